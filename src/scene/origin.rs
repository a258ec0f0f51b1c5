//! Local origin of scenes far from the world's origin, where 32-bit floats no longer
//! resolve particles.

use glam::{DAffine3, DVec2, DVec3};

use super::{PlacedMesh, Scene, probe::ProbeKind};
use swell_domain::bounds::Bounds;

/// A domain within this many of its own edge lengths of the world's origin keeps world coordinates.
const NEAR: f64 = 2.0;

/// Returns the world position of the local origin for a domain, metres, per axis.
///
/// It is zero unless the domain is far away. Otherwise, with q the largest power of two not above
/// the edge, the domain begins between q and 2 q from the local origin. Local coordinates are then
/// between q and 4 q, so an `f32` is finer than 2⁻²² of the edge and a multiple of 2⁻²³ q, and its
/// sum with the origin is exact in `f64` up to 2²⁹ edges away.
pub fn of(domain: &Bounds) -> DVec3 {
    let [min, max] = [domain.min, domain.max].map(|p| p.to_array());
    DVec3::from_array(std::array::from_fn(|axis| {
        let edge = max[axis] - min[axis];
        if min[axis].abs().max(max[axis].abs()) <= NEAR * edge {
            return 0.0;
        }
        let quantum = edge.log2().floor().exp2();
        ((min[axis] / quantum).floor() - 1.0) * quantum
    }))
}

impl Scene {
    /// Converts world coordinates to coordinates relative to `self.origin`.
    #[must_use]
    pub fn into_local(mut self) -> Self {
        let way = -self.origin;
        if way == DVec3::ZERO {
            return self;
        }
        self.domain = self.domain.moved(way);
        for block in &mut self.water.blocks {
            *block = block.moved(way);
        }
        let swarms = self.water.particles.iter_mut();
        swarms
            .flat_map(|swarm| &mut swarm.at)
            .for_each(|at| *at += way);
        let placed = self.water.meshes.iter_mut().chain(&mut self.solids);
        let moving = self.moving_solids.iter_mut().map(|solid| &mut solid.placed);
        placed.chain(moving).for_each(|mesh| carry(mesh, way));
        for turn in self.moving_solids.iter_mut().flat_map(|it| &mut it.turn) {
            turn.pivot += way;
        }
        for track in self.moving_solids.iter_mut().flat_map(|it| &mut it.track) {
            track.carry(way);
        }
        for it in self
            .moving_solids
            .iter_mut()
            .flat_map(|it| &mut it.sequence)
        {
            it.shape = it.shape.moved(way);
        }
        for it in self.moving_solids.iter_mut().flat_map(|it| &mut it.floor) {
            *it = it.moved(way);
        }
        for it in self.moving_solids.iter_mut().flat_map(|it| &mut it.body) {
            it.body.carry(way);
        }
        self.carry_sources(way, &carry);
        self.carry_forces(way, &carry);
        for probe in &mut self.probes {
            match &mut probe.kind {
                ProbeKind::Elevation { at } => *at += DVec2::new(way.x, way.z),
                ProbeKind::Pressure { at } | ProbeKind::Force { about: at, .. } => *at += way,
                ProbeKind::Flux { towards, at } => *at += way[towards.axis],
                ProbeKind::Energy
                | ProbeKind::Volume
                | ProbeKind::Front { .. }
                | ProbeKind::RunUp { .. } => {}
            }
        }
        self
    }
}

fn carry(placed: &mut PlacedMesh, way: DVec3) {
    placed.mesh = placed.mesh.transformed(&DAffine3::from_translation(way));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_domains_begin_near_their_own_zero() {
        for (min, max, origin) in [
            // Near: unchanged.
            (0.0, 25.0, 0.0),
            (-2.0, 2.0, 0.0),
            (2.0, 4.0, 0.0),
            // Far: multiples of 8 for an edge of 12.6, of 2 for 2, and of a quarter for 0.3.
            (10_000.0, 10_012.6, 9_992.0),
            (-10_002.0, -10_000.0, -10_004.0),
            (6.0, 8.0, 4.0),
            (1.3, 1.6, 1.0),
        ] {
            let found = of(&Bounds {
                min: DVec3::splat(min),
                max: DVec3::splat(max),
            });
            assert_eq!(found, DVec3::splat(origin), "{min} to {max}");
            if origin != 0.0 {
                let edge: f64 = max - min;
                let quantum = edge.log2().floor().exp2();
                let local = [min - origin, max - origin];
                assert!(
                    local[0] >= quantum && local[1] <= 4.0 * quantum,
                    "{local:?}"
                );
            }
        }
    }
}
