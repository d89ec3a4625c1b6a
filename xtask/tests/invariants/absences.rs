//! What the text of a crate may not name: core touches no world, wgpu decides nothing, and no constant is
//! copied.

use anyhow::{Context, Result, ensure};

use crate::sources::{code, files, files_under, identifiers, production, root, std_modules};

/// The parts of the standard library that reach outside, read a clock or start something.
const WORLD: &[&str] = &["env", "fs", "io", "net", "os", "path", "process", "thread", "time"];

#[test]
fn core_touches_no_world() -> Result<()> {
    for source in files_under("crates/vastex-core/src", &["rs"])? {
        let text = production(&source.text);
        let used: Vec<&str> =
            std_modules(&text).into_iter().filter(|module| WORLD.contains(module)).collect();
        ensure!(
            used.is_empty(),
            "{} uses std::{used:?}; core has no world, its time is the frame index",
            source.path
        );
        ensure!(!identifiers(&text).any(|name| name == "wgpu"), "{} names wgpu", source.path);
    }
    Ok(())
}

#[test]
fn wgpu_chooses_no_page_and_sees_no_source() -> Result<()> {
    for source in files_under("crates/vastex-wgpu/src", &["rs"])? {
        let text = production(&source.text);
        let found = identifiers(&text).find(|name| ["TileSource", "Pager", "vastex_tiles"].contains(name));
        ensure!(found.is_none(), "{} names {found:?}; wgpu carries out what the pager returns", source.path);
    }
    Ok(())
}

/// Whoever shows it, a window, a browser or a test, brings those.
#[test]
fn the_viewer_has_no_window_no_clock_and_waits_for_nothing() -> Result<()> {
    const WAITS: &[&str] = &[
        "block_on",
        "pollster",
        "wait",
        "wait_indefinitely",
        "PollType",
        "feedback_of_every",
        "add_blocking",
        "read_blocking",
    ];
    const HOSTS: &[&str] = &["winit", "Instant", "SystemTime", "println", "eprintln"];
    for source in files_under("crates/vastex-viewer/src", &["rs"])? {
        let text = production(&source.text);
        let found = identifiers(&text).find(|name| WAITS.contains(name) || HOSTS.contains(name));
        ensure!(found.is_none(), "{} names {found:?}, which is the host's business", source.path);
        let used: Vec<&str> = std_modules(&text)
            .into_iter()
            .filter(|module| WORLD.contains(module) && *module != "time")
            .collect();
        ensure!(used.is_empty(), "{} uses std::{used:?}; times are told to it", source.path);
    }
    Ok(())
}

/// What a right click asks comes in a later frame (`vastex_viewer::inspect::answers`).
#[test]
fn no_frame_of_the_window_waits_for_the_gpu() -> Result<()> {
    const WAITS: &[&str] = &["wait", "feedback_of_every", "wait_indefinitely", "PollType"];
    let mut polls = 0;
    let rooms =
        ["beside", "surface_scene", "window_scene"].map(|room| format!("crates/vastex-viewer/src/{room}"));
    for folder in rooms.iter().map(String::as_str).chain(["apps/vastex-cli/src/view"]) {
        for source in files_under(folder, &["rs"])? {
            let text = production(&source.text);
            let found = identifiers(&text).find(|name| WAITS.contains(name));
            ensure!(found.is_none(), "{} names {found:?}, which waits", source.path);
            polls += identifiers(&text).filter(|name| *name == "answers").count();
        }
    }
    ensure!(polls == 1, "answers to right clicks are looked for {polls} times in a frame");
    Ok(())
}

