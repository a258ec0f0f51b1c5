//! Textures and samplers by name.

use wgpu::{Sampler, Texture, TextureFormat, TextureUsages};

use super::{adapter::Context, error::GpuError, program::Program};

/// Description of a texture to allocate: two-dimensional, one mip level, one sample.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextureSpec {
    /// Unique name; shader variables of this name bind it.
    pub name: String,
    /// Width and height, texels.
    pub size: [u32; 2],
    /// Texel format.
    pub format: TextureFormat,
}

impl TextureSpec {
    /// Bytes of one texel.
    fn texel_bytes(&self) -> u32 {
        // Every format that passes draw or sample can be copied, and so has a size.
        self.format.block_copy_size(None).unwrap_or(0)
    }

    /// Returns the total size in bytes.
    pub fn bytes(&self) -> u64 {
        u64::from(self.texel_bytes()) * u64::from(self.size[0]) * u64::from(self.size[1])
    }
}

/// Description of a sampler, with linear filtering and clamping to the edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SamplerSpec {
    /// Unique name; shader variables of this name bind it.
    pub name: &'static str,
    /// Whether it repeats along x instead of clamping.
    pub repeats_x: bool,
    /// Comparison function of a `sampler_comparison`; `None` for an ordinary sampler.
    pub compare: Option<wgpu::CompareFunction>,
}

impl Program {
    /// Adds textures, filled with zeros, and samplers.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn with_textures(
        mut self,
        textures: &[TextureSpec],
        samplers: &[SamplerSpec],
    ) -> Result<Self, GpuError> {
        for spec in textures {
            let texture = allocate(&self.context, spec);
            self.textures.insert(spec.name.clone(), texture);
        }
        for spec in samplers {
            self.samplers
                .insert(spec.name, sampler(&self.context, spec));
        }
        self.context.check()?;
        Ok(self)
    }

    /// Returns the texture with this name.
    ///
    /// # Panics
    /// If the program has none: a recording that its plan does not cover is a bug.
    pub fn texture(&self, name: &str) -> &Texture {
        self.textures
            .get(name)
            .unwrap_or_else(|| panic!("texture `{name}` is not in the program"))
    }

    /// Returns the sampler with this name.
    ///
    /// # Panics
    /// As [`Self::texture`].
    pub fn sampler(&self, name: &str) -> &Sampler {
        self.samplers
            .get(name)
            .unwrap_or_else(|| panic!("sampler `{name}` is not in the program"))
    }

    /// Writes all texels of a texture, row by row, ordered before later submissions.
    pub fn upload_texture(&self, name: &str, texels: &[u8]) {
        let texture = self.texture(name);
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(texels.len() as u32 / texture.height()),
            rows_per_image: None,
        };
        let copy = texture.as_image_copy();
        (self.context.queue).write_texture(copy, texels, layout, texture.size());
    }
}

fn allocate(context: &Context, spec: &TextureSpec) -> Texture {
    let [width, height] = spec.size;
    context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(&spec.name),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: spec.format,
        usage: TextureUsages::RENDER_ATTACHMENT
            | TextureUsages::TEXTURE_BINDING
            | TextureUsages::COPY_SRC
            | TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

fn sampler(context: &Context, spec: &SamplerSpec) -> Sampler {
    context.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some(spec.name),
        address_mode_u: match spec.repeats_x {
            true => wgpu::AddressMode::Repeat,
            false => wgpu::AddressMode::ClampToEdge,
        },
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        compare: spec.compare,
        ..Default::default()
    })
}
