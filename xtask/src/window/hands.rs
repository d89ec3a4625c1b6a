//! The window under the hands of a person: keys and pointer are sent to it on a display of its own, and its title and its pixels say what
//! came of them.

use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};

use crate::shell;

/// As long something may take.
const PATIENCE: Duration = Duration::from_secs(30);
const SIZE: [usize; 2] = [1280, 800];
/// Where the pointer rests: within the picture, beside the panel.
const PLACE: [usize; 2] = [500, 400];

/// Opens an image, zooms, drags, changes the range, opens and closes the panel, writes into its field, goes to a globe, and ends.
pub(super) fn use_window(place: &Path, program: &Path, image: &Path) -> Result<()> {
    let display = Display::start(place)?;
    let mut window = Window::open(&display, place, program, image)?;
    let used = window.walk_through();
    let said = fs::read_to_string(place.join("hands.txt")).unwrap_or_default();
    used.with_context(|| format!("the window under a person's hands; it said: {said}"))
}

/// A display that shows nothing to anybody, and what stands on it.
struct Display {
    server: Child,
    name: String,
    pixels: PathBuf,
}

impl Display {
    fn start(place: &Path) -> Result<Display> {
        let mut command = shell::command("Xvfb");
        command
            .args(["-displayfd", "1", "-screen", "0", &format!("{}x{}x24", SIZE[0], SIZE[1]), "-fbdir"])
            .arg(place);
        let mut server = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn()?;
        let mut number = String::new();
        if let Some(output) = server.stdout.take() {
            BufReader::new(output).read_line(&mut number)?;
        }
        let display =
            Display { server, name: format!(":{}", number.trim()), pixels: place.join("Xvfb_screen0") };
        ensure!(!number.trim().is_empty(), "Xvfb has not started");
        Ok(display)
    }

    /// Whether anything of the rows of columns has another colour, and the mean of all colours of them.
    fn look(&self, columns: std::ops::Range<usize>) -> Result<Vec<u8>> {
        let file = fs::read(&self.pixels)?;
        let word = |n: usize| -> Result<usize> {
            let bytes = file.get(4 * n..4 * n + 4).context("the display's pixels have no head")?;
            Ok(u32::from_be_bytes(bytes.try_into()?) as usize)
        };
        // The format of xwd: the length of the head, the bytes of a row, and colours of 12 bytes before the pixels.
        let (first, row_bytes) = (word(0)? + 12 * word(19)?, word(12)?);
        let row = |y: usize| {
            file.get(first + y * row_bytes + 4 * columns.start..first + y * row_bytes + 4 * columns.end)
        };
        let rows: Option<Vec<&[u8]>> = (0..SIZE[1]).map(row).collect();
        Ok(rows.context("the display's pixels are cut off")?.concat())
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        // It ends with everything that is on it.
        drop(self.server.kill());
        drop(self.server.wait());
    }
}

struct Window<'a> {
    display: &'a Display,
    program: Child,
    id: String,
}

