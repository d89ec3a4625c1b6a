//! What is shown: of the source one layer with `--layer-shown` and `--range`, or several with `--layer`, the
//! lowest first; with `--over` other files over it, and with `--compare-mode` how they are compared.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use vastex_viewer::layers::{CompareMode, MOST_LAYERS, Placement};
use vastex_viewer::surface::{MOST_STOPS, ParseLayerError, range_of};
use vastex_viewer::{Curve, LayerOptions};

/// Which layers are shown.
#[derive(Clone, Debug, Default, ClapArgs)]
pub(crate) struct ShownArgs {
    /// The layer to show, by its name; the first where none is named
    #[arg(long, value_name = "NAME")]
    pub(crate) layer_shown: Option<String>,
    /// The values that are black and white, in 0 to 1 where the format holds whole numbers. By default 0,1;
    /// for grey of 16 bits and for floats, `vastex view` takes the values of a coarse level
    #[arg(long, value_name = "LO,HI", value_parser = parse_range, allow_hyphen_values = true)]
    pub(crate) range: Option<[f32; 2]>,
    /// How much lighter it is than the range says, in stops: 1 doubles what lies above black, -1 halves it
    #[arg(long, value_name = "STOPS", value_parser = parse_stops, allow_hyphen_values = true)]
    pub(crate) exposure: Option<f32>,
    /// The curve from black to white: linear; log, for values of which few are far larger than most; or, for
    /// values that are light, light, where what is brighter than white is white, reinhard or aces, where it
    /// fades out
    #[arg(long, value_name = "CURVE", value_parser = parse_curve)]
    pub(crate) curve: Option<Curve>,
    /// Show a layer over those named before it; up to 8. NAME may be left out for the first layer of the
    /// texture. After it, each after a colon and in any order: file=N, which file it is of, 1 being the
    /// source and 2 the first of --over; bands=B, one of its channels, or bands=R,G,B, those that are red,
    /// green and blue, counted from 1, also of a TIFF file that has more than four; nodata=V, the value that
    /// stands for no data as it is stored, or nan, or off, instead of what the file says: what has it is not
    /// drawn; nodata-color=RRGGBB, a colour that it is drawn in after all; range=LO..HI, the values that are
    /// black and white; map=M, the colours of a single channel (grey, viridis, magma, inferno, plasma,
    /// cividis, turbo, coolwarm, terrain, or one of these reversed, as in viridis_r); exposure=E and
    /// curve=CURVE, as those options have it; log, short for curve=log; gamma=G, the exponent of values in
    /// the range (below 1 what is dark becomes lighter); opacity=O, from 0 to 1; filter=FILTER, as --filter
    /// has it; hidden, to load nothing of it
    #[arg(
        long = "layer",
        value_name = "NAME[:SETTING]...",
        value_parser = parse_layer,
        conflicts_with_all = ["layer_shown", "range", "exposure", "curve"]
    )]
    pub(crate) layers: Vec<LayerOptions>,
    /// Lay another file over the source, over the same place (--placement), its first layer if no --layer is
    /// of it; may be given several times, the lowest first. In a window it lies over the first file only, and
    /// goes when another is opened
    #[arg(long, value_name = "FILE")]
    pub(crate) over: Vec<PathBuf>,
    /// Compare the uppermost layer with those beneath it: off; swipe[:AT], right of a line at a share of the
    /// width; flicker[:SECONDS], by turns; difference[:TIMES], how far its colours are from those beneath,
    /// magnified; beside, all layers side by side
    #[arg(long, default_value = "off", value_name = "MODE")]
    pub(crate) compare_mode: CompareMode,
    /// Where images lie whose size is another than the lowest one's, on an image seen flat: stretched over
    /// all of its place; or by-texel, texel upon texel from the upper left corner, so that nothing is shown
    /// of an image beyond its edges
    #[arg(long, default_value = "stretched", value_name = "HOW")]
    pub(crate) placement: Placement,
}

impl ShownArgs {
    /// In the words of the scenes.
    pub(crate) fn layers(&self) -> Vec<LayerOptions> {
        let mut layers = self.layers.clone();
        if layers.is_empty() {
            layers.push(LayerOptions {
                name: self.layer_shown.clone(),
                range: self.range,
                exposure: self.exposure.unwrap_or_default(),
                curve: self.curve.unwrap_or_default(),
                ..LayerOptions::default()
            });
        }
        for texture in 1..=self.over.len() {
            if layers.iter().all(|layer| layer.texture != texture) {
                layers.push(LayerOptions { texture, ..LayerOptions::default() });
            }
        }
        layers
    }

