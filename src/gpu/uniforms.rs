//! Uniform buffers that a driver can take.
//!
//! Mesa's software driver, from 22.1 until 24, replaces uniforms with constants where a condition
//! depends on nothing else. It keeps the offsets of those uniforms in a table of 32 buffers by 4
//! offsets, and indexes it as if it were 32 by 32 (`uni_offsets[ubo * PIPE_MAX_CONSTANT_BUFFERS +
//! i]` in `lvp_inline_uniforms.c`), so a shader whose fourth uniform buffer, or a later one, is in
//! such a condition overwrites memory behind the table: counts first, then the heap. There, a
//! shader's further uniform buffers are bound as read-only storage buffers, which hold the same
//! bytes.

use std::borrow::Cow;

use naga::{AddressSpace, StorageAccess};
use wgpu::{BindGroupLayoutEntry, BindingType, BufferBindingType, ShaderSource};

use super::error::GpuError;

/// Uniform buffers of a shader whose offsets lie within the table: rows begin at 0, for immediates,
/// and every 32 words, of 128.
const WITHIN_TABLE: usize = 3;

/// Uniform buffers that a shader may bind on the driver of this adapter; `None` for as many as the
/// adapter's limits allow.
pub(super) fn most(info: &wgpu::AdapterInfo) -> Option<usize> {
    is_faulty(&info.driver, &info.driver_info).then_some(WITHIN_TABLE)
}

fn is_faulty(driver: &str, version: &str) -> bool {
    let mesa = version.split_once("Mesa ").map(|(_, it)| it);
    let major = mesa.and_then(|it| it.split('.').next()?.parse::<u32>().ok());
    driver == "llvmpipe" && major.is_none_or(|major| major < 24)
}

/// Makes storage buffers of the uniform buffers of pass `name` after the first `most`, by binding.
///
/// # Errors
/// [`GpuError::Shader`] if the source has to be rewritten and cannot be parsed.
pub(super) fn limited<'a>(
    name: &str,
    most: usize,
    entries: &[BindGroupLayoutEntry],
    source: ShaderSource<'a>,
) -> Result<(Vec<BindGroupLayoutEntry>, ShaderSource<'a>), GpuError> {
    let mut entries = entries.to_vec();
    let mut uniforms: Vec<&mut BindGroupLayoutEntry> = (entries.iter_mut())
        .filter(|entry| is_uniform(entry.ty))
        .collect();
    uniforms.sort_by_key(|entry| entry.binding);
    let further = uniforms.into_iter().skip(most);
    let moved: Vec<u32> = further
        .map(|entry| {
            if let BindingType::Buffer { ty, .. } = &mut entry.ty {
                *ty = BufferBindingType::Storage { read_only: true };
            }
            entry.binding
        })
        .collect();
    if moved.is_empty() {
        return Ok((entries, source));
    }
    let mut module = match source {
        ShaderSource::Naga(module) => module.into_owned(),
        ShaderSource::Wgsl(text) => {
            naga::front::wgsl::parse_str(&text).map_err(|error| GpuError::Shader {
                name: name.to_owned(),
                message: error.emit_to_string(&text),
            })?
        }
        _ => unreachable!("shaders are WGSL, or a module made of it"),
    };
    for (_, variable) in module.global_variables.iter_mut() {
        if variable
            .binding
            .is_some_and(|at| moved.contains(&at.binding))
        {
            let access = StorageAccess::LOAD;
            variable.space = AddressSpace::Storage { access };
        }
    }
    Ok((entries, ShaderSource::Naga(Cow::Owned(module))))
}

fn is_uniform(ty: BindingType) -> bool {
    let uniform = BufferBindingType::Uniform;
    matches!(ty, BindingType::Buffer { ty, .. } if ty == uniform)
}

#[cfg(test)]
mod tests {
    use super::{
        super::{
            program::entries,
            reflect::{reflect, validator},
            variants::forms,
        },
        *,
    };

    fn uniforms(module: &naga::Module) -> usize {
        let variables = module.global_variables.iter();
        let uniform = |it: &naga::GlobalVariable| it.space == AddressSpace::Uniform;
        variables.filter(|(_, it)| uniform(it)).count()
    }

    #[test]
    fn no_pass_has_more_uniform_buffers_than_the_driver_can_take() {
        let mut rewritten = 0;
        for form in forms().expect("they compose") {
            let (name, text) = (form.pass.as_str(), form.text.as_str());
            let own = naga::front::wgsl::parse_str(text).expect("it parses");
            let bindings = reflect(name, text).expect("it reflects").bindings;
            let listed = entries(&bindings, wgpu::ShaderStages::COMPUTE);
            let wgsl = ShaderSource::Wgsl(text.into());
            let (listed, source) = limited(name, WITHIN_TABLE, &listed, wgsl).expect("it parses");
            let bound = listed.iter().filter(|it| is_uniform(it.ty)).count();
            assert_eq!(bound, uniforms(&own).min(WITHIN_TABLE), "{name}");
            let ShaderSource::Naga(module) = source else {
                assert_eq!(bound, uniforms(&own), "{name}");
                continue;
            };
            assert_eq!(uniforms(&module), WITHIN_TABLE, "{name}");
            if let Err(error) = validator().validate(&module) {
                panic!("{name}: {}", error.emit_to_string(text));
            }
            rewritten += 1;
        }
        assert!(rewritten > 8, "{rewritten}");
    }

    #[test]
    fn it_is_the_software_driver_before_mesa_24() {
        for (driver, version, expected) in [
            ("llvmpipe", "Mesa 22.3.6 (LLVM 15.0.6)", true),
            ("llvmpipe", "Mesa 23.2.1-1ubuntu3.1 (LLVM 15.0.7)", true),
            ("llvmpipe", "unknown", true),
            ("llvmpipe", "Mesa 24.0.0 (LLVM 17.0.6)", false),
            ("llvmpipe", "Mesa 25.0.7 (LLVM 19.1.7)", false),
            ("radv", "Mesa 22.3.6", false),
            ("NVIDIA", "570.86.15", false),
        ] {
            assert_eq!(is_faulty(driver, version), expected, "{driver} {version}");
        }
    }
}
