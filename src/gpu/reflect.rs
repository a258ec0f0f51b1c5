//! Reflection of composed shaders: bindings, workgroup size, struct layouts.
//!
//! Bind groups are built from it, so no binding list is written by hand.

use std::error::Error as _;

use naga::{
    AddressSpace, ImageClass, ImageDimension, ScalarKind, ShaderStage, StorageAccess, TypeInner,
    valid::GlobalUse,
};

use super::error::GpuError;

/// Scalar type of the components of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    /// `f32`.
    F32,
    /// `f64`.
    F64,
    /// `u32`.
    U32,
    /// Several types, as in a struct, whose members
    /// [`Mirror::layout`](super::buffer::Mirror::layout) lists.
    Mixed,
}

/// How a buffer, texture or sampler is bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// `var<uniform>`.
    Uniform,
    /// `var<storage, read>`.
    Read,
    /// `var<storage, read_write>`.
    ReadWrite,
    /// `texture_2d<f32>`, of a filterable format.
    Texture,
    /// `texture_depth_2d`.
    DepthTexture,
    /// `sampler`.
    Sampler,
    /// `sampler_comparison`.
    CompareSampler,
}

impl Access {
    /// Returns whether it counts towards the adapter's limit of storage buffers.
    pub fn is_storage(self) -> bool {
        matches!(self, Self::Read | Self::ReadWrite)
    }
}

/// Pipeline stage of a shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// One compute entry point.
    Compute,
    /// A vertex entry point, for a raster pass.
    Raster {
        /// Whether there is also a fragment entry point; without one, only depth is drawn.
        has_fragment: bool,
    },
}

/// One binding of group 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    /// WGSL variable, which is also the name of the buffer unless a command binds another.
    pub name: String,
    /// `@binding(n)`.
    pub index: u32,
    /// Kind of the binding.
    pub access: Access,
    /// Whether the shader reads it.
    pub is_read: bool,
    /// Whether the shader writes it.
    pub is_written: bool,
    /// Element type of the array, after its head if there is one; the type itself if it is not
    /// an array.
    pub element: ElementType,
}

/// A type in its WGSL layout.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ElementType {
    /// Bytes from one element of the array to the next.
    pub stride: u32,
    /// Scalar type of its components.
    pub scalar: Scalar,
    /// Name if it is a struct.
    pub name: Option<String>,
    /// Bytes before the array.
    pub head: u32,
}

/// Layout of a `struct` of the shader.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Struct name.
    pub name: String,
    /// Size in bytes.
    pub size: u32,
    /// Member names with their byte offsets.
    pub members: Vec<(String, u32)>,
}

/// Reflection of one pass.
#[derive(Clone, Debug)]
pub struct Reflection {
    /// Stage given by its entry points.
    pub stage: Stage,
    /// Bindings in the order of their indices.
    pub bindings: Vec<Binding>,
    /// Threads per workgroup along each axis; zeros for a raster pass.
    pub workgroup_size: [u32; 3],
    /// Layouts of all named structs.
    pub layouts: Vec<Layout>,
    /// Names of the `override` constants.
    pub overrides: Vec<String>,
    /// Named `u32` constants with their values.
    pub constants: Vec<(String, u32)>,
    /// Whether the shader computes in f64.
    pub has_f64: bool,
}

