//! Animated PNG written frame by frame: lossless, and played by every browser.

use std::io::Write;

use png::{BitDepth, ColorType, EncodingError};

use swell_study::rgb::Rgb;

/// An animation that is being written; it loops forever.
pub(super) struct Apng<W: Write> {
    writer: png::Writer<W>,
}

impl<W: Write> Apng<W> {
    /// Starts an animation of `count` frames (at least 1) of `size` pixels (columns, rows).
    ///
    /// # Errors
    /// An error of the writer, or a side longer than PNG allows.
    pub(super) fn begin(
        out: W,
        size: [usize; 2],
        count: usize,
        frames_per_second: f64,
    ) -> Result<Self, EncodingError> {
        let [width, height] = size.map(|side| side as u32);
        let mut encoder = png::Encoder::new(out, width, height);
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        encoder.set_animated(count as u32, 0)?;
        encoder.validate_sequence(true);
        let (seconds, of) = delay(frames_per_second);
        encoder.set_frame_delay(seconds, of)?;
        Ok(Self {
            writer: encoder.write_header()?,
        })
    }

    /// Appends the next frame.
    ///
    /// # Errors
    /// An error of the writer; a frame of another size, or more frames than announced.
    pub(super) fn push(&mut self, frame: &Rgb) -> Result<(), EncodingError> {
        self.writer.write_image_data(frame.pixels.as_flattened())
    }

    /// Finishes the file.
    ///
    /// # Errors
    /// An error of the writer.
    pub(super) fn finish(self) -> Result<(), EncodingError> {
        self.writer.finish()
    }
}

/// Frame delay in seconds as a fraction of two 16-bit numbers: over 1, over 1001 as in
/// broadcasting, or the nearest that fits.
fn delay(frames_per_second: f64) -> (u16, u16) {
    let of = |parts: u16| {
        let many = (frames_per_second * f64::from(parts))
            .round()
            .clamp(1.0, 65535.0);
        let error = (many / f64::from(parts) / frames_per_second - 1.0).abs();
        (error, (parts, many as u16))
    };
    let mut best = of(1);
    for parts in [1001, 1000, 100, 10] {
        let other = of(parts);
        // The first fraction that is close enough has the roundest numbers.
        if best.0 > 1e-6 && other.0 < best.0 {
            best = other;
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_are_those_of_the_rate() {
        for (rate, wanted) in [
            (24.0, (1, 24)),
            (60.0, (1, 60)),
            (24000.0 / 1001.0, (1001, 24000)),
            (12.5, (1000, 12500)),
            (120.0, (1, 120)),
        ] {
            assert_eq!(delay(rate), wanted, "{rate}");
        }
        let (seconds, of) = delay(99.7);
        assert_eq!((seconds, of), (100, 9970));
    }

    #[test]
    fn every_frame_is_read_again_as_it_was() {
        let frame = |k: u8| Rgb {
            size: [3, 2],
            pixels: (0..6).map(|i| [i * 10 + k, k, 255 - k]).collect(),
        };
        let mut bytes = Vec::new();
        let mut movie = Apng::begin(&mut bytes, [3, 2], 4, 24.0).unwrap();
        for k in 0..4 {
            movie.push(&frame(k)).unwrap();
        }
        assert!(movie.push(&frame(4)).is_err(), "one more than there are");
        movie.finish().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
            .read_info()
            .unwrap();
        let animation = *reader.info().animation_control().unwrap();
        assert_eq!((animation.num_frames, animation.num_plays), (4, 0));
        let mut read = vec![0; reader.output_buffer_size().unwrap()];
        for k in 0..4 {
            reader.next_frame(&mut read).unwrap();
            assert_eq!(read, frame(k).pixels.as_flattened(), "{k}");
            let control = reader.info().frame_control().unwrap();
            assert_eq!((control.delay_num, control.delay_den), (1, 24));
        }
    }
}
