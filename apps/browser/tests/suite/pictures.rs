//! The pictures of the real head, drawn on this machine's adapter.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use vastex_browser::{Drawn, Show, ShowError};
use vastex_build::{ContainerOptions, Progress, VolumeFormat, VolumeOptions, build_volume};
use vastex_volume::{Opened, VolumeRegion, open};

const HEAD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/volumes/head.zip");
/// Names the directory in which the container and the pictures are to be left, if anywhere.
const PICTURES: &str = "VASTEX_BROWSER_PICTURES";
const PATIENCE: Duration = Duration::from_secs(120);

struct Silent;

impl Progress for Silent {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// A container of the head, in bricks so small that there are many.
fn container(path: &Path) -> Vec<u8> {
    let format = VolumeFormat::Container(ContainerOptions { page: 32, ..ContainerOptions::default() });
    let options = VolumeOptions { format, ..VolumeOptions::default() };
    build_volume(Path::new(HEAD), path, &options, &Silent).unwrap();
    std::fs::read(path).unwrap()
}

fn drawn(show: &mut Show) -> Result<Vec<Drawn>, ShowError> {
    let (mut pictures, begun) = (Vec::new(), Instant::now());
    while !show.is_done() {
        assert!(begun.elapsed() < PATIENCE, "{} pictures in {PATIENCE:?}", pictures.len());
        match show.frame()? {
            Some(picture) => pictures.push(picture),
            None => std::thread::sleep(Duration::from_millis(1)),
        }
    }
    Ok(pictures)
}

#[test]
fn the_head_is_drawn_by_the_code_that_draws_it_in_a_browser() {
    let own = tempfile::tempdir().unwrap();
    let directory = std::env::var_os(PICTURES).map_or_else(|| own.path().to_owned(), PathBuf::from);
    let mut show = pollster::block_on(Show::open("head", container(&directory.join("head.vastex")))).unwrap();
    let pictures = drawn(&mut show).unwrap();
    let names: Vec<&str> = pictures.iter().map(|picture| picture.name).collect();
    assert_eq!(names, ["slice", "oblique", "mip"]);
    for Drawn { name, size, pixels, frames, bricks } in &pictures {
        assert_eq!(pixels.len() as u32, size[0] * size[1] * 4, "{name}");
        let bright = pixels.chunks_exact(4).filter(|pixel| pixel[..3].iter().any(|code| *code > 60)).count();
        assert!(bright * 8 > pixels.len() / 4, "{name}: of {size:?} pixels {bright} are bright");
        assert!(*bricks > 1, "{name}: {bricks} bricks after {frames} frames");
        std::fs::write(directory.join(format!("{name}-{}.rgba", size[0])), pixels).unwrap();
    }
    let head = Head::read();
    head.is_sliced(&pictures[0]);
    head.is_projected(&pictures[2]);
}

/// The values of the file, by channel.
struct Head {
    size: [usize; 3],
    channels: Vec<Vec<u8>>,
}

impl Head {
    fn read() -> Head {
        let Opened::Volume(volume) = open(Path::new(HEAD)).unwrap() else { panic!("{HEAD} is a volume") };
        let size = volume.about().levels[0].size;
        let channels = (0..3).map(|channel| {
            let region = VolumeRegion { level: 0, channel, time: 0, at: [0; 3], size };
            pollster::block_on(volume.read(&region)).unwrap()
        });
        Head { size: size.map(|side| side as usize), channels: channels.collect() }
    }

    fn at(&self, channel: usize, [x, y, z]: [usize; 3]) -> u8 {
        self.channels[channel][(z * self.size[1] + y) * self.size[0] + x]
    }

    fn is_sliced(&self, slice: &Drawn) {
        let [width, height, depth] = self.size;
        let code = |channel, nth| self.at(channel, [nth % width, nth / width, depth / 2]);
        self.is_drawn(slice, [width, height], code);
    }

    /// The largest values along x, from the left of the head: a pixel is a voxel.
    fn is_projected(&self, mip: &Drawn) {
        let [width, height, depth] = self.size;
        let most = |channel, nth| {
            (0..width).map(|x| self.at(channel, [x, nth % height, nth / height])).max().unwrap()
        };
        self.is_drawn(mip, [height, depth], most);
    }

    /// Whether a picture shows these values of the channels at its pixels, in the colours of the scene.
    fn is_drawn(&self, picture: &Drawn, size: [usize; 2], value: impl Fn(usize, usize) -> u8) {
        const COLORS: [[f64; 3]; 3] = [[255.0; 3], [255.0, 90.0, 30.0], [40.0, 130.0, 255.0]];
        assert_eq!(picture.size.map(|side| side as usize), size);
        let mut most: f64 = 0.0;
        for nth in 0..size[0] * size[1] {
            let xs: [f64; 3] = std::array::from_fn(|channel| {
                ((f64::from(value(channel, nth)) / 255.0 - 0.05) / 0.75).clamp(0.0, 1.0)
            });
            for of in 0..3 {
                let lights = xs.iter().zip(COLORS).map(|(x, color)| 0.3 * light(x * color[of] / 255.0));
                let expected = 255.0 * display(lights.sum::<f64>()).min(1.0);
                most = most.max((expected - f64::from(picture.pixels[4 * nth + of])).abs());
            }
        }
        assert!(most < 1.5, "{}: up to {most} from what follows from the file", picture.name);
    }
}

fn light(display: f64) -> f64 {
    if display <= 0.04045 { display / 12.92 } else { ((display + 0.055) / 1.055).powf(2.4) }
}

fn display(light: f64) -> f64 {
    if light <= 0.0031308 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

#[test]
fn what_is_no_volume_is_refused_with_its_name() {
    let error = pollster::block_on(Show::open("noise", vec![7; 5000])).err().unwrap().to_string();
    assert!(error.contains("noise"), "{error}");
}
