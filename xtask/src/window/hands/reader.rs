//! The window by ear: a screen reader comes while nothing happens, hears the names of all controls, uses them
//! by what it was told alone, and goes.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use super::super::bus::{Bus, Node};
use super::super::display::{Display, SIZE};
use super::{IMAGE, Window};
use crate::shell;

/// What a person can use, by AT-SPI's numbers of roles: check box and its item of a menu, combo box, item of
/// a menu, button, radio button and its item, slider, spin button, text, toggle button, field, link.
const USED: [u32; 13] = [7, 8, 11, 35, 43, 44, 45, 51, 52, 61, 62, 79, 88];
/// A window.
const WINDOWS: [u32; 2] = [23, 69];
/// Controls that are heard at least while the panel is open.
const LEAST: usize = 20;

/// Opens an image, and the panel by its button; goes to a globe, writes a text into a field, cuts it out and
/// pastes it, and ends.
pub(in super::super) fn use_by_ear(place: &Path) -> Result<()> {
    let mut display = Display::start(place)?;
    let bus = Bus::start(&display)?;
    display.bus = Some(bus.address.clone());
    let size = format!("{}x{}", SIZE[0], SIZE[1]);
    let image = shell::root().join(IMAGE);
    Window::hold(&display, place, &image, &["--size", &size], |window| window.is_heard(&bus))
}

impl Window<'_> {
    fn is_heard(&mut self, bus: &Bus) -> Result<()> {
        self.until("the image", |window| window.magnification().ok())?;
        self.settled()?;
        self.costs_nothing()?;
        // Nothing happens in the window when somebody comes who wants to know.
        bus.set_heard(true)?;
        let button = self.heard(bus, |node| node.name == "Panel")?;
        self.rest()?;
        self.costs_nothing()?;
        bus.press(&button)?;
        let field = self.heard(bus, |node| node.name == "Path" && USED.contains(&node.role))?;
        self.settled()?;
        self.keep("01-panel")?;
        let nodes = bus.nodes()?;
        let line = |node: &Node| format!("{}: {}\n", node.role, node.name.escape_debug());
        let heard: String = nodes.iter().map(line).collect();
        fs::write(self.place.join("heard.txt"), &heard)?;
        let used: Vec<&Node> = nodes.iter().filter(|node| USED.contains(&node.role)).collect();
        let unnamed: Vec<_> = used.iter().filter(|node| node.name.trim().is_empty()).collect();
        ensure!(unnamed.is_empty(), "controls without a name: {unnamed:?}; of all that is heard:\n{heard}");
        ensure!(used.len() >= LEAST, "{} controls are heard: {heard}", used.len());
        println!("{} controls are heard, each by its name", used.len());
        let is_window = |node: &&Node| WINDOWS.contains(&node.role);
        let window = nodes.iter().find(is_window).with_context(|| format!("no window in:\n{heard}"))?;
        ensure!(IMAGE.ends_with(&window.name) && !window.name.is_empty(), "the window is {window:?}");
        let globe = self.heard(bus, |node| node.name == "globe")?;
        bus.press(&globe)?;
        self.until("a globe", |window| window.title().filter(|title| title.contains("globe")))?;
        self.settled()?;
        self.keep("02-globe")?;
        self.write_by_ear(bus, &field)?;
        // Who hears nothing any more costs nothing.
        bus.set_heard(false)?;
        self.rest()?;
        self.costs_nothing()?;
        let ended = self.quit()?;
        ensure!(ended.success(), "it ended with {ended}");
        Ok(())
    }

    /// What is cut out of a field is pasted into it twice.
    fn write_by_ear(&mut self, bus: &Bus, field: &Node) -> Result<()> {
        let told = bus.tell(field, "Component.GrabFocus", &[])?;
        ensure!(told.contains("true"), "the field does not take the keys: {told}");
        self.rest()?;
        let written = |wanted: &'static str| {
            move |_: &mut Self| {
                let text = bus.ask(field, "Text.GetText", &["0", "-1"]).ok()?;
                (text == wanted).then_some(())
            }
        };
        self.xdotool(&["type", "moon"])?;
        self.until("a text in the field", written("moon"))?;
        self.key("ctrl+a")?;
        self.key("ctrl+x")?;
        self.until("a field whose text is cut out", written(""))?;
        self.key("ctrl+v")?;
        self.until("what was cut out", written("moon"))?;
        self.key("ctrl+v")?;
        self.until("what was cut out once more", written("moonmoon"))?;
        self.settled()?;
        self.keep("03-pasted")?;
        self.key("Escape")
    }

    /// A node of the window, once there is such a one.
    fn heard(&mut self, bus: &Bus, is_it: impl Fn(&Node) -> bool) -> Result<Node> {
        let mut heard = Vec::new();
        let found = self.until("what a screen reader looks for", |_| {
            heard = bus.nodes().ok()?;
            heard.iter().find(|node| is_it(node)).cloned()
        });
        found.with_context(|| format!("it hears {heard:?}"))
    }
}

impl Bus {
    /// Has a control do what a click does.
    fn press(&self, node: &Node) -> Result<()> {
        let told = self.tell(node, "Action.DoAction", &["0"])?;
        ensure!(told.contains("true"), "{node:?} does nothing: {told}");
        Ok(())
    }
}
