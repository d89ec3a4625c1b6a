//! Draws a scene: the picture, and the feedback pass that goes with it.
//!
//! The picture from an ordinary texture, to compare with, is `reference`'s business.

use glam::Vec4;
use vastex::{Error, Kinds, LayerId, Sampled, Textures, shader_module};

use super::camera_binding::CameraBinding;
use super::fixed;
use super::mesh::{Mesh, grid, surface};
use super::patches::QUADS;
use super::pipeline::{Corners, PipelineParts};
use super::relief::{Relief, ReliefSurface};
use super::shaders;
use super::tiling::Tiling;
use crate::camera::Pose;
use crate::layers::{ColorMap, background};
use crate::scene::Scene;
use crate::stage::{StageScene, Target, Uniform, filled_buffer, takes_light};

/// What is drawn.
#[derive(Clone, Debug)]
pub struct SceneDesc {
    /// The scene.
    pub scene: Scene,
    /// What is on it.
    pub layer: LayerId,
    /// How its values become colours.
    pub color_map: ColorMap,
    /// The heights that displace it; without any a terrain is flat.
    pub relief: Option<Relief>,
    /// How it lies on a surface without heights.
    pub tiling: Tiling,
    /// Whether an image or a globe is drawn in fixed point however small and far it is; else where a mesh would not be exact.
    pub always_fixed: bool,
}

/// The pipelines of fixed.wgsl, for a texture of `size` texels.
#[derive(Debug)]
struct FixedPipelines {
    picture: wgpu::RenderPipeline,
    wanted: wgpu::RenderPipeline,
    size: [u32; 2],
    is_always: bool,
}

/// A scene with one layer of a texture on it, ready to be drawn.
#[derive(Debug)]
pub struct SceneRenderer {
    scene: Scene,
    layer: LayerId,
    color_map: ColorMap,
    tiling: Tiling,
    relief: Option<ReliefSurface>,
    /// Width over height of the image.
    image: f64,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    index_count: u32,
    camera: CameraBinding,
    group_layout: wgpu::BindGroupLayout,
    picture: wgpu::RenderPipeline,
    wanted: wgpu::RenderPipeline,
    /// The image and the globe as every pixel works out what it sees.
    fixed: Option<FixedPipelines>,
    /// Texture space is one texture's, not a group's.
    spread: Option<wgpu::RenderPipeline>,
    /// What is sampled, and what a plan of the layer alone samples.
    kinds: Kinds,
    plan_kinds: Kinds,
    /// Every entry point that draws the scene.
    module: wgpu::ShaderModule,
    constants: Vec<(&'static str, f64)>,
    format: wgpu::TextureFormat,
}

impl SceneRenderer {
    /// Prepares a scene for pictures of `format`. Fails where its texture was removed.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        textures: &Textures,
        desc: SceneDesc,
        format: wgpu::TextureFormat,
    ) -> Result<SceneRenderer, Error> {
        let SceneDesc { scene, layer, color_map, relief, tiling, always_fixed } = desc;
        let [width, height, _] = textures.texture(layer.texture())?.description().geometry.size();
        let image = f64::from(width) / f64::from(height);
        let relief = relief.map(|relief| relief.surface(scene, image as f32));
        let mesh = if relief.is_some() { patch_mesh() } else { surface(scene, image as f32) };
        let vertices =
            filled_buffer(device, queue, bytemuck::cast_slice(&mesh.vertices), wgpu::BufferUsages::VERTEX);
        let indices =
            filled_buffer(device, queue, bytemuck::cast_slice(&mesh.indices), wgpu::BufferUsages::INDEX);
        let group_layout = Uniform::layout(device);
        let sampled = sampled(layer, relief.as_ref());
        let kinds = textures.kinds(sampled)?;
        let textures_layout = textures.bind_group_layout(&kinds);
        let groups = [Some(&textures_layout), Some(&group_layout)];
        let vastex = textures.wgsl(&kinds);
        let text = if relief.is_some() { shaders::relief(&vastex) } else { shaders::flat(&vastex) };
        let module = shader_module(device, Some("scene"), text);
        let constants = constants(scene, color_map, format, tiling, relief.as_ref());
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
        let has_fixed =
            relief.is_none() && tiling == Tiling::default() && matches!(scene, Scene::Image | Scene::Globe);
        let fixed = has_fixed.then(|| FixedPipelines {
            picture: parts(["place_fixed", "shade_fixed"], &formats).screen(device, &groups),
            wanted: parts(["place_fixed_feedback", "want_fixed"], &feedback).screen(device, &groups),
            size: [width, height],
            is_always: always_fixed,
        });
        let spread = relief.is_none().then(|| {
            let spread = parts(["spread", "need"], &[Textures::TEXTURE_SPACE_FORMAT]);
            spread.blended(device, &groups, Textures::TEXTURE_SPACE_BLEND)
        });
        Ok(SceneRenderer {
            scene,
            layer,
            color_map,
            tiling,
            image,
            vertices,
            indices,
            index_count: mesh.indices.len() as u32,
            camera: CameraBinding::new(device, &group_layout, relief.is_some()),
            picture: picture.pipeline(device, &groups),
            wanted: wanted.pipeline(device, &groups),
            fixed,
            spread,
            constants,
            module,
            relief,
            group_layout,
            format,
            plan_kinds: textures.kinds(layer)?,
            kinds,
        })
    }

