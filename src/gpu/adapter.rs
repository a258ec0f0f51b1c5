//! Finds adapters and opens devices on them.

use std::sync::{Arc, Mutex, OnceLock};

use wgpu::{Adapter, AdapterInfo, Backends, Device, DeviceType, Features, Instance, Limits, Queue};

use super::{
    compiled::Compiled,
    hidden,
    imprecision::Imprecision,
    rounding::Rounding,
    shader::Shaders,
    traffic::{Counters, Traffic},
    uniforms,
};

pub use super::error::GpuError;

/// An open device.
#[derive(Clone, Debug)]
pub struct Context {
    /// The logical device.
    pub device: Device,
    /// Its queue.
    pub queue: Queue,
    /// Name, driver and backend of the adapter.
    pub info: AdapterInfo,
    /// Limits of the device: those of the adapter, unless they were lowered.
    pub limits: Limits,
    /// Whether the adapter computes on the processor.
    pub is_software: bool,
    /// If the adapter is software: what makes Vulkan show the GPUs that the machine seems to have.
    /// `None` if it seems to have none, or if Vulkan shows one.
    pub advice: Option<String>,
    /// Whether passes can be timed with device timestamps.
    pub has_timestamps: bool,
    /// Whether passes may compute in f64; only if that was requested.
    pub has_f64: bool,
    /// Shaders that passes are composed from.
    pub shaders: Shaders,
    /// Whether timers also count operations. That runs an instrumented version of a pass at
    /// the first run of a dispatch and at one in seven after it, each of which then takes
    /// twice as long.
    pub counts_operations: bool,
    /// A fault injected into one pass, to show that a comparison detects it; `None` in
    /// every command.
    pub spoil: Option<InjectedFault>,
    /// How much less precisely passes compute than the device does.
    pub(super) imprecision: Option<Imprecision>,
    /// Uniform buffers that a shader may bind, if the driver cannot take what its limits allow.
    pub(super) most_uniforms: Option<usize>,
    /// What [`Context::rounding`] measured.
    rounding: Arc<OnceLock<Rounding>>,
    /// Passes compiled on this device.
    pub(super) compiled: Arc<Compiled>,
    pub(super) counters: Arc<Counters>,
    fault: Arc<Mutex<Option<String>>>,
}

/// A text replacement in one pass, with imports included, before it is compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InjectedFault {
    /// Pass name. If a pass `NAME_dry` does part of the work of pass `NAME`, it gets the
    /// same fault.
    pub pass: &'static str,
    /// Text to replace; it must occur in the pass.
    pub from: &'static str,
    /// Replacement.
    pub to: &'static str,
}

fn instance() -> Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    descriptor.backends &= Backends::VULKAN | Backends::METAL | Backends::DX12;
    // The validation would insert a pass of its own before each indirect dispatch, of which a
    // pressure solve has hundreds; their sizes are our own and within the limits.
    descriptor
        .flags
        .remove(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
    Instance::new(descriptor)
}

/// Lists all adapters of this machine in the driver's order, in which a request numbers them.
pub fn enumerate() -> Vec<Adapter> {
    pollster::block_on(instance().enumerate_adapters(Backends::all()))
}

/// Features that a device is opened for, beyond those of every pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// Whether passes compute in f64.
    pub f64: bool,
}

/// Optional features that are offered, plus required ones; `None` if a required one is missing.
fn features(offered: Features, needs: Needs) -> Option<Features> {
    let used = offered & (Features::TIMESTAMP_QUERY | Features::FLOAT32_FILTERABLE);
    match needs.f64 {
        true => (offered.contains(Features::SHADER_F64)).then_some(used | Features::SHADER_F64),
        false => Some(used),
    }
}

/// Returns whether shaders can compute in f64 on an adapter.
pub fn has_f64(adapter: &Adapter) -> bool {
    adapter.features().contains(Features::SHADER_F64)
}

/// Returns whether passes can be timed with device timestamps on an adapter.
pub fn has_timestamps(adapter: &Adapter) -> bool {
    adapter.features().contains(Features::TIMESTAMP_QUERY)
}

/// Index of the name that a request selects. Digits alone are an index and never part of a name,
/// because names contain versions, as in "llvmpipe (LLVM 15.0.6, 256 bits)".
fn position(names: &[String], request: &str) -> Option<usize> {
    let wanted = request.trim().to_lowercase();
    if wanted.is_empty() {
        return None;
    }
    if wanted.bytes().all(|byte| byte.is_ascii_digit()) {
        let index = wanted.parse().ok()?;
        return (index < names.len()).then_some(index);
    }
    let mut lower = names.iter().map(|name| name.to_lowercase());
    lower.position(|name| name.contains(&wanted))
}

fn names(adapters: &[Adapter]) -> Vec<String> {
    let names = adapters.iter().map(|adapter| adapter.get_info().name);
    names.collect()
}

