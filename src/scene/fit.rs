//! Whether boxes lie in the domain, as exactly as their files say where they are.

use glam::DVec3;

use swell_domain::bounds::Bounds;

/// Whether `inner` lies in the domain, up to the rounding of decimal fractions and, along each axis, of its file.
pub(super) fn fits(inner: &Bounds, domain: &Bounds, rounding: DVec3) -> bool {
    let most = rounding.max(DVec3::splat(1e-9 * domain.size().max_element()));
    let room = Bounds {
        min: domain.min - most,
        max: domain.max + most,
    };
    room.contains(inner.min) && room.contains(inner.max)
}

/// Whether more of `it` is in the domain than the rounding of its file.
pub(super) fn comes_into(it: &Bounds, domain: &Bounds, rounding: DVec3) -> bool {
    (it.min + rounding).cmplt(domain.max).all() && (it.max - rounding).cmpgt(domain.min).all()
}