    /// The scene.
    pub fn scene(&self) -> Scene {
        self.scene
    }

    /// What is drawn where no surface is, in the values of its pictures.
    pub fn background(&self) -> Vec4 {
        background(takes_light(self.format))
    }

    /// Width over height of the image.
    pub fn image_aspect(&self) -> f64 {
        self.image
    }

    /// Where the camera is in the frame that is about to be drawn, and how many pixels the picture has. Over heights it is as far
    /// above the ground as the pose says, as far as `textures` know the ground.
    pub fn set_pose(&self, queue: &wgpu::Queue, textures: &Textures, pose: &Pose, picture: [u32; 2]) {
        self.place(&self.camera, queue, textures, pose, picture);
    }

    /// A camera to draw the scene through from another place in the same encoder.
    pub fn new_camera(&self, device: &wgpu::Device) -> CameraBinding {
        CameraBinding::new(device, &self.group_layout, self.relief.is_some())
    }

    /// Draws the level that each part of the texture needs, into a pass of [`vastex::Ahead::texture_space`]; nothing where heights
    /// displace the scene.
    pub fn draw_spread(&self, pass: &mut wgpu::RenderPass<'_>, texture_group: &wgpu::BindGroup) {
        if let Some(spread) = &self.spread {
            self.draw(pass, spread, texture_group);
        }
    }

    /// What the scene's own camera sees it through.
    pub fn camera(&self) -> &CameraBinding {
        &self.camera
    }

    /// Draws by a pipeline of the scene, through its own camera.
    pub fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        texture_group: &wgpu::BindGroup,
    ) {
        self.draw_through(&self.camera, pass, pipeline, texture_group);
    }

    /// Sets everything that all pipelines of the scene share, and draws.
    fn draw_through(
        &self,
        camera: &CameraBinding,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        texture_group: &wgpu::BindGroup,
    ) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, texture_group, &[]);
        pass.set_bind_group(1, camera.group(), &[]);
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        let (corners, instances) = match self.relief {
            None => (&self.vertices, 1),
            Some(_) => (&camera.patches, camera.patch_count()),
        };
        pass.set_vertex_buffer(0, corners.slice(..));
        pass.draw_indexed(0..self.index_count, 0, 0..instances);
    }

    /// A pipeline that draws the same surface by other entry points: one more bind group, its targets.
    pub fn other_pipeline(
        &self,
        device: &wgpu::Device,
        textures: &Textures,
        entries: [&'static str; 2],
        group: Option<&wgpu::BindGroupLayout>,
        formats: &[wgpu::TextureFormat],
    ) -> wgpu::RenderPipeline {
        let textures_layout = textures.bind_group_layout(&self.kinds);
        let mut groups = vec![Some(&textures_layout), Some(&self.group_layout)];
        groups.extend(group.map(Some));
        let corners = corners(self.scene, self.relief.as_ref());
        let (module, constants) = (&self.module, &self.constants);
        PipelineParts { module, constants, corners, entries, formats }.pipeline(device, &groups)
    }

    /// The entry point of what places the surface in a picture.
    pub fn vertex_entry(&self) -> &'static str {
        if self.relief.is_some() { "place_relief" } else { "place" }
    }

    /// A pipeline that draws the scene in fixed point by another entry point; nothing for a scene that is not drawn so.
    pub fn fixed_pipeline(
        &self,
        device: &wgpu::Device,
        textures: &Textures,
        entry: &'static str,
        format: wgpu::TextureFormat,
    ) -> Option<wgpu::RenderPipeline> {
        self.fixed.as_ref()?;
        let textures_layout = textures.bind_group_layout(&self.kinds);
        let groups = [Some(&textures_layout), Some(&self.group_layout)];
        let (module, constants, corners) = (&self.module, &self.constants, Corners::Vertices);
        let entries = ["place_fixed", entry];
        Some(PipelineParts { module, constants, corners, entries, formats: &[format] }.plan(device, &groups))
    }

    /// Draws by a pipeline of [`SceneRenderer::fixed_pipeline`], through its own camera.
    pub fn draw_fixed(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        texture_group: &wgpu::BindGroup,
    ) {
        draw_fixed(&self.camera, pass, pipeline, texture_group);
    }

    /// The texel that the scene is told from in fixed point at a pose; nothing where a mesh is exact enough.
    pub fn anchor(&self, pose: &Pose, picture: [u32; 2]) -> Option<[u32; 2]> {
        Some(self.fixed_uniform(pose, picture)?.anchor())
    }

    fn fixed_uniform(&self, pose: &Pose, picture: [u32; 2]) -> Option<fixed::FixedUniform> {
        let fixed = self.fixed.as_ref()?;
        let is_drawn = fixed.is_always || fixed::is_needed(pose, fixed.size, picture);
        is_drawn.then(|| fixed::uniform(pose, fixed.size, picture)).flatten()
    }

    /// Whether heights displace the scene.
    pub fn has_relief(&self) -> bool {
        self.relief.is_some()
    }

    /// A pipeline that draws a plan over the whole picture in the place of the scene; one more bind group, if any.
    pub fn plan_pipeline(
        &self,
        device: &wgpu::Device,
        textures: &Textures,
        entries: [&'static str; 2],
        group: Option<&wgpu::BindGroupLayout>,
    ) -> wgpu::RenderPipeline {
        let textures_layout = textures.bind_group_layout(&self.plan_kinds);
        let mut groups = vec![Some(&textures_layout), Some(&self.group_layout)];
        groups.extend(group.map(Some));
        // A plan is of a texture, not of the group that a scene with heights samples.
        let flat = || shader_module(device, Some("plan"), shaders::flat(&textures.wgsl(&self.plan_kinds)));
        let module = if self.relief.is_some() { &flat() } else { &self.module };
        let constants = &constants(self.scene, self.color_map, self.format, self.tiling, None);
        let corners = Corners::Vertices;
        PipelineParts { module, constants, corners, entries, formats: &[self.format] }.plan(device, &groups)
    }

    /// Draws a plan.
    pub fn draw_plan(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        texture_group: &wgpu::BindGroup,
    ) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, texture_group, &[]);
        pass.set_bind_group(1, self.camera.group(), &[]);
        pass.draw(0..3, 0..1);
    }

    /// The format of its pictures.
    pub fn format(&self) -> wgpu::TextureFormat {
        self.format
    }

    /// What is on the scene.
    pub fn layer(&self) -> LayerId {
        self.layer
    }

    /// How its values become colours.
    pub fn color_map(&self) -> ColorMap {
        self.color_map
    }
}

