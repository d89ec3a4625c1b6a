//! The window under the hands of a person: keys and pointer are sent to it on a display of its own, and its
//! title and its pixels say what came of them.

mod broken;
mod changes;
mod dense;
mod planet;
mod pointer;
mod reader;
mod rest;
mod volume;

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use xtask::compiled_shaders;

use super::display::{Display, SIZE, mean};
use crate::{shaders, shell};
pub(super) use broken::use_broken;
pub(super) use dense::use_dense_screen;
pub(super) use planet::{PLANET, use_planet};
pub(super) use reader::use_by_ear;
use rest::Threads;
pub(super) use volume::use_volume;

/// What is looked at: 16 bits of heights.
const IMAGE: &str = "assets/earth-elevation-1080x540-u16.png";
/// As long something may take.
const PATIENCE: Duration = Duration::from_secs(120);
/// Between two looks at what is waited for.
const EVERY: Duration = Duration::from_millis(30);
/// Longer than a window that draws waits for its display: between two looks at threads that do nothing.
const REST: Duration = Duration::from_millis(120);
/// Where the pointer rests: within the picture, between the panels.
const PLACE: [usize; 2] = [366, 224];
/// Rows above notices.
const ABOVE: usize = 300;
/// Columns that the panel leaves free.
const FREE: std::ops::Range<usize> = 0..SIZE[0] - 330;
/// Columns of what the machine does, and where a button halves its first pool.
const HUD: std::ops::Range<usize> = 0..348;
const HALVE: [usize; 2] = [129, 299];
/// What a warning is written on, the button that does what it says, what an error is written on and the
/// button that dismisses it.
const WARNING: [u8; 3] = [255, 186, 66];
const REMEDY: [u8; 3] = [96, 60, 0];
const ERROR: [u8; 3] = [122, 30, 30];
const DISMISS: [u8; 3] = [78, 16, 16];
/// What graphs are drawn on.
const GROUND: [u8; 3] = [22, 24, 29];

/// Opens an image, changes the range, zooms, drags, uses the panel by pointer and keyboard, fails to open a
/// file, goes to a globe, looks at what the machine does, makes its pool too small and large enough again,
/// goes to the edges of the image, fills the screen, changes the theme and how views say what they want, and
/// ends; opened again it is as it was.
pub(super) fn use_window(place: &Path) -> Result<()> {
    let display = Display::start(place)?;
    let size = format!("{}x{}", SIZE[0], SIZE[1]);
    // A range of somebody's own, so that the keys have one to change.
    let first = ["--size", &size, "--pool-mib", "2", "--range", "0,1"];
    let image = shell::root().join(IMAGE);
    Window::hold(&display, place, &image, &first, Window::walk_through)?;
    // The next file is one that cannot be shown.
    let broken = place.join("broken.png");
    Window::hold(&display, place, &image, &[&broken.to_string_lossy()], Window::is_as_before)
        .context("opened again")
}

/// Returns true if a program says that an image was built.
pub(super) fn says_built(said: &str) -> bool {
    said.contains("is built into")
}

/// A program on a display, with a cache and a memory of its own in a place.
pub(super) fn stand_in(command: &mut Command, display: &Display, place: &Path) {
    command.env("DISPLAY", &display.name).env_remove("WAYLAND_DISPLAY");
    if let Some(bus) = &display.bus {
        command.env("DBUS_SESSION_BUS_ADDRESS", bus);
    }
    command.env("WINIT_X11_SCALE_FACTOR", display.scale.to_string());
    command.env(shaders::LOG, shaders::handed_over());
    command.env("XDG_CACHE_HOME", place.join("cache")).env("XDG_STATE_HOME", place.join("state"));
    // GNU's allocator keeps what a software driver takes again in each frame.
    command.env("MALLOC_TRIM_THRESHOLD_", "536870912").env("MALLOC_TOP_PAD_", "33554432");
    // Debug builds of wgpu add lines to shaders for debuggers, and errors that are handled need no backtrace:
    // both cost processor time.
    command.env("WGPU_DEBUG", "0").env("RUST_LIB_BACKTRACE", "0");
    // What was compiled in the tests need not be compiled again for each window.
    compiled_shaders::share(command);
}

