//! `--on planet`: each of its files and settings is seen, in `render` and in pictures of the window, and
//! none is written over.

use crate::tool::{Ended, Sandbox};

fn run(sandbox: &Sandbox, command: &str) -> Ended {
    sandbox.run(&command.split_whitespace().collect::<Vec<_>>())
}

/// A directory with small images of the Earth, built.
fn earth() -> Sandbox {
    let sandbox = Sandbox::new();
    let relief = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/earth-elevation-1080x540-u16.png");
    std::fs::copy(relief, sandbox.path("relief.png")).unwrap();
    run(&sandbox, "build relief.png -o relief.vastex --page 64 --quiet").expect_code(0);
    sandbox
}

const VIEW: &str = "--on planet --view globe:lon=10,lat=30,alt=9000000m --size 96x64";

#[test]
fn each_part_of_a_planet_is_seen() {
    let sandbox = earth();
    let picture = |words: &str| {
        run(&sandbox, &format!("render relief.vastex {VIEW} {words} -o out.png")).expect_code(0);
        sandbox.read_rgb("out.png")
    };
    let sun = "--sun -60,10";
    let lit = picture(sun);
    for words in [
        "--sun off",
        "--sun 60,10",
        "--sun -60,10 --atmosphere 0",
        "--sun -60,10 --night relief.vastex",
        "--sun -60,10 --clouds relief.vastex",
        "--sun -60,10 --height relief.vastex --height-scale 0.02",
    ] {
        assert_ne!(lit, picture(words), "{words}");
    }
    assert_eq!(lit, picture(sun));
}

#[cfg(feature = "view")]
#[test]
fn a_picture_of_the_window_has_all_of_a_planet_and_writes_over_none_of_its_files() {
    let sandbox = earth();
    std::fs::copy(sandbox.path("relief.vastex"), sandbox.path("night.vastex")).unwrap();
    let shot = |words: &str, output: &str| {
        run(&sandbox, &format!("view --screenshot {output} relief.vastex {VIEW} --sun -60,10 {words}"))
    };
    shot("", "plain.png").expect_code(0);
    shot("--clouds relief.vastex", "clouds.png").expect_code(0);
    assert_ne!(sandbox.read_rgb("plain.png"), sandbox.read_rgb("clouds.png"));
    let refused = shot("--night night.vastex", "night.vastex");
    assert!(refused.expect_code(2).stderr.contains(".png"), "an ending that is no picture's");
    std::fs::rename(sandbox.path("night.vastex"), sandbox.path("night")).unwrap();
    let before = std::fs::read(sandbox.path("night")).unwrap();
    let refused = shot("--night night", "night").expect_code(1).stderr;
    assert!(refused.contains("is the source as well as the output"), "{refused}");
    assert_eq!(std::fs::read(sandbox.path("night")).unwrap(), before);
    shot("", "shot.gif").expect_code(2);
}
