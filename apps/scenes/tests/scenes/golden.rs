//! The pictures that the README and the docs show are what the scenes draw, from the real image.
//!
//! `VASTEX_ACCEPT=1 cargo test -p vastex-scenes golden` replaces them by what is drawn now.

use std::path::{Path as FilePath, PathBuf};

use vastex::Filter;
use vastex_build::BuildOptions;
use vastex_scenes::{Comparison, DisplayOptions, LayerOptions, Offscreen, Path, Picture, Scene, Until};

use crate::common::{converged, gpu, settings};

const PICTURE: [u32; 2] = [640, 360];
/// Bytes that the pictures may take together.
const BYTE_BUDGET: u64 = 1_000_000;
/// Adapters differ in how they round filter weights and rasterise the limb of the globe, 45 dB between two software
/// drivers; a wrong page, level or border costs far more.
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

#[test]
fn the_readme_shows_what_is_drawn() {
    let directory = tempfile::tempdir().unwrap();
    let container = directory.path().join("earth.vastex");
    let input = repository().join("assets/earth-color-10800x5400.jpg");
    let address = [vastex::AddressMode::Wrap, vastex::AddressMode::Clamp];
    vastex_build::build(&[input], &container, &BuildOptions { address, ..Default::default() }, &()).unwrap();
    let globe = [("globe", Scene::Globe, Path::Still), ("close-up", Scene::Globe, Path::Zoom)];
    let globe = globe.map(|(name, scene, path)| {
        let source = vastex::open(&container).unwrap();
        let drawn = converged(source, scene, PICTURE, path, settings(16, Filter::Trilinear)).picture();
        check(name, drawn)
    });
    let bytes = globe.iter().sum::<u64>() + check("terrain", terrain(directory.path(), address));
    assert!(bytes <= BYTE_BUDGET, "{bytes} bytes of pictures");
}

/// The Earth's relief, displaced by itself.
fn terrain(directory: &FilePath, address: [vastex::AddressMode; 2]) -> Picture {
    let container = directory.join("elevation.vastex");
    let input = repository().join("assets/earth-elevation-1080x540-u16.png");
    let options = BuildOptions { address, page: 64, ..Default::default() };
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
