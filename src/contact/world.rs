//! A world of rapier for one step.

use glam::{DMat3, DQuat, DVec3};
use rapier3d_f64::{
    dynamics::{
        FrictionModel, IntegrationParameters, LockedAxes, MassProperties, RigidBodyBuilder,
        RigidBodyHandle, SpringCoefficients,
    },
    geometry::{ColliderBuilder, SharedShape},
    math::{Pose, Real, Rotation},
    na::{Matrix3, SymmetricEigen},
    pipeline::PhysicsWorld,
};
use swell_domain::{
    body::{Body, BodyState, Freedom},
    pose::Passage,
};

use crate::{
    Collider, Contacts, FRICTION, PUSH,
    near::{Near, Wall},
    shape::vector,
};

/// Sweeps over all contacts, times the number of bodies.
const EFFORT: usize = 6400;
/// The fewest and the most sweeps over all contacts. From an impulse of 0, a stack of three boxes
/// needs the most to stand still to 1e-4 m/s at 240 steps a second.
const SWEEPS: [usize; 2] = [32, 256];
/// Share of an overlap that a step removes, as long as [`PUSH`] allows it.
const SHARE: f64 = 0.2;
/// Damping ratio ζ of contacts. A high one makes them rigid: with r = 1 / SHARE - 1, an overlap
/// yields to an impulse by r² / 4 (1 + r) ζ² = 8e-5 of it.
const DAMPING: f64 = 100.0;

/// A world and what was put into it.
pub(crate) struct World {
    world: PhysicsWorld,
    bodies: Vec<Option<RigidBodyHandle>>,
    skin: f64,
}

impl World {
    /// Builds a world of the walls and solids that are near.
    pub(crate) fn new(contacts: &Contacts, near: &Near, length: f64) -> Self {
        let mut world = PhysicsWorld::new();
        world.gravity = vector(DVec3::ZERO);
        world.integration_parameters =
            parameters(contacts.bodies.len(), near.travel + contacts.margin, length);
        let mut all = Self {
            world,
            bodies: Vec::with_capacity(contacts.bodies.len()),
            skin: 0.5 * contacts.margin,
        };
        near.walls.iter().for_each(|wall| all.add_wall(wall));
        for shape in &near.statics {
            let collider = all.collider(shape, DVec3::ZERO);
            all.world.insert(RigidBodyBuilder::fixed(), collider);
        }
        for (shape, passage) in &near.moving {
            all.add_moving(shape, passage);
        }
        all
    }

    fn collider(&self, shape: &SharedShape, offset: DVec3) -> ColliderBuilder {
        ColliderBuilder::new(shape.clone())
            .position(Pose::from_translation(vector(offset)))
            .mass_properties(MassProperties::default())
            .friction(FRICTION)
            .contact_skin(self.skin)
    }

    fn add_wall(&mut self, wall: &Wall) {
        let shape = SharedShape::halfspace(vector(wall.inward));
        let collider = self.collider(&shape, DVec3::ZERO);
        let body = match wall.velocity == DVec3::ZERO {
            true => RigidBodyBuilder::fixed(),
            false => RigidBodyBuilder::kinematic_velocity_based(),
        };
        let body = body
            .translation(vector(wall.at))
            .linvel(vector(wall.velocity));
        self.world.insert(body, collider);
    }

    fn add_moving(&mut self, shape: &SharedShape, passage: &Passage) {
        let start = passage.start;
        let body = RigidBodyBuilder::kinematic_velocity_based()
            .pose(pose(start.centre, start.turn))
            .linvel(vector(passage.velocity))
            .angvel(vector(passage.spin))
            .can_sleep(false);
        let collider = self.collider(shape, -start.rest);
        self.world.insert(body, collider);
    }

    /// Adds a body; one that touches nothing stays out.
    pub(crate) fn add_body(&mut self, collider: &Collider, state: &BodyState) {
        let Collider { body, touch } = collider;
        let Some(touch) = touch else {
            self.bodies.push(None);
            return;
        };
        // A hinged body turns about a point of its axis that cannot move.
        let (pivot, velocity, locked) = match body.freedom {
            Freedom::Axes { along, .. } => (state.centre, state.velocity, locked(along)),
            Freedom::Hinge { at, .. } => (at, DVec3::ZERO, LockedAxes::TRANSLATION_LOCKED),
        };
        let pivot = state.turn.conjugate() * (pivot - state.centre);
        let rigid = RigidBodyBuilder::dynamic()
            .pose(pose(state.centre, state.turn))
            .linvel(vector(velocity))
            .angvel(vector(state.spin))
            .locked_axes(locked)
            .additional_mass_properties(mass_properties(body, state, pivot))
            .gyroscopic_forces_enabled(false)
            .allow_fast_rotation(true)
            .can_sleep(false);
        let collider = self.collider(&touch.shape, DVec3::ZERO);
        let (handle, _) = self.world.insert(rigid, collider);
        self.bodies.push(Some(handle));
    }

