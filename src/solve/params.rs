//! Host-side mirrors of uniforms and counters. A test compares each layout with naga's layout of
//! the WGSL struct.

use swell_domain::bricks::Brick;
use swell_gpu::{
    buffer::{Element, Mirror, Scalar, Workgroups, mirror},
    reflect::Layout,
};
use swell_scene::{moving_solid::MAX_MOVING_SOLIDS, sources::MAX_INLETS};

mirror!(
    /// `Params` of shared/pbf_params.wgsl. Lengths in metres; positions relative to the domain's
    /// minimum corner.
    Params {
        /// Gravity times time step, m/s.
        velocity_step: [f32; 3],
        /// Number of fluid particles.
        particle_count: u32,
        /// Cells of edge h along each axis.
        grid_dims: [u32; 3],
        /// Largest displacement by one iteration, metres.
        max_correction: f32,
        /// Minimum faces of the box, displaced by wave makers, metres.
        wall_min: [f32; 3],
        /// Length of the substep, seconds.
        time_step: f32,
        /// Maximum faces of the box, displaced by wave makers, metres.
        wall_max: [f32; 3],
        /// 1/Δt, 1/s; 0 if the time step is 0.
        inverse_time_step: f32,
        /// Support radius h of the kernels, metres.
        support_radius: f32,
        /// 1/h, 1/m.
        inverse_support_radius: f32,
        /// Index of a dummy particle far from everything, which pads neighbour lists.
        nobody: u32,
        /// Relative density per unit of (1 − q²)³, q = r/h; see `domain::sph`.
        density_scale: f32,
        /// |∇C| per unit of (1 − q)², 1/m; see `domain::sph`.
        gradient_scale: f32,
        /// Lattice density beyond a wall over the continuum's; see `domain::sph`.
        wall_density_scale: f32,
        /// ε in the denominator of λ, 1/m².
        regularization: f32,
        /// Relaxation factor ω of the corrections.
        relaxation: f32,
        /// Least distance of a particle from a wall or solid, metres.
        contact_distance: f32,
        /// Cap on a particle's displacement in a substep, metres.
        max_displacement: f32,
        /// k of s_corr times the natural scale of λ, m².
        artificial_pressure: f32,
        /// Period of the domain along x, metres; 0 if the axis is not periodic.
        period_x: f32,
        /// Velocities of the minimum faces, each along its own axis, m/s.
        wall_velocity_min: [f32; 3],
        /// Period of the domain along y, metres; 0 if the axis is not periodic.
        period_y: f32,
        /// Velocities of the maximum faces, each along its own axis, m/s.
        wall_velocity_max: [f32; 3],
        /// Period of the domain along z, metres; 0 if the axis is not periodic.
        period_z: f32,
    }
);

mirror!(
    /// `FlipParams` of shared/flip_params.wgsl. Lengths in metres; positions relative to the
    /// domain's minimum corner.
    FlipParams {
        /// Minimum faces of the box at the substep's end, displaced by wave makers, metres.
        wall_min: [f32; 3],
        /// Number of particles.
        particle_count: u32,
        /// Maximum faces of the box at the substep's end, displaced by wave makers, metres.
        wall_max: [f32; 3],
        /// 512 times the number of slots with water, without slot 0.
        wet_cells: u32,
        /// Minimum faces of the box at the substep's start, in cells: they cut cells.
        cut_min: [f32; 3],
        /// 512 times the number of slots with water or within reach of it, without slot 0.
        active_cells: u32,
        /// Maximum faces of the box at the substep's start, in cells: they cut cells.
        cut_max: [f32; 3],
        /// Distance between planes of face arrays, in elements.
        stride: u32,
        /// Velocities of the minimum faces, each along its own axis, m/s.
        wall_velocity_min: [f32; 3],
        /// Distance between planes of partial sums, in elements.
        partial_stride: u32,
        /// Velocities of the maximum faces, each along its own axis, m/s.
        wall_velocity_max: [f32; 3],
        /// Length of the substep, seconds.
        time_step: f32,
        /// Gravity times `kick`, m/s.
        velocity_step: [f32; 3],
        /// Cell size Δx, metres.
        cell_size: f32,
        /// Cells of the domain along each axis; storage has one more for the upper faces.
        cells: [u32; 3],
        /// 1/Δx, 1/m.
        inverse_cell_size: f32,
        /// Bricks along each axis of the brick table.
        table_dims: [u32; 3],
        /// PIC fraction α of a substep: the share of the velocity that is taken from the grid.
        pic_blend: f32,
        /// Reciprocal of the number of particles in a full cell.
        particle_share: f32,
        /// Least distance of a particle from a wall or solid, metres.
        contact_distance: f32,
        /// Cap on a particle's displacement in a substep, metres.
        max_displacement: f32,
        /// Particles closer to each other than this are pushed apart, metres.
        apart: f32,
        /// Bit mask of periodic axes: bit k for axis k.
        periodic: u32,
        /// Particles closer to a wall than half of this are pushed away from it, metres.
        apart_from_walls: f32,
        /// Seconds for which gravity, pressure, surface tension, confinement and drag act: half of
        /// the previous substep plus half of this one.
        kick: f32,
        /// Depth below the free surface to which there are particles, cells; 0 if they are
        /// everywhere.
        band: f32,
    }
);

