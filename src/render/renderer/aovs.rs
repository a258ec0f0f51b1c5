//! Channels beside the picture, back from the device.

use super::Renderer;
use crate::{
    render::{RenderError, buffers::aovs, frame::FAR, image::Aovs},
    scene::look::AovSpec,
};

impl Renderer {
    pub(super) fn read_aovs(&self) -> Result<Aovs, RenderError> {
        let values: Vec<[f32; 10]> = self.read_bands(aovs, 1)?;
        let origin = self.scene.origin + self.scene.domain.min;
        let seen = |v: &[f32; 10]| v[0] < 0.1 * FAR;
        let wants = |aov| self.look.wants(aov);
        Ok(Aovs {
            z: wants(AovSpec::Z).then(|| values.iter().map(|v| v[0]).collect()),
            n: wants(AovSpec::N).then(|| values.iter().map(|v| [v[1], v[2], v[3]]).collect()),
            p: wants(AovSpec::P).then(|| {
                values
                    .iter()
                    .map(|v| {
                        if !seen(v) {
                            return [0.0; 3];
                        }
                        [0, 1, 2].map(|axis| (f64::from(v[4 + axis]) + origin[axis]) as f32)
                    })
                    .collect()
            }),
            forward: wants(AovSpec::Forward).then(|| values.iter().map(|v| [v[7], v[8]]).collect()),
            thickness: wants(AovSpec::Thickness).then(|| values.iter().map(|v| v[9]).collect()),
        })
    }
}
