//! `whitewater --dry-run`: what a job would make, without a device, and with nothing written.

use std::path::PathBuf;

use super::{Request, WhitewaterError, asked, hash, other};
use swell_cache::{CacheReader, stream::PARTICLES};

/// What a job would make.
#[derive(Clone, Debug)]
pub struct Expected {
    /// Where the stream goes.
    pub directory: PathBuf,
    /// First frame that would be computed.
    pub first: u32,
    /// Last one.
    pub last: u32,
    /// Frames that stand there, the first aside.
    pub standing: u32,
    /// Bytes of the frames to be computed, each as large as those that stand there on the mean; `None` where none does.
    pub bytes: Option<u64>,
}

/// Looks at the bake and at the stream that stands there, as a job would.
///
/// # Errors
/// Those of [`whitewater`](super::whitewater()) that need no device.
pub fn expected(request: &Request) -> Result<Expected, WhitewaterError> {
    let (cache, last) = asked(request)?;
    let directory = super::directory(&request.cache, &request.name);
    let mut found = Expected {
        first: cache.first_frame() + 1,
        last,
        standing: 0,
        bytes: None,
        directory,
    };
    if swell_cache::exists(&found.directory) && !request.overwrite {
        let stream = CacheReader::open(&found.directory)?;
        if let Some(how) = other(&stream, &hash(&cache, request)?) {
            return Err(WhitewaterError::Other {
                directory: found.directory,
                how,
            });
        }
        found.first = stream.last_frame() + 1;
        let made = stream.entries().iter().skip(1);
        let bytes: u64 = made
            .filter_map(|entry| Some(entry.file(PARTICLES)?.bytes))
            .sum();
        found.standing = stream.last_frame() - stream.first_frame();
        let left = u64::from((last + 1).saturating_sub(found.first));
        let each = bytes.checked_div(found.standing.into());
        found.bytes = each.map(|each| each * left);
    }
    Ok(found)
}
