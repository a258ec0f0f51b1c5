//! Whitewater settings: how a stream of spray, foam and bubbles is derived from a finished bake.
//! They do not affect the bake's physics.

use std::{path::Path, sync::Arc};

use glam::DVec3;
use serde::Deserialize;

use super::{
    Reach,
    document::Document,
    keys::{
        BubblesSpec, EmissionSpec, FoamSpec, KillSpec, MeshSpec, ScaleSpec, SpraySpec, WHITEWATER,
        WhitewaterSpec,
    },
    placed_mesh::placed_mesh,
    toml_text::to_toml,
};
use swell_domain::{
    bounds::Bounds,
    sources::Window,
    text,
    whitewater::{CompleteSettings, Kill, KillMesh, KillRoom, ShotScale, Thresholds},
};
use swell_scene::{SceneError, asset_path};

impl KillSpec {
    /// Checks the values of the table at `path`.
    fn build(&self, doc: &Document<'_>, base: &Path, path: &str) -> Result<Kill, SceneError> {
        let room = match (self.min, self.max, self.sides, &self.mesh) {
            (_, _, _, Some(spec)) => KillRoom::Mesh(Arc::new(mesh(doc, base, path, spec)?)),
            (_, _, Some(width), None) => KillRoom::Sides(width),
            (Some(min), Some(max), None, None) => {
                let [min, max] = [min, max].map(DVec3::from_array);
                if !min.cmplt(max).all() {
                    let problem = "the box is inverted or has no volume";
                    return Err(doc.fault_of(&format!("{path}.max"), problem));
                }
                KillRoom::Block(Bounds { min, max })
            }
            _ => {
                let problem = "it has no room: name min and max, mesh, or sides";
                return Err(doc.fault_of_plain(path, problem));
            }
        };
        let Self { from, until, .. } = *self;
        if until.is_some_and(|until| until <= from) {
            return Err(doc.fault_of(&format!("{path}.until"), "it is not after from"));
        }
        let window = Window { from, until };
        Ok(Kill { room, window })
    }

    fn written(kill: &Kill) -> Self {
        let (mut block, mut mesh, mut sides) = (None, None, None);
        match &kill.room {
            KillRoom::Block(bounds) => block = Some(*bounds),
            KillRoom::Mesh(of) => mesh = Some(written_mesh(of)),
            KillRoom::Sides(width) => sides = Some(*width),
        }
        Self {
            mesh,
            min: block.map(|block| block.min.to_array()),
            max: block.map(|block| block.max.to_array()),
            sides,
            from: kill.window.from,
            until: kill.window.until,
        }
    }
}

/// Reads the mesh of a kill volume.
fn mesh(
    doc: &Document<'_>,
    base: &Path,
    path: &str,
    spec: &MeshSpec,
) -> Result<KillMesh, SceneError> {
    // No particles resolve the room: any rounding of its coordinates is taken.
    let spec = (spec, f64::INFINITY);
    let placed = placed_mesh(doc, base, &format!("{path}.mesh"), "file", spec)?;
    Ok(KillMesh {
        file: placed.file,
        file_hash: placed.file_hash,
        translate: placed.placement.translate.to_array(),
        rotate_degrees: placed.placement.rotate_degrees.to_array(),
        scale: placed.placement.scale.to_array(),
        mesh: placed.mesh,
    })
}

/// Returns what settings say of a mesh that lie beside its copy.
fn written_mesh(mesh: &KillMesh) -> MeshSpec {
    MeshSpec {
        file: kill_asset(mesh),
        blake3: Some(mesh.file_hash.clone()),
        translate: mesh.translate,
        rotate_degrees: mesh.rotate_degrees,
        scale: ScaleSpec::PerAxis(mesh.scale),
    }
}

/// Returns the name of the copy of a kill volume's mesh file among the assets of a stream.
pub fn kill_asset(mesh: &KillMesh) -> String {
    let path = asset_path(&mesh.file, &mesh.file_hash);
    path.trim_start_matches("assets/").to_owned()
}

/// A validated settings file. Values that depend on the shot may be open.
#[derive(Clone, Debug)]
pub struct WhitewaterSettings {
    spec: WhitewaterSpec,
    kills: Vec<Kill>,
}

