//! `repr(C)` mirrors of the shaders' structs; the WGSL sources document the fields.

use swell_gpu::{
    buffer::{Mirror, mirror},
    reflect::Layout,
};

mirror!(
    /// `Camera` of shared/camera.wgsl.
    Camera {
        position: [f32; 3],
        seconds: f32,
        right: [f32; 3],
        focal: f32,
        up: [f32; 3],
        particle_count: u32,
        forward: [f32; 3],
        radius: f32,
        centre: [f32; 2],
        size: [u32; 2],
        margin: [u32; 2],
        picture: [u32; 2],
        weight: f32,
        sample_index: u32,
        clock: f32,
        frame_seconds: f32,
        corner: [f32; 2],
        near: f32,
        closed: u32,
    }
);

mirror!(
    /// `Moment` of shared/shutter.wgsl.
    Moment {
        position: [f32; 3],
        seconds: f32,
        right: [f32; 3],
        focal: f32,
        up: [f32; 3],
        part: f32,
        forward: [f32; 3],
        since: f32,
        centre: [f32; 2],
        speed: f32,
        seed: u32,
    }
);

mirror!(
    /// `Particle` of shared/ssfr_splat.wgsl.
    Particle {
        position: [f32; 3],
        air: u32,
        velocity: [f32; 3],
        tag: u32,
    }
);

mirror!(
    /// `Page` of shared/ssfr_page.wgsl.
    Page {
        first: u32,
        count: u32,
        aired_first: u32,
        aired_count: u32,
    }
);

mirror!(
    /// `Path` of shared/ssfr_moved.wgsl.
    Path {
        before_square: [f32; 3],
        pad0: f32,
        before_cube: [f32; 3],
        pad1: f32,
        after_square: [f32; 3],
        pad2: f32,
        after_cube: [f32; 3],
        pad3: f32,
    }
);

mirror!(
    /// `SprayParams` of shared/ssfr_spray.wgsl.
    SprayParams {
        density: f32,
        scale: f32,
        range: f32,
        speed: f32,
    }
);

mirror!(
    /// `Shape` of shared/ssfr_ellipsoid.wgsl.
    Shape {
        diagonal: [f32; 3],
        pad0: f32,
        off: [f32; 3],
        pad1: f32,
    }
);

mirror!(
    /// `Shading` of shared/ssfr_light.wgsl.
    Shading {
        sun_direction: [f32; 3],
        roughness: f32,
        sun_irradiance: [f32; 3],
        index: f32,
        absorption: [f32; 3],
        sun_path: f32,
        scattering: [f32; 3],
        spacing: f32,
        ground_colour: [f32; 3],
        ground_variation: f32,
        solid_colour: [f32; 3],
        haze: f32,
        ripple: [f32; 2],
        windows: [f32; 2],
        window_lit: f32,
        window_radiance: f32,
        background: f32,
        disc: f32,
        extent: f32,
        shadow_offset: f32,
        film: [f32; 2],
        irradiance: [[f32; 4]; 9],
        shadow_from_world: [[f32; 4]; 4],
    }
);

mirror!(
    /// `TileGrid` of ssfr/list_tiles.wgsl.
    TileGrid {
        corner: [u32; 2],
        size: [u32; 2],
        tile: [u32; 2],
        frame: [u32; 2],
    }
);

mirror!(
    /// `FlowParams` of shared/ssfr_flow.wgsl.
    Flow as "FlowParams" {
        width: f32,
        world: u32,
        fraction: f32,
        edge: f32,
        steps: u32,
        levels: u32,
        pad0: u32,
        pad1: u32,
    }
);

mirror!(
    /// `FlowLevel` of shared/ssfr_flow.wgsl.
    FlowLevel {
        size: [u32; 2],
        level: u32,
        index: u32,
    }
);

mirror!(
    /// `NarrowParams` of shared/ssfr_narrow.wgsl.
    Narrow as "NarrowParams" {
        width: f32,
        range: f32,
        offset: f32,
        axis: u32,
    }
);

mirror!(
    /// `FillParams` of ssfr/fill.wgsl.
    Fill as "FillParams" {
        word: u32,
        count: u32,
        pad0: u32,
        pad1: u32,
    }
);

mirror!(
    /// `Triangle` of shared/ssfr_solid.wgsl.
    Triangle {
        a: [f32; 3],
        material: u32,
        b: [f32; 3],
        paint: u32,
        c: [f32; 3],
        place: u32,
    }
);