fn find(names: Vec<String>, request: &str) -> Result<usize, GpuError> {
    position(&names, request).ok_or_else(|| GpuError::NoSuchAdapter {
        request: request.to_owned(),
        available: names,
    })
}

/// Checks that this machine has the adapter that `request` names, without opening it.
///
/// # Errors
/// [`GpuError::NoAdapter`], [`GpuError::NoSuchAdapter`].
pub fn check_request(request: &str) -> Result<(), GpuError> {
    let adapters = enumerate();
    if adapters.is_empty() {
        return Err(no_adapter());
    }
    find(names(&adapters), request).map(|_| ())
}

/// The error of a machine without adapters.
pub fn no_adapter() -> GpuError {
    GpuError::NoAdapter {
        advice: hidden::advice(),
    }
}

fn is_software(info: &AdapterInfo) -> bool {
    info.device_type == DeviceType::Cpu
}

fn choose(mut adapters: Vec<Adapter>, request: Option<&str>) -> Result<Adapter, GpuError> {
    if adapters.is_empty() {
        return Err(no_adapter());
    }
    let Some(request) = request else {
        // Hardware before software adapters; within a kind, the driver's order.
        adapters.sort_by_key(|adapter| match adapter.get_info().device_type {
            DeviceType::DiscreteGpu => 0,
            DeviceType::IntegratedGpu => 1,
            DeviceType::VirtualGpu => 2,
            DeviceType::Cpu | DeviceType::Other => 3,
        });
        return Ok(adapters.swap_remove(0));
    };
    let index = find(names(&adapters), request)?;
    Ok(adapters.swap_remove(index))
}

impl Context {
    /// Opens the adapter that `request` names (digits alone are its number, anything else a part of
    /// its name), or the best one.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`], [`GpuError::NoSuchAdapter`], [`GpuError::Open`].
    pub fn open(request: Option<&str>) -> Result<Self, GpuError> {
        Self::open_for(request, Needs::default())
    }

    /// Same as [`Self::open`] for passes with these needs; enables no feature that they do not
    /// ask for.
    ///
    /// # Errors
    /// Those of [`Self::open`], and [`GpuError::NoF64`].
    pub fn open_for(request: Option<&str>, needs: Needs) -> Result<Self, GpuError> {
        Self::open_lowered(request, needs, |_| {})
    }

    /// Same as [`Self::open`] on a device whose passes compute as imprecisely as a profile says,
    /// which its name tells. Passes may also compute in f64, which stays precise.
    ///
    /// # Errors
    /// Those of [`Self::open`]; [`GpuError::NoImprecision`] on an adapter without f64.
    pub fn open_imprecise(request: Option<&str>, profile: Imprecision) -> Result<Self, GpuError> {
        match Self::open_for(request, Needs { f64: true }) {
            Ok(mut context) => {
                context.imprecision = Some(profile);
                context.info.name += &format!(" with the errors of {profile}");
                Ok(context)
            }
            Err(GpuError::NoF64 { adapter }) => Err(GpuError::NoImprecision { adapter }),
            Err(error) => Err(error),
        }
    }

