//! `--on terrain` and a globe with heights: from a file to a picture, and what is said where there are no
//! heights.

use crate::tool::{Ended, Sandbox};

fn run(sandbox: &Sandbox, command: &str) -> Ended {
    sandbox.run(&command.split_whitespace().collect::<Vec<_>>())
}

#[test]
fn the_earths_relief_displaces_a_terrain_and_the_globe() {
    let sandbox = Sandbox::new();
    sandbox.write_relief("relief.png");
    run(&sandbox, "build relief.png -o relief.vastex --page 64 --quiet").expect_code(0);
    for scene in ["--on terrain", "--on globe --height-scale 0.3 --height-zero 0.168"] {
        let command =
            format!("render relief.vastex {scene} --size 200x120 --compare --json -o relief.out.png");
        let summary = run(&sandbox, &command).expect_code(0).json();
        assert_eq!((&summary["converged"], &summary["reference"]), (&true.into(), &"cpu".into()));
        assert!(summary["share_within_1_255"].as_f64() > Some(0.999), "{scene}: {summary}");
    }
}

#[test]
fn what_has_no_heights_is_no_terrain() {
    let sandbox = Sandbox::with_container();
    let ended = run(&sandbox, "render image.vastex --on terrain -o out.png").expect_code(1);
    assert!(ended.stderr.contains("--height-layer") && ended.stderr.contains("image.vastex"), "{ended}");
    let ended = run(&sandbox, "render image.vastex --on globe --height-layer depth").expect_code(1);
    assert!(ended.stderr.contains("\"depth\""), "{ended}");
    for more in ["--height-scale nan", "--height-zero 1e10", "--estimate quadtree"] {
        run(&sandbox, &format!("render image.vastex --on terrain {more}")).expect_code(2);
    }
    assert!(!sandbox.path("out.png").exists());
}

/// Colours and heights in two files that nobody built: in a picture of the window as in any other.
#[cfg(feature = "view")]
#[test]
fn heights_of_a_file_displace_what_the_window_shows() {
    let sandbox = Sandbox::new();
    sandbox.write_relief("relief.png");
    sandbox.write_png("color.png", [300, 150]);
    for (scene, view) in [
        ("terrain", "plane:x=0,y=-0.9,z=0.4,yaw=0,pitch=30"),
        ("globe", "globe:lon=80,lat=30,alt=2000000m,tilt=40"),
        ("planet", "globe:lon=80,lat=30,alt=2000000m,tilt=40"),
    ] {
        let size = "--size 160x100 --cache cache";
        let shown = format!("color.png --on {scene} --view {view} --height relief.png");
        let shoot = |words: &str| {
            run(&sandbox, &format!("view --screenshot shot.png {words} {size}")).expect_code(0);
            sandbox.read_rgb("shot.png")
        };
        let low = shoot(&shown);
        // A picture of other heights is another one, so that neither heights nor their scale were left out.
        let scale = if scene == "terrain" { "0.4" } else { "0" };
        assert!(shoot(&format!("{shown} --height-scale {scale}")) != low, "{scene}");
        run(&sandbox, &format!("render {shown} {size} -o drawn.png")).expect_code(0);
        let drawn = sandbox.read_rgb("drawn.png");
        // But for what lies over the picture in a window.
        let alike = low.iter().zip(&drawn).filter(|(a, b)| a == b).count();
        assert!(alike * 10 > 9 * drawn.len(), "{scene}: {alike} of {}", drawn.len());
    }
}