impl WhitewaterSettings {
    /// Reads, parses and validates a settings file.
    ///
    /// # Errors
    /// If the file cannot be read, or for its first fault, with line, key and allowed values.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        Self::load_within(path, Reach::Folder)
    }

    /// Same as [`Self::load`], with meshes from where `reach` says.
    ///
    /// # Errors
    /// Those of [`Self::load`].
    pub fn load_within(path: &Path, reach: Reach) -> Result<Self, SceneError> {
        let text = text::read(path).map_err(|source| SceneError::Read {
            file: path.to_owned(),
            source,
        })?;
        Self::parse_within(&text, path, reach)
    }

    /// Parses and validates the text of a settings file; `file` names it in messages.
    ///
    /// # Errors
    /// Those of [`Self::load`].
    pub fn parse(text: &str, file: &Path) -> Result<Self, SceneError> {
        Self::parse_within(text, file, Reach::Folder)
    }

    fn parse_within(text: &str, file: &Path, reach: Reach) -> Result<Self, SceneError> {
        let (doc, mut root) = Document::parse(text, file, &[], WHITEWATER)?;
        let doc = doc.within(reach);
        doc.settle(&mut root)?;
        let mut spec = WhitewaterSpec::deserialize(toml::Deserializer::from(root))
            .map_err(|error| doc.translate(&error))?;
        let rising = [
            ("radius", spec.radius, true),
            (
                "emission.trapped_air",
                Some(spec.emission.trapped_air),
                false,
            ),
            ("emission.wave_crest", Some(spec.emission.wave_crest), false),
            ("emission.energy", Some(spec.emission.energy), false),
            ("foam.lifetime", Some(spec.foam.lifetime), true),
        ];
        for (key, values, may_be_equal) in rising {
            if let Some([least, greatest]) = values
                && (greatest < least || (greatest == least && !may_be_equal))
            {
                let problem = format!("[{least}, {greatest}] is not ascending");
                return Err(doc.fault_of(key, problem));
            }
        }
        let kills = spec.kill.iter().enumerate();
        let base = file.parent().unwrap_or(Path::new(""));
        let kills = kills.map(|(index, kill)| kill.build(&doc, base, &format!("kill[{index}]")));
        let kills = kills.collect::<Result<Vec<_>, _>>()?;
        // Meshes by their content, so that the hash is of that.
        spec.kill = kills.iter().map(KillSpec::written).collect();
        for mesh in spec.kill.iter_mut().filter_map(|kill| kill.mesh.as_mut()) {
            mesh.file.clear();
        }
        Ok(Self { spec, kills })
    }

    /// Whether the scale of the shot decides nothing.
    pub fn is_complete(&self) -> bool {
        let emission = &self.spec.emission;
        let numbers = [
            emission.trapped_air_rate,
            emission.wave_crest_rate,
            self.spec.foam.crowd,
        ];
        self.spec.radius.is_some() && numbers.iter().all(Option::is_some)
    }

    /// Returns complete settings. `shot` supplies the rates, radii and crowd that the file leaves
    /// open.
    pub fn settled(&self, shot: &ShotScale) -> CompleteSettings {
        let WhitewaterSpec {
            seed,
            max_particles,
            radius,
            emission,
            spray,
            foam,
            bubbles,
            kill: _,
        } = &self.spec;
        CompleteSettings {
            seed: *seed,
            max_particles: *max_particles,
            radius: radius.unwrap_or_else(|| shot.radius()),
            trapped_air_rate: (emission.trapped_air_rate)
                .unwrap_or_else(|| shot.trapped_air_rate()),
            wave_crest_rate: (emission.wave_crest_rate).unwrap_or_else(|| shot.wave_crest_rate()),
            thresholds: Thresholds {
                trapped_air: emission.trapped_air,
                wave_crest: emission.wave_crest,
                energy: emission.energy,
            },
            drop_radius: spray.drop_radius,
            wind: spray.wind,
            lifetime: foam.lifetime,
            crowd: foam.crowd.unwrap_or_else(|| shot.crowd()),
            rise_speed: bubbles.rise_speed,
            response: bubbles.response,
            kills: self.kills.clone(),
        }
    }

    /// Returns the BLAKE3 hash of all values including defaults, hexadecimal; the layout of the
    /// file does not affect it.
    pub fn hash(&self) -> String {
        // `Debug` prints the shortest exact text of a float, so equal values, and only those,
        // have equal text.
        let text = format!("{:?}", self.spec);
        // Streams that were made before there were kill volumes keep their hash.
        blake3::hash(text.replace(", kill: []", "").as_bytes())
            .to_hex()
            .to_string()
    }
}

