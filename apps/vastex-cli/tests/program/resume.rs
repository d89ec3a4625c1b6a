//! `build --resume`: killed, interrupted or out of room at any moment, the same command goes on to the same
//! bytes.
#![cfg(unix)]

use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use xtask::limited::Limited;

use crate::tool::{Ended, PATIENCE, Sandbox};

const PARTIAL: &str = ".out.vastex.partial";
const JOURNAL: &str = ".out.vastex.journal";

/// Kills of the program, 20 if `VASTEX_KILLS` does not say otherwise.
fn kills() -> u64 {
    std::env::var("VASTEX_KILLS").ok().and_then(|number| number.parse().ok()).unwrap_or(20)
}

const BUILD: &[&str] =
    &["build", "big.png", "-o", "out.vastex", "--page", "40", "--compress", "none", "--quiet"];

/// A sandbox with `big.png`, and the bytes of its container.
fn sandbox() -> (Sandbox, Vec<u8>) {
    let sandbox = Sandbox::new();
    sandbox.write_png("big.png", [1500, 1200]);
    sandbox.run(BUILD).expect_code(0);
    let whole = sandbox.read("out.vastex");
    std::fs::remove_file(sandbox.path("out.vastex")).unwrap();
    (sandbox, whole)
}

/// Sends the signal of this name to the program once what it has not finished yet has so many bytes; says how
/// it ended.
///
/// The moment follows from the program's work, whatever the speed of the machine. A program that is done
/// before it is seen at work is run again, where that can be; that it gets away each time means that it does
/// not work as it should.
pub(crate) fn signal_at(sandbox: &Sandbox, args: &[&str], signal: &str, bytes: u64) -> Ended {
    const ATTEMPTS: u64 = 30;
    for attempt in 0..ATTEMPTS {
        let bytes = bytes * (ATTEMPTS - attempt) / ATTEMPTS;
        let mut running = Limited::start(&mut sandbox.command(args), PATIENCE).unwrap();
        let begin = Instant::now();
        while !running.has_ended().unwrap() && unfinished_bytes(sandbox) < bytes {
            assert!(
                begin.elapsed() < PATIENCE,
                "{args:?} did neither end nor write {bytes} bytes in {PATIENCE:?}; {running}"
            );
            sleep(Duration::from_millis(1));
        }
        if !running.has_ended().unwrap() {
            let number = running.id().to_string();
            // It may end at this very moment.
            let mut kill = Command::new("kill");
            let _ = kill.args(["-s", signal, &number]).stderr(Stdio::null()).status().unwrap();
        }
        let ended = Ended::of_running(running);
        if ended.code.is_none() || ended.code == Some(130) {
            return ended;
        }
        let _ = std::fs::remove_file(sandbox.path("out.vastex"));
    }
    panic!("{args:?} was never caught at work");
}

/// Bytes of all that the program has begun and not finished.
fn unfinished_bytes(sandbox: &Sandbox) -> u64 {
    let hidden = sandbox.names().into_iter().filter(|name| name.starts_with('.'));
    hidden.filter_map(|name| Some(std::fs::metadata(sandbox.path(&name)).ok()?.len())).sum()
}

#[test]
fn a_killed_build_resumes_to_the_same_bytes() {
    let (sandbox, whole) = sandbox();
    let resume = [BUILD, &["--resume", "--json"]].concat();
    let mut taken_over = 0;
    for case in 0..kills() {
        // One to three kills, of builds with and without --resume, at moments spread over the whole build.
        for kill in 0..=case % 3 {
            let share = (case * 61 + kill * 37) % 100;
            let args = if case % 2 == 0 || kill > 0 { &resume } else { BUILD };
            let killed = signal_at(&sandbox, args, "KILL", whole.len() as u64 * share / 100);
            assert_eq!(killed.code, None, "case {case}: {killed}");
        }
        let ended = sandbox.run(&resume).expect_code(0);
        taken_over += ended.json()["resumed_tiles"].as_u64().unwrap();
        assert!(sandbox.read("out.vastex") == whole, "case {case}: other bytes");
        assert_eq!(sandbox.names(), ["big.png", "out.vastex"], "case {case}");
        std::fs::remove_file(sandbox.path("out.vastex")).unwrap();
    }
    println!("{taken_over} tiles taken over");
    assert!(taken_over > 0, "nothing was ever taken over");
}

