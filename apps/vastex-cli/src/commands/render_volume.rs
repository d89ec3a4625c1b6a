//! `vastex render --on volume` and `--on slices`: a picture of a volume without a window.
//!
//! What is drawn is the viewer's business (`vastex_viewer::volume`), what is read `vastex-volume`'s. Here
//! channels are chosen and frames played until everything in view is loaded.

mod along;
mod asked;
#[cfg(feature = "record")]
mod recorded;
mod reference;
mod steps;
mod summary;
mod times;
mod watch;

use std::process::ExitCode;
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use pollster::block_on;
use vastex::wgpu::{self, PollType, TextureFormat};
use vastex::{Event, Filter, LevelRule, Settings, Textures, ViewId};
use vastex_scenes::{Gpu, Picture, headless_gpu};
use vastex_tiles::DiskTier;
use vastex_viewer::stage::{Canvas, Frame, Pictures, StageView, TargetKind, TextureRead};
use vastex_viewer::volume::{
    QUIET_FRAMES, VolumeBox, VolumeChannel, VolumeClip, VolumeDesc, VolumeRenderer, VolumeView,
    drawable_range, usual_channel_color,
};
use vastex_volume::{Volume, VolumeAbout, VolumeOptions, VolumeSource};

#[cfg(feature = "record")]
pub(crate) use self::recorded::{Recorded, recorded};
use self::summary::Summary;
use self::times::AtTime;
use self::watch::Watch;
use super::render_labels::Labels;
use super::render_pools::PoolBytes;
use super::volume::printable;
use crate::args::{AskedChannel, RenderVolumeArgs, VolumeFilter};
use crate::made_levels::LevelMaker;
use crate::pictures::PictureOutput;
use crate::{gpu, report};

/// Frames that the last picture waits for at most.
const MOST_FRAMES: u64 = 10_000;
/// What 8 bits are written as.
const PICTURE: TextureFormat = TextureFormat::Rgba8Unorm;

