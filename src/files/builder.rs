//! Builds a scene in code, through the same validation as scene files.

use std::path::{Path, PathBuf};

use toml::{Table, Value};

use swell_scene::{Fault, Place, Scene, SceneError, Wall};

use super::parse_scene;

/// A scene under construction; [`SceneBuilder::new`] begins one.
///
/// Every key of a scene file can be given, and [`build`](Self::build) validates them and fills in
/// defaults as for a file. `docs/keys.md` lists the keys with their units, ranges and defaults.
///
/// ```
/// use swell_files::SceneBuilder;
/// use swell_scene::Wall;
///
/// let scene = SceneBuilder::new("flume")
///     .frames(48, 24.0)
///     .domain([0.0; 3], [4.0, 1.0, 0.5])
///     .block([0.0; 3], [4.0, 0.5, 0.5])
///     .wave_maker(Wall::NEG_X, r#"kind = "sine", stroke = 0.1, period = 1.5"#)
///     .flip(0.1)
///     .set("solver.flip.cfl", 1.5)
///     .build()?;
/// assert_eq!(scene.particle_spacing(), 0.05);
///
/// let error = SceneBuilder::new("empty").domain([0.0; 3], [-1.0, 1.0, 1.0]).pbf(0.1).build();
/// assert!(error.unwrap_err().to_string().contains("domain"));
/// # Ok::<(), swell_scene::SceneError>(())
/// ```
#[derive(Clone, Debug)]
#[must_use = "a builder does nothing until `build`"]
pub struct SceneBuilder {
    root: Table,
    folder: PathBuf,
    /// First text that is not TOML, with the key that it was given for.
    fault: Option<(String, String)>,
}

impl SceneBuilder {
    /// Begins a scene of a shot with this name: 24 frames at 24 per second, no water, PBF.
    pub fn new(name: &str) -> Self {
        let builder = Self {
            root: Table::new(),
            folder: PathBuf::from("."),
            fault: None,
        };
        builder
            .set("shot.name", name)
            .frames(24, 24.0)
            .set("solver.method", "pbf")
    }

    /// Sets the number of output frames and their rate, 1/s.
    pub fn frames(self, frames: u32, per_second: f64) -> Self {
        self.set("shot.frames", i64::from(frames))
            .set("shot.frames_per_second", per_second)
    }

    /// Sets the two corners of the domain, metres; y is up.
    pub fn domain(self, min: [f64; 3], max: [f64; 3]) -> Self {
        self.set("domain.min", min.to_vec())
            .set("domain.max", max.to_vec())
    }

    /// Adds a box of water at the start, metres.
    pub fn block(self, min: [f64; 3], max: [f64; 3]) -> Self {
        let block = Table::from_iter([
            ("min".to_owned(), Value::from(min.to_vec())),
            ("max".to_owned(), Value::from(max.to_vec())),
        ]);
        self.append("water.block", block)
    }

    /// Adds a static solid from a mesh file (OBJ, PLY, STL, glTF or VDB); the path is relative to
    /// [`folder`](Self::folder).
    pub fn solid(self, mesh: &str) -> Self {
        let solid = Table::from_iter([("mesh".to_owned(), Value::from(mesh))]);
        self.append("solid", solid)
    }

    /// Adds a wave maker; `motion` is the inside of an inline table of TOML, such as
    /// `kind = "sine", stroke = 0.1, period = 1.5`.
    pub fn wave_maker(self, wall: Wall, motion: &str) -> Self {
        self.push(
            "wave_maker",
            &format!("wall = \"{}\"\nmotion = {{ {motion} }}", wall.name()),
        )
    }

    /// Chooses PBF, and sets the particle spacing, metres.
    pub fn pbf(self, particle_spacing: f64) -> Self {
        self.set("solver.method", "pbf")
            .set("solver.pbf.particle_spacing", particle_spacing)
    }

    /// Chooses FLIP, and sets the edge length of a cell, metres: two particle spacings.
    pub fn flip(self, cell_size: f64) -> Self {
        self.set("solver.method", "flip")
            .set("solver.flip.cell_size", cell_size)
    }

    /// Sets a key outside of arrays of tables by its dotted path, such as `solver.pbf.iterations`;
    /// replaces a value that was set before.
    pub fn set(mut self, key: &str, value: impl Into<Value>) -> Self {
        let value = value.into();
        match self.entry(key) {
            Some(entry) => *entry = value,
            None => self = self.with_fault(key, "it is inside a value that is not a table"),
        }
        self
    }

