//! A frame file: binary little-endian PLY, readable by Blender, MeshLab and Houdini.
//!
//! Positions are world coordinates: `float`, or `double` if the scene has its own origin, which is
//! then recorded in a comment.
//!
//! The header goes through ply-rs-bw; the rows are packed here, some while those before are hashed
//! and written. The ignored test `packed_rows_against_per_property` compares the speed with that of
//! the library's property-by-property path. Another test compares the packed rows with the
//! library's own, byte for byte. [`planes`] holds the same content, compressed.

mod deep;
pub mod planes;

use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    Addable, DefaultElement, ElementDef, Encoding, Header, PropertyDef, PropertyType, ScalarType,
};
use rayon::prelude::*;

use super::error::CacheError;
use swell_domain::{
    deep::Deep,
    particles::{AT_ONCE, Particles},
};

/// Columns of every row, in this order, before the attributes; the first three are the position.
const FIXED: [(&str, ScalarType); 7] = [
    ("x", ScalarType::Float),
    ("y", ScalarType::Float),
    ("z", ScalarType::Float),
    ("vx", ScalarType::Float),
    ("vy", ScalarType::Float),
    ("vz", ScalarType::Float),
    ("id", ScalarType::UInt),
];
/// Bytes of a value; only positions relative to an origin are wider.
const VALUE: usize = 4;
/// Prefix of the comment that records the origin.
const ORIGIN: &str = "origin ";
/// Rows packed at a time: about half a megabyte, so that they stay in the cache until they are
/// hashed and written.
const ROWS_AT_ONCE: usize = 1 << 14;
/// Rows that a thread packs at a time.
const ROWS_OF_A_TASK: usize = 1 << 11;
/// Bytes searched for the header. Our headers have a few hundred bytes; the limit keeps a file
/// without line ends from being read as one line.
const HEADER_LIMIT: usize = 1 << 16;

/// Description of a frame file, written into it as comments.
#[derive(Clone, Copy, Debug)]
pub struct Stamp<'a> {
    /// Program name, `swell`.
    pub program: &'a str,
    /// Version of the program.
    pub program_version: &'a str,
    /// Shot name.
    pub shot: &'a str,
    /// Frame number; 0 is the start.
    pub frame: u32,
    /// Simulated time, seconds.
    pub time: f64,
    /// Offset from the particles' positions to world coordinates, metres. Reading subtracts it
    /// again and restores the same bits as long as the sum is finer than the positions (see
    /// `scene::Scene::origin`).
    pub origin: DVec3,
}

/// Length and BLAKE3 of what was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct WrittenFile {
    /// Length in bytes.
    pub bytes: u64,
    /// BLAKE3 of the bytes.
    pub hash: blake3::Hash,
}

/// Refuses particles that cannot be stored as a frame: arrays of different lengths, ids that do not
/// ascend, attribute names that are taken or that PLY cannot hold.
///
/// # Errors
/// [`CacheError::Unfit`].
pub fn check(particles: &Particles) -> Result<(), CacheError> {
    let n = particles.len();
    let unfit = |what: String| Err(CacheError::Unfit(what));
    if particles.velocity.len() != n || particles.id.len() != n {
        return unfit(format!(
            "{n} positions, {} velocities, {} ids",
            particles.velocity.len(),
            particles.id.len()
        ));
    }
    for (name, values) in &particles.attributes {
        if !is_attribute_name(name) {
            return unfit(format!("`{name}` cannot name an attribute"));
        }
        if values.len() != n {
            return unfit(format!("{n} positions, {} of `{name}`", values.len()));
        }
    }
    if let Some(i) = first_unordered(&particles.id) {
        return unfit(format!("id {} is not in ascending order", particles.id[i]));
    }
    particles.deep.fault().map_or(Ok(()), unfit)
}

fn is_attribute_name(name: &str) -> bool {
    let is_word = name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
    is_word
        && name.starts_with(|c: char| !c.is_ascii_digit())
        && FIXED.iter().all(|(fixed, _)| *fixed != name)
}

fn first_unordered(ids: &[u32]) -> Option<usize> {
    let pairs = ids.par_windows(2).with_min_len(AT_ONCE);
    pairs.position_first(|w| w[0] >= w[1]).map(|i| i + 1)
}

/// Length in bytes of the file that [`encode`] writes.
///
/// # Errors
/// A header that cannot be written.
pub fn length(stamp: &Stamp<'_>, particles: &Particles) -> io::Result<u64> {
    let names = particles.attributes.keys().map(String::as_str);
    let head = header_bytes(&header(stamp, particles.len(), names, &particles.deep))?;
    let rows = particles.len() * row_size(stamp.origin, particles.attributes.len());
    Ok((head.len() + rows + particles.deep.cell.len() * deep::ROW) as u64)
}

