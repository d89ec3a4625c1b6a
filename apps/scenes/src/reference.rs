//! The same scene drawn from an ordinary mip-mapped texture: what a virtual texture is compared with.
//!
//! The texture holds the levels that the source has of one layer, padded per axis to the next power of two,
//! so that texel `i` of a level covers exactly the texels `2i` and `2i + 1` of the level before it, as in the
//! virtual texture. The padding holds what the address mode gives there.
//!
//! Compressed layers are decoded, by the CPU, so that what a driver makes of blocks is compared, too: BC6H
//! and BC7 are exact, the others may differ by 2/255 of a texel.

use vastex::survey::TexelPositions;
use vastex::{AddressMode, Description, Geometry, Layer, LayerFormat, Textures, TileSource};

use crate::levels::{LevelError, read_level};
use vastex_viewer::stage::StageScene;
use vastex_viewer::{ScenePipelines, SceneRenderer, Target};

/// An ordinary texture may take so much of the device's memory: 1 GiB.
const MAX_BYTES: u64 = 1 << 30;

/// Why there is no ordinary texture to compare with.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// The texture is too large to be an ordinary one.
    #[error("an ordinary texture of {}x{} texels and {bytes} bytes is beyond this adapter", size[0], size[1])]
    TooLarge {
        /// Padded size in texels.
        size: [u32; 2],
        /// Bytes of all its levels.
        bytes: u64,
    },
    /// The adapter has no ordinary texture of this format that it filters.
    #[error("this adapter does not filter {} textures", .0.name())]
    Format(LayerFormat),
    /// Some places have no tiles of the finer levels, which an ordinary texture cannot do without.
    #[error("an ordinary texture needs every tile, and this one lacks some")]
    Sparse,
    /// A tile could not be read.
    #[error(transparent)]
    Level(#[from] LevelError),
    /// What is shown was removed.
    #[error(transparent)]
    Gone(#[from] vastex::Error),
}

/// Whose taps an ordinary texture is sampled by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taps {
    /// Those of the virtual texture, one by one, at the edges too.
    Same,
    /// Those of the virtual texture, at the edges as the sampler has it; bicubic by one. What a price is
    /// measured by.
    Ordinary,
    /// Those of the adapter's own trilinear filter, or of its anisotropic one where the virtual texture's is
    /// anisotropic.
    Adapter,
}

/// A scene drawn from an ordinary texture, to be compared with.
pub struct Reference {
    pipelines: ScenePipelines,
    group: wgpu::BindGroup,
}

impl Reference {
    /// Reads all levels of the one opaque layer that the renderer shows, on a surface without heights, into
    /// an ordinary texture.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        textures: &Textures,
        renderer: &SceneRenderer,
        source: &dyn TileSource,
        taps: Taps,
    ) -> Result<Reference, ReferenceError> {
        if source.present().is_some() {
            return Err(ReferenceError::Sparse);
        }
        let index = renderer.layer().index();
        let plain = Plain::new(source.description(), index);
        let texture = plain.texture(device)?;
        for level in 0..=plain.shape.coarsest() {
            plain.write_level(queue, &texture, level, &read_level(source, index, level)?);
        }
        let (shade, sampler) = match taps {
            Taps::Same => ("shade_reference", plain.sampler(device)),
            Taps::Ordinary => ("shade_ordinary", plain.sampler(device)),
            Taps::Adapter => (
                "shade_by_adapter",
                plain.own_sampler(
                    device,
                    textures
                        .texture(renderer.layer().texture())?
                        .filter(renderer.layer().index())
                        .unwrap_or_default()
                        .max_taps(),
                ),
            ),
        };
        let pipelines = renderer.pipelines(shade, Some(&group_entries()), &[renderer.format()]);
        let uniform = plain.uniform(device, queue);
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("reference"),
            entries: &group_entries(),
        });
        Ok(Reference { pipelines, group: bind(device, &layout, &texture, &sampler, &uniform) })
    }

    /// Draws the picture.
    pub fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        renderer: &SceneRenderer,
        textures: &Textures,
        target: &Target<'_>,
    ) {
        let mut pass = target.begin(encoder, renderer.background());
        pass.set_bind_group(2, &self.group, &[]);
        if let Ok(group) = textures.bind_group(renderer.sampled()) {
            renderer.draw(&mut pass, &self.pipelines, group);
        }
    }
}

