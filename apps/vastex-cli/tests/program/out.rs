//! What comes out of the program beside one picture: every picture of a path, views as texts, and the page
//! about a run.

use xtask::limited::within;

use crate::tool::{Ended, PATIENCE, Sandbox};

fn run(sandbox: &Sandbox, command: &str) -> Ended {
    sandbox.run(&command.split_whitespace().collect::<Vec<_>>())
}

#[test]
fn a_written_path_is_drawn_picture_by_picture() {
    let sandbox = Sandbox::with_container();
    let places = ["image:x=150,y=100,zoom=1", "image:x=200,y=120,zoom=4,turn=90"];
    let path = format!("vastex path 1\n# a flight\nfps 2\n0 {}\n1 {}\n", places[0], places[1]);
    sandbox.write("flight.path", path.as_bytes());
    let render = "render image.vastex --size 64x48";
    run(&sandbox, &format!("{render} --camera-path flight.path -o frame-%02d.png")).expect_code(0);
    let frames: Vec<String> = sandbox.names().into_iter().filter(|name| name.starts_with("frame")).collect();
    assert_eq!(frames, ["frame-00.png", "frame-01.png", "frame-02.png"]);
    for (frame, view) in [(0, places[0]), (2, places[1])] {
        run(&sandbox, &format!("{render} --view {view} -o still.png")).expect_code(0);
        assert!(sandbox.read_rgb(&frames[frame]) == sandbox.read_rgb("still.png"), "{view}");
    }
    // As bytes, into a file and into a pipe.
    run(&sandbox, &format!("{render} --camera-path flight.path --format raw -o all.rgba")).expect_code(0);
    let bytes = sandbox.read("all.rgba");
    let pixels: Vec<[u8; 4]> = frames
        .iter()
        .flat_map(|name| sandbox.read_rgb(name))
        .map(|[red, green, blue]| [red, green, blue, 255])
        .collect();
    assert!(bytes == pixels.as_flattened(), "{} bytes of {}", bytes.len(), pixels.len() * 4);
    let words = format!("{render} --camera-path flight.path --format raw --frames 2 -o -");
    let mut command = sandbox.command(&words.split(' ').collect::<Vec<_>>());
    let piped = within(&mut command, PATIENCE).unwrap();
    assert!(piped.status.success() && piped.stdout == bytes[..bytes.len() / 3 * 2]);
    assert!(String::from_utf8_lossy(&piped.stderr).contains("converged after"), "it is told elsewhere");
    // The last picture alone, as of any path.
    run(&sandbox, &format!("{render} --camera-path flight.path -o last.png")).expect_code(0);
    assert!(sandbox.read_rgb("last.png") == sandbox.read_rgb("frame-02.png"));
    sandbox.write("bad.path", b"vastex path 1\n0 image:x=1,y=2,zoom=3\n0 image:x=1,y=2,zoom=3\n");
    for (words, code, said) in [
        ("--camera-path bad.path -o x.png", 1, "bad.path: line 3: 0 s is not later"),
        ("--camera-path none.path -o x.png", 1, "none.path: it cannot be read"),
        ("--camera-path image.vastex -o x.png", 1, "image.vastex: this is no text"),
        ("--camera-path spni -o x.png", 2, "still, fly, spin"),
        ("--camera-path flight.path --view image:x=1,y=2,zoom=3", 2, "cannot be used with"),
        ("-o -", 2, "--format raw"),
        ("--format raw", 2, "--output"),
        ("--format raw -o - --json", 2, "stdout"),
        ("-o %d-%d.png", 1, "one place for a number"),
        ("-o nowhere/%d.png", 1, "its directory does not exist"),
    ] {
        let ended = run(&sandbox, &format!("{render} {words}")).expect_code(code);
        assert!(ended.stderr.contains(said), "{words}: {ended}");
    }
}

#[test]
fn a_view_says_what_is_shown_there() {
    let sandbox = Sandbox::with_container();
    let picture = |words: &str| {
        run(&sandbox, &format!("render image.vastex --size 60x40 {words} -o out.png")).expect_code(0);
        sandbox.read_rgb("out.png")
    };
    let place = "image:x=100,y=90,zoom=3";
    let plain = picture(&format!("--view {place}"));
    let shown =
        picture(&format!("--view {place} --layer color:bands=1:range=0.2..0.7:map=viridis:gamma=0.5"));
    assert_ne!(plain, shown);
    assert_eq!(
        picture(&format!("--view {place};layer=color:bands=1:range=0.2..0.7:map=viridis:gamma=0.5")),
        shown
    );
    let over = picture(&format!("--over image.png --cache off --compare-mode swipe:0.3 --view {place}"));
    assert_eq!(
        picture(&format!(
            "--over image.png --cache off --view {place};layer=;layer=:file=2;compare=swipe:0.3"
        )),
        over
    );
    for (words, code, said) in [
        (format!("--view {place};layer=color:map=jet"), 2, "grey, viridis, magma"),
        (format!("--view {place};layer=snow"), 1, "there is no layer \"snow\""),
        (format!("--view {place};layer=color --layer color"), 2, "--view says which layers are shown"),
        (format!("--view {place};layer=:file=2"), 2, "'file=2': there are 1 files"),
        (format!("--view {place};compare=swipe"), 2, "one layer is shown"),
    ] {
        let ended = run(&sandbox, &format!("render image.vastex {words} -o x.png")).expect_code(code);
        assert!(ended.stderr.contains(said), "{words}: {ended}");
    }
}

