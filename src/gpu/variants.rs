//! All variants in which the shipped passes can be composed, for tests that cover them all.

use std::collections::BTreeSet;

use super::{error::GpuError, shader};

/// Combinations of conditions that a plan can set; every pass must compose under each.
const VARIANTS: [&[&str]; 97] = [
    &[],
    &["SOLIDS"],
    &["BAND"],
    &[
        "BAND",
        "CORRECTION",
        "PUSHED",
        "PERIODIC",
        "GHOST_FLUID",
        "SOLIDS",
    ],
    &["NEIGHBOR_LIST"],
    &["NEIGHBOR_LIST", "PLACES"],
    &[
        "NEIGHBOR_LIST",
        "PLACES",
        "SOLIDS",
        "DENSITY",
        "ARTIFICIAL_PRESSURE",
    ],
    &["SOLIDS", "DENSITY", "ARTIFICIAL_PRESSURE"],
    &["NEIGHBOR_LIST", "SOLIDS", "PRESSURE"],
    &["PROJECTED", "SOLIDS"],
    &["WALL_WORK"],
    &["WALL_WORK", "SOLIDS", "MOVING_SOLIDS"],
    &["WALL_WORK", "SOLIDS", "MOVING_SOLIDS", "SHAPES"],
    &[
        "SOLIDS",
        "MOVING_SOLIDS",
        "SHAPES",
        "CORRECTION",
        "PUSHED",
        "GHOST_FLUID",
    ],
    &["CONTRACTS"],
    &[
        "SOLIDS",
        "MOVING_SOLIDS",
        "SHAPES",
        "BODIES",
        "APIC",
        "CONTRACTS",
    ],
    &[
        "PAGED",
        "PROJECTED",
        "NEIGHBOR_LIST",
        "PLACES",
        "SOLIDS",
        "MOVING_SOLIDS",
        "WALL_WORK",
        "DENSITY",
        "PRESSURE",
    ],
    &["PAGED"],
    &["NEIGHBOR_EFFECTS"],
    &["NEIGHBOR_EFFECTS", "PAGED", "PROJECTED"],
    &["PAGED", "PROJECTED", "NEIGHBOR_LIST", "PLACES", "SOLIDS"],
    &["PAGED", "CHEBYSHEV", "NEIGHBOR_LIST"],
    &["CORRECTION", "PUSHED", "GHOST_FLUID"],
    &["CORRECTION", "PUSHED", "GHOST_FLUID", "PLACES"],
    &["SOLIDS", "CORRECTION", "PUSHED", "GHOST_FLUID", "APIC"],
    &[
        "SOLIDS",
        "MOVING_SOLIDS",
        "CORRECTION",
        "PUSHED",
        "GHOST_FLUID",
    ],
    &[
        "SOLIDS",
        "MOVING_SOLIDS",
        "BODIES",
        "CORRECTION",
        "PUSHED",
        "GHOST_FLUID",
    ],
    &["SOLIDS", "MOVING_SOLIDS", "BODIES", "F64"],
    &["GHOST_FLUID", "DIAGONAL"],
    &["GHOST_FLUID", "DIAGONAL", "TWO_WORDS"],
    &["TWO_WORDS"],
    &["GHOST_FLUID", "DIAGONAL", "F64"],
    &["F64"],
    &["MULTIGRID"],
    &["MULTIGRID", "TWO_WORDS"],
    &["MULTIGRID", "F64"],
    &["PERIODIC"],
    &[
        "PERIODIC",
        "SOLIDS",
        "NEIGHBOR_LIST",
        "CORRECTION",
        "PUSHED",
        "GHOST_FLUID",
    ],
    &[
        "PERIODIC",
        "SOLIDS",
        "MOVING_SOLIDS",
        "CORRECTION",
        "PUSHED",
        "APIC",
    ],
    &["PERIODIC", "F64"],
    &["FORCE_MESHES"],
    &["FORCES"],
    &["FORCES", "FORCE_MESHES", "PERIODIC", "SOLIDS"],
    &["FORCES", "SOLIDS", "MOVING_SOLIDS", "SHAPES"],
    &["SPRAY"],
    &["AOVS"],
    &["FORWARD"],
    &["HOLDOUT"],
    &["LIGHTS"],
    &["RIPPLES"],
    &["WINDOWS"],
    &["WINDOWS", "PALETTE", "INDEXED", "MATERIALS"],
    &["RIPPLES", "WINDOWS", "SEA", "CAUSTICS", "LIGHTS"],
    &["LISTED", "DRY", "RIPPLES", "WINDOWS"],
    &["LIGHTS", "SPRAY", "HOLDOUT"],
    &["OBJECTS"],
    &["OBJECTS", "SPRAY"],
    &["SEA"],
    &["SEA", "AOVS", "FORWARD"],
    &["SEA", "PALETTE", "SPRAY", "LIGHTS"],
    &["SEA", "PALETTE", "SPRAY", "OBJECTS"],
    &["PALETTE"],
    &["PATHS"],
    &["PATHS", "MOTION"],
    &["AOVS", "SPRAY"],
    &["FORWARD", "SPRAY"],
    &["ELLIPSOIDS"],
    &["INDEXED", "MATERIALS"],
    &["INDEXED", "MATERIALS", "PALETTE", "SEA", "SPRAY", "LIGHTS"],
    &["INDEXED", "MATERIALS", "SEA", "SPRAY", "OBJECTS"],
    &["INDEXED", "MATERIALS", "SEA", "SPRAY", "AOVS", "FORWARD"],
    &["AOVS", "CARRIED"],
    &[
        "INDEXED",
        "MATERIALS",
        "SEA",
        "SPRAY",
        "AOVS",
        "FORWARD",
        "CARRIED",
    ],
    &["SHUTTER"],
    &["SHUTTER", "PATHS", "FOAM"],
    &["SHUTTER", "SEA", "SPRAY", "FORWARD", "CARRIED", "CAUSTICS"],
    &[
        "SHUTTER",
        "INDEXED",
        "WET",
        "MATERIALS",
        "SEA",
        "PALETTE",
        "VOLUME",
        "FOAM_LAYER",
        "LIGHTS",
        "CAUSTICS",
    ],
    &["VOLUME"],
    &["VOLUME", "LIGHTS", "HOLDOUT"],
    &["INDEXED", "MATERIALS", "SEA", "PALETTE", "VOLUME", "LIGHTS"],
    &["FOAM"],
    &["LIGHTS", "SPRAY", "FOAM"],
    &[
        "INDEXED",
        "MATERIALS",
        "SEA",
        "PALETTE",
        "VOLUME",
        "LIGHTS",
        "FOAM",
    ],
    &["CAUSTICS", "LIGHTS"],
    &["CAUSTICS", "SEA", "PALETTE", "SPRAY", "LIGHTS"],
    &["INDEXED"],
    &["INDEXED", "WET"],
    &[
        "INDEXED", "WET", "LISTED", "DRY", "PALETTE", "SPRAY", "LIGHTS",
    ],
    &[
        "INDEXED",
        "WET",
        "MATERIALS",
        "SEA",
        "SPRAY",
        "AOVS",
        "FORWARD",
    ],
    &[
        "INDEXED",
        "WET",
        "MATERIALS",
        "SEA",
        "PALETTE",
        "VOLUME",
        "LIGHTS",
        "CAUSTICS",
    ],
    &["LISTED"],
    &["LISTED", "DRY"],
    &["LISTED", "DRY", "BARE"],
    &["NARROW"],
    &["NARROW", "PAGED", "ELLIPSOIDS"],
    &[
        "LISTED",
        "INDEXED",
        "MATERIALS",
        "PALETTE",
        "SPRAY",
        "LIGHTS",
    ],
    &[
        "LISTED",
        "DRY",
        "INDEXED",
        "MATERIALS",
        "PALETTE",
        "SPRAY",
        "LIGHTS",
    ],
];

