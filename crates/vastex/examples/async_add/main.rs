//! A texture that comes while frames are drawn, from a source that takes a second for each answer: the thread
//! that draws neither reads it nor waits, and the picture stays as it is until the texture is there.
//!
//! `cargo run -p vastex --example async_add -- [picture.png]`

use std::sync::{Arc, mpsc};
use std::thread;
use std::time::Duration;

use vastex::{BindingPlace, Event, Settings, Textures, TileSource};

#[path = "../existing_renderer/main.rs"]
#[allow(dead_code, reason = "of the other example only what draws is used")]
pub(crate) mod existing_renderer;
pub(crate) mod slow;

use existing_renderer::common::headless::{Headless, write_png};
use existing_renderer::landscape::landscape;
use existing_renderer::{GroundRenderer, SKY};
use slow::Slow;

const PATIENCE_FRAMES: u64 = 20_000;

/// What came of it.
pub(crate) struct Shown {
    /// Frames from the beginning of the read until the texture is drawn.
    pub(crate) frames_meanwhile: u32,
    /// How many of them differ from the picture before.
    pub(crate) frames_changed: u32,
    /// The picture of the slow texture, as sharp as it gets.
    pub(crate) at_the_end: Vec<u8>,
    /// Times that the thread that draws has read from the source or polled it, and that all threads have.
    pub(crate) asked: (usize, usize),
}

#[expect(clippy::print_stdout, reason = "a program, and this is its result")]
pub(crate) fn main() -> anyhow::Result<()> {
    let output = std::env::args_os().nth(1).unwrap_or_else(|| "async_add.png".into());
    let size = [1280, 720];
    let shown = show(Arc::new(landscape()?), size)?;
    write_png(output.as_ref(), size, &shown.at_the_end)?;
    let (by_this_thread, by_all) = shown.asked;
    let Shown { frames_meanwhile, frames_changed, .. } = shown;
    println!("{}: {frames_changed} of {frames_meanwhile} frames changed while it was read", output.display());
    println!(
        "reads and polls of the slow source: {by_all}, {by_this_thread} of them by the thread that draws"
    );
    Ok(())
}

/// Shows the source, and then what a slow one makes of it.
pub(crate) fn show(source: Arc<dyn TileSource>, size: [u32; 2]) -> anyhow::Result<Shown> {
    let target = Headless::new(size)?;
    let (device, queue) = (&target.device, &target.queue);
    let settings = Settings { binding: BindingPlace { group: 1, first: 0 }, ..Settings::default() };
    let mut textures = Textures::new(device, queue, settings)?;
    let mut ground = textures.add_blocking(source.clone())?;
    let mut renderer = GroundRenderer::new(device, &textures, ground)?;
    renderer.look(queue, 1.0, size);

    let slow = Arc::new(Slow::new(source, Duration::from_secs(1)));
    let (preparer, (prepared, arrived)) = (textures.preparer(), mpsc::channel());
    let (mut before, mut is_slow) = (None, false);
    let (mut frames_meanwhile, mut frames_changed) = (0, 0);
    for _ in 0..PATIENCE_FRAMES {
        let mut encoder = device.create_command_encoder(&Default::default());
        textures.feedback(&mut encoder, size, |pass, groups| {
            renderer.draw(pass, &renderer.wanted, groups.get(ground));
        })?;
        // Nothing is sent to the GPU before the next update.
        let added =
            arrived.try_recv().ok().map(|prepared: Result<_, vastex::Error>| Ok(textures.add(prepared?)?));
        textures.update()?;
        let mut pass = target.begin(&mut encoder, SKY);
        renderer.draw(&mut pass, &renderer.picture, textures.bind_group(ground).ok());
        drop(pass);
        queue.submit([encoder.finish()]);
        if let Some(before) = before.as_ref().filter(|_| !is_slow) {
            frames_meanwhile += 1;
            frames_changed += u32::from(target.read()? != *before);
        }
        if let Some(added) = added {
            // Both are of the same kind and so of the same pipelines: from the next frame on this one is
            // drawn.
            (ground, is_slow) = (added.map_err(|error: vastex::Error| error)?, true);
            renderer.texture = textures.shader_id(ground)?;
            renderer.look(queue, 1.0, size);
            textures.view_mut(vastex::ViewId::MAIN)?.cut();
        }
        while let Some(event) = textures.poll_event() {
            match event {
                Event::Converged { .. } if is_slow => {
                    let asked = slow.times_asked(thread::current().id());
                    let at_the_end = target.read()?;
                    return Ok(Shown { frames_meanwhile, frames_changed, at_the_end, asked });
                }
                Event::Converged { .. } if before.is_none() => {
                    before = Some(target.read()?);
                    let (preparer, slow, prepared) = (preparer.clone(), slow.clone(), prepared.clone());
                    thread::spawn(move || prepared.send(pollster::block_on(preparer.read(slow))));
                }
                Event::Failed { page, why, .. } => anyhow::bail!("{page:?}: {why}"),
                _ => {}
            }
        }
    }
    anyhow::bail!("the view has not converged in {PATIENCE_FRAMES} frames: {:?}", textures.stats())
}
