//! Draws a scene without heights that has a list of layers on it: all of them by one pipeline, one over the other in light.

use vastex::{Error, Sampled, Textures, shader_module};

use super::camera_binding::CameraBinding;
use super::mesh::surface;
use super::pipeline::{Corners, PipelineParts};
use super::shaders;
use super::tiling::Tiling;
use crate::camera::Pose;
use crate::layers::{BACKGROUND, LayerUniform, Layers, MOST_LAYERS};
use crate::scene::Scene;
use crate::stage::{StageScene, Target, TargetKind, Uniform, filled_buffer};

/// A scene with several layers on it. It is drawn into a target that takes light: half floats or an sRGB format.
#[derive(Debug)]
pub struct LayeredRenderer {
    sampled: Sampled,
    image: f64,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    index_count: u32,
    camera: CameraBinding,
    camera_layout: wgpu::BindGroupLayout,
    layers: Uniform,
    picture: wgpu::RenderPipeline,
    wanted: wgpu::RenderPipeline,
}

impl LayeredRenderer {
    /// Prepares an image, a plane or a globe for pictures of `format`. The first layer's texture says how wide the image is. Fails
    /// where a texture was removed.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        textures: &Textures,
        scene: Scene,
        layers: &Layers,
        format: wgpu::TextureFormat,
    ) -> Result<LayeredRenderer, Error> {
        let size = match layers.iter().next() {
            Some(first) => textures.texture(first.layer.texture())?.description().geometry.size(),
            None => [1; 3],
        };
        let image = f64::from(size[0]) / f64::from(size[1]);
        let mesh = surface(scene, image as f32);
        let filled = |bytes, usage| filled_buffer(device, queue, bytes, usage);
        let camera_layout = Uniform::layout(device);
        let sampled = Sampled::Group(layers.group());
        let kinds = textures.kinds(sampled)?;
        let textures_layout = textures.bind_group_layout(&kinds);
        let groups = [Some(&textures_layout), Some(&camera_layout), Some(&camera_layout)];
        let text = shaders::layered(&textures.wgsl(&kinds), layers.count());
        let module = &shader_module(device, Some("layers"), text);
        // Overridable constants of surface.wgsl have values whether a pipeline reads them or not.
        let of_maps = layers.iter().take(1).flat_map(|shown| shown.color_map.constants(true));
        let constants: Vec<_> = of_maps.chain(Tiling::default().constants()).collect();
        let constants = &constants[..];
        let corners = if scene == Scene::Globe { Corners::Outside } else { Corners::Vertices };
        let pipeline = |entries, format| {
            PipelineParts { module, constants, corners, entries, formats: &[format] }
                .pipeline(device, &groups)
        };
        let renderer = LayeredRenderer {
            sampled,
            image,
            vertices: filled(bytemuck::cast_slice(&mesh.vertices), wgpu::BufferUsages::VERTEX),
            indices: filled(bytemuck::cast_slice(&mesh.indices), wgpu::BufferUsages::INDEX),
            index_count: mesh.indices.len() as u32,
            camera: CameraBinding::new(device, &camera_layout, false),
            layers: Uniform::new::<[LayerUniform; MOST_LAYERS]>(device, &camera_layout),
            picture: pipeline(["place", "shade_layered"], format),
            wanted: pipeline(["place_layered_feedback", "want_layered"], Textures::FEEDBACK_FORMAT),
            camera_layout,
        };
        renderer.set_layers(queue, textures, layers);
        Ok(renderer)
    }

    /// What the layers are like in frames from here on: of the list that the renderer was made with.
    pub fn set_layers(&self, queue: &wgpu::Queue, textures: &Textures, layers: &Layers) {
        self.layers.set(queue, &layers.uniforms(textures));
    }

    /// The scene's own camera.
    pub fn camera(&self) -> &CameraBinding {
        &self.camera
    }

    /// A camera to draw the scene through from another place in the same encoder.
    pub fn new_camera(&self, device: &wgpu::Device) -> CameraBinding {
        CameraBinding::new(device, &self.camera_layout, false)
    }

    /// Into what several layers are drawn.
    pub fn target_kind(adapter: &wgpu::Adapter, layers: &Layers) -> TargetKind {
        TargetKind::for_layers(adapter, layers.count())
    }

    fn draw(
        &self,
        camera: &CameraBinding,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        textures: &wgpu::BindGroup,
    ) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, textures, &[]);
        pass.set_bind_group(1, camera.group(), &[]);
        pass.set_bind_group(2, &self.layers.group, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.index_count, 0, 0..1);
    }
}

impl StageScene for LayeredRenderer {
    type Pose = Pose;
    type Camera = CameraBinding;

    fn sampled(&self) -> Sampled {
        self.sampled
    }

    fn place(
        &self,
        camera: &CameraBinding,
        queue: &wgpu::Queue,
        textures: &Textures,
        pose: &Pose,
        picture: [u32; 2],
    ) {
        let [width, height] = picture.map(f64::from);
        let matrix = pose.clip_from_world(width / height, self.image);
        let all = textures.bindings().ids(self.sampled).map_or(0, |ids| ids[0]);
        camera.set_light(queue, matrix, all, picture.map(|side| side as f32));
    }

    fn draw_wanted(
        &self,
        camera: &CameraBinding,
        pass: &mut wgpu::RenderPass<'_>,
        textures: &wgpu::BindGroup,
    ) {
        self.draw(camera, pass, &self.wanted, textures);
    }

    fn draw_picture(
        &self,
        camera: &CameraBinding,
        encoder: &mut wgpu::CommandEncoder,
        textures: &wgpu::BindGroup,
        target: &Target<'_>,
    ) {
        self.draw(camera, &mut target.begin(encoder, BACKGROUND), &self.picture, textures);
    }
}
