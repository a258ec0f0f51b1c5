//! Typed names of buffers.
//!
//! A buffer is declared once, as a constant, and read and written through it, so that its name,
//! element type and element size are written in a single place:
//!
//! ```text
//! pub const VELOCITY: Buf<[f32; 3]> = Buf::new("velocity");
//! program.upload(VELOCITY, 0, &velocities);
//! let (velocity, id) = program.download((VELOCITY.first(n), ID.first(n)))?;
//! ```
//!
//! `tests/suite/gpu/shaders.rs` checks each element type against the WGSL variable with the
//! buffer's name: its stride and its scalars.

use std::{borrow::Cow, marker::PhantomData};

use super::reflect::Layout;
pub use super::reflect::Scalar;

/// Description of a buffer to allocate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BufferSpec {
    /// Unique name; shader variables of this name bind it.
    pub name: String,
    /// Size in bytes; rounded up to a multiple of 16.
    pub bytes: u64,
    /// Whether passes bind it as a uniform.
    pub is_uniform: bool,
    /// Whether passes bind parts of it: it may then be larger than the binding limit.
    pub is_windowed: bool,
    /// Element layout.
    pub element: BufferLayout,
}

impl BufferSpec {
    /// Returns the description with [`Self::is_windowed`] set.
    pub fn windowed(self) -> Self {
        Self {
            is_windowed: true,
            ..self
        }
    }
}

/// Selects the first values of a buffer.
#[derive(Clone, Debug)]
pub struct First<T> {
    pub(super) buffer: Buf<T>,
    pub(super) count: usize,
}

/// Binding of a shader variable to a resource of another name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bind {
    /// WGSL variable.
    pub variable: &'static str,
    /// Name of the buffer, texture or sampler.
    pub buffer: String,
    /// Byte offset and length; `None` binds the whole buffer.
    pub window: Option<(u64, u64)>,
}

impl Bind {
    /// Binds `variable` to all of `buffer`.
    pub fn whole<T>(variable: &'static str, buffer: &Buf<T>) -> Self {
        Self {
            variable,
            buffer: buffer.name().to_owned(),
            window: None,
        }
    }
}

/// A plain-old-data value with the same layout on the device.
pub trait Element: bytemuck::Pod {
    /// Scalar type of its components.
    const SCALAR: Scalar;
}

impl Element for f32 {
    const SCALAR: Scalar = Scalar::F32;
}

impl Element for f64 {
    const SCALAR: Scalar = Scalar::F64;
}

impl Element for u32 {
    const SCALAR: Scalar = Scalar::U32;
}

impl<T: Element, const N: usize> Element for [T; N]
where
    [T; N]: bytemuck::Pod,
{
    const SCALAR: Scalar = T::SCALAR;
}

/// Element layout of a buffer, for comparison with the shader variable of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BufferLayout {
    /// Bytes per value.
    pub bytes: u32,
    /// Scalar type of a value's components.
    pub scalar: Scalar,
    /// Bytes before the first value.
    pub head: u32,
}

/// A struct that also exists in the shaders under the same name.
pub trait Mirror: Element {
    /// Returns name, size and members, for comparison with the reflection of the shader's struct.
    fn layout() -> Layout;
}

