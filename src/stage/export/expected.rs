//! `export --dry-run`: what an export would make, with nothing written.

use std::{collections::BTreeMap, path::Path};

use super::{Content, ExportError, Job, Request, Target, is_binary, share};

/// What an export would make.
#[derive(Clone, Debug, Default)]
pub struct Expected {
    /// Frames of this process's share.
    pub frames: Vec<u32>,
    /// Those of them whose files all stand there.
    pub standing: Vec<u32>,
    /// Files to be made.
    pub files: usize,
    /// Bytes of them: each as large as that of the first frame to be made, which was made for that and thrown away. `None` where binary
    /// USD is among them, which another program makes.
    pub bytes: Option<u64>,
}

/// Looks at what stands there, as an export would, and writes nothing.
///
/// # Errors
/// Those of [`export`](super::export).
pub fn expected(request: &Request) -> Result<Expected, ExportError> {
    let job = Job::new(request)?;
    let frames = share(&job.frames, request.chunk).to_vec();
    let shots = job.shots()?;
    job.check_all(&frames, &shots)?;
    let mut found = Expected {
        bytes: Some(0),
        ..Expected::default()
    };
    for (wanted, bytes) in shots {
        if request.overwrite || !wanted.stands() {
            let size = (!is_binary(&wanted.file)).then_some(bytes.len() as u64);
            found.add(size);
        }
    }
    let mut sizes = BTreeMap::new();
    for &frame in &frames {
        let content = Content::new(&job, frame);
        let mut stands = true;
        for (index, (target, wanted)) in job.files(frame)?.into_iter().enumerate() {
            if !request.overwrite && wanted.stands() {
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

/// Bytes of a file, which is made for that; `None` of binary USD.
fn size_of(
    job: &Job<'_>,
    target: &Target,
    file: &Path,
    content: &Content<'_>,
) -> Result<Option<u64>, ExportError> {
    match is_binary(file) {
        true => Ok(None),
        false => Ok(Some(job.bytes(target, content)?.len() as u64)),
    }
}

impl Expected {
    fn add(&mut self, size: Option<u64>) {
        self.files += 1;
        self.bytes = self.bytes.zip(size).map(|(all, size)| all + size);
    }
}
