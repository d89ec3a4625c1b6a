//! What `vastex render` is told of volumes: `--on volume` and `--on slices`.
//!
//! These words are others than those of images, so they are a command of their own behind the same name:
//! which of the two is meant follows from `--on` ([`super::with_volume`]).

use std::path::PathBuf;

use clap::Args as ClapArgs;
use vastex_viewer::Palette;
use vastex_viewer::volume::{MOST_CHANNELS, VolumeCamera, VolumeFace, VolumeMode};

use super::volume_labels::LabelArgs;
use super::{named, parse_size, value_error};

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
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// A channel as it is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AskedChannel {
    /// Which, from 0.
    pub(crate) channel: u64,
    /// sRGB codes.
    pub(crate) color: Option<[u8; 3]>,
    /// Colours of places in the range, in the place of the one colour.
    pub(crate) map: Option<Palette>,
    /// Stored values.
    pub(crate) range: Option<[f64; 2]>,
    /// 0 to 1.
    pub(crate) opacity: Option<f32>,
}

impl AskedChannel {
    /// A channel of which nothing else is said.
    pub(crate) fn new(channel: u64) -> AskedChannel {
        AskedChannel { channel, color: None, map: None, range: None, opacity: None }
    }
}

/// A plane of voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AskedSlice {
    /// 0 to 2: x, y, z.
    pub(crate) axis: u8,
    /// Which voxel of level 0, from 0.
    pub(crate) voxel: u32,
}

/// What `vastex render --on volume|slices` is told.
#[derive(Clone, Debug, ClapArgs)]
#[command(after_help = "\
Examples:
  vastex render head.zarr --on volume --mode mip --view +z -o head.png
  vastex render cells.zarr --on volume --mode emission --view around:yaw=30,pitch=20 --channels 0:00FF00,1:FF00FF -o cells.png
  vastex render scan.nii.gz --on slices --slice y=120 --range 0,0.1 -o slice.png
  vastex render bones.zarr --on volume --mode iso --iso 300 --view -y --json -o bones.png
  vastex render cells.zarr --on slices --slice z=40 --labels nuclei --label-outlines -o nuclei.png

The picture is drawn once everything in view is loaded. docs/volumes.md says what each mode shows.")]
pub(crate) struct RenderVolumeArgs {
    /// A volume: OME-Zarr, Zarr, NIfTI, a TIFF stack, raw values with a sidecar, or one that vastex built
    pub(crate) source: PathBuf,
    /// volume: rays through all of it; slices: a plane of its voxels
    #[arg(long, value_name = "SCENE", value_parser = named(&VolumeScene::ALL, VolumeScene::name))]
    pub(crate) on: VolumeScene,
    /// What becomes of the samples along a ray: the largest (mip), the smallest (minip), their mean
    /// (average); all of them glow and hide what is behind (emission); or the surface at which a value is
    /// reached (iso)
    #[arg(long, default_value = "mip", value_name = "MODE", value_parser = named(&VolumeMode::ALL, VolumeMode::name))]
    pub(crate) mode: VolumeMode,
    /// From where it is seen: along an axis, +x, -x, +y, -y, +z or -z, in parallel rays; or
    /// around:yaw=DEGREES,pitch=DEGREES, in perspective. Where the picture is as large as the face is in
    /// voxels, a pixel is a voxel
    #[arg(long, default_value = "+z", value_name = "VIEW", value_parser = parse_toward, allow_hyphen_values = true)]
    pub(crate) view: Toward,
    /// Which plane of voxels: x=K, y=K or z=K, K counting voxels of the finest level from 0
    #[arg(long, value_name = "AXIS=K", value_parser = parse_slice)]
    pub(crate) slice: Option<AskedSlice>,
    /// Which channels, each as I[:COLOUR[:LO..HI[:OPACITY]]] and with commas between them: COLOUR is RRGGBB
    /// or a colour map (grey, viridis, magma, inferno, plasma, cividis, turbo, coolwarm, terrain, or one of
    /// these reversed, as in viridis_r), LO..HI are stored values, without which they are as --range says,
    /// else all that the format holds. By default those that the file shows at first, in its colours and
    /// windows, or the first four
    #[arg(long, value_name = "CHANNELS", value_delimiter = ',', value_parser = parse_channel)]
    pub(crate) channels: Vec<AskedChannel>,
    /// The values that are dark and bright where a channel names none: 0 to 1 of the full range of whole
    /// numbers, stored values of floats
    #[arg(long, value_name = "LO,HI", value_parser = parse_range, allow_hyphen_values = true)]
    pub(crate) range: Option<[f64; 2]>,
    /// The stored value at which a surface is
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    pub(crate) iso: Option<f64>,
    #[command(flatten)]
    pub(crate) labels: LabelArgs,
    /// The time, from 0
    #[arg(long, default_value_t = 0, value_name = "T")]
    pub(crate) time: u64,
    /// How far samples along a ray are apart, in sides of a voxel
    #[arg(long, default_value_t = 1.0, value_name = "S", value_parser = parse_step)]
    pub(crate) step: f64,
    /// How dense what glows is: at 1 a hundredth of the longest side hides as much as its opacity says
    #[arg(long, default_value_t = 1.0, value_name = "D", value_parser = parse_step)]
    pub(crate) density: f64,
    /// How voxels are blended: linear, by the device; exact, by the shader in single precision; or nearest
    #[arg(long, default_value = "linear", value_name = "FILTER", value_parser = named(&VolumeFilter::ALL, VolumeFilter::name))]
    pub(crate) filter: VolumeFilter,
    /// Size of the picture in pixels
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = parse_size)]
    pub(crate) size: [u32; 2],
    /// GPU memory for bricks, in MiB; too little makes the picture coarser. By default as much as a picture
    /// of this size needs
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    pub(crate) pool_mib: Option<u64>,
    /// A directory for levels that the file lacks and that are made of its coarsest one; or off: they are
    /// made in memory [default: off]
    #[arg(long, value_name = "DIR|off")]
    pub(crate) cache: Option<PathBuf>,
    /// Where to write the picture, as PNG
    #[arg(short, long, value_name = "OUT.png")]
    pub(crate) output: Option<PathBuf>,
    /// Print figures about the run as JSON
    #[arg(long)]
    pub(crate) json: bool,
    /// Compare with the picture that ordinary 3-D textures give, of up to 1 GiB
    #[arg(long)]
    pub(crate) compare: bool,
}