fn draw_fixed(
    camera: &CameraBinding,
    pass: &mut wgpu::RenderPass<'_>,
    pipeline: &wgpu::RenderPipeline,
    textures: &wgpu::BindGroup,
) {
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, textures, &[]);
    pass.set_bind_group(1, camera.group(), &[]);
    pass.draw(0..3, 0..1);
}

impl StageScene for SceneRenderer {
    type Pose = Pose;
    type Camera = CameraBinding;

    fn sampled(&self) -> Sampled {
        sampled(self.layer, self.relief.as_ref())
    }

    fn place(
        &self,
        camera: &CameraBinding,
        queue: &wgpu::Queue,
        textures: &Textures,
        pose: &Pose,
        picture: [u32; 2],
    ) {
        let [width, height] = picture.map(|side| side as f32);
        let seen = self.relief.as_ref().map(|relief| relief.seen_from(textures, pose, picture));
        let level = || pose.clip_from_world(f64::from(width) / f64::from(height), self.image);
        let matrix = seen.as_ref().map_or_else(level, |seen| seen.clip_from_world);
        // What was removed has no id; shaders are told of what is not there, and say so.
        let ids = match textures.bindings().ids(self.sampled()).unwrap_or_default()[..] {
            [all, color, height] => [all, color, height],
            _ => [textures.shader_id(self.layer).unwrap_or(0); 3],
        };
        let fixed = self.fixed_uniform(pose, picture);
        camera.set(queue, matrix, ids, &self.color_map, [width, height], (seen.as_ref(), fixed));
    }

    fn draw_wanted(
        &self,
        camera: &CameraBinding,
        pass: &mut wgpu::RenderPass<'_>,
        textures: &wgpu::BindGroup,
    ) {
        match self.fixed.as_ref().filter(|_| camera.is_fixed()) {
            Some(fixed) => draw_fixed(camera, pass, &fixed.wanted, textures),
            None => self.draw_through(camera, pass, &self.wanted, textures),
        }
    }

    fn draw_picture(
        &self,
        camera: &CameraBinding,
        encoder: &mut wgpu::CommandEncoder,
        textures: &wgpu::BindGroup,
        target: &Target<'_>,
    ) {
        let mut pass = target.begin(encoder, self.background());
        match self.fixed.as_ref().filter(|_| camera.is_fixed()) {
            Some(fixed) => draw_fixed(camera, &mut pass, &fixed.picture, textures),
            None => self.draw_through(camera, &mut pass, &self.picture, textures),
        }
    }
}

fn sampled(layer: LayerId, relief: Option<&ReliefSurface>) -> Sampled {
    relief.map_or(layer.into(), |relief| relief.group().into())
}

/// What the pipelines of a scene are made with.
fn constants(
    scene: Scene,
    color_map: ColorMap,
    format: wgpu::TextureFormat,
    tiling: Tiling,
    relief: Option<&ReliefSurface>,
) -> Vec<(&'static str, f64)> {
    let of_relief = relief.map(ReliefSurface::constants).into_iter().flatten();
    let fixed = relief.is_none().then_some(("FIXED_GLOBE", f64::from(u8::from(scene == Scene::Globe))));
    let of_map = color_map.constants(takes_light(format)).into_iter();
    of_map.chain(tiling.constants()).chain(of_relief).chain(fixed).collect()
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
