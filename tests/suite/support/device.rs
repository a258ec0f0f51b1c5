//! A pool of GPU devices that tests share.

use std::{
    ops::{Deref, DerefMut},
    sync::{Mutex, PoisonError},
    thread,
};

use swell::gpu::adapter::{Context, Spoil};

/// Idle devices. A device keeps its compiled passes, so a test reuses those that an earlier test
/// compiled. No two tests use a device at once, so they never wait for each other's work.
static FREE: Mutex<Vec<Context>> = Mutex::new(Vec::new());

/// A device taken from the pool. Dropping it returns the device.
#[derive(Debug)]
pub struct Lent {
    context: Context,
    /// The same device without the changes made to `context`; this is what returns to the pool.
    clean: Context,
}

impl Deref for Lent {
    type Target = Context;

    fn deref(&self) -> &Context {
        &self.context
    }
}

impl DerefMut for Lent {
    fn deref_mut(&mut self) -> &mut Context {
        &mut self.context
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        // A device that reported an error, or whose test failed, is dropped.
        if !thread::panicking() && self.clean.check().is_ok() {
            let mut free = FREE.lock().unwrap_or_else(PoisonError::into_inner);
            free.push(self.clean.clone());
        }
    }
}

/// A device on the best adapter, opened as every command opens it.
pub fn context() -> Lent {
    let free = FREE.lock().unwrap_or_else(PoisonError::into_inner).pop();
    let clean = free.unwrap_or_else(|| {
        Context::open(None).expect("tests need a Vulkan adapter; tools/test installs one")
    });
    Lent {
        context: clean.clone(),
        clean,
    }
}

/// A device whose pass `pass` has `from` replaced by `to`: for negative controls.
pub fn spoiled(pass: &'static str, from: &'static str, to: &'static str) -> Lent {
    let mut context = context();
    context.spoil = Some(Spoil { pass, from, to });
    context
}
