//! Text of usda: lines, names, arrays.

use std::fmt::Write as _;

use glam::DVec3;

/// A layer under construction.
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

    /// Writes a line, unless it is empty, and opens the body that follows it.
    pub(super) fn open(&mut self, line: &str) {
        if !line.is_empty() {
            self.line(line);
        }
        self.line("{");
        self.depth += 1;
    }

    /// Writes the line of a prim with one line of metadata, and opens the prim's body.
    pub(super) fn open_with(&mut self, line: &str, metadata: &str) {
        self.line(&format!("{line} ("));
        self.line(&format!("    {metadata}"));
        self.line(")");
        self.open("");
    }

    pub(super) fn close(&mut self) {
        self.depth -= 1;
        self.line("}");
    }

    /// Writes `before` and an array.
    pub(super) fn array<T>(&mut self, before: &str, values: &[T], each: impl Fn(&T) -> String) {
        self.indent();
        self.out.push_str(before);
        self.put_array(values, each);
        self.out.push('\n');
    }

    /// Writes an array attribute with its interpolation over the prim.
    pub(super) fn primvar<T>(
        &mut self,
        attribute: &str,
        interpolation: &str,
        values: &[T],
        each: impl Fn(&T) -> String,
    ) {
        self.indent();
        self.out.push_str(&format!("{attribute} = "));
        self.put_array(values, each);
        self.out
            .push_str(&format!(" (interpolation = {})\n", quoted(interpolation)));
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

    /// Writes an attribute with a value at each of these frames.
    pub(super) fn samples(&mut self, attribute: &str, samples: &[(u32, String)]) {
        self.line(&format!("{attribute}.timeSamples = {{"));
        for (frame, value) in samples {
            self.line(&format!("    {frame}: {value},"));
        }
        self.line("}");
    }

    /// Writes an array attribute with a value at one frame.
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

    /// Writes an array attribute with a value at each of these frames.
    pub(super) fn array_samples<T>(
        &mut self,
        attribute: &str,
        samples: impl Iterator<Item = (u32, Vec<T>)>,
        each: impl Fn(&T) -> String,
    ) {
        self.line(&format!("{attribute}.timeSamples = {{"));
        for (frame, values) in samples {
            self.indent();
            self.out.push_str(&format!("    {frame}: "));
            self.put_array(&values, &each);
            self.out.push_str(",\n");
        }
        self.line("}");
    }

    pub(super) fn into_bytes(self) -> Vec<u8> {
        self.out.into_bytes()
    }
}

/// Formats three 32-bit values with enough digits to restore their bits.
pub(super) fn floats(values: &[f32; 3]) -> String {
    let mut out = String::with_capacity(40);
    let [x, y, z] = values;
    // Writing to a String cannot fail.
    let _ = write!(out, "({x}, {y}, {z})");
    out
}

/// Formats three 64-bit values.
pub(super) fn triple(p: DVec3) -> String {
    format!("({}, {}, {})", p.x, p.y, p.z)
}

/// Converts a text to a valid USD name: letters, digits and `_`, no digit first.
pub(super) fn name(text: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let name: String = text.chars().map(plain).collect();
    match name.starts_with(|c: char| c.is_ascii_digit()) || name.is_empty() {
        true => format!("_{name}"),
        false => name,
    }
}

/// Valid names for prims beside each other with these names, each once.
pub(super) fn unique<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut taken: Vec<String> = Vec::new();
    for wanted in names.map(name) {
        let numbered = (2u32..).map(|k| format!("{wanted}_{k}"));
        let mut free = std::iter::once(wanted.clone()).chain(numbered);
        taken.extend(free.find(|name| !taken.contains(name)));
    }
    taken
}

/// Formats the name of a file beside the layer as an asset path. It must not contain line ends,
/// which USD cannot express.
pub(super) fn asset(file: &str) -> String {
    match file.contains('@') {
        true => format!("@@@./{}@@@", file.replace("@@@", "\\@@@")),
        false => format!("@./{file}@"),
    }
}

/// Quotes a text, which must not contain line ends.
pub(super) fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}
