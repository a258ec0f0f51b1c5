// Floats a particle of `carried`: the grid's velocity at it, and the density correction's displacement.
#ifdef CORRECTION
const CARRIED = 6u;
#else
const CARRIED = 3u;
#endif
