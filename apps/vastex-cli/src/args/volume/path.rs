//! How the camera moves in `vastex render` of a volume, and what its pictures are written as.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use vastex_scenes::Path as CameraPath;

use super::super::render::{PictureFormat, check_is_png};
use super::super::{named, value_error};
use super::{RenderVolumeArgs, Toward, VolumeScene};

/// How the camera moves.
#[derive(Clone, Debug, ClapArgs)]
pub(crate) struct VolumePathArgs {
    /// A file in which places of the camera are written down, each as volume:x=..,y=..,z=..,zoom=..,yaw=..,
    /// pitch=.., perhaps with slices=.. and time=.. (docs/camera-paths.md): every picture of it is drawn.
    /// What is shown there --view and the other options say; with a --view of one slice that one is drawn
    #[arg(long, value_name = "FILE")]
    pub(crate) camera_path: Option<PathBuf>,
    /// Draw so many pictures of the path
    #[arg(long, value_name = "N", requires = "camera_path", value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    pub(crate) frames: Option<u64>,
    /// What pictures are written as: png; or raw, each pixel as four bytes: red, green, blue and alpha,
    /// picture after picture
    #[arg(long, default_value = "png", value_name = "FORMAT", requires = "output", value_parser = named(&PictureFormat::ALL, PictureFormat::name))]
    pub(crate) format: PictureFormat,
}

impl VolumePathArgs {
    /// Fails where it does not go with what else is asked for.
    pub(super) fn check(&self, args: &RenderVolumeArgs) -> Result<(), clap::Error> {
        if let Some(path) = &self.camera_path {
            let is_named = |known: &CameraPath| path.as_os_str() == known.name();
            if let Some(known) = CameraPath::ALL.iter().find(|known| is_named(known) && !path.exists()) {
                return Err(value_error(&format!(
                    "'{}' for '--camera-path <FILE>': it is a path over images; places of a path round a volume are written down in a file \
                     (docs/camera-paths.md), as the window does by F8",
                    known.name()
                )));
            }
            let why = match (args.on, &args.view) {
                (VolumeScene::Slices, _) => Some(
                    "'--camera-path': use it with --on volume; for slices of a path add --view 'volume:..;panes=z'",
                ),
                (_, Some(Toward::Face(_) | Toward::Around { .. })) => Some(
                    "'--camera-path': it says from where the volume is seen, and --view does; leave out one of them",
                ),
                _ if args.compare => Some("'--compare': it is of one picture; leave out --camera-path"),
                _ => None,
            };
            if let Some(why) = why {
                return Err(value_error(why));
            }
        }
        let is_stdout = args.output.as_deref().is_some_and(|output| output.as_os_str() == "-");
        match (self.format, &args.output) {
            (PictureFormat::Raw, _) if is_stdout && args.json => {
                Err(value_error("'--json': stdout has the pictures; write them into a file"))
            }
            (PictureFormat::Raw, _) | (_, None) => Ok(()),
            (PictureFormat::Png, Some(_)) if is_stdout => {
                Err(value_error("'-' for '--output <OUT.png>': to stdout pictures go with --format raw"))
            }
            (PictureFormat::Png, Some(output)) => check_is_png(output, "--output"),
        }
    }
}
