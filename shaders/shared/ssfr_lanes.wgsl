// Which threads share the pixels of which particle.

// Threads of one particle: as many as the adapter runs in step. With more, an adapter of eight would compute the particle's bounds
// again for each further eight threads.
#ifdef NARROW
const LANES: u32 = 8u;
#else
const LANES: u32 = 32u;
#endif
// Particles of a workgroup: one alone costs a software adapter as much to begin as a distant particle's pixels.
const ROWS: u32 = 8u;

// Which particle of the dispatch a thread works on.
fn row_of_group(group: vec3u, groups: vec3u, thread: vec3u) -> u32 {
    return (group.x + group.y * groups.x) * ROWS + thread.y;
}