    /// Returns true if layers are named, or a range of the first one.
    pub(super) fn are_named(&self) -> bool {
        !self.layers.is_empty()
            || self.layer_shown.is_some()
            || self.range.is_some_and(|range| range != [0.0, 1.0])
            || self.exposure.is_some()
            || self.curve.is_some()
    }

    /// Returns true if black and white of what is shown are nobody's choice.
    pub(super) fn range_is_free(&self) -> bool {
        self.layers.is_empty() && self.range.is_none()
    }
}

/// What is wrong with a list of layers as a whole, of so many files.
pub(super) fn fault(layers: &[LayerOptions], files: usize, compare_mode: CompareMode) -> Option<String> {
    if let Some(fault) = beyond(layers.iter().map(|layer| layer.texture), files) {
        return Some(fault);
    }
    let is_seen = |layer: &&LayerOptions| layer.is_visible && layer.opacity > 0.0;
    if compare_mode != CompareMode::Off && layers.iter().filter(is_seen).count() < 2 {
        let why = "one layer is shown; lay a file over it with --over, or show another --layer";
        return Some(format!("'--compare-mode': {why}"));
    }
    let count = layers.len();
    (count > MOST_LAYERS)
        .then(|| format!("'--layer' and '--over': {count} layers named, {MOST_LAYERS} are shown at most"))
}

/// What is wrong where one of the textures is of no file, of so many.
pub(super) fn beyond(mut textures: impl Iterator<Item = usize>, files: usize) -> Option<String> {
    let file = textures.find(|texture| *texture >= files)? + 1;
    Some(format!("'file={file}': there are {files} files, the source and those beside it"))
}

/// Two different numbers; the first may be the larger one, which turns black and white round.
fn parse_range(text: &str) -> Result<[f32; 2], String> {
    range_of(text, ",")
}

fn parse_stops(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|stops: &f32| stops.abs() <= MOST_STOPS);
    number.ok_or_else(|| format!("write a number from -{MOST_STOPS} to {MOST_STOPS}, as in 1.5"))
}

fn parse_curve(text: &str) -> Result<Curve, String> {
    let names = || Curve::ALL.map(Curve::name).join(", ");
    Curve::named(text).ok_or_else(|| format!("there are the curves {}", names()))
}

/// A layer of a list.
fn parse_layer(text: &str) -> Result<LayerOptions, String> {
    text.parse().map_err(|error: ParseLayerError| error.to_string())
}

#[cfg(test)]
mod tests {
    use vastex::Filter;
    use vastex_viewer::{Bands, Nodata, Palette};

    use super::*;