/// Returns a file with all settings, which [`WhitewaterSettings::parse`] reads back.
pub fn written_out(settings: &CompleteSettings) -> String {
    let Thresholds {
        trapped_air,
        wave_crest,
        energy,
    } = settings.thresholds;
    to_toml(&WhitewaterSpec {
        seed: settings.seed,
        max_particles: settings.max_particles,
        radius: Some(settings.radius),
        emission: EmissionSpec {
            trapped_air_rate: Some(settings.trapped_air_rate),
            wave_crest_rate: Some(settings.wave_crest_rate),
            trapped_air,
            wave_crest,
            energy,
        },
        spray: SpraySpec {
            drop_radius: settings.drop_radius,
            wind: settings.wind,
        },
        foam: FoamSpec {
            lifetime: settings.lifetime,
            crowd: Some(settings.crowd),
        },
        bubbles: BubblesSpec {
            rise_speed: settings.rise_speed,
            response: settings.response,
        },
        kill: settings.kills.iter().map(KillSpec::written).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<WhitewaterSettings, SceneError> {
        WhitewaterSettings::parse(text, Path::new("w.toml"))
    }

    fn shot() -> ShotScale {
        ShotScale::of_volume(200.0)
    }

    #[test]
    fn an_empty_file_leaves_the_rest_to_the_shot() {
        let settings = parse("").expect("valid");
        assert!(!settings.is_complete());
        let settled = settings.settled(&shot());
        assert_eq!(settled.thresholds, Thresholds::default());
        assert_eq!(settled.radius, shot().radius());
        assert_eq!(settled.trapped_air_rate, shot().trapped_air_rate());
        assert_eq!(settled.wave_crest_rate, shot().wave_crest_rate());
        assert_eq!(settled.crowd, shot().crowd());
        let own = "radius = [0.1, 0.2]\n[emission]\ntrapped_air_rate = 7\nwave_crest_rate = 8\n\
            [foam]\ncrowd = 9\n";
        let settings = parse(own).expect("valid");
        assert!(settings.is_complete());
        let settled = settings.settled(&shot());
        let rates = [settled.trapped_air_rate, settled.wave_crest_rate];
        assert_eq!((rates, settled.crowd), ([7.0, 8.0], 9.0));
    }

    #[test]
    fn what_is_written_out_reads_back_as_the_same() {
        let text = "seed = 5\nradius = [0.001, 0.002]\n[emission]\ntrapped_air_rate = 12.5\n\
            [spray]\nwind = [1, -2.5, 0]\n\
            [foam]\nlifetime = [1, 2]\ncrowd = 3\n[bubbles]\nrise_speed = 0.1\nresponse = 0.5\n\
            [[kill]]\nmin = [1, 2, 3]\nmax = [4, 5, 6]\nfrom = 0.5\n[[kill]]\nsides = 0.25\n\
            until = 2\n";
        let other = ShotScale::of_volume(3.0);
        for text in [text, &text.replace("rise_speed = 0.1\n", "")] {
            let settled = parse(text).expect("valid").settled(&shot());
            let written = written_out(&settled);
            let again = parse(&written).expect("what was written");
            // The file is complete: the shot does not change the result.
            assert_eq!(again.settled(&other), settled);
            assert!(again.is_complete());
        }
    }

    #[test]
    fn hashes_are_of_the_content() {
        let hash = |text: &str| parse(text).expect("valid").hash();
        assert_eq!(
            hash(""),
            hash("[foam]\nlifetime = [0.5, 4] # the default\n")
        );
        assert_ne!(hash(""), hash("[foam]\ncrowd = 15\n"));
        assert_ne!(hash(""), hash("[emission]\nenergy = [1, 2]\n"));
        assert_ne!(hash(""), hash("[[kill]]\nsides = 0.5\n"));
    }

    #[test]
    fn faults_name_file_line_key_and_what_is_allowed() {
        for (text, words) in [
            (
                "[foam]\nlifetime = [4, 1]",
                &["w.toml:2", "foam.lifetime", "rising"][..],
            ),
            (
                "[emission]\nenergy = [1, 1]",
                &["w.toml:2", "emission.energy", "ascending"],
            ),
            ("[foam]\nlife = 1", &["w.toml:2", "lifetime"]),
            (
                "[spray]\ndrop_radius = -1",
                &["w.toml:2", "spray.drop_radius"],
            ),
            ("max_particles = 0", &["w.toml:1", "max_particles"]),
            ("[[kill]]\nfrom = 1", &["w.toml", "kill[0]", "no room"]),
            (
                "[[kill]]\nsides = 1\nmin = [0, 0, 0]",
                &["w.toml:3", "kill[0].min"],
            ),
            (
                "[[kill]]\nmin = [0, 0, 0]\nmax = [1, 0, 1]",
                &["w.toml:3", "kill[0].max", "no volume"],
            ),
            (
                "[[kill]]\nsides = 1\nfrom = 2\nuntil = 2",
                &["w.toml:4", "kill[0].until"],
            ),
        ] {
            let found = parse(text).expect_err("a fault").to_string();
            for word in words {
                assert!(found.contains(word), "{found}: {word}");
            }
        }
    }
}
