//! A renderer that uses all four of WebGPU's bind groups itself: view, light, material, object. Vastex's
//! bindings are merged into the material's, whose groups are kept and made anew when they must be; the
//! feedback pass is begun by the renderer, as a render graph does; depth is reversed, drawn before the
//! picture, and has four samples a pixel.
//!
//! All that is there for Vastex stands in this file and in `feedback.wgsl`.
//!
//! `cargo run --release -p vastex --example four_groups -- [picture.png]`

use std::sync::Arc;

use vastex::{
    BindingPlace, Event, Kinds, Pace, PoolSettings, Settings, TextureId, Textures, TileSource, ViewId,
};

pub(crate) mod chess;
#[allow(dead_code, clippy::duplicate_mod, reason = "of what the examples have in common each uses its part")]
#[path = "../common/mod.rs"]
pub(crate) mod common;
pub(crate) mod paint;
pub(crate) mod renderer;
pub(crate) mod setup;

use common::headless::{Headless, write_png};
use common::painted::Painted;
use renderer::{MATERIAL_GROUP, MATERIALS, OWN_BINDINGS, Renderer};
use setup::Drawing;

const PATIENCE_FRAMES: u64 = 2000;

/// What came of it.
pub(crate) struct Drawn {
    pub(crate) pixels: Vec<u8>,
    pub(crate) frames: u64,
    /// How many bind groups of materials were made.
    pub(crate) groups_made: usize,
    /// The highest number of a bind group that was set.
    pub(crate) highest_group: u32,
}

#[expect(clippy::print_stdout, reason = "a program, and this is its result")]
pub(crate) fn main() -> anyhow::Result<()> {
    let output = std::env::args_os().nth(1).unwrap_or_else(|| "four_groups.png".into());
    let size = [1280, 720];
    let sources = images([32_768, 16_384, 8192, 8192, 4096], 128)?
        .map(|image| -> Arc<dyn TileSource> { Arc::new(image) });
    let Drawn { pixels, frames, groups_made, highest_group } = draw(size, sources, |_, _| {})?;
    write_png(output.as_ref(), size, &pixels)?;
    println!("{} after {frames} frames", output.display());
    println!("{groups_made} bind groups made for {MATERIALS} materials; none is set above {highest_group}");
    Ok(())
}

/// The images of the materials, each of so many texels along an axis.
pub(crate) fn images(sides: [u32; MATERIALS], page: u32) -> anyhow::Result<[Painted; MATERIALS]> {
    let [table, board, white, black, lead] = sides;
    Ok([
        paint::image(paint::planks, table, page)?,
        paint::image(paint::board, board, page)?,
        paint::image(paint::white, white, page)?,
        paint::image(paint::black, black, page)?,
        paint::image(paint::lead, lead, page)?,
    ])
}

