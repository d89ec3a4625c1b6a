//! A planet drawn from ordinary mip-mapped textures, all of them at once: what its picture is compared with.

use crate::compare::Comparison;
use crate::levels::read_level;
use crate::pipeline::{Corners, PipelineParts};
use crate::planet::{Attribute, FORMAT, GLOBE, Planet, function};
use crate::reference::{Plain, ReferenceError};

/// Bindings that a member takes.
const BINDINGS: u32 = 3;

impl Planet {
    /// How alike the picture of the last frame is to that from an ordinary texture in the place of each virtual one.
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
        let groups = [self.textures.bind_group_layout(self.group), &self.globe.layout, &layout].map(Some);
        let sampled: String = Attribute::ALL.into_iter().map(|attribute| self.sampled(attribute)).collect();
        let text = [GLOBE, &sampled, &self.textures.wgsl(self.group)].join("\n");
        let pipeline = PipelineParts {
            text,
            corners: Corners::Vertices,
            entries: ["place", "shade"],
            formats: &[FORMAT],
        };
        let expected = self.picture_by(&pipeline.pipeline(device, &groups), Some(&group));
        Ok(self.picture().compare(&expected))
    }

    /// The function by which planet.wgsl samples an attribute, from its ordinary texture. Parts are the group's textures in
    /// their order, its shape before them.
    fn sampled(&self, attribute: Attribute) -> String {
        let place = (0..).zip(&self.parts).find(|(_, (part, _))| *part == attribute);
        let Some((place, _)) = place else { return function(attribute.name(), attribute.without()) };
        let bindings = ["TEXTURE_BINDING", "SAMPLER_BINDING", "PARAMS_BINDING"];
        let text = include_str!("wgsl/planet_reference.wgsl").replace("MEMBER", attribute.name());
        let text = text.replace("TEXTURE_PLACE", &(place + 1).to_string());
        (place * BINDINGS..).zip(bindings).fold(text, |text, (n, name)| text.replace(name, &n.to_string()))
    }
}
