//! How well a device's own filter blends voxels, found out by trying it: the formats in which pools hold
//! volumes follow from that ([`held_volume_format`](crate::held_volume_format)).
//!
//! A ramp is put into a small 3-D texture of each format and filtered at 64 places. A format passes where
//! everything that comes back is within 1/1024 of the range. Software drivers often filter 8 bits in 8 bits,
//! which shows as bands in what should be smooth.

use std::collections::HashMap;
use std::sync::{Mutex, OnceLock, PoisonError};

use crate::device::{alive, validated};
use crate::error::GpuError;
use crate::mapping::{Answer, Mapping, read_buffer};
use crate::module::shader_module;

const TEXT: &str = include_str!("wgsl/filters.wgsl");
/// Texels along each side of a texture.
const SIDE: u32 = 8;
/// Places at which it is sampled.
const PLACES: u32 = 64;
/// What may be lost, of the range.
const TOLERANCE: f64 = 1.0 / 1024.0;
/// The format of the target: a row of [`PLACES`] has no padding when it is copied.
const TARGET: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;

/// Which formats a device filters as well as is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct VolumeFilters {
    /// True if one channel of 8 bits is filtered well.
    pub r8: bool,
    /// True if one channel of 16 bits is filtered well.
    pub r16: bool,
    /// True if two channels of 8 bits, the halves of 16, are filtered well, each by itself.
    pub high_low: bool,
    /// True if one channel of 16-bit floats is filtered well.
    pub r16f: bool,
    /// True if one channel of 32-bit floats is filtered well.
    pub r32f: bool,
}

/// What tells devices apart that may filter in other ways.
type Key = (String, String, String, wgpu::Backend, bool, bool);

impl VolumeFilters {
    /// The filters assumed of a device with these features where none can be tried, as in a browser, where
    /// nothing can wait for an answer: all but two channels in the place of one.
    pub fn untried(features: wgpu::Features) -> VolumeFilters {
        VolumeFilters {
            r8: true,
            r16: features.contains(wgpu::Features::TEXTURE_FORMAT_16BIT_NORM),
            high_low: false,
            r16f: true,
            r32f: features.contains(wgpu::Features::FLOAT32_FILTERABLE),
        }
    }

    /// The filters of a device: tried by the first call, which waits for some milliseconds, and kept for all
    /// devices of the same adapter, driver and features in this process. Where the device is lost, or has no
    /// answer, they are those that are taken for granted, and the next call tries again.
    pub fn of(device: &wgpu::Device, queue: &wgpu::Queue) -> VolumeFilters {
        if cfg!(target_family = "wasm") {
            return VolumeFilters::untried(device.features());
        }
        static KNOWN: OnceLock<Mutex<HashMap<Key, VolumeFilters>>> = OnceLock::new();
        let known = KNOWN.get_or_init(Mutex::default);
        // Held while it is tried, so that several threads try once.
        let mut known = known.lock().unwrap_or_else(PoisonError::into_inner);
        let key = key(device);
        if let Some(filters) = known.get(&key) {
            return *filters;
        }
        match tried(device, queue) {
            Ok(filters) => {
                tracing::debug!(?filters, adapter = key.0, "filters of volumes were tried");
                known.insert(key, filters);
                filters
            }
            Err(error) => {
                tracing::warn!("the device's filters could not be tried: {error}");
                VolumeFilters::untried(device.features())
            }
        }
    }

