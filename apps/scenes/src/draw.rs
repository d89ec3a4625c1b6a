//! Draws a scene: the picture, and the feedback pass that goes with it.
//!
//! The picture from an ordinary texture, to compare with, is `reference`'s business.

use glam::Vec4;
use vastex::{LayerId, Sampled, Textures, shader_module};

use crate::eye::Eye;
use crate::look::Look;
use crate::patches::QUADS;
use crate::pipeline::{Corners, DEPTH, PipelineParts};
use crate::pose::Pose;
use crate::relief::{Relief, ReliefSurface};
use crate::scene::{Mesh, Scene, grid, surface};
use crate::shaders;
use crate::tiling::Tiling;
use crate::uniform::Uniform;

/// What is seen beside the texture.
pub(crate) const BACKGROUND: Vec4 = Vec4::new(0.008, 0.01, 0.014, 1.0);

/// What is drawn.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// The scene.
    pub scene: Scene,
    /// What is on it.
    pub layer: LayerId,
    /// How its values become colours.
    pub look: Look,
    /// The heights that displace it; without any a terrain is flat.
    pub relief: Option<Relief>,
    /// How it lies on a surface without heights.
    pub tiling: Tiling,
}

/// A scene with one layer of a texture on it, ready to be drawn.
#[derive(Debug)]
pub struct SceneRenderer {
    scene: Scene,
    layer: LayerId,
    look: Look,
    tiling: Tiling,
    relief: Option<ReliefSurface>,
    /// Width over height of the image.
    image: f32,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    index_count: u32,
    eye: Eye,
    group_layout: wgpu::BindGroupLayout,
    picture: wgpu::RenderPipeline,
    wanted: wgpu::RenderPipeline,
    /// Texture space is one texture's, not a group's.
    spread: Option<wgpu::RenderPipeline>,
    /// Every entry point that draws the scene.
    module: wgpu::ShaderModule,
    constants: Vec<(&'static str, f64)>,
    format: wgpu::TextureFormat,
}

impl SceneRenderer {
    /// Prepares a scene for pictures of `format`.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        textures: &Textures,
        drawn: Drawn,
        format: wgpu::TextureFormat,
    ) -> SceneRenderer {
        let Drawn { scene, layer, look, relief, tiling } = drawn;
        let [width, height, _] = textures.description(layer.texture()).geometry.size();
        let image = width as f32 / height as f32;
        let relief = relief.map(|relief| relief.surface(scene, image));
        let mesh = if relief.is_some() { patch_mesh() } else { surface(scene, image) };
        let vertices =
            filled_buffer(device, queue, bytemuck::cast_slice(&mesh.vertices), wgpu::BufferUsages::VERTEX);
        let indices =
            filled_buffer(device, queue, bytemuck::cast_slice(&mesh.indices), wgpu::BufferUsages::INDEX);
        let group_layout = Uniform::layout(device);
        let sampled = sampled(layer, relief.as_ref());
        let groups = [Some(textures.bind_group_layout(sampled)), Some(&group_layout)];
        let vastex = textures.wgsl(sampled);
        let text = if relief.is_some() { shaders::relief(&vastex) } else { shaders::flat(&vastex) };
        let module = shader_module(device, Some("scene"), text);
        let constants = constants(look, tiling, relief.as_ref());
        let parts = |entries, formats| PipelineParts {
            module: &module,
            constants: &constants,
            corners: corners(scene, relief.as_ref()),
            entries,
            formats,
        };
        let (formats, feedback) = ([format], [Textures::FEEDBACK_FORMAT]);
        let [picture, wanted] = match &relief {
            None => [parts(["place", "shade"], &formats), parts(["place_feedback", "want"], &feedback)],
            Some(_) => [
                parts(["place_relief", "shade_relief"], &formats),
                parts(["place_relief_feedback", "want_relief"], &feedback),
            ],
        };
        let spread = relief.is_none().then(|| {
            let spread = parts(["spread", "need"], &[Textures::TEXTURE_SPACE_FORMAT]);
            spread.blended(device, &groups, Textures::TEXTURE_SPACE_BLEND)
        });
        SceneRenderer {
            scene,
            layer,
            look,
            tiling,
            image,
            vertices,
            indices,
            index_count: mesh.indices.len() as u32,
            eye: Eye::new(device, &group_layout, relief.is_some()),
            picture: picture.pipeline(device, &groups),
            wanted: wanted.pipeline(device, &groups),
            spread,
            constants,
            module,
            relief,
            group_layout,
            format,
        }
    }

