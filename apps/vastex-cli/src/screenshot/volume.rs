//! What the window shows of a volume, as a picture in a file: three slices and all of it, as they are painted
//! in the window.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use egui::Rect;
use vastex::{Pace, Settings};
use vastex_scenes::{Gpu, Picture, headless_gpu};
use vastex_viewer::hud::{Hud, HudData};
use vastex_viewer::panels::{VolumePanes, ray_cut_text};
use vastex_viewer::volume_scene::{VolumeAsked, VolumeLook, VolumePictures, VolumeScene, pane_rects};

use super::paint::OverPainter;
use super::patience::Patience;
use crate::args::ViewArgs;
use crate::made_levels::LevelMaker;
use crate::output::{Output, PngRows};
use crate::parts::{MOST_SIDE, Parts};
use crate::report;
use crate::volumes::{OpenHow, OpenedVolume, open_volume, read_channel, read_labels};

/// Frames that the picture waits for at most.
const MOST_FRAMES: u64 = 20_000;

/// What a picture of a volume in the window shows, and how large it is.
pub(crate) struct VolumeShot {
    pub(crate) source: PathBuf,
    /// How it is shown; at first, where nothing is said.
    pub(crate) look: Option<VolumeLook>,
    /// Width and height in pixels.
    pub(crate) size: [u32; 2],
    pub(crate) pixels_per_point: f32,
    pub(crate) has_guides: bool,
    pub(crate) has_hud: bool,
}

/// Draws what the window would show of a volume, writes it, and ends.
pub(super) fn run(args: &ViewArgs, output: &Path) -> Result<ExitCode> {
    let scene = &args.scene;
    let output = Output::at(output)?;
    let shot = VolumeShot {
        source: scene.source.clone(),
        look: None,
        size: scene.size(),
        pixels_per_point: 1.0,
        has_guides: true,
        has_hud: args.hud,
    };
    Ok(super::ended(shot.write(args, &output)?, &scene.source))
}

impl VolumeShot {
    /// Draws it, on a device of its own, and writes it as PNG. Returns true if everything in view is there.
    pub(crate) fn write(&self, args: &ViewArgs, output: &Output) -> Result<bool> {
        self.write_while(args, (output, &Patience::default()))
    }

    /// The same as long as somebody waits for it. Fails, and writes nothing, where nobody does any more.
    pub(crate) fn write_while(
        &self,
        args: &ViewArgs,
        (output, patience): (&Output, &Patience),
    ) -> Result<bool> {
        let opened = open_volume(&self.source, OpenHow::of(args))?;
        let gpu = headless_gpu()?;
        let source = self.source.display().to_string();
        let settings = Settings {
            picture: self.size,
            pace: Pace::LockStep { latency_frames: 1 },
            upload_bytes_per_frame: 64 << 20,
            ..opened.settings(&args.scene)?
        };
        let begun = Instant::now();
        let clock = Arc::new(move || begun.elapsed());
        let mut scene = VolumeScene::new(&gpu, opened.facts.clone(), settings, clock)?;
        scene.look = match &self.look {
            Some(look) => look.clone(),
            None => opened.initial_look(args)?,
        };
        self.check_panes(&gpu, &scene.look)?;
        let mut rows = output.png_rows(self.size)?;
        let is_whole = self.play(&mut scene, &opened, patience).context(source.clone())?;
        if let Some(cut) = scene.ray_cut() {
            report::say(&format!("note: {source}: {}", ray_cut_text(&cut)));
        }
        let most = args.scene.part_side.map_or(MOST_SIDE, |side| side.min(MOST_SIDE));
        self.paint((&gpu, &scene), most, patience, &mut rows)?;
        rows.finish()?;
        Ok(is_whole)
    }

    /// Each slice, and the picture of the whole, lies in a texture.
    fn check_panes(&self, gpu: &Gpu, look: &VolumeLook) -> Result<()> {
        let most = gpu.device.limits().max_texture_dimension_2d;
        let panes = pane_rects(look.layout, self.area());
        let Some(pane) = panes.iter().find(|pane| pane.size.iter().any(|side| *side > most)) else {
            return Ok(());
        };
        let ([width, height], [of_pane, rows]) = (self.size, pane.size);
        bail!(
            "a picture of {width}x{height} pixels has a slice or the volume in {of_pane}x{rows} of them: this adapter draws \
             {most}x{most} of each at most"
        );
    }