#[test]
fn a_page_tells_how_a_run_went() {
    let sandbox = Sandbox::with_container();
    let render = "render image.vastex --size 128x96";
    run(
        &sandbox,
        &format!("{render} --on plane --camera-path fly --frames 40 --report page/of/it -o out.png"),
    )
    .expect_code(0);
    let page = String::from_utf8(sandbox.read("page/of/it/index.html")).unwrap();
    for part in [
        "<title>image.vastex",
        "No warnings",
        "300 x 200",
        "color (rgba8-srgb)",
        "Mip bias",
        "frame 40",
        "fly",
    ] {
        assert!(page.contains(part), "{part}");
    }
    // Five pictures, all of them in the page, and nothing outside it.
    assert_eq!(page.matches("data:image/png;base64,").count(), 5);
    assert!(!page.contains("http") && !page.contains("url("));
    assert_eq!(sandbox.names().iter().filter(|name| name.contains("partial")).count(), 0);
    // What went wrong is told in the words in which it was said.
    sandbox.write_png("large.png", [1024, 1024]);
    run(&sandbox, "build large.png -o large.vastex --page 256 --quiet").expect_code(0);
    let ended = run(&sandbox, "render large.vastex --size 400x400 --pool-mib 1 --report small");
    assert!(ended.stderr.contains("too small") || ended.stderr.contains("coarser"), "{ended}");
    let page = String::from_utf8(sandbox.read("small/index.html")).unwrap();
    assert!(page.contains("class=\"warning\"") && !page.contains("No warnings"));
    let ended = run(&sandbox, &format!("{render} --report image.vastex")).expect_code(1);
    assert!(ended.stderr.contains("image.vastex: this directory cannot be made"), "{ended}");
    // Its own page is written anew, that of somebody else is not.
    run(&sandbox, &format!("{render} --report small")).expect_code(0);
    std::fs::create_dir(sandbox.path("site")).unwrap();
    std::fs::write(sandbox.path("site/index.html"), "<title>mine</title>").unwrap();
    let ended = run(&sandbox, &format!("{render} --report site")).expect_code(1);
    assert!(ended.stderr.contains("somebody else"), "{ended}");
    assert_eq!(sandbox.read("site/index.html"), b"<title>mine</title>");
}

#[test]
fn pictures_of_a_path_are_written_over_nothing_that_is_read() {
    let sandbox = Sandbox::with_container();
    std::fs::copy(sandbox.path("image.vastex"), sandbox.path("frame-0003.vastex")).unwrap();
    std::fs::write(sandbox.path("a.path"), "vastex path 1\n0 image:x=9,y=9,zoom=1\n").unwrap();
    let kept = ["frame-0003.vastex", "a.path"].map(|name| (name, sandbox.read(name)));
    for words in [
        "render frame-0003.vastex --camera-path a.path --format raw -o frame-0003.vastex",
        "render frame-0003.vastex --camera-path a.path --format raw -o a.path",
        "render image.vastex --camera-path a.path --format raw --over frame-0003.vastex -o frame-%04d.vastex",
    ] {
        let ended = run(&sandbox, words).expect_code(1);
        assert!(ended.stderr.contains("is the source as well as the output"), "{words}: {ended}");
    }
    // Nor over an older film, where there is nothing to draw.
    std::fs::write(sandbox.path("film.rgba"), "older").unwrap();
    run(&sandbox, "render nothing.vastex --camera-path a.path --format raw -o film.rgba").expect_code(1);
    assert_eq!(sandbox.read("film.rgba"), b"older");
    for (name, bytes) in kept {
        assert!(sandbox.read(name) == bytes, "{name}");
    }
}

