//! Frames of scenes and of volumes in lock-step: what each wanted, what the page table then leads to, and the
//! pictures.
//!
//! Which scenes, filters, formats and modes there are is said by lines in the words of `vastex render`.

use std::ffi::OsString;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};
use clap::Parser;
use vastex::diagnostics::{FrameStats, PageState};
use vastex::{Geometry, PageId, TextureNumber, Textures};
use vastex_core::PagePos;
use vastex_scenes::{Gpu, Offscreen, Overlay, Picture, Until, headless_gpu};

use super::{make, picture, text, write};
use crate::args::{Args, Command, RenderArgs, with_volume};
use crate::commands::render;
#[cfg(feature = "volumes")]
use crate::commands::render_volume::{self, Recorded};
use crate::{gpu, open};

pub(super) fn record(directory: &Path, cases: &Path) -> Result<()> {
    make(directory)?;
    let gpu = headless_gpu()?;
    gpu::report_refusals(&gpu);
    let cases = fs::read_to_string(cases).with_context(|| cases.display().to_string())?;
    for line in cases.lines() {
        let Some((name, words)) = line.split_once(' ') else { bail!("'{line}' has no words for a scene") };
        let words = ["vastex", "render"].into_iter().chain(words.split_whitespace());
        let mut args =
            Args::try_parse_from(with_volume(words.map(OsString::from).collect(), open::is_volume))?;
        args.follow_links().and_then(|()| args.check())?;
        let drawn = match args.command {
            Command::Render(mut args) => {
                open::pick_bands(&mut args.scene).and_then(|()| draw(directory, name, &args, &gpu))
            }
            #[cfg(feature = "volumes")]
            Command::RenderVolume(args) => render_volume::recorded(&args, &gpu).and_then(|recorded| {
                let Recorded { converged, picture, mut textures } = recorded;
                note(directory, name, (converged, &textures.stats()), &mut textures)?;
                pictured(directory, name, &picture)
            }),
            _ => bail!("'{line}' is no scene"),
        };
        drawn.with_context(|| line.to_owned())?;
    }
    Ok(())
}

/// Plays a scene to its end and writes all that can be seen of it.
fn draw(directory: &Path, name: &str, args: &RenderArgs, gpu: &Gpu) -> Result<()> {
    let (lowest, over) = (open::open(&args.scene)?.image, open::open_over(&args.scene)?);
    let mut offscreen = render::offscreen(args, render::frame_settings(args)?, gpu, (lowest, &over))?;
    args.estimate.estimating().into_iter().for_each(|estimating| offscreen.estimate(estimating));
    offscreen.textures_mut().ahead().trace().record();
    let until = args.frames.map_or(Until::Converged, Until::Frames);
    let outcome = offscreen.run(args.camera_path.built_in(), until, |_, _| ())?;
    note(directory, name, (outcome.converged, &outcome.stats), offscreen.textures_mut())?;
    pictured(directory, name, &offscreen.picture())?;
    match args.scene.overlay() {
        Some(_) => overlays(directory, name, &offscreen),
        None => Ok(()),
    }
}

/// Writes what frames came to, what each of them wanted, and what is in slots then.
fn note(
    directory: &Path,
    name: &str,
    (converged, stats): (bool, &FrameStats),
    textures: &mut Textures,
) -> Result<()> {
    let mut facts = format!("converged {converged}\n");
    for (what, count) in [
        ("frames", stats.frame),
        ("pool-bytes", stats.pool_bytes),
        ("table-bytes", stats.table_bytes),
        ("table-bytes-sent", stats.table_bytes_sent),
        ("feedback-bytes-read", stats.feedback_bytes_read),
        ("degenerate-pixels", stats.degenerate_pixels.into()),
        ("loaded", stats.pager.loaded),
        ("evicted", stats.pager.evicted),
        ("shared", stats.pager.shared),
        ("bias-eighths", stats.pager.bias_eighths.into()),
    ] {
        // Writing to a string cannot fail.
        let _ = writeln!(facts, "{what} {count}");
    }
    write(directory, &format!("{name}.facts.txt"), facts)?;
    if let Some(trace) = textures.ahead().trace().take()? {
        write(directory, &format!("{name}.feedback.txt"), text::of_trace(&trace))?;
    }
    write(directory, &format!("{name}.table.txt"), tables(textures))
}

fn pictured(directory: &Path, name: &str, picture: &Picture) -> Result<()> {
    write(directory, &format!("{name}.png"), picture::encode(picture)?)
}

/// Pictures of the feedback, the page table and the slots as the GPU has them, and all others.
fn overlays(directory: &Path, name: &str, offscreen: &Offscreen) -> Result<()> {
    for overlay in Overlay::ALL {
        let picture = picture::encode(&offscreen.overlay(overlay)?)?;
        write(directory, &format!("{name}.{}.png", overlay.name()), picture)?;
    }
    Ok(())
}

/// The pages of every texture that are in slots, and in which.
fn tables(textures: &Textures) -> String {
    let mut lines = String::new();
    for texture in textures.inspect().textures() {
        let Ok(shown) = textures.texture(texture) else { continue };
        let geometry = &shown.description().geometry;
        for page in geometry.pages().filter_map(|pos| page_id(texture.number(), geometry, pos)) {
            if let PageState::Resident(slot) = textures.inspect().state(page) {
                let page = text::of_page(page, geometry.dims());
                let _ = writeln!(lines, "{page} in slot {}", slot.index());
            }
        }
    }
    lines
}

fn page_id(texture: TextureNumber, geometry: &Geometry, pos: PagePos) -> Option<PageId> {
    PageId::new(texture, geometry.dims(), pos).ok()
}