impl<'a> Window<'a> {
    fn open(display: &'a Display, place: &Path, program: &Path, image: &Path) -> Result<Window<'a>> {
        let mut command = Command::new(program);
        command.current_dir(shell::root()).env("DISPLAY", &display.name).env_remove("WAYLAND_DISPLAY");
        command.env("XDG_CACHE_HOME", place.join("cache")).env("XDG_STATE_HOME", place.join("state"));
        command.arg("view").arg(image).args(["--size", &format!("{}x{}", SIZE[0], SIZE[1])]);
        let program = command.stderr(File::create(place.join("hands.txt"))?).spawn()?;
        let mut window = Window { display, program, id: String::new() };
        window.id = window.until("a window", |window| {
            let found = window.xdotool(&["search", "--onlyvisible", "--name", "png"]).ok()?;
            found.lines().next().map(str::to_owned)
        })?;
        window.xdotool(&["windowfocus", &window.id.clone()])?;
        Ok(window)
    }

    fn walk_through(&mut self) -> Result<()> {
        let [x, y] = PLACE.map(|side| side.to_string());
        self.xdotool(&["mousemove", &x, &y])?;
        // A texel of the built image is in the title, and nothing changes any more.
        self.until("the image", |window| {
            window.title().filter(|title| !title.contains("opening") && title.contains(": "))
        })?;
        let dark = self.settled()?;
        self.key("c")?;
        let stretched = self.until("another range", |window| {
            let seen = window.display.look(0..SIZE[0] - 400).ok()?;
            (mean(&seen) > mean(&dark) + 20.0).then_some(seen)
        })?;
        let magnification = self.magnification()?;
        (0..4).try_for_each(|_| self.xdotool(&["click", "4"]).map(drop))?;
        // Four notches of the wheel, each at least a quarter more: winit hears the press and the release of a device without scroll
        // axes as a notch each, and the pointer of this display is one.
        let wanted = 0.98 * magnification * 1.25f64.powi(4)..magnification * 1.3f64.powi(8);
        let mut before = 0.0;
        let zoomed = self.until("an image zoomed by the wheel", |window| {
            sleep(Duration::from_millis(400));
            let zoomed = window.magnification().ok()?;
            (zoomed == std::mem::replace(&mut before, zoomed) && wanted.contains(&zoomed)).then_some(zoomed)
        })?;
        self.settled()?;
        let texel = self.texel()?;
        self.xdotool(&["mousedown", "1"])?;
        for step in 1..=8 {
            self.xdotool(&["mousemove", &(PLACE[0] - 20 * step).to_string(), &y])?;
            sleep(Duration::from_millis(30));
        }
        self.xdotool(&["mouseup", "1"])?;
        self.xdotool(&["mousemove", &x, &y])?;
        self.until("another part of the image", |window| {
            window.texel().ok().filter(|there| there[0] > texel[0] + 10)
        })?;
        ensure!(self.magnification()? == zoomed, "a drag zooms to {} %", self.magnification()?);
        // The panel opens by its button in a window that draws nothing; keys that are written into its field are no commands.
        self.settled()?;
        sleep(Duration::from_secs(2));
        let beside = self.display.look(SIZE[0] - 300..SIZE[0] - 100)?;
        self.xdotool(&["mousemove", &(SIZE[0] - 30).to_string(), "18", "click", "1"])?;
        self.until("the panel", |window| {
            window.display.look(SIZE[0] - 300..SIZE[0] - 100).ok().filter(|seen| *seen != beside)
        })?;
        self.settled()?;
        sleep(Duration::from_secs(2));
        // The wheel over the panel is the panel's.
        self.xdotool(&["mousemove", &(SIZE[0] - 150).to_string(), "600", "click", "4"])?;
        self.settled()?;
        ensure!(
            self.magnification()? == zoomed,
            "the wheel over the panel zooms to {} %",
            self.magnification()?
        );
        self.xdotool(&["mousemove", &(SIZE[0] - 150).to_string(), "62", "click", "1"])?;
        sleep(Duration::from_millis(500));
        self.key("q")?;
        self.key("F3")?;
        sleep(Duration::from_secs(1));
        ensure!(self.program.try_wait()?.is_none(), "a letter in the field ends the program");
        ensure!(self.magnification().is_ok(), "a key in the field chooses a scene");
        self.xdotool(&["mousemove", &x, &y, "click", "1"])?;
        sleep(Duration::from_millis(500));
        self.key("m")?;
        self.key("F3")?;
        self.until("a globe", |window| window.title().filter(|title| title.contains("globe")))?;
        ensure!(self.settled()? != stretched, "the globe is seen");
        self.key("q")?;
        let ended = self.until("the end", |window| window.program.try_wait().ok()?)?;
        ensure!(ended.success(), "it ended with {ended}");
        Ok(())
    }

    /// The picture beside the panel once it stays as it is.
    fn settled(&mut self) -> Result<Vec<u8>> {
        let mut before = Vec::new();
        self.until("a picture that stays", |window| {
            sleep(Duration::from_millis(400));
            let seen = window.display.look(0..SIZE[0] - 400).ok()?;
            let stays = seen == before;
            before.clone_from(&seen);
            stays.then_some(seen)
        })
    }

    fn until<T>(&mut self, what: &str, mut get: impl FnMut(&mut Self) -> Option<T>) -> Result<T> {
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            if let Some(got) = get(self) {
                return Ok(got);
            }
            sleep(Duration::from_millis(50));
        }
        bail!("{what} has not come in {} s; the title is {:?}", PATIENCE.as_secs(), self.title())
    }

    fn key(&self, key: &str) -> Result<()> {
        self.xdotool(&["key", key]).map(drop)
    }

    fn title(&self) -> Option<String> {
        self.xdotool(&["getwindowname", &self.id]).ok()
    }

    /// Percent of an image, as the title has it.
    fn magnification(&self) -> Result<f64> {
        let title = self.title().unwrap_or_default();
        let part = title.split(" – ").find_map(|part| part.strip_suffix(" %")).map(str::to_owned);
        Ok(part.with_context(|| format!("no magnification in {title:?}"))?.parse()?)
    }

    /// The texel below the pointer, as the title has it.
    fn texel(&self) -> Result<[i64; 2]> {
        let title = self.title().unwrap_or_default();
        let part = title.split(" – ").find_map(|part| part.split_once(": ")?.0.split_once(','));
        let (x, y) = part.with_context(|| format!("no texel in {title:?}"))?;
        Ok([x.parse()?, y.parse()?])
    }

    fn xdotool(&self, words: &[&str]) -> Result<String> {
        shell::output(shell::command("xdotool").env("DISPLAY", &self.display.name).args(words))
    }
}

impl Drop for Window<'_> {
    fn drop(&mut self) {
        drop(self.program.kill());
        drop(self.program.wait());
    }
}

fn mean(bytes: &[u8]) -> f64 {
    bytes.iter().map(|&byte| f64::from(byte)).sum::<f64>() / bytes.len().max(1) as f64
}
