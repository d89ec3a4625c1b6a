//! A planet in colour under the hands of a person: the real Earth with its heights, its lights and its
//! clouds, in windows of two sizes, and a picture that is taken of it.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use super::super::display::{Display, SIZE};
use super::{Window, says_built};
use crate::shell;

/// The image that is on it.
pub(in super::super) const PLANET: &str = "assets/earth-color-10800x5400.jpg";
/// What it is shown with, as the README has it.
const WITH: [&str; 15] = [
    "--on",
    "planet",
    "--height",
    "assets/earth-land-4320x2160-u16.png",
    "--height-scale",
    "0.010286",
    "--height-zero",
    "0",
    "--night",
    "assets/earth-night-2048x1024.jpg",
    "--clouds",
    "assets/earth-clouds-2048x1024.jpg",
    "--layer",
    ":gamma=1.4",
    "--sun=-52,14",
];
/// Windows that are quick to draw.
const WINDOW: [usize; 2] = [300, 200];
const SMALL: [usize; 2] = [240, 160];
/// Where a drag begins and ends.
const DRAG: [[usize; 2]; 2] = [[150, 100], [200, 88]];

/// Opens it before anything of it was built, looks at it, turns it, shows the image alone and the planet
/// again, takes a picture of it in a smaller window, and ends.
pub(in super::super) fn use_planet(place: &Path) -> Result<()> {
    let display = Display::start(place)?;
    let size = format!("{}x{}", WINDOW[0], WINDOW[1]);
    // Nobody is asked where the window stands, so it stands in the corner.
    let with = WITH.map(|word| match word.strip_prefix("assets/") {
        Some(_) => shell::root().join(word).to_string_lossy().into_owned(),
        None => word.to_owned(),
    });
    let mut options: Vec<&str> = with.iter().map(String::as_str).collect();
    options.extend(["--size", &size]);
    Window::hold(&display, place, &shell::root().join(PLANET), &options, Window::look_at_planet)
}

/// Pixels of a planet by what they look like.
#[derive(Debug, PartialEq)]
struct Colours {
    /// Darker than anything that is lit: space, and the night.
    dark: usize,
    /// Seas and air.
    blue: usize,
    /// Deserts, and lamps in the night.
    yellow: usize,
    /// Clouds and ice.
    white: usize,
}

impl Window<'_> {
    fn look_at_planet(&mut self) -> Result<()> {
        // The image is built while its preview is seen, then come heights, lights and clouds.
        self.until("a planet", |window| {
            window.title().filter(|title| title.contains("planet") && !title.contains("opening"))
        })?;
        self.until("the planet in colour", |window| {
            let Colours { dark, blue, yellow, white } = window.colours(WINDOW).ok()?;
            (dark > 8000 && blue > 4000 && yellow > 1200 && white > 120).then_some(())
        })?;
        self.settled()?;
        self.keep("01-planet")?;
        let said = self.said();
        ensure!(says_built(&said), "nothing of it was built: {said}");
        let before = self.display.look(0..WINDOW[0])?;
        self.turn(DRAG)?;
        self.settled()?;
        ensure!(self.display.look(0..WINDOW[0])? != before, "the planet is not turned");
        self.keep("02-turned")?;
        self.key("F1")?;
        self.until("the image alone", |window| window.magnification().ok())?;
        self.settled()?;
        let magnification = self.magnification()?;
        self.keep("03-image")?;
        self.resize(SMALL)?;
        self.key("F10")?;
        self.until("a planet again", |window| window.title().filter(|title| title.contains("planet")))?;
        self.settled()?;
        self.keep("04-small")?;
        self.take_picture("F5", SMALL, "05-picture")?;
        self.key("F1")?;
        self.resize(WINDOW)?;
        self.until("the image as it was", |window| {
            window.magnification().ok().filter(|there| *there == magnification)
        })?;
        let ended = self.quit()?;
        ensure!(ended.success(), "it ended with {ended}");
        Ok(())
    }

    /// A picture of the window that a key asks for has so many pixels, and stays beside the others.
    pub(super) fn take_picture(&mut self, key: &str, size: [usize; 2], step: &str) -> Result<()> {
        let name = |window: &mut Self| -> Option<String> {
            let title = window.title()?;
            Some(title.split("the picture is ").nth(1)?.split(" – ").next()?.trim().to_owned())
        };
        // The title may still name the picture before.
        let before = name(self);
        self.key(key)?;
        let place = self.place.clone();
        let picture = self.until("a picture of the window", |window| {
            let name = name(window).filter(|name| Some(name) != before.as_ref())?;
            fs::read(place.join(name)).ok()
        })?;
        let side = |at: usize| Some(u32::from_be_bytes(picture.get(at..at + 4)?.try_into().ok()?) as usize);
        let sides = [side(16), side(20)];
        ensure!(sides == size.map(Some), "the picture has {sides:?} pixels, not {size:?}");
        fs::write(self.place.join(format!("steps/{step}.png")), picture).context("the picture cannot be kept")
    }

    /// What there is of each colour in the window's pixels.
    fn colours(&self, [width, height]: [usize; 2]) -> Result<Colours> {
        let seen = self.display.look(0..width.min(SIZE[0]))?;
        let mut colours = Colours { dark: 0, blue: 0, yellow: 0, white: 0 };
        for pixel in seen.chunks_exact(4).take(width * height) {
            let [b, g, r] = [0, 1, 2].map(|n| i32::from(pixel[n]));
            match r + g + b {
                0..=60 => colours.dark += 1,
                _ if b > r + 24 => colours.blue += 1,
                _ if r > b + 24 => colours.yellow += 1,
                540.. => colours.white += 1,
                _ => {}
            }
        }
        Ok(colours)
    }

    pub(super) fn resize(&self, [width, height]: [usize; 2]) -> Result<()> {
        let (width, height) = (width.to_string(), height.to_string());
        self.xdotool(&["windowsize", "--sync", &self.id, &width, &height]).map(drop)
    }
}