/// Declares `repr(C)` structs that mirror the WGSL struct of the same name, or the one given
/// after `as`.
#[doc(hidden)]
#[macro_export]
macro_rules! mirror {
    (@name $name:ident) => { stringify!($name) };
    (@name $name:ident $wgsl:literal) => { $wgsl };
    ($(#[$meta:meta])* $name:ident $(as $wgsl:literal)? {
        $($(#[$field_meta:meta])* $field:ident: $ty:ty),+ $(,)?
    }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $name { $($(#[$field_meta])* pub $field: $ty),+ }

        impl $crate::buffer::Element for $name {
            const SCALAR: $crate::buffer::Scalar = $crate::buffer::Scalar::Mixed;
        }

        impl $crate::buffer::Mirror for $name {
            fn layout() -> $crate::reflect::Layout {
                $crate::reflect::Layout {
                    name: $crate::buffer::mirror!(@name $name $($wgsl)?).to_owned(),
                    size: size_of::<$name>() as u32,
                    members: vec![$((
                        stringify!($field).to_owned(),
                        std::mem::offset_of!($name, $field) as u32,
                    )),+],
                }
            }
        }
    };
}

pub use crate::mirror;

/// Workgroup counts of an indirect dispatch, a `vec4u` in shaders; zeros make it empty.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Workgroups {
    /// Count along each axis.
    pub count: [u32; 3],
    /// Unused.
    pub padding: u32,
}

impl Element for Workgroups {
    const SCALAR: Scalar = Scalar::U32;
}

impl From<[u32; 3]> for Workgroups {
    fn from(count: [u32; 3]) -> Self {
        Self { count, padding: 0 }
    }
}

/// Name and element type of a buffer of `T` values.
#[derive(Debug)]
pub struct Buf<T> {
    name: Cow<'static, str>,
    /// Bytes before the first value.
    offset: u64,
    is_uniform: bool,
    of: PhantomData<fn() -> T>,
}

impl<T> Clone for Buf<T> {
    fn clone(&self) -> Self {
        Self {
            name: self.name.clone(),
            ..*self
        }
    }
}

impl<T> Buf<T> {
    /// A storage buffer; shader variables of this name bind it.
    pub const fn new(name: &'static str) -> Self {
        Self::of(Cow::Borrowed(name), false)
    }

    /// A uniform buffer; shader variables of this name bind it.
    pub const fn uniform(name: &'static str) -> Self {
        Self::of(Cow::Borrowed(name), true)
    }

    /// A storage buffer whose name is built at run time, as one of several of a kind.
    pub const fn named(name: String) -> Self {
        Self::of(Cow::Owned(name), false)
    }

    /// The values that follow one `Head` value in a storage buffer.
    pub const fn behind<Head>(name: &'static str) -> Self {
        Self {
            name: Cow::Borrowed(name),
            offset: size_of::<Head>() as u64,
            is_uniform: false,
            of: PhantomData,
        }
    }

    const fn of(name: Cow<'static, str>, is_uniform: bool) -> Self {
        Self {
            name,
            offset: 0,
            is_uniform,
            of: PhantomData,
        }
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the same buffer description under another name.
    pub fn renamed(&self, name: &str) -> Self {
        Self {
            name: Cow::Owned(name.to_owned()),
            ..*self
        }
    }

    /// Returns the same bytes as values of another type.
    pub fn retyped<U>(&self) -> Buf<U> {
        Buf {
            name: self.name.clone(),
            offset: self.offset,
            is_uniform: self.is_uniform,
            of: PhantomData,
        }
    }

    /// Returns the description of the values that follow the first `count`.
    pub fn after(self, count: usize) -> Self {
        Self {
            offset: self.place(count),
            ..self
        }
    }

    /// Selects the first `count` values for reading.
    pub fn first(self, count: usize) -> First<T> {
        First {
            buffer: self,
            count,
        }
    }

    /// Byte offset of value `index`.
    pub fn place(&self, index: usize) -> u64 {
        self.offset + (index * size_of::<T>()) as u64
    }
}

impl<T: Element> Buf<T> {
    /// Describes an allocation with space for `count` values.
    pub fn sized(&self, count: usize) -> BufferSpec {
        BufferSpec {
            name: self.name.clone().into_owned(),
            bytes: self.offset + (count * size_of::<T>()) as u64,
            is_uniform: self.is_uniform,
            is_windowed: false,
            element: BufferLayout {
                bytes: size_of::<T>() as u32,
                scalar: T::SCALAR,
                head: self.offset as u32,
            },
        }
    }
}

/// A uniform buffer of which each dispatch binds one value of `T`, its window.
///
/// Windows are spaced by the largest offset alignment that WebGPU allows an adapter to require.
#[derive(Debug)]
pub struct Windows<T> {
    variable: &'static str,
    name: Cow<'static, str>,
    of: PhantomData<fn() -> T>,
}

/// Bytes from one window to the next.
const STRIDE: usize = 256;

impl<T> Windows<T> {
    /// Windows of buffer `name`, bound by shader variable `variable`.
    pub const fn new(variable: &'static str, name: &'static str) -> Self {
        Self {
            variable,
            name: Cow::Borrowed(name),
            of: PhantomData,
        }
    }

    /// Same with a name that is built at run time.
    pub const fn named(variable: &'static str, name: String) -> Self {
        Self {
            variable,
            name: Cow::Owned(name),
            of: PhantomData,
        }
    }

    /// Returns the name of the buffer.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the name of the shader variable.
    pub fn variable(&self) -> &'static str {
        self.variable
    }

    /// Binds the variable to window `index`.
    pub fn bind(&self, index: usize) -> Bind {
        const { assert!(size_of::<T>() <= STRIDE) };
        Bind {
            variable: self.variable,
            buffer: self.name.clone().into_owned(),
            window: Some(((index * STRIDE) as u64, size_of::<T>() as u64)),
        }
    }
}

impl<T: Element> Windows<T> {
    /// Describes an allocation of `count` windows.
    pub fn sized(&self, count: usize) -> BufferSpec {
        BufferSpec {
            name: self.name.clone().into_owned(),
            bytes: (count * STRIDE) as u64,
            is_uniform: true,
            is_windowed: false,
            element: BufferLayout {
                bytes: size_of::<T>() as u32,
                scalar: T::SCALAR,
                head: 0,
            },
        }
    }

    /// Returns the bytes of a buffer that holds `values`, one per window.
    pub fn bytes(values: &[T]) -> Vec<u8> {
        let mut bytes = vec![0; values.len() * STRIDE];
        for (window, value) in bytes.chunks_exact_mut(STRIDE).zip(values) {
            window[..size_of::<T>()].copy_from_slice(bytemuck::bytes_of(value));
        }
        bytes
    }
}
