//! Signed distance.
