//! The solver of a scene, and scenes whose method is known to the compiler.

use std::ops::Deref;

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

/// A scene that is solved with the settings `S`: see [`PbfScene`] and [`FlipScene`].
#[derive(Clone, Debug)]
pub struct SceneWith<S> {
    scene: Scene,
    settings: S,
}

impl<S: Clone + Into<Solver>> SceneWith<S> {
    /// Returns `scene` with `settings` as its solver's, and no others.
    pub fn new(scene: Scene, settings: S) -> Self {
        let scene = Scene {
            solver: settings.clone().into(),
            unchosen: None,
            ..scene
        };
        Self { scene, settings }
    }
}

impl<S> SceneWith<S> {
    /// Returns the settings of the solver.
    pub fn settings(&self) -> &S {
        &self.settings
    }
}

impl<S> Deref for SceneWith<S> {
    type Target = Scene;

    fn deref(&self) -> &Scene {
        &self.scene
    }
}

/// A scene that PBF solves.
pub type PbfScene = SceneWith<Pbf>;

/// A scene that FLIP solves.
pub type FlipScene = SceneWith<Flip>;

/// A scene by its method.
#[derive(Clone, Debug)]
pub enum ByMethod {
    /// A scene that PBF solves.
    Pbf(PbfScene),
    /// A scene that FLIP solves.
    Flip(FlipScene),
}

impl Scene {
    /// Returns the scene with the settings of its method.
    pub fn by_method(&self) -> ByMethod {
        match self.solver.clone() {
            Solver::Pbf(settings) => ByMethod::Pbf(SceneWith {
                scene: self.clone(),
                settings,
            }),
            Solver::Flip(settings) => ByMethod::Flip(SceneWith {
                scene: self.clone(),
                settings,
            }),
        }
    }

    /// Returns the scene with the settings of PBF, if that is its method.
    pub fn with_pbf(&self) -> Option<PbfScene> {
        match self.by_method() {
            ByMethod::Pbf(scene) => Some(scene),
            ByMethod::Flip(_) => None,
        }
    }

    /// Returns the scene with the settings of FLIP, if that is its method.
    pub fn with_flip(&self) -> Option<FlipScene> {
        match self.by_method() {
            ByMethod::Pbf(_) => None,
            ByMethod::Flip(scene) => Some(scene),
        }
    }
}
