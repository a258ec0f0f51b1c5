//! usda's text: lines, names, arrays.

use std::fmt::Write as _;

use glam::DVec3;

/// A layer on its way.
#[derive(Default)]
pub(super) struct Text {
    out: String,
    depth: usize,
}

impl Text {
    fn indent(&mut self) {
        self.out.extend(std::iter::repeat_n("    ", self.depth));
    }

    pub(super) fn line(&mut self, line: &str) {
        if !line.is_empty() {
            self.indent();
            self.out.push_str(line);
        }
        self.out.push('\n');
    }

    /// A line, nothing where it is empty, and the body that follows it.
    pub(super) fn open(&mut self, line: &str) {
        if !line.is_empty() {
            self.line(line);
        }
        self.line("{");
        self.depth += 1;
    }

    pub(super) fn close(&mut self) {
        self.depth -= 1;
        self.line("}");
    }

    /// `before` and an array.
    pub(super) fn array<T>(&mut self, before: &str, values: &[T], each: impl Fn(&T) -> String) {
        self.indent();
        self.out.push_str(before);
        self.put_array(values, each);
        self.out.push('\n');
    }

    fn put_array<T>(&mut self, values: &[T], each: impl Fn(&T) -> String) {
        self.out.push('[');
        for (k, value) in values.iter().enumerate() {
            if k > 0 {
                self.out.push_str(", ");
            }
            self.out.push_str(&each(value));
        }
        self.out.push(']');
    }

    /// An attribute with a value at each of these frames.
    pub(super) fn samples(&mut self, attribute: &str, samples: &[(u32, String)]) {
        self.line(&format!("{attribute}.timeSamples = {{"));
        for (frame, value) in samples {
            self.line(&format!("    {frame}: {value},"));
        }
        self.line("}");
    }

    /// An array attribute with a value at one frame.
    pub(super) fn sampled_array<T>(
        &mut self,
        attribute: &str,
        frame: u32,
        values: &[T],
        each: impl Fn(&T) -> String,
    ) {
        self.line(&format!("{attribute}.timeSamples = {{"));
        self.array(&format!("    {frame}: "), values, each);
        self.line("}");
    }

    pub(super) fn into_bytes(self) -> Vec<u8> {
        self.out.into_bytes()
    }
}

/// Three values of 32 bits, with the digits that give their bits back.
pub(super) fn floats(values: &[f32; 3]) -> String {
    let mut out = String::with_capacity(40);
    let [x, y, z] = values;
    // Writing to a String cannot fail.
    let _ = write!(out, "({x}, {y}, {z})");
    out
}

/// Three values of 64 bits.
pub(super) fn triple(p: DVec3) -> String {
    format!("({}, {}, {})", p.x, p.y, p.z)
}

/// A name that USD takes: letters, digits and `_`, no digit first.
pub(super) fn name(text: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let name: String = text.chars().map(plain).collect();
    match name.starts_with(|c: char| c.is_ascii_digit()) || name.is_empty() {
        true => format!("_{name}"),
        false => name,
    }
}

/// The name of a file beside the layer, as an asset's. It has no line ends: USD has no way to write them.
pub(super) fn asset(file: &str) -> String {
    match file.contains('@') {
        true => format!("@@@./{}@@@", file.replace("@@@", "\\@@@")),
        false => format!("@./{file}@"),
    }
}

/// In quotes. What is quoted here has no line ends.
pub(super) fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}