/// What the shader is told; laid out as `Reference` in reference.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Params {
    share: [f32; 2],
    layer_scale: u32,
    keeps_positions: u32,
}

/// One layer as an ordinary texture.
pub(crate) struct Plain<'a> {
    description: &'a Description,
    layer: &'a Layer,
    /// Of its texels.
    format: LayerFormat,
    /// The levels in texels of the layer.
    shape: Geometry,
    /// Size of level 0 with the padding.
    padded: [u32; 2],
}

impl Plain<'_> {
    pub(crate) fn new(description: &Description, index: usize) -> Plain<'_> {
        let layer = &description.layers[index];
        let ([width, height, _], [mode_x, mode_y, _]) =
            (description.geometry.size(), description.geometry.address());
        // The levels of a layer with a fraction of the resolution are as many as the texture's, so its
        // padding is as large.
        let padded = |side: u32, mode| match mode {
            // Down to a texel of padding beside the last of the texture.
            AddressMode::Border => 2 << description.geometry.coarsest(),
            AddressMode::Clamp | AddressMode::Wrap | AddressMode::Mirror => side.next_power_of_two(),
        };
        Plain {
            description,
            layer,
            format: layer.format.decoded(),
            shape: description.geometry.of_layer(layer.scale),
            padded: [padded(width, mode_x), padded(height, mode_y)],
        }
    }

    pub(crate) fn texture(&self, device: &wgpu::Device) -> Result<wgpu::Texture, ReferenceError> {
        let filtered = vastex::texture_format(self.format, device.features());
        let filtered = filtered.filter(|(_, atlas)| *atlas == vastex::Atlas::Float);
        let (format, _) = filtered.ok_or(ReferenceError::Format(self.format))?;
        let (size, texel) = (self.padded, self.format.texel_bytes() as u64);
        let bytes = u64::from(size[0]) * u64::from(size[1]) * texel * 4 / 3;
        if bytes > MAX_BYTES || size.iter().any(|&side| side > device.limits().max_texture_dimension_2d) {
            return Err(ReferenceError::TooLarge { size, bytes });
        }
        Ok(device.create_texture(&wgpu::TextureDescriptor {
            label: Some("reference"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: u32::from(self.shape.coarsest()) + 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        }))
    }

    pub(crate) fn write_level(&self, queue: &wgpu::Queue, texture: &wgpu::Texture, level: u8, image: &[u8]) {
        const BAND_BYTES: usize = 32 << 20;
        let texel = self.format.texel_bytes();
        let [size_x, size_y, _] = self.shape.level(level).size;
        let padded = self.padded.map(|side| (side >> level).max(1));
        let [mode_x, mode_y, _] = self.shape.address();
        let source_x: Vec<_> = (0..padded[0]).map(|x| padding_source(mode_x, x, size_x, padded[0])).collect();
        let border = border_texel(self.format, self.description.border_color);
        let row_bytes = padded[0] as usize * texel;
        let band_rows = (BAND_BYTES / row_bytes).max(1) as u32;
        let mut band = Vec::new();
        for first in (0..padded[1]).step_by(band_rows as usize) {
            let rows = band_rows.min(padded[1] - first);
            band.clear();
            for y in first..first + rows {
                let source_y = padding_source(mode_y, y, size_y, padded[1]);
                for &x in &source_x {
                    match x.zip(source_y) {
                        Some((x, y)) => {
                            let start = (y as usize * size_x as usize + x as usize) * texel;
                            band.extend_from_slice(&image[start..start + texel]);
                        }
                        None => band.extend_from_slice(&border),
                    }
                }
            }
            queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture,
                    mip_level: u32::from(level),
                    origin: wgpu::Origin3d { x: 0, y: first, z: 0 },
                    aspect: wgpu::TextureAspect::All,
                },
                &band,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes as u32),
                    rows_per_image: None,
                },
                wgpu::Extent3d { width: padded[0], height: rows, depth_or_array_layers: 1 },
            );
            queue.submit([]); // so that the queue lets go of the band's staging memory
        }
    }

    fn params(&self) -> Params {
        let ([width, height, _], scale) = (self.description.geometry.size(), self.layer.scale);
        let share = |side: u32, padded: u32| side as f32 / (scale * padded) as f32;
        Params {
            share: [share(width, self.padded[0]), share(height, self.padded[1])],
            layer_scale: scale,
            keeps_positions: u32::from(self.shape.spec().positions == TexelPositions::Kept),
        }
    }

    /// The coarsest level.
    pub(crate) fn coarsest(&self) -> u8 {
        self.shape.coarsest()
    }

    /// What a shader reads it by: texture, sampler, parameters.
    pub(crate) fn binding_types() -> [wgpu::BindingType; 3] {
        [
            wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: true },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
            wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
        ]
    }

    /// A sampler of the levels one by one.
    pub(crate) fn sampler(&self, device: &wgpu::Device) -> wgpu::Sampler {
        device.create_sampler(&self.sampler_of_levels())
    }

    /// A sampler that chooses and blends levels itself, with so many taps at most.
    fn own_sampler(&self, device: &wgpu::Device, taps: u32) -> wgpu::Sampler {
        device.create_sampler(&wgpu::SamplerDescriptor {
            mipmap_filter: wgpu::MipmapFilterMode::Linear,
            anisotropy_clamp: taps as u16, // at most 16
            ..self.sampler_of_levels()
        })
    }

    fn sampler_of_levels(&self) -> wgpu::SamplerDescriptor<'static> {
        // A mirrored edge needs the texel at the edge once more, which is what a clamped edge gives; before
        // the first texel lies the end of the padding, where the border colour is.
        let address = self.shape.address().map(|mode| match mode {
            AddressMode::Wrap | AddressMode::Border => wgpu::AddressMode::Repeat,
            AddressMode::Clamp | AddressMode::Mirror => wgpu::AddressMode::ClampToEdge,
        });
        wgpu::SamplerDescriptor {
            label: Some("reference"),
            address_mode_u: address[0],
            address_mode_v: address[1],
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            mipmap_filter: wgpu::MipmapFilterMode::Nearest,
            ..Default::default()
        }
    }

    pub(crate) fn uniform(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> wgpu::Buffer {
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("reference"),
            size: size_of::<Params>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&self.params()));
        uniform
    }
}

