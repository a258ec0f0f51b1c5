//! Part names and texture coordinates of each triangle of a mesh. They are for rendering only; the
//! mesh does not depend on them.

use std::{collections::HashMap, path::Path};

use glam::Vec2;

use super::{MeshError, MeshFormat, Welded, lines_of, obj, quoted, welded, without_mark};

/// Texture coordinates of a triangle's corners: u to the right, v upward.
pub type Places = [[f32; 2]; 3];

/// Parts of a mesh, for each triangle in the mesh's order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshParts {
    /// Names of each part: of its material (`usemtl`), then of its groups (`g`), then of its object
    /// (`o`). Only OBJ has names.
    pub names: Vec<Vec<String>>,
    /// Index in `names` of each triangle's part.
    pub of: Vec<u32>,
    /// Texture coordinates of each triangle; `None` if one of its corners has none. Empty if no
    /// triangle has any.
    pub places: Vec<Option<Places>>,
}

impl MeshParts {
    /// Reads the parts of the mesh that [`crate::mesh::TriangleMesh::from_bytes`] reads from the
    /// same bytes.
    ///
    /// # Errors
    /// The same errors; also a texture coordinate (`vt`) that is not a number, or a corner that
    /// refers to a missing one.
    pub fn from_bytes(bytes: &[u8], format: MeshFormat, file: &Path) -> Result<Self, MeshError> {
        let fail = |detail| MeshError::Malformed {
            file: file.to_owned(),
            detail,
        };
        let welded = welded(bytes, format, file)?;
        if format != MeshFormat::Obj {
            return Ok(Self {
                names: vec![Vec::new()],
                of: vec![0; welded.corners.len()],
                places: Vec::new(),
            });
        }
        let found = PartsReader::of_file(bytes).map_err(fail)?;
        // Both readers must count the same corners.
        if found.corners.len() != welded.in_file {
            return Err(fail("its faces are counted in two ways".into()));
        }
        Ok(found.into_parts(&welded))
    }

    /// Swaps the second and third corner of each triangle, for a mesh that was mirrored.
    pub fn turn(&mut self) {
        for places in self.places.iter_mut().flatten() {
            places.swap(1, 2);
        }
    }
}

/// A corner of a face.
struct Corner {
    part: u32,
    /// Number of its texture coordinate, counted from 1, and the line of its face.
    named: Option<(i64, usize)>,
}

#[derive(Default)]
struct PartsReader {
    coordinates: Vec<[f32; 2]>,
    material: String,
    groups: Vec<String>,
    object: String,
    /// Part number of each list of names.
    numbers: HashMap<Vec<String>, u32>,
    /// Part of the faces that follow; `None` until there is one.
    current: Option<u32>,
    corners: Vec<Corner>,
    names: Vec<Vec<String>>,
}

impl PartsReader {
    /// Reads all corners of an OBJ file, in the order of its faces.
    fn of_file(bytes: &[u8]) -> Result<Self, String> {
        let text = lines_of(without_mark(bytes)?);
        let mut reader = Self::default();
        for (number, line) in obj::statements(&text) {
            reader.add(number, &line)?;
        }
        reader.check()?;
        Ok(reader)
    }

    fn add(&mut self, number: usize, line: &str) -> Result<(), String> {
        let line = line.trim_start();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        match word {
            "vt" => {
                let mut numbers = rest.split_whitespace().map(str::parse::<f32>);
                let u = numbers.next();
                // A one-dimensional texture has only u.
                let (Some(Ok(u)), Ok(v)) = (u, numbers.next().unwrap_or(Ok(0.0))) else {
                    return Err(format!(
                        "line {number}: a texture coordinate needs numbers: {}",
                        quoted(line)
                    ));
                };
                if !(u.is_finite() && v.is_finite()) {
                    return Err(format!(
                        "line {number}: a texture coordinate is not finite: {}",
                        quoted(line)
                    ));
                }
                self.coordinates.push([u, v]);
            }
            "usemtl" => self.name(|it| it.material = rest.to_owned()),
            "g" => {
                let groups = rest.split_whitespace().map(str::to_owned);
                self.name(|it| it.groups = groups.collect());
            }
            "o" => self.name(|it| it.object = rest.to_owned()),
            "f" => self.face(number, rest)?,
            _ => {}
        }
        Ok(())
    }

    fn name(&mut self, set: impl FnOnce(&mut Self)) {
        set(self);
        self.current = None;
    }

