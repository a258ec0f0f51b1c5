//! Bodies that float, sink and turn with the water, by both solvers, on the GPU and in f64.

use std::path::Path;

use glam::DVec3;
use swell::{
    domain::body::BodyState,
    files::parse_scene,
    gpu::adapter::Context,
    scene::Scene,
    stage::{device::Opened, drive::Drive, prepare::Start},
};

use crate::support::{context, device::spoiled};

/// Cell size, metres.
const DX: f64 = 0.05;

/// Water 0.6 m deep in a tank 1 m wide and long, with this `[[body]]`.
fn scene(body: &str, set: &[&str]) -> Scene {
    let folder = if body.contains("assets/") {
        "scenes"
    } else {
        "tests/hard_cases"
    };
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let text = format!(
        "[shot]\nname = \"float\"\nframes = 48\nframes_per_second = 24\n\
         [domain]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\n\
         [[water.block]]\nmin = [0, 0, 0]\nmax = [1, 0.6, 1]\n\
         [[body]]\n{body}\n\
         [solver]\nmethod = \"flip\"\n[solver.flip]\ncell_size = {DX}\n\
         [solver.pbf]\nparticle_spacing = {}\n",
        0.5 * DX
    );
    let set: Vec<String> = set.iter().map(|&it| it.to_owned()).collect();
    parse_scene(&text, Path::new("float.toml"), &scenes, &set).unwrap()
}

/// The bodies after each of the first `frames` frames.
fn run(opened: &Opened, scene: &Scene, frames: u32) -> Vec<Vec<BodyState>> {
    let start = Start::of(scene).unwrap();
    let mut drive = Drive::new(opened, scene, &start, false).unwrap();
    let states = (0..frames).map(|_| drive.advance().unwrap().particles.bodies);
    states.collect()
}

fn gpu(context: &Context) -> Opened {
    Opened::Gpu(Box::new(context.clone()))
}

/// A flat box of 0.4 m by 0.4 m, 0.2 m high, released at its draft.
fn raft(density: f64, more: &str) -> String {
    let bottom = 0.6 - 0.2e-3 * density;
    format!(
        "mesh = \"cube.obj\"\nscale = [0.4, 0.2, 0.4]\ntranslate = [0.3, {bottom}, 0.3]\n\
         density = {density}\n{more}"
    )
}

/// Archimedes: a raft floats at its draft, to a tenth of a cell, and lies still.
#[test]
fn a_raft_floats_at_its_draft_and_rests() {
    let context = context();
    for (density, set) in [
        (100.0, &[][..]),
        (500.0, &[]),
        (900.0, &[]),
        (500.0, &["solver.method=\"pbf\""]),
    ] {
        let scene = scene(&raft(density, ""), set);
        let states = run(&gpu(&context), &scene, 60);
        let late = &states[36..];
        let mean = late.iter().map(|b| b[0].centre.y).sum::<f64>() / late.len() as f64;
        let draft = 0.6 - 0.2e-3 * density + 0.1;
        let speed = late
            .iter()
            .map(|b| b[0].velocity.length())
            .fold(0.0, f64::max);
        let spin = late.iter().map(|b| b[0].spin.length()).fold(0.0, f64::max);
        println!(
            "{density} {set:?}: {:.4} off, {speed:.3} m/s, {spin:.3} rad/s",
            mean - draft
        );
        assert!((mean - draft).abs() < 0.1 * DX, "{density}: {mean} {draft}");
        assert!(
            speed < 0.08 && spin < 0.2,
            "{density}: {speed} m/s, {spin} rad/s"
        );
    }
}

/// Where planes cut off its edges, it floats deeper by more than the tenth of a cell.
#[test]
fn without_an_offset_a_raft_floats_too_deep() {
    let context = context();
    let without = spoiled("flip/couple_bodies", "let offset = ", "let offset = 0.0 * ");
    let [with, without] = [&context, &without].map(|context| {
        let states = run(&gpu(context), &scene(&raft(900.0, ""), &[]), 60);
        let late = &states[36..];
        late.iter().map(|b| b[0].centre.y).sum::<f64>() / late.len() as f64
    });
    assert!(with - without > 0.1 * DX, "{with} {without}");
}