fn is_of_bodies(pass: &str) -> bool {
    ["flip/couple_bodies", "flip/carry_bodies"].contains(&pass)
}

/// Whether a pass has a form for an open shutter: those of rays, and splats of what flies.
fn has_shutter(pass: &str) -> bool {
    let splats = ["ssfr/splat_spray", "ssfr/splat_whitewater"];
    pass.starts_with("rays/") || splats.iter().any(|splat| pass.starts_with(splat))
}

/// `neighbor_list` holds lists, so build_neighbors has no variant without them; bodies are solids
/// that move; and only ray tracing passes render a volume.
fn is_meaningful(pass: &str, defines: &[&str]) -> bool {
    let has_lists = pass != "pbf/build_neighbors" || defines.contains(&"NEIGHBOR_LIST");
    let has_bodies = !is_of_bodies(pass) || defines.contains(&"BODIES");
    let has_shutter = !defines.contains(&"SHUTTER") || has_shutter(pass);
    has_lists
        && has_bodies
        && has_shutter
        && (pass.starts_with("rays/") || !defines.contains(&"VOLUME"))
}

/// A pass under conditions that change its text.
#[derive(Clone, Debug)]
pub struct Form {
    /// Pass name.
    pub pass: String,
    /// Names for which `#ifdef` holds.
    pub defines: &'static [&'static str],
    /// Composed WGSL.
    pub text: String,
}

/// Composes all distinct variants of all passes.
///
/// # Errors
/// [`GpuError::Shader`] for a shader that does not compose.
pub fn forms() -> Result<Vec<Form>, GpuError> {
    let mut forms = Vec::new();
    for pass in shader::pass_files() {
        let mut seen = BTreeSet::new();
        for defines in VARIANTS.into_iter().filter(|it| is_meaningful(&pass, it)) {
            let text = shader::compose(&pass, defines)?;
            if seen.insert(text.clone()) {
                let pass = pass.clone();
                forms.push(Form {
                    pass,
                    defines,
                    text,
                });
            }
        }
    }
    Ok(forms)
}

