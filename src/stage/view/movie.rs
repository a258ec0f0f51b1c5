//! Movies: APNG written here, MP4 and WebM by ffmpeg.

use std::{
    fs::File,
    io::{BufWriter, Read as _, Write as _},
    path::Path,
    process::{Child, Command, Stdio},
};

use super::{ViewError, apng::Apng};
use swell_domain::output::{AtPath as _, Draft};
use swell_study::rgb::Rgb;

/// Format of a movie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MovieFormat {
    /// Lossless, large, played by every browser.
    Apng,
    /// H.264.
    Mp4,
    /// VP9.
    Webm,
}

impl MovieFormat {
    /// Determined by the file's extension.
    pub(super) fn of(movie: &Path) -> Result<Self, ViewError> {
        let ending = movie.extension().unwrap_or_default().to_string_lossy();
        match &*ending.to_ascii_lowercase() {
            "apng" => Ok(Self::Apng),
            "mp4" => Ok(Self::Mp4),
            "webm" => Ok(Self::Webm),
            _ => Err(ViewError::Asked(format!(
                "{}: a movie ends in .apng, .mp4 or .webm",
                movie.display()
            ))),
        }
    }

    /// Options for ffmpeg: even sizes, which 4:2:0 chroma needs, and colours converted to and
    /// tagged as Rec. 709.
    fn options(self) -> Vec<&'static str> {
        let codec: &[&str] = match self {
            Self::Mp4 => &[
                "-c:v",
                "libx264",
                "-crf",
                "16",
                "-preset",
                "medium",
                "-movflags",
                "+faststart",
                "-f",
                "mp4",
            ],
            _ => &[
                "-c:v",
                "libvpx-vp9",
                "-crf",
                "24",
                "-b:v",
                "0",
                "-row-mt",
                "1",
                "-f",
                "webm",
            ],
        };
        let picture = [
            "-vf",
            "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv",
            "-pix_fmt",
            "yuv420p",
            "-colorspace",
            "bt709",
            "-color_primaries",
            "bt709",
            "-color_trc",
            "iec61966-2-1",
            "-color_range",
            "tv",
        ];
        [&picture[..], codec].concat()
    }
}

/// A movie being written.
pub(super) struct Movie {
    draft: Draft,
    writer: Option<Writer>,
    program: String,
}

enum Writer {
    Apng(Apng<BufWriter<File>>),
    Ffmpeg(Child),
}

impl Movie {
    /// Starts a movie of `count` frames.
    pub(super) fn begin(
        file: &Path,
        size: [usize; 2],
        count: usize,
        frames_per_second: f64,
        ffmpeg: &str,
    ) -> Result<Self, ViewError> {
        let kind = MovieFormat::of(file)?;
        let draft = Draft::beside(file);
        let part = draft.path();
        let writer = match kind {
            MovieFormat::Apng => {
                let out = File::create(part).at(part)?;
                let begun = Apng::begin(BufWriter::new(out), size, count, frames_per_second);
                Writer::Apng(begun.map_err(encode(file))?)
            }
            _ => Writer::Ffmpeg(encoder(kind, file, part, size, frames_per_second, ffmpeg)?),
        };
        Ok(Self {
            draft,
            writer: Some(writer),
            program: ffmpeg.to_owned(),
        })
    }

    /// Appends the next frame.
    pub(super) fn push(&mut self, frame: &Rgb) -> Result<(), ViewError> {
        match &mut self.writer {
            Some(Writer::Apng(movie)) => movie.push(frame).map_err(encode(self.draft.target())),
            Some(Writer::Ffmpeg(child)) => {
                let put = child
                    .stdin
                    .as_mut()
                    .map(|pipe| pipe.write_all(frame.pixels.as_flattened()));
                // The error is reported when the encoder ends.
                match put {
                    Some(Err(_)) => self.close(),
                    _ => Ok(()),
                }
            }
            None => Ok(()),
        }
    }

    /// Finishes the movie and renames it. Returns its size in bytes.
    pub(super) fn finish(mut self) -> Result<u64, ViewError> {
        self.close()?;
        Ok(self.draft.publish()?)
    }

    fn close(&mut self) -> Result<(), ViewError> {
        match self.writer.take() {
            Some(Writer::Apng(movie)) => movie.finish().map_err(encode(self.draft.target())),
            Some(Writer::Ffmpeg(mut child)) => {
                drop(child.stdin.take());
                let mut said = String::new();
                if let Some(pipe) = &mut child.stderr {
                    let _ = pipe.read_to_string(&mut said);
                }
                let ended = child.wait().at(self.draft.target())?;
                match ended.success() {
                    true => Ok(()),
                    false => Err(ViewError::Encoder {
                        movie: self.draft.target().to_owned(),
                        program: self.program.clone(),
                        said: one_line(&said, &ended.to_string()),
                    }),
                }
            }
            None => Ok(()),
        }
    }
}

impl Drop for Movie {
    fn drop(&mut self) {
        if let Some(Writer::Ffmpeg(mut child)) = self.writer.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn encode(file: &Path) -> impl FnOnce(png::EncodingError) -> ViewError {
    let file = file.to_owned();
    move |source| ViewError::Encode { file, source }
}

fn encoder(
    kind: MovieFormat,
    file: &Path,
    part: &Path,
    [width, height]: [usize; 2],
    frames_per_second: f64,
    ffmpeg: &str,
) -> Result<Child, ViewError> {
    let mut command = Command::new(ffmpeg);
    command
        .args([
            "-hide_banner",
            "-loglevel",
            "error",
            "-y",
            "-f",
            "rawvideo",
            "-pix_fmt",
            "rgb24",
        ])
        .args(["-video_size", &format!("{width}x{height}")])
        .args(["-framerate", &frames_per_second.to_string(), "-i", "-"])
        .args(kind.options())
        // An absolute path, because a name that begins with a hyphen would be read as an option.
        .arg(std::path::absolute(part).at(part)?)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    command.spawn().map_err(|source| ViewError::NoEncoder {
        movie: file.to_owned(),
        program: ffmpeg.to_owned(),
        source,
    })
}

fn one_line(said: &str, else_: &str) -> String {
    let lines = said.lines().map(str::trim).filter(|line| !line.is_empty());
    let lines: Vec<&str> = lines.collect();
    match lines.is_empty() {
        true => else_.to_owned(),
        false => lines.join("; "),
    }
}