/// Without the weight of the water between cells' centres and its bottom, it bobs and rolls.
#[test]
fn without_the_weight_within_cells_a_raft_does_not_rest() {
    let context = spoiled(
        "flip/couple_bodies",
        "let is_alone = ",
        "let is_alone = false && ",
    );
    let states = run(&gpu(&context), &scene(&raft(500.0, ""), &[]), 60);
    let late = states[36..].iter();
    let unrest = late.map(|b| b[0].velocity.length() + 0.2 * b[0].spin.length());
    let unrest = unrest.fold(0.0, f64::max);
    assert!(unrest > 0.07, "{unrest}");
}

/// A ball of radius 0.15 m deep in water 1 m deep.
fn deep(density: f64) -> Scene {
    let body = format!(
        "mesh = \"assets/drop.obj\"\nscale = 0.15\ntranslate = [0.5, 0.5, 0.5]\ndensity = {density}\n"
    );
    let set = [
        "domain.max=[1,1.2,1]",
        "water.block=[{min=[0,0,0],max=[1,1,1]}]",
        "shot.frames_per_second=120",
        "solver.flip.cell_size=0.025",
    ];
    scene(&body, &set)
}

/// Released under water a ball begins with (m − m_w) g / (m + m_a), m_a = m_w / 2 in unbounded
/// water; walls 3.3 radii from its middle add some percent to m_a.
#[test]
fn a_ball_begins_to_sink_or_rise_with_its_added_mass() {
    let context = context();
    for (density, gate) in [(7000.0, 0.01), (500.0, 0.06), (10.0, 0.06)] {
        let states = run(&gpu(&context), &deep(density), 1);
        let found = 120.0 * states[0][0].velocity.y;
        let relative = density / 1000.0;
        let exact = -(relative - 1.0) * 9.81 / (relative + 0.5);
        println!("{density}: {found:.3} m/s², {exact:.3} in unbounded water");
        assert!(
            (found / exact - 1.0).abs() < gate,
            "{density}: {found} {exact}"
        );
    }
    // Negative control: without its reaction on the pressure, a light ball shoots away.
    let context = spoiled(
        "pressure/couple",
        "let added = select(0.0, body_flux",
        "let added = 0.5 * select(0.0, body_flux",
    );
    let states = run(&gpu(&context), &deep(10.0), 1);
    let found = 120.0 * states[0][0].velocity.y;
    assert!((found / 19.04 - 1.0).abs() > 0.06, "{found}");
}

/// Both solve the same system: the GPU to its tolerance, the reference to rounding.
#[test]
fn the_gpu_moves_bodies_as_the_reference_does() {
    let context = context();
    let body = raft(300.0, "rotate_degrees = [10, 20, 5]\nspin = [0, 40, 0]\n");
    for (precision, method) in [
        ("f32", "flip"),
        ("f32_refined", "flip"),
        ("f32_refined", "pbf"),
    ] {
        let set = format!("solver.flip.pressure.precision=\"{precision}\"");
        let method = format!("solver.method=\"{method}\"");
        let scene = scene(
            &body,
            &[&set, &method, "solver.flip.pressure.tolerance=1e-6"],
        );
        let [found, exact] = [gpu(&context), Opened::Cpu].map(|on| run(&on, &scene, 3));
        for (found, exact) in found.iter().zip(&exact) {
            let apart = found[0].velocity - exact[0].velocity;
            let turned = found[0].spin - exact[0].spin;
            // Three impulses of up to 0.4 m/s, each known to the solve's tolerance over the least
            // eigenvalue of the water's modes, (π / 24 cells)² = 0.017: 3 × 0.4 × 1e-6 / 0.017 =
            // 7e-5 m/s; twice that, and ten times over 0.1 m of arm for the turn.
            assert!(apart.length() < 1.5e-4, "{precision}: {apart}");
            assert!(turned.length() < 1.5e-3, "{precision}: {turned}");
        }
    }
}

/// A solid whose faces lie on those of cells, elsewhere in the water, is no part of a body: a crate at
/// its draft lies still, on the GPU and in f64. With the distances to all solids in place of those to
/// the body, it turned at 0.04 rad/s in f64.
#[test]
fn a_solid_on_the_faces_of_cells_is_no_part_of_a_body() {
    let context = context();
    let crates = "mesh = \"assets/crate.obj\"\nscale = 0.3\ntranslate = [0.6, 0.6, 0.6]\n\
                  density = 500.0\n\
                  [[solid]]\nmesh = \"assets/crate.obj\"\nscale = 0.2\n\
                  translate = [0.2, 0.2, 0.2]\n";
    let scene = scene(crates, &[]);
    for on in [gpu(&context), Opened::Cpu] {
        let states = run(&on, &scene, 6);
        let last = states.last().unwrap()[0];
        assert!(last.spin.length() < 0.005, "{last:?}");
    }
}