    /// What the panels leave to the pictures: all of it but what shows what the machine does.
    fn area(&self) -> [u32; 2] {
        let hud = if self.has_hud { (Hud::WIDTH * self.pixels_per_point).round() as u32 } else { 0 };
        [self.size[0].saturating_sub(hud).max(1), self.size[1]]
    }

    /// Plays frames until everything in view is there, then draws it. Returns false where it is not after so
    /// many frames.
    fn play(&self, scene: &mut VolumeScene, opened: &OpenedVolume, patience: &Patience) -> Result<bool> {
        let (mut frames, mut is_refused) = (0, false);
        let mut levels = LevelMaker::default();
        let mut is_wanted = false;
        let is_whole = loop {
            patience.check()?;
            for asked in scene.take_asked() {
                if let VolumeAsked::Labels { nth, time } = asked {
                    let name = scene.facts().labels.get(nth).cloned().unwrap_or_default();
                    match read_labels(opened, (&name, time), &scene.preparer()) {
                        Ok(read) => {
                            let added = scene.add_labels((nth, time), read.prepared, read.place)?;
                            added.map_or(Ok(()), |texture| levels.add(texture, read.source))?;
                        }
                        Err(error) => {
                            report::say(&report::message(&error));
                            scene.refuse_labels(nth, time);
                            is_refused = true;
                        }
                    }
                }
                let VolumeAsked::Channel { channel, time } = asked else { continue };
                match read_channel(opened, (channel, time), &scene.preparer()) {
                    Ok(read) => {
                        if let Some(texture) = scene.add((channel, time), read.prepared, read.usual)? {
                            levels.add(texture, read.source)?;
                        }
                    }
                    Err(error) => {
                        report::say(&report::message(&error));
                        scene.refuse(channel, time);
                        is_refused = true;
                    }
                }
            }
            scene.frame(self.area(), VolumePictures::None)?;
            scene.take_faults().iter().take(20).for_each(|fault| report::say(fault));
            is_wanted |= levels.want(scene.textures());
            frames += 1;
            // A time that comes takes the place of the first one.
            let is_there = scene.seen_time() == scene.look.time;
            if scene.has_all() && is_there && frames > 1 {
                // In this order: what is made last changes something, too.
                is_wanted |= levels.want_tails(scene.textures(), 0);
                let is_made = levels.is_done() && !std::mem::take(&mut is_wanted);
                let changes = levels.changes();
                if is_made && changes.is_empty() {
                    break !is_refused;
                }
                // Frames are counted while something can be drawn.
                match changes.is_empty() {
                    true => LevelMaker::wait(),
                    false => (frames, _) = (1, scene.changed(&changes)),
                }
                continue;
            }
            if frames >= MOST_FRAMES {
                break false;
            }
        };
        let faults = levels.faults();
        faults.iter().take(20).for_each(|fault| report::say(&fault.to_string()));
        scene.frame(self.area(), VolumePictures::Whole)?;
        Ok(is_whole)
    }

    /// Paints the pictures and what lies over them, in parts of at most so many pixels a side.
    fn paint(
        &self,
        (gpu, scene): (&Gpu, &VolumeScene),
        most: u32,
        patience: &Patience,
        rows: &mut PngRows,
    ) -> Result<()> {
        let mut painter = OverPainter::new(gpu, self.size, self.pixels_per_point);
        let pictures: Vec<_> =
            scene.pictures().iter().map(|(pane, picture)| (pane.pane, painter.register(picture))).collect();
        let panes = scene.panes();
        let shown = VolumePanes {
            facts: scene.facts(),
            look: &scene.look,
            panes: &panes,
            pictures: &pictures,
            has_guides: self.has_guides,
            seen_time: scene.seen_time(),
        };
        let told = self.has_hud.then(|| HudData { is_of_volume: true, ..HudData::of(scene.textures()) });
        let mut hud = Hud::default();
        painter.run(|ui| {
            if let Some(told) = &told {
                // Nobody is there to change anything.
                drop(hud.show(ui, told));
            }
            let all: Rect = ui.available_rect_before_wrap();
            shown.paint(ui.painter(), all, self.pixels_per_point);
        });
        let parts = Parts::new(self.size, 1, most, false);
        for row in parts.rows() {
            patience.check()?;
            let Some(height) = row.first().map(|part| parts.height_of(part)) else { continue };
            let bytes = self.size[0] as usize * height as usize * 4;
            let rgba = [0, 0, 0, 255].into_iter().cycle().take(bytes).collect();
            let mut picture = Picture { size: [self.size[0], height], rgba };
            painter.paint(&row, &mut picture)?;
            rows.add(&picture)?;
        }
        Ok(())
    }
}