/// Element type of a binding of type `ty`.
fn element_of(module: &naga::Module, ty: naga::Handle<naga::Type>) -> ElementType {
    match &module.types[ty].inner {
        TypeInner::Array { base, stride, .. } => ElementType {
            stride: *stride,
            ..element(module, *base)
        },
        // A struct that ends in a runtime-sized array is the array's head.
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

/// The struct of shared/vector.wgsl, which represents three numbers of its first member's type.
const VECTOR: &str = "Vector";

fn element(module: &naga::Module, ty: naga::Handle<naga::Type>) -> ElementType {
    let naga::Type { name, inner } = &module.types[ty];
    let is_vector = name.as_deref() == Some(VECTOR);
    let kind = match inner {
        TypeInner::Atomic(scalar) => Some(*scalar),
        TypeInner::Struct { members, .. } if is_vector => {
            (members.first()).and_then(|member| module.types[member.ty].inner.scalar())
        }
        _ => inner.scalar(),
    };
    ElementType {
        stride: inner.size(module.to_ctx()),
        scalar: match kind.map(|scalar| (scalar.kind, scalar.width)) {
            Some((ScalarKind::Float, 4)) => Scalar::F32,
            Some((ScalarKind::Float, 8)) => Scalar::F64,
            Some((ScalarKind::Uint, 4)) => Scalar::U32,
            _ => Scalar::Mixed,
        },
        name: match inner {
            TypeInner::Struct { .. } if !is_vector => name.clone(),
            _ => None,
        },
        head: 0,
    }
}

fn stage(module: &naga::Module) -> Option<Stage> {
    let mut stages: Vec<ShaderStage> = module.entry_points.iter().map(|e| e.stage).collect();
    stages.sort_by_key(|stage| *stage == ShaderStage::Fragment);
    match stages.as_slice() {
        [ShaderStage::Compute] => Some(Stage::Compute),
        [ShaderStage::Vertex] => Some(Stage::Raster {
            has_fragment: false,
        }),
        [ShaderStage::Vertex, ShaderStage::Fragment] => Some(Stage::Raster { has_fragment: true }),
        _ => None,
    }
}

/// Kind of a global variable's binding; `None` if passes may not bind it.
fn access(module: &naga::Module, variable: &naga::GlobalVariable) -> Option<Access> {
    match variable.space {
        AddressSpace::Uniform => Some(Access::Uniform),
        AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => {
            Some(Access::ReadWrite)
        }
        AddressSpace::Storage { .. } => Some(Access::Read),
        AddressSpace::Handle => match module.types[variable.ty].inner {
            TypeInner::Sampler { comparison: true } => Some(Access::CompareSampler),
            TypeInner::Sampler { comparison: false } => Some(Access::Sampler),
            TypeInner::Image {
                dim: ImageDimension::D2,
                arrayed: false,
                class,
            } => match class {
                ImageClass::Sampled {
                    kind: ScalarKind::Float,
                    multi: false,
                } => Some(Access::Texture),
                ImageClass::Depth { multi: false } => Some(Access::DepthTexture),
                _ => None,
            },
            _ => None,
        },
        _ => None,
    }
}

/// Reflects `wgsl`, which must have one compute entry point, or one vertex entry point with or
/// without a fragment entry point.
///
/// # Errors
/// [`GpuError::Shader`] if it does not parse or validate, has other entry points, binds outside of
/// group 0, or binds anything that [`Access`] does not list.
pub fn reflect(name: &str, wgsl: &str) -> Result<Reflection, GpuError> {
    reflect_at(name, wgsl, &|line| format!("line {line}"))
}

/// Parses and validates a text. Errors name positions through `place`, which maps lines counted
/// from 1.
pub(super) fn validated(
    name: &str,
    wgsl: &str,
    place: &dyn Fn(usize) -> String,
) -> Result<(naga::Module, naga::valid::ModuleInfo), GpuError> {
    let fault = |message: String| GpuError::Shader {
        name: name.to_owned(),
        message,
    };
    let located = |message: String, labels: Vec<(naga::Span, String)>, notes: Vec<String>| {
        let label = |(span, label): &(naga::Span, String)| {
            let at = span.location(wgsl);
            let line = at.line_number as usize;
            let text = wgsl.lines().nth(line - 1).unwrap_or_default().trim();
            format!("\n  {}: {label}: {text}", place(line))
        };
        let labels = labels
            .iter()
            .filter(|(span, _)| span.is_defined())
            .map(label);
        let notes = notes.iter().map(|note| format!("\n  {note}"));
        fault(message + &labels.chain(notes).collect::<String>())
    };
    let module = naga::front::wgsl::parse_str(wgsl).map_err(|error| {
        let labels = error.labels().map(|(span, label)| (span, label.to_owned()));
        let notes = error.notes().map(str::to_owned).collect();
        located(error.message().to_owned(), labels.collect(), notes)
    })?;
    let info = validator().validate(&module).map_err(|error| {
        let mut causes = Vec::new();
        let mut next = error.as_inner().source();
        while let Some(cause) = next {
            causes.push(cause.to_string());
            next = cause.source();
        }
        let labels = error.spans().cloned().collect();
        located(error.as_inner().to_string(), labels, causes)
    })?;
    Ok((module, info))
}

/// A validator of all that a pass may use.
pub(super) fn validator() -> naga::valid::Validator {
    let capabilities = naga::valid::Capabilities::default() | naga::valid::Capabilities::FLOAT64;
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities)
}

/// Same as [`reflect`]; errors name positions through `place`, which maps lines counted from 1.
pub(super) fn reflect_at(
    name: &str,
    wgsl: &str,
    place: &dyn Fn(usize) -> String,
) -> Result<Reflection, GpuError> {
    let (module, info) = validated(name, wgsl, place)?;
    let fault = |message: String| GpuError::Shader {
        name: name.to_owned(),
        message,
    };
    let stage = stage(&module).ok_or_else(|| {
        let count = module.entry_points.len();
        fault(format!("{count} entry points, which do not form a pass"))
    })?;
    let entries = 0..module.entry_points.len();
    let uses = |variable: naga::Handle<naga::GlobalVariable>, how: GlobalUse| {
        let mut entries = entries.clone();
        entries.any(|entry| info.get_entry_point(entry)[variable].intersects(how))
    };
    let mut bindings = Vec::new();
    for (handle, variable) in module.global_variables.iter() {
        let Some(place) = variable.binding else {
            continue;
        };
        let access = access(&module, variable)
            .ok_or_else(|| fault(format!("{:?} is not bound by any pass", variable.name)))?;
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
            is_read: uses(handle, GlobalUse::READ | GlobalUse::ATOMIC),
            is_written: uses(handle, GlobalUse::WRITE | GlobalUse::ATOMIC),
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
        scalar.is_some_and(|scalar| scalar.kind == ScalarKind::Float && scalar.width == 8)
    });
    Ok(Reflection {
        stage,
        has_f64,
        bindings,
        workgroup_size: module.entry_points[0].workgroup_size,
        layouts,
        constants,
        overrides,
    })
}