/// Writes one frame. The particles must pass [`check`].
///
/// # Errors
/// Those of `out`.
pub fn encode(
    out: &mut impl Write,
    stamp: &Stamp<'_>,
    particles: &Particles,
) -> io::Result<WrittenFile> {
    let names = particles.attributes.keys().map(String::as_str);
    let head = header_bytes(&header(stamp, particles.len(), names, &particles.deep))?;
    let mut out = Counted::new(out);
    out.write_all(&head)?;
    let (mut rows, mut next) = (Vec::new(), Vec::new());
    for first in (0..=particles.len()).step_by(ROWS_AT_ONCE) {
        let end = particles.len().min(first + ROWS_AT_ONCE);
        out.write_beside(&rows, || {
            pack(particles, stamp.origin, first..end, &mut next)
        })?;
        std::mem::swap(&mut rows, &mut next);
    }
    out.write_beside(&rows, || {})?;
    out.write_beside(&deep::pack(&particles.deep), || {})?;
    Ok(out.written())
}

/// A writer that counts and hashes what passes through it.
struct Counted<W> {
    out: W,
    hasher: blake3::Hasher,
    bytes: u64,
}

impl<W: Write> Counted<W> {
    fn new(out: W) -> Self {
        Self {
            out,
            hasher: blake3::Hasher::new(),
            bytes: 0,
        }
    }

    /// Writes all of `buffer` while other threads hash it and do `work`.
    fn write_beside(&mut self, buffer: &[u8], work: impl FnOnce() + Send) -> io::Result<()> {
        self.bytes += buffer.len() as u64;
        let (out, hasher) = (&mut self.out, &mut self.hasher);
        rayon::in_place_scope(|scope| {
            scope.spawn(|_| work());
            scope.spawn(|_| {
                hasher.update_rayon(buffer);
            });
            out.write_all(buffer)
        })
    }

    fn written(self) -> WrittenFile {
        WrittenFile {
            bytes: self.bytes,
            hash: self.hasher.finalize(),
        }
    }
}

impl<W: Write> Write for Counted<W> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let taken = self.out.write(buffer)?;
        self.hasher.update(&buffer[..taken]);
        self.bytes += taken as u64;
        Ok(taken)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

fn header<'a>(
    stamp: &Stamp<'_>,
    count: usize,
    names: impl Iterator<Item = &'a str>,
    deep: &Deep,
) -> Header {
    let mut vertex = ElementDef::new("vertex".to_owned());
    vertex.count = count;
    let attributes = names.map(|name| (name, ScalarType::Float));
    for (name, scalar) in fixed(stamp.origin).chain(attributes) {
        let kind = PropertyType::Scalar(scalar);
        vertex
            .properties
            .add(PropertyDef::new(name.to_owned(), kind));
    }
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.comments = vec![
        format!("{} {}", stamp.program, stamp.program_version),
        format!("shot {}", stamp.shot),
        format!("frame {}", stamp.frame),
        format!("time {}", stamp.time),
    ];
    if stamp.origin != DVec3::ZERO {
        header.comments.push(origin_comment(stamp.origin));
    }
    header.elements.add(vertex);
    deep::add(&mut header, deep);
    header
}

fn origin_comment(origin: DVec3) -> String {
    format!("{ORIGIN}{:?} {:?} {:?}", origin.x, origin.y, origin.z)
}

/// [`FIXED`] with the position type that a scene with this origin uses.
fn fixed<'a>(origin: DVec3) -> impl Iterator<Item = (&'a str, ScalarType)> {
    let is_far = origin != DVec3::ZERO;
    let scalar = move |k: usize, scalar: &ScalarType| match k {
        0..3 if is_far => ScalarType::Double,
        _ => scalar.clone(),
    };
    (FIXED.iter().enumerate()).map(move |(k, (name, kind))| (*name, scalar(k, kind)))
}

/// Bytes of a row.
fn row_size(origin: DVec3, attributes: usize) -> usize {
    let wider = if origin == DVec3::ZERO { 0 } else { 3 * VALUE };
    (FIXED.len() + attributes) * VALUE + wider
}

fn header_bytes(header: &Header) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    ply_rs_bw::writer::Writer::<DefaultElement>::new().write_header(&mut bytes, header)?;
    Ok(bytes)
}