struct Window<'a> {
    display: &'a Display,
    program: Child,
    id: String,
    /// Where pictures of the steps are kept, and what it says is written.
    place: PathBuf,
}

impl<'a> Window<'a> {
    /// Opens a window and uses it. Where that goes wrong, what was seen then stays as a picture, and what it
    /// said is told.
    fn hold(
        display: &'a Display,
        place: &Path,
        source: &Path,
        options: &[&str],
        using: impl FnOnce(&mut Window<'a>) -> Result<()>,
    ) -> Result<()> {
        let mut window = Window::open(display, place, source, options)?;
        let used = using(&mut window);
        if used.is_err() {
            drop(window.keep("99-failed"));
        }
        used.with_context(|| format!("under a person's hands; it said: {}", window.said()))
    }

    fn open(display: &'a Display, place: &Path, source: &Path, options: &[&str]) -> Result<Window<'a>> {
        let mut command = Command::new(super::program());
        // Pictures of the window are written where it runs.
        stand_in(command.current_dir(place), display, place);
        command.arg("view").arg(source).args(options);
        let program = command.stderr(File::create(place.join("hands.txt"))?).spawn()?;
        let mut window = Window { display, program, id: String::new(), place: place.to_owned() };
        window.id = window.until("a window", |window| {
            let ending = source.extension()?.to_str()?;
            let found = window.xdotool(&["search", "--onlyvisible", "--name", ending]).ok()?;
            found.lines().next().map(str::to_owned)
        })?;
        window.xdotool(&["windowfocus", &window.id.clone()])?;
        Ok(window)
    }

    fn walk_through(&mut self) -> Result<()> {
        self.point(PLACE)?;
        // A texel of the built image is in the title, and nothing changes any more.
        self.until("the image", |window| {
            window.title().filter(|title| !title.contains("opening") && title.contains(": "))
        })?;
        let dark = self.settled()?;
        self.keep("01-open")?;
        self.key("c")?;
        self.until("another range", |window| {
            let seen = window.display.look(FREE).ok()?;
            (mean(&seen) > mean(&dark) + 20.0).then_some(())
        })?;
        self.keep("02-range")?;
        let zoomed = self.zoom_and_drag()?;
        self.use_panel(zoomed)?;
        self.fail_to_open()?;
        self.key("F3")?;
        self.until("a globe", |window| window.title().filter(|title| title.contains("globe")))?;
        self.settled()?;
        self.keep("08-globe")?;
        self.key("F1")?;
        self.until("the image again", |window| window.magnification().ok())?;
        self.look_at_machine()?;
        self.go_to_edges()?;
        self.fill_screen()?;
        self.change_theme()?;
        // Last, since pictures that say themselves what they lack are drawn until nothing is missing.
        self.change_feedback()?;
        self.key("F8")?;
        self.until("a recording", |window| window.title().filter(|title| title.contains("is recorded")))?;
        // Of the file that could not be shown the exit code tells, too.
        let ended = self.quit()?;
        let recorded = fs::read_to_string(self.place.join("earth-elevation-1080x540-u16-1.path"));
        let recorded = recorded.context("what was recorded when the window closed")?;
        ensure!(recorded.contains("\n0 image:"), "it recorded {recorded}");
        ensure!(ended.code() == Some(1), "it ended with {ended}");
        Ok(())
    }

    /// What is opened again is as it was: its size, and that the machine is shown.
    fn is_as_before(&mut self) -> Result<()> {
        self.until("the image", |window| window.magnification().ok())?;
        let grounds = |window: &mut Self| window.display.find(HUD, GROUND).ok().flatten();
        self.until("what was shown before", |window| grounds(window).filter(|found| found.count > 10_000))?;
        self.settled()?;
        self.keep("18-again")?;
        let geometry = self.xdotool(&["getwindowgeometry", "--shell", &self.id])?;
        let has = |what: &str| geometry.lines().any(|line| line == what);
        ensure!(
            SIZE.map(|side| side.to_string())
                .iter()
                .zip(["WIDTH", "HEIGHT"])
                .all(|(side, name)| has(&format!("{name}={side}"))),
            "opened again it is another size: {geometry}"
        );
        let kept = fs::read_to_string(self.place.join("state/vastex/window.json"))?;
        for chosen in ["\"feedback\": \"inline\"", "\"bytes\": "] {
            ensure!(kept.contains(chosen), "{chosen} is not remembered: {kept}");
        }
        self.link_after_failure()?;
        self.key("Escape")?;
        ensure!(self.ended()?.code() == Some(1), "it ended without the error of its second file");
        Ok(())
    }

    /// Control and arrows go to the edges of the image, and Caps Lock changes no key.
    fn go_to_edges(&mut self) -> Result<()> {
        // In the middle of the image, beside what the machine does.
        let place = [(HUD.end + SIZE[0]) / 2, SIZE[1] / 2];
        self.point(place)?;
        self.key("3")?;
        self.until("texels of three pixels", |window| {
            window.magnification().ok().filter(|there| *there == 300.0)
        })?;
        self.settled()?;
        let texel = self.texel()?;
        self.key("ctrl+Left")?;
        self.key("ctrl+Up")?;
        // The image begins at the window's edges, and texels have three pixels.
        let corner = self.texel_until("the corner", |there| there[0] < texel[0] && there[1] < texel[1])?;
        let before = place.map(|pixel| pixel as i64 / 3);
        ensure!(
            (0..2).all(|axis| (corner[axis] - before[axis]).abs() <= 1),
            "at the corner {corner:?} is below the pointer"
        );
        self.key("shift+Right")?;
        self.texel_until("a view on", |there| there[0] > corner[0])?;
        self.keep("14-edges")?;
        self.key("Caps_Lock")?;
        self.key("ctrl+c")?;
        let copied =
            self.until("a copy", |window| window.title().filter(|title| title.contains("copied: ")))?;
        self.key("Caps_Lock")?;
        ensure!(copied.contains("copied: image:"), "with Caps Lock another thing is copied: {copied}");
        Ok(())
    }

    /// After a file that cannot be shown a link is of the one that is.
    fn link_after_failure(&mut self) -> Result<()> {
        self.key("n")?;
        let error = |window: &mut Self| window.display.find(0..SIZE[0], ERROR).ok().flatten();
        self.until("an error in the window", |window| error(window).filter(|found| found.count > 4000))?;
        self.key("ctrl+shift+c")?;
        let copied =
            self.until("a link", |window| window.title().filter(|title| title.contains("vastex:")))?;
        self.keep("19-link")?;
        ensure!(
            copied.contains("u16.png") && !copied.contains("broken"),
            "the link is of another file: {copied}"
        );
        Ok(())
    }

    /// Percent of the image after it.
    fn zoom_and_drag(&mut self) -> Result<f64> {
        let magnification = self.magnification()?;
        self.turn_wheel(true, 4)?;
        // Four notches of the wheel, each at least a quarter more: winit hears the press and the release of a
        // device without scroll axes as a notch each, and the pointer of this display is one.
        let wanted = 0.98 * magnification * 1.25f64.powi(4)..magnification * 1.3f64.powi(8);
        let zoomed = self.until("an image zoomed by the wheel", |window| {
            window.settled().ok()?;
            window.magnification().ok().filter(|zoomed| wanted.contains(zoomed))
        })?;
        self.keep("03-zoom")?;
        let texel = self.texel()?;
        self.drag([PLACE, [PLACE[0] - 160, PLACE[1]]])?;
        self.point(PLACE)?;
        self.until("another part of the image", |window| {
            window.texel().ok().filter(|there| there[0] > texel[0] + 10)
        })?;
        ensure!(self.magnification()? == zoomed, "a drag zooms to {} %", self.magnification()?);
        self.settled()?;
        self.keep("04-pan")?;
        Ok(zoomed)
    }

    /// The panel opens by its button in a window that draws nothing, and keys that are written into its field
    /// are no commands.
    fn use_panel(&mut self, zoomed: f64) -> Result<()> {
        // Above notices, which come and go, and the scale.
        let panel = |window: &Self| -> Result<Vec<u8>> {
            let columns = SIZE[0] - 250..SIZE[0] - 125;
            let mut seen = window.display.look(columns.clone())?;
            seen.truncate(4 * columns.len() * ABOVE);
            Ok(seen)
        };
        let beside = panel(self)?;
        self.click([SIZE[0] - 30, 18])?;
        let is_other = |window: &mut Self| panel(window).ok().filter(|seen| *seen != beside);
        self.until("the panel", is_other)?;
        self.settled()?;
        self.keep("05-panel")?;
        // The wheel over the panel is the panel's.
        self.point([SIZE[0] - 150, SIZE[1] - 200])?;
        self.xdotool(&["click", "4"])?;
        self.settled()?;
        ensure!(self.magnification()? == zoomed, "the wheel over the panel zooms");
        self.click([SIZE[0] - 150, 62])?;
        self.rest()?;
        self.key("q")?;
        self.key("F3")?;
        self.rest()?;
        ensure!(self.program.try_wait()?.is_none(), "a letter in the field ends the program");
        ensure!(self.magnification().is_ok(), "a key in the field chooses a scene");
        // Escape leaves the field, M closes the panel, Tab opens it and goes from control to control.
        self.key("Escape")?;
        self.rest()?;
        self.key("m")?;
        let is_closed = |window: &mut Self| panel(window).ok().filter(|seen| *seen == beside);
        self.point(PLACE)?;
        self.until("no panel", is_closed)?;
        self.key("Tab")?;
        self.until("the panel by the keyboard", is_other)?;
        self.rest()?;
        self.key("Tab")?;
        self.rest()?;
        self.keep("06-keyboard")?;
        self.key("Escape")
    }

    /// A file that is none is told of in the window until that is dismissed, and what was there stays.
    fn fail_to_open(&mut self) -> Result<()> {
        let broken = self.place.join("broken.png");
        fs::write(&broken, "no picture")?;
        self.click([SIZE[0] - 150, 62])?;
        self.rest()?;
        self.key("ctrl+a")?;
        self.xdotool(&["type", "--delay", "8", &broken.to_string_lossy()])?;
        self.key("Return")?;
        let error = |window: &mut Self| window.display.find(0..SIZE[0] - 320, ERROR).ok().flatten();
        self.until("an error in the window", |window| error(window).filter(|found| found.count > 4000))?;
        self.settled()?;
        self.keep("07-error")?;
        ensure!(self.magnification().is_ok(), "what was there is gone");
        let dismiss =
            self.display.find(0..SIZE[0] - 320, DISMISS)?.context("an error cannot be dismissed")?;
        self.click(dismiss.middle)?;
        self.until("an error that is gone", |window| error(window).is_none().then_some(()))?;
        // A click on the picture takes the keys back.
        self.click(PLACE)?;
        self.rest()?;
        self.key("m")
    }

    /// What the machine does is shown at no cost, a pool that is too small is told of, and the remedy that is
    /// offered is one.
    fn look_at_machine(&mut self) -> Result<()> {
        self.key("u")?;
        let ground = |window: &mut Self| window.display.find(HUD, GROUND).ok().flatten();
        self.until("what the machine does", |window| ground(window).filter(|found| found.count > 10_000))?;
        // Why a pixel is as it is comes by itself.
        self.point([PLACE[0] + 10, PLACE[1] + 10])?;
        self.settled()?;
        self.keep("09-machine")?;
        self.costs_nothing()?;
        let warning = |window: &mut Self| {
            window.display.find(HUD, WARNING).ok().flatten().filter(|found| found.count > 4000)
        };
        ensure!(warning(self).is_none(), "the pool is too small before it is made so");
        let begun = Instant::now();
        while warning(self).is_none() {
            ensure!(begun.elapsed() < PATIENCE, "no pool becomes too small");
            self.click(HALVE)?;
            self.settled()?;
        }
        self.point(PLACE)?;
        self.settled()?;
        self.keep("10-too-small")?;
        let remedy = self.display.find(HUD, REMEDY)?.context("the warning offers no remedy")?;
        self.click(remedy.middle)?;
        self.until("a pool that is large enough", |window| warning(window).is_none().then_some(()))?;
        self.point(PLACE)?;
        self.settled()?;
        self.keep("11-large-enough")?;
        self.key("l")?;
        self.until("an overlay", |window| window.title().filter(|title| title.contains("levels")))?;
        self.settled()?;
        self.keep("12-levels")?;
        (0..7).try_for_each(|_| self.key("l"))?;
        self.until("the picture again", |window| window.magnification().ok())?;
        self.key("question")?;
        self.settled()?;
        self.keep("13-keys")?;
        self.key("Escape")
    }

    /// While nothing happens the program takes nothing of a processor, whatever it shows.
    fn costs_nothing(&mut self) -> Result<()> {
        // Hundredths of a second. A notice that goes, or a tool tip, may be a frame of its own.
        self.until("a window at rest", |window| {
            let before = window.spent().ok()?;
            sleep(Duration::from_secs(1));
            (window.spent().ok()? <= before + 1).then_some(())
        })
    }

    fn quit(&mut self) -> Result<ExitStatus> {
        self.key("q")?;
        self.ended()
    }

    fn ended(&mut self) -> Result<ExitStatus> {
        self.until("the end", |window| window.program.try_wait().ok()?)
    }

    /// Keeps a picture of what is seen after a step.
    fn keep(&self, step: &str) -> Result<()> {
        self.display.keep(&self.place.join("steps").join(format!("{step}.png")))
    }

    /// What it has said so far.
    fn said(&self) -> String {
        fs::read_to_string(self.place.join("hands.txt")).unwrap_or_default()
    }

    /// The picture beside the panel once it stays as it is, and nothing is done any more.
    fn settled(&mut self) -> Result<Vec<u8>> {
        self.until("a picture that stays", |window| {
            let before = window.display.look(FREE).ok()?;
            let is_idle = window.is_idle().ok()?;
            let seen = window.display.look(FREE).ok()?;
            (is_idle && seen == before).then_some(seen)
        })
    }

    /// Waits until what was asked for is done.
    fn rest(&mut self) -> Result<()> {
        self.until("a program at rest", |window| window.is_idle().ok()?.then_some(()))
    }

    /// Returns true if no thread of the program, nor of its display, does anything or has anything to do.
    fn is_idle(&self) -> Result<bool> {
        let programs = [self.program.id(), self.display.id()];
        let Some(before) = Threads::look(&programs)? else { return Ok(false) };
        sleep(REST);
        Ok(Threads::look(&programs)? == Some(before))
    }

    /// Hundredths of a second of processors that it has taken so far.
    fn spent(&self) -> Result<u64> {
        let stat = fs::read_to_string(format!("/proc/{}/stat", self.program.id()))?;
        let fields: Vec<&str> = stat.rsplit_once(')').context("no process")?.1.split_whitespace().collect();
        Ok(fields[11].parse::<u64>()? + fields[12].parse::<u64>()?)
    }

    fn until<T>(&mut self, what: &str, mut get: impl FnMut(&mut Self) -> Option<T>) -> Result<T> {
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            if let Some(got) = get(self) {
                return Ok(got);
            }
            sleep(EVERY);
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
        let part = title.split(" – ").find_map(|part| part.strip_suffix(" %"));
        Ok(part.with_context(|| format!("no magnification in {title:?}"))?.parse()?)
    }

    /// The texel below the pointer, as the title has it.
    fn texel(&self) -> Result<[i64; 2]> {
        let title = self.title().unwrap_or_default();
        let part = title.split(" – ").find_map(|part| part.split_once(": ")?.0.split_once(','));
        let (x, y) = part.with_context(|| format!("no texel in {title:?}"))?;
        Ok([x.parse()?, y.parse()?])
    }

    /// The texel below the pointer once it is as it should be.
    fn texel_until(&mut self, what: &str, is_it: impl Fn([i64; 2]) -> bool) -> Result<[i64; 2]> {
        self.until(what, |window| window.texel().ok().filter(|there| is_it(*there)))
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
