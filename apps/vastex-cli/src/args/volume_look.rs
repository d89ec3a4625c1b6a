//! What `vastex render` and `vastex view` are told alike of how a volume is shown: channels, the mode,
//! labels, the time.

use clap::Args as ClapArgs;
use vastex_viewer::view_text::ViewChannel;
use vastex_viewer::volume::{MOST_CHANNELS, RAY_STEPS, VolumeMode};
use vastex_viewer::{Palette, VolumeViewText};

use super::volume_labels::LabelArgs;
use super::{OriginsArgs, conflict, named, value_error};

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
    /// The exponent of a value's place in the range.
    pub(crate) gamma: Option<f32>,
    /// Whether a view names it: then it has what it would have in the window where nothing is said of it.
    pub(crate) is_of_view: bool,
}

/// What a view says that no option can say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct OfView {
    /// No channel is shown.
    pub(crate) no_channels: bool,
    /// Whether labels are shown, which are named then; `None` where nothing is said of them.
    pub(crate) labels: Option<bool>,
}

impl AskedChannel {
    /// A channel of which nothing else is said.
    pub(crate) fn new(channel: u64) -> AskedChannel {
        let (color, map, range, opacity, gamma) = (None, None, None, None, None);
        AskedChannel { channel, color, map, range, opacity, gamma, is_of_view: false }
    }
}

/// How a volume is shown.
#[derive(Clone, Debug, Default, ClapArgs)]
pub(crate) struct VolumeLookArgs {
    /// What becomes of the samples along a ray: the largest (mip), the smallest (minip), their mean
    /// (average); all of them glow and hide what is behind (emission); or the surface at which a value is
    /// reached (iso) [default: mip]
    #[arg(long, value_name = "MODE", value_parser = named(&VolumeMode::ALL, VolumeMode::name))]
    pub(crate) mode: Option<VolumeMode>,
    /// Which channels, each as I[:COLOUR[:LO..HI[:OPACITY]]] and with commas between them: COLOUR is RRGGBB
    /// or a colour map (grey, viridis, magma, inferno, plasma, cividis, turbo, coolwarm, terrain, or one of
    /// these reversed, as in viridis_r), LO..HI are stored values, without which they are as --range says,
    /// else all that the format holds. By default those that the file shows at first, in its colours and
    /// windows, or the first four
    #[arg(long, value_name = "CHANNELS", value_delimiter = ',', value_parser = parse_channel)]
    pub(crate) channels: Vec<AskedChannel>,
    /// The stored value at which a surface is
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    pub(crate) iso: Option<f64>,
    #[command(flatten)]
    pub(crate) labels: LabelArgs,
    /// The time, from 0 [default: 0]
    #[arg(long, value_name = "T")]
    pub(crate) time: Option<u64>,
    /// How far samples along a ray are apart, in sides of a voxel [default: 1]
    #[arg(long, value_name = "S", value_parser = parse_step)]
    pub(crate) step: Option<f64>,
    /// How dense what glows is: at 1 a hundredth of the longest side hides as much as its opacity says
    /// [default: 1]
    #[arg(long, value_name = "D", value_parser = parse_step)]
    pub(crate) density: Option<f64>,
    #[command(flatten)]
    pub(crate) origins: OriginsArgs,
    /// What a view says beside that.
    #[arg(skip)]
    pub(crate) of_view: OfView,
}

impl VolumeLookArgs {
    /// What becomes of samples along a ray.
    pub(crate) fn mode(&self) -> VolumeMode {
        self.mode.unwrap_or_default()
    }

    /// The time, from 0.
    pub(crate) fn time(&self) -> u64 {
        self.time.unwrap_or(0)
    }

    /// How far samples are apart, in sides of a voxel.
    pub(crate) fn step(&self) -> f64 {
        self.step.unwrap_or(1.0)
    }

    /// How dense what glows is.
    pub(crate) fn density(&self) -> f64 {
        self.density.unwrap_or(1.0)
    }

