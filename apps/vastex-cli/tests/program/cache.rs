//! Images that nobody built, shown all the same: they are built into the cache once.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use xtask::compiled_shaders;

use crate::tool::{Ended, Sandbox};

/// All files below a directory but locks.
fn files(directory: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(directory) else { return Vec::new() };
    let paths = entries.map(|entry| entry.unwrap().path());
    let mut files: Vec<_> =
        paths.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect();
    files.retain(|file| file.extension().is_none_or(|ending| ending != "lock"));
    files.sort();
    files
}

/// A run whose cache is in the sandbox.
fn run(sandbox: &Sandbox, args: &[&str]) -> Ended {
    Ended::of(with_cache(&mut sandbox.command(args), &sandbox.path("caches")))
}

/// A program whose cache is in a place of its own, but for what the driver has compiled before.
fn with_cache<'a>(command: &'a mut Command, place: &Path) -> &'a mut Command {
    compiled_shaders::share(command).env("XDG_CACHE_HOME", place)
}

/// What is kept there.
fn kept(sandbox: &Sandbox) -> Vec<PathBuf> {
    files(&sandbox.path("caches/vastex"))
}

#[test]
fn an_image_is_shown_without_a_build_and_built_once() {
    let sandbox = Sandbox::new();
    sandbox.write_png("image.png", [300, 200]);
    let render = |words: &[&str]| run(&sandbox, &[&["render", "--size", "160x100"], words].concat());
    let first = render(&["image.png", "-o", "first.png"]).expect_code(0);
    assert!(first.stderr.contains("image.png: is built into"), "{first}");
    let cached = kept(&sandbox);
    assert_eq!(cached.len(), 1, "{cached:?}");
    let second = render(&["image.png", "-o", "second.png"]).expect_code(0);
    assert!(!second.stderr.contains("is built"), "{second}");
    run(&sandbox, &["build", "image.png", "-o", "image.vastex", "--quiet"]).expect_code(0);
    render(&["image.vastex", "-o", "built.png"]).expect_code(0);
    assert_eq!(sandbox.read("first.png"), sandbox.read("built.png"));
    assert_eq!(sandbox.read("second.png"), sandbox.read("built.png"));
    // On a globe the edges are neighbours: that is another container.
    let globe = render(&["image.png", "--on", "globe", "-o", "globe.png"]).expect_code(0);
    assert!(globe.stderr.contains("is built"), "{globe}");
    assert_eq!(kept(&sandbox).len(), 2);
    let wrapped = ["build", "image.png", "-o", "globe.vastex", "--address", "wrap,clamp", "--quiet"];
    run(&sandbox, &wrapped).expect_code(0);
    render(&["globe.vastex", "--on", "globe", "-o", "of-built.png"]).expect_code(0);
    assert_eq!(sandbox.read("globe.png"), sandbox.read("of-built.png"));
    // A generated planet takes it, too.
    render(&["planet:12:image.png", "-o", "planet.png"]).expect_code(0);
}

#[test]
fn a_cached_image_that_is_damaged_is_built_anew_once() {
    let sandbox = Sandbox::new();
    sandbox.write_png("image.png", [500, 400]);
    let render = |name: &str| run(&sandbox, &["render", "image.png", "--size", "500x400", "-o", name]);
    render("whole.png").expect_code(0);
    let [cached] = &kept(&sandbox)[..] else { panic!("one container is kept") };
    let whole = std::fs::read(cached).unwrap();
    // Between the description and the index lie the tiles.
    let mut bytes = whole.clone();
    let end = bytes.len() * 9 / 10;
    (bytes.len() / 2..end).step_by(97).for_each(|at| bytes[at] ^= 0x55);
    std::fs::write(cached, bytes).unwrap();
    let mended = render("mended.png").expect_code(0);
    assert_eq!(mended.stderr.matches("is damaged; it is built anew").count(), 1, "{mended}");
    assert!(sandbox.read("mended.png") == sandbox.read("whole.png"));
    assert!(std::fs::read(&kept(&sandbox)[0]).unwrap() == whole, "the same bytes");
    assert!(!render("again.png").expect_code(0).stderr.contains("damaged"));
}

#[test]
fn of_an_image_info_tells_what_its_header_says() {
    let sandbox = Sandbox::new();
    sandbox.write_png("image.png", [300, 200]);
    let told = run(&sandbox, &["info", "image.png"]).expect_code(0);
    assert!(told.stdout.starts_with("image.png\n300x200 texels of 8-bit RGB\n"), "{told}");
    let told = run(&sandbox, &["info", "image.png", "--json"]).expect_code(0);
    let told: serde_json::Value = serde_json::from_str(&told.stdout).unwrap();
    assert_eq!((&told["kind"], &told["size"]), (&"image".into(), &serde_json::json!([300, 200])));
    let refused = run(&sandbox, &["info", "image.png", "--estimate", "100x100"]).expect_code(1);
    assert!(refused.stderr.contains("`vastex build image.png"), "{refused}");
    assert!(kept(&sandbox).is_empty(), "nothing is built for that");
}

