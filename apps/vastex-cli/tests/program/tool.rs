//! Runs the program in a directory of its own.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Duration;

use tempfile::TempDir;
use xtask::limited::{Limited, within};

/// Longer than any run of a test on any machine; none waits longer.
pub(crate) const PATIENCE: Duration = Duration::from_secs(300);

/// Returns true if the adapter is a GPU: what pictures may differ by there says docs/draw-checks.md. By a
/// software driver they may not, so this is asked where they do.
pub(crate) fn draws_by_gpu() -> bool {
    !pollster::block_on(vastex_viewer::Gpu::headless()).unwrap().is_processor()
}

/// A directory with a small image and a container made of it.
pub(crate) struct Sandbox {
    dir: TempDir,
}

/// How a run of the program ended.
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Sandbox {
    /// An empty sandbox.
    pub(crate) fn new() -> Sandbox {
        Sandbox { dir: TempDir::new().unwrap() }
    }

    /// A sandbox with `image.png`, of 300x200 texels, and `image.vastex`, whose pages have 64.
    pub(crate) fn with_container() -> Sandbox {
        let sandbox = Sandbox::new();
        sandbox.write_png("image.png", [300, 200]);
        sandbox.run(&["build", "image.png", "-o", "image.vastex", "--page", "64", "--quiet"]).expect_code(0);
        sandbox
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    /// An RGB image without two tiles alike.
    pub(crate) fn write_png(&self, name: &str, [width, height]: [u32; 2]) {
        let file = std::fs::File::create(self.path(name)).unwrap();
        let mut encoder = png::Encoder::new(file, width, height);
        encoder.set_color(png::ColorType::Rgb);
        let texel = |n: u32| {
            let (x, y) = (n % width, n / width);
            [(x * 255 / width) as u8, (y * 255 / height) as u8, ((x / 8 + y / 8) % 2 * 200) as u8]
        };
        let texels: Vec<u8> = (0..width * height).flat_map(texel).collect();
        encoder.write_header().unwrap().write_image_data(&texels).unwrap();
    }

    /// A grey image without two tiles alike.
    pub(crate) fn write_grey_png(&self, name: &str, [width, height]: [u32; 2]) {
        let file = std::fs::File::create(self.path(name)).unwrap();
        let mut encoder = png::Encoder::new(file, width, height);
        encoder.set_color(png::ColorType::Grayscale);
        let texels: Vec<u8> =
            (0..width * height).map(|n| (n % width * 100 / width + n / width * 150 / height) as u8).collect();
        encoder.write_header().unwrap().write_image_data(&texels).unwrap();
    }

    /// A grey image of 16 bits, of big-endian numbers.
    pub(crate) fn write_png_of(&self, name: &str, [width, height]: [u32; 2], texels: &[u8]) {
        let file = std::fs::File::create(self.path(name)).unwrap();
        let mut encoder = png::Encoder::new(file, width, height);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        encoder.write_header().unwrap().write_image_data(texels).unwrap();
    }

    /// The heights of the Earth, of 16 bits, with few texels: a surface is drawn of no finer patches than its
    /// heights have texels, so that a small picture takes little time and still has patches of several sizes.
    pub(crate) fn write_relief(&self, name: &str) {
        let whole = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/earth-elevation-1080x540-u16.png");
        let whole = std::io::BufReader::new(std::fs::File::open(whole).unwrap());
        let mut reader = png::Decoder::new(whole).read_info().unwrap();
        let mut texels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut texels).unwrap();
        let [every, width, height] = [6, 180, 90];
        let places = (0..height).flat_map(|y| (0..width).map(move |x| every * (every * y * width + x)));
        let few: Vec<u8> = places.flat_map(|at| [texels[2 * at], texels[2 * at + 1]]).collect();
        self.write_png_of(name, [width as u32, height as u32], &few);
    }

    /// The pixels of a picture that the program wrote.
    pub(crate) fn read_rgb(&self, name: &str) -> Vec<[u8; 3]> {
        let mut reader = png::Decoder::new(std::io::Cursor::new(self.read(name))).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        pixels.chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
    }

    /// Every name in the directory, hidden ones too.
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.dir.path()).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    pub(crate) fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(Path::new(env!("CARGO_BIN_EXE_vastex")));
        command.args(args).current_dir(self.dir.path()).env_remove("RUST_LOG").env("RUST_BACKTRACE", "0");
        // A software driver has memory given back and taken again in each frame, which is a sixth of all its
        // processor time: GNU's allocator keeps some, and no other one heeds these.
        command.env("MALLOC_TRIM_THRESHOLD_", "536870912").env("MALLOC_TOP_PAD_", "33554432");
        // Debug builds of wgpu add lines to shaders for debuggers, which is a tenth of the time that a
        // picture of a planet takes.
        command.env("WGPU_DEBUG", "0");
        command
    }

    #[track_caller]
    pub(crate) fn run(&self, args: &[&str]) -> Ended {
        Ended::of(&mut self.command(args))
    }
}

impl Ended {
    /// Runs a command to its end; fails, and says what it printed, where that is not within [`PATIENCE`].
    #[track_caller]
    pub(crate) fn of(command: &mut Command) -> Ended {
        Ended::with(&within(command, PATIENCE).unwrap_or_else(|error| panic!("{error:#}")))
    }

    /// The same of a program that was started before.
    #[track_caller]
    pub(crate) fn of_running(running: Limited) -> Ended {
        Ended::with(&running.end().unwrap_or_else(|error| panic!("{error:#}")))
    }

    #[track_caller]
    fn with(output: &Output) -> Ended {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let ended =
            Ended { code: output.status.code(), stdout: text(&output.stdout), stderr: text(&output.stderr) };
        assert!(!ended.stderr.contains("panicked"), "{ended}");
        // Nobody sees it in colour.
        assert!(!ended.stderr.contains('\x1b'), "{ended}");
        ended
    }

    #[track_caller]
    pub(crate) fn expect_code(self, code: i32) -> Ended {
        assert_eq!(self.code, Some(code), "{self}");
        self
    }

    /// The one JSON object on stdout.
    #[track_caller]
    pub(crate) fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error} in\n{self}"))
    }
}

impl std::fmt::Display for Ended {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "code {:?}\nstdout: {}\nstderr: {}", self.code, self.stdout, self.stderr)
    }
}
