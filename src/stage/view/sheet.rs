//! A contact sheet: pictures in rows, each with its label below.

use std::fmt::Write as _;

use swell_study::{
    page::escaped,
    raster::{self, RasterError},
    rgb::Rgb,
};

/// A picture of a sheet.
#[derive(Clone, Debug)]
pub(super) struct SheetPicture {
    /// Text below the picture.
    pub(super) label: String,
    /// The picture, already in its final size.
    pub(super) picture: Rgb,
}

/// Margin around everything and between pictures, pixels.
const MARGIN: usize = 16;
/// Height of a label, and of the title with the note below it, pixels.
const LABEL: usize = 22;
const HEAD: usize = 58;
/// Least width of a sheet, pixels; a narrower one has no space for its title.
const LEAST_WIDTH: usize = 480;
/// Approximate width of a letter, pixels.
const LETTER: f64 = 6.6;

/// Draws a sheet with a title, a note, and the pictures in rows of at most `columns`. Smaller
/// pictures are centred in their cells.
///
/// # Errors
/// [`RasterError`] for a sheet that is too large.
pub(super) fn sheet(
    title: &str,
    note: &str,
    cells: &[SheetPicture],
    columns: usize,
) -> Result<Rgb, RasterError> {
    let columns = columns.clamp(1, cells.len().max(1));
    let most = |axis: usize| cells.iter().map(|cell| cell.picture.size[axis]).max();
    let place = [0, 1].map(|axis| most(axis).unwrap_or(1));
    let rows = cells.len().div_ceil(columns);
    let width = (MARGIN + columns * (place[0] + MARGIN)).max(LEAST_WIDTH);
    let height = HEAD + rows * (place[1] + LABEL + MARGIN) + MARGIN;
    let corner = |index: usize| {
        [
            MARGIN + index % columns * (place[0] + MARGIN),
            HEAD + index / columns * (place[1] + LABEL + MARGIN),
        ]
    };
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"14\" fill=\"#d8dbe0\"><rect width=\"100%\" \
         height=\"100%\" fill=\"#17191c\"/><text x=\"{MARGIN}\" y=\"26\" \
         font-size=\"18\">{}</text><text x=\"{MARGIN}\" y=\"46\" fill=\"#9aa0a8\">{}</text>",
        shortened(title, width, 1.3),
        shortened(note, width, 1.0),
    );
    for (index, cell) in cells.iter().enumerate() {
        let [left, top] = corner(index);
        // Writing to a String cannot fail.
        let _ = write!(
            svg,
            "<text x=\"{left}\" y=\"{}\">{}</text>",
            top + place[1] + 16,
            shortened(&cell.label, place[0] + MARGIN, 1.0)
        );
    }
    let mut all = raster::rgb(&(svg + "</svg>"))?;
    for (index, cell) in cells.iter().enumerate() {
        let [left, top] = corner(index);
        let [x, y] = [0, 1].map(|axis| (place[axis] - cell.picture.size[axis]) / 2);
        all.paste(&cell.picture, [left + x, top + y]);
    }
    Ok(all)
}

/// Shortens a text to `width` pixels by replacing its middle with an ellipsis.
fn shortened(text: &str, width: usize, scale: f64) -> String {
    let room = ((width.saturating_sub(MARGIN)) as f64 / (LETTER * scale)) as usize;
    let letters: Vec<char> = text.chars().collect();
    if letters.len() <= room.max(5) {
        return escaped(text);
    }
    let half = room.max(5) / 2;
    let ends = [&letters[..half], &['…'], &letters[letters.len() - half..]].concat();
    escaped(&ends.into_iter().collect::<String>())
}

#[cfg(all(test, feature = "charts"))]
mod tests {
    use super::*;

    fn cell(label: &str, size: [usize; 2], colour: [u8; 3]) -> SheetPicture {
        SheetPicture {
            label: label.to_owned(),
            picture: Rgb::filled(size, colour),
        }
    }

    #[test]
    fn pictures_stand_in_rows_with_their_labels_below() {
        let cells: Vec<SheetPicture> = (0..7u8)
            .map(|k| cell(&format!("frame {k}"), [100, 50], [200, k, 9]))
            .collect();
        let all = sheet("a title", "a note", &cells, 4).unwrap();
        assert_eq!(all.size, [480, HEAD + 2 * (50 + LABEL + MARGIN) + MARGIN]);
        let at = |x: usize, y: usize| all.pixels[y * all.size[0] + x];
        for k in 0..7 {
            let [x, y] = [MARGIN + k % 4 * 116, HEAD + k / 4 * 88];
            for corner in [at(x, y), at(x + 99, y + 49)] {
                assert_eq!(corner, [200, k as u8, 9], "{k}");
            }
            assert_eq!(at(x + 100, y), [0x17, 0x19, 0x1c], "{k}");
            let label = (x..x + 60).flat_map(|x| (y + 52..y + 70).map(move |y| (x, y)));
            let bright = label.filter(|&(x, y)| at(x, y)[1] > 120).count();
            assert!(bright > 20, "{k}: {bright}");
        }
        // Control: there is no eighth picture and no eighth label.
        assert!((364..464).all(|x| (HEAD + 88..HEAD + 160).all(|y| at(x, y)[1] < 40)));
    }

    #[test]
    fn what_is_too_long_loses_its_middle_and_markup_is_text() {
        assert_eq!(shortened("a<b", 300, 1.0), "a&lt;b");
        let short = shortened(&"x".repeat(90), 100, 1.0);
        assert_eq!(short.chars().count(), 13, "{short}");
        assert!(sheet("<&", "", &[cell("</svg>", [40, 40], [0; 3])], 6).is_ok());
        let smaller = [cell("a", [40, 40], [1; 3]), cell("b", [20, 10], [2; 3])];
        let all = sheet("", "", &smaller, 6).unwrap();
        assert_eq!(all.pixels[(HEAD + 20) * all.size[0] + 82], [2; 3]);
    }
}