    fn face(&mut self, number: usize, rest: &str) -> Result<(), String> {
        let part = self.part();
        let count = self.coordinates.len() as i64;
        for word in rest.split_whitespace() {
            let index = word.split('/').nth(1).filter(|index| !index.is_empty());
            let named = match index {
                None => None,
                Some(index) => Some(obj::index_of(index, count).ok_or_else(|| {
                    format!(
                        "line {number}: {} is not a valid texture coordinate index",
                        quoted(word)
                    )
                })?),
            };
            let named = named.map(|index| (index, number));
            self.corners.push(Corner { part, named });
        }
        Ok(())
    }

    fn part(&mut self) -> u32 {
        if let Some(part) = self.current {
            return part;
        }
        let own = std::iter::once(&self.material)
            .chain(&self.groups)
            .chain([&self.object]);
        let names: Vec<String> = own.filter(|name| !name.is_empty()).cloned().collect();
        let next = self.names.len() as u32;
        let part = *self.numbers.entry(names.clone()).or_insert(next);
        if part == next {
            self.names.push(names);
        }
        self.current = Some(part);
        part
    }

    /// Checks the indices at the end, because coordinates may follow the faces that refer to them.
    fn check(&self) -> Result<(), String> {
        let count = self.coordinates.len();
        let named = self.corners.iter().filter_map(|corner| corner.named);
        for (index, number) in named {
            if self.coordinate(index).is_none() {
                return Err(format!(
                    "line {number}: the face refers to texture coordinate \
                     {index}, but there are {count}"
                ));
            }
        }
        Ok(())
    }

    fn coordinate(&self, index: i64) -> Option<Vec2> {
        let at = usize::try_from(index - 1).ok()?;
        self.coordinates.get(at).copied().map(Vec2::from_array)
    }

