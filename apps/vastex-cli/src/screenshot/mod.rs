//! What the window shows, as a picture in a file, once everything in view is loaded: for `vastex view
//! --screenshot`, and for keys in the window. It needs no window and no display; what no texture is large
//! enough for is drawn in parts.
//!
//! How parts lie in the whole is in [`parts`]; what lies over the picture is painted by [`paint`], the guides
//! as [`guided`] has them, which the window shows too.

mod guided;
mod paint;
mod parts;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use vastex::{Filter, Pace, Settings, TileSource};
use vastex_scenes::{
    DisplayOptions, Gpu, LayerOptions, Offscreen, Overlay, Picture, Pose, Scene, Until, headless_gpu,
};
use vastex_viewer::hud::{Hud, HudData, MachineThumbnail};
use vastex_viewer::layers::CompareMode;
use vastex_viewer::overlay::SmallOverlay;
use vastex_viewer::panels::{ImageView, Minimap, Panes, swipe_line};
use vastex_viewer::stage::LinearTarget;

use crate::args::ViewArgs;
use crate::commands::info::rows_of;
use crate::commands::render::{self, Troubles};
use crate::open::{self, FileAbout};
use crate::output::Output;
use crate::report;
pub(crate) use guided::{CRISP, Guided};
use parts::{Part, parts, pose_of_part, swipe_of_part};

/// Pixels of a part along each side at most, so that little GPU memory is taken however large the whole is.
const MOST_SIDE: u32 = 4096;
/// Of a whole, so that it can be held in memory.
const MOST_PIXELS: u64 = 1 << 30;

/// What a picture of the window shows, and how large it is.
pub(crate) struct Shot {
    pub(crate) source: PathBuf,
    pub(crate) over: Vec<PathBuf>,
    pub(crate) scene: Scene,
    /// Where the camera is; at first, where nothing is said.
    pub(crate) pose: Option<Pose>,
    pub(crate) options: DisplayOptions,
    pub(crate) overlay: Option<Overlay>,
    /// Whether large texels are shown as they are, where no filter is asked for.
    pub(crate) may_be_crisp: bool,
    /// Width and height in pixels.
    pub(crate) size: [u32; 2],
    pub(crate) pixels_per_point: f32,
    pub(crate) has_guides: bool,
    pub(crate) has_hud: bool,
}

/// What a shot is made of, once its files are open.
struct Sources {
    tiles: Arc<dyn TileSource>,
    over: Vec<Arc<dyn TileSource>>,
    about: FileAbout,
    /// Shapes of another file that lie over it.
    shapes: Option<vastex_viewer::panels::Shapes>,
    image: [u32; 2],
}

