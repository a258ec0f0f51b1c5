use glam::DVec3;

use crate::parse_scene;

/// Individual particles move with the scene.
#[test]
fn particles_are_carried_with_their_domain() {
    let text = "[shot]\nname = \"a\"\nframes = 1\nframes_per_second = 30\n[domain]\n\
        min = [100, 0, 100]\nmax = [102, 2, 102]\n\
        [[water.particles]]\nat = [[101.5, 1.0, 101.25]]\n[solver]\nmethod = \"pbf\"\n\
        [solver.pbf]\nparticle_spacing = 0.1\n";
    let world = parse_scene(text, "s.toml".as_ref(), "".as_ref(), &[]).expect("valid");
    let way = world.origin;
    assert!(way.x > 90.0 && way.z > 90.0, "{way}");
    let at = world.water.particles[0].at[0];
    let local = DVec3::new(101.5, 1.0, 101.25) - way;
    assert_eq!(at, local);
    assert!(at.cmpge(world.domain.min).all() && at.cmple(world.domain.max).all());
}
