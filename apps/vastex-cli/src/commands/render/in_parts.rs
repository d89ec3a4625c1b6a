//! Pictures that are larger than any texture of the device: drawn in parts, which are put together row by
//! row. Of a run that plays a path only its pictures are drawn, each once everything in it is loaded.

use anyhow::{Result, bail};
use vastex::Settings;
use vastex_scenes::{Gpu, Offscreen, Outcome, Scene, SceneImage, Views};

use super::{Motion, Summary, Troubles, frame_settings, name_textures, print_summary};
use crate::args::RenderArgs;
use crate::parts::{self, MOST_SIDE, Parts, Totals};
use crate::pictures::PictureOutput;
use crate::{open, report};

/// Pixels a side that are drawn at once, where a picture has to be drawn in parts.
pub(super) fn most_side(args: &RenderArgs, gpu: &Gpu) -> Option<u32> {
    let limit = gpu.device.limits().max_texture_dimension_2d;
    let most = args.scene.part_side.map_or(limit, |side| side.min(limit));
    args.scene.size().iter().any(|side| *side > most).then_some(most.min(MOST_SIDE))
}

/// Fails where something is asked for that is of a picture that is drawn at once.
fn check(args: &RenderArgs) -> Result<()> {
    let is_asked = [
        ("--compare", args.compare),
        ("--explain", args.explain.is_some()),
        ("--report", args.report.is_some()),
        ("--estimate", args.estimate.estimating().is_some()),
        ("--views", args.views != Views::One),
        ("--predict", args.predict),
        ("--record-trace", args.files.record_trace.is_some()),
        ("--prefetch-sets", args.prefetch_sets.is_some()),
        ("--stats-csv", args.files.stats_csv.is_some()),
        ("--stats-json", args.files.stats_json.is_some()),
        ("--dump-pools", args.dump_pools),
    ];
    if let Some((option, _)) = is_asked.iter().find(|(_, is_asked)| *is_asked) {
        let [width, height] = args.scene.size();
        bail!(
            "{option} is of a picture that is drawn at once, and one of {width}x{height} pixels is drawn in parts; leave it out, or choose a \
             smaller --size"
        );
    }
    parts::check_overlay(args.scene.overlay())
}

/// Draws the last picture of a path or, where they are wanted, all of them, with at most so many pixels a
/// side at once, and tells how that went.
pub(super) fn run(
    args: &RenderArgs,
    (motion, scene): (&Motion, Scene),
    gpu: &Gpu,
    images: (SceneImage, &[SceneImage]),
    (pictures, most): (&mut PictureOutput, u32),
) -> Result<Outcome> {
    check(args)?;
    let (shown, size) = (open::shown(&args.scene), args.scene.size());
    let has_clouds = scene == Scene::Planet && shown.planet.clouds.is_some();
    let parts = Parts::new(size, parts::panes(&shown, 1 + images.1.len()), most, has_clouds);
    let drawn = parts.drawn_size();
    let settings = Settings { picture: drawn, ..frame_settings(args)? };
    let mut offscreen = Offscreen::showing_together(&shown, gpu, images, scene, drawn, settings)?;
    name_textures(args, &mut offscreen)?;
    let frames = match (pictures.is_sequence(), args.frames) {
        // Beyond its end a path holds its last place.
        (true, Some(frames)) => 0..frames,
        (true, None) => 0..motion.frames(),
        // Where the path ends, or after so many frames of it.
        (false, frames) => {
            let last = frames.unwrap_or(motion.frames()).min(motion.frames()).saturating_sub(1);
            last..last + 1
        }
    };
    let mut troubles = Troubles::default();
    let mut totals = Totals::new(offscreen.textures().stats());
    for frame in frames {
        let pose = motion.poses(args, &offscreen)(frame);
        let mut rows = pictures.rows(frame, size)?;
        let mut is_read = std::ops::ControlFlow::Continue(());
        let drawn = parts::draw(
            &mut offscreen,
            (&pose, &parts, args.scene.overlay()),
            &mut troubles,
            |_, _, row| {
                is_read = rows.add(&row)?;
                Ok(is_read)
            },
        )?;
        totals.follow(drawn);
        if is_read.is_break() {
            break;
        }
        rows.finish()?;
    }
    let source = args.scene.source.display().to_string();
    troubles.texts(&source, offscreen.textures()).iter().for_each(|said| report::say(said));
    let outcome = totals.outcome();
    let mut summary = Summary::new(outcome, totals.share_at_wanted_level(), gpu.adapter_name(), None);
    summary.parts = Some(totals.parts());
    print_summary(args, &summary)?;
    Ok(outcome.clone())
}
