// Floats a particle of `carried`: the grid's velocity at it, and where particles are pushed, what they are displaced by.
#ifdef PUSHED
const CARRIED = 6u;
#else
const CARRIED = 3u;
#endif
