//! States of the bodies as tables, `bodies/NAME.csv`: a row per frame, from the states in the
//! ledger's lines.

use super::manifest::Manifest;
use super::probes::{ProbeRecord, ProbeValues, Rows};
use super::stream::BODIES;
use swell_domain::body::BodyState;

/// Columns of a body's table: position of its centre of mass in world coordinates, rotation from
/// the pose at the start as a quaternion, velocity, and angular velocity.
const COLUMNS: [&str; 13] = [
    "x_m",
    "y_m",
    "z_m",
    "turn_x",
    "turn_y",
    "turn_z",
    "turn_w",
    "velocity_x_m/s",
    "velocity_y_m/s",
    "velocity_z_m/s",
    "spin_x_rad/s",
    "spin_y_rad/s",
    "spin_z_rad/s",
];

/// Makes the records of bodies with these names, in the order of their states. Names become file
/// names, and equal ones get a number.
pub fn body_records(names: impl IntoIterator<Item = String>) -> Vec<ProbeRecord> {
    let mut records: Vec<ProbeRecord> = Vec::new();
    for name in names {
        let allowed = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
        let name: String = (name.chars())
            .map(|c| if allowed(c) { c } else { '_' })
            .collect();
        let name = match name.starts_with(['.', '-']) || name.is_empty() {
            true => format!("body{name}"),
            false => name,
        };
        let is_taken = |wanted: &str| {
            let mut taken = records.iter();
            taken.any(|record| record.name.eq_ignore_ascii_case(wanted))
        };
        let numbered = (2u32..).map(|k| format!("{name}-{k}"));
        let free = std::iter::once(name.clone()).chain(numbered);
        let name = free.into_iter().find(|wanted| !is_taken(wanted));
        records.push(ProbeRecord {
            name: name.unwrap_or_default(),
            kind: "body".to_owned(),
            columns: COLUMNS.map(str::to_owned).to_vec(),
            ..ProbeRecord::default()
        });
    }
    records
}

/// Adds the rows of the bodies, where the manifest declares any. Returns whether there were such
/// rows already.
pub(super) fn add_rows(manifest: &Manifest, bodies: &[BodyState], rows: &mut Rows) -> bool {
    if manifest.bodies.is_empty() {
        return false;
    }
    let origin = manifest.origin;
    let row = |state: &BodyState| {
        let centre = state.centre.to_array();
        let world = [0, 1, 2].map(|axis| centre[axis] + origin[axis]);
        let turn = state.turn.to_array();
        let [velocity, spin] = [state.velocity, state.spin].map(|v| v.to_array());
        let all = [&world[..], &turn, &velocity, &spin].concat();
        all.into_iter().map(Some).collect()
    };
    let values: ProbeValues = bodies.iter().map(row).collect();
    rows.insert(BODIES.to_owned(), values).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_bodies_are_file_names_and_differ() {
        let names = ["crate", "Crate", "a b", "a/b", ".x", "", "crate"];
        let found = body_records(names.map(str::to_owned));
        let found: Vec<_> = found.iter().map(|record| &*record.name).collect();
        assert_eq!(
            found,
            [
                "crate", "Crate-2", "a_b", "a_b-2", "body.x", "body", "crate-3"
            ]
        );
        assert!(ProbeRecord::check_all(&body_records(names.map(str::to_owned)), "body").is_ok());
    }
}
