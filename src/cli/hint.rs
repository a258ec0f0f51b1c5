//! Options that do what the message of an error advises. The libraries, which make the messages,
//! know no command line.

use std::{borrow::Cow, error::Error, path::Path};

use swell_domain::posix;
use swell_experiment::StudyError;
use swell_files::study::{StudyFileError, tune::TuneError};
use swell_scene::{SceneError, look::LookError};
use swell_stage::{
    bake::BakeError,
    branch::BranchError,
    check::CheckError,
    derived::DerivedError,
    device::{GpuError, SolveError, SolverError},
    diff::DiffError,
    export::{ExportError, UsdcError},
    render::{self, RenderJobError, StreamError},
    verify::CacheError,
    view::ViewError,
    wet::WetError,
    whitewater::WhitewaterError,
};

/// Options or a command; `None` where the message says all.
type Hint = Option<Cow<'static, str>>;

/// Options for an error of a command.
pub(super) fn of(error: &(dyn Error + 'static)) -> Hint {
    (error.downcast_ref().and_then(scene))
        .or_else(|| error.downcast_ref().and_then(look))
        .or_else(|| error.downcast_ref().and_then(study_file))
        .or_else(|| error.downcast_ref().and_then(tune))
        .or_else(|| error.downcast_ref().and_then(bake))
        .or_else(|| error.downcast_ref().and_then(render))
        .or_else(|| error.downcast_ref().and_then(export))
        .or_else(|| error.downcast_ref().and_then(whitewater))
        .or_else(|| error.downcast_ref().and_then(wet))
        .or_else(|| error.downcast_ref().and_then(view))
        .or_else(|| error.downcast_ref().and_then(diff))
        .or_else(|| error.downcast_ref().and_then(study))
        .or_else(|| error.downcast_ref().and_then(check))
        .or_else(|| error.downcast_ref().and_then(device))
}

fn scene(error: &SceneError) -> Hint {
    error.leads_out().then_some("--allow-outside".into())
}

fn look(error: &LookError) -> Hint {
    error.leads_out().then_some("--allow-outside".into())
}

fn study_file(error: &StudyFileError) -> Hint {
    match error {
        StudyFileError::Scene(error) => scene(error),
        StudyFileError::Look(error) => look(error),
    }
}

fn tune(error: &TuneError) -> Hint {
    match error {
        TuneError::Scene(error) => scene(error),
        TuneError::Option { .. } => None,
    }
}

fn bake(error: &BakeError) -> Hint {
    match error {
        BakeError::Scene(error) => scene(error),
        BakeError::Cache(error) => cache(error),
        BakeError::Branch(BranchError::Cache(error)) => cache(error),
        BakeError::Gpu(error) => gpu(error),
        BakeError::Solve(error) => solver(error),
        BakeError::OtherPhysics { .. } => Some("-o".into()),
        BakeError::Budget { failed, .. } => {
            let check = format!("`swell check {}` computes it again", posix::path(failed));
            Some(check.into())
        }
        _ => None,
    }
}

/// Options of a bake that goes on from a frame of another cache.
fn branch_of(dir: &Path) -> String {
    format!("--from {}:FRAME, -o", posix::path(dir))
}

/// Whether a field of a manifest says on what it was baked.
fn is_of_device(field: &str) -> bool {
    ["device", "driver", "backend"].contains(&field)
}

/// Of a cache that a bake writes.
fn cache(error: &CacheError) -> Hint {
    match error {
        CacheError::Exists { .. } => Some("--resume, -o".into()),
        CacheError::OldFormat { dir, .. } => Some(branch_of(dir).into()),
        CacheError::OtherScene { dir, field, .. } if is_of_device(field) => {
            Some(branch_of(dir).into())
        }
        CacheError::Occupied { .. }
        | CacheError::OtherScene { .. }
        | CacheError::OtherProbes { .. }
        | CacheError::OtherParent { .. } => Some("-o".into()),
        _ => None,
    }
}

/// Of any job on an adapter.
fn device(error: &GpuError) -> Hint {
    let is_refused = matches!(error, GpuError::Software { .. });
    is_refused.then_some("--require, SWELL_REQUIRE_GPU".into())
}

/// Of a job that the CPU can do as well.
fn gpu(error: &GpuError) -> Hint {
    let is_other = matches!(error, GpuError::TooManyBuffers { .. });
    is_other
        .then_some("--device cpu".into())
        .or_else(|| device(error))
}

fn solver(error: &SolverError) -> Hint {
    match error {
        SolverError::Gpu(SolveError::Gpu(error)) => gpu(error),
        _ => None,
    }
}

fn render(error: &RenderJobError) -> Hint {
    match error {
        RenderJobError::Look(error) => look(error),
        RenderJobError::Gpu(error) => device(error),
        RenderJobError::NotOneFrame(_) => Some("--frames".into()),
        RenderJobError::Folder(render::FolderError::Other { .. }) => Some("-o, --overwrite".into()),
        RenderJobError::Folder(
            render::FolderError::Left { .. } | render::FolderError::InUse { .. },
        )
        | RenderJobError::IntoCache(_) => Some("-o".into()),
        RenderJobError::Wet(error) => wet(error),
        RenderJobError::Whitewater(StreamError::Missing { stream, cache, .. }) => {
            stream_of("whitewater", cache, stream)
        }
        RenderJobError::Whitewater(StreamError::Frame { .. }) => Some("`swell whitewater`".into()),
        _ => None,
    }
}

/// The command that makes a stream.
fn stream_of(command: &str, cache: &Path, name: &str) -> Hint {
    let command = format!(
        "`swell {command} {} --name {}`",
        posix::path(cache),
        posix::word(name)
    );
    Some(command.into())
}

fn export(error: &ExportError) -> Hint {
    match error {
        ExportError::Nothing => Some("--mesh, --usd, --npy, --csv, --bgeo, --vdb, --fog".into()),
        ExportError::Foam(_) => Some("--foam".into()),
        ExportError::FogVoxel { .. } => Some("--fog-voxel".into()),
        ExportError::Kinds => Some("--stream, --usd-whitewater".into()),
        ExportError::NoFog => Some("--stream".into()),
        ExportError::Look(error) => look(error),
        ExportError::Wet(error) => wet(error),
        ExportError::Taken { .. } => Some("--overwrite".into()),
        ExportError::Usdc(UsdcError::Missing { .. }) => Some("--python".into()),
        ExportError::NoStream { stream, cache, .. } => stream_of("whitewater", cache, stream),
        ExportError::OldStream { .. } => Some("`swell whitewater`".into()),
        _ => None,
    }
}

fn whitewater(error: &WhitewaterError) -> Hint {
    match error {
        WhitewaterError::Gpu(error) => gpu(error),
        WhitewaterError::Solver(error) => solver(error),
        WhitewaterError::Derived(DerivedError::Other { .. }) => Some("--name, --overwrite".into()),
        _ => None,
    }
}

fn wet(error: &WetError) -> Hint {
    match error {
        WetError::Derived(DerivedError::Other { .. }) => Some("--name, --overwrite".into()),
        WetError::TooFine { .. } => Some("--edge".into()),
        WetError::Missing { stream, cache, .. } => stream_of("wet", cache, stream),
        WetError::Unfit { .. } => Some("`swell wet`".into()),
        _ => None,
    }
}

fn check(error: &CheckError) -> Hint {
    match error {
        CheckError::Gpu(error) => device(error),
        _ => None,
    }
}

fn view(error: &ViewError) -> Hint {
    match error {
        ViewError::Nothing => Some("--sheet, --movie, --player".into()),
        ViewError::Foreign(_) => Some("-o".into()),
        ViewError::NoEncoder { .. } => Some("--ffmpeg".into()),
        _ => None,
    }
}

fn diff(error: &DiffError) -> Hint {
    match error {
        DiffError::NoImages => Some("--output".into()),
        DiffError::NoHashes => Some("--ignore-hashes".into()),
        DiffError::OwnTolerances => Some("--tolerance".into()),
        _ => None,
    }
}

fn study(error: &StudyError) -> Hint {
    match error {
        StudyError::Bake(error) => bake(error),
        StudyError::Render(error) => render(error),
        StudyError::Scene(error) => scene(error),
        StudyError::Gpu(error) => device(error),
        StudyError::NoShares(_) => Some("without --chunk".into()),
        StudyError::OtherStudy { .. } | StudyError::Occupied(_) => Some("-o".into()),
        StudyError::NotTuned(_) => Some("--write".into()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_follow_what_an_error_advises() {
        let exists = || CacheError::Exists { dir: "a b".into() };
        let of_bake = BakeError::Cache(exists());
        assert!(!of_bake.to_string().contains("--"));
        assert!(crate::chain(&of_bake).ends_with("or choose another folder (--resume, -o)"));
        let of_study = StudyError::Bake(BakeError::Cache(CacheError::OldFormat {
            dir: "a b".into(),
            found: 1,
            newest: 2,
        }));
        assert_eq!(of(&of_study).as_deref(), Some("--from 'a b':FRAME, -o"));
        let other = |field: &str| {
            let other = CacheError::OtherScene {
                dir: "a b".into(),
                field: field.into(),
                cached: "one".into(),
                given: "another".into(),
            };
            of(&BakeError::Cache(other))
        };
        for field in ["device", "driver", "backend"] {
            assert_eq!(other(field).as_deref(), Some("--from 'a b':FRAME, -o"));
        }
        assert_eq!(other("solver").as_deref(), Some("-o"));
        let of_check = CheckError::Gpu(GpuError::Software {
            adapter: "llvmpipe".into(),
            advice: None,
        });
        assert_eq!(
            of(&of_check).as_deref(),
            Some("--require, SWELL_REQUIRE_GPU")
        );
        // Without a bake there is nothing to resume.
        assert_eq!(of(&exists()), None);
    }
}
