//! Particles at the same position, whose direction a hash decides.

use swell::{gpu::adapter::InjectedFault, scene::Method};

use super::{case, lines, over, run};
use crate::support::context;

/// Pairs within water, which are compared like all others: a coordinate of the
/// direction that is off by 2⁻¹¹, as WGSL allows sines, is seen, and so is another direction. PBF's
/// cap on corrections hides a wrong length.
#[test]
fn coincident_particles_are_within_tolerance_and_a_fault_in_their_direction_is_seen() {
    let context = context();
    for (method, pass, field) in [
        (Method::Flip, "flip/push_apart", "displacement"),
        (Method::Pbf, "pbf/compute_delta", "corrected position"),
    ] {
        let (scene, mut start) = case(method);
        let particles = &mut start.particles;
        for (from, to) in [(20, 21), (45, 200), (90, 12), (131, 132)] {
            particles.position[to] = particles.position[from];
            particles.velocity[to] = particles.velocity[from];
        }
        let clean = run(&context, &scene, &start);
        assert!(over(&clean).is_empty(), "{method:?}: {}", lines(&clean));
        let row = |table: &swell::check::CheckTable| {
            let mut rows = table.rows.iter();
            let row = rows.find(|row| (row.field.pass, row.field.name) == (pass, field));
            row.map(|row| (row.ties, row.worst.ratio)).unwrap()
        };
        assert_eq!(row(&clean).0, 0, "{method:?}: {}", lines(&clean));
        for (from, to) in [
            (
                "direction * (sign",
                "direction * vec3f(1.00048828, 1.0, 1.0) * (sign",
            ),
            ("direction * (sign", "(direction + 0.3) * (sign"),
        ] {
            let mut spoiled = context.clone();
            spoiled.spoil = Some(InjectedFault { pass, from, to });
            let found = run(&spoiled, &scene, &start);
            let is_seen = over(&found).contains(&(pass, field));
            println!("{method:?} {to}: {:?} after {:?}", row(&found), row(&clean));
            assert!(is_seen, "{method:?} {to}: {}", lines(&found));
        }
    }
}
