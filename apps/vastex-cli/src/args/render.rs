//! What `vastex render` is told.

mod run_files;

use std::path::{Path, PathBuf};

use vastex_scenes::{Path as CameraPath, Views};

use super::estimate::EstimateArgs;
use super::{ClapArgs, MOST_FADE_MS, SceneArgs, conflict, named, parse_pixel, value_error};
pub(crate) use run_files::RunFilesArgs;

/// How the camera moves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum CameraMotion {
    /// As a path that the program knows.
    BuiltIn(CameraPath),
    /// As a file says, see docs/camera-paths.md.
    File(PathBuf),
}

impl CameraMotion {
    /// The path that the program knows; of a file, to stand still.
    #[cfg(feature = "record")]
    pub(crate) fn built_in(&self) -> CameraPath {
        match self {
            CameraMotion::BuiltIn(path) => *path,
            CameraMotion::File(_) => CameraPath::Still,
        }
    }
}

/// What pictures are written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PictureFormat {
    Png,
    /// Red, green, blue and alpha of each pixel, a byte each, picture after picture.
    Raw,
}

impl PictureFormat {
    pub(super) const ALL: [PictureFormat; 2] = [PictureFormat::Png, PictureFormat::Raw];

    pub(super) fn name(self) -> &'static str {
        match self {
            PictureFormat::Png => "png",
            PictureFormat::Raw => "raw",
        }
    }
}

/// What `vastex render` is told.
#[derive(Debug, ClapArgs)]
#[command(after_help = "\
Examples:
  vastex render earth.vastex --on globe -o globe.png
  vastex render earth.vastex --on plane --size 1920x1080 --camera-path fly --frames 120 -o fly.png
  vastex render earth.vastex --on plane --pool-mib 4 --compare --json
  vastex render earth.vastex --on plane --filter anisotropic8 -o sharp-to-the-horizon.png
  vastex render /net/slow/earth.vastex --on globe --disk-cache ~/.cache/vastex -o globe.png
  vastex render island.vastex --layer-shown height --range 0,0.2 -o height.png
  vastex render island.vastex --layer color --layer height:range=0..0.2:map=viridis:opacity=0.5 -o both.png
  vastex render earth.vastex --view globe:lon=11.5,lat=46.4,alt=200000m -o alps.png
  vastex render before.tif --over after.tif --compare-mode difference:16 -o changes.png
  vastex render earth.vastex --on plane --feedback inline --compare --json
  vastex render island.vastex --on terrain --height-scale 0.1 -o island.png
  vastex render earth.vastex --on plane --views stereo --compare -o eyes.png
  vastex render earth.vastex --on plane --camera-path fly --predict --stats-csv fly.csv
  vastex render earth.vastex --camera-path flight.path -o frame-%04d.png
  vastex render earth.vastex --camera-path flight.path --size 1280x720 --format raw -o - | \\
    ffmpeg -f rawvideo -pix_fmt rgba -s 1280x720 -r 30 -i - flight.mp4
  vastex render earth.vastex --on plane --camera-path fly --pool-mib 8 --report fly/
  vastex render earth.vastex --on globe --camera-path spin --record-trace spin.vxtrace
  vastex render earth.vastex --on globe --camera-path fly --stats-csv fly.csv --dump-pools
  vastex render earth.vastex --on plane --frames 12 --overlay deficit -o deficit.png --explain 640,700
  vastex render earth.vastex --on globe --estimate quadtree -o without-feedback.png
  vastex render 'vastex:/data/earth.jpg?file=/data/night.jpg&view=globe:lon=9,lat=36,alt=9000000m;on=planet;layer=;night=:file=2' \\
    -o night.png
  vastex render earth.vastex --on plane --fade-ms 200 --frames 8 -o fading-in.png

