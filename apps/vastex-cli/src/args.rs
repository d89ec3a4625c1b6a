//! The words of the command line, their defaults, and which values make sense.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args as ClapArgs, CommandFactory, Parser, Subcommand};
use vastex::{FeedbackMode, Filter};
use vastex_scenes::{DisplayOptions, LayerOptions, Overlay, Pose, Scene};
use vastex_viewer::layers::{CompareMode, Placement};
use vastex_viewer::{Link, ViewText, VolumeViewText};

#[cfg(feature = "build")]
pub(crate) use build::{BuildArgs, Compress};
pub(crate) use cache::CacheArgs;
#[cfg(feature = "build")]
pub(crate) use crop::{CropArgs, CropPlace, CropSize};
pub(crate) use disk_cache::DiskCacheArgs;
#[cfg(feature = "build")]
pub(crate) use export::{ExportArgs, FormatName, LayoutName};
pub(crate) use info::InfoArgs;
pub(crate) use learn::LearnArgs;
#[cfg(feature = "view")]
pub(crate) use link::{is_link, without_help};
#[cfg(feature = "build")]
pub(crate) use merge::MergeArgs;
pub(crate) use origins::OriginsArgs;
use pixels::{parse_pixel, parse_size};
#[cfg(feature = "record")]
pub(crate) use record::RecordArgs;
pub(crate) use render::{CameraMotion, PictureFormat, RenderArgs};
#[cfg(feature = "build")]
pub(crate) use replace::ReplaceArgs;
pub(crate) use replay::ReplayArgs;
#[cfg(feature = "view")]
pub(crate) use view::{Fault, NO_FILE, ViewArgs, of_link, parsed};
#[cfg(feature = "volumes")]
pub(crate) use volume::{AskedSlice, RenderVolumeArgs, Toward, VolumeFilter, VolumeScene, with_volume};
#[cfg(all(feature = "build", feature = "volumes"))]
pub(crate) use volume_build::{Downsample, Zarr};
#[cfg(all(feature = "view", feature = "volumes"))]
pub(crate) use volume_labels::LabelArgs;
#[cfg(feature = "volumes")]
pub(crate) use volume_look::{AskedChannel, VolumeLookArgs};

#[cfg(feature = "build")]
mod build;
#[cfg(feature = "build")]
mod build_kind;
mod cache;
#[cfg(feature = "build")]
mod common;
#[cfg(feature = "build")]
mod crop;
mod disk_cache;
mod estimate;
#[cfg(feature = "build")]
mod export;
mod heights;
mod info;
#[cfg(feature = "build")]
mod inset;
#[cfg(feature = "build")]
mod layer;
mod learn;
mod link;
#[cfg(feature = "build")]
mod merge;
mod origins;
mod pixels;
mod planet;
mod reading;
#[cfg(feature = "record")]
mod record;
mod render;
#[cfg(feature = "build")]
mod replace;
mod replay;
mod shown;
#[cfg(feature = "view")]
mod view;
#[cfg(feature = "volumes")]
mod volume;
#[cfg(feature = "build")]
mod volume_build;
#[cfg(feature = "volumes")]
mod volume_labels;
#[cfg(feature = "volumes")]
mod volume_look;

/// Images far larger than GPU memory, as ordinary textures.
#[derive(Debug, Parser)]
#[command(name = "vastex", version, max_term_width = 110, after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Log more to stderr: -v what happens, -vv details, -vvv everything. RUST_LOG has the last word
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub(crate) verbose: u8,
    #[command(subcommand)]
    pub(crate) command: Command,
}

const EXAMPLES: &str = "\
Examples:
  vastex build earth.jpg -o earth.vastex --address wrap,clamp
  vastex view earth.vastex --on globe
  vastex earth.jpg                                     # as `vastex view earth.jpg`: built when it is opened for the first time
  vastex render earth.vastex --on plane --size 1920x1080 -o plane.png

Exit codes: 0 done; 1 something is wrong with the input or the machine; 2 with the command line; 130 ended by Ctrl-C";

