//! A fault for each row of a check.
pub(super) mod band;
pub(super) mod bodies;
pub(super) mod flip;
pub(super) mod pbf;
pub(super) mod shapes;
pub(super) mod tension;
pub(super) mod variants;
pub(super) mod walls;

use swell::gpu::adapter::InjectedFault;

/// A fault in one pass, and the rows that must fail first because of it.
pub struct Control {
    pub spoil: InjectedFault,
    pub pass: &'static str,
    pub fields: &'static [&'static str],
    /// Passes whose inputs the fault makes inconsistent, which may fail too.
    pub follow: &'static [&'static str],
}

impl Control {
    pub const fn and(self, follow: &'static [&'static str]) -> Self {
        Self { follow, ..self }
    }
}

pub const fn control(
    pass: &'static str,
    from: &'static str,
    to: &'static str,
    fails: &'static str,
    fields: &'static [&'static str],
) -> Control {
    Control {
        spoil: InjectedFault { pass, from, to },
        pass: fails,
        fields,
        follow: &[],
    }
}

/// A fault that its own pass's rows find.
pub const fn own(
    pass: &'static str,
    from: &'static str,
    to: &'static str,
    fields: &'static [&'static str],
) -> Control {
    control(pass, from, to, pass, fields)
}