/// Draws what the window would show, writes it, and ends.
pub(crate) fn run(args: &ViewArgs, output: &Path) -> Result<ExitCode> {
    let scene = &args.scene;
    if !args.files.is_empty() {
        bail!("--screenshot shows one file; leave out the others, or lay them over it with --over");
    }
    let files = std::iter::once(&*scene.source).chain(scene.files_over()).chain(args.shapes.as_deref());
    if files.into_iter().any(|file| open::is_file_of(file, output)) {
        bail!("{}: is the source as well as the output; choose another name", output.display());
    }
    let output = Output::at(output)?;
    let shot = Shot {
        source: scene.source.clone(),
        over: scene.files_over().map(Path::to_owned).collect(),
        scene: scene.scene(),
        pose: None,
        options: scene.shown(),
        overlay: scene.overlay(),
        may_be_crisp: scene.filter == Filter::default(),
        size: scene.size(),
        pixels_per_point: 1.0,
        has_guides: true,
        has_hud: args.hud,
    };
    let (picture, converged) = shot.take(args)?;
    output.write_picture(&picture)?;
    if !converged {
        report::say(&format!("error: {}: not everything in view was loaded", scene.source.display()));
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}

impl Shot {
    /// Draws it, on a device of its own. Returns true if everything in view is there.
    pub(crate) fn take(&self, args: &ViewArgs) -> Result<(Picture, bool)> {
        let [width, height] = self.size;
        if u64::from(width) * u64::from(height) > MOST_PIXELS {
            bail!("a picture of {width}x{height} pixels has more than 2^30 of them; choose a smaller --size");
        }
        let sources = self.open(args)?;
        let source = self.source.display().to_string();
        self.draw(args, &sources).context(source)
    }

    fn open(&self, args: &ViewArgs) -> Result<Sources> {
        let open = |file: &PathBuf| Ok::<_, anyhow::Error>(open::open_another(file, &args.scene, &())?.tiles);
        let tiles = open(&self.source)?;
        let over = self.over.iter().map(open).collect::<Result<_>>()?;
        let about = FileAbout::of(&self.source, rows_of(&self.source).unwrap_or_default());
        let shapes = args.shapes.as_ref().filter(|_| self.source == args.scene.source);
        let shapes = shapes.map(|path| open::shapes_over(&self.source, path, || true)).transpose()?;
        let [width, height, _] = tiles.description().geometry.size();
        Ok(Sources { tiles, over, about, shapes, image: [width, height] })
    }

    fn draw(&self, args: &ViewArgs, sources: &Sources) -> Result<(Picture, bool)> {
        let gpu = headless_gpu()?;
        let said = || args.scene.pose(sources.image);
        let pose = self.pose.or_else(said).unwrap_or_else(|| Pose::first(self.scene));
        let most = gpu.device.limits().max_texture_dimension_2d;
        // Panes divide the whole, and so are drawn at once.
        let is_parted =
            matches!(pose, Pose::Image { .. }) && self.options.compare_mode != CompareMode::Beside;
        if !is_parted && self.size.iter().any(|side| *side > most) {
            let [width, height] = self.size;
            bail!(
                "{width}x{height} pixels: of scenes only an image is drawn in parts, and none side by side; choose at most {most} pixels a side"
            );
        }
        let parts = parts(self.size, if is_parted { most.min(MOST_SIDE) } else { most });
        let mut whole =
            Picture { size: self.size, rgba: vec![0; self.size[0] as usize * self.size[1] as usize * 4] };
        let (mut offscreen, mut converged, mut troubles) = (None, true, Troubles::default());
        for part in &parts {
            let pose = pose_of_part(&pose, self.size, sources.image, part);
            // The line of a comparison is told when a scene is set up.
            let is_kept = parts.len() == 1 || !matches!(self.options.compare_mode, CompareMode::Swipe(_));
            let mut drawn = match offscreen.take().filter(|_| is_kept) {
                Some(drawn) => drawn,
                None => self.offscreen(args, &gpu, sources, (&pose, part))?,
            };
            let outcome =
                drawn.run_along(1, |_| pose, Until::Converged, |_, events| troubles.note(events))?;
            converged &= outcome.converged;
            let picture = match self.overlay {
                None => drawn.picture(),
                Some(overlay) => drawn.overlay(overlay)?,
            };
            part.put(&picture, &mut whole);
            offscreen = Some(drawn);
        }
        if let Some(drawn) = offscreen {
            let source = self.source.display().to_string();
            troubles.texts(&source, drawn.textures()).iter().for_each(|said| report::say(said));
            self.paint_over(&gpu, &drawn, (sources, pose), (&parts, &mut whole))?;
        }
        Ok((whole, converged))
    }

    fn offscreen(
        &self,
        args: &ViewArgs,
        gpu: &Gpu,
        sources: &Sources,
        (pose, part): (&Pose, &Part),
    ) -> Result<Offscreen> {
        let files = || std::iter::once(&self.source).chain(&self.over);
        let mut options = open::shown_of(self.options.clone(), files().map(PathBuf::as_path));
        // What flickers is seen as it is first.
        options.compare_mode = swipe_of_part(options.compare_mode.at(Duration::ZERO), self.size, part);
        if options.layers.is_empty() {
            let first = |texture| LayerOptions { texture, ..LayerOptions::default() };
            options.layers = (0..=sources.over.len()).map(first).collect();
        }
        let seen = options.layers.iter().filter(|layer| layer.is_visible && layer.opacity > 0.0).count();
        let panes = if options.compare_mode == CompareMode::Beside { seen.max(1) as u32 } else { 1 };
        let pane = [(part.size[0] / panes).max(1), part.size[1]];
        let is_crisp = pose.magnification(pane, sources.image).is_some_and(|scale| scale >= CRISP);
        if is_crisp && self.may_be_crisp {
            options.layers.iter_mut().for_each(|layer| layer.filter = layer.filter.or(Some(Filter::Nearest)));
        }
        let settings = Settings {
            picture: part.size,
            pace: Pace::LockStep { latency_frames: 1 },
            fade: Duration::ZERO,
            ..render::settings(&args.scene)?
        };
        let (tiles, over) = (sources.tiles.clone(), &sources.over);
        let mut drawn =
            Offscreen::showing_together(&options, gpu, tiles, over, self.scene, part.size, settings)?;
        let shown: Vec<_> = drawn.textures().inspect().textures().collect();
        for (texture, file) in shown.into_iter().zip(files()) {
            let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
            drawn.textures_mut().texture_mut(texture)?.set_name(name);
        }
        Ok(drawn)
    }

    /// Paints what lies over the picture in the window, but for its panel.
    fn paint_over(
        &self,
        gpu: &Gpu,
        drawn: &Offscreen,
        (sources, pose): (&Sources, Pose),
        (parts, whole): (&[Part], &mut Picture),
    ) -> Result<()> {
        let layers = drawn.renderer().layers();
        let panes = Panes { count: layers.panes(), width: layers.pane_size(self.size)[0] };
        let view = ImageView { pose, picture: [panes.width, self.size[1]], image: sources.image, left: 0 };
        let name = |layer: vastex::LayerId| {
            let texture = drawn.textures().texture(layer.texture()).ok();
            texture.and_then(|texture| texture.name().map(str::to_owned)).unwrap_or_default()
        };
        let titles: Vec<String> = match panes.count {
            0 | 1 => Vec::new(),
            _ => layers.in_panes().map(|shown| name(shown.layer)).collect(),
        };
        let mut painter = paint::OverPainter::new(gpu, self.size, self.pixels_per_point);
        let mut data = self.has_hud.then(|| HudData::of(drawn.textures()));
        // They stay until they are painted.
        let mut machine = Vec::new();
        if let Some(data) = &mut data {
            data.overlay = self.overlay;
            // They are drawn by pipelines of the scene, into pictures like its own.
            let format = match drawn.renderer().format() {
                LinearTarget::FORMAT => paint::FORMAT,
                format => format,
            };
            for overlay in [Overlay::Table, Overlay::Atlas] {
                let small = SmallOverlay::new(gpu, drawn.textures(), drawn.renderer(), overlay, format);
                let Ok(mut small) = small else { continue };
                if small.draw(gpu, drawn.textures(), drawn.renderer(), &drawn.pose()).is_ok() {
                    let picture = painter.register(small.view());
                    data.thumbnails.push(MachineThumbnail { overlay, picture, size: small.size() });
                    machine.push(small);
                }
            }
        }
        let mut hud = Hud::default();
        let mut minimaps: Vec<Minimap> = (0..panes.count).map(|_| Minimap::default()).collect();
        let mut compare_mode = self.options.compare_mode;
        let can_compare = drawn.renderer().layers().can_compare();
        painter.run(|ui| {
            if let Some(data) = &data {
                // Nobody is there to change anything.
                drop(hud.show(ui, data));
            }
            let all = ui.available_rect_before_wrap();
            let free = |pane: u32| panes.rect(pane, all, ui.pixels_per_point());
            panes.paint(ui.painter(), all, &titles, None);
            if self.overlay.is_some() {
                return;
            }
            if can_compare {
                swipe_line(ui.ctx(), free(0), view.picture[0], &mut compare_mode);
            }
            if self.has_guides {
                let about = &sources.about;
                let guided = Guided {
                    textures: drawn.textures(),
                    renderer: drawn.renderer(),
                    view: &view,
                    texel_size: about.texel_size.as_ref(),
                    shapes: sources.shapes.as_ref(),
                    is_settled: true,
                    is_seen: true,
                };
                for (pane, minimap) in (0..).zip(&mut minimaps) {
                    guided.show(ui, pane, free(pane), minimap);
                }
            }
        });
        painter.paint(parts, whole)
    }
}