#[cfg(test)]
mod tests {
    use super::{
        super::{
            bindings::{MOST_STORAGE_BUFFERS, storage_buffers},
            reflect::{Stage, reflect},
        },
        *,
    };

    /// Arguments of sines and cosines that are not known to be within half a turn.
    fn unbounded_angles(text: &str) -> Vec<&str> {
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let arguments = ["sin(", "cos("].into_iter().flat_map(|call| {
            text.match_indices(call).filter_map(move |(at, _)| {
                let is_call = !text[..at].ends_with(is_word);
                let rest = &text[at + call.len()..];
                is_call.then(|| rest.split(')').next().unwrap_or(rest))
            })
        });
        let angles = text.lines().filter_map(|line| {
            let value = line.trim().strip_prefix("let angle = ")?;
            (!value.starts_with("angle_of(") && !value.starts_with("line_angle(")).then_some(value)
        });
        // Directions of ripples are within ± 80°, and operands of measure/rounding within half a
        // turn.
        let arguments = arguments.filter(|it| !["angle", "turn", "operands.w"].contains(it));
        arguments.chain(angles).collect()
    }

    /// Devices need not have sines beyond half a turn.
    #[test]
    fn sines_take_angles_within_half_a_turn() {
        let mut count = 0;
        for form in forms().expect("they compose") {
            let found = unbounded_angles(&form.text);
            assert!(
                found.is_empty(),
                "{} {:?}: {found:?}",
                form.pass,
                form.defines
            );
            count += form.text.matches("cos(angle)").count();
        }
        assert!(count > 10, "{count}");
        let faults = unbounded_angles("let angle = k * x;\nlet y = 2.0 * cos(k * x) + acos(z);");
        assert_eq!(faults, ["k * x", "k * x;"]);
    }

    /// Names after `#ifdef` and `#ifndef` in the lines of a shader.
    fn conditions(text: &str) -> impl Iterator<Item = &str> {
        let asked = |line: &'_ str| line.starts_with("#ifdef") || line.starts_with("#ifndef");
        let lines = text.lines().map(str::trim).filter(move |line| asked(line));
        lines.filter_map(|line| line.split_whitespace().nth(1))
    }

    #[test]
    fn every_condition_of_a_shader_is_in_a_variant() {
        let known: BTreeSet<&str> = VARIANTS.into_iter().flatten().copied().collect();
        let asked: BTreeSet<&str> = shader::shipped_texts().flat_map(conditions).collect();
        assert!(asked.len() > 30, "{asked:?}");
        let unknown: Vec<_> = asked.difference(&known).collect();
        assert!(unknown.is_empty(), "{unknown:?} are in no variant");
        let unused: Vec<_> = known.difference(&asked).collect();
        assert!(unused.is_empty(), "{unused:?} are in no shader");
    }

    #[test]
    fn every_pass_validates_in_every_variant() {
        let passes = shader::pass_files().len();
        let forms = forms().expect("they compose");
        let mut most = 0;
        assert!(passes >= 30 && forms.len() > 2 * passes, "{}", forms.len());
        for Form {
            pass,
            defines,
            text,
        } in &forms
        {
            let reflection =
                reflect(pass, text).unwrap_or_else(|error| panic!("{pass} {defines:?}: {error}"));
            // Only the projection, and the passes that share sums over bodies with it, may require
            // f64, and only when told to.
            let of_projection = pass.starts_with("pressure/") || is_of_bodies(pass);
            let is_wide = of_projection && defines.contains(&"F64");
            assert!(is_wide || !reflection.has_f64, "{pass} {defines:?}");
            let size = reflection.workgroup_size;
            let is_drawing = pass.starts_with("ssfr/") || pass.starts_with("rays/");
            let is_known = match (is_drawing, reflection.stage) {
                (true, Stage::Raster { .. }) => true,
                (true, Stage::Compute) => {
                    [[64, 1, 1], [32, 8, 1], [16, 4, 1], [8, 8, 1]].contains(&size)
                }
                (false, stage) => {
                    stage == Stage::Compute && [[64, 1, 1], [256, 1, 1]].contains(&size)
                }
            };
            assert!(is_known, "{pass}: {size:?}");
            let bindings = &reflection.bindings;
            let storage = storage_buffers(bindings);
            most = most.max(storage);
            assert!(
                storage <= MOST_STORAGE_BUFFERS,
                "{pass} {defines:?}: {storage} storage buffers"
            );
            let mut indices: Vec<u32> = bindings.iter().map(|it| it.index).collect();
            indices.dedup();
            assert_eq!(
                indices.len(),
                bindings.len(),
                "{pass}: a binding index twice"
            );
        }
        assert_eq!(most, MOST_STORAGE_BUFFERS);
        // Negative control: an undeclared type.
        let text = shader::compose("pbf/predict", &[]).expect("it composes");
        assert!(reflect("pbf/predict", &text).is_ok());
        let spoiled = format!("{text}\nfn spoiled(x: Nothing) {{}}\n");
        assert!(reflect("pbf/predict", &spoiled).is_err());
    }
}
