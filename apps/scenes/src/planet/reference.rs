//! A planet drawn from ordinary mip-mapped textures, all of them at once: what its picture is compared with.

use super::{FORMAT, Planet};
use crate::attribute::Attribute;
use crate::compare::Comparison;
use crate::levels::read_level;
use crate::reference::{Plain, ReferenceError};
use crate::shaders;
use vastex_viewer::surface::{Corners, PipelineParts};

impl Planet {
    /// How alike the picture of the last frame is to that from an ordinary texture in the place of each
    /// virtual one.
    pub fn compare(&self) -> Result<Comparison, ReferenceError> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let (mut types, mut bound) = (Vec::new(), Vec::new());
        for (_, source) in &self.parts {
            let plain = Plain::new(source.description(), 0);
            let texture = plain.texture(device)?;
            for level in 0..=plain.coarsest() {
                plain.write_level(queue, &texture, level, &read_level(&**source, 0, level)?);
            }
            types.extend(Plain::binding_types());
            bound.push((
                texture.create_view(&Default::default()),
                plain.sampler(device),
                plain.uniform(device, queue),
            ));
        }
        let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("ordinary planet"),
            entries: &(0..).zip(types).map(entry).collect::<Vec<_>>(),
        });
        let resources = bound.iter().flat_map(|(view, sampler, params)| {
            [
                wgpu::BindingResource::TextureView(view),
                wgpu::BindingResource::Sampler(sampler),
                params.as_entire_binding(),
            ]
        });
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("ordinary planet"),
            layout: &layout,
            entries: &entries,
        });
        let kinds = self.textures.kinds(self.scene.group)?;
        let textures_layout = self.textures.bind_group_layout(&kinds);
        let groups = [&textures_layout, &self.scene.globe.layout, &layout].map(Some);
        let attributes: Vec<Attribute> = self.parts.iter().map(|(part, _)| *part).collect();
        let pools: Vec<usize> = kinds.member_pools().collect();
        let text = shaders::ordinary_planet(&self.textures.wgsl(&kinds), &attributes, &pools);
        let pipeline = PipelineParts {
            module: &vastex::shader_module(device, Some("ordinary planet"), text),
            constants: &[],
            corners: Corners::Vertices,
            entries: ["place", "shade"],
            formats: &[FORMAT],
        };
        let expected = self.picture_by(&pipeline.pipeline(device, &groups), Some(&group));
        Ok(Comparison::of(&self.picture(), &expected))
    }
}