    #[test]
    fn ranges_are_checked() {
        assert_eq!(parse_range("-11000, 8848"), Ok([-11000.0, 8848.0]));
        assert_eq!(parse_range("1,0"), Ok([1.0, 0.0]));
        for bad in ["", "1", "1,", ",1", "0,0", "nan,1", "0,inf", "1;2", "0,1,2", "1e-40,0"] {
            assert!(parse_range(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn every_part_of_the_text_of_a_planet_counts() {
        use clap::Parser as _;

        use crate::args::{Args, Command};

        let view = "globe:lon=10,lat=30,alt=9000000m;on=planet;layer=:gamma=1.4;height=:file=2:scale=0.01:zero=0;\
                    sun=-60,10;exaggeration=7;atmosphere=0.5;lights=1;night=:file=3;clouds=:file=4:opacity=0.7";
        let shown = |view: &str| {
            let over = ["--over", "b", "--over", "c", "--over", "d", "--view", view, "-o", "out.png"];
            let args = Args::parse_from([&["vastex", "render", "a"][..], &over].concat());
            let Command::Render(args) = args.command else { panic!("is another command") };
            (args.scene.scene(), args.scene.shown())
        };
        for (part, other) in [
            ("on=planet", "on=globe"),
            ("sun=-60,10", "sun=off"),
            ("exaggeration=7", "exaggeration=40"),
            ("atmosphere=0.5", "atmosphere=0"),
            ("lights=1", "lights=20"),
            ("night=:file=3", "night=:file=3:hidden"),
            ("file=4:opacity=0.7", "file=4:hidden"),
            ("gamma=1.4", "gamma=2"),
            ("scale=0.01", "scale=0.1"),
        ] {
            assert!(view.contains(part), "{part}");
            assert_ne!(shown(view), shown(&view.replace(part, other)), "{other}");
        }
    }

    #[test]
    fn a_layer_is_told_by_its_settings() {
        assert_eq!(parse_layer(""), Ok(LayerOptions::default()));
        assert_eq!(parse_layer(":file=2"), Ok(LayerOptions { texture: 1, ..LayerOptions::default() }));
        let named = |name: &str| LayerOptions { name: Some(name.into()), ..LayerOptions::default() };
        assert_eq!(parse_layer("height"), Ok(named("height")));
        let expected = LayerOptions {
            range: Some([-11000.0, 8848.5]),
            palette: Palette::VIRIDIS,
            exposure: -1.5,
            curve: Curve::Log,
            gamma: 0.5,
            opacity: 0.25,
            filter: Some(Filter::Nearest),
            bands: Bands::One(1),
            nodata: Nodata::Value(-9999.0),
            nodata_color: Some([255, 0, 128]),
            is_visible: false,
            ..named("height")
        };
        let text = "height:opacity=0.25:range=-11000..8848.5:map=viridis:hidden:log:gamma=0.5:filter=nearest\
                    :bands=2:nodata=-9999:nodata-color=ff0080:exposure=-1.5";
        assert_eq!(parse_layer(text), Ok(expected));
        let of_light = LayerOptions { curve: Curve::Aces, ..LayerOptions::default() };
        assert_eq!(parse_layer(":curve=aces"), Ok(of_light));
        assert_eq!((parse_stops("-2.5"), parse_curve("reinhard")), (Ok(-2.5), Ok(Curve::Reinhard)));
        assert!(parse_stops("31").is_err() && parse_stops("nan").is_err() && parse_curve("film").is_err());
    }

    #[test]
    fn what_is_wrong_with_a_layer_is_told_by_its_place() {
        for (text, place) in [
            ("range=0..1", "stands where the layer's name does"),
            ("a:range=0,1", "0..0.5"),
            ("a:range=1..1", "not the same"),
            ("a:map=jet", "grey, viridis, magma"),
            ("a:bands=0", "counted from 1"),
            ("a:bands=1,2", "bands=3,2,1"),
            ("a:nodata=none", "nodata=-9999"),
            ("a:nodata-color=red", "nodata-color=ff0080"),
            ("a:nodata-color=+f00+1", "hexadecimal"),
            ("a:nodata-color=1234567", "hexadecimal"),
            ("a:nodata-color=µµµ", "hexadecimal"),
            ("a:gamma=0", "0.01"),
            ("a:exposure=1e3", "-30 to 30"),
            ("a:curve=film", "linear, log, light, reinhard, aces"),
            ("a:log:curve=aces", "curve is told twice"),
            ("a:opacity=1.5", "0 to 1"),
            ("a:opacity=nan", "0 to 1"),
            ("a:filter=cubic", "bicubic"),
            ("a:file=0", "1 to 9"),
            ("a:file=b", "file=2"),
            ("a:opacity=1:opacity=0.5", "opacity is told twice"),
            ("a:hidden=1", "no such setting"),
            ("a:", "no such setting"),
            ("a:colour=red", "'colour=red'"),
        ] {
            let error = parse_layer(text).unwrap_err();
            assert!(error.contains(place), "{text}: {error}");
        }
    }

    #[test]
    fn every_file_is_shown_over_those_before_it() {
        let args = |layers: &[&str], over: usize, compare_mode| ShownArgs {
            layer_shown: None,
            range: None,
            exposure: None,
            curve: None,
            layers: layers.iter().map(|layer| parse_layer(layer).unwrap()).collect(),
            over: vec![PathBuf::from("b.png"); over],
            compare_mode,
            placement: Placement::default(),
        };
        let textures = |args: &ShownArgs| args.layers().iter().map(|layer| layer.texture).collect::<Vec<_>>();
        assert_eq!(textures(&args(&[], 2, CompareMode::Off)), [0, 1, 2]);
        assert_eq!(
            textures(&args(&[":file=2", "height"], 2, CompareMode::Off)),
            [1, 0, 2],
            "as they are named"
        );
        for (args, place) in [
            (args(&[":file=3"], 1, CompareMode::Off), "'file=3'"),
            (args(&[], 0, CompareMode::Swipe(0.5)), "--over"),
            (args(&["a", "b:hidden"], 0, CompareMode::Swipe(0.5)), "one layer is shown"),
            (args(&["a:opacity=0", "b"], 0, CompareMode::Swipe(0.5)), "one layer is shown"),
            (args(&[], 8, CompareMode::Off), "9 layers named"),
        ] {
            let said = fault(&args.layers(), 1 + args.over.len(), args.compare_mode);
            assert!(said.unwrap().contains(place), "{place}");
        }
        assert!(args(&["a"], 0, CompareMode::Off).are_named() && !args(&[], 1, CompareMode::Off).are_named());
    }
}
