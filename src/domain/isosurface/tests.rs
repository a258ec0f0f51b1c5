use super::*;
use crate::level_set::kernels::Kernels;

const D: f64 = 0.1;

/// Lattice points where `is_water` holds, in a box of `size`.
fn lattice(size: DVec3, is_water: impl Fn(DVec3) -> bool) -> Vec<DVec3> {
    let count = (size / D).floor().to_array().map(|n| n as usize);
    let at = |k: usize| D * (k as f64 + 0.5);
    let mut all = Vec::new();
    for z in 0..count[2] {
        for y in 0..count[1] {
            for x in 0..count[0] {
                let p = DVec3::new(at(x), at(y), at(z));
                if is_water(p) {
                    all.push(p);
                }
            }
        }
    }
    all
}

/// Number of edges that are not shared by exactly two triangles.
fn torn(mesh: &TriangleMesh) -> usize {
    mesh.edges().values().filter(|uses| uses.len() != 2).count()
}

#[test]
fn a_pool_fills_its_box_up_to_its_level() {
    for size in [DVec3::new(2.0, 1.5, 1.0), DVec3::new(2.04, 1.5, 1.07)] {
        let level = 0.8;
        let scale = size / DVec3::new(2.0, 1.5, 1.0);
        let places: Vec<_> = lattice(DVec3::new(2.0, 1.5, 1.0), |p| p.y < level)
            .iter()
            .map(|&p| p * DVec3::new(scale.x, 1.0, scale.z))
            .collect();
        let found = extract(&LevelSet::new(&places, size, D), 0.0);
        let mesh = &found.mesh;
        assert_eq!((mesh.open_edges().len(), torn(mesh)), (0, 0));
        let volume = level * size.x * size.z;
        let ratio = mesh.signed_volume() / volume;
        assert!((ratio - 1.0).abs() < 0.01, "{size}: {ratio}");
        let bounds = mesh.bounds().unwrap();
        assert_eq!(
            (bounds.min, bounds.max.x, bounds.max.z),
            (DVec3::ZERO, size.x, size.z)
        );
        // Vertices in a side have its normal as their cap.
        let flat = mesh
            .vertices
            .iter()
            .zip(&found.caps)
            .filter(|(_, cap)| cap.y == -1.0);
        assert!(flat.clone().count() > 100 && flat.into_iter().all(|(v, _)| v.y == 0.0));
    }
}

#[test]
fn drops_sheets_and_noise_are_closed() {
    // A hash for noise, so that all arrangements of neighbours occur.
    let noise = |p: DVec3| {
        let h = (p.dot(DVec3::new(127.1, 311.7, 74.7)).sin() * 43758.5)
            .fract()
            .abs();
        h < 0.35
    };
    let size = DVec3::splat(2.0);
    let sheet = |p: DVec3| (p.y - 1.0).abs() < 0.06;
    let ball = |p: DVec3| (p - 1.0).length() < 0.7;
    let shapes: [&dyn Fn(DVec3) -> bool; 4] = [&noise, &sheet, &ball, &|_| true];
    for (k, shape) in shapes.into_iter().enumerate() {
        let places = lattice(size, shape);
        let mesh = extract(&LevelSet::new(&places, size, D), 0.0).mesh;
        assert!(
            !mesh.triangles.is_empty() && mesh.open_edges().is_empty(),
            "{k}"
        );
        assert!(mesh.signed_volume() > 0.0);
        // Negative control: one triangle less.
        let mut holed = mesh.clone();
        holed.triangles.pop();
        assert_eq!(holed.open_edges().len(), 3);
    }
    let none = extract(&LevelSet::new(&[], size, D), 0.0);
    assert!(none.mesh.triangles.is_empty());
}

#[test]
fn a_ball_has_its_vertices_on_the_field_and_no_needles() {
    let size = DVec3::splat(2.0);
    let places = lattice(size, |p| (p - 1.0).length() < 0.7);
    let kernels = Kernels::fit(&places, size, D);
    let mesh = extract(&LevelSet::of_kernels(&kernels, size, 0.5 * D), 0.0).mesh;
    let field = kernels.field();
    let off = |p: DVec3| field.value(p).abs() / field.gradient(p).length();
    let worst = mesh.vertices.iter().map(|&p| off(p)).fold(0.0, f64::max);
    // A voxel is half a spacing. The field curves over a kernel's half axis of about a spacing:
    // h²/8 times 1/d is 0.03 d.
    assert!(worst < 0.05 * D, "{worst}");
    let moved = mesh
        .vertices
        .iter()
        .map(|&p| off(p + 0.1 * D))
        .fold(0.0, f64::max);
    assert!(moved > 0.05 * D, "the control");
    assert_eq!(torn(&mesh), 0);
}

#[test]
fn another_value_gives_another_volume() {
    let size = DVec3::splat(2.0);
    let places = lattice(size, |p| (p - 1.0).length() < 0.7);
    let kernels = Kernels::fit(&places, size, D);
    let level = LevelSet::with_margin(&kernels, size, 0.5 * D, 0.5);
    let volume = |iso: f32| {
        let mesh = extract(&level, iso).mesh;
        assert_eq!(torn(&mesh), 0);
        mesh.signed_volume()
    };
    let [more, same, less] = [-0.45, 0.0, 0.45].map(volume);
    assert!(more > same && same > less, "{more} {same} {less}");
    // Without the margin, bricks hold values only near the surface of value 0; that surface is
    // the same.
    let plain = extract(&LevelSet::of_kernels(&kernels, size, 0.5 * D), 0.0);
    assert_eq!(plain, extract(&level, 0.0));
}
