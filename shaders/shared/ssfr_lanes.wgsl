// Threads that share the pixels of one particle: as many as the adapter runs in step. Others would wait for it, or repeat what all of
// them find out first.
#ifdef NARROW
const LANES: u32 = 8u;
#else
const LANES: u32 = 32u;
#endif
