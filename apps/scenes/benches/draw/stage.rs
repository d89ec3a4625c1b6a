//! A scene with a generated texture, drawn frame by frame with or without feedback.

use std::sync::Arc;
use std::time::Duration;

use anyhow::Result;
use vastex::{BindGroups, Geometry, GeometrySpec, Pace, Settings, TableChoice, TextureSettings, Textures};
use vastex_scenes::{Layers, Pose, Scene, SceneDesc, SceneRenderer, ShownLayer, depth_view};
use vastex_tiles::PropertySource;
use vastex_viewer::Target;
use vastex_viewer::stage::{StageScene, draw_again};

use crate::world::Bench;

pub(crate) struct Stage<'a> {
    bench: &'a Bench,
    size: [u32; 2],
    pub(crate) textures: Textures,
    renderer: SceneRenderer,
    colour: wgpu::TextureView,
    depth: wgpu::TextureView,
}

impl<'a> Stage<'a> {
    pub(crate) fn new(
        bench: &'a Bench,
        size: [u32; 2],
        scene: Scene,
        settings: Settings,
        shape: GeometrySpec,
        page_table: TableChoice,
    ) -> Result<Stage<'a>> {
        let (device, queue) = (&bench.gpu.device, &bench.gpu.queue);
        let settings = Settings { pace: Pace::LockStep { latency_frames: 1 }, ..settings };
        let mut textures = Textures::new(device, queue, settings)?;
        let source = PropertySource::new(Geometry::new(shape)?);
        let settings = TextureSettings { page_table, ..Default::default() };
        let prepared = textures.preparer().read_blocking(Arc::new(source), settings)?;
        let texture = textures.add(prepared)?;
        let shown = ShownLayer::new(texture.into(), &textures.texture(texture)?.description().layers[0]);
        let format = shown.color_map.picture_format();
        let drawn = SceneDesc {
            scene,
            layers: Layers::one(shown),
            relief: None,
            tiling: Default::default(),
            always_fixed: false,
            light: Default::default(),
        };
        let renderer = SceneRenderer::new(&bench.gpu, &textures, drawn, format)?;
        let colour = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let (colour, depth) = (colour.create_view(&Default::default()), depth_view(device, size));
        Ok(Stage { bench, size, textures, renderer, colour, depth })
    }

    pub(crate) fn set_pose(&self, pose: &Pose) {
        self.renderer.set_pose(&self.bench.gpu.queue, &self.textures, pose, self.size);
    }

    /// Plays a frame; gives what the GPU takes for the picture and, if there is any, its feedback.
    pub(crate) fn draw(&mut self, with_feedback: bool) -> Result<Duration> {
        let Stage { renderer, colour, depth, textures, bench, size } = self;
        let (gpu, sampled) = (&bench.gpu, renderer.sampled());
        textures.update()?;
        gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        let target = Target::new(colour, depth, None);
        let mut result = Ok(());
        let taken = bench.clock.time(gpu, |encoder| {
            if !with_feedback {
                return draw_again(encoder, textures, renderer, renderer.camera(), &target);
            }
            let picture = |encoder: &mut wgpu::CommandEncoder, groups: &BindGroups| {
                if let Some(group) = groups.get(sampled) {
                    renderer.draw_picture(renderer.camera(), encoder, group, &target);
                }
            };
            let wanted = textures.feedback(encoder, *size, |pass, groups| {
                if let Some(group) = groups.get(sampled) {
                    renderer.draw_wanted(renderer.camera(), pass, group);
                }
            });
            result = wanted.and_then(|()| textures.main_pass(encoder, *size, picture));
        });
        result?;
        Ok(taken)
    }
}