/// Largest speed of the water, and largest density error, in each of the frames from 24 to 48 of a
/// heavy box that lies on the floor.
fn beside_a_box_on_the_floor(context: &Context, set: &[&str]) -> [f64; 2] {
    let body =
        "mesh = \"cube.obj\"\nscale = 0.25\ntranslate = [0.4, 0.001, 0.3]\ndensity = 3000.0\n";
    let scene = scene(body, &[set, &["budget.density_error_max=1e3"]].concat());
    let start = Start::of(&scene).unwrap();
    let mut drive = Drive::new(&gpu(context), &scene, &start, false).unwrap();
    let reports = (0..48).map(|_| drive.advance().unwrap().report);
    reports.skip(23).fold([0.0; 2], |[speed, density], report| {
        [
            speed.max(report.max_speed),
            density.max(report.density_error_max),
        ]
    })
}

/// The floor bears what the water does not: the projection that follows contacts lets the water know
/// of it.
#[test]
fn water_beside_a_box_on_the_floor_rests() {
    for set in [&[][..], &["solver.method=\"pbf\""]] {
        let [speed, density] = beside_a_box_on_the_floor(&context(), set);
        println!("{set:?}: {speed:.3} m/s, density error {density:.2}");
        assert!(speed < 0.1 && density < 0.5, "{set:?}: {speed} {density}");
    }
    // Negative control: without it, the water takes the box to sink by its weight in each substep.
    let context = spoiled(
        "pressure/carry_flux",
        "solid_flux[CELLS * found.x + inner] += f32(sum);",
        "solid_flux[CELLS * found.x + inner] += select(f32(sum), 0.0, phase.step == 3u);",
    );
    let [speed, _] = beside_a_box_on_the_floor(&context, &[]);
    assert!(speed > 0.3, "{speed}");
}

/// Bodies 1 000 times lighter and 20 times heavier than water, one that is hinged and one that is
/// moored, in the same water: nothing flies.
#[test]
fn light_heavy_hinged_and_moored_bodies_stay_bounded() {
    let context = context();
    let one = |scale: &str, at: &str, more: &str| {
        format!("mesh = \"assets/crate.obj\"\nscale = {scale}\ntranslate = {at}\n{more}\n")
    };
    let bodies = [
        one("[0.2, 0.2, 0.2]", "[0.25, 0.3, 0.25]", "density = 1.0"),
        one(
            "[0.15, 0.15, 0.15]",
            "[0.75, 0.5, 0.25]",
            "density = 20000.0",
        ),
        one(
            "[0.3, 0.3, 0.1]",
            "[0.3, 0.5, 0.75]",
            "density = 300.0\nhinge = { at = [0.15, 0.35, 0.75], axis = [0, 0, 1] }",
        ),
        one(
            "[0.2, 0.1, 0.2]",
            "[0.75, 0.3, 0.7]",
            "density = 200.0\nmooring = [{ anchor = [0.75, 0, 0.7], at = [0.75, 0.25, 0.7], \
             length = 0.25, stiffness = 1e5, damping = 50 }]",
        ),
    ];
    let scene = scene(&bodies.join("[[body]]\n"), &[]);
    let states = run(&gpu(&context), &scene, 48);
    // The light one rises with 2 g at first, and nothing can fall faster than from the top.
    let fastest = states.iter().flatten().map(|b| b.velocity.length());
    let fastest = fastest.fold(0.0, f64::max);
    assert!(fastest < (2.0 * 9.81 * 1.0f64).sqrt(), "{fastest}");
    let last = &states[47];
    // It swims on the water, 0.6 m deep, on a face or up to a corner: its middle is 0.1 m to
    // 0.173 m up, and waves of 0.03 m pass. The hinge and the rope hold.
    assert!((0.67..0.803).contains(&last[0].centre.y), "{:?}", last[0]);
    let hinge = DVec3::new(0.15, 0.35, 0.75);
    let door = scene.bodies().nth(2).unwrap();
    let at = door.body.pose(&last[2]).place(hinge);
    assert!((at - hinge).length() < 1e-9, "{at}");
    let rope = scene.bodies().nth(3).unwrap().body.pose(&last[3]);
    let taut = rope
        .place(DVec3::new(0.75, 0.25, 0.7))
        .distance(DVec3::new(0.75, 0.0, 0.7));
    // 31 N of buoyancy stretch it by 0.3 mm, and waves pull some times as much.
    assert!((taut - 0.25).abs() < 2e-3, "{taut}");
}

