//! A cache of the passes compiled on a device.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use super::{
    adapter::Context,
    error::GpuError,
    program::{Pass, source},
    raster::{RasterPass, RasterSpec},
};

/// Compiled passes of one device. A program reuses every pass that an earlier program on the
/// device compiled. Edited shaders are not cached, because each program checks them against its
/// own buffers.
#[derive(Debug, Default)]
pub(super) struct Compiled {
    passes: Mutex<BTreeMap<PassKey, Arc<Pass>>>,
    rasters: Mutex<BTreeMap<(RasterKey, String), Arc<RasterPass>>>,
}

/// Name, bits of the override constants, and WGSL text of a compute pass.
type PassKey = (&'static str, Vec<(&'static str, u64)>, String);

/// Name, and formats and depth test, of a raster pass.
type RasterKey = (&'static str, String);

impl Compiled {
    /// Returns the compute pass with this name, text and constants, and compiles it by `make` if
    /// there is none. Constants that the text does not name are ignored.
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

    /// Returns the pass with this key, and compiles it by `make` if there is none.
    fn get<K: Ord, P>(
        passes: &Mutex<BTreeMap<K, Arc<P>>>,
        key: K,
        make: impl FnOnce() -> Result<P, GpuError>,
    ) -> Result<Arc<P>, GpuError> {
        let locked = || passes.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pass) = locked().get(&key) {
            return Ok(Arc::clone(pass));
        }
        // The lock is released while compiling, so two threads can compile at once.
        let pass = Arc::new(make()?);
        Ok(Arc::clone(locked().entry(key).or_insert(pass)))
    }
}

/// Returns the raster pass of `spec`, and compiles it by `make` if the device has none.
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
