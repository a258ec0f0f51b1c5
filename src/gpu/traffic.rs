//! What the host and a device exchange.

use std::{
    ops::Sub,
    sync::atomic::{AtomicU64, Ordering},
};

/// Counts of what the host asked of a device. A timer submits and waits for each command in
/// addition, which is not counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Command buffers submitted.
    pub submissions: u64,
    /// Times at which the host waited for the device.
    pub waits: u64,
    /// Bytes read back.
    pub bytes_read: u64,
}

/// What happened since an earlier count.
impl Sub for Traffic {
    type Output = Self;

    fn sub(self, earlier: Self) -> Self {
        Self {
            submissions: self.submissions - earlier.submissions,
            waits: self.waits - earlier.waits,
            bytes_read: self.bytes_read - earlier.bytes_read,
        }
    }
}

/// Running counts, shared by the clones of a context.
#[derive(Debug, Default)]
pub(super) struct Counters {
    submissions: AtomicU64,
    waits: AtomicU64,
    bytes_read: AtomicU64,
}

impl Counters {
    pub(super) fn submitted(&self) {
        self.submissions.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn waited(&self, bytes_read: u64) {
        self.waits.fetch_add(1, Ordering::Relaxed);
        self.bytes_read.fetch_add(bytes_read, Ordering::Relaxed);
    }

    pub(super) fn now(&self) -> Traffic {
        Traffic {
            submissions: self.submissions.load(Ordering::Relaxed),
            waits: self.waits.load(Ordering::Relaxed),
            bytes_read: self.bytes_read.load(Ordering::Relaxed),
        }
    }
}
