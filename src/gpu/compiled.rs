//! Passes that were compiled on a device, kept for the next program that has them.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use super::{
    adapter::{Context, GpuError},
    program::{Pass, source},
    raster::{RasterPass, RasterSpec},
};

/// Passes that were compiled on one device, so that a program whose passes another has compiles none again. Passes of edited
/// shaders are compiled for each program: they are checked against its buffers.
#[derive(Debug, Default)]
pub(super) struct Compiled {
    passes: Mutex<BTreeMap<PassKey, Arc<Pass>>>,
    rasters: Mutex<BTreeMap<(RasterKey, String), Arc<RasterPass>>>,
}

/// Name, bits of the constants, and text of a pass.
type PassKey = (&'static str, Vec<(&'static str, u64)>, String);

/// What a raster pass is made of, beside the text of its shader.
type RasterKey = (&'static str, String);

impl Compiled {
    /// The compute pass of that name and text; made where there is none. Of the constants those count that the text names.
    pub(super) fn pass<'a>(
        &self,
        name: &'static str,
        constants: impl Iterator<Item = &'a (&'static str, f64)>,
        text: String,
        make: impl FnOnce() -> Result<Pass, GpuError>,
    ) -> Result<Arc<Pass>, GpuError> {
        let named = constants.filter(|(constant, _)| text.contains(constant));
        let bits = named.map(|&(constant, value)| (constant, value.to_bits()));
        let key = (name, bits.collect(), text);
        Self::get(&self.passes, key, make)
    }

    /// The pass of that key; made where there is none.
    fn get<K: Ord, P>(
        passes: &Mutex<BTreeMap<K, Arc<P>>>,
        key: K,
        make: impl FnOnce() -> Result<P, GpuError>,
    ) -> Result<Arc<P>, GpuError> {
        let locked = || passes.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pass) = locked().get(&key) {
            return Ok(Arc::clone(pass));
        }
        // Not under the lock: two threads may compile at once.
        let pass = Arc::new(make()?);
        Ok(Arc::clone(locked().entry(key).or_insert(pass)))
    }
}

/// Compiles a raster pass, or takes it from those that were compiled on the device.
///
/// # Errors
/// Those of `make`, and of composing its shader.
pub(super) fn compiled_raster(
    context: &Context,
    spec: &RasterSpec,
    make: impl FnOnce() -> Result<RasterPass, GpuError>,
) -> Result<Arc<RasterPass>, GpuError> {
    if context.shaders.edited().is_some() {
        return Ok(Arc::new(make()?));
    }
    let text = source(context, spec.name, spec.defines)?.text;
    let key = (spec.name, format!("{:?} {:?}", spec.colours, spec.compare));
    Compiled::get(&context.compiled.rasters, (key, text), make)
}
