// Whether directly visible opaque geometry is a holdout: absent from the picture, but occluding
// what is behind it.
#ifdef HOLDOUT
const HOLDS_OUT: bool = true;
#else
const HOLDS_OUT: bool = false;
#endif
