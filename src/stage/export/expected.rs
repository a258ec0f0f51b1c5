//! Predicts an export without writing anything.

use std::{collections::BTreeMap, path::Path};

use super::{Content, ExportError, ExportJob, ExportRequest, Target, is_binary, share};

/// Prediction of an export.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct ExpectedExport {
    /// Frames of this process's share.
    pub frames: Vec<u32>,
    /// Those of them whose files all exist.
    pub standing: Vec<u32>,
    /// Number of files to be made.
    pub files: usize,
    /// Predicted bytes of these files, each assumed as large as that of the first frame to be made,
    /// which is computed and discarded for this. `None` if they include binary USD, which another
    /// program writes.
    pub bytes: Option<u64>,
}

/// Examines existing files as an export would; writes nothing.
///
/// # Errors
/// Those of [`export`](super::export).
pub fn expected(request: &ExportRequest) -> Result<ExpectedExport, ExportError> {
    let job = ExportJob::new(request)?;
    let frames = share(&job.frames, request.chunk).to_vec();
    let shots = job.shots()?;
    job.check_all(&frames, &shots)?;
    let mut found = ExpectedExport {
        bytes: Some(0),
        ..ExpectedExport::default()
    };
    for (wanted, bytes) in shots {
        if request.overwrite || !wanted.is_complete() {
            let size = (!is_binary(&wanted.file)).then_some(bytes.len() as u64);
            found.add(size);
        }
    }
    let mut sizes = BTreeMap::new();
    for &frame in &frames {
        let content = Content::new(&job, frame);
        let mut stands = true;
        for (index, (target, wanted)) in job.files(frame)?.into_iter().enumerate() {
            if !request.overwrite && wanted.is_complete() {
                continue;
            }
            stands = false;
            let size = match sizes.get(&index) {
                Some(&size) => size,
                None => {
                    let size = size_of(&job, target, &wanted.file, &content)?;
                    sizes.insert(index, size);
                    size
                }
            };
            found.add(size);
        }
        if stands {
            found.standing.push(frame);
        }
    }
    found.frames = frames;
    Ok(found)
}

/// Bytes of a file, found by computing its content; `None` for binary USD.
fn size_of(
    job: &ExportJob<'_>,
    target: &Target,
    file: &Path,
    content: &Content<'_>,
) -> Result<Option<u64>, ExportError> {
    match is_binary(file) {
        true => Ok(None),
        false => Ok(Some(job.bytes(target, content)?.len() as u64)),
    }
}

impl ExpectedExport {
    fn add(&mut self, size: Option<u64>) {
        self.files += 1;
        self.bytes = self.bytes.zip(size).map(|(all, size)| all + size);
    }
}