/// The command line, with `view` put before a file that stands where a command does.
pub(crate) fn with_view(mut args: Vec<OsString>) -> Vec<OsString> {
    let first = args.iter().skip(1).position(|arg| !arg.to_string_lossy().starts_with('-'));
    if let Some(place) = first.map(|place| place + 1).filter(|_| cfg!(feature = "view")) {
        let named = args[place].to_string_lossy();
        let is_command = named == "help" || Args::command().find_subcommand(&*named).is_some();
        // Something like a path need not be there: `view` says what is wrong with it.
        let is_file = named.contains(['.', '/', std::path::MAIN_SEPARATOR])
            || Link::is_link(&named)
            || Path::new(&args[place]).exists();
        if !is_command && is_file {
            args.insert(place, "view".into());
        }
    }
    args
}

/// The command behind `vastex render --on volume` and `--on slices`.
#[cfg(feature = "volumes")]
const RENDER_VOLUME: &str = "render-volume";

/// No volume is drawn.
#[cfg(not(feature = "volumes"))]
pub(crate) fn with_volume(args: Vec<OsString>, _: impl Fn(&Path) -> bool) -> Vec<OsString> {
    args
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Make a container of an image (JPEG, PNG, TIFF, OpenEXR, raw texels), a mosaic or a tile directory; a
    /// container or an OME-Zarr of a volume
    #[cfg(feature = "build")]
    Build(BuildArgs),
    /// Write a region of a level of an image or a volume as it is stored, to a NumPy array, PNG or TIFF
    #[cfg(feature = "build")]
    Crop(CropArgs),
    /// Make a tile directory for another program
    #[cfg(feature = "build")]
    Export(ExportArgs),
    /// Join the parts that `build --shard` made
    #[cfg(feature = "build")]
    Merge(MergeArgs),
    /// Put an image into a region of a container, on all levels
    #[cfg(feature = "build")]
    Replace(ReplaceArgs),
    /// Say what is in a container, a TIFF pyramid, an image or a volume
    Info(InfoArgs),
    /// Read and check every byte of a container
    Verify(VerifyArgs),
    /// Draw a scene without a window; of volumes: `vastex render VOLUME --on volume --help`
    Render(Box<RenderArgs>),
    /// Draw a volume without a window
    #[cfg(feature = "volumes")]
    #[command(name = RENDER_VOLUME, hide = true, override_usage = "vastex render --on <volume|slices> [OPTIONS] <SOURCE>")]
    RenderVolume(Box<RenderVolumeArgs>),
    /// Play a recorded trace under a policy, beside Belady's optimum
    Replay(ReplayArgs),
    /// Learn from recorded traces which pages are wanted where, to load them ahead
    Learn(LearnArgs),
    /// Write down what this program decides, draws and reads, for `cargo xtask record`
    #[cfg(feature = "record")]
    #[command(subcommand, hide = true)]
    Record(RecordArgs),
    /// Look at an image of any size in a window, flat or on a globe, a planet or a terrain
    #[cfg(feature = "view")]
    View(Box<ViewArgs>),
}

impl Args {
    /// What no single value shows: whether they make sense together.
    pub(crate) fn check(&self) -> Result<(), clap::Error> {
        match &self.command {
            #[cfg(feature = "build")]
            Command::Build(args) => args.check(),
            #[cfg(feature = "build")]
            Command::Crop(args) => args.check(),
            #[cfg(feature = "build")]
            Command::Export(args) => args.check(),
            Command::Render(args) => args.check(),
            #[cfg(feature = "volumes")]
            Command::RenderVolume(args) => args.check(),
            #[cfg(feature = "view")]
            Command::View(args) => args.check(),
            _ => Ok(()),
        }
    }
}

/// What `vastex verify` is told.
#[derive(Debug, ClapArgs)]
#[command(after_help = "\
Examples:
  vastex verify earth.vastex && cp earth.vastex /mnt/archive/

