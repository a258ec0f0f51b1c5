//! A pool of GPU devices that tests share.

use std::{
    env,
    ops::{Deref, DerefMut},
    sync::{Mutex, PoisonError},
    thread,
};

use swell::gpu::adapter::{Context, InjectedFault};

/// Idle devices. A device keeps its compiled passes, so a test reuses those that an earlier test
/// compiled. No two tests use a device at once, so they never wait for each other's work.
static FREE: Mutex<Vec<Context>> = Mutex::new(Vec::new());

/// A device taken from the pool. Dropping it returns the device.
#[derive(Debug)]
pub struct PooledDevice {
    context: Context,
    /// The same device without the changes made to `context`; this is what returns to the pool.
    clean: Context,
}

impl Deref for PooledDevice {
    type Target = Context;

    fn deref(&self) -> &Context {
        &self.context
    }
}

impl DerefMut for PooledDevice {
    fn deref_mut(&mut self) -> &mut Context {
        &mut self.context
    }
}

impl Drop for PooledDevice {
    fn drop(&mut self) {
        // A device that reported an error, or whose test failed, is dropped.
        if !thread::panicking() && self.clean.check().is_ok() {
            let mut free = FREE.lock().unwrap_or_else(PoisonError::into_inner);
            free.push(self.clean.clone());
        }
    }
}

/// A device on the adapter that `SWELL_ADAPTER` names or on the best one, opened as every command
/// opens it.
pub fn context() -> PooledDevice {
    let free = FREE.lock().unwrap_or_else(PoisonError::into_inner).pop();
    let clean = free.unwrap_or_else(|| {
        let adapter = env::var("SWELL_ADAPTER").ok();
        Context::open(adapter.as_deref())
            .expect("tests need a Vulkan adapter; tools/test installs one")
    });
    PooledDevice {
        context: clean.clone(),
        clean,
    }
}

/// A device whose pass `pass` has `from` replaced by `to`: for negative controls.
pub fn spoiled(pass: &'static str, from: &'static str, to: &'static str) -> PooledDevice {
    let mut context = context();
    context.spoil = Some(InjectedFault { pass, from, to });
    context
}
