//! Files that users write: scenes, looks, studies, tolerances and whitewater settings.
//!
//! Each key is declared once, in [`keys`]; reading, ranges, messages, defaults and the page of keys
//! follow from it. What is read becomes the validated types of `swell-scene`.

pub mod edit;
pub mod keys;
pub mod look;
pub mod measure;
pub mod rig;
pub mod study;
pub mod tolerance;
pub mod whitewater;

mod absorption;
mod axis;
mod band;
mod body;
mod budget;
mod build;
mod builder;
mod declare;
mod difference;
mod document;
mod effects;
mod fit;
mod forces;
mod frame;
mod gltf_nodes;
mod grids;
mod keep;
mod key;
mod load;
mod mesh_sequence;
mod motion;
mod motion_table;
mod moving_solid;
mod no_slip;
mod open_waves;
mod overrides;
mod periodic;
mod placed_mesh;
mod probe;
mod reach;
mod regular_waves;
mod seas;
mod settle;
mod simulated_depth;
mod solid_track;
mod sources;
mod speed;
mod start_waves;
#[cfg(test)]
mod tests;
mod toml_text;
mod usd_nodes;
mod usda;
mod wave_maker;
mod write;

pub use builder::SceneBuilder;
pub use difference::{physics_difference, physics_hash};
pub use load::{load_scene, load_scene_within, parse_scene, parse_scene_within, recorded_scene};
pub use look::{load_look, load_look_with, load_look_within, parse_look};
pub use reach::Reach;
pub use write::scene_to_toml;