#[test]
fn whatever_is_shown_is_told_drawn_and_cut_without_a_build() {
    let sandbox = Sandbox::with_container();
    run(&sandbox, "export image.vastex --layout deepzoom -o dz --format png").expect_code(0);
    let dzi = if sandbox.path("dz.dzi").exists() { "dz.dzi" } else { "dz/image.dzi" };
    let dzi = if sandbox.path(dzi).exists() { dzi } else { "dz" };
    for (source, kind, size) in [
        ("image.vastex", None, [300, 200]),
        ("image.png", Some("image"), [300, 200]),
        (dzi, Some("tiles"), [300, 200]),
        ("planet:10", Some("planet"), [1024, 512]),
        ("planet:10:image.png", Some("planet"), [1024, 512]),
    ] {
        let told = run(&sandbox, &format!("info {source} --cache cache --json")).expect_code(0).json();
        assert_eq!(told["size"], serde_json::json!(size), "{source}: {told}");
        assert_eq!(told["kind"].as_str(), kind, "{source}: {told}");
        run(&sandbox, &format!("info {source} --cache off")).expect_code(0);
        run(&sandbox, &format!("render {source} --cache cache --size 40x20 -o out.png")).expect_code(0);
        run(&sandbox, &format!("crop {source} --cache cache --at 100,50 --size 7x5 -o out.npy"))
            .expect_code(0);
        let array = sandbox.read("out.npy");
        let head = String::from_utf8_lossy(&array[..80]).into_owned();
        assert!(head.contains("(5, 7, ") && head.contains("'|u1'"), "{source}: {head}");
        let ended =
            run(&sandbox, &format!("crop {source} --cache off --at {},0 --size 7x5 -o x.npy", size[0] - 6));
        assert!(ended.expect_code(1).stderr.contains("beyond the edge"), "{source}");
    }
    assert!(!sandbox.path("x.npy").exists());
}

#[cfg(feature = "view")]
#[test]
fn a_picture_of_the_window_needs_no_display() {
    let sandbox = Sandbox::with_container();
    let shoot = |words: &str| {
        let words: Vec<&str> = words.split_whitespace().collect();
        let mut command = sandbox.command(&words);
        command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
        Ended::of(&mut command)
    };
    let differing = |a: &[[u8; 3]], b: &[[u8; 3]]| {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 2)).count()
    };
    shoot("view --screenshot shot.png --size 300x200 image.vastex").expect_code(0);
    run(&sandbox, "render image.vastex --size 300x200 -o plain.png").expect_code(0);
    let (shot, plain) = (sandbox.read_rgb("shot.png"), sandbox.read_rgb("plain.png"));
    let others = differing(&shot, &plain);
    assert!(
        others > 100 && others < 6000,
        "a scale lies over the picture, and nothing else: {others} pixels"
    );
    // A view of large texels: they are shown as they are, with their values in them.
    let view = "--view image:x=150,y=100,zoom=40";
    shoot(&format!("view --screenshot large.png {view} --size 300x200 image.vastex")).expect_code(0);
    run(&sandbox, &format!("render image.vastex {view} --filter nearest --size 300x200 -o large-plain.png"))
        .expect_code(0);
    let others = differing(&sandbox.read_rgb("large.png"), &sandbox.read_rgb("large-plain.png"));
    assert!(others > 500 && others < 40_000, "{others}");
    // What the machine does is beside it.
    shoot("view --screenshot hud.png --hud --size 600x400 image.vastex").expect_code(0);
    shoot("view --screenshot none.png --size 600x400 image.vastex").expect_code(0);
    let (hud, none) = (sandbox.read_rgb("hud.png"), sandbox.read_rgb("none.png"));
    let half = |pixels: &[[u8; 3]], from: usize| -> Vec<[u8; 3]> {
        pixels.chunks(600).flat_map(|row| row[from..from + 150].to_vec()).collect()
    };
    assert!(differing(&half(&hud, 0), &half(&none, 0)) > 20_000);
    // In parts it is the picture that it is in one.
    shoot("view --screenshot parts.png --size 5000x64 image.vastex").expect_code(0);
    run(&sandbox, "render image.vastex --size 5000x64 -o whole.png").expect_code(0);
    let others = differing(&sandbox.read_rgb("parts.png"), &sandbox.read_rgb("whole.png"));
    assert!(others < 20_000, "{others} of 320000");
    shoot("view --screenshot globe.png --on globe --size 100x80 image.vastex").expect_code(0);
    run(&sandbox, "render image.vastex --on globe --size 100x80 -o globe-plain.png").expect_code(0);
    assert_eq!(differing(&sandbox.read_rgb("globe.png"), &sandbox.read_rgb("globe-plain.png")), 0);
    for (words, code, said) in [
        ("view --screenshot image.vastex image.vastex", 2, "give it the ending .png"),
        ("view --screenshot a.png image.vastex image.png", 1, "shows one file"),
        ("view --screenshot nowhere/a.png image.vastex", 1, "its directory does not exist"),
        ("view --screenshot a.png nothing.png", 1, "nothing.png"),
        (
            "view --screenshot a.png --size 60000x20 --overlay table image.vastex",
            1,
            "the overlay table is drawn at once",
        ),
        ("view --screenshot a.png --size 70000x20 image.vastex", 2, "1 to 65536"),
        ("view --screenshot a.png", 2, "name a file"),
        ("view --shapes a.geojson", 2, "name a file"),
        ("view --hud image.vastex", 2, "--screenshot"),
    ] {
        let ended = shoot(words).expect_code(code);
        assert!(ended.stderr.contains(said), "{words}: {ended}");
    }
}
