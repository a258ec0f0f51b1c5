//! Devices that tests use one after the other.

use std::{
    ops::{Deref, DerefMut},
    sync::{Mutex, PoisonError},
    thread,
};

use swell::gpu::adapter::{Context, Spoil};

/// Devices that no test uses at the moment. A device keeps the passes that it has compiled, so that a test begins with those
/// that another one needed as well; and each test has a device of its own, so that tests do not wait for each other.
static FREE: Mutex<Vec<Context>> = Mutex::new(Vec::new());

/// A device on loan; goes back when dropped.
#[derive(Debug)]
pub struct Lent {
    context: Context,
    /// The same device, as it goes back whatever was set in `context`.
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
        // A device that reported an error, or whose test failed, is not used again.
        if !thread::panicking() && self.clean.check().is_ok() {
            let mut free = FREE.lock().unwrap_or_else(PoisonError::into_inner);
            free.push(self.clean.clone());
        }
    }
}

/// The best adapter's device, opened as every command opens it.
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

/// A device whose pass `pass` has `to` for `from`: for negative controls.
pub fn spoiled(pass: &'static str, from: &'static str, to: &'static str) -> Lent {
    let mut context = context();
    context.spoil = Some(Spoil { pass, from, to });
    context
}