    /// Advances the world to the end of the step.
    pub(crate) fn step(&mut self) {
        self.world.step();
    }

    /// Gives `state` the velocities of body `index` if a contact changed them.
    pub(crate) fn read(&self, index: usize, body: &Body, state: &mut BodyState) {
        let Some(handle) = self.bodies[index] else {
            return;
        };
        let rigid = &self.world.bodies[handle];
        let linear = DVec3::from_array(rigid.linvel().to_array());
        let spin = DVec3::from_array(rigid.angvel().to_array());
        // A contact that gives a hinged body no spin has no effect on it.
        let (velocity, is_kept) = match body.freedom {
            Freedom::Axes { .. } => (linear, linear == state.velocity),
            Freedom::Hinge { at, .. } => (spin.cross(state.centre - at), true),
        };
        if is_kept && spin == state.spin {
            return;
        }
        *state = body.constrained(BodyState {
            velocity,
            spin,
            ..*state
        });
    }
}

/// One step at the end of which no velocity is corrected, so that the velocities are those that
/// moved the bodies.
fn parameters(bodies: usize, prediction: f64, length: f64) -> IntegrationParameters {
    let softness = SpringCoefficients::new(
        2.0 * DAMPING * SHARE / ((1.0 - SHARE) * length * std::f64::consts::TAU),
        DAMPING,
    );
    let [fewest, most] = SWEEPS;
    IntegrationParameters {
        dt: length,
        contact_softness: softness,
        static_contact_softness: softness,
        normalized_max_corrective_velocity: PUSH,
        // It includes the margin, since points farther apart are dropped before the skin counts.
        normalized_prediction_distance: prediction,
        normalized_max_linear_velocity: Real::MAX,
        num_solver_iterations: 1,
        num_internal_pgs_iterations: (EFFORT / bodies).clamp(fewest, most),
        num_internal_stabilization_iterations: 0,
        // Contacts foresee what a step reaches (`Near::travel`), so no body is stopped on its way.
        max_ccd_substeps: 0,
        friction_model: FrictionModel::Simplified,
        ..IntegrationParameters::default()
    }
}

fn locked(along: [bool; 3]) -> LockedAxes {
    let axes = [
        LockedAxes::TRANSLATION_LOCKED_X,
        LockedAxes::TRANSLATION_LOCKED_Y,
        LockedAxes::TRANSLATION_LOCKED_Z,
    ];
    let locked = axes.into_iter().zip(along).filter(|(_, free)| !free);
    locked.fold(LockedAxes::empty(), |all, (axis, _)| all | axis)
}

/// Returns the mass, and the change of angular velocity for each unit of angular momentum within
/// the body's freedom, which is 0 about locked axes. `pivot` is the point that they refer to,
/// relative to the body.
fn mass_properties(body: &Body, state: &BodyState, pivot: DVec3) -> MassProperties {
    let response = body.response(state);
    let row = |i: usize| DVec3::new(response[i][3], response[i][4], response[i][5]);
    let turn = DMat3::from_quat(state.turn);
    let about = turn.transpose() * DMat3::from_cols(row(3), row(4), row(5)) * turn;
    let eigen = SymmetricEigen::new(Matrix3::from_column_slice(&about.to_cols_array()));
    let vectors = DMat3::from_cols_slice(eigen.eigenvectors.as_slice());
    let right_handed = DMat3::from_cols(
        vectors.x_axis,
        vectors.y_axis,
        vectors.z_axis * vectors.determinant().signum(),
    );
    let values = DVec3::from_slice(eigen.eigenvalues.as_slice());
    MassProperties {
        local_com: vector(pivot),
        inv_mass: body.mass.mass.recip(),
        inv_principal_inertia: vector(values.max(DVec3::ZERO)),
        principal_inertia_local_frame: rotation(DQuat::from_mat3(&right_handed)),
    }
}

fn pose(at: DVec3, turn: DQuat) -> Pose {
    Pose::from_parts(vector(at), rotation(turn))
}

fn rotation(turn: DQuat) -> Rotation {
    Rotation::from_array(turn.to_array())
}