/// A GPU, a thread or a program that hangs is to fail a test and say so, not to keep the suite.
#[test]
fn no_test_waits_without_limit() -> Result<()> {
    let waits_for_programs =
        |path: &str| path.starts_with("apps/vastex-cli/tests/") || path.starts_with("xtask/src/record/");
    let (mut of_gpus, mut of_threads, mut of_programs) = (0, 0, 0);
    for source in files(&["rs"])? {
        // This file names what it forbids.
        if source.path.contains("/tests/") && !source.path.starts_with("xtask/") {
            let found = source.text.contains("wait_indefinitely");
            ensure!(
                !found,
                "{} waits for a GPU without limit: use test_device::finish, or a time-out",
                source.path
            );
            of_gpus += 1;
        }
        // The decider's tests know no other crate; their threads wait for nothing but their own work.
        let is_test = source.path.contains("/tests/") || source.path.ends_with("/tests.rs");
        if is_test && !["xtask/", "crates/vastex-core/"].iter().any(|of| source.path.starts_with(of)) {
            let joins = source.text.contains(".join().unwrap()");
            ensure!(
                !joins || source.text.contains("ends_within("),
                "{} waits for threads without limit: do all of it within vastex_tiles::ends_within",
                source.path
            );
            of_threads += usize::from(joins);
        }
        if waits_for_programs(&source.path) {
            let found = [".output()", ".wait()", ".wait_with_output()"];
            let found = found.iter().find(|call| source.text.contains(**call));
            ensure!(
                found.is_none(),
                "{} waits for a program without limit ({found:?}): use xtask::limited",
                source.path
            );
            of_programs += 1;
        }
    }
    let found = [of_gpus, of_threads, of_programs];
    ensure!(of_gpus > 100 && of_threads > 1 && of_programs > 20, "tests have moved: {found:?} files");
    Ok(())
}

/// Core's suite names, by their types, the steps of a frame that cannot fail. What a frame does stands in
/// these files.
#[test]
fn all_that_a_frame_asks_of_the_pager_is_among_what_cannot_fail() -> Result<()> {
    const FRAME: [&str; 14] = [
        "paging/frame",
        "paging/loading",
        "gpu/carry_out",
        "gpu/fades",
        "gpu/feedback",
        "gpu/tables",
        "gpu/uploads",
        "textures/ahead",
        "textures/feedback",
        "textures/frame",
        "textures/stats",
        "textures/views",
        "watch/recorder",
        "watch/telemetry",
    ];
    /// Views come and go between frames.
    const BETWEEN_FRAMES: [&str; 3] = ["add_view", "remove_view", "set_weight"];
    let listed = std::fs::read_to_string(root().join("crates/vastex-core/tests/suite/worlds.rs"))?;
    let mut asked = 0;
    for file in FRAME {
        let path = format!("crates/vastex/src/{file}.rs");
        let text = production(&std::fs::read_to_string(root().join(&path))?);
        for name in ["pager.", "pool(pool)."].iter().flat_map(|of| called_on(&text, of)) {
            let is_listed =
                [format!("::{name};"), format!("pager.{name}()")].iter().any(|part| listed.contains(part));
            ensure!(
                is_listed || BETWEEN_FRAMES.contains(&name),
                "{path} calls {name}; worlds.rs does not say in nothing_that_a_frame_does_can_fail that it cannot fail"
            );
            asked += 1;
        }
    }
    ensure!(asked > 20, "a frame asks only {asked} things of the pager; this test looks in the wrong files");
    Ok(())
}

/// The methods that a text calls on something of that name.
fn called_on<'a>(text: &'a str, of: &'a str) -> impl Iterator<Item = &'a str> {
    text.match_indices(of).filter_map(move |(at, _)| {
        let rest = &text[at + of.len()..];
        let name = identifiers(rest).next().filter(|name| rest.starts_with(name))?;
        rest[name.len()..].starts_with('(').then_some(name)
    })
}

#[test]
fn no_shader_declares_a_shared_constant_by_hand() -> Result<()> {
    let shared = std::fs::read_to_string(root().join("crates/vastex-core/src/shader_constants.rs"))?;
    let shared: Vec<&str> = constants(&shared).collect();
    ensure!(
        shared.len() > 5,
        "the shared constants have moved; this test looks for them in core's shader_constants.rs"
    );
    for source in files(&["wgsl"])? {
        let text = code(&source.text);
        for name in constants(&text) {
            let plain = name.strip_prefix("VASTEX_").unwrap_or(name);
            ensure!(
                !shared.contains(&plain),
                "{} declares {name}, which is generated from core's shader_constants.rs",
                source.path
            );
        }
    }
    Ok(())
}

#[test]
fn nothing_is_kept_in_step_by_comment() -> Result<()> {
    let plea = ["keep", "in", "sync"].join(" ");
    for source in files(&["rs", "wgsl", "toml"])? {
        let found = source.text.lines().position(|line| line.to_lowercase().contains(&plea));
        ensure!(
            found.is_none(),
            "{}:{}: a test keeps things equal, a comment does not",
            source.path,
            found.unwrap_or(0) + 1
        );
    }
    Ok(())
}

