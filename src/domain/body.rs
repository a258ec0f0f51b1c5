//! Rigid bodies that float: mass properties, constraints, moorings, and the motion between two
//! instants.
//!
//! Velocities and impulses of a body have six components, three of the centre of mass and three
//! about it, along the axes of the scene: a [`Six`].

mod path;

use glam::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::{mesh::TriangleMesh, pose::Pose};

/// A velocity (m/s, rad/s) or an impulse (N s, N m s) of a rigid body: three components of the
/// centre of mass, and three about it.
pub type Six = [f64; 6];

/// Mass, centre and inertia of a body in its pose at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass, metres.
    pub centre: DVec3,
    /// Inertia about the centre of mass, kg m².
    pub inertia: DMat3,
}

/// Velocities that a body may have.
#[derive(Clone, Debug, PartialEq)]
pub enum Freedom {
    /// Translation along, and rotation about, these axes of the scene.
    Axes {
        /// Axes along which it moves.
        along: [bool; 3],
        /// Axes about which it turns.
        about: [bool; 3],
    },
    /// Rotation about an axis that stands still.
    Hinge {
        /// A point on the axis, metres.
        at: DVec3,
        /// Direction of the axis, a unit vector.
        axis: DVec3,
    },
}

/// A spring with damping from a fixed point to a point of the body; it pulls and never pushes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mooring {
    /// Where it is fixed, metres.
    pub anchor: DVec3,
    /// Where it holds the body, in the pose at the start, metres.
    pub at: DVec3,
    /// Length at which it begins to pull, metres.
    pub length: f64,
    /// Stiffness, N/m.
    pub stiffness: f64,
    /// Damping while it is taut, N s/m.
    pub damping: f64,
}

/// A rigid body that the water moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Mass properties.
    pub mass: MassProperties,
    /// Velocity at the start, m/s and rad/s.
    pub velocity: Six,
    /// What it may do.
    pub freedom: Freedom,
    /// Its moorings.
    pub moorings: Vec<Mooring>,
}

/// A taut mooring within a time.
struct Hold {
    /// Direction in which it pulls, and its moment about the centre of mass.
    unit: Six,
    /// Impulse of a body at rest, N s.
    pull: f64,
    /// Decrease of that for each m/s towards the anchor, kg.
    resistance: f64,
}

/// State of a body at an instant; part of the simulation's state.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyState {
    /// Time of this state, seconds from the start of the shot.
    pub time: f64,
    /// Centre of mass, metres, relative to the scene's origin.
    pub centre: DVec3,
    /// Rotation from the pose at the start, a unit quaternion (x, y, z, w).
    pub turn: DQuat,
    /// Velocity of the centre of mass, m/s.
    pub velocity: DVec3,
    /// Angular velocity, rad/s.
    pub spin: DVec3,
}

impl MassProperties {
    /// Computes the exact integrals over the inside of a closed mesh of uniform density, kg/m³, as
    /// a sum over tetrahedra from the middle of its box (equivalent to Mirtich 1996).
    pub fn of_mesh(mesh: &TriangleMesh, density: f64) -> Self {
        let origin = mesh.bounds().map_or(DVec3::ZERO, |b| 0.5 * (b.min + b.max));
        let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
        for index in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(index).map(|x| x - origin);
            let six_volumes = a.dot(b.cross(c));
            let sum = a + b + c;
            volume += six_volumes / 6.0;
            first += six_volumes / 24.0 * sum;
            let squares = [a, b, c, sum].map(|v| outer(v, v));
            let squares = squares.into_iter().fold(DMat3::ZERO, |all, one| all + one);
            second += squares * (six_volumes / 120.0);
        }
        let away = first / volume;
        let about = second - outer(away, away) * volume;
        let trace = about.x_axis.x + about.y_axis.y + about.z_axis.z;
        Self {
            mass: density * volume,
            centre: origin + away,
            inertia: (DMat3::from_diagonal(DVec3::splat(trace)) - about) * density,
        }
    }
}

impl Body {
    /// Adds `way` to all positions, metres.
    pub fn carry(&mut self, way: DVec3) {
        self.mass.centre += way;
        if let Freedom::Hinge { at, .. } = &mut self.freedom {
            *at += way;
        }
        for mooring in &mut self.moorings {
            mooring.anchor += way;
            mooring.at += way;
        }
    }