Prints every fault that it finds and exits with 1 if there is any. What an interrupted `vastex replace` left at the end is
a note, not a fault. While a container is being changed, the version before is checked; while it is checked, it is not
changed.")]
pub(crate) struct VerifyArgs {
    /// The container
    pub(crate) file: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but faults
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// What a source begins with that is no file but a generated planet.
pub(crate) const PLANET: &str = "planet:";

/// What both `render` and `view` are told.
#[derive(Clone, Debug, ClapArgs)]
pub(crate) struct SceneArgs {
    /// An image, which is built into --cache the first time; a container, a tile directory or a TIFF pyramid.
    /// Or planet:BITS[:IMAGE], a map that is generated while it is looked at, of 2^BITS texels round the
    /// equator (8 to 31) and with the continents of IMAGE, if that is named. Or a volume: OME-Zarr, Zarr,
    /// NIfTI or raw values with a sidecar, which `render` draws as such; of TIFF a stack, which it draws with
    /// --on volume or slices, else as an image. Or a link as the window copies it, vastex:FILE?view=VIEW
    pub(crate) source: PathBuf,
    /// What the image is put on
    #[arg(long, default_value = "image", value_name = "SCENE", value_parser = named(&Scene::ALL, Scene::name))]
    pub(crate) on: Scene,
    /// Where the camera is at first, as the panel of the window writes it. image:x=COLUMN,y=ROW,zoom=Z: Z is
    /// 1 where all of the image fits, 10 where a tenth does; also turn=DEGREES, clockwise, and mirror=1.
    /// plane:x=..,y=..,z=..,yaw=..,pitch=..: in halves of the plane's width, and degrees.
    /// globe:lon=..,lat=..,alt=..m: degrees, and metres above the ground; also heading=DEGREES, clockwise
    /// from north, and tilt=DEGREES, from straight down. After it may follow, each after a semicolon, what
    /// is shown there: on=SCENE, else as --on says where that is a scene of such a place; layer=.. as
    /// --layer has it, compare=.. as --compare-mode, overlay=.. as --overlay; heights as
    /// height=[NAME][:file=N][:scale=N][:zero=N]; and of a planet sun=.., exaggeration=.. and atmosphere=..
    /// as the options have them, lights=N, how bright they are, and the layers night=.. and clouds=.. Of a
    /// volume it is volume:x=..,y=..,z=..,zoom=..,yaw=..,pitch=.. with what follows there
    /// (docs/camera-paths.md)
    #[arg(long, value_name = "VIEW", value_parser = parse_view)]
    pub(crate) view: Option<String>,
    #[command(flatten)]
    pub(crate) layers: shown::ShownArgs,
    #[command(flatten)]
    pub(crate) heights: heights::HeightArgs,
    #[command(flatten)]
    pub(crate) planet: planet::PlanetArgs,
    /// Size of the picture in pixels, up to 65536 a side; one that is larger than any texture of the device
    /// is drawn in parts. By default 1280x720; a window has the size that it had when it was closed last
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub(crate) size: Option<[u32; 2]>,
    /// Draw pictures in parts of at most so many pixels a side, to see that their edges are not seen
    #[arg(long, value_name = "N", hide = true, value_parser = clap::value_parser!(u32).range(16..))]
    pub(crate) part_side: Option<u32>,
    /// GPU memory for tiles, in MiB, whatever the settings say; too little makes the picture coarser. By
    /// default as much as a picture of this size needs
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    pub(crate) pool_mib: Option<u64>,
    /// Settings of pools and of reading (vastex.toml); may be given several times, and later files override
    /// earlier ones
    #[arg(long, value_name = "FILE")]
    pub(crate) settings: Vec<PathBuf>,
    /// How texels are blended: nearest, bilinear, trilinear, anisotropic2, 4, 8 or 16 (with up to so many
    /// taps where the surface is seen at a slant), or bicubic (where the image is enlarged). By default
    /// trilinear; in a window as it was chosen there last
    #[arg(long, value_name = "FILTER")]
    pub(crate) filter: Option<Filter>,
    /// How the view says which pages it wants: by a small pass of its own, by some pixels of the picture
    /// itself, or, for adapters without compute shaders or storage buffers, by that pass read back whole. By
    /// default the best mode of the adapter; in a window the one that was chosen there last
    #[arg(long, value_name = "MODE", value_parser = named(&FeedbackMode::ALL, FeedbackMode::name))]
    pub(crate) feedback: Option<FeedbackMode>,
    /// KiB of GPU memory up to which a texture is held whole, as an ordinary one that takes no part in
    /// paging; 0: none is
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u64).range(..=1 << 22))]
    pub(crate) whole_kib: u64,
    /// KiB of tiles copied to the GPU per frame at most; by default 2048
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1 << 22))]
    pub(crate) upload_kib_per_frame: Option<u64>,
    /// Draw a diagnostic overlay instead of the picture: the levels shown, the levels wanted, how far one
    /// falls short of the other, the borders of pages, the feedback as seen, the page table, or the slots of
    /// the pool
    #[arg(long, value_name = "NAME", value_parser = named(&Overlay::ALL, Overlay::name))]
    pub(crate) overlay: Option<Overlay>,
    /// Load pages of the same content one by one, each into a slot of its own, to see what sharing saves
    #[arg(long)]
    pub(crate) no_sharing: bool,
    /// Read tiles past the system's file cache, several at a time; for containers built with --align
    #[arg(long)]
    pub(crate) direct: bool,
    #[command(flatten)]
    pub(crate) reading: reading::ReadingArgs,
    #[command(flatten)]
    pub(crate) disk_cache: DiskCacheArgs,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
}