mirror!(
    /// `Phase` of shared/phase.wgsl: the particles that a dispatch handles.
    Phase {
        /// First particle of the chunk; even.
        first: u32,
        /// Threads of the dispatch.
        count: u32,
        /// 1 for all particles, 2 for one colour.
        stride: u32,
        /// Colour, 0 or 1; 0 for all particles.
        colour: u32,
        /// Factor of the Chebyshev semi-iteration; 1 is the plain iteration.
        acceleration: f32,
    }
);

mirror!(
    /// `SolidGrid` of shared/confine.wgsl: a grid of signed distances.
    SolidGrid {
        /// First node, metres, relative to the domain's minimum corner, or to a moving solid's
        /// reference point.
        origin: [f32; 3],
        /// Distance between nodes, metres.
        spacing: f32,
        /// Nodes along each axis.
        dims: [u32; 3],
        /// Index of the grid's first node in `solid_distance`.
        first: u32,
    }
);

mirror!(
    /// `PosedSolid` of shared/moving_solids.wgsl: a solid's pose in a substep.
    PosedSolid {
        /// Grid in the initial pose, relative to the reference point; all static solids form the
        /// first one.
        grid: SolidGrid,
        /// Reference point at the substep's start, metres, relative to the domain's minimum corner.
        centre: [f32; 3],
        /// Distance from there to the grid's farthest corner, metres.
        reach: f32,
        /// Velocity of the reference point, m/s.
        velocity: [f32; 3],
        /// Of a body: distance by which its surface is moved outward where its volume is cut by
        /// cells, metres.
        offset: f32,
        /// Angular velocity about the reference point, rad/s.
        spin: [f32; 3],
        /// Unused.
        padding: f32,
        /// Unit quaternion (x, y, z, w) that rotates from the pose at the substep's start back to
        /// the initial pose.
        back: [f32; 4],
        /// Unit quaternion (x, y, z, w) that rotates from the pose at the substep's end back to the
        /// initial pose.
        end_back: [f32; 4],
    }
);

/// `PosedSolids` of shared/moving_solids.wgsl: poses of all solids in a substep.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PosedSolids {
    /// Number of solids.
    pub count: u32,
    /// Largest speed of any point of any solid, m/s.
    pub fastest: f32,
    /// Length of the substep, seconds.
    pub length: f32,
    /// Unused.
    pub padding: u32,
    /// The solids; all static ones form the first.
    pub solids: [PosedSolid; MAX_MOVING_SOLIDS + 1],
}

impl Default for PosedSolids {
    fn default() -> Self {
        bytemuck::Zeroable::zeroed()
    }
}

impl Element for PosedSolids {
    const SCALAR: Scalar = Scalar::Mixed;
}

impl Mirror for PosedSolids {
    fn layout() -> Layout {
        let member = |name: &str, offset: usize| (name.to_owned(), offset as u32);
        Layout {
            name: "PosedSolids".to_owned(),
            size: size_of::<Self>() as u32,
            members: vec![
                member("count", std::mem::offset_of!(Self, count)),
                member("fastest", std::mem::offset_of!(Self, fastest)),
                member("length", std::mem::offset_of!(Self, length)),
                member("padding", std::mem::offset_of!(Self, padding)),
                member("solids", std::mem::offset_of!(Self, solids)),
            ],
        }
    }
}