    /// Returns the state at the start.
    pub fn at_start(&self) -> BodyState {
        let [vx, vy, vz, wx, wy, wz] = self.velocity;
        let state = BodyState {
            time: 0.0,
            centre: self.mass.centre,
            turn: DQuat::IDENTITY,
            velocity: DVec3::new(vx, vy, vz),
            spin: DVec3::new(wx, wy, wz),
        };
        self.constrained(state)
    }

    /// Returns the inertia about the centre of mass in the pose of `state`, kg m².
    pub fn inertia(&self, state: &BodyState) -> DMat3 {
        let turn = DMat3::from_quat(state.turn);
        turn * self.mass.inertia * turn.transpose()
    }

    /// Returns the change of velocity for each unit of each component of an impulse, as rows: the
    /// inverse of the mass matrix within the body's freedom, N (Nᵀ M N)⁻¹ Nᵀ with the velocities N
    /// that it may have.
    pub fn response(&self, state: &BodyState) -> [Six; 6] {
        self.response_of(state, &[])
    }

    /// Returns the same for impulses within `kick` seconds, in which taut moorings also act on what
    /// velocity the impulses give.
    pub fn held_response(&self, state: &BodyState, kick: f64) -> [Six; 6] {
        self.response_of(state, &self.holds(state, kick))
    }

    fn response_of(&self, state: &BodyState, holds: &[Hold]) -> [Six; 6] {
        let momentum = |v: &Six| {
            let held = holds
                .iter()
                .map(|it| (it.resistance * dot(&it.unit, v), &it.unit));
            let own = self.momentum(state, v);
            held.fold(own, |sum, (by, unit)| {
                std::array::from_fn(|k| sum[k] + by * unit[k])
            })
        };
        // Orthonormal with respect to the mass matrix, by Gram and Schmidt.
        let mut basis: Vec<Six> = Vec::new();
        for mut v in self.freedom.velocities(state.centre) {
            for _ in 0..2 {
                for other in &basis {
                    let part = dot(&momentum(other), &v);
                    v = std::array::from_fn(|k| v[k] - part * other[k]);
                }
            }
            let size = dot(&momentum(&v), &v).sqrt();
            basis.push(v.map(|x| x / size));
        }
        std::array::from_fn(|i| {
            std::array::from_fn(|j| basis.iter().map(|v| v[i] * v[j]).sum::<f64>())
        })
    }

    /// Returns the momentum of a velocity.
    fn momentum(&self, state: &BodyState, v: &Six) -> Six {
        let [_, _, _, x, y, z] = *v;
        let about = self.inertia(state) * DVec3::new(x, y, z);
        let m = self.mass.mass;
        [m * v[0], m * v[1], m * v[2], about.x, about.y, about.z]
    }

    /// Returns the moorings that are taut for the next `kick` seconds.
    fn holds(&self, state: &BodyState, kick: f64) -> Vec<Hold> {
        let hold = |mooring: &Mooring| {
            let at = self.pose(state).place(mooring.at);
            let way = mooring.anchor - at;
            let distance = way.length();
            let stretch = distance - mooring.length;
            let towards = way / distance;
            let about = (at - state.centre).cross(towards);
            let hold = Hold {
                unit: [towards.x, towards.y, towards.z, about.x, about.y, about.z],
                pull: kick * mooring.stiffness * stretch,
                resistance: kick * (mooring.stiffness * kick + mooring.damping),
            };
            let pulls = hold.pull > hold.resistance * dot(&hold.unit, &state.velocities());
            (stretch > 0.0 && pulls).then_some(hold)
        };
        self.moorings.iter().filter_map(hold).collect()
    }

    /// Returns the state after gravity, m/s², and the moorings have acted for `kick` seconds.
    /// Moorings act implicitly, so that a stiff one is stable at any step.
    pub fn accelerated(&self, state: &BodyState, gravity: DVec3, kick: f64) -> BodyState {
        let weight = self.mass.mass * kick * gravity;
        let mut impulse = [weight.x, weight.y, weight.z, 0.0, 0.0, 0.0];
        let holds = self.holds(state, kick);
        for hold in &holds {
            // Less what it resists of the velocity that the body has.
            let by = hold.pull - hold.resistance * dot(&hold.unit, &state.velocities());
            impulse = std::array::from_fn(|k| impulse[k] + by * hold.unit[k]);
        }
        state.pushed(&self.response_of(state, &holds), &impulse)
    }