impl SceneArgs {
    pub(crate) fn check(&self) -> Result<(), clap::Error> {
        let said = self.view_text([1; 2]);
        if said.as_ref().is_some_and(ViewText::names_layers) && self.layers.are_named() {
            return Err(conflict(
                "--view says which layers are shown; leave them out of it, or leave out --layer",
            ));
        }
        if let Some(view) = &said {
            let is_compared = view.compare_mode.is_some() && self.layers.compare_mode != CompareMode::Off;
            let is_placed = view.placement.is_some() && self.layers.placement != Placement::Stretched;
            let is_high = view.planet.exaggeration.is_some() && self.planet.exaggeration.is_some();
            let is_dense = view.planet.atmosphere.is_some() && self.planet.atmosphere.is_some();
            let twice = [
                (is_compared, "how layers are compared", "--compare-mode"),
                (is_placed, "where images of other sizes lie", "--placement"),
                (view.planet.sun.is_some() && self.planet.sun.is_some(), "where the sun stands", "--sun"),
                (is_high, "how high mountains are made", "--exaggeration"),
                (is_dense, "how dense the air is", "--atmosphere"),
            ];
            if let Some((_, what, option)) = twice.iter().find(|(is_twice, ..)| *is_twice) {
                return Err(conflict(&format!(
                    "--view says {what}; leave that out of it, or leave out {option}"
                )));
            }
        }
        let shown = self.shown();
        let files = 1 + self.files_over().count();
        let fault = shown::fault(&shown.layers, files, shown.compare_mode)
            .or_else(|| shown::beyond(said.iter().flat_map(ViewText::textures), files));
        if let Some(fault) = fault {
            return Err(value_error(&fault));
        }
        let fault = self.planet.fault(&shown, self.scene());
        fault.map_or(Ok(()), |fault| Err(conflict(&fault)))
    }

    /// How texels are blended.
    pub(crate) fn filter(&self) -> Filter {
        self.filter.unwrap_or_default()
    }

    /// What the image is put on.
    pub(crate) fn scene(&self) -> Scene {
        self.view_text([1; 2]).map_or(self.on, |view| view.scene(self.on))
    }

    /// What `--view` says over an image of so many texels, if it is there.
    pub(crate) fn view_text(&self, size: [u32; 2]) -> Option<ViewText> {
        self.view.as_deref().and_then(|text| ViewText::from_text(text, size).ok())
    }

    /// What `--view` says of a volume, if it does.
    pub(crate) fn volume_view(&self) -> Option<VolumeViewText> {
        self.view.as_deref().filter(|text| VolumeViewText::is_meant(text))?.parse().ok()
    }

    /// Fails where what is shown is of a volume, and the source is none.
    pub(crate) fn check_of_image(&self) -> anyhow::Result<()> {
        match self.volume_view() {
            Some(_) => anyhow::bail!("{}: is no volume, and --view is of one", self.source.display()),
            None => Ok(()),
        }
    }

    /// Width and height of the picture in pixels.
    pub(crate) fn size(&self) -> [u32; 2] {
        self.size.unwrap_or([1280, 720])
    }

    /// Where the camera is at first over an image of so many texels, if that is said.
    pub(crate) fn pose(&self, size: [u32; 2]) -> Option<Pose> {
        self.view_text(size).map(|view| view.pose)
    }

    /// Returns true if black and white of what is shown are nobody's choice: neither options nor a view say
    /// them.
    pub(crate) fn range_is_free(&self) -> bool {
        let named = self.view_text([1; 2]).is_some_and(|view| view.names_layers());
        self.layers.range_is_free() && !named
    }

