//! A bake that begins from a frame of another cache.

use std::{
    borrow::Cow,
    ffi::{OsStr, OsString},
    fmt,
    path::PathBuf,
};
use swell_files::scene_to_toml;

use glam::Vec3;

use swell_cache::{CacheError, CacheReader, Clock, Parent};
use swell_domain::{absorber::AbsorberStates, bounds::Bounds, particles::Particles, pose::Pose};
use swell_scene::{Scene, SceneError};

use super::prepare::Start;

/// A frame of a cache, written `CACHE:120`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BranchPoint {
    /// Directory of the cache.
    pub directory: PathBuf,
    /// Number of the frame to begin from.
    pub frame: u32,
}

impl TryFrom<OsString> for BranchPoint {
    type Error = &'static str;

    fn try_from(text: OsString) -> Result<Self, Self::Error> {
        let parts = at_last_colon(&text).filter(|(path, _)| !path.is_empty());
        let point = parts.and_then(|(path, frame)| {
            Some(Self {
                directory: path.into(),
                frame: frame.to_str()?.parse().ok()?,
            })
        });
        point.ok_or("not a cache and a frame, such as cache/wave-city/pbf:120")
    }
}

/// Splits at the last colon: a path may contain others, and bytes that are not UTF-8.
#[cfg(unix)]
fn at_last_colon(text: &OsStr) -> Option<(&OsStr, &OsStr)> {
    use std::os::unix::ffi::OsStrExt as _;
    let bytes = text.as_bytes();
    let colon = bytes.iter().rposition(|&byte| byte == b':')?;
    let parts = [&bytes[..colon], &bytes[colon + 1..]];
    Some(parts.map(OsStr::from_bytes).into())
}

/// Other systems do not expose the bytes of a path.
#[cfg(not(unix))]
fn at_last_colon(text: &OsStr) -> Option<(&OsStr, &OsStr)> {
    let (path, frame) = text.to_str()?.rsplit_once(':')?;
    Some((path.as_ref(), frame.as_ref()))
}

impl fmt::Display for BranchPoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.directory.display(), self.frame)
    }
}

/// The state with which a scene begins from a frame of another cache.
#[derive(Clone, Debug)]
pub struct Branch {
    /// Record of the frame for the manifest.
    pub parent: Parent,
    /// Clock after the frame: number and time continue, so that walls and solids keep moving as
    /// they would have.
    pub clock: Clock,
    /// The frame's particles with the scene's attributes.
    pub particles: Particles,
    /// Notes about beginning from this frame, a sentence each.
    pub notes: Vec<String>,
}

/// Why a scene cannot begin from a frame.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BranchError {
    /// Reading the cache or its frame failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The cache's own scene.
    #[error("{file}: the cache's scene", file = .file.display())]
    Scene {
        /// The cache.
        file: PathBuf,
        /// What is wrong with it.
        source: SceneError,
    },
    /// The scene differs from the cache in a key that decides what particles represent.
    #[error(
        "from {from}: it was baked with {key} = {cached}, and the scene has {given}; a bake that \
         begins from a frame keeps it"
    )]
    Unfit {
        /// The frame.
        from: BranchPoint,
        /// Key of the scene.
        key: &'static str,
        /// Value in the cache.
        cached: String,
        /// Value in the scene.
        given: String,
    },
    /// Particles outside the scene's walls.
    #[error(
        "from {from}: {count} of {all} particles lie beyond the walls of the scene at {time} s; \
         the first is particle {id} at {position:?}"
    )]
    Beyond {
        /// The frame.
        from: BranchPoint,
        /// Number of particles outside.
        count: usize,
        /// Number of particles in the frame.
        all: usize,
        /// Time of the frame, seconds.
        time: f64,
        /// Id of the first particle outside.
        id: u32,
        /// World position of that particle, metres.
        position: [f64; 3],
    },
}

