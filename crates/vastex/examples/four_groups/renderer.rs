//! The host's renderer: a bind group for each of view, light, material and object, so that none is left; a
//! shadow map, a depth prepass with reversed depth, four samples a pixel. It knows no Vastex but in that a
//! material has bindings of whoever samples its textures.

use std::cell::Cell;
use std::ops::Range;

use glam::{Mat4, Vec3};

use super::chess::{self, Mesh, Object};
use super::common::headless::{DEPTH_FORMAT, Headless, PICTURE_FORMAT};
use super::setup::{
    Drawing, OBJECT_STRIDE, buffer, group_layout, objects_buffer, pipeline, pipeline_layout, shadow_entries,
    target_view, uniform_entry,
};

/// The group of the material.
pub(crate) const MATERIAL_GROUP: u32 = 2;
/// Bindings of a material that are the renderer's own: those of its textures come behind.
pub(crate) const OWN_BINDINGS: u32 = 1;
pub(crate) const MATERIALS: usize = 5;
/// How rough each is, 0 to 1: table, board, white, black, lead.
const ROUGHNESS: [f32; MATERIALS] = [0.55, 0.34, 0.16, 0.1, 0.5];
const SAMPLES: u32 = 4;
const SHADOW_SIDE: u32 = 2048;

pub(crate) struct Renderer {
    module: wgpu::ShaderModule,
    /// Of all four groups.
    layout: wgpu::PipelineLayout,
    material_layout: wgpu::BindGroupLayout,
    /// Of each what is its own.
    materials: [wgpu::Buffer; MATERIALS],
    eye_group: wgpu::BindGroup,
    sun_group: wgpu::BindGroup,
    light_group: wgpu::BindGroup,
    object_group: wgpu::BindGroup,
    shadow: wgpu::RenderPipeline,
    prepass: wgpu::RenderPipeline,
    picture: wgpu::RenderPipeline,
    behind: wgpu::RenderPipeline,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    /// Of each its indices.
    meshes: Vec<Range<u32>>,
    objects: Vec<Object>,
    shadow_map: wgpu::TextureView,
    samples: wgpu::TextureView,
    samples_depth: wgpu::TextureView,
    highest_group: Cell<u32>,
}