    /// Each filter by its name, for people and for scripts.
    pub fn named(self) -> [(&'static str, bool); 5] {
        let VolumeFilters { r8, r16, high_low, r16f, r32f } = self;
        [("r8", r8), ("r16", r16), ("rg8", high_low), ("r16f", r16f), ("r32f", r32f)]
    }
}

fn key(device: &wgpu::Device) -> Key {
    let info = device.adapter_info();
    let granted = VolumeFilters::untried(device.features());
    (info.name, info.driver, info.driver_info, info.backend, granted.r16, granted.r32f)
}

/// The text of the shader that tries filters, which this crate hands to a device.
pub fn filters_text() -> String {
    TEXT.to_owned()
}

/// A ramp: what the texel at `x + y + z` steps stands for, and its bytes.
struct Ramp {
    format: wgpu::TextureFormat,
    texel: fn(u32) -> (f64, Vec<u8>),
}

/// The ramps, in the order in which the shader has them; of formats that the device does not filter there is
/// another in their place.
fn ramps(has: VolumeFilters) -> [Ramp; 5] {
    use wgpu::TextureFormat::{R8Unorm, R16Float, R16Unorm, R32Float, Rg8Unorm};
    let eight =
        || Ramp { format: R8Unorm, texel: |step| (f64::from(12 * step) / 255.0, vec![(12 * step) as u8]) };
    let sixteen = |format| Ramp {
        format,
        texel: |step| {
            // Halves of which the lower one jumps.
            let code = 777 + 3001 * step;
            (f64::from(code) / 65535.0, (code as u16).to_le_bytes().to_vec())
        },
    };
    let half = Ramp {
        format: R16Float,
        texel: |step| {
            let value = step as f32 / 21.0;
            (f64::from(value), half_bits(value).to_le_bytes().to_vec())
        },
    };
    let float = Ramp {
        format: R32Float,
        texel: |step| {
            let value = step as f32 / 21.0;
            (f64::from(value), value.to_le_bytes().to_vec())
        },
    };
    [
        eight(),
        if has.r16 { sixteen(R16Unorm) } else { eight() },
        sixteen(Rg8Unorm),
        half,
        if has.r32f { float } else { eight() },
    ]
}

/// A float of 16 bits, the nearest one, of a number from 2^-14 to 1, or 0.
pub fn half_bits(value: f32) -> u16 {
    if value < 6.2e-5 {
        return 0;
    }
    let bits = value.to_bits();
    // Half of the last bit that is kept, or a little less where that bit is even.
    let rounded = bits + 0xfff + ((bits >> 13) & 1);
    ((rounded >> 13) - ((127 - 15) << 10)) as u16
}

/// Filters the ramps, and sees what comes back.
fn tried(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<VolumeFilters, GpuError> {
    alive(device)?;
    let has = VolumeFilters { high_low: true, ..VolumeFilters::untried(device.features()) };
    let ramps = ramps(has);
    let (found, is_taken) = validated(device, || filtered(device, queue, &ramps));
    let found = found?;
    if !is_taken {
        return Err(GpuError::DeviceLost);
    }
    let passes = |nth: usize| {
        let (first, _) = (ramps[nth].texel)(0);
        let (second, _) = (ramps[nth].texel)(1);
        (0..PLACES).all(|place| {
            let steps = [1, 37, 23].map(|stride| f64::from(place * stride % PLACES) * 7.0 / 64.0);
            let expected = first + steps.iter().sum::<f64>() * (second - first);
            (f64::from(found[nth][place as usize]) - expected).abs() <= TOLERANCE
        })
    };
    Ok(VolumeFilters {
        r8: passes(0),
        r16: has.r16 && passes(1),
        high_low: passes(2),
        r16f: passes(3),
        r32f: has.r32f && passes(4),
    })
}

/// What the shader samples of each ramp at each place.
fn filtered(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    ramps: &[Ramp; 5],
) -> Result<[Vec<f32>; 5], GpuError> {
    let views = ramps.each_ref().map(|ramp| ramp_texture(device, queue, ramp));
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("vastex filters"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    });
    let module = shader_module(device, Some("vastex filters"), TEXT);
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("vastex filters"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("filters_fill"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("filters_try"),
            compilation_options: Default::default(),
            targets: &[Some(TARGET.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let sampler = wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::Sampler(&sampler) };
    let textures = (1..).zip(&views).map(|(binding, view)| wgpu::BindGroupEntry {
        binding,
        resource: wgpu::BindingResource::TextureView(view),
    });
    let entries: Vec<_> = std::iter::once(sampler).chain(textures).collect();
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("vastex filters"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    });
    let size = wgpu::Extent3d { width: PLACES, height: 2, depth_or_array_layers: 1 };
    let target = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("vastex filters"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: TARGET,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = target.create_view(&Default::default());
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("vastex filters"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations::default(),
        })],
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.draw(0..3, 0..1);
    drop(pass);
    let row = 16 * PLACES;
    let read = read_buffer(device, u64::from(2 * row));
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
    let info = wgpu::TexelCopyBufferInfo { buffer: &read, layout };
    encoder.copy_texture_to_buffer(target.as_image_copy(), info, size);
    let mapping = Mapping::on_submit(&encoder, &read, read.size());
    queue.submit([encoder.finish()]);
    if mapping.wait(device, queue, &read)? != Answer::Mapped {
        return Err(GpuError::DeviceLost);
    }
    let words: Vec<[f32; 4]> = mapping.read(&read, bytemuck::pod_collect_to_vec)?;
    let (first, second) = words.split_at(PLACES as usize);
    let of = |nth: usize| match nth {
        4 => second.iter().map(|pixel| pixel[0]).collect(),
        _ => first.iter().map(|pixel| pixel[nth]).collect(),
    };
    Ok(std::array::from_fn(of))
}

fn ramp_texture(device: &wgpu::Device, queue: &wgpu::Queue, ramp: &Ramp) -> wgpu::TextureView {
    let size = wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: SIDE };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("vastex filters"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format: ramp.format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let sides = (0..SIDE).flat_map(|z| (0..SIDE).flat_map(move |y| (0..SIDE).map(move |x| x + y + z)));
    let bytes: Vec<u8> = sides.flat_map(|step| (ramp.texel)(step).1).collect();
    let row = bytes.len() as u32 / (SIDE * SIDE);
    let layout =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: Some(SIDE) };
    queue.write_texture(texture.as_image_copy(), &bytes, layout, size);
    texture.create_view(&Default::default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_the_nearest() {
        // As IEEE 754 has them: 1, a third, 1/255, and a tie between two.
        assert_eq!([1.0, 1.0 / 3.0, 1.0 / 255.0, 0.0].map(half_bits), [0x3c00, 0x3555, 0x1c04, 0]);
        assert_eq!(half_bits(1.0 - 1.0 / 4096.0), 0x3c00, "halfway, to the even one");
        assert_eq!(half_bits(1.0 - 3.0 / 4096.0), 0x3bfe, "halfway, to the even one");
    }

    #[test]
    fn ramps_span_the_range_in_equal_steps() {
        let all = VolumeFilters { r8: true, r16: true, high_low: true, r16f: true, r32f: true };
        for (nth, ramp) in ramps(all).iter().enumerate() {
            let values: Vec<f64> = (0..22).map(|step| (ramp.texel)(step).0).collect();
            let steps: Vec<f64> = values.windows(2).map(|two| two[1] - two[0]).collect();
            assert!(steps.iter().all(|step| (step - steps[0]).abs() < 1e-6), "{nth}: {steps:?}");
            assert!(values[21] > 0.95 && values[21] <= 1.0 && values[0] >= 0.0, "{nth}");
        }
    }

    #[test]
    fn what_is_not_tried_is_what_the_features_say() {
        let none = VolumeFilters::untried(wgpu::Features::empty());
        assert_eq!(none.named().map(|(_, passes)| passes), [true, false, false, true, false]);
        let all = VolumeFilters::untried(wgpu::Features::all());
        assert!(all.r16 && all.r32f && !all.high_low);
    }
}