/// Packs the particles in `range` as little-endian rows.
fn pack(particles: &Particles, origin: DVec3, range: std::ops::Range<usize>, rows: &mut Vec<u8>) {
    let columns: Vec<&[f32]> = particles.attributes.values().map(Vec::as_slice).collect();
    let row_size = row_size(origin, columns.len());
    rows.resize(range.len() * row_size, 0);
    let tasks = rows.par_chunks_mut(ROWS_OF_A_TASK * row_size);
    let firsts = range.into_par_iter().step_by(ROWS_OF_A_TASK);
    tasks.zip(firsts).for_each(|(rows, first)| {
        for (row, i) in rows.chunks_exact_mut(row_size).zip(first..) {
            let ([p, v], id) = (
                [particles.position[i], particles.velocity[i]],
                particles.id[i],
            );
            let rest = if origin == DVec3::ZERO {
                put(row, p.map(f32::to_le_bytes))
            } else {
                let world = [0, 1, 2].map(|axis| origin[axis] + f64::from(p[axis]));
                put(row, world.map(f64::to_le_bytes))
            };
            let rest = put(rest, v.map(f32::to_le_bytes));
            let rest = put(rest, [id.to_le_bytes()]);
            for (place, column) in rest.chunks_exact_mut(VALUE).zip(&columns) {
                place.copy_from_slice(&column[i].to_le_bytes());
            }
        }
    });
}

/// Writes values at the start of a row and returns the rest of it.
fn put<const N: usize, const SIZE: usize>(row: &mut [u8], values: [[u8; SIZE]; N]) -> &mut [u8] {
    let (place, rest) = row.split_at_mut(N * SIZE);
    place.copy_from_slice(values.as_flattened());
    rest
}

/// Reads one frame. Strict: refuses whatever [`encode`] would not have written, and checks the
/// length that the header promises before it allocates.
///
/// # Errors
/// [`CacheError::Damaged`] with `file` as its name.
pub fn decode(bytes: &[u8], file: &Path) -> Result<Particles, CacheError> {
    parse(bytes).map_err(|what| CacheError::damaged(file, what))
}

/// The comments in a frame's header, in order.
pub fn comments(bytes: &[u8]) -> Vec<String> {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(HEADER_LIMIT)]);
    let lines = head.lines().take_while(|line| *line != "end_header");
    let comments = lines.filter_map(|line| line.strip_prefix("comment "));
    comments.map(str::to_owned).collect()
}

fn parse(bytes: &[u8]) -> Result<Particles, String> {
    let head = read_head(&bytes[..bytes.len().min(HEADER_LIMIT)])?;
    if head.planes.is_some() {
        return Err("its PLY header is that of a compressed frame".to_owned());
    }
    let rows = &bytes[head.bytes..];
    let of_particles = head.count.checked_mul(head.row_size());
    let of_deep = head.deep.count.checked_mul(deep::ROW);
    let expected = of_particles
        .zip(of_deep)
        .and_then(|(a, b)| a.checked_add(b));
    if expected != Some(rows.len()) {
        return Err(head.misfit(rows.len() as u64));
    }
    let (rows, of_deep) = rows.split_at(head.count * head.row_size());
    let mut unpacked = Unpacked::new(&head, head.count);
    unpacked.add(rows)?;
    let deep = deep::unpack(head.deep, of_deep)?;
    Ok(unpacked.finish(head.names, deep))
}

/// Contents of a header.
struct Head {
    /// Length of the header.
    bytes: usize,
    /// Number of particles.
    count: usize,
    /// World position of the particles' [0, 0, 0], metres.
    origin: DVec3,
    /// Names of the attributes, ascending.
    names: Vec<String>,
    /// The deep cells that follow the particles.
    deep: deep::Promised,
    /// How the byte planes that follow are encoded; `None` if rows follow.
    planes: Option<planes::Content>,
}

impl Head {
    fn row_size(&self) -> usize {
        row_size(self.origin, self.names.len())
    }

    fn misfit(&self, found: u64) -> String {
        let (count, size) = (self.count, self.row_size());
        let deep = match self.deep.count {
            0 => String::new(),
            cells => format!(" and {cells} deep cells of {} bytes", deep::ROW),
        };
        format!(
            "its header declares {count} particles of {size} bytes{deep}, and {found} bytes follow"
        )
    }
}

/// Reads the header at the start of `head`.
fn read_head(head: &[u8]) -> Result<Head, String> {
    let mut reader = Reader::new(head);
    let header = Parser::<DefaultElement>::new()
        .read_header(&mut reader)
        .map_err(|error| {
            let words = error.to_string();
            let first: String = words.lines().take(1).collect();
            format!("PLY header: {first}")
        })?;
    let head = &head[..head.len() - reader.into_inner().len()];
    // The parsed header hides duplicate names, alternative spellings and extra spaces, so it is
    // written again and compared byte for byte.
    if header_bytes(&header).map_err(|e| e.to_string())? != head {
        return Err("its PLY header is not one that swell writes".to_owned());
    }
    let origin = read_origin(&header.comments)?;
    let (count, names, deep) = layout(&header, origin)?;
    Ok(Head {
        bytes: head.len(),
        count,
        origin,
        names,
        deep,
        planes: planes::Content::from_comments(&header.comments),
    })
}

