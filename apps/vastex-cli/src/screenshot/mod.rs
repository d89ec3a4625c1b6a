//! What the window shows, as a picture in a file, once everything in view is loaded: for `vastex view
//! --screenshot`, and for keys in the window. It needs no window and no display; what no texture is large
//! enough for is drawn in parts.
//!
//! How parts lie in the whole is in [`crate::parts`]; what lies over the picture is in `over`, painted by
//! `paint`.

mod over;
mod paint;
mod patience;
#[cfg(test)]
mod tests;
#[cfg(feature = "volumes")]
mod volume;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use glam::DVec2;
use vastex::{Filter, Pace, Settings, Textures};
use vastex_scenes::{
    DisplayOptions, Gpu, LayerOptions, Offscreen, Overlay, PlanetOptions, Pose, Scene, SceneImage,
    ShownLayer, Until, headless_gpu,
};
use vastex_viewer::PicturePart;
use vastex_viewer::hud::Hud;
use vastex_viewer::inspect::first_range;
use vastex_viewer::layers::{Ground, Tone};
use vastex_viewer::panels::{FileAbout, Measure, Panes, free_in_panes};
use vastex_viewer::surface::shows_large_texels;

use crate::args::ViewArgs;
use crate::commands::info::said_of;
use crate::commands::render::{self, Troubles};
use crate::open::{self, Looked};
use crate::output::{Output, PngRows};
use crate::parts::{self, MOST_SIDE, Part, Parts};
use crate::places::Inputs;
use crate::report;
use over::Over;
use patience::OpeningShot;
pub(crate) use patience::Patience;
#[cfg(feature = "volumes")]
pub(crate) use volume::VolumeShot;

/// What a picture of the window shows, and how large it is.
pub(crate) struct Shot {
    pub(crate) source: PathBuf,
    pub(crate) over: Vec<PathBuf>,
    pub(crate) scene: Scene,
    pub(crate) camera: ShotCamera,
    pub(crate) options: DisplayOptions,
    pub(crate) overlay: Option<Overlay>,
    /// True if large texels are shown as they are, where no filter is asked for.
    pub(crate) may_be_crisp: bool,
    /// True if black and white are nobody's choice, and so those of the values.
    pub(crate) range_is_free: bool,
    pub(crate) ground: Ground,
    /// Width and height in pixels.
    pub(crate) size: [u32; 2],
    pub(crate) pixels_per_point: f32,
    pub(crate) has_guides: bool,
    /// A line that is measured in an image.
    pub(crate) measure: Option<Measure>,
    pub(crate) has_hud: bool,
}

/// Where the camera of a picture is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ShotCamera {
    /// Where the command line says, else as at first.
    First,
    /// Where all of an image is seen, beside what the picture has of the window.
    Fitted,
    At(Pose),
}

/// What a shot is made of, once its files are open.
struct Sources {
    lowest: SceneImage,
    over: Vec<SceneImage>,
    about: FileAbout,
    /// Shapes of another file that lie over it.
    shapes: Option<vastex_viewer::panels::Shapes>,
}

/// Draws what the window would show, writes it, and ends.
pub(crate) fn run(args: &ViewArgs, output: &Path) -> Result<ExitCode> {
    let scene = &args.scene;
    #[cfg(feature = "build")]
    crate::commands::build::clean_up_at_interrupts()?;
    if !args.files.is_empty() {
        bail!("--screenshot shows one file; leave out the others, or lay them over it with --over");
    }
    let sources = std::iter::once(&*scene.source).chain(scene.files_over());
    let others = args.shapes.as_deref().into_iter().chain(scene.settings.iter().map(|file| &**file));
    Inputs::of(sources.chain(others)).check(&[("picture of the window", Some(output))])?;
    #[cfg(feature = "volumes")]
    if crate::volumes::opens_as_volume(&scene.source, args) {
        return volume::run(args, output);
    }
    let output = Output::at(output)?;
    let shot = Shot {
        source: scene.source.clone(),
        over: scene.files_over().map(Path::to_owned).collect(),
        scene: scene.scene(),
        camera: ShotCamera::First,
        options: scene.shown(),
        overlay: scene.overlay(),
        may_be_crisp: scene.filter() == Filter::default(),
        range_is_free: scene.range_is_free(),
        ground: Ground::default(),
        size: scene.size(),
        pixels_per_point: 1.0,
        has_guides: true,
        measure: None,
        has_hud: args.hud,
    };
    Ok(ended(shot.write(args, &output)?, &scene.source))
}

