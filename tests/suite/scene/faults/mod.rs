//! A good scene, and faulty changes to it with their messages.
mod flip;
mod forces;
mod keys;
mod sources;
mod values;
mod zones;

pub use flip::FLIP_FAULTS;
pub use forces::FORCE_FAULTS;
pub use keys::KEY_FAULTS;
pub use sources::SOURCE_FAULTS;
pub use values::VALUE_FAULTS;
pub use zones::ZONE_FAULTS;

pub const SCENE: &str = r#"[shot]
name = "base"
frames = 240
frames_per_second = 60

[domain]
min = [0.0, 0.0, 0.0]
max = [25.0, 12.6, 15.0]

[water]
rest_density = 1000.0
gravity = [0.0, -9.81, 0.0]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [13.4, 1.0, 15.0]

[[solid]]
mesh = "cube.obj"
translate = [18.0, 0.0, 7.0]
scale = 2.0

[[wave_maker]]
wall = "-x"
motion = { kind = "sine", stroke = 1.5, period = 3.0, ramp = 1.0 }

[solver]
method = "pbf"
[solver.pbf]
particle_spacing = 0.1
iterations = 4

[effects]
viscosity = { xsph = 0.01 }

[solver.flip]
cell_size = 0.2
transfer = "flip"
surface = "voxel"
pressure = { preconditioner = "ipp", tolerance = 1e-4 }
"#;

/// Text to replace in the good scene, its replacement, line of the fault, parts of the message. No
/// parts: the change is valid.
pub type Fault = (&'static str, &'static str, usize, &'static [&'static str]);
