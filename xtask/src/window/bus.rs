//! A session bus of its own, with the registry in which programs say what is in their windows, and what a
//! screen reader learns there. It is asked by `gdbus`, a question at a time.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result};

use super::display::Display;
use crate::shell;

/// Where the root of what a program shows is, and the registry's list of programs.
const ROOT: &str = "/org/a11y/atspi/accessible/root";

/// The bus.
pub(super) struct Bus {
    daemon: Child,
    pub(super) address: String,
    /// Where programs say what is in their windows.
    registry: String,
    /// What its programs write while they run. It is short, since sockets have short names.
    place: PathBuf,
}

/// Something in a window, as a program tells of it: whose it is, and by which name it is asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Node {
    program: String,
    path: String,
    pub(super) role: u32,
    pub(super) name: String,
}

impl Bus {
    /// Starts one, on which no program has to say anything yet.
    pub(super) fn start(display: &Display) -> Result<Bus> {
        let place = std::env::temp_dir().join(format!("vastex-bus-{}", std::process::id()));
        fs::create_dir(&place)?;
        let mut command = shell::command("dbus-daemon");
        command.args(["--session", "--nofork", "--nopidfile", "--print-address=1"]);
        // Nobody's own settings are read or changed.
        command.env("DISPLAY", &display.name).env("XDG_RUNTIME_DIR", &place).env("HOME", &place);
        command.env("GSETTINGS_BACKEND", "memory").env_remove("DBUS_SESSION_BUS_ADDRESS");
        let daemon = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn()?;
        let mut bus = Bus { daemon, address: String::new(), registry: String::new(), place };
        let mut address = String::new();
        if let Some(output) = bus.daemon.stdout.take() {
            BufReader::new(output).read_line(&mut address)?;
        }
        bus.address = address.trim().to_owned();
        let told = call(&bus.address, ["org.a11y.Bus", "/org/a11y/bus", "org.a11y.Bus.GetAddress"], &[])?;
        bus.registry = texts(&told).next().context("there is no registry")?;
        Ok(bus)
    }

    /// Programs are to say what is in their windows, or need not any more: a screen reader comes or goes.
    pub(super) fn set_heard(&self, is_heard: bool) -> Result<()> {
        let method = "org.freedesktop.DBus.Properties.Set";
        let value = format!("<{is_heard}>");
        let set = ["org.a11y.Status", "IsEnabled", &value];
        call(&self.address, ["org.a11y.Bus", "/org/a11y/bus", method], &set).map(drop)
    }

    /// Everything in the windows of all programs. What goes while it is asked for is left out.
    pub(super) fn nodes(&self) -> Result<Vec<Node>> {
        let registry = Node {
            program: "org.a11y.atspi.Registry".to_owned(),
            path: ROOT.to_owned(),
            role: 0,
            name: String::new(),
        };
        let (mut found, mut left) = (Vec::new(), self.children(&registry)?);
        while let Some(mut node) = left.pop() {
            let Ok(children) = self.children(&node) else { continue };
            left.extend(children.into_iter().rev());
            let role = self.tell(&node, "Accessible.GetRole", &[]).ok().as_deref().and_then(number);
            let (Some(role), Ok(name)) = (role, self.property(&node, "Name")) else { continue };
            (node.role, node.name) = (role, name);
            found.push(node);
        }
        Ok(found)
    }

    fn children(&self, node: &Node) -> Result<Vec<Node>> {
        let told = self.tell(node, "Accessible.GetChildren", &[])?;
        let told: Vec<String> = texts(&told).collect();
        let child = |[program, path]: &[String; 2]| Node {
            program: program.clone(),
            path: path.clone(),
            role: 0,
            name: String::new(),
        };
        Ok(told.as_chunks().0.iter().map(child).collect())
    }

    /// A property of a node, which is a text.
    fn property(&self, node: &Node, name: &str) -> Result<String> {
        let place = [&*node.program, &node.path, "org.freedesktop.DBus.Properties.Get"];
        let told = call(&self.registry, place, &["org.a11y.atspi.Accessible", name])?;
        Ok(texts(&told).next().unwrap_or_default())
    }

    /// The text that a node answers a question with.
    pub(super) fn ask(&self, node: &Node, method: &str, arguments: &[&str]) -> Result<String> {
        Ok(texts(&self.tell(node, method, arguments)?).next().unwrap_or_default())
    }

    /// Has a node do something. Gives back what it says to that.
    pub(super) fn tell(&self, node: &Node, method: &str, arguments: &[&str]) -> Result<String> {
        let method = format!("org.a11y.atspi.{method}");
        call(&self.registry, [&node.program, &node.path, &method], arguments)
    }
}

impl Drop for Bus {
    fn drop(&mut self) {
        // Its programs end with it.
        drop(self.daemon.kill());
        drop(self.daemon.wait());
        drop(fs::remove_dir_all(&self.place));
    }
}

/// Calls a method of a program on a bus: the program, where in it, and which.
fn call(bus: &str, [program, path, method]: [&str; 3], arguments: &[&str]) -> Result<String> {
    let mut command: Command = shell::command("gdbus");
    command.args(["call", "--timeout", "60", "--address", bus]);
    command.args(["--dest", program, "--object-path", path, "--method", method, "--"]).args(arguments);
    shell::output(&mut command)
}

/// The number in what `gdbus` prints, behind the name of its type.
fn number(printed: &str) -> Option<u32> {
    let (_, rest) = printed.split_once("uint32 ")?;
    rest.split(|letter: char| !letter.is_ascii_digit()).next()?.parse().ok()
}

/// The texts in what `gdbus` prints: each stands in quotes of either kind, and a backslash stands before what
/// would end it.
fn texts(printed: &str) -> impl Iterator<Item = String> {
    let mut left = printed.chars();
    std::iter::from_fn(move || {
        let quote = left.find(|letter| matches!(letter, '\'' | '"'))?;
        let mut text = String::new();
        loop {
            match left.next()? {
                '\\' => text.push(match left.next()? {
                    'n' => '\n',
                    't' => '\t',
                    letter => letter,
                }),
                letter if letter == quote => return Some(text),
                letter => text.push(letter),
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_found_in_what_is_printed() {
        let found = |printed| texts(printed).collect::<Vec<_>>();
        assert_eq!(found("([(':1.3', objectpath '/a/0'), (':1.4', '/b')],)"), [":1.3", "/a/0", ":1.4", "/b"]);
        assert_eq!(found(r#"(<"it's">, 'say \'a\'', 'two\nlines')"#), ["it's", "say 'a'", "two\nlines"]);
        assert_eq!(found("(true,)"), [""; 0]);
        assert_eq!(found("('cut"), [""; 0]);
        assert_eq!([number("(uint32 75,)"), number("(true,)")], [Some(75), None]);
    }
}
