// Threads that share the pixels of one particle: as many as the adapter runs in step. With more, an adapter of eight would compute the
// particle's bounds again for each further eight threads.
#ifdef NARROW
const LANES: u32 = 8u;
#else
const LANES: u32 = 32u;
#endif