#[test]
fn the_cache_lies_where_it_is_asked_for_or_nowhere() {
    let sandbox = Sandbox::new();
    sandbox.write_png("image.png", [100, 60]);
    let image = ["render", "image.png", "--size", "100x60", "-o", "out.png"];
    let render = |more: &[&str]| run(&sandbox, &[&image[..], more].concat());
    render(&["--cache", "mine/here"]).expect_code(0);
    assert_eq!((files(&sandbox.path("mine/here")).len(), kept(&sandbox).len()), (1, 0));
    // Without a cache it is decoded into memory: the same picture.
    let cached = sandbox.read("out.png");
    let off = render(&["--cache", "off"]).expect_code(0);
    assert!(off.stderr.is_empty() && sandbox.read("out.png") == cached, "{off}");
    assert_eq!((files(&sandbox.path("mine/here")).len(), kept(&sandbox).len()), (1, 0));
    sandbox.write("file", b"");
    // Where none can be, too, and that is said.
    for cache in ["file", "file/cache"] {
        std::fs::remove_file(sandbox.path("out.png")).unwrap();
        let unusable = render(&["--cache", cache]).expect_code(0);
        assert!(unusable.stderr.contains(&format!("{cache}: cannot hold built images")), "{unusable}");
        assert!(
            unusable.stderr.contains("another directory with --cache DIR; decoding it into memory"),
            "{unusable}"
        );
        assert!(sandbox.read("out.png") == cached && unusable.stderr.lines().count() == 1, "{unusable}");
    }
    let mut homeless = sandbox.command(&image);
    let homeless = Ended::of(homeless.env_remove("XDG_CACHE_HOME").env_remove("HOME")).expect_code(0);
    assert!(homeless.stderr.contains("name one with --cache DIR"), "{homeless}");
    assert!(sandbox.read("out.png") == cached);
    // What is damaged is said of the image, and leaves nothing.
    let whole = sandbox.read("image.png");
    sandbox.write("short.png", &whole[..whole.len() / 2]);
    for cache in [&[][..], &["--cache", "off"]] {
        let short =
            run(&sandbox, &[&["render", "short.png", "-o", "out.png"], cache].concat()).expect_code(1);
        assert!(short.stderr.contains("short.png") && short.stderr.contains("truncated"), "{short}");
    }
    assert_eq!(kept(&sandbox).len(), 0);
}

/// Whose writes fail from so many bytes of a file on.
#[test]
fn an_image_that_a_full_disk_cannot_keep_is_shown_all_the_same() {
    let sandbox = Sandbox::new();
    sandbox.write_png("image.png", [700, 500]);
    let mut shell = Command::new("sh");
    let script = "ulimit -f 16; exec \"$0\" render image.png --size 32x20 --cache kept -o out.png";
    shell.current_dir(sandbox.path("")).env_remove("RUST_LOG");
    shell.args(["-c", script, env!("CARGO_BIN_EXE_vastex")]);
    let shown = Ended::of(compiled_shaders::share(&mut shell)).expect_code(0);
    assert!(shown.stderr.contains("image.png: cannot be built into kept: "), "{shown}");
    assert!(!shown.stderr.contains("WARN"), "one message is enough: {shown}");
    let image = ["render", "image.png", "--size", "32x20", "--cache", "off", "-o", "off.png"];
    sandbox.run(&image).expect_code(0);
    assert!(sandbox.read("out.png") == sandbox.read("off.png"));
}

/// A grey progressive JPEG of nothing but a first scan, whose blocks have no coefficients.
fn plain_progressive_jpeg([width, height]: [u16; 2]) -> Vec<u8> {
    let mut file = vec![0xff, 0xd8];
    let mut segment = |marker: u8, body: &[u8]| {
        file.extend([0xff, marker]);
        file.extend((body.len() as u16 + 2).to_be_bytes());
        file.extend(body);
    };
    segment(0xdb, &[&[0][..], &[1; 64]].concat());
    segment(0xc2, &[&[8][..], &height.to_be_bytes(), &width.to_be_bytes(), &[1, 1, 0x11, 0]].concat());
    // One code, of one bit, after which none follow.
    segment(0xc4, &[&[0, 1][..], &[0; 15], &[0]].concat());
    segment(0xda, &[1, 1, 0, 0, 0, 0]);
    let blocks = [width, height].map(|side| usize::from(side).div_ceil(8));
    file.resize(file.len() + (blocks[0] * blocks[1]).div_ceil(8), 0);
    file.extend([0xff, 0xd9]);
    file
}

