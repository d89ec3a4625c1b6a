//! Plans that are drawn in the place of a scene, as some overlays are: one over the whole of each pane.

use vastex::{Error, Textures};

use super::SceneRenderer;
use crate::layers::ShownLayer;
use crate::picture::PicturePart;
use crate::surface::camera_binding::{CameraBinding, Placed};

impl SceneRenderer {
    /// A pipeline that draws a plan of a layer over the whole of a pane in the place of the scene; one more
    /// bind group, if any. Fails where its texture was removed.
    pub fn plan_pipeline(
        &self,
        textures: &Textures,
        shown: &ShownLayer,
        entry: &str,
        group: Option<&[wgpu::BindGroupLayoutEntry]>,
    ) -> Result<wgpu::RenderPipeline, Error> {
        self.maker.plan(textures, shown.layer, shown.color_map, (entry, group))
    }

    /// Tells a camera of [`SceneRenderer::new_camera`] what a plan of a layer is drawn by, in a picture of so
    /// many pixels.
    pub fn place_plan(
        &self,
        camera: &CameraBinding,
        queue: &wgpu::Queue,
        textures: &Textures,
        shown: &ShownLayer,
        picture: [u32; 2],
    ) {
        // What was removed has no id; shaders show what they show for any texture that is not there.
        let id = textures.shader_id(shown.layer).unwrap_or(u32::MAX);
        let panes = self.panes_in(picture);
        let pane = PicturePart::all([panes.width, picture[1]]);
        let placed = (&Placed::Mesh(glam::Mat4::IDENTITY), bytemuck::Zeroable::zeroed(), None, [f32::MAX; 2]);
        camera.set(queue, placed, [id; 3], &shown.color_map, (pane, pane, &panes, self.ground()));
    }

    /// Draws a plan in a pane, through a camera that was told of it. The bind group is that of the plan's
    /// layer.
    pub fn draw_plan(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        (camera, pane): (&CameraBinding, u32),
        pipeline: &wgpu::RenderPipeline,
        texture_group: &wgpu::BindGroup,
    ) {
        self.turn_to_pane(camera, pass, pane);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, texture_group, &[]);
        pass.set_bind_group(1, camera.group(), &[]);
        pass.draw(0..3, 0..1);
    }
}
