//! What a composed shader says of itself: bindings, workgroup size, struct layouts.
//!
//! Bind groups are built from this, so no binding list is typed by hand.

use naga::{AddressSpace, ShaderStage, StorageAccess, TypeInner};

use super::{adapter::GpuError, buffer::Scalar};

/// How a buffer is bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// `var<uniform>`.
    Uniform,
    /// `var<storage, read>`.
    Read,
    /// `var<storage, read_write>`.
    ReadWrite,
}

/// One buffer binding of group 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    /// The WGSL variable, which names the buffer too unless a step says otherwise.
    pub name: String,
    /// `@binding(n)`.
    pub index: u32,
    /// Uniform or storage.
    pub access: Access,
    /// What it is an array of, behind its head where it has one; what it is where it is no array.
    pub element: ElementType,
}

/// A type as WGSL lays it out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ElementType {
    /// Bytes from one element of the array to the next.
    pub stride: u32,
    /// What it is made of.
    pub scalar: Scalar,
    /// Its name where it is a struct.
    pub name: Option<String>,
    /// Bytes of a scalar; 0 of a mixed one.
    pub scalar_bytes: u8,
    /// Bytes before the array.
    pub head: u32,
}

/// A `struct` of the shader as WGSL lays it out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Struct name.
    pub name: String,
    /// Bytes.
    pub size: u32,
    /// Member names with their byte offsets.
    pub members: Vec<(String, u32)>,
}

/// Reflection of one pass.
#[derive(Clone, Debug)]
pub struct Reflection {
    /// In order of binding index.
    pub bindings: Vec<Binding>,
    /// Threads a workgroup.
    pub workgroup_size: [u32; 3],
    /// Every named struct.
    pub layouts: Vec<Layout>,
    /// Names of its `override` constants.
    pub overrides: Vec<String>,
    /// Its constants of u32.
    pub constants: Vec<(String, u32)>,
    /// Whether it computes in f64.
    pub has_f64: bool,
}

/// What a binding of type `ty` consists of.
fn element_of(module: &naga::Module, ty: naga::Handle<naga::Type>) -> ElementType {
    match &module.types[ty].inner {
        TypeInner::Array { base, stride, .. } => ElementType {
            stride: *stride,
            ..element(module, *base)
        },
        // A struct that ends in an array without a length is that array's head.
        TypeInner::Struct { members, .. } => match members.last() {
            Some(last) if is_unsized(module, last.ty) => ElementType {
                head: last.offset,
                ..element_of(module, last.ty)
            },
            _ => element(module, ty),
        },
        _ => element(module, ty),
    }
}

fn is_unsized(module: &naga::Module, ty: naga::Handle<naga::Type>) -> bool {
    let size = naga::ArraySize::Dynamic;
    matches!(&module.types[ty].inner, TypeInner::Array { size: of, .. } if *of == size)
}

fn element(module: &naga::Module, ty: naga::Handle<naga::Type>) -> ElementType {
    let inner = &module.types[ty].inner;
    let kind = inner.scalar();
    ElementType {
        stride: inner.size(module.to_ctx()),
        scalar: match kind.map(|scalar| scalar.kind) {
            Some(naga::ScalarKind::Float) => Scalar::Float,
            Some(naga::ScalarKind::Uint) => Scalar::Uint,
            _ => Scalar::Mixed,
        },
        name: match inner {
            TypeInner::Struct { .. } => module.types[ty].name.clone(),
            _ => None,
        },
        scalar_bytes: kind.map_or(0, |scalar| scalar.width),
        head: 0,
    }
}

/// Reads the single compute entry point of `wgsl`.
///
/// # Errors
/// [`GpuError::Shader`] where it does not parse or validate, has another number of entry points, or
/// binds outside group 0.
pub fn reflect(name: &str, wgsl: &str) -> Result<Reflection, GpuError> {
    let fault = |message: String| GpuError::Shader {
        name: name.to_owned(),
        message,
    };
    let module =
        naga::front::wgsl::parse_str(wgsl).map_err(|error| fault(error.emit_to_string(wgsl)))?;
    let mut validator = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::default() | naga::valid::Capabilities::FLOAT64,
    );
    validator
        .validate(&module)
        .map_err(|error| fault(error.emit_to_string(wgsl)))?;
    let [entry] = module.entry_points.as_slice() else {
        return Err(fault(format!(
            "{} entry points, not one",
            module.entry_points.len()
        )));
    };
    if entry.stage != ShaderStage::Compute {
        return Err(fault("not a compute pass".into()));
    }
    let mut bindings = Vec::new();
    for (_, variable) in module.global_variables.iter() {
        let Some(place) = variable.binding else {
            continue;
        };
        let access = match variable.space {
            AddressSpace::Uniform => Access::Uniform,
            AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => {
                Access::ReadWrite
            }
            AddressSpace::Storage { .. } => Access::Read,
            _ => return Err(fault("only buffers are bound".into())),
        };
        if place.group != 0 {
            return Err(fault(format!("group {} is not 0", place.group)));
        }
        let name = variable
            .name
            .clone()
            .ok_or_else(|| fault("a binding without a name".into()))?;
        bindings.push(Binding {
            name,
            index: place.binding,
            access,
            element: element_of(&module, variable.ty),
        });
    }
    bindings.sort_by_key(|binding| binding.index);
    let layouts = module
        .types
        .iter()
        .filter_map(|(_, ty)| match &ty.inner {
            TypeInner::Struct { members, span } => Some(Layout {
                name: ty.name.clone()?,
                size: *span,
                members: members
                    .iter()
                    .filter_map(|m| Some((m.name.clone()?, m.offset)))
                    .collect(),
            }),
            _ => None,
        })
        .collect();
    let overrides = module
        .overrides
        .iter()
        .filter_map(|(_, constant)| constant.name.clone())
        .collect();
    let constants = module
        .constants
        .iter()
        .filter_map(|(_, constant)| {
            let naga::Expression::Literal(naga::Literal::U32(value)) =
                module.global_expressions[constant.init]
            else {
                return None;
            };
            Some((constant.name.clone()?, value))
        })
        .collect();
    let has_f64 = module.types.iter().any(|(_, ty)| {
        let scalar = ty.inner.scalar();
        scalar.is_some_and(|scalar| scalar.kind == naga::ScalarKind::Float && scalar.width == 8)
    });
    Ok(Reflection {
        has_f64,
        bindings,
        workgroup_size: entry.workgroup_size,
        layouts,
        constants,
        overrides,
    })
}