    /// Appends a table to an array of tables such as `emitter` or `probe`, given as TOML.
    pub fn push(self, key: &str, table: &str) -> Self {
        match table.parse::<Table>() {
            Ok(table) => self.append(key, table),
            Err(error) => self.with_fault(key, error.message()),
        }
    }

    /// Sets the folder at which paths of meshes and tables start, and which they must not leave;
    /// the current folder by default.
    pub fn folder(mut self, folder: impl Into<PathBuf>) -> Self {
        self.folder = folder.into();
        self
    }

    /// Returns the scene file that says the same; line numbers in errors of
    /// [`build`](Self::build) count its lines.
    pub fn to_toml(&self) -> String {
        self.root.to_string()
    }

    /// Validates the scene, reads its files and fills in defaults.
    ///
    /// # Errors
    /// As for [`load_scene`](crate::load_scene): the first fault, with its key and what is allowed.
    pub fn build(&self) -> Result<Scene, SceneError> {
        let name = self.root["shot"].get("name").and_then(Value::as_str);
        let file = PathBuf::from(format!("{} (built in code)", name.unwrap_or_default()));
        if let Some((key, reason)) = &self.fault {
            return Err(SceneError::Fault(Box::new(Fault {
                file,
                place: Place::Whole,
                key: key.clone(),
                message: reason.clone(),
            })));
        }
        parse_scene(&self.to_toml(), &file, Path::new(&self.folder), &[])
    }

    /// Returns the value of a dotted key, created empty; `None` if a part of its path is no table.
    fn entry(&mut self, key: &str) -> Option<&mut Value> {
        let (path, last) = key.rsplit_once('.').unwrap_or(("", key));
        let mut table = &mut self.root;
        for part in path.split('.').filter(|part| !part.is_empty()) {
            let inner = table.entry(part).or_insert_with(|| Table::new().into());
            table = inner.as_table_mut()?;
        }
        Some(
            table
                .entry(last)
                .or_insert_with(|| Value::Array(Vec::new())),
        )
    }

    fn append(mut self, key: &str, table: Table) -> Self {
        match self.entry(key).and_then(Value::as_array_mut) {
            Some(list) => list.push(table.into()),
            None => self = self.with_fault(key, "it is not an array of tables"),
        }
        self
    }

    fn with_fault(mut self, key: &str, reason: &str) -> Self {
        self.fault
            .get_or_insert_with(|| (key.to_owned(), reason.to_owned()));
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene_to_toml;

    fn flume() -> SceneBuilder {
        SceneBuilder::new("flume")
            .frames(48, 25.0)
            .domain([0.0; 3], [4.0, 1.0, 0.5])
            .block([0.0; 3], [4.0, 0.5, 0.5])
            .flip(0.1)
    }

    /// The same scene by a file; a key that differs is seen.
    #[test]
    fn a_built_scene_is_the_one_of_its_file() {
        let built = flume()
            .set("solver.flip.cfl", 1.5)
            .push("probe", "kind = \"energy\"");
        let file = Path::new("s.toml");
        let of_file = |set: &[String]| {
            parse_scene(&built.to_toml(), file, Path::new("."), set).expect("valid")
        };
        let scene = built.build().expect("valid");
        let written = |scene: &Scene| scene_to_toml(scene, &|path, _| path.display().to_string());
        assert_eq!(written(&scene), written(&of_file(&[])));
        let other = of_file(&["solver.flip.cfl=1.6".to_owned()]);
        assert_ne!(written(&scene), written(&other));
        assert_eq!(
            (scene.shot.frames, scene.shot.frames_per_second),
            (48, 25.0)
        );
        assert_eq!(
            (scene.solver.flip().expect("FLIP").cfl, scene.probes.len()),
            (1.5, 1)
        );
    }

    #[test]
    fn faults_name_their_key() {
        let said = |builder: SceneBuilder| builder.build().expect_err("refused").to_string();
        for (builder, parts) in [
            (
                flume().set("solver.flip.cell_size", -1.0),
                ["flume", "solver.flip.cell_size"],
            ),
            (
                flume().set("shot.name.first", 1),
                ["shot.name.first", "not a table"],
            ),
            (flume().push("probe", "kind = "), ["probe", "flume"]),
            (
                flume().push("shot.name", "a = 1"),
                ["shot.name", "not an array of tables"],
            ),
            (
                flume().set("solver.flip.celsize", 1.0),
                ["celsize", "cell_size"],
            ),
            (flume().solid("none.obj"), ["none.obj", "flume"]),
        ] {
            let said = said(builder);
            assert!(parts.iter().all(|part| said.contains(part)), "{said}");
        }
    }
}