mirror!(
    /// `Inlets` of shared/inlets.wgsl: boxes of cells where water enters.
    Inlets {
        /// Number of boxes in use.
        count: u32,
        /// Unused.
        unused: u32,
        /// Unused.
        padding: [u32; 2],
        /// First cell of each box; the fourth component is unused.
        low: [[u32; 4]; MAX_INLETS],
        /// Last cell of each box; the fourth component is unused.
        high: [[u32; 4]; MAX_INLETS],
        /// Rate at which excess water flows out, 1/s, in the first component.
        rate: [[f32; 4]; MAX_INLETS],
    }
);

mirror!(
    /// `Force` of shared/forces.wgsl. Lengths in metres, relative to the domain's minimum corner.
    DeviceForce as "Force" {
        /// Least corner of the room.
        low: [f32; 3],
        /// 1 / depth at which the force is at its full strength, 1/m; 0 for a sharp edge.
        fade_rate: f32,
        /// Greatest corner of the room.
        high: [f32; 3],
        /// Kind: [`swell_domain::forces::ForceKind::number`].
        kind: u32,
        /// The acceleration, m/s², or a point of the axis, or the point that attracts, or the
        /// pivot of the domain's motion.
        at: [f32; 3],
        /// Acceleration at the core radius, m/s², times the fraction of the step in which it acts;
        /// of the domain's motion the square of the angular velocity, 1/s².
        strength: f32,
        /// Unit vector along the axis.
        axis: [f32; 3],
        /// Core radius; of the domain's motion the angular acceleration, 1/s².
        core: f32,
        /// First node of the distances to the room's mesh; of the domain's motion the acceleration
        /// at the pivot, m/s².
        origin: [f32; 3],
        /// Distance between nodes; 0 without a mesh.
        spacing: f32,
        /// Nodes along each axis.
        dims: [u32; 3],
        /// Index of the first node in `force_distance`.
        first: u32,
        /// Exponent of the distance beyond the core.
        falloff: u32,
        /// Unused.
        unused: u32,
        /// Unused.
        padding: [u32; 2],
    }
);

mirror!(
    /// `VelocityTurn` of shared/velocity_turn.wgsl.
    DeviceTurn as "VelocityTurn" {
        /// Unit vector along the axis.
        axis: [f32; 3],
        /// Sine of the angle.
        sine: f32,
        /// 1 minus its cosine.
        rest: f32,
        /// Unused.
        unused: u32,
        /// Unused.
        padding: [u32; 2],
    }
);

mirror!(
    /// `Counters` of shared/counters.wgsl, which passes of both solvers add to over a frame.
    Counters {
        /// Times that a particle's displacement was reduced to the cap.
        capped: u32,
        /// Times that a particle had more neighbours than its list holds. PBF only.
        searched: u32,
        /// Iterations of solves that stop at a density error. PBF only.
        iterations: u32,
        /// Number of non-finite values.
        not_finite: u32,
    }
);

mirror!(
    /// `IterationControl` of shared/iteration_control.wgsl: state of PBF's iteration to a density
    /// error. The pass pbf/decide ends it by setting the sizes of the remaining indirect dispatches
    /// to zero.
    IterationControl {
        /// 1 once the density error is small enough.
        is_done: u32,
        /// Iterations so far.
        iterations: u32,
        /// Unused.
        padding: [u32; 2],
        /// Workgroups of an indirect dispatch over all particles.
        all: Workgroups,
        /// Workgroups of an indirect dispatch over one colour.
        colour: Workgroups,
    }
);

mirror!(
    /// `SurveyHead` of flip/survey.
    SurveyHead {
        /// Largest squared speed, (m/s)². The shader takes an integer maximum of its bits:
        /// non-negative floats sort like their bit patterns.
        speed_square: f32,
        /// Number of particles with non-finite values.
        not_finite: u32,
        /// Unused.
        padding: [u32; 2],
    }
);

/// A [`Brick`] with the device's memory layout.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct DeviceBrick(pub Brick);

impl Element for DeviceBrick {
    const SCALAR: Scalar = Scalar::Mixed;
}

impl Mirror for DeviceBrick {
    fn layout() -> Layout {
        let member = |name: &str, offset: usize| (name.to_owned(), offset as u32);
        Layout {
            name: "Brick".to_owned(),
            size: size_of::<Self>() as u32,
            members: vec![
                member("coordinate", std::mem::offset_of!(Brick, coordinate)),
                member("level", std::mem::offset_of!(Brick, level)),
                member("neighbors", std::mem::offset_of!(Brick, neighbors)),
                member("parent", std::mem::offset_of!(Brick, parent)),
                member("children", std::mem::offset_of!(Brick, children)),
            ],
        }
    }
}
