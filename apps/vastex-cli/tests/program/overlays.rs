//! `render --overlay` and `--explain`.

use crate::tool::Sandbox;

fn words(command: &str) -> Vec<&str> {
    command.split_whitespace().collect()
}

#[test]
fn every_overlay_is_another_picture() {
    let sandbox = Sandbox::with_container();
    let render = "render image.vastex --size 160x90 --on plane --frames 8";
    sandbox.run(&words(&format!("{render} -o plain.png"))).expect_code(0);
    let mut pictures = vec![("no overlay", sandbox.read_rgb("plain.png"))];
    for overlay in ["levels", "wanted", "deficit", "pages", "feedback", "table", "atlas"] {
        sandbox.run(&words(&format!("{render} --overlay {overlay} -o {overlay}.png"))).expect_code(0);
        let picture = sandbox.read_rgb(&format!("{overlay}.png"));
        for (other, before) in &pictures {
            let differing = picture.iter().zip(before).filter(|(a, b)| a != b).count();
            // Lines are drawn over little of the picture; everything else is another picture.
            assert!(differing * 50 > picture.len(), "{overlay} differs from {other} in {differing} pixels");
        }
        pictures.push((overlay, picture));
    }
    sandbox.run(&words(&format!("{render} --overlay nonsense"))).expect_code(2);
}

#[test]
fn a_pixel_says_what_it_wants_and_what_that_waits_for() {
    let sandbox = Sandbox::with_container();
    let render = "render image.vastex --size 160x90 --on plane --json";
    let here = sandbox.run(&words(&format!("{render} --explain 80,85"))).expect_code(0).json();
    let page = &here["explained"]["pages"][0];
    assert_eq!((&page["state"], &page["shown"]), (&"resident".into(), &page["at_bias"]));
    assert!(page["text"].as_str().unwrap().contains("in its slot"), "{page}");
    let early = sandbox.run(&words(&format!("{render} --frames 2 --explain 80,85"))).expect_code(0).json();
    assert_eq!(early["explained"]["pages"][0]["state"], "absent");
    let beside =
        sandbox.run(&words("render image.vastex --size 160x90 --on image --explain 0,45")).expect_code(0);
    assert!(beside.stdout.contains("no texture is seen there"), "{beside}");
    for (pixel, why) in [("160,0", "160x90 pixels"), ("1", "column and row"), ("a,b", "column and row")] {
        let refused = sandbox.run(&words(&format!("{render} --explain {pixel}"))).expect_code(2);
        assert!(refused.stderr.contains(why), "{refused}");
    }
}
