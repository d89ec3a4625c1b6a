//! `vastex view SOURCE [FILE]...`: a window.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::{MOST_FADE_MS, SceneArgs};

/// What `vastex view` is told.
#[derive(Debug, ClapArgs)]
#[command(after_help = "\
Examples:
  vastex view earth.vastex
  vastex view earth.vastex --on globe --pool-mib 256
  vastex view island.vastex --on terrain
  vastex view island.vastex --layer color --layer height:map=inferno:opacity=0.4
  vastex view scan.jpg --view image:x=12000,y=3400,zoom=40,turn=90
  vastex view before.tif --over after.tif --compare-mode swipe
  vastex view scan.jpg slides/*.svs

Keys and mouse:
  drag, a finger move the image, turn the globe, look about on the plane and the terrain; let go in motion, it goes on
  wheel, + and - zoom, as I and O; two fingers do, too
  1 to 9         so many pixels a texel; with Ctrl so many texels a pixel
  double click   back to the first view, as Home, R and 0
  arrows, WASD   walk
  T, X, Y        turn an image by a quarter (Shift+T back), exchange left and right, top and bottom
  F1 to F4, Tab  image, plane, globe, terrain; the next of them
  G              guides over an image: a map, a scale, lines between large texels with their values
  V              compare the uppermost layer with those beneath it: swipe, flicker, difference; then not
  L              the next overlay: levels, wanted, deficit, pages, feedback, table, atlas; then the picture again
  right click    explain the pixel: in the title, and in full on stdout
  N, P           the next file or the one before, of those named or dropped, else of the folder; as page down and page up
  dropped files  show the first of them
  M              the panel: files, and how values become colours
  K              measure an image: a click sets a point, a double click closes the line, Backspace takes the last one back
  C              black and white by the values in view
  ?, H           keys and gestures, in the window
  F, F11         full screen
  Esc, Q         quit")]
pub(crate) struct ViewArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Further files to step through with N and P
    #[arg(value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// Milliseconds in which a tile fades in from what was on screen before; 0: it is there at once. By default 150, or 0 where a
    /// processor draws in the place of a GPU
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=MOST_FADE_MS))]
    pub(crate) fade_ms: Option<u64>,
    /// Print as JSON when something could be seen, and close the window some seconds after all is sharp, for benchmarks
    #[arg(long, hide = true, conflicts_with = "exit_after_frames")]
    pub(crate) times: bool,
    /// Close the window after so many frames of the source itself, for tests
    #[arg(long, value_name = "N", hide = true)]
    pub(crate) exit_after_frames: Option<u64>,
}