    /// An option of these that is given.
    pub(crate) fn given(&self) -> Option<&'static str> {
        let given = [
            (self.mode.is_some(), "--mode"),
            (!self.channels.is_empty(), "--channels"),
            (self.iso.is_some(), "--iso"),
            (self.labels.labels.is_some(), "--labels"),
            (self.time.is_some(), "--time"),
            (self.step.is_some(), "--step"),
            (self.density.is_some(), "--density"),
            (self.origins.is_given(), "--origins"),
        ];
        let given = given.iter().find(|(is_given, _)| *is_given).map(|(_, name)| *name);
        given.or(self.labels.of_labels_alone())
    }

    /// Fails where a view says what an option does.
    pub(crate) fn check_beside(&self, view: &VolumeViewText) -> Result<(), clap::Error> {
        let twice = [
            (view.mode.is_some() && self.mode.is_some(), "which mode it is", "--mode"),
            (view.channels.is_some() && !self.channels.is_empty(), "which channels are shown", "--channels"),
            (view.iso.is_some() && self.iso.is_some(), "where a surface is", "--iso"),
            (view.labels.is_some() && self.labels.labels.is_some(), "which labels are shown", "--labels"),
            (view.time.is_some() && self.time.is_some(), "which time it is", "--time"),
            (view.step.is_some() && self.step.is_some(), "how far samples are apart", "--step"),
            (view.density.is_some() && self.density.is_some(), "how dense it is", "--density"),
        ];
        match twice.iter().find(|(is_twice, ..)| *is_twice) {
            Some((_, what, option)) => {
                Err(conflict(&format!("--view says {what}; leave that out of it, or leave out {option}")))
            }
            None => Ok(()),
        }
    }

    /// Puts what a view says in the place of what is said nothing of.
    pub(crate) fn follow_view(&mut self, view: &VolumeViewText) -> Result<(), clap::Error> {
        self.check_beside(view)?;
        self.mode = self.mode.or(view.mode);
        self.iso = self.iso.or(view.iso.flatten());
        (self.time, self.step) = (self.time.or(view.time), self.step.or(view.step));
        self.density = self.density.or(view.density);
        let channel = |said: &ViewChannel| {
            let ViewChannel { channel, color, map, range, gamma, opacity } = *said;
            AskedChannel { channel, color, map, range, opacity, gamma, is_of_view: true }
        };
        self.channels.extend(view.channels.iter().flatten().map(channel));
        self.of_view = OfView {
            no_channels: view.channels.as_ref().is_some_and(Vec::is_empty),
            labels: view.labels.as_ref().map(Option::is_some),
        };
        if let Some(Some(labels)) = &view.labels {
            let asked = &mut self.labels;
            asked.labels = Some(labels.name.clone().into());
            asked.label_opacity = asked.label_opacity.or(Some(labels.opacity));
            asked.label_outlines |= labels.outlines;
            asked.label_selected = asked.label_selected.or(labels.selected);
            asked.label_others = asked.label_others.or(Some(labels.others));
        }
        Ok(())
    }

    /// Checks that what is asked for can be.
    pub(super) fn check(&self) -> Result<(), clap::Error> {
        if self.channels.len() > MOST_CHANNELS {
            return Err(value_error(&format!(
                "for '--channels': {} are named, {MOST_CHANNELS} are shown at most",
                self.channels.len()
            )));
        }
        match self.iso.is_some_and(|iso| !iso.is_finite()) {
            true => Err(value_error("for '--iso <V>': write a finite number")),
            false => Ok(()),
        }
    }
}

fn parse_step(text: &str) -> Result<f64, String> {
    // A third is written so.
    let number = match text.split_once('/') {
        Some((above, below)) => above.parse::<f64>().ok().zip(below.parse::<f64>().ok()).map(|(a, b)| a / b),
        None => text.parse().ok(),
    };
    number.filter(|number| RAY_STEPS.contains(number)).ok_or_else(|| {
        let (least, most) = (RAY_STEPS.start(), RAY_STEPS.end());
        format!("write a number from {least} to {most}, as in 0.5 or 1/3")
    })
}

/// Two different finite numbers.
pub(super) fn range(text: &str, between: &str) -> Result<[f64; 2], String> {
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
    use vastex_viewer::volume::OtherLabels;

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
    fn steps_are_checked() {
        assert_eq!(parse_step("1/4"), Ok(0.25));
        for bad in ["0", "-1", "1/0", "nan", "x"] {
            assert!(parse_step(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_view_says_what_options_say_nothing_of_and_nothing_twice() {
        let text = "volume:x=1,y=2,z=3,zoom=1,yaw=0,pitch=0;mode=iso;iso=7.5;channel=2:map=magma:gamma=0.5;time=3;labels=a:selected=9";
        let view: VolumeViewText = text.parse().unwrap();
        let mut asked = VolumeLookArgs { density: Some(2.0), ..VolumeLookArgs::default() };
        asked.follow_view(&view).unwrap();
        assert_eq!(
            (asked.mode(), asked.iso, asked.time(), asked.density()),
            (VolumeMode::Iso, Some(7.5), 3, 2.0)
        );
        let (map, gamma) = (Some(Palette::MAGMA), Some(0.5));
        let channel = AskedChannel { map, gamma, is_of_view: true, ..AskedChannel::new(2) };
        assert_eq!((&asked.channels[..], asked.labels.label_selected), (&[channel][..], Some(9)));
        for twice in [
            VolumeLookArgs { mode: Some(VolumeMode::Mip), ..VolumeLookArgs::default() },
            VolumeLookArgs { time: Some(3), ..VolumeLookArgs::default() },
            VolumeLookArgs { channels: vec![channel], ..VolumeLookArgs::default() },
        ] {
            assert!(twice.clone().follow_view(&view).is_err(), "{twice:?}");
            assert!(twice.given().is_some());
        }
        assert_eq!(VolumeLookArgs::default().given(), None);
        // What an option says of how labels look stays, also where it is what they usually have.
        let labels = LabelArgs { label_others: Some(OtherLabels::Dimmed), ..LabelArgs::default() };
        let mut asked = VolumeLookArgs { labels, ..VolumeLookArgs::default() };
        let hidden: VolumeViewText =
            "volume:x=1,y=2,z=3,zoom=1,yaw=0,pitch=0;channels=none;labels=a:selected=9:others=hidden"
                .parse()
                .unwrap();
        asked.follow_view(&hidden).unwrap();
        assert_eq!(asked.labels.label_others, Some(OtherLabels::Dimmed));
        assert_eq!(asked.of_view, OfView { no_channels: true, labels: Some(true) });
    }
}
