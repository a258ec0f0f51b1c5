//! What the numbers of a scene or a study may be. Each range is wider than any shot needs, and narrow enough that no
//! product or quotient of what a scene may hold leaves what the solvers compute with. The words that a user reads stand in
//! `allowed`; a test holds both against each other.

use std::ops::RangeInclusive;

pub(super) type Interval = RangeInclusive<f64>;

/// From a frame in 100 s, with which a tide is baked in a thousand frames, to the rate of a high-speed camera.
pub(super) const FRAMES_PER_SECOND: Interval = 0.01..=1e5;

/// kg/m³. Hydrogen gas has 0.09, osmium 22 590.
pub(super) const REST_DENSITY: Interval = 0.01..=1e5;

/// Metres. Below 10 nm matter is no fluid; 100 km is a tenth of the largest domain.
pub(super) const SPACING: Interval = 1e-8..=1e5;

/// Metres of an edge of the domain: no smaller than the least spacing.
pub(super) const EDGE: Interval = 1e-8..=2e6;

/// Metres: a stroke, a wave's height, the water's depth. The domain is the upper bound.
pub(super) const LENGTH: Interval = 1e-9..=1e6;

/// m/s. Sound has 1 500 in water.
pub(super) const SPEED: Interval = 1e-9..=1e5;

/// Seconds: from a tenth of a millisecond, the ripples of ultrasound, to eleven days, a spring tide.
pub(super) const PERIOD: Interval = 1e-4..=1e6;

/// Seconds until a wall stands.
pub(super) const UNTIL: Interval = 1e-6..=1e9;

/// Spacings or cells. With 10 000 substeps a frame, the most there are, 1e-5 is a tenth of one in a frame.
pub(super) const CFL: Interval = 1e-5..=5.0;

/// h / d.
pub(super) const SUPPORT_RATIO: Interval = 1.5..=4.0;

/// ρ. Above, Chebyshev's factors hardly change any more within 10 000 iterations.
pub(super) const SPECTRAL_RADIUS: Interval = 0.01..=0.9999;

/// Of the rest density. f32 tells densities 6e-8 apart.
pub(super) const DENSITY_ERROR: Interval = 1e-7..=0.99;

/// ω. A hundredth takes a hundred iterations for one.
pub(super) const RELAXATION: Interval = 0.01..=1.5;

/// k.
pub(super) const ARTIFICIAL_PRESSURE: Interval = 0.0..=10.0;

/// A part of something.
pub(super) const PART: Interval = 0.0..=1.0;

/// Of the right-hand side's norm. In f64 a residual is rounded at 2e-16 a term, and a row has seven.
pub(super) const TOLERANCE: Interval = 1e-14..=0.99;

/// A limit of the budget, in its unit: wider than what f32 tells apart from nothing, and than anything that is computed.
pub(super) const BUDGET: Interval = 1e-12..=1e12;

/// Lengths of one run of a study over those of another.
pub(super) const SCALE: Interval = 1e-6..=1e6;

/// What a limit of a study is searched between, in its unit.
pub(super) const SEARCHED: Interval = 1e-12..=1e12;

/// What a quantity of a study is held to, in its unit.
pub(super) const BOUND: Interval = -1e12..=1e12;

/// How near a search comes: each step halves the logarithm of what is left, 24 of them at most for 1e24 to 1.001.
pub(super) const RATIO: Interval = 1.001..=1e12;

/// Seconds of a shot, of which some have 1e6 frames of 100 s.
pub(super) const SECONDS: Interval = 1e-6..=1e8;
