//! Triangles drawn into textures, and textures copied into buffers.

use swell::gpu::{
    adapter::GpuError,
    buffer::Buf,
    program::Program,
    raster::{CopyTexture, DEPTH, Draw, RasterSpec, Target},
    recording::{Command, Recording},
    texture::TextureSpec,
};

const MATRIX: Buf<[f32; 16]> = Buf::uniform("shadow_from_world");
/// Corners of a triangle, each with a word of padding.
const TRIANGLE: Buf<[f32; 4]> = Buf::new("triangles");
const COPY: Buf<f32> = Buf::new("copy");
const SIZE: [u32; 2] = [64, 8];

const SHADOW: RasterSpec = RasterSpec {
    name: "ssfr/shadow",
    colours: &[],
    compare: wgpu::CompareFunction::Less,
    defines: &[],
};

/// Depths of the picture after a triangle over its lower left half was drawn at depth 0.25, in
/// front of the far depth 0.5.
fn drawn(raster: RasterSpec) -> Vec<f32> {
    let context = crate::support::context();
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    let buffers = [MATRIX.sized(1), TRIANGLE.sized(3), COPY.sized(pixels)];
    let map = TextureSpec {
        name: "map".into(),
        size: SIZE,
        format: DEPTH,
    };
    assert_eq!(map.bytes(), 4 * pixels as u64);
    let program = Program::new(&context, &buffers, &[], &[])
        .unwrap()
        .with_rasters(&[raster])
        .unwrap()
        .with_textures(&[map], &[])
        .unwrap();
    let identity: [f32; 16] = std::array::from_fn(|i| if i % 5 == 0 { 1.0 } else { 0.0 });
    program.upload(MATRIX, 0, &[identity]);
    let corner = |x: f32, y: f32| [x, y, 0.25, 0.0];
    let triangle = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0)];
    program.upload(TRIANGLE, 0, &triangle);
    let commands = [
        Command::Draw(Draw {
            raster,
            binds: Vec::new(),
            vertices: 3,
            colours: Vec::new(),
            depth: Target {
                texture: "map".into(),
                clear: 0.5,
                is_kept: true,
            },
        }),
        Command::CopyTexture(CopyTexture {
            texture: "map".into(),
            buffer: COPY.name().into(),
            offset: 0,
            bytes_per_row: 4 * SIZE[0],
        }),
    ];
    let recording = Recording::new(&program, &commands);
    assert_eq!(recording.passes().collect::<Vec<_>>(), ["ssfr/shadow"]);
    recording.run(&program, None).unwrap();
    program.read(COPY, pixels).unwrap()
}

#[test]
fn a_triangle_hides_what_is_farther() {
    let depth = drawn(SHADOW);
    let at = |x: usize, y: usize| depth[y * SIZE[0] as usize + x];
    assert_eq!([at(0, 7), at(40, 7), at(0, 1)], [0.25; 3]);
    assert_eq!([at(63, 0), at(63, 6), at(40, 1)], [0.5; 3]);
    // Negative control: with the comparison inverted nothing is drawn.
    let far = drawn(RasterSpec {
        compare: wgpu::CompareFunction::Greater,
        ..SHADOW
    });
    assert!(far.iter().all(|depth| *depth == 0.5));
}

#[test]
fn a_pass_without_fragments_draws_no_colour() {
    let context = crate::support::context();
    let coloured = RasterSpec {
        colours: &[wgpu::TextureFormat::R32Float],
        ..SHADOW
    };
    let program = || Program::new(&context, &[], &[], &[]).unwrap();
    let refused = program().with_rasters(&[coloured]).unwrap_err();
    assert!(matches!(refused, GpuError::Shader { .. }), "{refused}");
    assert!(program().with_rasters(&[SHADOW]).is_ok(), "the control");
}