/// How the program ends once a picture is written, in which everything in view is there or not.
fn ended(is_whole: bool, source: &Path) -> ExitCode {
    if is_whole {
        return ExitCode::SUCCESS;
    }
    report::say(&format!("error: {}: not everything in view was loaded", source.display()));
    ExitCode::FAILURE
}

impl Shot {
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
        let sources = self.open(args, patience)?;
        patience.check()?;
        let source = self.source.display().to_string();
        let mut rows = output.png_rows(self.size)?;
        let converged = self.draw((args, patience), &sources, &mut rows).context(source)?;
        patience.check()?;
        rows.finish()?;
        Ok(converged)
    }

    fn open(&self, args: &ViewArgs, patience: &Patience) -> Result<Sources> {
        let opening = OpeningShot { looked: Looked::at(&self.source), patience };
        let looked = &opening.looked;
        let open =
            |file: &PathBuf| Ok::<_, anyhow::Error>(open::open_another(file, &args.scene, &opening)?.image);
        let lowest = open(&self.source)?;
        let over = self.over.iter().map(open).collect::<Result<_>>()?;
        let said = said_of(&self.source, looked).unwrap_or_default();
        let about = open::file_about(&self.source, looked, said);
        let shapes = args.shapes.as_ref().filter(|_| open::is_same_file(&self.source, &args.scene.source));
        let shapes = shapes.map(|path| open::shapes_over(&self.source, path, || true)).transpose()?;
        Ok(Sources { lowest, over, about, shapes })
    }

    fn draw(
        &self,
        (args, patience): (&ViewArgs, &Patience),
        sources: &Sources,
        rows: &mut PngRows,
    ) -> Result<bool> {
        let gpu = headless_gpu()?;
        let said = || args.scene.pose(sources.lowest.size);
        let panes = parts::panes(&self.options, 1 + sources.over.len());
        let most = gpu.device.limits().max_texture_dimension_2d.min(MOST_SIDE);
        let most = args.scene.part_side.map_or(most, |side| side.min(most));
        let is_whole = self.size.iter().all(|side| *side <= most);
        let free = self.free();
        let [first, last] = free.map(|corner| corner.x);
        let places = Panes::sharing(panes, self.size[0], [first, last]);
        let pane = [places.width, self.size[1]];
        let free = free_in_panes(&places, self.size[1], free);
        let fitted = || match self.scene {
            Scene::Image => Pose::fitted(pane, sources.lowest.size, free),
            scene => Pose::first(scene),
        };
        let pose = match self.camera {
            ShotCamera::First => said().unwrap_or_else(fitted),
            ShotCamera::Fitted => fitted(),
            ShotCamera::At(pose) => pose,
        };
        let has_clouds = self.scene == Scene::Planet && self.options.planet.clouds.is_some();
        let parts = Parts::of_panes(self.size, places, most, has_clouds);
        if !is_whole {
            parts::check_overlay(self.overlay)?;
        }
        let drawn_size = if is_whole { self.size } else { parts.drawn_size() };
        let mut drawn = self.offscreen(args, &gpu, sources, (&pose, pane, drawn_size))?;
        drawn.lay_on(self.ground);
        drawn.set_room(Some(PicturePart {
            whole: self.size,
            at: [first as i64, 0],
            size: [(last - first) as u32, self.size[1]],
        }));
        drawn.set_view(Some(PicturePart::around(pane, free)));
        if self.range_is_free {
            self.take_first_ranges(&mut drawn)?;
        }
        let mut troubles = Troubles::default();
        let mut over = Over::new(self, &gpu, &drawn, pose, sources);
        let outcome = match is_whole {
            true => {
                let watch = |_: &Textures, events| {
                    troubles.note(events);
                    patience.flow()
                };
                let outcome = drawn.run_along(1, |_| pose, Until::Converged, watch)?;
                patience.check()?;
                let mut picture = match self.overlay {
                    None => drawn.picture(),
                    Some(overlay) => drawn.overlay(overlay)?,
                };
                over.paint(&drawn, &[Part::all(self.size)], &mut picture)?;
                rows.add(&picture)?;
                outcome
            }
            false => parts::draw(
                &mut drawn,
                (&pose, &parts, self.overlay),
                &mut troubles,
                |drawn, of_row, mut row| {
                    over.paint(drawn, &parts.covering(of_row), &mut row)?;
                    rows.add(&row)?;
                    patience.check()?;
                    Ok(ControlFlow::Continue(()))
                },
            )?
            .outcome()
            .clone(),
        };
        let source = self.source.display().to_string();
        troubles.texts(&source, drawn.textures()).iter().for_each(|said| report::say(said));
        Ok(outcome.converged)
    }

    /// The corners of what no panel covers, in pixels.
    fn free(&self) -> [DVec2; 2] {
        let hud = if self.has_hud { f64::from((Hud::WIDTH * self.pixels_per_point).round()) } else { 0.0 };
        [DVec2::new(hud, 0.0), DVec2::from(self.size.map(f64::from))]
    }

    /// Gives layers the ranges of their values, as the window does at first.
    fn take_first_ranges(&self, drawn: &mut Offscreen) -> Result<()> {
        let shown: Vec<_> =
            drawn.renderer().layers().iter().map(|shown| (shown.layer, shown.color_map)).collect();
        let PlanetOptions { night, clouds, .. } = &self.options.planet;
        let parts = [night, clouds].into_iter().flatten().filter(|_| self.scene == Scene::Planet);
        let count = shown.len().saturating_sub(parts.count());
        for (n, (layer, map)) in shown.into_iter().enumerate().take(count) {
            let Some((range, text)) = first_range(drawn.textures(), (layer, &map), 1.0) else { continue };
            report::say(&format!("{}: {text}", self.source.display()));
            drawn.change_layer(n, |shown| {
                let tone = Tone { range, ..shown.color_map.tone() };
                ShownLayer { color_map: shown.color_map.with_tone(tone), ..shown }
            })?;
        }
        Ok(())
    }

    /// What draws pictures of `size` pixels, of a camera that shows the whole in panes of `pane`.
    fn offscreen(
        &self,
        args: &ViewArgs,
        gpu: &Gpu,
        sources: &Sources,
        (pose, pane, size): (&Pose, [u32; 2], [u32; 2]),
    ) -> Result<Offscreen> {
        let files = || std::iter::once(&self.source).chain(&self.over);
        let mut options = open::shown_of(self.options.clone(), files().map(PathBuf::as_path));
        // What flickers is seen as it is first.
        options.compare_mode = options.compare_mode.at(Duration::ZERO);
        if options.layers.is_empty() {
            let is_shown = |texture: &usize| !self.options.is_of_planet(*texture);
            let first = |texture| LayerOptions { texture, ..LayerOptions::default() };
            options.layers = (0..=sources.over.len()).filter(is_shown).map(first).collect();
        }
        let is_crisp = pose
            .magnification(pane, sources.lowest.size)
            .is_some_and(|scale| shows_large_texels(scale, false));
        if is_crisp && self.may_be_crisp {
            options.layers.iter_mut().for_each(|layer| layer.filter = layer.filter.or(Some(Filter::Nearest)));
        }
        let settings = Settings {
            picture: size,
            pace: Pace::LockStep { latency_frames: 1 },
            fade: Duration::ZERO,
            ..render::settings(&args.scene)?
        };
        let images = (sources.lowest.clone(), &*sources.over);
        let mut drawn = Offscreen::showing_together(&options, gpu, images, self.scene, size, settings)?;
        let shown: Vec<_> = drawn.textures().inspect().textures().collect();
        for (texture, file) in shown.into_iter().zip(files()) {
            let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
            drawn.textures_mut().texture_mut(texture)?.set_name(name);
        }
        Ok(drawn)
    }
}
