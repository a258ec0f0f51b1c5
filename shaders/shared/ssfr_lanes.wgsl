// Assignment of threads to particles or blocks of water, whose pixels they share.

// Threads per particle: the adapter's subgroup size. With more, an adapter of eight lanes would
// compute the particle's bounds again for every further eight threads.
#ifdef NARROW
const LANES: u32 = 8u;
#else
const LANES: u32 = 32u;
#endif
// Particles per workgroup: with only one, starting it costs a software adapter as much as a distant
// particle's pixels.
const ROWS: u32 = 8u;

// Index in the dispatch of the particle that a thread processes.
fn row_of_group(group: vec3u, groups: vec3u, thread: vec3u) -> u32 {
    return (group.x + group.y * groups.x) * ROWS + thread.y;
}

// The same for passes in which some rows take longer. A software adapter gives each of its threads
// a contiguous run of workgroups; this interleaves them between two threads. Passes that add to few
// pixels at a time, such as the thickness, would then contend for the same pixels.
fn row_of_dealt_group(group: vec3u, groups: vec3u, thread: vec3u) -> u32 {
    var place = group.x + group.y * groups.x;
#ifdef NARROW
    let half = (groups.x * groups.y + 1u) / 2u;
    place = select(2u * (place - half) + 1u, 2u * place, place < half);
#endif
    return place * ROWS + thread.y;
}