pub(crate) fn run(args: &RenderVolumeArgs) -> Result<ExitCode> {
    let source = args.source.display().to_string();
    watch::check_places(args)?;
    let mut output = PictureOutput::at(args.output.as_deref(), args.path.format)?;
    let (path, mut asked) = along::opened(args)?;
    let mut watch = Watch::new(args)?;
    let gpu = headless_gpu()?;
    gpu::report_refusals(&gpu);
    let views = path.as_ref().map(|path| path.views(asked.volume.about(), args.size)).transpose()?;
    let (mut drawing, brick) = asked.drawing((args, views), &gpu, watch.disk.as_ref())?;
    watch.begin(&mut drawing);
    let (converged, picture) =
        along::draw((&mut drawing, brick), (path.as_ref(), &mut asked), &mut output, &mut watch)
            .context(source.clone())?;
    let watched = watch.end(args, &mut drawing).context(source.clone())?;
    let mut summary = Summary::new(&drawing, (&asked.volume, brick), converged, watched);
    if args.compare && converged {
        let drawn = (&picture, summary.mip_bias);
        let compared = reference::compare(args, &gpu, (&asked.volume, &asked.channels), asked.view, drawn);
        summary.compared = Some(compared.context(source.clone())?);
    }
    match args.json {
        true => report::print_json(&summary)?,
        // Where stdout has pictures, it has nothing else.
        false if args.output.as_deref().is_some_and(|output| output.as_os_str() == "-") => {
            report::say(&summary.text());
        }
        false => report::print(&summary.text())?,
    }
    for fault in drawing.faults.iter().take(20) {
        report::say(&format!("{source}: {fault}"));
    }
    let note = note_of_pool(drawing.is_pool_bounded, summary.mip_bias);
    let note = note.into_iter().chain(summary::note_of_finest(asked.volume.about())).collect::<Vec<_>>();
    note.iter().for_each(|note| report::say(&printable(&format!("note: {source}: {note}"))));
    let missing =
        format!("not converged within {MOST_FRAMES} frames, {} bricks are missing", summary.bricks_missing);
    let warnings = drawing.faults.iter().take(20).cloned().chain(note).collect::<Vec<_>>();
    let warnings = if converged { warnings } else { [warnings, vec![missing.clone()]].concat() };
    watch.report(args, (&drawing, &picture, converged), (warnings, summary.text()))?;
    if !converged {
        report::say(&format!("error: {source}: {missing}"));
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}

/// What is said of a picture that is coarser by so many levels than its size asks for, where nobody has said
/// how much memory it may take, and all bricks would need more than is taken then.
fn note_of_pool(is_bounded: bool, bias: f64) -> Option<String> {
    (is_bounded && bias > 0.0).then(|| {
        format!(
            "bricks take up to 1 GiB of GPU memory where --pool-mib does not say otherwise, and this picture wants more: it is \
             {bias} levels coarser; give --pool-mib N"
        )
    })
}

/// The box of a volume, in a world in which the longest side of a voxel is 1.
pub(crate) fn box_of(about: &VolumeAbout) -> Result<VolumeBox> {
    let level = &about.levels[0];
    let mut size = [0; 3];
    for (side, voxels) in size.iter_mut().zip(level.size) {
        *side =
            u32::try_from(voxels).with_context(|| format!("{}: a side of {voxels} voxels", about.path))?;
    }
    // Only proportions count, and those of nanometres and of light years are told alike.
    let longest = level.scale.iter().copied().fold(0.0, f64::max);
    Ok(VolumeBox::new(size, level.scale.map(|side| side / longest)))
}

fn source_of(
    args: &RenderVolumeArgs,
    volume: &Arc<Volume>,
    (asked, time): (&AskedChannel, u64),
    brick: u32,
) -> Result<Arc<VolumeSource>> {
    let options = VolumeOptions {
        brick,
        channel: asked.channel,
        time,
        cache: args.cache(),
        // What is kept serves other runs, whatever they look at.
        makes_all: args.cache().is_some(),
        ..VolumeOptions::default()
    };
    let text = format!("note: {}: its coarsest stored level is read", volume.about().path);
    Ok(Arc::new(report::say_if_slow(&text, || VolumeSource::open(volume.clone(), &options))?))
}

/// What is drawn, and what it is drawn with.
struct Drawing<'a> {
    gpu: &'a Gpu,
    textures: Textures,
    /// What is shown, and how it is asked for: windows may follow from levels that are made meanwhile.
    args: &'a RenderVolumeArgs,
    shown: Vec<(AskedChannel, Arc<VolumeSource>)>,
    maker: LevelMaker,
    renderer: VolumeRenderer,
    canvas: Canvas,
    view: VolumeView,
    frames: u64,
    /// How many the next picture is waited for.
    most_frames: u64,
    faults: Vec<String>,
    /// True if all bricks need more memory than is taken where nobody says how much.
    is_pool_bounded: bool,
}

