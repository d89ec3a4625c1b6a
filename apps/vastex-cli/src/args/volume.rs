//! What `vastex render` is told of volumes: `--on volume` and `--on slices`.
//!
//! These words are others than those of images, so they are a command of their own behind the same name:
//! which of the two is meant follows from `--on` ([`super::with_volume`]).

mod of_images;
mod paging;
mod path;
mod slice;
mod watch;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{Args as ClapArgs, CommandFactory};
use vastex::FeedbackMode;
use vastex_viewer::volume::{VolumeCamera, VolumeFace, VolumeMode};
use vastex_viewer::{Link, VolumeViewText};

use super::volume_look::{VolumeLookArgs, range};
use super::{conflict, named, parse_size, value_error};
use of_images::OfImagesArgs;
use paging::VolumePagingArgs;
use path::VolumePathArgs;
pub(crate) use slice::AskedSlice;
use slice::parse_slice;
use watch::VolumeWatchArgs;

/// Puts the command for volumes in the place of `render` where `--on` names what only volumes are put on, and
/// where it names nothing and `is_volume` says that the source is one: its other words are others.
pub(crate) fn with_volume(mut args: Vec<OsString>, is_volume: impl Fn(&Path) -> bool) -> Vec<OsString> {
    let is_on_volume = |word: &str| VolumeScene::ALL.iter().any(|scene| scene.name() == word);
    let words: Vec<String> = args.iter().map(|arg| arg.to_string_lossy().into_owned()).collect();
    let place = words.iter().skip(1).position(|word| !word.starts_with('-')).map(|place| place + 1);
    let Some(place) = place.filter(|&place| words[place] == "render") else { return args };
    let follows = words.windows(2).any(|two| two[0] == "--on" && is_on_volume(&two[1]));
    let is_joined = words.iter().any(|word| word.strip_prefix("--on=").is_some_and(is_on_volume));
    let says_on = words.iter().any(|word| word == "--on" || word.starts_with("--on="));
    // The view of a volume says so itself.
    let is_view = words.windows(2).any(|two| two[0] == "--view" && VolumeViewText::is_meant(&two[1]))
        || words.iter().any(|word| word.strip_prefix("--view=").is_some_and(VolumeViewText::is_meant))
        || words.iter().any(|word| {
            let view = word.parse::<Link>().ok().and_then(|link| link.view);
            view.is_some_and(|view| VolumeViewText::is_meant(&view))
        });
    let source = || {
        let source = source_in(&words[place + 1..]).map(|n| &args[place + 1 + n])?;
        let link = source.to_str().and_then(|text| text.parse::<Link>().ok());
        Some(link.map_or_else(|| PathBuf::from(source), |link| link.source.into()))
    };
    let is_meant = follows || is_joined || is_view;
    if is_meant || (!says_on && source().is_some_and(|source| is_volume(&source))) {
        args[place] = super::RENDER_VOLUME.into();
        if !follows && !is_joined {
            let is_slice = words.iter().any(|word| word == "--slice" || word.starts_with("--slice="));
            let on = if is_slice { VolumeScene::Slices } else { VolumeScene::Volume };
            args.insert(place + 1, format!("--on={}", on.name()).into());
        }
    }
    args
}

/// Where in the words of `render` the source is: the first word that is no option, and no value of one.
fn source_in(words: &[String]) -> Option<usize> {
    let command = super::Args::command();
    let commands = ["render", super::RENDER_VOLUME].map(|name| command.find_subcommand(name));
    let options: Vec<&clap::Arg> = commands.into_iter().flatten().flat_map(|of| of.get_arguments()).collect();
    let takes_value = |word: &str| {
        let is = |option: &&&clap::Arg| {
            let is_long = option.get_long().is_some_and(|long| word.strip_prefix("--") == Some(long));
            let short = option.get_short().map(|short| format!("-{short}"));
            is_long || short.is_some_and(|short| word == short)
        };
        options.iter().find(is).is_some_and(|option| option.get_action().takes_values())
    };
    let is_value = |n: usize| n > 0 && takes_value(&words[n - 1]);
    (0..words.len()).find(|&n| !words[n].starts_with('-') && !is_value(n))
}

