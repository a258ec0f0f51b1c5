//! Keys and checks of viscosity.

use swell_scene::{
    SceneError,
    effects::viscosity::{Settings, TOLERANCE},
};

use super::{Declared, Surroundings};
use crate::{declare::keys, document::Document};

keys! { fields of Settings {
    coefficient: Option<f64> = number(1e-6..=1e9)
        .unit("Pa s")
        .absent()
        .without(&["xsph"])
        .about(
            "μ, solved implicitly on FLIP's grid, or on that of PBF's projection; water \
             holds to solids, and to the walls of `domain.no_slip`",
        ),
    tolerance: Option<f64> = number(1e-6..=0.5)
        .computed(|| TOLERANCE.to_string())
        .with("coefficient")
        .about(
            "to which part of what it was a substep's solve brings the \
             error of the velocities",
        ),
    // Below a millionth, a frame of 32-bit velocities hardly changes.
    xsph: Option<f64> = number(1e-6..=1.0)
        .absent()
        .without(&["coefficient"])
        .about(
            "c, the part of the neighbours' mean relative velocity that a substep of PBF, \
             or a frame of FLIP, takes over",
        ),
} }

impl Declared for Settings {
    const ABOUT: &'static str = "viscosity: of so many Pa s (Batty and Bridson 2008), or XSPH's \
        (Schechter and Bridson 2012)";

    fn check(&self, doc: &Document<'_>, around: &Surroundings<'_>) -> Result<(), SceneError> {
        match (self.coefficient, self.xsph) {
            (None, None) => Err(doc.fault_of_plain(
                "effects.viscosity",
                "neither coefficient (Pa s) nor xsph is given; give one of them",
            )),
            (Some(_), _) if !around.has_projection => Err(doc.fault_of_plain(
                "effects.viscosity.coefficient",
                "it is solved on the grid of PBF's projection, which solver.pbf.grid_projection = \
                 false turns off: set it to true",
            )),
            _ => Ok(()),
        }
    }
}