impl RenderVolumeArgs {
    /// Where levels are kept that are made.
    pub(crate) fn cache(&self) -> Option<PathBuf> {
        self.cache.clone().filter(|cache| cache.as_os_str() != "off")
    }

    /// Whether what is asked for goes together.
    pub(crate) fn check(&self) -> Result<(), clap::Error> {
        let wrong = |why: String| Err(value_error(&why));
        if self.channels.len() > MOST_CHANNELS {
            return wrong(format!(
                "for '--channels': {} are named, {MOST_CHANNELS} are shown at most",
                self.channels.len()
            ));
        }
        if self.mode == VolumeMode::Iso && self.on == VolumeScene::Volume && self.iso.is_none() {
            return wrong(
                "'iso' for '--mode <MODE>': it shows where a value is reached; say which with --iso V".into(),
            );
        }
        if self.iso.is_some_and(|iso| !iso.is_finite()) {
            return wrong("for '--iso <V>': write a finite number".into());
        }
        match (self.on, self.slice) {
            (VolumeScene::Slices, None) => wrong(
                "'slices' for '--on <SCENE>': it shows a plane of voxels; say which with --slice z=K".into(),
            ),
            (VolumeScene::Volume, Some(_)) => wrong("'--slice': it goes with --on slices".into()),
            _ => match &self.output {
                Some(output) => super::render::check_is_png(output, "--output"),
                None => Ok(()),
            },
        }
    }

    /// A camera in perspective, if one is asked for.
    pub(crate) fn camera(&self, of: &vastex_viewer::volume::VolumeBox) -> Option<VolumeCamera> {
        let Toward::Around { yaw, pitch } = self.view else { return None };
        let (yaw, pitch) = (yaw.to_radians(), pitch.to_radians());
        let toward = [-yaw.sin() * pitch.cos(), yaw.cos() * pitch.cos(), pitch.sin()];
        // z is downward, as it is in the faces that are seen along x and y.
        Some(VolumeCamera::around(of, toward, [0.0, 0.0, 1.0]))
    }
}

