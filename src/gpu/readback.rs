//! Values read back from a device, in memory that it writes and the host maps.
//!
//! That memory is kept for the next time: a driver takes milliseconds to allocate and pin what a
//! frame of a million particles needs.

use std::{
    marker::PhantomData,
    sync::{Arc, Mutex},
};

use wgpu::{Buffer, BufferUsages, BufferView, Device};

pub use super::buffer::First;
use super::{adapter::Context, error::GpuError};

/// Idle buffers that are kept; the one that has waited longest goes first.
const KEPT: usize = 16;
/// Sizes are multiples of this, bytes.
const GRAIN: usize = 1 << 12;

/// Data read back together: [`Buf::first`](super::buffer::Buf::first) of one buffer, or a tuple of
/// those of several.
pub trait Readback {
    /// One slice of values per buffer.
    type Views<'a>;
    /// One vector of values per buffer.
    type Values;

    /// Returns name, byte offset and length in bytes of each buffer's part.
    fn spans(&self) -> Vec<(&str, u64, usize)>;

    /// Interprets the bytes of each part as values, in the same order.
    fn views<'a>(bytes: &mut dyn Iterator<Item = &'a [u8]>) -> Self::Views<'a>;

    /// Copies the values.
    fn values(views: Self::Views<'_>) -> Self::Values;
}

impl<T: bytemuck::Pod> Readback for First<T> {
    type Views<'a> = &'a [T];
    type Values = Vec<T>;

    fn spans(&self) -> Vec<(&str, u64, usize)> {
        let bytes = self.count * size_of::<T>();
        vec![(self.buffer.name(), self.buffer.place(0), bytes)]
    }

    fn views<'a>(bytes: &mut dyn Iterator<Item = &'a [u8]>) -> &'a [T] {
        // Mapped memory is aligned to at least 64 bytes, an empty slice to 1.
        let bytes = bytes.next().filter(|bytes| !bytes.is_empty());
        bytes.map_or(&[], bytemuck::cast_slice)
    }

    fn values(views: &[T]) -> Vec<T> {
        views.to_vec()
    }
}

macro_rules! readback_tuple {
    ($($name:ident: $place:tt),+) => {
        impl<$($name: Readback),+> Readback for ($($name,)+) {
            type Views<'a> = ($($name::Views<'a>,)+);
            type Values = ($($name::Values,)+);

            fn spans(&self) -> Vec<(&str, u64, usize)> {
                [$(self.$place.spans()),+].concat()
            }

            fn views<'a>(bytes: &mut dyn Iterator<Item = &'a [u8]>) -> Self::Views<'a> {
                ($($name::views(bytes),)+)
            }

            fn values(views: Self::Views<'_>) -> Self::Values {
                ($($name::values(views.$place),)+)
            }
        }
    };
}

readback_tuple!(A: 0, B: 1);
readback_tuple!(A: 0, B: 1, C: 2);
readback_tuple!(A: 0, B: 1, C: 2, D: 3);
readback_tuple!(A: 0, B: 1, C: 2, D: 3, E: 4);
readback_tuple!(A: 0, B: 1, C: 2, D: 3, E: 4, F: 5);

/// Idle buffers for the host to read, shared by all copies that were made of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Staging(Arc<Mutex<Vec<Buffer>>>);

impl Staging {
    /// A buffer with space for `bytes` bytes: an idle one that is at most twice as large, or else a
    /// new one.
    pub(super) fn copy(&self, device: &Device, bytes: usize) -> Copied {
        let size = bytes.next_multiple_of(GRAIN) as u64;
        let idle = self.0.lock().ok().and_then(|mut idle| {
            let fits = |buffer: &Buffer| (size..=2 * size).contains(&buffer.size());
            let place = idle.iter().position(fits)?;
            Some(idle.remove(place))
        });
        let new = || {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("readback"),
                size,
                usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
                mapped_at_creation: false,
            })
        };
        Copied {
            buffer: idle.unwrap_or_else(new),
            bytes,
            view: None,
            staging: self.clone(),
        }
    }

    fn take_back(&self, buffer: Buffer) {
        if let Ok(mut idle) = self.0.lock() {
            idle.push(buffer);
            if idle.len() > KEPT {
                idle.remove(0);
            }
        }
    }
}

/// A buffer that holds a copy; idle again when dropped.
pub(super) struct Copied {
    buffer: Buffer,
    bytes: usize,
    view: Option<BufferView>,
    staging: Staging,
}

impl Copied {
    pub(super) fn buffer(&self) -> &Buffer {
        &self.buffer
    }

    pub(super) fn len(&self) -> usize {
        self.bytes
    }

    /// Asks for the mapping, which is there after the next wait for the device.
    pub(super) fn request(&self) {
        // A failed mapping is reported when its range is requested.
        self.buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    }

    fn map(&mut self) -> Result<(), GpuError> {
        let view = self.buffer.get_mapped_range(..);
        self.view = Some(view.map_err(|error| GpuError::Lost(error.to_string()))?);
        Ok(())
    }

    fn bytes(&self) -> &[u8] {
        self.view.as_ref().map_or(&[], |view| &view[..self.bytes])
    }
}

impl Drop for Copied {
    fn drop(&mut self) {
        // What was not mapped is an error's, and not used again.
        if self.view.take().is_some() {
            self.buffer.unmap();
            self.staging.take_back(self.buffer.clone());
        }
    }
}

/// Values of buffers in memory that the device wrote, which may be read on any thread.
pub struct Mapped<W> {
    context: Context,
    copies: Vec<Option<Copied>>,
    wanted: PhantomData<fn() -> W>,
}

impl<W: Readback> Mapped<W> {
    /// Maps copies whose mappings the device has granted.
    pub(super) fn new(context: Context, mut copies: Vec<Option<Copied>>) -> Result<Self, GpuError> {
        copies.iter_mut().flatten().try_for_each(Copied::map)?;
        Ok(Self {
            context,
            copies,
            wanted: PhantomData,
        })
    }

    /// Returns the values.
    ///
    /// # Errors
    /// [`GpuError::Lost`] if the device was lost since: its memory may be gone.
    pub fn views(&self) -> Result<W::Views<'_>, GpuError> {
        self.context.check()?;
        let copies = self.copies.iter();
        let mut bytes = copies.map(|copy| copy.as_ref().map_or(&[][..], Copied::bytes));
        Ok(W::views(&mut bytes))
    }
}
