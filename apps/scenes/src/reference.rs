//! The same scene drawn from an ordinary mip-mapped texture: what a virtual texture is compared with.
//!
//! The texture holds the levels that the source has, padded per axis to the next power of two, so that texel `i` of a level
//! covers exactly the texels `2i` and `2i + 1` of the level before it, as in the virtual texture. The padding holds
//! what the address mode gives there.

use vastex::{AddressMode, Description, LayerFormat, Textures, TileSource};

use crate::draw::{PictureTarget, SceneRenderer};
use crate::levels::{LevelError, read_level};

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
    /// A tile could not be read.
    #[error(transparent)]
    Level(#[from] LevelError),
}

/// See the head of the file.
pub struct Reference {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
}

impl Reference {
    /// Reads all levels of the source into an ordinary texture.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        textures: &Textures,
        renderer: &SceneRenderer,
        source: &dyn TileSource,
    ) -> Result<Reference, ReferenceError> {
        let description = source.description();
        let texture = reference_texture(device, description)?;
        for level in 0..=description.geometry.coarsest() {
            write_level(queue, &texture, description, level, &read_level(source, level)?);
        }
        let layout = group_layout(device);
        let pipeline = renderer.other_pipeline(
            device,
            textures,
            include_str!("wgsl/reference.wgsl"),
            ["place", "shade_reference"],
            Some(&layout),
            &[renderer.format()],
        );
        Ok(Reference { pipeline, group: bind(device, queue, &layout, &texture, description) })
    }

    /// Draws the picture.
    pub fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        renderer: &SceneRenderer,
        textures: &Textures,
        target: &PictureTarget<'_>,
    ) {
        let mut pass = target.begin(encoder);
        pass.set_bind_group(2, &self.group, &[]);
        renderer.draw(&mut pass, &self.pipeline, textures.bind_group(renderer.texture()));
    }
}

fn padded_size(description: &Description) -> [u32; 2] {
    let [width, height, _] = description.geometry.size();
    [width.next_power_of_two(), height.next_power_of_two()]
}

fn reference_texture(
    device: &wgpu::Device,
    description: &Description,
) -> Result<wgpu::Texture, ReferenceError> {
    let size = padded_size(description);
    let format = match description.layers[0].format {
        LayerFormat::R8 => wgpu::TextureFormat::R8Unorm,
        LayerFormat::Rg8 => wgpu::TextureFormat::Rg8Unorm,
        LayerFormat::Rgba8 => wgpu::TextureFormat::Rgba8Unorm,
        LayerFormat::Rgba8Srgb => wgpu::TextureFormat::Rgba8UnormSrgb,
        LayerFormat::R16 if device.features().contains(wgpu::Features::TEXTURE_FORMAT_16BIT_NORM) => {
            wgpu::TextureFormat::R16Unorm
        }
        format => return Err(ReferenceError::Format(format)),
    };
    let texel = description.layers[0].format.texel_bytes() as u64;
    let bytes = u64::from(size[0]) * u64::from(size[1]) * texel * 4 / 3;
    if bytes > MAX_BYTES || size.iter().any(|&side| side > device.limits().max_texture_dimension_2d) {
        return Err(ReferenceError::TooLarge { size, bytes });
    }
    Ok(device.create_texture(&wgpu::TextureDescriptor {
        label: Some("reference"),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: u32::from(description.geometry.coarsest()) + 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    }))
}

/// The texel of a level of `size` that padding texel `at` of `padded` holds. With wrapped edges the far half of the
/// padding lies before texel 0, since the sampler wraps too.
fn padding_source(mode: AddressMode, at: u32, size: u32, padded: u32) -> u32 {
    let before_first = mode == AddressMode::Wrap && at >= size + (padded - size).div_ceil(2);
    let texel = if before_first { i64::from(at) - i64::from(padded) } else { i64::from(at) };
    vastex::fold(mode, texel, size)
}

fn write_level(
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    description: &Description,
    level: u8,
    image: &[u8],
) {
    const BAND_BYTES: usize = 32 << 20;
    let geometry = &description.geometry;
    let texel = description.layers[0].format.texel_bytes();
    let [size_x, size_y, _] = geometry.level(level).size;
    let padded = padded_size(description).map(|side| (side >> level).max(1));
    let [mode_x, mode_y, _] = geometry.address();
    let columns: Vec<u32> =
        (size_x..padded[0]).map(|x| padding_source(mode_x, x, size_x, padded[0])).collect();
    let row_bytes = padded[0] as usize * texel;
    let band_rows = (BAND_BYTES / row_bytes).max(1) as u32;
    let mut band = Vec::new();
    for first in (0..padded[1]).step_by(band_rows as usize) {
        let rows = band_rows.min(padded[1] - first);
        band.clear();
        for y in first..first + rows {
            let y = if y < size_y { y } else { padding_source(mode_y, y, size_y, padded[1]) };
            let start = y as usize * size_x as usize * texel;
            let row = &image[start..start + size_x as usize * texel];
            band.extend_from_slice(row);
            columns.iter().for_each(|&x| band.extend_from_slice(&row[x as usize * texel..][..texel]));
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

fn group_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("reference"),
        entries: &[
            entry(
                0,
                wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable: true },
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
            ),
            entry(1, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
            entry(
                2,
                wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
            ),
        ],
    })
}

fn bind(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    layout: &wgpu::BindGroupLayout,
    texture: &wgpu::Texture,
    description: &Description,
) -> wgpu::BindGroup {
    let geometry = &description.geometry;
    // A mirrored edge needs the texel at the edge once more, which is what a clamped edge gives.
    let address = geometry.address().map(|mode| match mode {
        AddressMode::Wrap => wgpu::AddressMode::Repeat,
        AddressMode::Clamp | AddressMode::Mirror | AddressMode::Border => wgpu::AddressMode::ClampToEdge,
    });
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("reference"),
        address_mode_u: address[0],
        address_mode_v: address[1],
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Nearest,
        ..Default::default()
    });
    let ([width, height, _], padded) = (geometry.size(), padded_size(description));
    let share = [width as f32 / padded[0] as f32, height as f32 / padded[1] as f32, 0.0, 0.0];
    let uniform = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("reference"),
        size: 16,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&share));
    let view = texture.create_view(&Default::default());
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("reference"),
        layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&sampler) },
            wgpu::BindGroupEntry { binding: 2, resource: uniform.as_entire_binding() },
        ],
    })
}
