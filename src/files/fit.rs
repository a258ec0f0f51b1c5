//! Containment of boxes in the domain, up to the precision of their files.

use glam::DVec3;

use swell_domain::bounds::Bounds;

/// Whether `inner` is in the domain, up to the rounding of decimal fractions and, along each
/// axis, of its file.
pub(super) fn fits(inner: &Bounds, domain: &Bounds, rounding: DVec3) -> bool {
    let most = rounding.max(DVec3::splat(1e-9 * domain.size().max_element()));
    let room = Bounds {
        min: domain.min - most,
        max: domain.max + most,
    };
    room.contains(inner.min) && room.contains(inner.max)
}

/// Whether more of `it` than the rounding of its file is in the domain.
pub(super) fn comes_into(it: &Bounds, domain: &Bounds, rounding: DVec3) -> bool {
    (it.min + rounding).cmplt(domain.max).all() && (it.max - rounding).cmpgt(domain.min).all()
}