    /// The scene.
    pub fn scene(&self) -> Scene {
        self.scene
    }

    /// What is drawn where no surface is, in the values of its pictures.
    pub(crate) fn background(&self) -> Vec4 {
        self.look.background()
    }

    /// Width over height of the image.
    pub fn image_aspect(&self) -> f32 {
        self.image
    }

    /// What its pipelines sample, and so whose bind group they are drawn with.
    pub fn sampled(&self) -> Sampled {
        sampled(self.layer, self.relief.as_ref())
    }

    /// Where the camera is in the frame that is about to be drawn, and how many pixels the picture has. Over heights it is as far
    /// above the ground as the pose says, as far as `textures` know the ground.
    pub fn set_pose(&self, queue: &wgpu::Queue, textures: &Textures, pose: &Pose, picture: [u32; 2]) {
        self.set_pose_of(&self.eye, queue, textures, pose, picture);
    }

    /// An eye to draw the scene through from another place in the same encoder.
    pub fn new_eye(&self, device: &wgpu::Device) -> Eye {
        Eye::new(device, &self.group_layout, self.relief.is_some())
    }

    /// Where another eye is in the frame that is about to be drawn.
    pub fn set_pose_of(
        &self,
        eye: &Eye,
        queue: &wgpu::Queue,
        textures: &Textures,
        pose: &Pose,
        picture: [u32; 2],
    ) {
        let [width, height] = picture.map(|side| side as f32);
        let seen = self.relief.as_ref().map(|relief| relief.seen_from(textures, pose, picture));
        let level = || pose.clip_from_world(width / height, self.image);
        let matrix = seen.as_ref().map_or_else(level, |seen| seen.clip_from_world);
        eye.set(queue, matrix, &self.look, [width, height], seen.as_ref());
    }

    /// Draws what the scene wants, into a pass of [`Textures::feedback`].
    pub fn draw_wanted(&self, pass: &mut wgpu::RenderPass<'_>, texture_group: &wgpu::BindGroup) {
        self.draw_wanted_of(&self.eye, pass, texture_group);
    }

    /// Draws what another eye wants, into a pass of [`Textures::feedback_of`].
    pub fn draw_wanted_of(
        &self,
        eye: &Eye,
        pass: &mut wgpu::RenderPass<'_>,
        texture_group: &wgpu::BindGroup,
    ) {
        self.draw_through(eye, pass, &self.wanted, texture_group);
    }

    /// Draws the level that each part of the texture needs, into a pass of [`Textures::texture_space`]; nothing where heights
    /// displace the scene.
    pub fn draw_spread(&self, pass: &mut wgpu::RenderPass<'_>, texture_group: &wgpu::BindGroup) {
        if let Some(spread) = &self.spread {
            self.draw(pass, spread, texture_group);
        }
    }

    /// Draws the picture.
    pub fn draw_picture(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        textures: &Textures,
        target: &PictureTarget<'_>,
    ) {
        self.draw_picture_of(&self.eye, encoder, textures.bind_group(self.sampled()), target);
    }

    /// Draws the picture that another eye sees, with the bind group of its view; in [`Textures::main_pass_of`] it says what it wants.
    pub fn draw_picture_of(
        &self,
        eye: &Eye,
        encoder: &mut wgpu::CommandEncoder,
        texture_group: &wgpu::BindGroup,
        target: &PictureTarget<'_>,
    ) {
        self.draw_through(eye, &mut target.begin(encoder, self.background()), &self.picture, texture_group);
    }

    /// What the scene's own camera sees it through.
    pub fn eye(&self) -> &Eye {
        &self.eye
    }

