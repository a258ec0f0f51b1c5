//! Animated values with glTF's interpolation (glTF 2.0, appendix C).

use glam::{DQuat, DVec3, DVec4};
use gltf::animation::{Interpolation, Sampler, util::Rotations};

/// A value over time.
#[derive(Clone, Debug)]
pub(super) struct Track<T> {
    /// Key times, seconds, ascending; a single one for a constant.
    pub(super) times: Vec<f64>,
    /// One value per time, or three for cubic splines: in-tangent, value, out-tangent.
    values: Vec<T>,
    interpolation: Interpolation,
}

/// Interpolation of values.
pub(super) trait Blend: Copy {
    /// Interpolates towards `other`; `part` is from 0 to 1.
    fn between(self, other: Self, part: f64) -> Self;
    /// Returns the weighted sum of four values, normalized where the type requires it.
    fn weighted(values: [Self; 4], weights: [f64; 4]) -> Self;
}

impl Blend for DVec3 {
    fn between(self, other: Self, part: f64) -> Self {
        self.lerp(other, part)
    }

    fn weighted(values: [Self; 4], weights: [f64; 4]) -> Self {
        values.iter().zip(weights).map(|(v, w)| *v * w).sum()
    }
}

impl Blend for DQuat {
    fn between(self, other: Self, part: f64) -> Self {
        // The shorter arc, which `slerp` takes.
        self.slerp(other, part)
    }

    fn weighted(values: [Self; 4], weights: [f64; 4]) -> Self {
        let sum: DVec4 = (values.iter().zip(weights))
            .map(|(v, w)| DVec4::from(*v) * w)
            .sum();
        Self::from_vec4(sum).normalize()
    }
}

impl<T: Blend + PartialEq> Track<T> {
    /// Returns the key times, seconds; empty if all values are equal.
    pub(super) fn times_moved(&self) -> &[f64] {
        match self.values.iter().any(|value| *value != self.values[0]) {
            true => &self.times,
            false => &[],
        }
    }
}

impl<T: Blend> Track<T> {
    pub(super) fn still(value: T) -> Self {
        Self {
            times: vec![0.0],
            values: vec![value],
            interpolation: Interpolation::Step,
        }
    }

    /// Whether the value changes in steps.
    pub(super) fn jumps(&self) -> bool {
        self.interpolation == Interpolation::Step && self.times.len() > 1
    }

    /// Returns the value at a time; before the first key and after the last it is constant (glTF
    /// 2.0, appendix C).
    pub(super) fn at(&self, seconds: f64) -> T {
        let is_cubic = self.interpolation == Interpolation::CubicSpline;
        let value = |k: usize| self.values[if is_cubic { 3 * k + 1 } else { k }];
        let last = self.times.len() - 1;
        let after = self.times.partition_point(|&time| time <= seconds);
        if after == 0 {
            return value(0);
        }
        let k = after - 1;
        if k == last {
            return value(last);
        }
        let span = self.times[k + 1] - self.times[k];
        let t = (seconds - self.times[k]) / span;
        match self.interpolation {
            Interpolation::Step => value(k),
            Interpolation::Linear => value(k).between(value(k + 1), t),
            Interpolation::CubicSpline => {
                let (t2, t3) = (t * t, t * t * t);
                let values = [
                    value(k),
                    self.values[3 * k + 2],
                    value(k + 1),
                    self.values[3 * (k + 1)],
                ];
                let weights = [
                    2.0 * t3 - 3.0 * t2 + 1.0,
                    span * (t3 - 2.0 * t2 + t),
                    3.0 * t2 - 2.0 * t3,
                    span * (t3 - t2),
                ];
                T::weighted(values, weights)
            }
        }
    }
}

/// Builds a track of rotations, normalized.
///
/// # Errors
/// Those of [`track`].
pub(super) fn rotations(
    times: Vec<f64>,
    values: Rotations<'_>,
    sampler: &Sampler<'_>,
) -> Result<Track<DQuat>, String> {
    let values: Vec<DQuat> = (values.into_f32())
        .map(|q| DQuat::from_array(q.map(f64::from)))
        .collect();
    let mut track = track(times, values, sampler)?;
    // The tangents of a cubic spline are not rotations.
    let stride = match track.interpolation {
        Interpolation::CubicSpline => 3,
        _ => 1,
    };
    for value in track.values.iter_mut().skip(stride / 2).step_by(stride) {
        *value = value.normalize();
    }
    Ok(track)
}

/// Builds a track of values.
///
/// # Errors
/// A description if the numbers of times and values do not match or the times do not ascend.
pub(super) fn track<T: Blend>(
    times: Vec<f64>,
    values: Vec<T>,
    sampler: &Sampler<'_>,
) -> Result<Track<T>, String> {
    let interpolation = sampler.interpolation();
    let wanted = match interpolation {
        Interpolation::CubicSpline => 3 * times.len(),
        _ => times.len(),
    };
    if times.is_empty() || values.len() != wanted {
        return Err(format!(
            "{} values for {} times; {wanted} are needed",
            values.len(),
            times.len()
        ));
    }
    let ascends = times.windows(2).all(|pair| pair[0] < pair[1]);
    if !(ascends && times.iter().all(|time| time.is_finite())) {
        return Err("its times are not in ascending order".to_owned());
    }
    Ok(Track {
        times,
        values,
        interpolation,
    })
}