fn parse_toward(text: &str) -> Result<Toward, String> {
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

fn parse_slice(text: &str) -> Result<AskedSlice, String> {
    let wrong = || "write x=K, y=K or z=K, K counting voxels from 0, as in z=40".to_owned();
    let (axis, voxel) = text.split_once('=').ok_or_else(wrong)?;
    let axis = ["x", "y", "z"].iter().position(|name| *name == axis).ok_or_else(wrong)?;
    Ok(AskedSlice { axis: axis as u8, voxel: voxel.parse().map_err(|_| wrong())? })
}

fn parse_step(text: &str) -> Result<f64, String> {
    // A third is written so.
    let number = match text.split_once('/') {
        Some((above, below)) => above.parse::<f64>().ok().zip(below.parse::<f64>().ok()).map(|(a, b)| a / b),
        None => text.parse().ok(),
    };
    number
        .filter(|number| (0.01..=100.0).contains(number))
        .ok_or_else(|| "write a number from 0.01 to 100, as in 0.5 or 1/3".into())
}

fn parse_range(text: &str) -> Result<[f64; 2], String> {
    range(text, ",")
}

/// Two different finite numbers.
fn range(text: &str, between: &str) -> Result<[f64; 2], String> {
    let ends = text
        .split_once(between)
        .and_then(|(low, high)| Some([low.trim().parse::<f64>().ok()?, high.trim().parse().ok()?]));
    match ends {
        Some([low, high]) if low.is_finite() && high.is_finite() && low != high => Ok([low, high]),
        Some(_) => Err("both values must be finite, and not the same".into()),
        None => Err(format!("write the values for dark and bright, as in 0{between}0.5")),
    }
}

fn parse_channel(text: &str) -> Result<AskedChannel, String> {
    let shape = || {
        format!(
            "'{text}': write I[:COLOUR[:LO..HI[:OPACITY]]], as in 1:00FF80:100..4000, COLOUR being RRGGBB or a colour map: {}",
            Palette::ALL.map(Palette::name).join(", ")
        )
    };
    let mut words = text.split(':');
    let channel = words.next().and_then(|word| word.parse().ok()).ok_or_else(shape)?;
    let mut asked = AskedChannel::new(channel);
    if let Some(color) = words.next().filter(|word| !word.is_empty()) {
        let is_hex = color.len() == 6 && color.bytes().all(|byte| byte.is_ascii_hexdigit());
        match is_hex {
            true => {
                let code = u32::from_str_radix(color, 16).map_err(|_| shape())?;
                asked.color = Some([code >> 16, code >> 8, code].map(|code| code as u8));
            }
            false => asked.map = Some(color.parse().map_err(|_| shape())?),
        }
    }
    if let Some(ends) = words.next().filter(|word| !word.is_empty()) {
        asked.range = Some(range(ends, "..").map_err(|why| format!("'{text}': {why}"))?);
    }
    if let Some(opacity) = words.next() {
        let opacity = opacity.parse().ok().filter(|opacity| (0.0..=1.0).contains(opacity));
        asked.opacity = Some(opacity.ok_or_else(|| format!("'{text}': an opacity is a number from 0 to 1"))?);
    }
    match words.next() {
        None => Ok(asked),
        Some(_) => Err(shape()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_told_by_number_colour_window_and_opacity() {
        let plain = AskedChannel::new(3);
        assert_eq!(parse_channel("3"), Ok(plain));
        assert_eq!(parse_channel("3:FF0080"), Ok(AskedChannel { color: Some([255, 0, 128]), ..plain }));
        let full =
            AskedChannel { color: Some([0, 255, 0]), range: Some([-5.0, 10.5]), opacity: Some(0.5), ..plain };
        assert_eq!(parse_channel("3:00ff00:-5..10.5:0.5"), Ok(full));
        let mapped = AskedChannel { map: Some(Palette::MAGMA.reversed()), range: Some([1.0, 2.0]), ..plain };
        assert_eq!(parse_channel("3:magma_r:1..2"), Ok(mapped));
        assert!(parse_channel("1:jet").unwrap_err().contains("viridis, magma"));
        assert_eq!(parse_channel("3::1..2"), Ok(AskedChannel { range: Some([1.0, 2.0]), ..plain }));
        for bad in ["", "x", "-1", "1:red", "1:+0FF00", "1::5..5", "1::nan..1", "1:::2", "1:::0.5:9", "1::1"]
        {
            assert!(parse_channel(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn views_slices_and_steps_are_checked() {
        assert_eq!(parse_toward("-x"), Ok(Toward::Face(VolumeFace::MinusX)));
        assert_eq!(parse_toward("around:pitch=-20"), Ok(Toward::Around { yaw: 0.0, pitch: -20.0 }));
        for bad in ["x", "around:", "around:yaw=nan", "around:pitch=90", "around:roll=1", "globe"] {
            assert!(parse_toward(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_slice("y=7"), Ok(AskedSlice { axis: 1, voxel: 7 }));
        for bad in ["7", "y", "w=1", "z=-1", "z=1.5", "z=99999999999"] {
            assert!(parse_slice(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_step("1/4"), Ok(0.25));
        for bad in ["0", "-1", "1/0", "nan", "x"] {
            assert!(parse_step(bad).is_err(), "{bad}");
        }
    }
}