#[test]
fn what_takes_too_much_memory_is_shown_at_an_eighth_of_its_size() {
    let sandbox = Sandbox::new();
    // Of which the decoder would hold 1.2 GB of coefficients.
    sandbox.write("large.jpg", &plain_progressive_jpeg([24_400, 24_100]));
    let large = run(&sandbox, &["render", "large.jpg", "--cache", "off", "--size", "64x64", "-o", "out.png"]);
    let said = large.expect_code(0).stderr;
    assert!(said.contains("1.00 GiB are allowed, so it is shown at 1/8 of its size"), "{said}");
    // All of it is the grey of no coefficients.
    let middle = sandbox.read_rgb("out.png")[64 * 32 + 32];
    assert!(middle.iter().all(|value| value.abs_diff(128) <= 1), "{middle:?}");
}

/// Texels of what is shown at a share of its size are those of the file: where the camera is, and where
/// another image lies upon it.
#[test]
fn what_is_shown_at_a_share_of_its_size_has_places_by_the_texels_of_its_file() {
    let sandbox = Sandbox::new();
    sandbox.write("large.jpg", &plain_progressive_jpeg([24_400, 24_100]));
    let file = std::fs::File::create(sandbox.path("part.png")).unwrap();
    let encoder = png::Encoder::new(file, 2440, 2410);
    encoder.write_header().unwrap().write_image_data(&vec![255; 2440 * 2410]).unwrap();
    // A tenth of it along each side, whose last corner is in the middle of the picture.
    let view = "image:x=2440,y=2410,zoom=20;layer=;layer=:file=2;placement=by-texel";
    let words = ["large.jpg", "--over", "part.png", "--cache", "off", "--size", "60x60", "--view", view];
    for (command, to) in [(&["render"][..], "-o"), (&["view"], "--screenshot")] {
        run(&sandbox, &[command, &words, &[to, "out.png"]].concat()).expect_code(0);
        let picture = sandbox.read_rgb("out.png");
        for (n, pixel) in picture.iter().enumerate() {
            let [x, y] = [n % 60, n / 60];
            let [is_edge, is_of_part] = [x.abs_diff(30).min(y.abs_diff(30)) < 3, x < 30 && y < 30];
            // Guides lie over the picture of a window.
            let is_seen = command == ["render"] || (10..50).contains(&x) && (10..50).contains(&y);
            let grey = if is_of_part { 255 } else { 128 };
            assert!(is_edge || !is_seen || pixel[0].abs_diff(grey) <= 1, "{command:?} {x},{y}: {pixel:?}");
        }
    }
}

/// A TIFF file of grey texels in one strip, compressed by Deflate. The last texel is the first that is shown:
/// what is stored turned is built, and not shown where it lies.
fn one_strip([width, height]: [u32; 2], texels: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(texels).unwrap();
    let strip = encoder.finish().unwrap();
    let at = 8 + strip.len() as u32;
    let mut file = [&b"II\x2a\0"[..], &at.to_le_bytes(), &strip].concat();
    let tags = [
        (256, width),
        (257, height),
        (258, 8),
        (259, 8),
        (262, 1),
        (273, 8),
        (274, 3),
        (277, 1),
        (278, height),
        (279, strip.len() as u32),
    ];
    file.extend((tags.len() as u16).to_le_bytes());
    for (tag, value) in tags {
        file.extend([&u16::to_le_bytes(tag)[..], &[4, 0, 1, 0, 0, 0], &value.to_le_bytes()].concat());
    }
    file.extend([0; 4]);
    file
}

#[test]
fn what_is_read_as_it_is_decoded_is_the_same_picture_once_all_is_there() {
    let (sandbox, size) = (Sandbox::new(), [700, 500]);
    let texels: Vec<u8> =
        (0..size[0] * size[1]).map(|n| ((n % size[0] / 3) ^ (n / size[0] / 2)) as u8).collect();
    sandbox.write("strip.tif", &one_strip(size, &texels));
    let file = std::fs::File::create(sandbox.path("rows.png")).unwrap();
    let encoder = png::Encoder::new(file, size[0], size[1]);
    let turned: Vec<u8> = texels.iter().rev().copied().collect();
    encoder.write_header().unwrap().write_image_data(&turned).unwrap();
    let shots = ["strip.tif", "rows.png"].map(|image| {
        run(&sandbox, &["view", "--screenshot", "shot.png", "--size", "128x96", image]).expect_code(0);
        sandbox.read_rgb("shot.png")
    });
    assert!(shots[0] == shots[1] && shots[0].iter().any(|pixel| pixel[0] > 100));
    // What is cut off is shown by no command that shows it as a whole, and the row is named.
    let whole = sandbox.read("strip.tif");
    let mut short = whole.clone();
    // The strip lies at the end, and half of it is missing.
    let entry = short.windows(4).rposition(|bytes| bytes == [0x11, 1, 4, 0]).unwrap();
    short[entry + 8..entry + 12].copy_from_slice(&(whole.len() as u32).to_le_bytes());
    short.extend(&whole[8..whole.len() / 2]);
    sandbox.write("short.tif", &short);
    let ended = run(&sandbox, &["render", "short.tif", "-o", "out.png"]).expect_code(1);
    assert!(ended.stderr.contains("truncated: it ends near row "), "{ended}");
    assert!(!ended.stderr.contains("near row 0 "), "{ended}");
}