mirror!(
    /// `Material` of shared/materials.wgsl.
    Material {
        colour: [f32; 3],
        windows: f32,
        first: u32,
        size_x: u32,
        size_y: u32,
        levels: u32,
    }
);

mirror!(
    /// `ThicknessParams` of ssfr/splat_thickness.wgsl.
    Thickness as "ThicknessParams" {
        scale: f32,
        pad0: f32,
        pad1: f32,
        pad2: f32,
    }
);

mirror!(
    /// `Block` of ssfr/splat_bulk.wgsl.
    Block {
        low: [f32; 3],
        filled: f32,
        high: [f32; 3],
        pad0: f32,
        velocity: [f32; 3],
        pad1: f32,
    }
);

mirror!(
    /// `Whitewater` of ssfr/splat_whitewater.wgsl.
    Whitewater {
        position: [f32; 3],
        radius: f32,
        velocity: [f32; 3],
        foam: f32,
    }
);

mirror!(
    /// `WhitewaterParams` of ssfr/splat_whitewater.wgsl.
    WhitewaterParams {
        count: u32,
        size: f32,
        density: f32,
        fading: f32,
    }
);

mirror!(
    /// `Tile` of ssfr/solid.wgsl.
    Tile {
        corner: [f32; 2],
        size: [f32; 2],
    }
);

mirror!(
    /// `Band` of shared/ssfr_band.wgsl.
    Band {
        row: u32,
        rows: u32,
        pad0: u32,
        pad1: u32,
    }
);

mirror!(
    /// `Rays` of shared/rays_water.wgsl.
    Rays {
        size: [f32; 3],
        voxel: f32,
        bricks: [u32; 3],
        triangles: u32,
        nodes: [u32; 3],
        pitch: f32,
        walls: u32,
        gap: f32,
        ways: u32,
        pad0: u32,
        set_low: [f32; 3],
        set_step: f32,
    }
);

mirror!(
    /// `Carried` of shared/ssfr_carried.wgsl.
    Carried {
        x: [f32; 4],
        y: [f32; 4],
        z: [f32; 4],
    }
);

mirror!(
    /// `Cloud` of shared/cloud.wgsl.
    Cloud {
        corner: [f32; 3],
        voxel: f32,
        bricks: [u32; 3],
        skin: f32,
        nodes: [u32; 3],
        pitch: f32,
        foam_corner: [f32; 2],
        foam_columns: [u32; 2],
        foam_edge: f32,
        foam_start: u32,
        foam_albedo: f32,
        foam_radius: f32,
    }
);

mirror!(
    /// `Sea` of shared/sea.wgsl.
    Sea {
        size: [f32; 3],
        level: f32,
        low: f32,
        high: f32,
        band: f32,
        hair: f32,
        nodes: [u32; 2],
        lines: u32,
        sides: u32,
    }
);

mirror!(
    /// `Caustics` of shared/caustics.wgsl.
    Caustics {
        towards: [f32; 3],
        index: f32,
        sun: [f32; 3],
        texel: f32,
        corner: [f32; 2],
        size: [u32; 2],
        first: [f32; 2],
        rays: [u32; 2],
        spacing: f32,
        top: f32,
        width: f32,
        fade: f32,
        ripple: [f32; 2],
        through: f32,
        start: u32,
        step: [f32; 2],
        pad0: f32,
        pad1: f32,
    }
);

mirror!(
    /// `SetNode` of shared/rays_set.wgsl.
    SetNode {
        left: [u32; 3],
        left_child: u32,
        right: [u32; 3],
        right_child: u32,
    }
);

impl Triangle {
    /// Material code, without the wetness of the corners.
    pub(super) fn code(&self) -> u32 {
        self.material & 255
    }
}

/// Returns the layouts of all structs that the renderer shares with its shaders, by their WGSL
/// names.
pub fn mirrors() -> Vec<Layout> {
    vec![
        Camera::layout(),
        Moment::layout(),
        Particle::layout(),
        Path::layout(),
        Page::layout(),
        SprayParams::layout(),
        Shape::layout(),
        Shading::layout(),
        Flow::layout(),
        FlowLevel::layout(),
        TileGrid::layout(),
        Narrow::layout(),
        Fill::layout(),
        Triangle::layout(),
        Material::layout(),
        Thickness::layout(),
        Block::layout(),
        Whitewater::layout(),
        WhitewaterParams::layout(),
        Tile::layout(),
        Band::layout(),
        Rays::layout(),
        Cloud::layout(),
        Sea::layout(),
        Caustics::layout(),
        SetNode::layout(),
        Carried::layout(),
    ]
}
