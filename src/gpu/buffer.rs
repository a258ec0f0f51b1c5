//! Buffers by name and by the type of what they hold.
//!
//! A buffer is declared once, as a constant, and read and written through it, so that no place types its name, its
//! element's size or its element's type a second time:
//!
//! ```text
//! pub const VELOCITY: Buf<[f32; 3]> = Buf::new("velocity");
//! program.upload(VELOCITY, 0, &velocities);
//! let (velocity, id) = program.download((VELOCITY.first(n), ID.first(n)))?;
//! ```
//!
//! `tests/shaders.rs` holds each element type against the WGSL variable of the buffer's name: its stride, and what
//! scalars it is of.

use std::{borrow::Cow, marker::PhantomData};

use super::{program::BufferSpec, reflect::Layout};

/// Scalars of which a value is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    /// `f32`.
    F32,
    /// `f64`.
    F64,
    /// `u32`.
    U32,
    /// Several kinds, as in a struct, whose members [`Mirror::layout`] names.
    Mixed,
}

/// A value of plain bits that is the same on the device.
pub trait Element: bytemuck::Pod {
    /// What it is made of.
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

/// What a buffer holds, for comparison with the shaders' variable of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Held {
    /// Of a value.
    pub bytes: u32,
    /// What a value is made of.
    pub scalar: Scalar,
    /// Bytes before the first value.
    pub head: u32,
}

/// A struct that the shaders have too, under the same name.
pub trait Mirror: Element {
    /// Name, size and members, for comparison with what naga makes of the shader's.
    fn layout() -> Layout;
}

/// Declares `repr(C)` structs that mirror WGSL's of the same name, or of the one given after `as`.
#[doc(hidden)]
#[macro_export]
macro_rules! mirror {
    (@name $name:ident) => { stringify!($name) };
    (@name $name:ident $wgsl:literal) => { $wgsl };
    ($(#[$meta:meta])* $name:ident $(as $wgsl:literal)? { $($(#[$field_meta:meta])* $field:ident: $ty:ty),+ $(,)? }) => {
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
                    members: vec![$((stringify!($field).to_owned(), std::mem::offset_of!($name, $field) as u32)),+],
                }
            }
        }
    };
}

pub use crate::mirror;

/// Workgroups of an indirect dispatch, a `vec4u` of the shaders; zeros make it empty.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Workgroups {
    /// Along each axis.
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

/// A buffer of values of `T`.
#[derive(Debug)]
pub struct Buf<T> {
    name: Cow<'static, str>,
    /// Bytes before the first of them.
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
    /// A storage buffer; a shader variable of this name binds it.
    pub const fn new(name: &'static str) -> Self {
        Self::of(Cow::Borrowed(name), false)
    }

    /// A uniform.
    pub const fn uniform(name: &'static str) -> Self {
        Self::of(Cow::Borrowed(name), true)
    }

    /// A storage buffer whose name is made while the program runs, as one of several of a kind.
    pub const fn named(name: String) -> Self {
        Self::of(Cow::Owned(name), false)
    }

    /// What stands behind one value of `Head` in a storage buffer.
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

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// One of another name that holds the same.
    pub fn renamed(&self, name: &str) -> Self {
        Self {
            name: Cow::Owned(name.to_owned()),
            ..*self
        }
    }

    /// The same bytes as values of another type.
    pub fn retyped<U>(&self) -> Buf<U> {
        Buf {
            name: self.name.clone(),
            offset: self.offset,
            is_uniform: self.is_uniform,
            of: PhantomData,
        }
    }

    /// The first `count` values, to be read.
    pub fn first(self, count: usize) -> First<T> {
        First {
            buffer: self,
            count,
        }
    }

    /// Where value `index` begins, bytes.
    pub(super) fn place(&self, index: usize) -> u64 {
        self.offset + (index * size_of::<T>()) as u64
    }
}

impl<T: Element> Buf<T> {
    /// One that holds `count` values.
    pub fn sized(&self, count: usize) -> BufferSpec {
        BufferSpec {
            name: self.name.clone().into_owned(),
            bytes: self.offset + (count * size_of::<T>()) as u64,
            is_uniform: self.is_uniform,
            is_windowed: false,
            element: Held {
                bytes: size_of::<T>() as u32,
                scalar: T::SCALAR,
                head: self.offset as u32,
            },
        }
    }
}

