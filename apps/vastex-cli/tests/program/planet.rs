//! `--on planet`: each of its files and settings is seen, in `render` and in pictures of the window, and
//! none is written over. `planet:BITS:IMAGE`: the continents are those of any image.

use crate::tool::{Ended, Sandbox};

fn run(sandbox: &Sandbox, command: &str) -> Ended {
    sandbox.run(&command.split_whitespace().collect::<Vec<_>>())
}

/// A directory with small images of the Earth, built.
fn earth() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write_relief("relief.png");
    run(&sandbox, "build relief.png -o relief.vastex --page 64 --quiet").expect_code(0);
    sandbox
}

const VIEW: &str = "--on planet --view globe:lon=10,lat=30,alt=20000000m --size 96x64";

#[test]
fn each_part_of_a_planet_is_seen() {
    let sandbox = earth();
    let picture = |words: &str| {
        run(&sandbox, &format!("render relief.vastex {VIEW} {words} -o out.png")).expect_code(0);
        sandbox.read_rgb("out.png")
    };
    let lit = picture("--sun -60,10");
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
    // That two pictures of the same are alike `links::a_planet_is_what_its_text_says` tests.
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

/// A planet has the continents of images of any format, and grey ones make it grey.
#[test]
fn a_planet_has_the_continents_of_any_image() {
    let sandbox = earth();
    sandbox.write_png("color.png", [512, 256]);
    sandbox.write_grey_png("grey.png", [512, 256]);
    run(&sandbox, "build color.png -o blocks.vastex --format bc1-srgb --quiet").expect_code(0);
    run(&sandbox, "build relief.png -o floats.vastex --format r32f --quiet").expect_code(0);
    let picture = |image: &str| {
        run(&sandbox, &format!("render planet:12:{image} --cache cache --on image --size 64x32 -o out.png"))
            .expect_code(0);
        sandbox.read_rgb("out.png")
    };
    let plain = picture("color.png");
    let far = |a: &[[u8; 3]], b: &[[u8; 3]]| {
        let differs = |(a, b): &(&[u8; 3], &[u8; 3])| (0..3).any(|c| a[c].abs_diff(b[c]) > 24);
        a.iter().zip(b).filter(differs).count()
    };
    let blocks = picture("blocks.vastex");
    assert!(far(&plain, &blocks) < 20, "{}", far(&plain, &blocks));
    let words = picture("relief.png");
    for (image, picture) in [
        ("grey.png", picture("grey.png")),
        ("floats.vastex", picture("floats.vastex")),
        ("relief.png", words),
    ] {
        let is_grey = |pixel: &&[u8; 3]| pixel.iter().max().unwrap() - pixel.iter().min().unwrap() <= 2;
        assert_eq!(picture.iter().filter(is_grey).count(), picture.len(), "{image}");
        let [dark, light] = [picture.iter().min().unwrap()[0], picture.iter().max().unwrap()[0]];
        assert!(light - dark > 30, "{image}: {dark} to {light}");
    }
}

/// Commands that read a file say of a planet that it has none, and what to do instead.
#[test]
fn what_needs_a_file_says_that_a_planet_has_none() {
    let sandbox = Sandbox::with_container();
    let before = sandbox.names();
    for (command, words) in [
        ("export planet:10 --layout deepzoom -o out", "cannot be exported; export a container"),
        ("verify planet:12", "cannot be verified; verify the container"),
        ("build planet:10:image.png -o out.vastex", "cannot be built; build its image"),
        ("build --layer color=planet:10 -o out.vastex", "cannot be built; build its image"),
        ("replace planet:10 --at 0,0 image.png", "cannot be changed; name a container"),
        ("replace image.vastex --at 0,0 planet:10", "cannot be put into a container"),
    ] {
        let said = run(&sandbox, command).expect_code(1).stderr;
        let is_told = said.contains(words) && said.contains("planet:1") && !said.contains("check the path");
        assert!(is_told, "{command}: {said}");
    }
    assert_eq!(sandbox.names(), before);
}

#[test]
fn a_planet_too_large_to_compare_is_told_in_words_of_the_program() {
    let sandbox = Sandbox::new();
    let command = "render planet:20 --on globe --compare --size 48x32 -o out.png";
    let said = run(&sandbox, command).expect_code(1).stderr;
    assert!(said.contains("pages is compared with nothing") && !said.contains("Cpu::"), "{said}");
}
