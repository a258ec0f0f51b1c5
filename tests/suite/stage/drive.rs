//! The loop over frames that bakes, replays and studies share.

use std::{
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
};
use swell::files::parse_scene;

use swell::stage::{
    device::{Opened, SolverError},
    drive::{ComputedFrame, Drive, End},
    prepare::Start,
};

const SCENE: &str = r#"
[shot]
name = "block"
frames = 4
frames_per_second = 60
[domain]
min = [0.0, 0.0, 0.0]
max = [0.8, 0.8, 0.4]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [0.4, 0.4, 0.4]
[solver]
method = "flip"
[solver.flip]
cell_size = 0.1
[[probe]]
kind = "pressure"
at = [0.15, 0.05, 0.15]
"#;

fn run(drive: &mut Drive<'_>, stop_after: u32) -> (End, Vec<ComputedFrame>) {
    let stop = AtomicBool::new(stop_after == 0);
    let mut steps: Vec<ComputedFrame> = Vec::new();
    let end = drive.run(4, &stop, |step| {
        stop.store(step.frame >= stop_after, Ordering::Relaxed);
        steps.push(step);
        Ok::<_, SolverError>(())
    });
    (end.unwrap(), steps)
}

#[test]
fn a_drive_stops_between_frames_and_goes_on_from_one() {
    let scene = parse_scene(SCENE, Path::new("block.toml"), Path::new(""), &[]).unwrap();
    let start = Start::of(&scene).unwrap();
    let new = || Drive::new(&Opened::Cpu, &scene, &start, false).unwrap();
    let (end, whole) = run(&mut new(), 9);
    assert_eq!((end, whole.len()), (End::Done, 4));
    let (end, none) = run(&mut new(), 0);
    assert_eq!((end, none.len()), (End::Stopped, 0));
    let (end, first) = run(&mut new(), 2);
    assert_eq!((end, first.len()), (End::Stopped, 2));
    assert_eq!(first[1].particles, whole[1].particles);

    // Another drive that loads the state continues as if uninterrupted; from another
    // state it does not.
    let mut other = new();
    other.load(2, &first[1].particles).unwrap();
    let (_, rest) = run(&mut other, 9);
    let frames: Vec<u32> = rest.iter().map(|step| step.frame).collect();
    assert_eq!(frames, [3, 4]);
    assert_eq!(rest[1].particles, whole[3].particles);
    other.load(2, &first[0].particles).unwrap();
    assert_ne!(run(&mut other, 9).1[1].particles, whole[3].particles);
}

#[test]
fn pressures_are_read_where_they_are_asked_for() {
    let scene = parse_scene(SCENE, Path::new("block.toml"), Path::new(""), &[]).unwrap();
    let start = Start::of(&scene).unwrap();
    let mut drive = Drive::new(&Opened::Cpu, &scene, &start, false).unwrap();
    assert!(drive.advance().unwrap().pressures.is_empty());
    let mut drive = drive.with_pressures();
    let [Some(pressure)] = drive.advance().unwrap().pressures[..] else {
        panic!("one probe in the water")
    };
    assert!(pressure > 0.0);
}

/// An error of the observer ends the run, and no further frame is computed.
#[test]
fn an_observer_s_fault_ends_a_drive() {
    let scene = parse_scene(SCENE, Path::new("block.toml"), Path::new(""), &[]).unwrap();
    let start = Start::of(&scene).unwrap();
    let mut drive = Drive::new(&Opened::Cpu, &scene, &start, false).unwrap();
    let mut seen = 0;
    #[derive(Debug)]
    struct Fault;
    impl From<SolverError> for Fault {
        fn from(error: SolverError) -> Self {
            panic!("{error}")
        }
    }
    let end = drive.run(4, &AtomicBool::new(false), |_| {
        seen += 1;
        Err(Fault)
    });
    assert!(end.is_err() && seen == 1);
}
