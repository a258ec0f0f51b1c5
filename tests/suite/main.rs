//! Integration tests that span several modules of the library, one test module per area. Tests of a
//! single module are in its own files.
//!
//! One test crate, so that everything is linked once. No test changes state that its process
//! shares: a test that needs its own environment, signals or limits runs `swell` as a process.
#![allow(
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::unwrap_used,
    unreachable_pub,
    reason = "a failed unwrap is a failed test, and what a test prints is shown where it fails"
)]

mod support;

mod cache {
    mod damaged;
    #[cfg(target_os = "linux")]
    mod disk_faults;
    #[cfg(unix)]
    mod durability;
    mod faults;
    mod format;
    mod keep;
    mod probe_forces;
    mod probe_rates;
    mod probes;
    mod vdb;
}
mod check;
mod cli {
    mod bad_input;
    mod expected;
    mod export;
    mod export_foam;
    mod export_fog;
    mod export_look;
    mod farm;
    mod inspect;
    mod pipeline;
    mod preview;
    mod shaders;
    mod shell;
    #[cfg(target_os = "linux")]
    mod terminal;
    mod view;
    mod water;
    mod workers;
}
mod compare {
    mod diff;
    mod renders;
}
mod docs;
mod domain {
    mod circles;
    mod level_set_file;
    mod signed_distance;
}
mod experiment {
    mod hard_cases;
    mod study;
    mod tune;
    mod validation;
}
mod gpu {
    mod ceilings;
    mod compiled;
    mod device_faults;
    mod imprecision;
    mod operations;
    mod raster;
    mod shaders;
    mod sort;
}
mod messages;
mod reference {
    mod densest;
    mod flip;
    mod pbf;
    mod viscous;
}
mod render {
    mod analytic;
    mod delivery;
    mod flicker;
    mod folder;
    mod listed;
    mod outlines;
    mod paged;
    mod parts;
    mod pictures;
    mod planned;
    mod scaled;
    mod scenes;
    mod timed;
}
mod scene {
    mod edits;
    mod faults;
    mod fuzz_inputs;
    mod lint;
    mod meshes;
    mod moving_frame;
    mod shapes;
    mod untrusted;
}
mod solve {
    mod analytic;
    mod analytic_water;
    mod apic_solids;
    mod band;
    mod bodies;
    mod current;
    mod drag;
    mod flip;
    mod flip_passes;
    mod forces;
    mod guided_depth;
    mod independent;
    mod ledgers;
    mod moving_frame;
    mod moving_solids;
    mod no_slip;
    mod paths;
    mod pbf;
    mod periodic;
    mod plan;
    mod pressure;
    mod projected;
    mod shapes;
    mod slope;
    mod sources;
    mod start_blocks;
    mod start_waves;
    mod tension;
    mod thin;
    mod thin_water;
    mod turning_solids;
    mod viscous;
    mod walls;
    mod wave_wall;
    mod whitewater;
    mod zones;
}
mod stage {
    mod absorption;
    mod band;
    mod births;
    mod body_output;
    mod branch;
    mod budget;
    mod device_cpu;
    mod drive;
    mod far_origin;
    mod imprecise;
    mod sources;
    mod substeps;
    mod waiting;
    mod wet;
    mod whitewater;
}
