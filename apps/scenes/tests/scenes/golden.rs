//! The pictures that the README and the docs show are what the scenes draw, from the real image.
//!
//! `VASTEX_ACCEPT=1 cargo test -p vastex-scenes golden` replaces them by what is drawn now.

use std::path::{Path as FilePath, PathBuf};
use std::sync::Arc;

use vastex::{AddressMode, Filter, TileSource};
use vastex_build::BuildOptions;
use vastex_scenes::{
    Comparison, DisplayOptions, Heights, LayerOptions, Offscreen, Path, Picture, PlanetLight, PlanetOptions,
    Pose, Scene, SceneImage, Until,
};

use crate::common::{gpu, settings};

const PICTURE: [u32; 2] = [640, 360];
/// Bytes that the pictures may take together.
const BYTE_BUDGET: u64 = 1_000_000;
/// Adapters differ in how they round filter weights and rasterise the limb of the globe, 45 dB between two
/// software drivers; a wrong page, level or border costs far more.
const MIN_PSNR_DB: f64 = 38.0;

fn repository() -> PathBuf {
    FilePath::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read_png(path: &FilePath) -> Option<Picture> {
    let mut reader =
        png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).ok()?)).read_info().ok()?;
    let mut rgba = vec![0; reader.output_buffer_size()?];
    let info = reader.next_frame(&mut rgba).ok()?;
    Some(Picture { size: [info.width, info.height], rgba })
}

fn write_png(path: &FilePath, picture: &Picture) {
    let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let mut encoder = png::Encoder::new(file, picture.size[0], picture.size[1]);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_compression(png::Compression::High);
    encoder.write_header().unwrap().write_image_data(&picture.rgba).unwrap();
}

const WRAP: [AddressMode; 2] = [AddressMode::Wrap, AddressMode::Clamp];

#[test]
fn the_readme_shows_what_is_drawn() {
    let directory = tempfile::tempdir().unwrap();
    let earth = EARTH.map(|image| built(directory.path(), image));
    let bytes =
        VIEWS.map(|(name, view, sun, exaggeration)| check(name, planet(&earth, view, sun, exaggeration)));
    let bytes = bytes.iter().sum::<u64>() + check("terrain", terrain(directory.path()));
    assert!(bytes <= BYTE_BUDGET, "{bytes} bytes of pictures");
}

/// The Earth's colours, heights, lights and clouds.
const EARTH: [&str; 4] = [
    "earth-color-10800x5400.jpg",
    "earth-land-4320x2160-u16.png",
    "earth-night-2048x1024.jpg",
    "earth-clouds-2048x1024.jpg",
];
/// The views of it, as `--view` has them, the places over which the sun stands, and how much higher its
/// mountains are than they are.
const VIEWS: [(&str, &str, [f64; 2], f32); 2] = [
    ("planet", "globe:lon=22,lat=27,alt=7500000m", [-52.0, 14.0], 10.0),
    ("alps", "globe:lon=9,lat=36,alt=1000000m,tilt=42", [-30.0, 35.0], 6.0),
];

fn built(directory: &FilePath, image: &str) -> Arc<dyn TileSource> {
    let container = directory.join(image).with_extension("vastex");
    let input = repository().join("assets").join(image);
    let options = BuildOptions { address: WRAP, ..Default::default() };
    vastex_build::build(&[input], &container, &options, &()).unwrap();
    vastex::open(&container).unwrap()
}

/// The Earth as `vastex render --on planet` draws it.
fn planet(earth: &[Arc<dyn TileSource>], view: &str, sun: [f64; 2], exaggeration: f32) -> Picture {
    let of = |texture| Some(LayerOptions { texture, ..LayerOptions::default() });
    let options = DisplayOptions {
        layers: vec![LayerOptions { gamma: 1.4, ..LayerOptions::default() }],
        // Values are metres.
        heights: Heights {
            texture: Some(1),
            scale: Some(65_535.0 / 6_371_000.0),
            zero: Some(0.0),
            ..Heights::default()
        },
        planet: PlanetOptions {
            night: of(2),
            clouds: of(3),
            light: PlanetLight { sun: Some(sun), exaggeration, ..PlanetLight::default() },
        },
        ..DisplayOptions::default()
    };
    let settings = settings(16, Filter::Trilinear);
    let over: Vec<SceneImage> = earth[1..].iter().cloned().map(SceneImage::from).collect();
    let images = (earth[0].clone().into(), &*over);
    let mut offscreen =
        Offscreen::showing_together(&options, gpu(), images, Scene::Planet, PICTURE, settings).unwrap();
    offscreen.stand_at(Pose::from_text(view, offscreen.image_size()).unwrap());
    assert!(offscreen.run(Path::Still, Until::Converged, |_, _| ()).unwrap().converged);
    offscreen.picture()
}

/// The Earth's relief, displaced by itself.
fn terrain(directory: &FilePath) -> Picture {
    let container = directory.join("elevation.vastex");
    let input = repository().join("assets/earth-elevation-1080x540-u16.png");
    let options = BuildOptions { address: WRAP, page: 64, ..Default::default() };
    vastex_build::build(&[input], &container, &options, &()).unwrap();
    let source = vastex::open(&container).unwrap();
    let layers = vec![LayerOptions { range: Some([0.08, 0.27]), ..LayerOptions::default() }];
    let shown = DisplayOptions { layers, ..DisplayOptions::default() };
    let settings = settings(16, Filter::Trilinear);
    let mut offscreen = Offscreen::showing(&shown, gpu(), source, Scene::Terrain, PICTURE, settings).unwrap();
    assert!(offscreen.run(Path::Still, Until::Converged, |_, _| ()).unwrap().converged);
    offscreen.picture()
}

/// Compares a picture with the one that is kept, or keeps it. Says how many bytes that has.
fn check(name: &str, mut drawn: Picture) -> u64 {
    drawn.rgba.chunks_exact_mut(4).for_each(|pixel| pixel[3] = 255); // a PNG to look at has no holes
    let golden = repository().join(format!("docs/images/{name}.png"));
    if std::env::var_os("VASTEX_ACCEPT").is_some() {
        write_png(&golden, &drawn);
    }
    let expected = read_png(&golden).filter(|picture| picture.size == drawn.size);
    let alike = expected.map(|expected| Comparison::of(&drawn, &expected));
    if alike.is_none_or(|alike| alike.psnr_db < MIN_PSNR_DB) {
        let seen = std::env::temp_dir().join(format!("vastex-{name}.png"));
        write_png(&seen, &drawn);
        panic!(
            "{} is not what is drawn ({alike:?}), see {}; to accept it: VASTEX_ACCEPT=1 cargo test -p vastex-scenes \
             golden",
            golden.display(),
            seen.display()
        );
    }
    std::fs::metadata(&golden).unwrap().len()
}
