//! The solver of a scene, and scenes whose method is known to the compiler.

use std::{borrow::Cow, ops::Deref};

use super::{Method, Pbf, Scene, flip::Flip, projection::PROJECTION_CELL};

/// A method with its settings.
#[derive(Clone, Debug, PartialEq)]
pub enum Solver {
    /// Position-based fluids.
    Pbf(Pbf),
    /// PIC/FLIP.
    Flip(Flip),
}

impl Solver {
    /// Returns the method.
    pub fn method(&self) -> Method {
        match self {
            Self::Pbf(_) => Method::Pbf,
            Self::Flip(_) => Method::Flip,
        }
    }

    /// Returns the settings of PBF, if that is the method.
    pub fn pbf(&self) -> Option<&Pbf> {
        match self {
            Self::Pbf(pbf) => Some(pbf),
            Self::Flip(_) => None,
        }
    }

    /// Returns the settings of FLIP, if that is the method.
    pub fn flip(&self) -> Option<&Flip> {
        match self {
            Self::Pbf(_) => None,
            Self::Flip(flip) => Some(flip),
        }
    }

    /// Returns the distance between neighbours on the initial lattice, metres.
    pub fn particle_spacing(&self) -> f64 {
        match self {
            Self::Pbf(pbf) => pbf.particle_spacing,
            Self::Flip(flip) => flip.particle_spacing(),
        }
    }

    /// Returns the edge of a cell of the grid on which velocities are projected, metres. PBF's
    /// projection may be off.
    pub fn cell_size(&self) -> f64 {
        match self {
            Self::Pbf(pbf) => PROJECTION_CELL * pbf.particle_spacing,
            Self::Flip(flip) => flip.cell_size,
        }
    }

    /// Returns the length that resolves the water, metres: PBF's particle spacing or FLIP's cell
    /// size.
    pub fn resolution(&self) -> f64 {
        match self {
            Self::Pbf(pbf) => pbf.particle_spacing,
            Self::Flip(flip) => flip.cell_size,
        }
    }

    /// Returns the largest number of substeps per frame.
    pub fn max_substeps(&self) -> u32 {
        match self {
            Self::Pbf(pbf) => pbf.max_substeps,
            Self::Flip(flip) => flip.max_substeps,
        }
    }
}

impl From<Pbf> for Solver {
    fn from(pbf: Pbf) -> Self {
        Self::Pbf(pbf)
    }
}

impl From<Flip> for Solver {
    fn from(flip: Flip) -> Self {
        Self::Flip(flip)
    }
}

/// A scene that is solved with the settings `S`: see [`PbfScene`] and [`FlipScene`]. It borrows a
/// scene whose solver they are, or owns one.
#[derive(Clone, Debug)]
pub struct SceneWith<'a, S> {
    scene: Cow<'a, Scene>,
    settings: S,
}

impl<S: Clone + Into<Solver>> SceneWith<'_, S> {
    /// Returns `scene` with `settings` as its solver's, and no others.
    pub fn new(scene: Scene, settings: S) -> Self {
        let scene = Scene {
            solver: settings.clone().into(),
            unchosen: None,
            ..scene
        };
        Self {
            scene: Cow::Owned(scene),
            settings,
        }
    }
}

impl<S> SceneWith<'_, S> {
    /// Returns the settings of the solver.
    pub fn settings(&self) -> &S {
        &self.settings
    }
}

impl<S: Clone> SceneWith<'_, S> {
    /// Returns the same with a copy of the scene, for what outlives it.
    pub fn to_owned_scene(&self) -> SceneWith<'static, S> {
        SceneWith {
            scene: Cow::Owned(Scene::clone(self)),
            settings: self.settings.clone(),
        }
    }
}

impl<S> Deref for SceneWith<'_, S> {
    type Target = Scene;

    fn deref(&self) -> &Scene {
        &self.scene
    }
}

/// A scene that PBF solves.
pub type PbfScene<'a> = SceneWith<'a, Pbf>;

/// A scene that FLIP solves.
pub type FlipScene<'a> = SceneWith<'a, Flip>;

/// A scene by its method.
#[derive(Clone, Debug)]
pub enum ByMethod<'a> {
    /// A scene that PBF solves.
    Pbf(PbfScene<'a>),
    /// A scene that FLIP solves.
    Flip(FlipScene<'a>),
}

impl Scene {
    /// Returns the scene with the settings of its method.
    pub fn by_method(&self) -> ByMethod<'_> {
        let scene = Cow::Borrowed(self);
        match self.solver.clone() {
            Solver::Pbf(settings) => ByMethod::Pbf(SceneWith { scene, settings }),
            Solver::Flip(settings) => ByMethod::Flip(SceneWith { scene, settings }),
        }
    }

    /// Returns the scene with the settings of PBF, if that is its method.
    pub fn with_pbf(&self) -> Option<PbfScene<'_>> {
        match self.by_method() {
            ByMethod::Pbf(scene) => Some(scene),
            ByMethod::Flip(_) => None,
        }
    }

    /// Returns the scene with the settings of FLIP, if that is its method.
    pub fn with_flip(&self) -> Option<FlipScene<'_>> {
        match self.by_method() {
            ByMethod::Pbf(_) => None,
            ByMethod::Flip(scene) => Some(scene),
        }
    }
}
