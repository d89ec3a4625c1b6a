//! `vastex view [SOURCE [FILE]...]`: a window.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{Arg, Args as ClapArgs, CommandFactory, FromArgMatches, ValueEnum};
use vastex_scenes::Scene;
use vastex_viewer::input::CONTROLS;
use vastex_viewer::layers::CompareMode;

use super::render::check_is_png;
use super::{Args, MOST_FADE_MS, SceneArgs, conflict, is_link, value_error};

/// Stands for a source where none is named: no path has this byte.
pub(crate) const NO_FILE: &str = "\0";

/// What the program is called with, for some purposes.
const EXAMPLES: &str = "\
Examples:
  vastex view earth.vastex
  vastex view
  vastex view earth.vastex --on globe --pool-mib 256
  vastex view island.vastex --on terrain
  vastex view island.vastex --layer color --layer height:map=inferno:opacity=0.4
  vastex view scan.jpg --view image:x=12000,y=3400,zoom=40,turn=90
  vastex view before.tif --over after.tif --compare-mode swipe
  vastex view before.tif after.tif --side-by-side
  vastex view landsat.tif --layer :bands=5,4,3
  vastex view slide.svs --shapes annotations.geojson
  vastex view scan.jpg slides/*.svs
  vastex view cells.zarr --channels 0:00FF00,1:magma --mode emission --labels nuclei
  vastex view --screenshot scan.png --size 3840x2160 scan.jpg
  vastex view earth.vastex --camera-path flight.path
  vastex view 'vastex:scan.jpg?view=image:x=12000,y=3400,zoom=40'";

impl ViewArgs {
    /// Files that are to be side by side lie over the first one, and are compared so.
    pub(crate) fn put_beside(&mut self) {
        if self.side_by_side {
            let layers = &mut self.scene.layers;
            layers.over.append(&mut self.files);
            layers.compare_mode = CompareMode::Beside;
        }
    }
}

/// Columns of the text that keys and gestures are told in, and of what stands before it.
const HELP_COLUMNS: usize = 100;
const KEY_COLUMNS: usize = 28;

/// Examples, and what every key and gesture does.
fn after_help() -> String {
    let mut text = EXAMPLES.to_owned();
    #[cfg(feature = "volumes")]
    let of_volumes = vastex_viewer::volume_scene::VOLUME_CONTROLS;
    #[cfg(not(feature = "volumes"))]
    let of_volumes = &[];
    for (part, controls) in CONTROLS.iter().chain(of_volumes) {
        text += &format!("\n\n{part}, in the window:");
        for (keys, meaning) in *controls {
            text += &format!("\n  {keys:<0$}", KEY_COLUMNS - 2);
            if keys.len() + 3 > KEY_COLUMNS {
                text += &format!("\n{:KEY_COLUMNS$}", "");
            }
            let mut column = KEY_COLUMNS;
            for word in meaning.split(' ') {
                if column + word.len() > HELP_COLUMNS {
                    text = format!("{}\n{:KEY_COLUMNS$}", text.trim_end(), "");
                    column = KEY_COLUMNS;
                }
                text += word;
                text.push(' ');
                column += word.len() + 1;
            }
            text.truncate(text.trim_end().len());
        }
    }
    text
}

/// What `vastex view` is told.
#[derive(Clone, Debug, ClapArgs)]
#[command(after_help = after_help())]
pub(crate) struct ViewArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Further files to step through with N and P
    #[arg(value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// Show SOURCE and the FILEs side by side, with one camera: the same part of each image, texel by texel
    /// where they are of one size. B puts them over one another
    #[arg(long, requires = "files", conflicts_with = "compare_mode")]
    pub(crate) side_by_side: bool,
    /// Open no window: write what it would show first, once everything in view is loaded, as PNG, and end.
    /// Needs no display. It may be larger than any texture: then it is drawn in parts
    #[arg(long, value_name = "OUT.png", conflicts_with_all = ["times", "exit_after_frames", "camera_path"])]
    pub(crate) screenshot: Option<PathBuf>,
    /// With --screenshot, show what the machine does beside the picture, as U does in the window
    #[arg(long, requires = "screenshot")]
    pub(crate) hud: bool,
    /// Play a camera path over the first image, or round the volume (docs/camera-paths.md), again with F9
    #[arg(long, value_name = "FILE")]
    pub(crate) camera_path: Option<PathBuf>,
    /// Draw the shapes of a GeoJSON file over the first image while guides are shown (G): in texels, or in
    /// degrees or the coordinate system that the file names where the image is a GeoTIFF of the same
    #[arg(long, value_name = "FILE")]
    pub(crate) shapes: Option<PathBuf>,
    /// Milliseconds in which a tile fades in from what was on screen before; 0: it is there at once. By
    /// default 150, or 0 where a processor draws in the place of a GPU
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=MOST_FADE_MS))]
    pub(crate) fade_ms: Option<u64>,
    /// Print as JSON when something could be seen, and close the window some seconds after all is sharp, for
    /// benchmarks
    #[arg(long, hide = true, conflicts_with = "exit_after_frames")]
    pub(crate) times: bool,
    /// With --times, draw without a pause until the source is there, as where a person moves meanwhile
    #[arg(long, hide = true, requires = "times")]
    pub(crate) restless: bool,
    /// Close the window after so many frames of the source itself, and when nothing that was asked for is yet
    /// to be opened, for tests
    #[arg(long, value_name = "N", hide = true)]
    pub(crate) exit_after_frames: Option<u64>,
    /// Have something go wrong after the first frame of the source itself, for tests
    #[arg(long, value_enum, hide = true, requires = "exit_after_frames")]
    pub(crate) fault: Option<Fault>,
    /// How a volume is shown at first. Last, since all that follows stands under its heading
    #[cfg(feature = "volumes")]
    #[command(flatten, next_help_heading = "Options of volumes")]
    pub(crate) volume: super::VolumeLookArgs,
}

/// What can go wrong with a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Fault {
    /// The device is lost.
    Device,
    /// The window's surface is lost.
    Surface,
    /// The surface cannot be configured in one frame.
    Configuration,
}

/// What the program is told in these words; `view` may do without a file. Says what is wrong with them, and
/// ends the program, as clap's own function for it does.
pub(crate) fn parsed(words: Vec<OsString>) -> Args {
    // An argument that is changed comes after the others, unless it says where.
    let may_lack_file =
        |source: Arg| source.required(false).default_value(NO_FILE).hide_default_value(true).index(1);
    let of_view =
        |view: clap::Command| view.mut_arg("source", may_lack_file).mut_arg("files", |files| files.index(2));
    let command = || Args::command().mut_subcommand("view", of_view);
    let matches = command().get_matches_from(words);
    Args::from_arg_matches(&matches).unwrap_or_else(|error| error.format(&mut command()).exit())
}

impl ViewArgs {
    /// The file to show at first; `None` for a window that waits for one.
    pub(crate) fn file(&self) -> Option<&Path> {
        Some(&*self.scene.source).filter(|source| *source != Path::new(NO_FILE))
    }

    pub(super) fn check(&self) -> Result<(), clap::Error> {
        let of_a_file = [
            (self.screenshot.is_some(), "--screenshot"),
            (self.scene.files_over().next().is_some(), "what is to lie over a file"),
            (self.camera_path.is_some(), "--camera-path"),
            (self.shapes.is_some(), "--shapes"),
            (self.times || self.exit_after_frames.is_some(), "a window that closes by itself"),
        ];
        let missing = of_a_file.iter().find(|(is_asked, _)| *is_asked && self.file().is_none());
        if let Some((_, what)) = missing {
            return Err(conflict(&format!("no SOURCE is named, and {what} needs one; name a file")));
        }
        self.scene.check()?;
        #[cfg(feature = "volumes")]
        {
            self.volume.check()?;
            self.scene.volume_view().map_or(Ok(()), |view| self.volume.check_beside(&view))?;
        }
        if let Some(link) = self.files.iter().find(|file| is_link(file)) {
            let link: String = link.display().to_string().chars().take(100).collect();
            return Err(value_error(&format!(
                "'{link}' for '[FILE]...': a link names its files itself; open it in the place of SOURCE"
            )));
        }
        self.screenshot.as_deref().map_or(Ok(()), |output| check_is_png(output, "--screenshot"))
    }
}

#[cfg(feature = "volumes")]
impl ViewArgs {
    /// Fails where something is asked for that only images have.
    pub(crate) fn check_of_volume(&self) -> anyhow::Result<()> {
        let scene = &self.scene;
        let asked = [
            (scene.on != Scene::Image, "--on"),
            (scene.view.is_some() && scene.volume_view().is_none(), "this --view"),
            (scene.overlay.is_some(), "--overlay"),
            (!scene.layers.layers.is_empty(), "--layer"),
            (scene.layers.exposure.is_some(), "--exposure"),
            (scene.layers.curve.is_some(), "--curve"),
            (scene.files_over().next().is_some(), "--over"),
            (self.shapes.is_some(), "--shapes"),
        ];
        match asked.iter().find(|(is_asked, _)| *is_asked) {
            Some((_, option)) => anyhow::bail!(
                "{}: is a volume, and {option} is for images; leave it out",
                scene.source.display()
            ),
            None => Ok(()),
        }
    }

    /// Fails where something is asked for that only volumes have.
    pub(crate) fn check_of_image(&self) -> anyhow::Result<()> {
        self.scene.check_of_image()?;
        match self.volume.given() {
            Some(option) => anyhow::bail!(
                "{}: is no volume, and {option} is for volumes; leave it out",
                self.scene.source.display()
            ),
            None => Ok(()),
        }
    }
}

/// The arguments of a window that opens a link: as it was told to open files, and to show what the link says.
pub(crate) fn of_link(args: &ViewArgs, link: &str) -> Result<ViewArgs, clap::Error> {
    let mut scene = args.scene.clone();
    scene.source = link.trim().into();
    (scene.on, scene.view, scene.overlay) = (Scene::Image, None, None);
    (scene.layers, scene.heights, scene.planet) = Default::default();
    scene.follow_link()?;
    scene.check()?;
    let (files, shapes, camera_path) = (Vec::new(), None, None);
    Ok(ViewArgs {
        scene,
        #[cfg(feature = "volumes")]
        volume: Default::default(),
        files,
        shapes,
        camera_path,
        side_by_side: false,
        ..args.clone()
    })
}