impl Branch {
    /// Reads the frame and checks that the scene can continue from it.
    ///
    /// Solver, frame rate and particle spacing must be equal, because they decide what a particle
    /// and a frame number mean. Attributes that the scene has and the frame lacks are zero, as at a
    /// scene's own start.
    ///
    /// # Errors
    /// [`BranchError`].
    pub fn open(from: &BranchPoint, scene: &Scene) -> Result<Self, BranchError> {
        let cache = CacheReader::open(&from.directory)?;
        let entry = cache.entry(from.frame)?;
        check_keys(from, &cache, scene)?;
        let origin = cache.manifest().origin.into();
        let mut particles = cache.state(from.frame)?.about(origin, scene.origin);
        take_band(&mut particles, scene);
        let mut clock = entry.clock;
        let mut notes = Vec::new();
        let baked = super::baked_scene(&cache, &from.directory);
        let baked = baked.map_err(|source| BranchError::Scene {
            file: from.directory.clone(),
            source,
        })?;
        check_motion(from, &baked, scene)?;
        if clock.walls != AbsorberStates::default() {
            (clock.walls, notes) = scene.carried(&baked, &clock.walls);
            particles.walls = clock.walls;
        }
        if particles.bodies.len() != scene.bodies().count() {
            particles.bodies = scene.bodies_at_start();
            notes.push(
                "bodies begin where the scene puts them: the frame has another number".to_owned(),
            );
        }
        check_walls(from, clock, scene, &particles)?;
        let manifest = cache.manifest();
        let parent = Parent {
            shot: manifest.shot.clone(),
            solver: manifest.solver.clone(),
            scene_hash: manifest.scene_hash.clone(),
            frame: from.frame,
            blake3: cache.frame_hash(from.frame)?.to_owned(),
            shaders: manifest.edited_shaders().map(str::to_owned),
        };
        if origin != scene.origin {
            notes.push("positions are rounded about another origin: the domain differs".to_owned());
        }
        let text = scene_to_toml(scene, &swell_scene::asset_path);
        let physics = swell_files::physics_difference(cache.scene_toml(), &text);
        notes.extend(physics.map_err(|source| BranchError::Scene {
            file: from.directory.clone(),
            source,
        })?);
        notes.extend(take_attributes(&mut particles, scene.declared_attributes()));
        Ok(Self {
            parent,
            clock,
            particles,
            notes,
        })
    }
}

/// Lays the scene's band, if it has one, around a frame without one or with another.
fn take_band(particles: &mut Particles, scene: &Scene) {
    let band = scene.band();
    if !particles.deep.is_empty() && band.is_none_or(|band| band.grid != particles.deep.grid) {
        *particles = std::mem::take(particles).filled();
    }
    if let (Some(band), true) = (band, particles.deep.is_empty()) {
        band.enter(particles);
    }
}

/// Note about particles of a start at `time` seconds that solids of the scene cover.
pub(super) fn note_covered(scene: &Scene, start: &Start, time: f64) -> Option<String> {
    let boundary = &start.boundary;
    let still = boundary.distance.iter();
    let still = still.map(|field| (Cow::Borrowed(field), Pose::START));
    let solids = scene.moving_solids.iter().enumerate();
    let moving = solids.map(|(index, solid)| {
        let pose = solid.pose(&start.particles.bodies, time);
        (boundary.moving_at(index, time), pose)
    });
    let fields: Vec<_> = still.chain(moving).collect();
    let is_covered = |x: &&[f32; 3]| {
        let x = Vec3::from_array(**x).as_dvec3();
        fields
            .iter()
            .any(|(field, pose)| field.sample(pose.back(x)) < 0.0)
    };
    match start.particles.position.iter().filter(is_covered).count() {
        0 => None,
        count => Some(format!(
            "{count} particles lie within solids of the scene, which will push them out"
        )),
    }
}

fn check_keys(from: &BranchPoint, cache: &CacheReader, scene: &Scene) -> Result<(), BranchError> {
    let manifest = cache.manifest();
    let quoted = |name: &str| format!("{name:?}");
    let number = |value: f64| format!("{value:?}");
    let spacing = match scene.solver.method() {
        swell_scene::Method::Pbf => "solver.pbf.particle_spacing",
        swell_scene::Method::Flip => {
            "the particle spacing of solver.flip (cell_size, particles_per_cell)"
        }
    };
    let rows = [
        (
            "solver.method",
            quoted(&manifest.solver),
            quoted(scene.solver.method().name()),
        ),
        (
            "shot.frames_per_second",
            number(manifest.frames_per_second),
            number(scene.shot.frames_per_second),
        ),
        (
            spacing,
            number(manifest.particle_spacing),
            number(scene.particle_spacing()),
        ),
    ];
    match rows.into_iter().find(|(_, cached, given)| cached != given) {
        None => Ok(()),
        Some((key, cached, given)) => Err(BranchError::Unfit {
            from: from.clone(),
            key,
            cached,
            given,
        }),
    }
}

/// Refuses a scene whose domain moves otherwise than that of the cache: the water would not have
/// felt what its domain has done before.
fn check_motion(from: &BranchPoint, baked: &Scene, scene: &Scene) -> Result<(), BranchError> {
    let world = |scene: &Scene| {
        scene.frame.as_ref().map(|frame| {
            let mut motion = frame.motion().clone();
            motion.carry(scene.origin);
            (motion.slide, motion.turn)
        })
    };
    let (cached, given) = (world(baked), world(scene));
    if cached == given {
        return Ok(());
    }
    let shown = |motion: &Option<_>| match motion {
        Some(_) => "a motion of its own",
        None => "none",
    };
    Err(BranchError::Unfit {
        from: from.clone(),
        key: "a motion of the domain",
        cached: shown(&cached).to_owned(),
        given: shown(&given).to_owned(),
    })
}

