//! What is told of pictures of volumes and kept beside them, as of images: traces, figures of frames, pools,
//! why a pixel shows what it shows, bricks on a disk, levels that are made; and planes that lie as they like.

use serde_json::Value;

use crate::tool::Sandbox;

/// A head of three channels.
const HEAD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/volumes/head.zip");

fn render(sandbox: &Sandbox, words: &str) -> Value {
    let first = ["render", HEAD, "--size", "49x58", "--json"];
    let words: Vec<&str> = words.split(' ').collect();
    sandbox.run(&[&first[..], &words].concat()).expect_code(0).json()
}

#[test]
fn a_run_tells_of_a_volume_what_it_tells_of_an_image() {
    let sandbox = Sandbox::new();
    let told = render(
        &sandbox,
        "--on slices --slice z=40 --pool-mib 8 --record-trace t.vxtrace --stats-csv f.csv --stats-json f.json --dump-pools --explain 20,30 --report run -o a.png",
    );
    // Every frame has a line.
    let csv = String::from_utf8(sandbox.read("f.csv")).unwrap();
    let frames = told["frames"].as_u64().unwrap() as usize;
    assert_eq!(csv.lines().count(), frames + 1, "{csv}");
    let records: Value = serde_json::from_slice(&sandbox.read("f.json")).unwrap();
    assert_eq!(records.as_array().unwrap().len(), frames);
    assert!(
        records.as_array().unwrap().iter().any(|record| record["uploads"].as_u64() > Some(0)),
        "{records}"
    );
    assert!(told["pool_dump"].to_string().contains("level"), "{told}");
    // Bricks of 32: a pool of 8 MiB is small for three channels. Voxel 40, 60, 40 at half the size.
    assert_eq!(told["brick"], 32);
    let page = &told["explained"]["pages"][0];
    assert_eq!(
        (&page["state"], page["wanted"].to_string()),
        (&"resident".into(), r#"{"level":1,"x":0,"y":0,"z":0}"#.into())
    );
    // A page of its own, without overlays.
    let page = String::from_utf8(sandbox.read("run/index.html")).unwrap();
    for says in [
        "data:image/png;base64,",
        "Slots of the pool",
        "<th>voxels</th>",
        "<th>scene</th><td>slices",
        "head.zip",
    ] {
        assert!(page.contains(says), "{says}");
    }
    assert!(!page.contains("What the picture is made of"));
    for channel in 0..3 {
        assert!(page.contains(&format!("<th>channel</th><td>{channel}<")), "{page}");
    }
    assert!(!page.contains("<th>over it</th>"), "channels are no files");
    let replayed = sandbox.run(&["replay", "t.vxtrace", "--json"]).expect_code(0).json();
    assert!(replayed.to_string().contains("loads"), "{replayed}");
    for (words, says) in [
        (vec!["--on", "volume", "--explain", "1,1"], "a ray meets many bricks"),
        (vec!["--on", "slices", "--slice", "z=1", "--explain", "49,1"], "49x58 pixels"),
        (vec!["--on", "volume", "--views", "stereo"], "has one camera"),
        (vec!["--on", "volume", "--camera-path", "fly"], "it is a path over images"),
    ] {
        let words = [&["render", HEAD, "--size", "49x58"][..], &words].concat();
        let ended = sandbox.run(&words).expect_code(2);
        assert!(ended.stderr.contains(says), "{words:?}: {ended}");
    }
    let settings = b"[reading]\nreads_at_once = 5\n";
    sandbox.write("s.toml", settings);
    for (words, says) in [
        ("--stats-csv a.csv --record-trace a.csv", "would be one file"),
        ("-o no/a.png", "no/a.png"),
        ("--settings s.toml --stats-csv s.toml", "s.toml"),
        ("--labels s.toml --stats-csv s.toml", "s.toml: is the source as well as the output"),
    ] {
        let words: Vec<&str> = words.split(' ').collect();
        let ended = sandbox.run(&[&["render", HEAD, "--on", "volume"][..], &words].concat()).expect_code(1);
        assert!(ended.stderr.contains(says), "{words:?}: {ended}");
    }
    assert_eq!(sandbox.read("s.toml"), settings, "what is read is not written over");
}

#[test]
fn bricks_are_small_where_the_pool_is() {
    let sandbox = Sandbox::new();
    // A volume is drawn as one, without a word that it is; words about reading change no picture.
    sandbox.write("vastex.toml", b"[reading]\nreads_at_once = 3\n[default_pool]\nsize_mib = 2\n");
    let words = "--settings vastex.toml --read-time-out-s 100 --upload-kib-per-frame 900 --no-sharing";
    let [small, large] = [(1, ""), (64, words)]
        .map(|(mib, words)| render(&sandbox, format!("--pool-mib {mib} -o a.png {words}").trim()));
    assert_eq!(
        (&small["brick"], &small["converged"], &small["tiles_reloaded"]),
        (&32.into(), &true.into(), &0.into())
    );
    assert_eq!((&large["brick"], &large["mip_bias"]), (&64.into(), &0.0.into()));
    // Whatever their size, one of each channel and one to work with must fit.
    sandbox.write("many.raw", &[7; 40 * 40 * 40 * 4 * 16]);
    let about = "width = 40\nheight = 40\ndepth = 40\nsample = \"f32\"\nchannels = 16\norder = \"planar\"\n";
    sandbox.write("many.raw.toml", about.as_bytes());
    let all = (0..16).map(|channel| channel.to_string()).collect::<Vec<_>>().join(",");
    let words = ["render", "many.raw", "--on", "volume", "--channels", &all, "--size", "20x20", "--pool-mib"];
    let said = sandbox.run(&[&words[..], &["1"]].concat()).expect_code(1).stderr;
    assert!(said.contains("16 channels need 3 MiB at least"), "{said}");
    let least = sandbox.run(&[&words[..], &["3", "--json"]].concat()).expect_code(0).json();
    assert_eq!((&least["converged"], &least["tiles_reloaded"]), (&true.into(), &0.into()), "{least}");
    let nuclei = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/volumes/nuclei.zip/labels/nuclei");
    let said = sandbox.run(&[&words[..], &["1", "--labels", nuclei]].concat()).expect_code(1).stderr;
    assert!(said.contains("16 channels and labels need"), "{said}");
}

#[test]
fn bricks_are_read_from_a_disk_where_they_were_kept() {
    let sandbox = Sandbox::new();
    let words = "--on volume --mode average --disk-cache kept -o";
    let reads = |told: &Value| ["hits", "misses"].map(|name| told["disk_cache"][name].as_u64().unwrap());
    let first = render(&sandbox, &format!("{words} a.png"));
    let [hits, misses] = reads(&first);
    assert!(hits == 0 && misses >= 6, "{first}");
    assert_eq!(reads(&render(&sandbox, &format!("{words} b.png"))), [misses, 0]);
    assert_eq!(sandbox.read("a.png"), sandbox.read("b.png"));
    let view = ["view", "--screenshot", "c.png", "--size", "64x48", HEAD, "--disk-cache", "of-view"];
    assert_eq!(sandbox.run(&view).expect_code(0).stderr, "");
    let kept = std::fs::read_dir(sandbox.path("of-view")).unwrap();
    assert!(kept.flatten().any(|entry| entry.metadata().unwrap().len() > 10_000), "bricks are there");
    // Of a directory a chunk may be written anew, and no date of another one tells.
    sandbox.run(&["build", HEAD, "-o", "head.zarr", "--quiet"]).expect_code(0);
    let words = ["render", "head.zarr", "--on", "volume", "--size", "20x20", "--disk-cache", "kept"];
    let said = sandbox.run(&words).expect_code(0).stderr;
    assert!(said.contains("head.zarr: not kept on disk"), "{said}");
}

#[test]
fn the_window_keeps_the_levels_that_it_makes() {
    let sandbox = Sandbox::new();
    // Larger than what is made at opening. Nothing is written of it: the file has holes.
    std::fs::File::create(sandbox.path("large.raw")).unwrap().set_len(420 * 410 * 400).unwrap();
    let about = "width = 420\nheight = 410\ndepth = 400\nsample = \"u8\"\n";
    sandbox.write("large.raw.toml", about.as_bytes());
    let view = |cache: &str| {
        let words = ["view", "--screenshot", "a.png", "--size", "48x40", "large.raw", "--cache", cache];
        sandbox.run(&words).expect_code(0);
    };
    view("off");
    assert!(!sandbox.path("off").exists());
    view("kept");
    let told = sandbox.run(&["info", "large.raw", "--json", "--cache", "kept"]).expect_code(0).json();
    assert!(told["levels_kept"]["kept"].as_u64() > Some(0), "{told}");
}

#[test]
fn a_plane_lies_as_it_is_told() {
    let sandbox = Sandbox::new();
    let picture = |slice: &str| {
        render(&sandbox, &format!("--on slices --channels 0 --filter exact --slice {slice} -o a.png"));
        sandbox.read_rgb("a.png")
    };
    // Through the middles of the voxels 40 along z, from before.
    let upright = picture("z=40");
    let near = |other: &[[u8; 3]]| {
        let off = upright.iter().zip(other).map(|(a, b)| a[0].abs_diff(b[0])).max().unwrap();
        assert!(upright.iter().any(|pixel| pixel[0] > 100));
        off
    };
    assert!(near(&picture("plane:x=3,y=90,z=40.5,nz=1")) <= 1);
    assert!(near(&picture("plane:x=49,y=58,z=47,nx=1,ny=-1,nz=0.5")) > 30);
    let words = ["render", HEAD, "--on", "slices", "--slice", "plane:x=1,y=1,z=500,nz=1"];
    assert!(sandbox.run(&words).expect_code(1).stderr.contains("does not meet"));
    let words = ["render", HEAD, "--on", "slices", "--slice", "plane:x=1,y=1,z=5"];
    assert!(sandbox.run(&words).expect_code(2).stderr.contains("needs a normal"));
}
