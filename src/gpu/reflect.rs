//! What a composed shader says of itself: bindings, workgroup size, struct layouts.
//!
//! Bind groups are built from this, so no binding list is typed by hand.

use std::error::Error as _;

use naga::{
    AddressSpace, ImageClass, ImageDimension, ScalarKind, ShaderStage, StorageAccess, TypeInner,
    valid::GlobalUse,
};

use super::{adapter::GpuError, buffer::Scalar};

/// How a buffer, texture or sampler is bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// `var<uniform>`.
    Uniform,
    /// `var<storage, read>`.
    Read,
    /// `var<storage, read_write>`.
    ReadWrite,
    /// `texture_2d<f32>`, of a format that filters.
    Texture,
    /// `texture_depth_2d`.
    DepthTexture,
    /// `sampler`.
    Sampler,
    /// `sampler_comparison`.
    CompareSampler,
}

impl Access {
    /// Whether it counts against the adapter's limit of storage buffers.
    pub fn is_storage(self) -> bool {
        matches!(self, Self::Read | Self::ReadWrite)
    }
}

/// What a shader is compiled into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// One compute entry point.
    Compute,
    /// A vertex entry point.
    Raster {
        /// Whether a fragment entry point stands beside it; without one, depth alone is drawn.
        has_fragment: bool,
    },
}

/// One binding of group 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    /// The WGSL variable, which names the buffer too unless a step says otherwise.
    pub name: String,
    /// `@binding(n)`.
    pub index: u32,
    /// Uniform or storage.
    pub access: Access,
    /// Whether the shader reads it.
    pub is_read: bool,
    /// Whether the shader writes it.
    pub is_written: bool,
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
    /// Its entry points.
    pub stage: Stage,
    /// In order of binding index.
    pub bindings: Vec<Binding>,
    /// Threads a workgroup along each axis; zeros of a raster pass.
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

/// The struct of shared/vector.wgsl, which stands for three numbers of its first member's kind.
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

/// How a global variable is bound; `None` where no pass may bind it.
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

/// Reads the entry points of `wgsl`: one of compute, or one of vertices with or without one of fragments.
///
/// # Errors
/// [`GpuError::Shader`] where it does not parse or validate, has other entry points, binds outside group 0, or binds
/// anything but what [`Access`] lists.
pub fn reflect(name: &str, wgsl: &str) -> Result<Reflection, GpuError> {
    reflect_at(name, wgsl, &|line| format!("line {line}"))
}

/// A text as naga has it, and what it says of that. Faults name places, of lines from 1, as `place` says.
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
    let mut validator = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::default() | naga::valid::Capabilities::FLOAT64,
    );
    let info = validator.validate(&module).map_err(|error| {
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

/// [`reflect`] of a text whose lines stand where `place` says: faults name places, of lines from 1.
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
        fault(format!("{count} entry points, which are no pass"))
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
