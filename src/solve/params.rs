//! Rust mirrors of the uniforms, which a test holds against naga's layout of the WGSL structs, and of the words that
//! passes count in.

use swell_domain::bricks::Brick;
use swell_gpu::{
    buffer::{Element, Mirror, Scalar, Workgroups, mirror},
    reflect::Layout,
};
use swell_scene::{moving_solid::MAX_MOVING_SOLIDS, sources::MAX_INLETS};

mirror!(
    /// `Params` of shared/pbf_params.wgsl; lengths in metres, positions relative to the domain's least corner.
    Params {
        /// Gravity times time step, m/s.
        velocity_step: [f32; 3],
        /// Fluid particles.
        particle_count: u32,
        /// Cells of edge h along each axis.
        grid_dims: [u32; 3],
        /// Largest correction of one iteration.
        max_correction: f32,
        /// Least faces of the box, wave-makers included.
        wall_min: [f32; 3],
        /// Seconds.
        time_step: f32,
        /// Greatest faces of the box.
        wall_max: [f32; 3],
        /// 1/s; 0 with a time step of 0.
        inverse_time_step: f32,
        /// h.
        support_radius: f32,
        /// 1/h.
        inverse_support_radius: f32,
        /// Index of a particle that is far from everything.
        nobody: u32,
        /// As in `domain::sph`.
        density_scale: f32,
        /// As in `domain::sph`.
        gradient_scale: f32,
        /// As in `domain::sph`.
        wall_density_scale: f32,
        /// ε, 1/m².
        regularization: f32,
        /// ω.
        relaxation: f32,
        /// Least distance from a wall or solid.
        contact_distance: f32,
        /// Of a substep.
        max_displacement: f32,
        /// k times λ's natural scale, m².
        artificial_pressure: f32,
        /// Length of the domain along x where it joins its own end; 0 with walls.
        period_x: f32,
        /// Of the least faces, each along its axis, m/s.
        wall_velocity_min: [f32; 3],
        /// The same along y.
        period_y: f32,
        /// Of the greatest faces.
        wall_velocity_max: [f32; 3],
        /// The same along z.
        period_z: f32,
    }
);

mirror!(
    /// `FlipParams` of shared/flip_params.wgsl; lengths in metres, positions relative to the domain's least
    /// corner.
    FlipParams {
        /// Least faces of the box at the substep's end, wave-makers included.
        wall_min: [f32; 3],
        /// Particles.
        particle_count: u32,
        /// Greatest faces of the box then.
        wall_max: [f32; 3],
        /// Cells of slots with water.
        wet_cells: u32,
        /// Least faces of the box at the substep's start, in cells.
        cut_min: [f32; 3],
        /// Cells of slots with water or within reach.
        active_cells: u32,
        /// Greatest faces of the box then, in cells.
        cut_max: [f32; 3],
        /// Between planes of face arrays, in elements.
        stride: u32,
        /// Of the least faces, each along its axis, m/s.
        wall_velocity_min: [f32; 3],
        /// Between planes of partial sums, in elements.
        partial_stride: u32,
        /// Of the greatest faces, m/s.
        wall_velocity_max: [f32; 3],
        /// Seconds.
        time_step: f32,
        /// Gravity times `kick`, m/s.
        velocity_step: [f32; 3],
        /// Δx.
        cell_size: f32,
        /// Cells of the domain.
        cells: [u32; 3],
        /// 1/Δx.
        inverse_cell_size: f32,
        /// Bricks of the table.
        table_dims: [u32; 3],
        /// α of a substep.
        pic_blend: f32,
        /// One over the particles of a full cell.
        particle_share: f32,
        /// Least distance from a wall or solid.
        contact_distance: f32,
        /// Of a substep.
        max_displacement: f32,
        /// Particles that are nearer to each other are pushed apart.
        apart: f32,
        /// A bit an axis along which the domain joins its own end.
        periodic: u32,
        /// Water is pushed off walls that are nearer than half of this.
        apart_from_walls: f32,
        /// Seconds for which gravity, pressure, surface tension, confinement and drag act: half of the substep before and half of this one.
        kick: f32,
        /// Unused.
        padding: u32,
    }
);