    /// Returns the state `length` seconds later without forces: the centre moves in a straight
    /// line, or about the hinge, and the angular momentum is kept.
    pub fn moved(&self, state: &BodyState, length: f64) -> BodyState {
        let turn = DQuat::from_scaled_axis(length * state.spin) * state.turn;
        let mut after = BodyState {
            time: state.time + length,
            centre: state.centre + length * state.velocity,
            turn: turn.normalize(),
            ..*state
        };
        if let Freedom::Hinge { at, .. } = self.freedom {
            after.centre = at + after.turn * (self.mass.centre - at);
            after.velocity = after.spin.cross(after.centre - at);
            return after;
        }
        let momentum = self.inertia(state) * state.spin;
        after.spin = self.inertia(&after).inverse() * momentum;
        self.constrained(after)
    }

    /// Returns the pose that belongs to a state.
    pub fn pose(&self, state: &BodyState) -> Pose {
        Pose {
            rest: self.mass.centre,
            centre: state.centre,
            turn: state.turn,
        }
    }

    /// Returns the kinetic energy, J.
    pub fn kinetic_energy(&self, state: &BodyState) -> f64 {
        let about = state.spin.dot(self.inertia(state) * state.spin);
        0.5 * (self.mass.mass * state.velocity.length_squared() + about)
    }

    /// Keeps of the momentum what the freedom allows.
    pub fn constrained(&self, state: BodyState) -> BodyState {
        let about = self.inertia(&state) * state.spin;
        let along = self.mass.mass * state.velocity;
        let still = BodyState {
            velocity: DVec3::ZERO,
            spin: DVec3::ZERO,
            ..state
        };
        let momentum = [along.x, along.y, along.z, about.x, about.y, about.z];
        match self.freedom {
            Freedom::ALL => state,
            _ => still.pushed(&self.response(&state), &momentum),
        }
    }
}

impl Freedom {
    /// Every motion.
    pub const ALL: Self = Self::Axes {
        along: [true; 3],
        about: [true; 3],
    };

    /// Returns independent velocities of a body whose centre of mass is at `centre`, which span
    /// those that it may have.
    fn velocities(&self, centre: DVec3) -> Vec<Six> {
        match *self {
            Self::Axes { along, about } => {
                let axes = along.into_iter().chain(about).enumerate();
                let free = axes.filter(|(_, is_free)| *is_free);
                let unit = |(k, _)| std::array::from_fn(|i| f64::from(u8::from(i == k)));
                free.map(unit).collect()
            }
            Self::Hinge { at, axis } => {
                let along = axis.cross(centre - at);
                vec![[along.x, along.y, along.z, axis.x, axis.y, axis.z]]
            }
        }
    }
}

impl BodyState {
    /// Returns the change of the six velocities since another state, m/s and rad/s.
    pub fn change_since(&self, before: &Self) -> Six {
        let (now, then) = (self.velocities(), before.velocities());
        std::array::from_fn(|k| now[k] - then[k])
    }

    /// Returns the velocity and the angular velocity.
    pub fn velocities(&self) -> Six {
        let [v, w] = [self.velocity, self.spin];
        [v.x, v.y, v.z, w.x, w.y, w.z]
    }

    /// Returns the state after an impulse, with the body's [`Body::response`].
    pub fn pushed(&self, response: &[Six; 6], impulse: &Six) -> Self {
        self.sped_up(&product(response, impulse))
    }

    /// Returns the state with `change` added to the velocities.
    pub fn sped_up(&self, change: &Six) -> Self {
        let [vx, vy, vz, wx, wy, wz] = *change;
        Self {
            velocity: self.velocity + DVec3::new(vx, vy, vz),
            spin: self.spin + DVec3::new(wx, wy, wz),
            ..*self
        }
    }

    /// Returns the velocity of the body's point that is at `x`, m/s.
    pub fn velocity_at(&self, x: DVec3) -> DVec3 {
        self.velocity + self.spin.cross(x - self.centre)
    }

    /// Returns whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let turn = self.turn.is_finite() && self.centre.is_finite();
        turn && self.velocity.is_finite() && self.spin.is_finite()
    }
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Returns Σ a b.
pub fn dot(a: &Six, b: &Six) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Returns a matrix of rows times a vector.
pub fn product(rows: &[Six; 6], v: &Six) -> Six {
    std::array::from_fn(|k| dot(&rows[k], v))
}

#[cfg(test)]
mod tests;
