use std::collections::BTreeMap;

use super::*;
use crate::whitewater::{ATTRIBUTES, none};

const RASTER: FogRaster = FogRaster {
    origin: DVec3::new(-0.3, 0.2, 0.1),
    voxel_size: 0.1,
    frame_seconds: 1.0 / 24.0,
};

/// Particles in a cloud around the corner of eight leaves, with radii up to `largest` metres.
fn cloud(largest: f64) -> Particles {
    let mut white = none();
    for k in 0..400u32 {
        let part = |n: f64| (f64::from(k) * n).fract();
        let p = RASTER.origin + DVec3::new(part(0.618), part(0.414), part(0.732)) * 0.9 - 0.4;
        white.position.push(p.as_vec3().to_array());
        let v = DVec3::new(part(0.236), -part(0.303), 2.0 * part(0.123));
        white.velocity.push(v.as_vec3().to_array());
        white.id.push(k);
        for name in ATTRIBUTES {
            let value = if name == RADIUS {
                largest * (0.1 + 0.9 * part(0.55))
            } else {
                0.0
            };
            let column = white.attributes.entry(name.to_owned()).or_default();
            column.push(value as f32);
        }
    }
    white
}

fn active<T: Copy>(grid: &SparseGrid<T>) -> BTreeMap<[i32; 3], T> {
    let leaves = grid.leaves.iter();
    leaves
        .flat_map(|leaf| {
            let active = (0..VOXELS).filter(|&element| leaf.is_active(element));
            active.map(|element| (leaf.voxel(element), leaf.values[element]))
        })
        .collect()
}

/// Volume and momentum per density of the particles, m³ and m⁴/s, and the sum of the momenta's
/// sizes.
fn held(white: &Particles) -> (f64, DVec3, f64) {
    let volumes = white.attributes[RADIUS]
        .iter()
        .map(|r| 4.0 / 3.0 * PI * f64::from(*r).powi(3));
    let velocities = white.velocity.iter().map(|v| DVec3::from(v.map(f64::from)));
    let pairs: Vec<(f64, DVec3)> = volumes.zip(velocities).collect();
    (
        pairs.iter().map(|(volume, _)| volume).sum(),
        pairs.iter().map(|(volume, v)| *volume * *v).sum(),
        pairs.iter().map(|(volume, v)| volume * v.length()).sum(),
    )
}

fn held_by(fog: &Fog) -> (f64, DVec3) {
    let velocity = active(&fog.velocity);
    let voxel = RASTER.voxel_size.powi(3);
    active(&fog.density)
        .iter()
        .fold((0.0, DVec3::ZERO), |(volume, momentum), (at, density)| {
            let own = f64::from(*density) * voxel;
            (
                volume + own,
                momentum + own * DVec3::from(velocity[at].map(f64::from)),
            )
        })
}

/// Each voxel rounds its density to f32, and its velocity.
const ROUNDING: f64 = 2.0 / (1u64 << 24) as f64;

#[test]
fn the_grids_hold_the_particles_volume_and_momentum() {
    // Balls within a voxel, as large as one, and over several leaves.
    for largest in [0.02, 0.1, 0.45] {
        let white = cloud(largest);
        let (volume, momentum, size) = held(&white);
        let fog = RASTER.fog(&white);
        let found = held_by(&fog);
        assert!(
            (found.0 / volume - 1.0).abs() < ROUNDING,
            "{largest}: {found:?}"
        );
        assert!(
            (found.1 - momentum).length() < 2.0 * ROUNDING * size,
            "{largest}: {found:?}"
        );
        // Negative controls: a particle less, and a velocity of another particle.
        let mut fewer = white.clone();
        fewer.retain(&(0..400).map(|k| k != 17).collect::<Vec<_>>());
        assert!((held_by(&RASTER.fog(&fewer)).0 / volume - 1.0).abs() > 100.0 * ROUNDING);
        let mut other = white;
        other.velocity.swap(3, 140);
        let off = (held_by(&RASTER.fog(&other)).1 - momentum).length();
        assert!(off > 100.0 * ROUNDING * size, "{largest}: {off}");
    }
}

