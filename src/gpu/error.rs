//! Errors of the device, its adapters and its shaders.

/// Error between the program and the device.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// There is no adapter.
    #[error(
        "no GPU adapter found; {}install a Vulkan driver (software: Debian and Ubuntu \
         `mesa-vulkan-drivers`, Fedora `mesa-vulkan-drivers`, Arch `vulkan-swrast`)",
        before(advice.as_deref())
    )]
    NoAdapter {
        /// What makes Vulkan show the GPUs that the machine seems to have; `None` if it seems to
        /// have none.
        advice: Option<String>,
    },
    /// The adapter is software, and a GPU is required.
    #[error("adapter {adapter} is software, and a GPU is required{}", after(advice.as_deref()))]
    Software {
        /// Adapter name.
        adapter: String,
        /// What makes Vulkan show the GPUs that the machine seems to have; `None` if it seems to
        /// have none, or if Vulkan shows one.
        advice: Option<String>,
    },
    /// No adapter has the number or name that was asked for.
    #[error(
        "no adapter matches `{request}`; give the number of one of these, or a part of its name:{}",
        list(available)
    )]
    NoSuchAdapter {
        /// The request.
        request: String,
        /// Names of the available adapters, in the order of their numbers.
        available: Vec<String>,
    },
    /// The adapter refused to open a device.
    #[error("adapter {adapter} refused a device: {message}")]
    Open {
        /// Adapter name.
        adapter: String,
        /// Message of the driver.
        message: String,
    },
    /// The device was lost or reported an error without a handler.
    #[error("device lost: {0}")]
    Lost(String),
    /// A shipped shader does not compose or compile.
    #[error("shader {name}: {message}")]
    Shader {
        /// Shader path.
        name: String,
        /// Position and message.
        message: String,
    },
    /// A shader of the folder of edited ones does not compose or compile.
    #[error("edited shader {name}: {message}")]
    EditedShader {
        /// Shader path.
        name: String,
        /// Position and message.
        message: String,
    },
    /// 64-bit floats were requested, but the adapter has none.
    #[error(
        "{adapter} has no 64-bit floats in shaders (SHADER_F64), which precision = \"f64\" asks \
         for; \"f32_refined\" needs none"
    )]
    NoF64 {
        /// Adapter name.
        adapter: String,
    },
    /// A profile of imprecision was requested, and the adapter has no 64-bit floats.
    #[error(
        "{adapter} has no 64-bit floats in shaders (SHADER_F64), with which a profile of \
         imprecision computes what it then makes imprecise"
    )]
    NoImprecision {
        /// Adapter name.
        adapter: String,
    },
    /// The adapter loses what two words of a number have to keep.
    #[error(
        "{adapter} loses {lost}, without which precision = \"f32_refined\" is no better than \
         \"f32\": its driver simplifies what shaders compute; use \"f64\" or \"f32\", PBF \
         without grid_projection, another driver, or the CPU"
    )]
    NoErrorTerms {
        /// Adapter name.
        adapter: String,
        /// What is lost.
        lost: &'static str,
    },
    /// A pass binds more storage buffers than the adapter supports.
    #[error(
        "pass {pass} binds {needed} storage buffers, and {adapter} allows {allowed} \
         (max_storage_buffers_per_shader_stage); use another adapter or a newer driver (of \
         llvmpipe Mesa 22.3), or bake on the CPU"
    )]
    TooManyBuffers {
        /// Pass name.
        pass: String,
        /// Number of storage buffers of the pass.
        needed: u32,
        /// Number that the adapter supports.
        allowed: u32,
        /// Adapter name.
        adapter: String,
    },
    /// A buffer is larger than the adapter supports.
    #[error(
        "buffer `{buffer}` needs {needed} bytes, and {adapter} allows {allowed} ({limit}); make \
         the scene or the picture smaller or coarser"
    )]
    TooLarge {
        /// Buffer name in the plan.
        buffer: String,
        /// Bytes needed.
        needed: u64,
        /// Bytes allowed.
        allowed: u64,
        /// Name of the wgpu limit.
        limit: &'static str,
        /// Adapter name.
        adapter: String,
    },
}

/// Advice about GPUs ahead of that about software.
fn before(advice: Option<&str>) -> String {
    advice.map_or(String::new(), |advice| format!("{advice}; or "))
}

/// Advice about GPUs at the end of a message.
fn after(advice: Option<&str>) -> String {
    advice.map_or(String::new(), |advice| format!("; {advice}"))
}

/// Formats names with their numbers, one per line.
fn list(names: &[String]) -> String {
    let lines = names.iter().enumerate();
    lines
        .map(|(index, name)| format!("\n  {index}: {name}"))
        .collect()
}