/// The texel of a level of `size` that texel `at` of `padded` holds, or nothing for the border colour. With
/// wrapped edges the far half of the padding lies before texel 0, since the sampler wraps too.
fn padding_source(mode: AddressMode, at: u32, size: u32, padded: u32) -> Option<u32> {
    if at < size {
        return Some(at);
    }
    let before_first = mode == AddressMode::Wrap && at >= size + (padded - size).div_ceil(2);
    let texel = if before_first { i64::from(at) - i64::from(padded) } else { i64::from(at) };
    (mode != AddressMode::Border).then(|| vastex::survey::fold(mode, texel, size))
}

/// A texel of the border colour.
fn border_texel(format: LayerFormat, color: [u8; 4]) -> Vec<u8> {
    use LayerFormat::{R16, R16Float, R32Float, Rgba16, Rgba16Float};
    let unit = color.map(|channel| f32::from(channel) / 255.0);
    let halves = unit.map(|channel| half::f16::from_f32(channel).to_le_bytes());
    let words = color.map(|channel| (u16::from(channel) * 257).to_le_bytes());
    match format {
        R16 | Rgba16 => words.as_flattened()[..format.texel_bytes()].to_vec(),
        R16Float | Rgba16Float => halves.as_flattened()[..format.texel_bytes()].to_vec(),
        R32Float => unit[0].to_le_bytes().to_vec(),
        _ => color[..format.texel_bytes()].to_vec(),
    }
}

fn group_entries() -> [wgpu::BindGroupLayoutEntry; 3] {
    let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    let [texture, sampler, params] = Plain::binding_types();
    [(0, texture), (1, sampler), (2, params)].map(entry)
}

fn bind(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    texture: &wgpu::Texture,
    sampler: &wgpu::Sampler,
    uniform: &wgpu::Buffer,
) -> wgpu::BindGroup {
    let view = texture.create_view(&Default::default());
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("reference"),
        layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(sampler) },
            wgpu::BindGroupEntry { binding: 2, resource: uniform.as_entire_binding() },
        ],
    })
}