    fn into_parts(self, welded: &Welded) -> MeshParts {
        let file = |corner: u32| self.corners.get(corner as usize);
        // Corners of split triangles: their ends come before them in the list.
        let mut between: Vec<(u32, Option<Vec2>)> = Vec::with_capacity(welded.between.len());
        let of = |corner: u32, between: &[(u32, Option<Vec2>)]| match file(corner) {
            Some(Corner { part, named }) => {
                (*part, named.and_then(|(index, _)| self.coordinate(index)))
            }
            None => between[corner as usize - welded.in_file],
        };
        for it in &welded.between {
            let [(part, from), (_, to)] = it.ends.map(|end| of(end, &between));
            let place = from.zip(to).map(|(from, to)| from.lerp(to, it.part as f32));
            between.push((part, place));
        }
        let triangles = welded.corners.iter();
        let found = triangles.map(|t| t.map(|corner| of(corner, &between)));
        let (of, mut places): (Vec<_>, Vec<_>) = found
            .map(|[a, b, c]| {
                (
                    a.0,
                    match [a.1, b.1, c.1] {
                        [Some(a), Some(b), Some(c)] => {
                            Some([a, b, c].map(|place| place.to_array()))
                        }
                        _ => None,
                    },
                )
            })
            .unzip();
        if places.iter().all(Option::is_none) {
            places.clear();
        }
        MeshParts {
            names: self.names,
            of,
            places,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use super::*;
    use crate::mesh::TriangleMesh;

    const FILE: &str = "mtllib a.mtl\no hut\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\n\
        vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl wall\nf 1/1 2/2 3/3 4/4\nf 1 1 2\ng front left\n\
        usemtl roof\nf 1//1 2//1 5/\n";

    fn parts(text: &str) -> Result<MeshParts, MeshError> {
        MeshParts::from_bytes(text.as_bytes(), MeshFormat::Obj, Path::new("a.obj"))
    }

    #[test]
    fn each_triangle_has_its_names_and_its_corners_coordinates() {
        let found = parts(FILE).unwrap();
        let mesh =
            TriangleMesh::from_bytes(FILE.as_bytes(), MeshFormat::Obj, Path::new("a.obj")).unwrap();
        // Both drop the sliver.
        assert_eq!(mesh.triangles.len(), 3);
        assert_eq!(found.names[0], ["wall", "hut"]);
        assert_eq!(found.names[1], ["roof", "front", "left", "hut"]);
        assert_eq!(found.of, [0, 0, 1]);
        // The texture coordinates equal x and y of their vertex.
        for (k, places) in found.places.iter().enumerate().take(2) {
            let corners = mesh.corners(k).map(|p| [p.x as f32, p.y as f32]);
            assert_eq!(places.unwrap(), corners, "triangle {k}");
        }
        assert_eq!(found.places[2], None);
        let turned = parts(&FILE.replace("2/2 3/3 4/4", "2/3 3/2 4/4")).unwrap();
        assert_ne!(turned.places[0], found.places[0], "the control");
    }

    #[test]
    fn what_is_turned_inside_out_keeps_its_corners_coordinates() {
        // A tetrahedron whose faces point inward: the reader reverses them.
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nvt 0 0\n\
            f 1/1 2/2 3/3\nf 1/1 4/4 2/2\nf 1/1 3/3 4/4\nf 2/2 4/4 3/3\n";
        let found = parts(text).unwrap();
        let mesh =
            TriangleMesh::from_bytes(text.as_bytes(), MeshFormat::Obj, Path::new("a.obj")).unwrap();
        assert!(mesh.signed_volume() > 0.0);
        for (k, places) in found.places.iter().enumerate() {
            let corners = mesh.corners(k).map(|p| [p.x as f32, p.y as f32]);
            assert_eq!(places.unwrap(), corners, "triangle {k}");
        }
    }

    /// Polygons that are not convex, and corners inserted into the neighbours of triangles
    /// without area.
    #[test]
    fn cut_polygons_and_split_triangles_keep_their_corners_coordinates() {
        // The texture coordinates equal x and y of their vertex. The last face has no area: its
        // corner 7 is inserted into the bay's first edge.
        let text = "v 0 0 0\nv 3 0 0\nv 3 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0.75 0 0\n\
            vt 0 0\nvt 3 0\nvt 3 1\nvt 1 1\nvt 1 2\nvt 0 2\nvt 9 9\n\
            g bay\nf 1/1 2/2 3/3 4/4 5/5 6/6\ng needle\nf 2/2 1/1 7/7\n";
        let found = parts(text).unwrap();
        let mesh =
            TriangleMesh::from_bytes(text.as_bytes(), MeshFormat::Obj, Path::new("a.obj")).unwrap();
        assert_eq!((mesh.triangles.len(), mesh.area()), (5, 4.0));
        assert_eq!((found.of.len(), found.places.len()), (5, 5));
        let bay = found.names.iter().position(|names| names == &["bay"]);
        assert!(found.of.iter().all(|part| Some(*part as usize) == bay));
        let mut split = 0;
        for (k, places) in found.places.iter().enumerate() {
            let corners = mesh.corners(k).map(|p| [p.x as f32, p.y as f32]);
            assert_eq!(places.unwrap(), corners, "triangle {k}");
            split += corners.iter().filter(|p| **p == [0.75, 0.0]).count();
        }
        assert_eq!(split, 2);
    }

    #[test]
    fn a_bad_coordinate_is_told_with_its_line() {
        for (from, to, words) in [
            (
                "vt 1 1",
                "vt 1 x",
                "line 10: a texture coordinate needs numbers",
            ),
            (
                "vt 1 1",
                "vt",
                "line 10: a texture coordinate needs numbers",
            ),
            (
                "vt 1 1",
                "vt nan 0",
                "line 10: a texture coordinate is not finite",
            ),
            (
                "3/3 4/4",
                "3/3 4/5",
                "line 13: the face refers to texture coordinate 5, but there are 4",
            ),
            (
                "3/3 4/4",
                "3/3 4/0",
                "line 13: \"4/0\" is not a valid texture coordinate index",
            ),
            (
                "3/3 4/4",
                "3/3 4/-9",
                "line 13: \"4/-9\" is not a valid texture coordinate index",
            ),
            (
                "3/3 4/4",
                "3/3 4/99999999999999999999",
                "line 13: \"4/99999999999999999999\" is not a valid texture coordinate index",
            ),
        ] {
            let text = FILE.replacen(from, to, 1);
            assert_ne!(text, FILE);
            let error = parts(&text).unwrap_err().to_string();
            assert!(error.contains(words), "{from} -> {to}: {error}");
            // The mesh still loads: no bake is refused for what it does not use.
            TriangleMesh::from_bytes(text.as_bytes(), MeshFormat::Obj, Path::new("a.obj")).unwrap();
        }
    }

    #[test]
    fn other_formats_are_one_part_without_a_name() {
        let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
            property float z\n\
            element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n\
            0 1 0\n3 0 1 2\n";
        let found =
            MeshParts::from_bytes(ply.as_bytes(), MeshFormat::Ply, Path::new("a.ply")).unwrap();
        assert_eq!(found.names, [Vec::<String>::new()]);
        assert_eq!((found.of, found.places), (vec![0], Vec::new()));
    }
}