/// What volumes are put on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum VolumeScene {
    /// Rays through all of it.
    Volume,
    /// A plane of its voxels.
    Slices,
}

impl VolumeScene {
    pub(crate) const ALL: [VolumeScene; 2] = [VolumeScene::Volume, VolumeScene::Slices];

    pub(crate) fn name(self) -> &'static str {
        match self {
            VolumeScene::Volume => "volume",
            VolumeScene::Slices => "slices",
        }
    }
}

/// From where a volume is seen.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Toward {
    /// Along an axis, in parallel rays.
    Face(VolumeFace),
    /// In perspective from around it: degrees round the z axis from +y, and above the plane of x and y.
    Around {
        /// Clockwise, seen from above.
        yaw: f64,
        /// Upward.
        pitch: f64,
    },
    /// As a view says that was copied.
    View(Box<VolumeViewText>),
}

/// How voxels are blended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum VolumeFilter {
    /// By the device, where it can.
    Linear,
    /// By the shader, in single precision.
    Exact,
    /// Not at all.
    Nearest,
}

impl VolumeFilter {
    const ALL: [VolumeFilter; 3] = [VolumeFilter::Linear, VolumeFilter::Exact, VolumeFilter::Nearest];

    fn name(self) -> &'static str {
        match self {
            VolumeFilter::Linear => "linear",
            VolumeFilter::Exact => "exact",
            VolumeFilter::Nearest => "nearest",
        }
    }
}

/// What `vastex render --on volume|slices` is told.
#[derive(Clone, Debug, ClapArgs)]
#[command(after_help = "\
Examples:
  vastex render head.zarr --on volume --mode mip --view +z -o head.png
  vastex render cells.zarr --on volume --mode emission --view around:yaw=30,pitch=20 --channels 0:00FF00,1:FF00FF -o cells.png
  vastex render scan.nii.gz --on slices --slice y=120 --range 0,0.1 -o slice.png
  vastex render head.zarr --on slices --slice plane:x=49,y=58,z=47,nx=1,ny=-1,nz=0.5 -o oblique.png
  vastex render bones.zarr --on volume --mode iso --iso 300 --view -y --json -o bones.png
  vastex render cells.zarr --on slices --slice z=40 --labels nuclei --label-outlines -o nuclei.png
  vastex render head.zarr --on volume --mode emission --camera-path around.path --size 640x480 -o frame-%04d.png

