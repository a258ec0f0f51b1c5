//! Storage buffers that passes bind, compared with what an adapter allows.

use super::{
    adapter::Context,
    error::GpuError,
    program::source,
    reflect::{Binding, reflect_at},
};

/// As many storage buffers as any shipped pass binds, which SwiftShader allows. Adapters that allow
/// them are not asked about each pass.
pub const MOST_STORAGE_BUFFERS: u32 = 10;

/// Number of storage buffers among bindings.
pub(super) fn storage_buffers(bindings: &[Binding]) -> u32 {
    let storage = bindings
        .iter()
        .filter(|binding| binding.access.is_storage());
    storage.count() as u32
}

/// Checks that the adapter allows a pass these bindings.
pub(super) fn check(context: &Context, pass: &str, bindings: &[Binding]) -> Result<(), GpuError> {
    let needed = storage_buffers(bindings);
    let allowed = context.limits.max_storage_buffers_per_shader_stage;
    if needed > allowed {
        return Err(GpuError::TooManyBuffers {
            pass: pass.to_owned(),
            needed,
            allowed,
            adapter: context.info.name.clone(),
        });
    }
    Ok(())
}

/// Checks that the adapter can bind the storage buffers of these passes, each given by its name and
/// the names for which `#ifdef` holds. Composes shaders, and compiles none.
///
/// # Errors
/// [`GpuError::TooManyBuffers`] for the first pass that it cannot, with the message of a program
/// that is built with it; [`GpuError::Shader`].
pub fn check_bindings<'a>(
    context: &Context,
    passes: impl IntoIterator<Item = (&'static str, &'a [&'static str])>,
) -> Result<(), GpuError> {
    let is_shipped = context.shaders.edited().is_none() && context.spoil.is_none();
    let allowed = context.limits.max_storage_buffers_per_shader_stage;
    if is_shipped && allowed >= MOST_STORAGE_BUFFERS {
        return Ok(());
    }
    passes.into_iter().try_for_each(|(pass, defines)| {
        let source = source(context, pass, defines)?;
        let reflection = reflect_at(pass, &source.text, &|line| source.location(line));
        let reflection = reflection.map_err(|error| context.shaders.blamed(error))?;
        check(context, pass, &reflection.bindings)
    })
}
