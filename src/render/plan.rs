//! Which passes a look calls for. What it does not name is neither built nor run.

use crate::scene::look::{AovSpec, FilterSpec, Look};

/// Names of the passes that a frame takes, sorted; `has_solids` is whether anything opaque stands in the scene
/// or the look.
pub fn passes(look: &Look, has_solids: bool) -> Vec<&'static str> {
    let spec = look.spec();
    let mut names = vec![
        "ssfr/fill",
        "ssfr/splat_depth",
        "ssfr/splat_thickness",
        "ssfr/shade",
    ];
    match spec.surface.filter {
        FilterSpec::CurvatureFlow => names.extend([
            "ssfr/flow_restrict",
            "ssfr/curvature_flow",
            "ssfr/flow_prolong",
        ]),
        FilterSpec::NarrowRange => names.push("ssfr/narrow_range"),
    }
    if has_solids {
        names.extend(["ssfr/solid", "ssfr/shadow"]);
    }
    if spec.water.spray.is_some() {
        names.push("ssfr/splat_spray");
    }
    if !spec.output.aovs.is_empty() {
        names.push("ssfr/shade_aovs");
    }
    if look.wants(AovSpec::Forward) {
        names.push("ssfr/splat_owner");
    }
    names.sort_unstable();
    names
}