/// Draws until everything is as sharp as it gets. `look` sees the textures of the materials at the beginning
/// and after each update.
pub(crate) fn draw(
    size: [u32; 2],
    sources: [Arc<dyn TileSource>; MATERIALS],
    mut look: impl FnMut(&Textures, &[TextureId]),
) -> anyhow::Result<Drawn> {
    let target = Headless::new(size)?;
    let (device, queue) = (&target.device, &target.queue);
    anyhow::ensure!(device.limits() == wgpu::Limits::default(), "WebGPU's limits are enough");
    anyhow::ensure!(device.limits().max_bind_groups == 4, "of which none is left");

    // Vastex: its bindings lie in the material's group behind the renderer's own, and depth is as in the
    // renderer's passes.
    let settings = Settings {
        binding: BindingPlace { group: MATERIAL_GROUP, first: OWN_BINDINGS },
        reversed_depth: true,
        pools: PoolSettings::of_bytes(48 << 20),
        pace: Pace::LockStep { latency_frames: 1 },
        ..Settings::default()
    };
    let mut textures = Textures::new(device, queue, settings)?;
    let added: Result<Vec<TextureId>, _> =
        sources.into_iter().map(|source| textures.add_blocking(source)).collect();
    let ids = added?;
    let kinds = textures.kinds(ids[0])?;
    let mut shader_ids = [0; MATERIALS];
    for (id, shader_id) in ids.iter().zip(&mut shader_ids) {
        anyhow::ensure!(textures.kinds(*id)? == kinds, "they share their pipelines");
        *shader_id = textures.shader_id(*id)?;
    }
    let renderer = Renderer::new(
        &target,
        size,
        text(&textures, &kinds),
        &textures.bindings().layout_entries(&kinds),
        shader_ids,
    );
    // Its feedback pass has targets of its own, of one sample.
    let wanted = renderer.pipeline(
        device,
        &Drawing {
            fragment: Some(("want", Textures::FEEDBACK_FORMAT)),
            depth: Textures::FEEDBACK_DEPTH_FORMAT,
            compare: wgpu::CompareFunction::Greater,
            ..Drawing::depth_of("place_feedback", 1)
        },
    );
    let mut materials = Materials::new(&renderer, device, &textures, &ids)?;
    look(&textures, &ids);

    for frame in 1..=PATIENCE_FRAMES {
        let mut encoder = device.create_command_encoder(&Default::default());
        if frame == 1 {
            renderer.draw_shadows(&mut encoder);
        }
        // Vastex: a pass of the renderer's among its other passes.
        if let Some(begun) = textures.view_mut(ViewId::MAIN)?.begin_feedback(&mut encoder, size)? {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("feedback"),
                color_attachments: &[Some(begun.color_attachment())],
                depth_stencil_attachment: Some(begun.depth_attachment()),
                ..Default::default()
            });
            let [x, y, width, height] = begun.scissor();
            pass.set_scissor_rect(x, y, width, height);
            renderer.draw(&mut pass, &wanted, &materials.groups);
            drop(pass);
            textures.view_mut(ViewId::MAIN)?.end_feedback(&mut encoder)?;
        }
        textures.update()?;
        materials.follow(&renderer, device, &textures, &ids)?;
        look(&textures, &ids);

        renderer.draw_picture(&mut encoder, &target, &materials.groups);
        queue.submit([encoder.finish()]);
        while let Some(event) = textures.poll_event() {
            if let Event::Converged { .. } = event {
                let (groups_made, highest_group) = (materials.made, renderer.highest_group());
                return Ok(Drawn { pixels: target.read()?, frames: frame, groups_made, highest_group });
            }
        }
    }
    anyhow::bail!("the view has not converged in {PATIENCE_FRAMES} frames: {:?}", textures.stats())
}

/// The renderer's text, and Vastex's after it.
fn text(textures: &Textures, kinds: &Kinds) -> String {
    [include_str!("scene.wgsl"), include_str!("feedback.wgsl"), &textures.wgsl(kinds)].concat()
}

/// Vastex: the bind groups of materials, which are kept for as long as what they bind stays the same.
struct Materials {
    groups: Vec<wgpu::BindGroup>,
    /// Of each group that of its texture when it was made.
    revisions: Vec<u64>,
    made: usize,
}

impl Materials {
    fn new(
        renderer: &Renderer,
        device: &wgpu::Device,
        textures: &Textures,
        ids: &[TextureId],
    ) -> Result<Materials, vastex::Error> {
        let mut materials = Materials { groups: Vec::new(), revisions: Vec::new(), made: 0 };
        for (nth, id) in ids.iter().enumerate() {
            let entries = textures.bindings().entries(*id)?;
            materials.groups.push(renderer.material_group(device, nth, entries));
            materials.revisions.push(textures.bindings().revision(*id)?);
            materials.made += 1;
        }
        Ok(materials)
    }

    /// Makes those anew that bind something else since the last update.
    fn follow(
        &mut self,
        renderer: &Renderer,
        device: &wgpu::Device,
        textures: &Textures,
        ids: &[TextureId],
    ) -> Result<(), vastex::Error> {
        let bindings = textures.bindings();
        for (nth, id) in ids.iter().enumerate() {
            let revision = bindings.revision(*id)?;
            if self.revisions[nth] != revision {
                self.groups[nth] = renderer.material_group(device, nth, bindings.entries(*id)?);
                self.revisions[nth] = revision;
                self.made += 1;
            }
        }
        Ok(())
    }
}