#[test]
fn ctrl_c_keeps_what_can_be_resumed_and_nothing_else() {
    let (sandbox, whole) = sandbox();
    let interrupt = |args: &[&str]| signal_at(&sandbox, args, "INT", whole.len() as u64 / 2).expect_code(130);
    let plain = interrupt(BUILD);
    assert!(plain.stderr.contains("nothing was left behind"), "{plain}");
    assert_eq!(sandbox.names(), ["big.png"]);
    let resume = [BUILD, &["--resume"]].concat();
    let kept = interrupt(&resume);
    assert!(kept.stderr.contains("the same command goes on"), "{kept}");
    assert_eq!(sandbox.names(), [JOURNAL, PARTIAL, "big.png"]);
    sandbox.run(&resume).expect_code(0);
    assert!(sandbox.read("out.vastex") == whole);
    assert_eq!(sandbox.names(), ["big.png", "out.vastex"]);
}

/// Runs the program where no file may have more than so many blocks: its writes fail as on a full disk.
fn run_short_of_room(sandbox: &Sandbox, blocks: u32, args: &[&str]) -> Ended {
    let mut shell = Command::new("sh");
    shell.current_dir(sandbox.path("")).env_remove("RUST_LOG");
    shell.args(["-c", &format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$@\""), "sh"]);
    shell.arg(env!("CARGO_BIN_EXE_vastex")).args(args);
    Ended::of(&mut shell)
}

#[test]
fn where_the_room_ends_the_message_says_so_and_resume_keeps_what_is_there() {
    let (sandbox, whole) = sandbox();
    let short = run_short_of_room(&sandbox, 6000, BUILD).expect_code(1);
    for word in ["out.vastex: cannot be written", "choose another place"] {
        assert!(short.stderr.contains(word), "{short}");
    }
    assert_eq!(sandbox.names(), ["big.png"]);
    let resume = [BUILD, &["--resume", "--json"]].concat();
    let short = run_short_of_room(&sandbox, 6000, &resume).expect_code(1);
    for word in ["out.vastex: cannot be written", "choose another place", "the same command goes on"] {
        assert!(short.stderr.contains(word), "{short}");
    }
    assert_eq!(sandbox.names(), [JOURNAL, PARTIAL, "big.png"]);
    let ended = sandbox.run(&resume).expect_code(0);
    assert!(ended.json()["resumed_tiles"].as_u64().unwrap() > 0, "{ended}");
    assert!(sandbox.read("out.vastex") == whole);
    assert_eq!(sandbox.names(), ["big.png", "out.vastex"]);
}

#[test]
fn what_another_build_left_is_refused_with_the_remedy() {
    let (sandbox, whole) = sandbox();
    let resume = [BUILD, &["--resume"]].concat();
    signal_at(&sandbox, &resume, "KILL", whole.len() as u64 / 2);
    assert_eq!(sandbox.names(), [JOURNAL, PARTIAL, "big.png"]);
    let other = sandbox.run(&[&resume[..], &["--border", "8"]].concat()).expect_code(1);
    for word in ["out.vastex", "other options", "build without --resume"] {
        assert!(other.stderr.contains(word), "{other}");
    }
    let time = sandbox.path("big.png").metadata().unwrap().modified().unwrap();
    sandbox.write_png("big.png", [1500, 1201]);
    sandbox.run(&resume).expect_code(1);
    sandbox.write_png("big.png", [1500, 1200]);
    // The same bytes, but who knows: only the same time tells that nobody touched them.
    std::fs::File::options().write(true).open(sandbox.path("big.png")).unwrap().set_modified(time).unwrap();
    sandbox.run(&resume).expect_code(0);
    assert!(sandbox.read("out.vastex") == whole);
}