    /// Same as [`Self::open_for`] on a device with lower limits than the adapter has, as set by
    /// `lower`. Exceeding them is then an error of the device, as on an adapter with these limits.
    ///
    /// # Errors
    /// Those of [`Self::open_for`]; [`GpuError::Open`] for a limit above that of the adapter.
    pub fn open_lowered(
        request: Option<&str>,
        needs: Needs,
        lower: impl FnOnce(&mut Limits),
    ) -> Result<Self, GpuError> {
        let adapters = enumerate();
        let shows_gpu = adapters.iter().any(|it| !is_software(&it.get_info()));
        let adapter = choose(adapters, request)?;
        let info = adapter.get_info();
        let mut limits = adapter.limits();
        let storage = limits.max_storage_buffers_per_shader_stage;
        lower(&mut limits);
        let features = features(adapter.features(), needs).ok_or_else(|| GpuError::NoF64 {
            adapter: info.name.clone(),
        })?;
        let most_uniforms = uniforms::most(&info);
        let mut required_limits = limits.clone();
        if most_uniforms.is_some() {
            required_limits.max_storage_buffers_per_shader_stage = storage;
        }
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("swell"),
            required_features: features,
            required_limits,
            ..Default::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| {
                GpuError::Open {
                    adapter: info.name.clone(),
                    message: error.to_string(),
                }
            })?;
        let fault = Arc::new(Mutex::new(None));
        let lost = Arc::clone(&fault);
        device.set_device_lost_callback(move |reason, message| {
            record(&lost, format!("{reason:?}: {message}"))
        });
        let uncaptured = Arc::clone(&fault);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            record(&uncaptured, error.to_string())
        }));
        let has_timestamps = features.contains(Features::TIMESTAMP_QUERY);
        Ok(Self {
            device,
            queue,
            is_software: is_software(&info),
            advice: (!shows_gpu).then(hidden::advice).flatten(),
            info,
            limits,
            has_timestamps,
            has_f64: features.contains(Features::SHADER_F64),
            shaders: Shaders::default(),
            counts_operations: false,
            spoil: None,
            imprecision: None,
            most_uniforms,
            rounding: Arc::default(),
            compiled: Arc::default(),
            counters: Arc::default(),
            fault,
        })
    }

    /// Returns what the host has asked of the device since it was opened.
    pub fn traffic(&self) -> Traffic {
        self.counters.now()
    }

    /// Measures the device's rounding, once unless its shaders were changed.
    ///
    /// # Errors
    /// Those of [`Rounding::measure`].
    pub fn rounding(&self) -> Result<Rounding, GpuError> {
        if self.spoil.is_some() || self.shaders.edited().is_some() {
            return Rounding::measure(self);
        }
        if let Some(rounding) = self.rounding.get() {
            return Ok(*rounding);
        }
        let rounding = Rounding::measure(self)?;
        Ok(*self.rounding.get_or_init(|| rounding))
    }

    /// Warning for a software adapter on a machine that seems to have a GPU which Vulkan does not
    /// show.
    pub fn software_warning(&self) -> Option<String> {
        let advice = self.advice.as_ref()?;
        Some(format!(
            "{} is a software adapter, and Vulkan does not show the GPU that this machine seems \
             to have; {advice}",
            self.info.name
        ))
    }

    /// Fails if the adapter is software.
    ///
    /// # Errors
    /// [`GpuError::Software`].
    pub fn require_hardware(&self) -> Result<(), GpuError> {
        match self.is_software {
            true => Err(GpuError::Software {
                adapter: self.info.name.clone(),
                advice: self.advice.clone(),
            }),
            false => Ok(()),
        }
    }

    /// Fails if the device was lost or has reported an error since it was opened.
    ///
    /// # Errors
    /// [`GpuError::Lost`] with the first message.
    pub fn check(&self) -> Result<(), GpuError> {
        match self.fault.lock() {
            Ok(fault) => fault
                .clone()
                .map_or(Ok(()), |message| Err(GpuError::Lost(message))),
            Err(_) => Err(GpuError::Lost("the error handler panicked".into())),
        }
    }

    /// Waits until all submitted work is done.
    ///
    /// A device that is known to be lost is not polled again: wgpu would then free all memory, that
    /// which a [`Mapped`](super::readback::Mapped) is being read from too.
    ///
    /// # Errors
    /// [`GpuError::Lost`] if the device was lost or has reported an error.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.check()?;
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|error| GpuError::Lost(error.to_string()))?;
        self.check()
    }
}

fn record(fault: &Mutex<Option<String>>, message: String) {
    if let Ok(mut fault) = fault.lock() {
        fault.get_or_insert(message);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_a_number_and_words_a_part_of_a_name() {
        let names =
            ["llvmpipe (LLVM 15.0.6, 256 bits)", "NVIDIA L4", "AMD 780M"].map(str::to_owned);
        for (request, expected) in [
            ("0", Some(0)),
            ("1", Some(1)),
            ("02", Some(2)),
            // Digits within the first name's version, and within the second's and third's model.
            ("5", None),
            ("15", None),
            ("256", None),
            ("4", None),
            ("780", None),
            ("99999999999999999999999", None),
            ("15.0", Some(0)),
            ("llvmpipe", Some(0)),
            ("nvidia", Some(1)),
            ("780m", Some(2)),
            ("-1", None),
            ("+1", None),
            ("", None),
            (" ", None),
        ] {
            assert_eq!(position(&names, request), expected, "{request:?}");
        }
        let two = names[..2].to_vec();
        let said = find(two, "5").expect_err("there is no 5").to_string();
        let lines: Vec<&str> = said.lines().collect();
        assert!(lines[0].contains("no adapter matches `5`"), "{said}");
        assert_eq!(
            lines[1..],
            ["  0: llvmpipe (LLVM 15.0.6, 256 bits)", "  1: NVIDIA L4"]
        );
    }

    #[test]
    fn f64_is_enabled_where_asked_for_and_refused_where_missing() {
        let (plain, double) = (Needs::default(), Needs { f64: true });
        let offered = Features::TIMESTAMP_QUERY | Features::SHADER_F64;
        assert_eq!(features(offered, plain), Some(Features::TIMESTAMP_QUERY));
        assert_eq!(features(offered, double), Some(offered));
        assert_eq!(features(Features::TIMESTAMP_QUERY, double), None);
        assert_eq!(features(Features::empty(), plain), Some(Features::empty()));
    }
}