impl<'a> Drawing<'a> {
    fn new(
        args: &'a RenderVolumeArgs,
        gpu: &'a Gpu,
        (of, channels, sources): (VolumeBox, &[AskedChannel], &[Arc<VolumeSource>]),
        labels: Option<&Labels>,
        (view, clip): (VolumeView, VolumeClip),
        (bytes, disk): (PoolBytes, Option<&Arc<DiskTier>>),
    ) -> Result<Drawing<'a>> {
        let settings = Settings {
            pace: vastex::Pace::LockStep { latency_frames: 1 },
            picture: args.size,
            whole_bytes: 0,
            filter: if args.filter == VolumeFilter::Nearest { Filter::Nearest } else { Filter::Trilinear },
            feedback: args.feedback,
            upload_bytes_per_frame: 64 << 20,
            ..Settings::default()
        };
        let mut settings = args.paging.lay_over(settings)?;
        settings.pools.default_pool.bytes = Some(bytes.channels);
        settings.pools.rules.extend(labels.iter().map(|labels| labels.pool(bytes.labels)));
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings)?;
        let at = AtTime::new((args, gpu), &mut textures, (of, channels, sources), labels, (clip, disk))?;
        let AtTime { shown, maker, renderer } = at;
        let canvas = Canvas::new(gpu, args.size, PICTURE, TargetKind::Direct);
        let (frames, most_frames, faults) = (0, MOST_FRAMES, Vec::new());
        let is_pool_bounded = bytes.is_bounded;
        Ok(Drawing {
            gpu,
            textures,
            args,
            shown,
            maker,
            renderer,
            canvas,
            view,
            frames,
            most_frames,
            faults,
            is_pool_bounded,
        })
    }

    /// Chooses the levels of all channels.
    fn set_levels(&mut self, rule: LevelRule) {
        let channels: Vec<_> = self.renderer.desc().channels.iter().map(|c| c.layer.texture()).collect();
        for channel in channels {
            // They were added a moment ago.
            if let Ok(mut texture) = self.textures.texture_mut(channel) {
                texture.set_levels(rule);
            }
        }
    }

    /// Plays frames until everything in view is loaded. Returns false where it is not after so many frames.
    fn play(&mut self, mut note: impl FnMut(&Textures)) -> Result<bool> {
        let (mut loaded, mut quiet, begun) = (0, 0, self.textures.inspect().frame());
        // What is made by now may have been read as a preview: it is looked once at least what has changed.
        let mut is_made = !self.maker.may_lack_levels();
        let mut is_wanted = false;
        loop {
            if quiet >= QUIET_FRAMES && self.textures.inspect().is_converged() {
                is_made &= !(std::mem::take(&mut is_wanted) | self.maker.want_tails(&self.textures, begun));
                if is_made && self.maker.is_done() {
                    let faults = self.maker.faults();
                    for fault in faults {
                        // Where a brick has failed for it, that was told.
                        let error = fault.error().to_string();
                        let is_told = self.faults.iter().any(|told| told.contains(&error));
                        self.faults.extend((!is_told).then(|| fault.to_string()));
                    }
                    return Ok(true);
                }
                (is_made, quiet) = (!self.waits_for_levels()?, 0);
            }
            if self.frames >= self.most_frames {
                return Ok(false);
            }
            let pager = self.textures.stats().pager;
            let is_quiet = pager.loaded == loaded && pager.missing == 0 && pager.in_flight == 0;
            quiet = if is_quiet { quiet + 1 } else { 0 };
            loaded = pager.loaded;
            let encoder = self.frame(Pictures::ForFeedback)?;
            self.gpu.queue.submit([encoder.finish()]);
            is_wanted |= self.maker.want(&self.textures);
            note(&self.textures);
            while let Some(event) = self.textures.poll_event() {
                if let Event::Failed { why, .. } = event {
                    self.faults.push(format!("{why}; a coarser brick is shown instead"));
                }
            }
        }
    }

    /// Waits until levels that are made have changed something, of which frames are to be played; false where
    /// all are made, and the windows of channels follow from them and no more from previews.
    fn waits_for_levels(&mut self) -> Result<bool> {
        loop {
            // In this order: what is made last changes something, too.
            let is_done = self.maker.is_done();
            if self.maker.take_changes(&mut self.textures)? > 0 {
                return Ok(true);
            }
            if is_done {
                let desc = self.renderer.desc().clone();
                let channels = all_as_shown(self.args, &desc.channels, &self.shown)?;
                self.renderer.set(VolumeDesc { channels, ..desc });
                return Ok(false);
            }
            self.maker.wait_and_tell();
        }
    }

    fn frame(&mut self, pictures: Pictures) -> Result<wgpu::CommandEncoder> {
        let views = [StageView { view: ViewId::MAIN, camera: self.renderer.camera(), pose: self.view }];
        let picture = self.canvas.size();
        let frame = Frame { views: &views, expected: None, picture, has_feedback: true, pictures };
        let target = self.canvas.target();
        self.frames += 1;
        Ok(frame.record(self.gpu, &mut self.textures, &self.renderer, &target, |_, _| Ok(()))?)
    }

    fn picture(&mut self) -> Result<Picture> {
        let encoder = self.frame(Pictures::Always)?;
        let read = TextureRead::submit(self.gpu, encoder, self.canvas.picture(), 4);
        self.gpu.device.poll(PollType::wait_indefinitely())?;
        let rgba = read.take().context("the picture did not come back from the adapter")??;
        Ok(Picture { size: self.canvas.size(), rgba })
    }
}