The picture is drawn once everything in view is loaded. docs/volumes.md says what each mode shows.")]
pub(crate) struct RenderVolumeArgs {
    /// A volume: OME-Zarr, Zarr, NIfTI, a TIFF stack, raw values with a sidecar, or one that vastex built; or
    /// a link as the window copies it, vastex:FILE?view=VIEW
    pub(crate) source: PathBuf,
    /// volume: rays through all of it; slices: a plane of its voxels
    #[arg(long, value_name = "SCENE", value_parser = named(&VolumeScene::ALL, VolumeScene::name))]
    pub(crate) on: VolumeScene,
    #[command(flatten)]
    pub(crate) look: VolumeLookArgs,
    /// From where it is seen: along an axis, +x, -x, +y, -y, +z or -z, in parallel rays; or
    /// around:yaw=DEGREES,pitch=DEGREES, in perspective. Where the picture is as large as the face is in
    /// voxels, a pixel is a voxel. Or a view as the window copies it, volume:x=..,y=..,z=..,zoom=..,yaw=..,
    /// pitch=.. with all that is shown there [default: +z]
    #[arg(long, value_name = "VIEW", value_parser = parse_toward, allow_hyphen_values = true)]
    pub(crate) view: Option<Toward>,
    /// Which plane of voxels: x=K, y=K or z=K, K counting voxels of the finest level from 0; or
    /// plane:x=X,y=Y,z=Z,nx=N,ny=N,nz=N, through a point, in voxels of the finest level, with a normal, in
    /// lengths of the world, which points away from the eye
    #[arg(long, value_name = "AXIS=K|PLANE", value_parser = parse_slice)]
    pub(crate) slice: Option<AskedSlice>,
    /// The values that are dark and bright where a channel names none: 0 to 1 of the full range of whole
    /// numbers, stored values of floats
    #[arg(long, value_name = "LO,HI", value_parser = parse_range, allow_hyphen_values = true)]
    pub(crate) range: Option<[f64; 2]>,
    /// How voxels are blended: linear, by the device; exact, by the shader in single precision; or nearest
    #[arg(long, default_value = "linear", value_name = "FILTER", value_parser = named(&VolumeFilter::ALL, VolumeFilter::name))]
    pub(crate) filter: VolumeFilter,
    // Hidden: `cargo xtask record` alone draws volumes by each mode, whose pictures are the same.
    /// How the view says which bricks it wants, as images have it; by default the best mode of the adapter
    #[arg(long, value_name = "MODE", hide = true, value_parser = named(&FeedbackMode::ALL, FeedbackMode::name))]
    pub(crate) feedback: Option<FeedbackMode>,
    /// Size of the picture in pixels
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = parse_size)]
    pub(crate) size: [u32; 2],
    /// GPU memory for bricks, in MiB; too little makes the picture coarser. By default as much as all bricks
    /// of all levels take, up to 1 GiB, and as much for labels
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    pub(crate) pool_mib: Option<u64>,
    /// A directory for levels that the file lacks and that are made of its coarsest one; or off: they are
    /// made in memory [default: off]
    #[arg(long, value_name = "DIR|off")]
    pub(crate) cache: Option<PathBuf>,
    /// Where to write the picture, as PNG; with --camera-path and %04d in its name every picture of the path,
    /// and its number there, from 0 on; - with --format raw for stdout
    #[arg(short, long, value_name = "OUT.png")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) path: VolumePathArgs,
    /// Print figures about the run as JSON
    #[arg(long)]
    pub(crate) json: bool,
    /// Compare with the picture that ordinary 3-D textures give, of up to 1 GiB
    #[arg(long)]
    pub(crate) compare: bool,
    #[command(flatten)]
    pub(crate) watch: VolumeWatchArgs,
    #[command(flatten)]
    pub(crate) paging: VolumePagingArgs,
    #[command(flatten)]
    of_images: OfImagesArgs,
}

impl RenderVolumeArgs {
    /// Where levels are kept that are made.
    pub(crate) fn cache(&self) -> Option<PathBuf> {
        self.cache.clone().filter(|cache| cache.as_os_str() != "off")
    }

    /// Puts what a link and a view say in the place of what options say.
    pub(crate) fn follow_view(&mut self) -> Result<(), clap::Error> {
        if let Some(link) = super::link::link_of(&self.source)? {
            if let Some(file) = link.files.first() {
                return Err(conflict(&format!(
                    "the link names {file} beside a volume, over which nothing lies"
                )));
            }
            if link.view.is_some() && self.view.is_some() {
                return Err(conflict(
                    "the link says which view is shown, and --view does; leave out one of them",
                ));
            }
            self.source = link.source.into();
            if let Some(view) = link.view {
                let view = parse_toward(&view)
                    .map_err(|why| value_error(&format!("'{view}' of the link: {why}")))?;
                self.view = Some(view);
            }
        }
        match &self.view {
            Some(Toward::View(view)) => self.look.follow_view(view),
            _ => Ok(()),
        }
    }

    /// Checks that what is asked for goes together.
    pub(crate) fn check(&self) -> Result<(), clap::Error> {
        let wrong = |why: String| Err(value_error(&why));
        self.of_images.check()?;
        self.look.check()?;
        self.watch.check(self.on == VolumeScene::Slices && self.slice.is_some(), self.size)?;
        let is_view = matches!(self.view, Some(Toward::View(_)));
        let is_iso = self.look.mode() == VolumeMode::Iso && self.on == VolumeScene::Volume;
        if is_iso && self.look.iso.is_none() && !is_view {
            return wrong(
                "'iso' for '--mode <MODE>': it shows where a value is reached; say which with --iso V".into(),
            );
        }
        if is_view && self.slice.is_some() {
            return wrong("'--slice': the view says which slices are seen; leave out one of them".into());
        }
        match (self.on, self.slice) {
            (VolumeScene::Slices, None) if !is_view => wrong(
                "'slices' for '--on <SCENE>': it shows a plane of voxels; say which with --slice z=K".into(),
            ),
            (VolumeScene::Volume, Some(_)) => wrong("'--slice': it goes with --on slices".into()),
            (VolumeScene::Slices, Some(_)) if self.look.mode.is_some() => {
                wrong("'--mode': a slice shows its voxels as they are; it goes with --on volume".into())
            }
            (VolumeScene::Slices, Some(_)) if self.view.is_some() => {
                wrong("'--view': --slice says from where a slice is seen; it goes with --on volume".into())
            }
            _ => self.path.check(self),
        }
    }