/// Refuses a frame with particles more than half a spacing outside the walls; closer ones are left
/// to the solver, whose walls push them back.
fn check_walls(
    from: &BranchPoint,
    clock: Clock,
    scene: &Scene,
    particles: &Particles,
) -> Result<(), BranchError> {
    let walls = scene.walls(&particles.walls, clock.time);
    let corner = scene.domain.min;
    // Along periodic axes there are no walls nearby, and particles have to lie in the domain.
    let room = Bounds {
        min: (corner + walls.min).max(scene.domain.min),
        max: (corner + walls.max).min(scene.domain.max),
    }
    .grown(0.5 * scene.particle_spacing());
    let is_beyond = |&k: &usize| {
        let x = Vec3::from_array(particles.position[k]).as_dvec3();
        !room.contains(x)
    };
    let mut beyond = (0..particles.len()).filter(is_beyond);
    match beyond.next() {
        None => Ok(()),
        Some(first) => Err(BranchError::Beyond {
            from: from.clone(),
            count: 1 + beyond.count(),
            all: particles.len(),
            time: clock.time,
            id: particles.id[first],
            position: (scene.origin + Vec3::from_array(particles.position[first]).as_dvec3())
                .to_array(),
        }),
    }
}

/// Keeps the declared attributes; notes which ones were missing and which are dropped.
fn take_attributes(particles: &mut Particles, declared: &[&str]) -> Vec<String> {
    let count = particles.len();
    let mut found = std::mem::take(&mut particles.attributes);
    let mut zeroed = Vec::new();
    for name in declared {
        let values = found.remove(*name).unwrap_or_else(|| {
            zeroed.push(*name);
            vec![0.0; count]
        });
        particles.attributes.insert((*name).to_owned(), values);
    }
    let dropped: Vec<&str> = found.keys().map(String::as_str).collect();
    let mut notes = Vec::new();
    if !zeroed.is_empty() {
        notes.push(format!(
            "the frame has no {}: zero, as at a scene's own start",
            zeroed.join(", ")
        ));
    }
    if !dropped.is_empty() {
        notes.push(format!(
            "the scene does not use {}, which is dropped",
            dropped.join(", ")
        ));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cache_and_a_frame_are_parted_at_the_last_colon() {
        let parse = |text: &str| BranchPoint::try_from(OsString::from(text));
        let point = parse("C:/shots/a:b:120").unwrap();
        assert_eq!(point.directory, PathBuf::from("C:/shots/a:b"));
        assert_eq!(point.frame, 120);
        assert_eq!(point.to_string(), "C:/shots/a:b:120");
        for bad in [
            "",
            "cache",
            ":3",
            "cache:",
            "cache:-1",
            "cache:last",
            "cache:4294967296",
        ] {
            assert!(parse(bad).is_err(), "{bad}");
        }
        #[cfg(unix)]
        {
            use std::os::unix::ffi::OsStrExt as _;
            let parse = |bytes: &[u8]| BranchPoint::try_from(OsStr::from_bytes(bytes).to_owned());
            let point = parse(b"caf\xe9:7").unwrap();
            assert_eq!(point.directory, OsStr::from_bytes(b"caf\xe9"));
            assert_eq!(point.frame, 7);
            assert!(parse(b"cache:\xe97").is_err());
        }
    }

    #[test]
    fn attributes_are_kept_made_zero_or_left_out_and_that_is_told() {
        let mut particles = Particles {
            position: vec![[0.0; 3]; 2],
            velocity: vec![[0.0; 3]; 2],
            id: vec![0, 1],
            attributes: [("a", 1.0), ("b", 2.0)]
                .map(|(name, value)| (name.to_owned(), vec![value; 2]))
                .into(),
            ..Particles::default()
        };
        let mut same = particles.clone();
        assert!(take_attributes(&mut same, &["a", "b"]).is_empty());
        assert_eq!(same, particles);
        let notes = take_attributes(&mut particles, &["b", "c"]);
        assert_eq!(particles.attributes["b"], [2.0; 2]);
        assert_eq!(particles.attributes["c"], [0.0; 2]);
        assert!(!particles.attributes.contains_key("a"));
        assert!(
            notes[0].contains("no c: zero") && notes[1].contains("not use a, which is dropped")
        );
    }
}