/// One particle in the middle of eight voxels, and one at a voxel's centre.
#[test]
fn a_particle_is_where_its_voxels_are() {
    let mut white = cloud(0.05);
    white.retain(&(0..400).map(|k| k < 1).collect::<Vec<_>>());
    white.velocity[0] = [1.0, 2.0, -3.0];
    let at = |place: DVec3| {
        let mut one = white.clone();
        one.position[0] = (RASTER.origin + place * RASTER.voxel_size)
            .as_vec3()
            .to_array();
        RASTER.fog(&one)
    };
    let volume = held(&white).0 / RASTER.voxel_size.powi(3);
    let shared = active(&at(DVec3::new(8.0, 16.0, -8.0)).density);
    assert_eq!(shared.len(), 8);
    for (voxel, density) in &shared {
        let off = [0, 1, 2].map(|axis| voxel[axis] - [8, 16, -8][axis]);
        assert!(off.iter().all(|x| [-1, 0].contains(x)), "{voxel:?}");
        // Positions have the rounding of f32, a part in 2²³ of a voxel and of its index.
        assert!(
            (f64::from(*density) / volume * 8.0 - 1.0).abs() < 1e-4,
            "{density}"
        );
    }
    let fog = at(DVec3::new(3.5, 4.5, 5.5));
    let density = active(&fog.density);
    assert!((f64::from(density[&[3, 4, 5]]) / volume - 1.0).abs() < 1e-4);
    let velocity = active(&fog.velocity);
    // 3.7 m/s for half a frame of 1/24 s are 0.8 voxels: one voxel around, and one for rounding.
    assert!(velocity.len() >= density.len() + 6, "{}", velocity.len());
    assert!(velocity.contains_key(&[4, 4, 5]) && !velocity.contains_key(&[7, 4, 5]));
    assert!(velocity.values().all(|v| *v == [1.0, 2.0, -3.0]));
}

/// Sums over all particles at each voxel, without leaves.
#[test]
fn sums_by_leaves_are_those_over_all_particles() {
    for largest in [0.02, 0.45] {
        let white = cloud(largest);
        let fog = RASTER.fog(&white);
        let density = active(&fog.density);
        let mut wanted: BTreeMap<[i32; 3], f64> = BTreeMap::new();
        for k in 0..white.len() {
            let splat = RASTER.splat(&white, k).unwrap();
            let near = 2 * MOST as i32 + 1;
            for step in 0..near.pow(3) {
                let steps = [step % near, step / near % near, step / near.pow(2)];
                let weight: f64 = (0..3)
                    .map(|a| splat.weights[a][steps[a] as usize])
                    .product();
                let at = [0, 1, 2].map(|a| splat.first[a] + steps[a]);
                *wanted.entry(at).or_default() += weight * splat.volume / 1e-3;
            }
        }
        wanted.retain(|_, density| *density as f32 > 0.0);
        assert!(density.keys().eq(wanted.keys()), "{largest}");
        for (found, wanted) in density.values().zip(wanted.values()) {
            assert!((f64::from(*found) / wanted - 1.0).abs() < 1e-6);
        }
        assert!(
            fog.density.leaves.len() >= 8 && fog.density.leaves.is_sorted_by_key(|it| it.origin)
        );
    }
}

#[test]
fn velocities_go_on_as_far_as_the_fastest_particle() {
    let mut white = cloud(0.02);
    let widths = [0.0, 8.0, 400.0].map(|speed| {
        white.velocity.fill([speed, 0.0, 0.0]);
        let fog = RASTER.fog(&white);
        let bounds = [fog.density.active_bounds(), fog.velocity.active_bounds()];
        let [own, all] = bounds.map(Option::unwrap);
        assert!(
            active(&fog.velocity)
                .values()
                .all(|v| *v == [speed, 0.0, 0.0])
        );
        assert!(fog.velocity.leaves.is_sorted_by_key(|leaf| leaf.origin));
        (0..3)
            .map(|axis| own.0[axis] - all.0[axis])
            .collect::<Vec<_>>()
    });
    // 8 m/s for 1/48 s are 1.7 voxels.
    assert_eq!(widths, [vec![1; 3], vec![2; 3], vec![MOST as i32; 3]]);
}

#[test]
fn a_frame_gives_the_same_grids_on_any_number_of_threads() {
    let white = cloud(0.2);
    let pool = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| RASTER.fog(&white))
    };
    assert_eq!(pool(1), pool(5));
    // Drops a thousand kilometres off take as many leaves as near ones.
    let mut far = white.clone();
    far.position[0] = [1e6, 1e6, 1e6];
    far.position[1] = [f32::NAN, 0.0, 0.0];
    let leaves = RASTER.fog(&far).density.leaves.len();
    assert!(
        leaves <= RASTER.fog(&white).density.leaves.len() + 8,
        "{leaves}"
    );
    let nothing = RASTER.fog(&none());
    assert!(nothing.density.leaves.is_empty() && nothing.velocity.leaves.is_empty());
}