    /// A camera in perspective, if one is asked for.
    pub(crate) fn camera(&self, of: &vastex_viewer::volume::VolumeBox) -> Option<VolumeCamera> {
        let Some(Toward::Around { yaw, pitch }) = self.view else { return None };
        let (yaw, pitch) = (yaw.to_radians(), pitch.to_radians());
        let toward = [-yaw.sin() * pitch.cos(), yaw.cos() * pitch.cos(), pitch.sin()];
        // z is downward, as it is in the faces that are seen along x and y.
        Some(VolumeCamera::around(of, toward, [0.0, 0.0, 1.0]))
    }
}

fn parse_toward(text: &str) -> Result<Toward, String> {
    if VolumeViewText::is_meant(text) {
        let view = text.parse::<VolumeViewText>();
        return view.map(|view| Toward::View(Box::new(view))).map_err(|error| error.to_string());
    }
    let Some(angles) = text.strip_prefix("around:") else {
        let faces = |error| format!("{error}; or write around:yaw=30,pitch=20");
        return text.parse().map(Toward::Face).map_err(faces);
    };
    let (mut yaw, mut pitch) = (0.0, 0.0);
    for angle in angles.split(',') {
        let degrees = |value: &str, most: f64| {
            value.parse().ok().filter(|degrees: &f64| degrees.abs() <= most).ok_or_else(|| {
                format!("'{angle}': write degrees from -{most} to {most}, as in around:yaw=30,pitch=20")
            })
        };
        match angle.split_once('=') {
            Some(("yaw", value)) => yaw = degrees(value, 360.0)?,
            Some(("pitch", value)) => pitch = degrees(value, 89.9)?,
            _ => return Err(format!("'{angle}': there are yaw=DEGREES and pitch=DEGREES")),
        }
    }
    Ok(Toward::Around { yaw, pitch })
}

fn parse_range(text: &str) -> Result<[f64; 2], String> {
    range(text, ",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_that_is_a_volume_is_drawn_as_one_unless_something_else_is_asked_for() {
        let with = |line: &str| {
            let words = line.split(' ').map(OsString::from).collect();
            let words = with_volume(words, |path| path.extension().is_some_and(|ending| ending == "zarr"));
            words.iter().map(|word| word.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
        };
        for (line, expected) in [
            ("vastex render a.zarr -o v.png", "vastex render-volume --on=volume a.zarr -o v.png"),
            ("vastex render --json -o v a.zarr", "vastex render-volume --on=volume --json -o v a.zarr"),
            ("vastex render a.zarr --slice z=3", "vastex render-volume --on=slices a.zarr --slice z=3"),
            ("vastex -v render vastex:a.zarr", "vastex -v render-volume --on=volume vastex:a.zarr"),
            ("vastex render a.zarr --on slices", "vastex render-volume a.zarr --on slices"),
        ] {
            assert_eq!(with(line), expected);
        }
        for line in [
            "vastex render a.png -o b.zarr",
            "vastex render --size 3x4 a.png --over b.zarr",
            "vastex render a.zarr --on globe",
            "vastex view a.zarr",
            "vastex info a.zarr",
        ] {
            assert_eq!(with(line), line);
        }
    }

    #[test]
    fn views_are_checked() {
        assert_eq!(parse_toward("-x"), Ok(Toward::Face(VolumeFace::MinusX)));
        assert_eq!(parse_toward("around:pitch=-20"), Ok(Toward::Around { yaw: 0.0, pitch: -20.0 }));
        assert!(matches!(parse_toward("volume:x=1,y=2,z=3,zoom=1,yaw=0,pitch=0"), Ok(Toward::View(_))));
        for bad in
            ["x", "volume:x=1", "around:", "around:yaw=nan", "around:pitch=90", "around:roll=1", "globe"]
        {
            assert!(parse_toward(bad).is_err(), "{bad}");
        }
    }
}