mirror!(
    /// `Phase` of shared/phase.wgsl.
    Phase {
        /// First particle of the chunk; even.
        first: u32,
        /// Threads.
        count: u32,
        /// 1 for all, 2 for one colour.
        stride: u32,
        /// 0 or 1.
        colour: u32,
        /// Factor of the Chebyshev semi-iteration; 1 is the plain one.
        acceleration: f32,
    }
);

mirror!(
    /// `SolidGrid` of shared/confine.wgsl.
    SolidGrid {
        /// Relative to the domain's least corner, or to a moving solid's point of rest.
        origin: [f32; 3],
        /// Metres.
        spacing: f32,
        /// Nodes.
        dims: [u32; 3],
        /// Where its nodes begin in `solid_distance`.
        first: u32,
    }
);

mirror!(
    /// `SolidGrids` of shared/moving_solids.wgsl.
    SolidGrids {
        /// As they lie at the start, from each solid's point of rest; static solids first, as one.
        grids: [SolidGrid; MAX_MOVING_SOLIDS + 1],
        /// Points of rest at the substep's start, relative to the domain's least corner.
        centres: [[f32; 4]; MAX_MOVING_SOLIDS + 1],
        /// Of the points of rest, m/s.
        velocities: [[f32; 4]; MAX_MOVING_SOLIDS + 1],
        /// Angular velocities about them, rad/s.
        spins: [[f32; 4]; MAX_MOVING_SOLIDS + 1],
        /// Quaternions x, y, z, w that turn back to the start, at the substep's start.
        backs: [[f32; 4]; MAX_MOVING_SOLIDS + 1],
        /// At its end.
        end_backs: [[f32; 4]; MAX_MOVING_SOLIDS + 1],
        /// Grids in use.
        count: u32,
        /// The greatest speed of any point, m/s.
        fastest: f32,
        /// Of the substep, seconds.
        length: f32,
        /// Unused.
        padding: u32,
    }
);

mirror!(
    /// `Inlets` of shared/inlets.wgsl.
    Inlets {
        /// Boxes in use.
        count: u32,
        /// Unused.
        unused: u32,
        /// Unused.
        padding: [u32; 2],
        /// First cells along each axis.
        low: [[u32; 4]; MAX_INLETS],
        /// Last cells.
        high: [[u32; 4]; MAX_INLETS],
        /// At which what is too much there flows out, 1/s, first of four.
        rate: [[f32; 4]; MAX_INLETS],
    }
);

mirror!(
    /// `Counters` of shared/counters.wgsl, which passes of both solvers add to over a frame.
    Counters {
        /// Times that a particle was slowed to the displacement cap.
        capped: u32,
        /// Times that a particle of PBF had more neighbours than its list holds.
        searched: u32,
        /// Iterations of PBF until a density error.
        iterations: u32,
        /// Values that are not finite.
        not_finite: u32,
    }
);

mirror!(
    /// `IterationControl` of shared/iteration_control.wgsl: PBF's iteration until a density error, which pbf/decide ends
    /// by emptying the dispatches to come.
    IterationControl {
        /// 1 once the error is small enough.
        is_done: u32,
        /// Iterations so far.
        iterations: u32,
        /// Unused.
        padding: [u32; 2],
        /// Of a dispatch over all particles.
        all: Workgroups,
        /// Of one over a colour.
        colour: Workgroups,
    }
);

mirror!(
    /// `SurveyHead` of flip/survey.
    SurveyHead {
        /// Bits of the largest speed squared, (m/s)²: those of floats that are not negative order as the floats do.
        speed_square: f32,
        /// Particles that are not finite.
        not_finite: u32,
        /// Unused.
        padding: [u32; 2],
    }
);

/// A [`Brick`] in the device's memory.
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