/// The origin in the comments; zero if they have none.
fn read_origin(comments: &[String]) -> Result<DVec3, String> {
    let Some(comment) = comments.iter().find(|c| c.starts_with(ORIGIN)) else {
        return Ok(DVec3::ZERO);
    };
    let numbers = comment[ORIGIN.len()..].split(' ').map(str::parse);
    let numbers: Vec<f64> = numbers.flatten().collect();
    <[f64; 3]>::try_from(numbers)
        .map(DVec3::from_array)
        .ok()
        .filter(|origin| origin.is_finite() && origin_comment(*origin) == *comment)
        .ok_or_else(|| format!("comment `{comment}` is not one that swell writes"))
}

/// Number of rows, names of the attributes, and the deep cells.
fn layout(header: &Header, origin: DVec3) -> Result<(usize, Vec<String>, deep::Promised), String> {
    if header.encoding != Encoding::BinaryLittleEndian || header.version.to_string() != "1.0" {
        return Err("not binary little-endian PLY 1.0".to_owned());
    }
    let mut elements = header.elements.values();
    let (vertex, deep) = match (elements.next(), elements.next(), elements.next()) {
        (Some(vertex), None, None) if vertex.name == "vertex" => (vertex, Default::default()),
        (Some(vertex), Some(deep), None) if vertex.name == "vertex" => {
            (vertex, deep::promised(header, deep)?)
        }
        _ => return Err("its only element is not `vertex`".to_owned()),
    };
    let mut properties = vertex.properties.values();
    for (name, scalar) in fixed(origin) {
        let kind = PropertyType::Scalar(scalar);
        if properties
            .next()
            .is_none_or(|p| p.name != name || p.data_type != kind)
        {
            return Err(format!("property `{name}` is in the wrong position"));
        }
    }
    let mut names = Vec::new();
    for property in properties {
        if property.data_type != PropertyType::Scalar(ScalarType::Float)
            || !is_attribute_name(&property.name)
            || names.last().is_some_and(|last| *last >= property.name)
        {
            return Err(format!(
                "property `{}` is not one that swell writes",
                property.name
            ));
        }
        names.push(property.name.clone());
    }
    Ok((vertex.count, names, deep))
}

/// Particles read so far, row by row.
struct Unpacked {
    particles: Particles,
    columns: Vec<Vec<f32>>,
    origin: DVec3,
    row_size: usize,
}

impl Unpacked {
    /// Empty, with capacity for `room` particles.
    fn new(head: &Head, room: usize) -> Self {
        Self {
            particles: Particles {
                position: Vec::with_capacity(room),
                velocity: Vec::with_capacity(room),
                id: Vec::with_capacity(room),
                ..Particles::default()
            },
            columns: vec![Vec::with_capacity(room); head.names.len()],
            origin: head.origin,
            row_size: head.row_size(),
        }
    }

    /// Appends whole rows.
    fn add(&mut self, rows: &[u8]) -> Result<(), String> {
        let before = self.particles.len().saturating_sub(1);
        for row in rows.chunks_exact(self.row_size) {
            let (position, rest) = if self.origin == DVec3::ZERO {
                let (place, rest) = take(row);
                (place.map(f32::from_le_bytes), rest)
            } else {
                let (place, rest) = take(row);
                let world = DVec3::from_array(place.map(f64::from_le_bytes));
                ((world - self.origin).as_vec3().to_array(), rest)
            };
            let (velocity, rest) = take(rest);
            let ([id], rest) = take(rest);
            self.particles.position.push(position);
            let velocity = velocity.map(f32::from_le_bytes);
            self.particles.velocity.push(velocity);
            self.particles.id.push(u32::from_le_bytes(id));
            for (column, value) in self.columns.iter_mut().zip(rest.as_chunks().0) {
                column.push(f32::from_le_bytes(*value));
            }
        }
        match first_unordered(&self.particles.id[before..]) {
            Some(i) => {
                let i = before + i;
                Err(format!("particle {i}: its id is not in ascending order"))
            }
            None => Ok(()),
        }
    }

    fn finish(mut self, names: Vec<String>, deep: Deep) -> Particles {
        self.particles.deep = deep;
        self.particles.attributes = names.into_iter().zip(self.columns).collect();
        self.particles
    }
}

/// Splits values off the start of a row.
fn take<const N: usize, const SIZE: usize>(row: &[u8]) -> ([[u8; SIZE]; N], &[u8]) {
    let (place, rest) = row.split_at(N * SIZE);
    let mut values = [[0; SIZE]; N];
    values.as_flattened_mut().copy_from_slice(place);
    (values, rest)
}

#[cfg(test)]
mod tests;