Without --frames it plays the camera path to its end and holds the last pose until everything is loaded; if not
everything is loaded within 10,000 frames, the picture is written as it is and the exit code is 1.")]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// How the camera moves: still, fly, spin, zoom or teleport, which last 300 frames (still: 1) and hold
    /// their last pose; or a file in which places of the camera are written down, as the window records it
    /// (docs/camera-paths.md)
    #[arg(
        long,
        default_value = "still",
        value_name = "NAME|FILE",
        value_parser = parse_motion,
        conflicts_with = "view"
    )]
    pub(crate) camera_path: CameraMotion,
    /// What the picture shows: one view, or two side by side, with feedback from each: what two eyes see, or
    /// what is ahead and what a mirror shows of what is behind
    #[arg(long, default_value = "one", value_name = "VIEWS", value_parser = named(&Views::ALL, Views::name))]
    pub(crate) views: Views,
    /// Load ahead what the camera is expected to see if it goes on as it does
    #[arg(long)]
    pub(crate) predict: bool,
    /// Milliseconds in which a tile fades in from what was on screen before, at 60 frames a second; 0: it is
    /// there at once
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u64).range(..=MOST_FADE_MS))]
    pub(crate) fade_ms: u64,
    /// Draw so many frames
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    pub(crate) frames: Option<u64>,
    /// Go on until everything in view is loaded (the default)
    #[arg(long, conflicts_with = "frames")]
    pub(crate) until_converged: bool,
    /// Frames that a load takes, so that every run is the same; without effect with --realtime
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub(crate) latency_frames: u64,
    /// Wait for nothing, as a window does
    #[arg(long)]
    pub(crate) realtime: bool,
    /// Where to write the last picture, as PNG. With %04d in its name, every picture of the path, each once
    /// all in view is loaded, and its number there, from 0 on; - with --format raw for stdout
    #[arg(short, long, value_name = "OUT.png")]
    pub(crate) output: Option<PathBuf>,
    /// What pictures are written as: png; or raw, every picture of the path one after the other, each pixel
    /// as four bytes: red, green, blue and alpha
    #[arg(long, default_value = "png", value_name = "FORMAT", requires = "output", value_parser = named(&PictureFormat::ALL, PictureFormat::name))]
    pub(crate) format: PictureFormat,
    /// Write a page about the run into this directory, DIR/index.html: its pictures, what each frame did,
    /// settings and warnings
    #[arg(long, value_name = "DIR")]
    pub(crate) report: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) estimate: EstimateArgs,
    #[command(flatten)]
    pub(crate) files: RunFilesArgs,
    /// Load ahead what was wanted before where the camera is and where it is heading: sets made by `vastex
    /// learn`
    #[arg(long, value_name = "FILE")]
    pub(crate) prefetch_sets: Option<PathBuf>,
    /// Tell what is in each pool at the end: pages by texture and level, the largest first; with --json as
    /// `pools`
    #[arg(long)]
    pub(crate) dump_pools: bool,
    /// Explain a pixel of the last picture, counted from the top left: the page that it wants, what is shown
    /// instead and what that waits for; with --json as `explained`
    #[arg(long, value_name = "X,Y", value_parser = parse_pixel)]
    pub(crate) explain: Option<[u32; 2]>,
    /// Compare the last picture with one drawn from an ordinary texture
    #[arg(long)]
    pub(crate) compare: bool,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

impl RenderArgs {
    pub(super) fn check(&self) -> Result<(), clap::Error> {
        self.scene.check()?;
        let [width, height] = self.scene.size();
        if let Some([x, y]) = self.explain.filter(|&[x, y]| x >= width || y >= height) {
            return Err(value_error(&format!(
                "'{x},{y}' for '--explain <X,Y>': the picture has {width}x{height} pixels, counted from 0,0"
            )));
        }
        if self.estimate.estimating().is_some() && self.scene.shown().displaces(self.scene.scene()) {
            return Err(conflict("--estimate knows surfaces without heights; leave it out, or the heights"));
        }
        if self.compare && self.scene.scene() == vastex_scenes::Scene::Planet {
            return Err(conflict(
                "--compare compares colours with an ordinary texture's, and a planet's are lit; leave it out, or put the image --on globe",
            ));
        }
        if !self.scene.shows_one_layer() {
            if self.compare {
                return Err(conflict(
                    "--compare compares one opaque layer; leave it out, or show one --layer",
                ));
            }
            if self.estimate.estimating().is_some() {
                return Err(conflict("--estimate knows one opaque layer; leave it out, or show one --layer"));
            }
        }
        let Some(output) = &self.output else { return Ok(()) };
        let is_stdout = output.as_os_str() == "-";
        if self.format == PictureFormat::Raw {
            if is_stdout && self.json {
                return Err(conflict(
                    "--json and raw pictures would both go to stdout; leave one of them out",
                ));
            }
            return Ok(());
        }
        if is_stdout {
            return Err(value_error("'-' for '--output <OUT.png>': to stdout pictures go with --format raw"));
        }
        check_is_png(output, "--output")
    }
}

/// Fails where the name of a picture promises another format than PNG.
pub(super) fn check_is_png(output: &Path, option: &str) -> Result<(), clap::Error> {
    const OTHERS: [&str; 9] = ["jpg", "jpeg", "tif", "tiff", "webp", "bmp", "gif", "exr", "vastex"];
    let extension = output.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    if !OTHERS.contains(&extension.as_str()) {
        return Ok(());
    }
    let output = output.display();
    Err(value_error(&format!(
        "'{output}' for '{option} <OUT.png>': the picture is written as PNG; give it the ending .png"
    )))
}

fn parse_motion(text: &str) -> Result<CameraMotion, String> {
    if let Some(known) = CameraPath::ALL.into_iter().find(|path| path.name() == text) {
        return Ok(CameraMotion::BuiltIn(known));
    }
    let path = Path::new(text);
    if path.extension().is_some() || text.contains(['/', std::path::MAIN_SEPARATOR]) || path.exists() {
        return Ok(CameraMotion::File(path.to_owned()));
    }
    let names = CameraPath::ALL.map(CameraPath::name).join(", ");
    Err(format!("write one of {names}, or the name of a file, as in flight.path"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_moves_by_a_name_or_a_file() {
        assert_eq!(parse_motion("spin"), Ok(CameraMotion::BuiltIn(CameraPath::Spin)));
        for file in ["flight.path", "a/spin", "Cargo.toml"] {
            assert_eq!(parse_motion(file), Ok(CameraMotion::File(file.into())));
        }
        assert!(parse_motion("spni").unwrap_err().contains("still, fly, spin"));
    }
}
