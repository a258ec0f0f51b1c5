// Whether what is opaque and seen directly is left out of the picture, and cuts what stands behind it.
#ifdef HOLDOUT
const HOLDS_OUT: bool = true;
#else
const HOLDS_OUT: bool = false;
#endif