    /// Draws by a pipeline of the scene, through its own eye.
    pub(crate) fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        texture_group: &wgpu::BindGroup,
    ) {
        self.draw_through(&self.eye, pass, pipeline, texture_group);
    }

    /// Sets everything that all pipelines of the scene share, and draws.
    fn draw_through(
        &self,
        eye: &Eye,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        texture_group: &wgpu::BindGroup,
    ) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, texture_group, &[]);
        pass.set_bind_group(1, eye.group(), &[]);
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        let (corners, instances) = match self.relief {
            None => (&self.vertices, 1),
            Some(_) => (&eye.patches, eye.patch_count()),
        };
        pass.set_vertex_buffer(0, corners.slice(..));
        pass.draw_indexed(0..self.index_count, 0, 0..instances);
    }

    /// A pipeline that draws the same surface by other entry points: one more bind group, its targets.
    pub(crate) fn other_pipeline(
        &self,
        device: &wgpu::Device,
        textures: &Textures,
        entries: [&'static str; 2],
        group: Option<&wgpu::BindGroupLayout>,
        formats: &[wgpu::TextureFormat],
    ) -> wgpu::RenderPipeline {
        let mut groups = vec![Some(textures.bind_group_layout(self.sampled())), Some(&self.group_layout)];
        groups.extend(group.map(Some));
        let corners = corners(self.scene, self.relief.as_ref());
        let (module, constants) = (&self.module, &self.constants);
        PipelineParts { module, constants, corners, entries, formats }.pipeline(device, &groups)
    }

    /// The entry point of what places the surface in a picture.
    pub(crate) fn vertex_entry(&self) -> &'static str {
        if self.relief.is_some() { "place_relief" } else { "place" }
    }

    /// Whether heights displace the scene.
    pub fn has_relief(&self) -> bool {
        self.relief.is_some()
    }

    /// A pipeline that draws a plan over the whole picture in the place of the scene; one more bind group, if any.
    pub(crate) fn plan_pipeline(
        &self,
        device: &wgpu::Device,
        textures: &Textures,
        entries: [&'static str; 2],
        group: Option<&wgpu::BindGroupLayout>,
    ) -> wgpu::RenderPipeline {
        let mut groups = vec![Some(textures.bind_group_layout(self.layer)), Some(&self.group_layout)];
        groups.extend(group.map(Some));
        // A plan is of a texture, not of the group that a scene with heights samples.
        let flat = || shader_module(device, Some("plan"), shaders::flat(&textures.wgsl(self.layer)));
        let module = if self.relief.is_some() { &flat() } else { &self.module };
        let constants = &constants(self.look, self.tiling, None);
        let corners = Corners::Vertices;
        PipelineParts { module, constants, corners, entries, formats: &[self.format] }.plan(device, &groups)
    }

    /// Draws a plan.
    pub(crate) fn draw_plan(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        texture_group: &wgpu::BindGroup,
    ) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, texture_group, &[]);
        pass.set_bind_group(1, self.eye.group(), &[]);
        pass.draw(0..3, 0..1);
    }

    /// The format of its pictures.
    pub(crate) fn format(&self) -> wgpu::TextureFormat {
        self.format
    }

    /// What is on the scene.
    pub fn layer(&self) -> LayerId {
        self.layer
    }

    /// How its values become colours.
    pub(crate) fn look(&self) -> Look {
        self.look
    }
}

/// Where a picture goes.
#[derive(Clone, Copy, Debug)]
pub struct PictureTarget<'a> {
    /// Its colours, in the format that the renderer was made for.
    pub colour: &'a wgpu::TextureView,
    /// A depth buffer of the same size.
    pub depth: &'a wgpu::TextureView,
}

impl PictureTarget<'_> {
    /// A pass that begins with the background, its alpha 0, which says "not covered".
    pub(crate) fn begin<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        background: Vec4,
    ) -> wgpu::RenderPass<'e> {
        let [r, g, b, _] = background.as_dvec4().to_array();
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("scene picture"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: self.colour,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 0.0 }),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        })
    }
}

pub(crate) fn filled_buffer(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    bytes: &[u8],
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("scene surface"),
        size: bytes.len() as u64,
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    queue.write_buffer(&buffer, 0, bytes);
    buffer
}

/// A depth buffer for pictures of a size.
pub fn depth_view(device: &wgpu::Device, size: [u32; 2]) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("scene depth"),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: DEPTH,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

fn sampled(layer: LayerId, relief: Option<&ReliefSurface>) -> Sampled {
    relief.map_or(layer.into(), |relief| relief.group().into())
}

/// What the pipelines of a scene are made with.
fn constants(look: Look, tiling: Tiling, relief: Option<&ReliefSurface>) -> Vec<(&'static str, f64)> {
    let of_relief = relief.map(ReliefSurface::constants).into_iter().flatten();
    look.constants().into_iter().chain(tiling.constants()).chain(of_relief).collect()
}

/// The quads of a patch; where its corners are, the vertex stage knows by their numbers.
fn patch_mesh() -> Mesh {
    let Mesh { indices, .. } = grid([QUADS; 2], |uv| uv.extend(0.0));
    Mesh { vertices: Vec::new(), indices }
}

fn corners(scene: Scene, relief: Option<&ReliefSurface>) -> Corners {
    match (relief, scene) {
        (Some(_), _) => Corners::Patches,
        (None, Scene::Globe) => Corners::Outside,
        (None, Scene::Image | Scene::Plane | Scene::Terrain) => Corners::Vertices,
    }
}