impl Renderer {
    /// `text` is the scene's shader and what samples its textures, `entries` the bindings of that, `ids` say
    /// which texture each material has.
    pub(crate) fn new(
        target: &Headless,
        size: [u32; 2],
        text: String,
        entries: &[wgpu::BindGroupLayoutEntry],
        ids: [u32; MATERIALS],
    ) -> Renderer {
        let device = &target.device;
        let view_layout = group_layout(device, "view", &[uniform_entry(false)]);
        let light_layout = group_layout(device, "light", &shadow_entries());
        let material_layout = group_layout(device, "material", &[&[uniform_entry(false)], entries].concat());
        let object_layout = group_layout(device, "object", &[uniform_entry(true)]);
        let group = |layout, entries: &[wgpu::BindGroupEntry<'_>]| {
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries })
        };

        let uniform = |bytes: &[u8]| buffer(target, wgpu::BufferUsages::UNIFORM, bytes);
        let seen_from = |(clip_from_world, at): (Mat4, Vec3)| {
            let matrices = [clip_from_world, clip_from_world.inverse()].map(|matrix| matrix.to_cols_array());
            uniform(bytemuck::cast_slice(&[matrices.as_flattened(), &at.extend(0.0).to_array()].concat()))
        };
        let view = |buffer: &wgpu::Buffer| group(&view_layout, &[entry(0, buffer.as_entire_binding())]);
        let sun = seen_from(chess::sun());
        let shadow_side = [SHADOW_SIDE; 2];
        let sampled = wgpu::TextureUsages::TEXTURE_BINDING;
        let shadow_map = target_view(device, shadow_side, 1, DEPTH_FORMAT, sampled);
        let shadow_sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("shadows"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            compare: Some(wgpu::CompareFunction::LessEqual),
            ..Default::default()
        });
        let light_group = group(
            &light_layout,
            &[
                entry(0, sun.as_entire_binding()),
                entry(1, wgpu::BindingResource::TextureView(&shadow_map)),
                entry(2, wgpu::BindingResource::Sampler(&shadow_sampler)),
            ],
        );
        let objects = chess::objects();
        let of_one = wgpu::BufferBinding {
            buffer: &objects_buffer(target, &objects),
            offset: 0,
            size: wgpu::BufferSize::new(u64::from(OBJECT_STRIDE)),
        };
        let object_group = group(&object_layout, &[entry(0, wgpu::BindingResource::Buffer(of_one))]);

        let module = vastex::shader_module(device, Some("scene"), text);
        let layout = pipeline_layout(
            device,
            [Some(&view_layout), Some(&light_layout), Some(&material_layout), Some(&object_layout)],
        );
        let depth_layout = pipeline_layout(device, [Some(&view_layout), None, None, Some(&object_layout)]);
        // Nearer is a larger depth; the sun's map is as usual.
        let nearest =
            Drawing { compare: wgpu::CompareFunction::Greater, ..Drawing::depth_of("place_depth", SAMPLES) };
        let shadow = Drawing {
            compare: wgpu::CompareFunction::Less,
            is_biased: true,
            ..Drawing::depth_of("place_depth", 1)
        };
        let as_before = |vertex, fragment| Drawing {
            fragment: Some((fragment, PICTURE_FORMAT)),
            compare: wgpu::CompareFunction::Equal,
            ..Drawing::depth_of(vertex, SAMPLES)
        };
        let mut all = Mesh::default();
        let meshes = chess::meshes(size[1]).into_iter().map(|mesh| all.add(mesh)).collect();
        let transient = wgpu::TextureUsages::empty();
        Renderer {
            shadow: pipeline(device, &depth_layout, &module, &shadow),
            prepass: pipeline(device, &depth_layout, &module, &nearest),
            picture: pipeline(device, &layout, &module, &as_before("place", "shade")),
            behind: pipeline(device, &layout, &module, &as_before("cover", "shade_behind")),
            materials: std::array::from_fn(|nth| {
                uniform(bytemuck::bytes_of(&[ids[nth], ROUGHNESS[nth].to_bits(), 0, 0]))
            }),
            eye_group: view(&seen_from(chess::eye(size))),
            sun_group: view(&sun),
            samples: target_view(device, size, SAMPLES, PICTURE_FORMAT, transient),
            samples_depth: target_view(device, size, SAMPLES, DEPTH_FORMAT, transient),
            highest_group: Cell::new(0),
            module,
            layout,
            material_layout,
            light_group,
            object_group,
            vertices: buffer(target, wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(&all.vertices)),
            indices: buffer(target, wgpu::BufferUsages::INDEX, bytemuck::cast_slice(&all.indices)),
            meshes,
            objects,
            shadow_map,
        }
    }

    /// The bind group of a material: its own, and its textures'.
    pub(crate) fn material_group(
        &self,
        device: &wgpu::Device,
        nth: usize,
        textures: Vec<wgpu::BindGroupEntry<'_>>,
    ) -> wgpu::BindGroup {
        let own = entry(0, self.materials[nth].as_entire_binding());
        let entries: Vec<_> = std::iter::once(own).chain(textures).collect();
        let layout = &self.material_layout;
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("material"),
            layout,
            entries: &entries,
        })
    }

    /// A pipeline of the same meshes, text and groups into other targets.
    pub(crate) fn pipeline(&self, device: &wgpu::Device, drawing: &Drawing<'_>) -> wgpu::RenderPipeline {
        pipeline(device, &self.layout, &self.module, drawing)
    }

    /// The number of the highest bind group that was set so far.
    pub(crate) fn highest_group(&self) -> u32 {
        self.highest_group.get()
    }

    /// Records the shadow map. Nothing moves, so once is enough.
    pub(crate) fn draw_shadows(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = begin(encoder, "shadows", None, &self.shadow_map, Some(1.0));
        self.draw_depth(&mut pass, &self.shadow, &self.sun_group);
    }

    /// Records depth and the picture, which ends in the target, one sample a pixel.
    pub(crate) fn draw_picture(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &Headless,
        materials: &[wgpu::BindGroup],
    ) {
        let mut pass = begin(encoder, "depth", None, &self.samples_depth, Some(0.0));
        self.draw_depth(&mut pass, &self.prepass, &self.eye_group);
        drop(pass);
        let resolved = target.colour.create_view(&Default::default());
        let colour = Some((&self.samples, &resolved));
        let mut pass = begin(encoder, "picture", colour, &self.samples_depth, None);
        self.draw(&mut pass, &self.picture, materials);
        pass.set_pipeline(&self.behind);
        pass.draw(0..3, 0..1);
    }

    /// Draws every object by a pipeline of all four groups.
    pub(crate) fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        materials: &[wgpu::BindGroup],
    ) {
        self.begin_meshes(pass, pipeline, &self.eye_group);
        self.set(pass, 1, &self.light_group, &[]);
        let mut set = None;
        for (nth, object) in (0..).zip(&self.objects) {
            if set.replace(object.material) != Some(object.material) {
                self.set(pass, MATERIAL_GROUP, &materials[object.material], &[]);
            }
            self.draw_object(pass, nth, object);
        }
    }

    fn draw_depth(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        view: &wgpu::BindGroup,
    ) {
        self.begin_meshes(pass, pipeline, view);
        (0..).zip(&self.objects).for_each(|(nth, object)| self.draw_object(pass, nth, object));
    }

    fn begin_meshes(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        view: &wgpu::BindGroup,
    ) {
        pass.set_pipeline(pipeline);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        self.set(pass, 0, view, &[]);
    }

    fn draw_object(&self, pass: &mut wgpu::RenderPass<'_>, nth: u32, object: &Object) {
        self.set(pass, 3, &self.object_group, &[nth * OBJECT_STRIDE]);
        pass.draw_indexed(self.meshes[object.mesh].clone(), 0, 0..1);
    }

    /// Sets a bind group: the only place that does.
    fn set(&self, pass: &mut wgpu::RenderPass<'_>, index: u32, group: &wgpu::BindGroup, offsets: &[u32]) {
        self.highest_group.set(self.highest_group.get().max(index));
        pass.set_bind_group(index, group, offsets);
    }
}

fn entry(binding: u32, resource: wgpu::BindingResource<'_>) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource }
}

/// A pass into samples that are resolved, if it has colour, with a depth that is cleared or, where that is
/// nothing, there and not kept.
fn begin<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    label: &str,
    colour: Option<(&wgpu::TextureView, &wgpu::TextureView)>,
    depth: &wgpu::TextureView,
    clear_depth: Option<f32>,
) -> wgpu::RenderPass<'e> {
    let attachment = colour.map(|(view, resolved)| {
        let (load, store) = (wgpu::LoadOp::Clear(wgpu::Color::BLACK), wgpu::StoreOp::Discard);
        let (resolve_target, ops) = (Some(resolved), wgpu::Operations { load, store });
        Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target, ops })
    });
    let depth_ops = match clear_depth {
        Some(depth) => wgpu::Operations { load: wgpu::LoadOp::Clear(depth), store: wgpu::StoreOp::Store },
        None => wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Discard },
    };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: attachment.as_slice(),
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: depth,
            depth_ops: Some(depth_ops),
            stencil_ops: None,
        }),
        ..Default::default()
    })
}