/// The middle of the range of the first channel.
fn middle_of(channels: &[VolumeChannel]) -> f64 {
    channels.first().map_or(0.5, |channel| channel.range.map(f64::from).iter().sum::<f64>() / 2.0)
}

/// The sampled value that stands for a stored one.
fn sampled(source: &VolumeSource, stored: f64) -> f64 {
    let codes = source.codes();
    (stored - codes.base) / codes.gain
}

/// All channels as they are shown, in the places of what shows them now.
fn all_as_shown(
    args: &RenderVolumeArgs,
    channels: &[VolumeChannel],
    shown: &[(AskedChannel, Arc<VolumeSource>)],
) -> Result<Vec<VolumeChannel>> {
    let mut all = Vec::new();
    for (channel, (asked, source)) in channels.iter().zip(shown) {
        all.push(as_shown(args, VolumeChannel::new(channel.layer), shown.len(), (asked, source))?);
    }
    Ok(all)
}

/// A channel in its colour and window: those asked for, those of the file, or usual ones.
fn as_shown(
    args: &RenderVolumeArgs,
    channel: VolumeChannel,
    count: usize,
    (asked, source): (&AskedChannel, &VolumeSource),
) -> Result<VolumeChannel> {
    let about = source.volume().about();
    let info = usize::try_from(asked.channel).ok().and_then(|channel| about.channel_info.get(channel));
    // Options name channels; views and files show them as the window does.
    let is_named = !args.look.channels.is_empty() && !asked.is_of_view;
    let (nth, channels) = (asked.channel as usize, about.channels as usize);
    let usual = usual_channel_color(nth, channels, info.and_then(|info| info.color));
    let color = asked.color.unwrap_or(if is_named && count == 1 { [255; 3] } else { usual });
    let of_range = |range: [f64; 2]| match about.dtype.bounds() {
        Some((least, most)) => range.map(|share| least as f64 + share * (most - least) as f64),
        None => range,
    };
    let stored = match (asked.range, args.range) {
        (Some(range), _) => range,
        (None, Some(range)) => of_range(range),
        (None, None) if is_named => of_range([0.0, 1.0]),
        (None, None) => {
            let window = block_on(source.usual_window())?;
            let is_inverted = info.is_some_and(|info| info.is_inverted);
            if is_inverted { [window[1], window[0]] } else { window }
        }
    };
    let sampled = stored.map(|value| sampled(source, value));
    let range = if asked.is_of_view { drawable_range(sampled) } else { sampled.map(|value| value as f32) };
    if range[0] == range[1] || !range.iter().all(|value| value.is_finite()) {
        bail!("channel {}: the values {} to {} cannot be told apart", asked.channel, stored[0], stored[1]);
    }
    let (opacity, gamma) = (asked.opacity.unwrap_or(1.0), asked.gamma.unwrap_or(1.0));
    Ok(VolumeChannel { range, opacity, gamma, map: asked.map, ..channel.in_color(color) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coarser_picture_is_told_where_nobody_has_asked_for_it() {
        assert!(
            note_of_pool(true, 0.5)
                .is_some_and(|note| note.contains("0.5 levels") && note.contains("--pool-mib"))
        );
        assert_eq!((note_of_pool(true, 0.0), note_of_pool(false, 2.0)), (None, None));
    }
}