    /// The overlay that is drawn in the place of the picture.
    pub(crate) fn overlay(&self) -> Option<Overlay> {
        self.view_text([1; 2]).map_or(self.overlay, |view| match self.overlay {
            // What the command line asks for is drawn, unless the view says so itself.
            Some(asked) => view.overlay.unwrap_or(Some(asked)),
            None => view.overlay(None),
        })
    }

    /// Returns true if one opaque layer is shown.
    fn shows_one_layer(&self) -> bool {
        matches!(&self.shown().layers[..], [layer] if layer.is_visible && layer.opacity >= 1.0)
    }

    /// The files that are opened beside the source, in the order in which they are counted after it: those of
    /// `--over`, then those of a planet.
    pub(crate) fn files_over(&self) -> impl Iterator<Item = &Path> {
        self.layers.over.iter().map(PathBuf::as_path).chain(self.planet.files())
    }

    /// What is shown of the textures, whatever they are: what the view says in the place of what options say.
    pub(crate) fn shown(&self) -> DisplayOptions {
        let mut heights = self.heights.heights();
        let planet = self.planet.options(1 + self.layers.over.len(), &mut heights);
        let mut shown = DisplayOptions {
            layers: self.layers.layers(),
            compare_mode: self.layers.compare_mode,
            placement: self.layers.placement,
            heights,
            planet,
            ..DisplayOptions::default()
        };
        let Some(view) = self.view_text([1; 2]) else { return shown };
        let (mode, placement) = (shown.compare_mode, shown.placement);
        view.change(&mut shown);
        shown.compare_mode = view.compare_mode.unwrap_or(mode);
        shown.placement = view.placement.unwrap_or(placement);
        if !view.names_layers() {
            // A file that lights, clouds or heights are of is shown as a layer only if one is named.
            let is_named = |texture| self.layers.layers.iter().any(|layer| layer.texture == texture);
            let of_planet = shown.clone();
            let is_shown =
                |layer: &LayerOptions| !of_planet.is_of_planet(layer.texture) || is_named(layer.texture);
            shown.layers.retain(is_shown);
        }
        shown
    }
}

/// A minute.
const MOST_FADE_MS: u64 = 60_000;

/// One of a few values, by its name.
fn named<T>(all: &'static [T], name: fn(T) -> &'static str) -> impl TypedValueParser<Value = T>
where
    T: Copy + Send + Sync + 'static,
{
    let names = PossibleValuesParser::new(all.iter().map(|&value| name(value)));
    names.try_map(move |given| {
        all.iter().copied().find(|&value| name(value) == given).ok_or("there is no such value")
    })
}

/// Where a camera is; an image's size does not decide whether it can be read.
fn parse_view(text: &str) -> Result<String, String> {
    if VolumeViewText::is_meant(text) {
        return text.parse::<VolumeViewText>().map(|_| text.to_owned()).map_err(|error| error.to_string());
    }
    let read = ViewText::from_text(text, [1; 2]);
    read.map(|_| text.to_owned()).map_err(|error| error.to_string())
}

/// Two things that do not go together, exit code 2.
fn conflict(what: &str) -> clap::Error {
    let kind = clap::error::ErrorKind::ArgumentConflict;
    clap::Error::raw(kind, format!("{what}\n\nFor more information, try '--help'.\n"))
}

/// An error of the command line, exit code 2.
fn value_error(what: &str) -> clap::Error {
    let kind = clap::error::ErrorKind::ValueValidation;
    clap::Error::raw(kind, format!("invalid value {what}\n\nFor more information, try '--help'.\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "view")]
    #[test]
    fn a_file_in_the_place_of_a_command_is_viewed() {
        let cases = [
            ("vastex earth.vastex --on globe", "vastex view earth.vastex --on globe"),
            ("vastex -v tiles/", "vastex -v view tiles/"),
            ("vastex src", "vastex view src"),
            ("vastex render earth.vastex", "vastex render earth.vastex"),
            ("vastex help", "vastex help"),
            ("vastex veiw earth.vastex", "vastex veiw earth.vastex"),
            ("vastex --help", "vastex --help"),
            ("vastex", "vastex"),
        ];
        for (given, meant) in cases {
            let split = |line: &str| line.split(' ').map(OsString::from).collect::<Vec<_>>();
            assert_eq!(with_view(split(given)), split(meant), "{given}");
        }
    }

    #[test]
    fn the_definition_is_sound() {
        Args::command().debug_assert();
    }
}
