// Which threads share the pixels of which particle, or block of water.

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

// The same where some rows take longer than others. A software adapter gives each of its threads as many groups in a row; of two threads
// each has every other group instead. Where a pass adds to few pixels at a time, as the thickness does, threads then wait for each other.
fn row_of_dealt_group(group: vec3u, groups: vec3u, thread: vec3u) -> u32 {
    var place = group.x + group.y * groups.x;
#ifdef NARROW
    let half = (groups.x * groups.y + 1u) / 2u;
    place = select(2u * (place - half) + 1u, 2u * place, place < half);
#endif
    return place * ROWS + thread.y;
}