/// A uniform of which each dispatch binds one value of `T`.
///
/// Values stand a stride apart that is the largest offset alignment that WebGPU lets an adapter ask for.
#[derive(Debug)]
pub struct Windows<T> {
    variable: &'static str,
    name: Cow<'static, str>,
    of: PhantomData<fn() -> T>,
}

/// Bytes between the beginnings of windows.
const STRIDE: usize = 256;

impl<T> Windows<T> {
    /// Windows of buffer `name`, which shader variable `variable` binds.
    pub const fn new(variable: &'static str, name: &'static str) -> Self {
        Self {
            variable,
            name: Cow::Borrowed(name),
            of: PhantomData,
        }
    }

    /// The same of a name that is made while the program runs.
    pub const fn named(variable: &'static str, name: String) -> Self {
        Self {
            variable,
            name: Cow::Owned(name),
            of: PhantomData,
        }
    }

    /// Name of the buffer.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Name of the variable.
    pub fn variable(&self) -> &'static str {
        self.variable
    }

    /// Binds the variable to window `index`.
    pub fn bind(&self, index: usize) -> super::recording::Bind {
        const { assert!(size_of::<T>() <= STRIDE) };
        super::recording::Bind {
            variable: self.variable,
            buffer: self.name.clone().into_owned(),
            window: Some(((index * STRIDE) as u64, size_of::<T>() as u64)),
        }
    }
}

impl<T: Element> Windows<T> {
    /// A buffer of `count` windows.
    pub fn sized(&self, count: usize) -> BufferSpec {
        BufferSpec {
            name: self.name.clone().into_owned(),
            bytes: (count * STRIDE) as u64,
            is_uniform: true,
            is_windowed: false,
            element: Held {
                bytes: size_of::<T>() as u32,
                scalar: T::SCALAR,
                head: 0,
            },
        }
    }

    /// Bytes of a buffer that holds `values`, one a window.
    pub fn bytes(values: &[T]) -> Vec<u8> {
        let mut bytes = vec![0; values.len() * STRIDE];
        for (window, value) in bytes.chunks_exact_mut(STRIDE).zip(values) {
            window[..size_of::<T>()].copy_from_slice(bytemuck::bytes_of(value));
        }
        bytes
    }
}

/// The first values of a buffer.
#[derive(Clone, Debug)]
pub struct First<T> {
    pub(super) buffer: Buf<T>,
    pub(super) count: usize,
}

/// What is read from the device at once: [`Buf::first`] of one buffer, or a tuple of those of several.
pub trait Wanted {
    /// Vectors of values, one a buffer.
    type Values;

    /// Name, first byte and bytes of each.
    fn spans(&self) -> Vec<(&str, u64, usize)>;

    /// The values from the bytes of each, in the same order.
    fn values(bytes: &mut dyn Iterator<Item = &[u8]>) -> Self::Values;
}

impl<T: bytemuck::Pod> Wanted for First<T> {
    type Values = Vec<T>;

    fn spans(&self) -> Vec<(&str, u64, usize)> {
        let bytes = self.count * size_of::<T>();
        vec![(self.buffer.name(), self.buffer.offset, bytes)]
    }

    fn values(bytes: &mut dyn Iterator<Item = &[u8]>) -> Vec<T> {
        bytemuck::pod_collect_to_vec(bytes.next().unwrap_or_default())
    }
}

macro_rules! wanted_tuple {
    ($($name:ident: $place:tt),+) => {
        impl<$($name: Wanted),+> Wanted for ($($name,)+) {
            type Values = ($($name::Values,)+);

            fn spans(&self) -> Vec<(&str, u64, usize)> {
                [$(self.$place.spans()),+].concat()
            }

            fn values(bytes: &mut dyn Iterator<Item = &[u8]>) -> Self::Values {
                ($($name::values(bytes),)+)
            }
        }
    };
}

wanted_tuple!(A: 0, B: 1);
wanted_tuple!(A: 0, B: 1, C: 2);
wanted_tuple!(A: 0, B: 1, C: 2, D: 3);
wanted_tuple!(A: 0, B: 1, C: 2, D: 3, E: 4);
wanted_tuple!(A: 0, B: 1, C: 2, D: 3, E: 4, F: 5);