/// In a domain without a particle a body falls by ½ g t², lands and rests, by both solvers, and no
/// bit but the time's differs between GPU and f64, since the device computes nothing.
#[test]
fn a_body_falls_where_there_is_no_water() {
    let context = context();
    let body = "mesh = \"cube.obj\"\nscale = 0.2\ntranslate = [0.4, 0.5, 0.4]\ndensity = 500\n";
    for method in ["flip", "pbf"] {
        let set = format!("solver.method=\"{method}\"");
        let mut scene = scene(body, &[&set, "water.block=[]"]);
        let least = |states: &[BodyState]| states[0].centre.y - 0.1;
        let all = [gpu(&context), Opened::Cpu].map(|on| run(&on, &scene, 24));
        let bits = |k: usize| {
            let states = all[k].iter().map(|states| BodyState {
                time: 0.0,
                ..states[0]
            });
            states.collect::<Vec<_>>()
        };
        assert_eq!(bits(0), bits(1), "{method}");
        for states in &all {
            let time = 5.0 / 24.0;
            // The start counts as the end of a substep: the first one, a frame at most, adds g Δt / 2.
            let (fallen, free) = (0.5 - least(&states[4]), 0.5 * 9.81 * time * time);
            let most = free + 0.5 * 9.81 / 24.0 * time;
            assert!((free..most + 1e-9).contains(&fallen), "{method}: {fallen}");
            let last = &states[23];
            assert!(least(last).abs() < 1e-3, "{method}: {last:?}");
            assert!(last[0].velocity.length() < 1e-3, "{method}: {last:?}");
        }
        // Negative control: without gravity it stays.
        scene.water.gravity = DVec3::ZERO;
        assert_eq!(least(&run(&Opened::Cpu, &scene, 2)[1]), 0.5);
    }
}

/// A frame has all that the next one needs: from frame 2 on a new solver computes the same bits.
#[test]
fn bodies_go_on_from_any_frame() {
    let context = context();
    for set in [&[][..], &["solver.method=\"pbf\""]] {
        let scene = scene(&raft(300.0, "spin = [20, 40, 0]\n"), set);
        let start = Start::of(&scene).unwrap();
        let mut drive = Drive::new(&gpu(&context), &scene, &start, false).unwrap();
        let whole: Vec<_> = (0..4).map(|_| drive.advance().unwrap().particles).collect();
        let mut other = Drive::new(&gpu(&context), &scene, &start, false).unwrap();
        other.load(2, &whole[1]).unwrap();
        for frame in [2, 3] {
            assert_eq!(other.advance().unwrap().particles, whole[frame], "{set:?}");
        }
        // Negative control: a body that stands elsewhere by a rounding error goes elsewhere.
        let mut moved = whole[1].clone();
        moved.bodies[0].velocity.y += 1e-12;
        other.load(2, &moved).unwrap();
        assert_ne!(other.advance().unwrap().particles.bodies, whole[2].bodies);
    }
}

#[test]
fn a_scene_without_bodies_has_nothing_for_them() {
    let context = context();
    let with = scene(&raft(300.0, ""), &[]);
    let mut without = with.clone();
    without.moving_solids.clear();
    for (scene, has) in [(&with, true), (&without, false)] {
        let start = Start::of(scene).unwrap();
        let mut drive = Drive::new(&gpu(&context), scene, &start, true).unwrap();
        let frame = drive.advance().unwrap();
        assert_eq!(frame.particles.bodies.is_empty(), !has);
        let shares = drive.shares();
        assert_eq!(shares.iter().any(|share| share.owner == "bodies"), has);
        let ran = drive.timings();
        assert_eq!(ran.iter().any(|time| time.pass.contains("bod")), has);
    }
}