/// Files that play a frame by `Textures::update`: who draws surfaces, who draws volumes in the window in
/// panes and parts, and `Textures::finish`, which draws nothing.
const PLAY_FRAMES: &[&str] = &[
    "crates/vastex/src/textures/frame.rs",
    "crates/vastex-viewer/src/stage/frame.rs",
    "crates/vastex-viewer/src/volume_scene/frames.rs",
];

/// What a frame does to textures stands in `Textures::update` alone, and few decide what is drawn about it.
#[test]
fn frames_are_played_in_few_places() -> Result<()> {
    let mut played = Vec::new();
    for folder in ["crates/vastex/src", "crates/vastex-viewer/src", "apps"] {
        for source in files_under(folder, &["rs"])?.into_iter().filter(|source| is_shipped(&source.path)) {
            let text = production(&source.text);
            if ["textures.update()", "textures_mut().update()", "self.update()"]
                .iter()
                .any(|call| text.contains(call))
            {
                played.push(source.path);
            }
        }
    }
    played.sort();
    let mut expected = PLAY_FRAMES.to_vec();
    expected.sort_unstable();
    ensure!(
        played == expected,
        "frames are played in {played:?}; draw what you have by the stage's Frame, or say in ARCHITECTURE.md why not, and list it in \
         PLAY_FRAMES"
    );
    Ok(())
}

/// Returns true if a file is part of a library or a program, and no test, example or benchmark.
fn is_shipped(path: &str) -> bool {
    !["/tests/", "/examples/", "/benches/", "/tests.rs"].iter().any(|part| path.contains(part))
}

/// An engine programmer reads the methods of `Textures` at one sitting; what few need lies in handles.
#[test]
fn the_front_of_textures_has_no_more_than_thirty_methods() -> Result<()> {
    let mut methods = Vec::new();
    for source in files_under("crates/vastex/src/textures", &["rs"])? {
        let text = production(&source.text);
        for block in text.split("\nimpl Textures {\n").skip(1) {
            let own = block.split("\n}\n").next().unwrap_or_default();
            let names = own.split("    pub fn ").skip(1).filter_map(|rest| rest.split(['(', '<']).next());
            methods.extend(names.map(str::to_owned));
        }
    }
    ensure!(methods.len() > 20, "only {methods:?} of Textures were found");
    ensure!(
        methods.len() <= 30,
        "Textures has {} methods: {methods:?}; put what few need into a handle",
        methods.len()
    );
    Ok(())
}

#[test]
fn the_frame_loop_stays_small() -> Result<()> {
    let path = root().join("crates/vastex/src/textures/frame.rs");
    let text =
        std::fs::read_to_string(&path).with_context(|| format!("the frame loop is {}", path.display()))?;
    let lines = production(&text).lines().count();
    ensure!(lines < 200, "the frame loop has {lines} lines; under 200 it can be read at one sitting");
    Ok(())
}

/// The names declared by `const NAME` or `override NAME` in Rust or WGSL.
fn constants(text: &str) -> impl Iterator<Item = &str> {
    let names: Vec<&str> = identifiers(text).collect();
    let pairs: Vec<(&str, &str)> = names.windows(2).map(|pair| (pair[0], pair[1])).collect();
    pairs.into_iter().filter(|(keyword, _)| ["const", "override"].contains(keyword)).map(|(_, name)| name)
}

#[test]
fn constants_are_seen_in_both_languages() {
    let found: Vec<&str> =
        constants("pub const A: u32 = 1;\nconst B = 2u;\noverride C: f32;\nlet D = 3;").collect();
    assert_eq!(found, ["A", "B", "C"]);
}

/// What begins with "error" looks like a failure: the tools of the project say so where they fail, and
/// nowhere else.
#[test]
fn tools_say_error_where_they_fail() -> Result<()> {
    const FAIL: [&str; 2] = ["xtask/src/main.rs", "xtask/src/test.rs"];
    let mut failing = Vec::new();
    for source in files_under("xtask/src", &["rs"])? {
        let says = |line: &str| line.contains("println!(\"") && line.to_lowercase().contains("ln!(\"error");
        if source.text.lines().any(says) {
            failing.push(source.path);
        }
    }
    failing.sort();
    ensure!(failing == FAIL, "lines that begin with \"error\" are printed in {failing:?}");
    Ok(())
}
