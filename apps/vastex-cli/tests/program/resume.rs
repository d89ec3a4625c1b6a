//! `build --resume`: killed, interrupted or out of room at any moment, the same command goes on to the same bytes.
#![cfg(unix)]

use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::tool::{Desk, Ended};

const PARTIAL: &str = ".out.vastex.partial";
const JOURNAL: &str = ".out.vastex.journal";

/// Kills of the program, 20 if `VASTEX_KILLS` does not say otherwise.
fn kills() -> u64 {
    std::env::var("VASTEX_KILLS").ok().and_then(|number| number.parse().ok()).unwrap_or(20)
}

const BUILD: &[&str] =
    &["build", "big.png", "-o", "out.vastex", "--page", "40", "--compress", "none", "--quiet"];

/// A desk with `big.png` and its container, and how long that took to build.
fn desk() -> (Desk, Vec<u8>, Duration) {
    let desk = Desk::new();
    desk.write_png("big.png", [2000, 1600]);
    let begin = Instant::now();
    desk.run(BUILD).expect_code(0);
    let took = begin.elapsed();
    let whole = desk.read("out.vastex");
    std::fs::remove_file(desk.path("out.vastex")).unwrap();
    (desk, whole, took)
}

/// The signal, by its name, after so long; says whether the program was still there.
pub(crate) fn signal_after(desk: &Desk, args: &[&str], signal: &str, delay: Duration) -> Option<Ended> {
    let mut command = desk.command(args);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    sleep(delay);
    let was_there = child.try_wait().unwrap().is_none();
    if was_there {
        let number = child.id().to_string();
        assert!(Command::new("kill").args(["-s", signal, &number]).status().unwrap().success());
    }
    let ended = Ended::of(&child.wait_with_output().unwrap());
    was_there.then_some(ended)
}

#[test]
fn a_killed_build_resumes_to_the_same_bytes() {
    let (desk, whole, took) = desk();
    let resume = [BUILD, &["--resume", "--json"]].concat();
    let (mut killed, mut taken_over) = (0, 0);
    for case in 0..kills() {
        // One to three kills, of builds with and without --resume, at moments spread over the whole build.
        for kill in 0..=case % 3 {
            let share = (case * 61 + kill * 37) % 100;
            let args = if case % 2 == 0 || kill > 0 { &resume } else { BUILD };
            let ended = signal_after(&desk, args, "KILL", took * share as u32 / 100);
            killed += u64::from(ended.is_some_and(|ended| ended.code.is_none()));
        }
        let ended = desk.run(&resume).expect_code(0);
        taken_over += ended.json()["resumed_tiles"].as_u64().unwrap();
        assert!(desk.read("out.vastex") == whole, "case {case}: other bytes");
        assert_eq!(desk.names(), ["big.png", "out.vastex"], "case {case}");
        std::fs::remove_file(desk.path("out.vastex")).unwrap();
    }
    println!("{killed} kills, {taken_over} tiles taken over");
    assert!(killed >= kills() / 2, "only {killed} builds were still there to be killed");
    assert!(taken_over > 0, "nothing was ever taken over");
}

#[test]
fn ctrl_c_keeps_what_can_be_resumed_and_nothing_else() {
    let (desk, whole, took) = desk();
    // The first signal that finds the program at work, at a moment that suits this machine.
    let interrupt = |args: &[&str]| {
        let attempts = [50, 40, 30, 20, 10, 60, 70].into_iter();
        let mut ended = attempts.filter_map(|share| signal_after(&desk, args, "INT", took * share / 100));
        ended.find(|ended| ended.code == Some(130)).unwrap()
    };
    let plain = interrupt(BUILD);
    assert!(plain.stderr.contains("nothing was left behind"), "{plain}");
    let _ = std::fs::remove_file(desk.path("out.vastex"));
    assert_eq!(desk.names(), ["big.png"]);
    let resume = [BUILD, &["--resume"]].concat();
    let kept = interrupt(&resume);
    assert!(kept.stderr.contains("the same command goes on"), "{kept}");
    let _ = std::fs::remove_file(desk.path("out.vastex"));
    assert_eq!(desk.names(), [JOURNAL, PARTIAL, "big.png"]);
    desk.run(&resume).expect_code(0);
    assert!(desk.read("out.vastex") == whole);
    assert_eq!(desk.names(), ["big.png", "out.vastex"]);
}

/// Runs the program where no file may have more than so many blocks: its writes fail as on a full disk.
fn run_short_of_room(desk: &Desk, blocks: u32, args: &[&str]) -> Ended {
    let mut shell = Command::new("sh");
    shell.current_dir(desk.path("")).env_remove("RUST_LOG");
    shell.args(["-c", &format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$@\""), "sh"]);
    shell.arg(env!("CARGO_BIN_EXE_vastex")).args(args);
    Ended::of(&shell.output().unwrap())
}

#[test]
fn where_the_room_ends_the_message_says_so_and_resume_keeps_what_is_there() {
    let (desk, whole, _) = desk();
    let short = run_short_of_room(&desk, 6000, BUILD).expect_code(1);
    for word in ["out.vastex: cannot be written", "choose another place"] {
        assert!(short.stderr.contains(word), "{short}");
    }
    assert_eq!(desk.names(), ["big.png"]);
    let resume = [BUILD, &["--resume", "--json"]].concat();
    let short = run_short_of_room(&desk, 6000, &resume).expect_code(1);
    for word in ["out.vastex: cannot be written", "choose another place", "the same command goes on"] {
        assert!(short.stderr.contains(word), "{short}");
    }
    assert_eq!(desk.names(), [JOURNAL, PARTIAL, "big.png"]);
    let ended = desk.run(&resume).expect_code(0);
    assert!(ended.json()["resumed_tiles"].as_u64().unwrap() > 0, "{ended}");
    assert!(desk.read("out.vastex") == whole);
    assert_eq!(desk.names(), ["big.png", "out.vastex"]);
}

#[test]
fn what_another_build_left_is_refused_with_the_remedy() {
    let (desk, whole, took) = desk();
    let resume = [BUILD, &["--resume"]].concat();
    let left = [JOURNAL, PARTIAL, "big.png"];
    // A build that was killed too late, or too early, has left something else.
    for eighth in (1..8).rev().cycle() {
        signal_after(&desk, &resume, "KILL", took * eighth / 8);
        let names = desk.names();
        if names == left {
            break;
        }
        names.iter().filter(|name| *name != "big.png").for_each(|name| {
            std::fs::remove_file(desk.path(name)).unwrap();
        });
    }
    let other = desk.run(&[&resume[..], &["--border", "8"]].concat()).expect_code(1);
    for word in ["out.vastex", "other options", "build without --resume"] {
        assert!(other.stderr.contains(word), "{other}");
    }
    desk.write_png("big.png", [2000, 1601]);
    desk.run(&resume).expect_code(1);
    desk.write_png("big.png", [2000, 1600]);
    desk.run(&resume).expect_code(0);
    assert!(desk.read("out.vastex") == whole);
}
