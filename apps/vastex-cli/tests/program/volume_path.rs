//! Camera paths round a volume: every picture of one, each as the view at its place is drawn by itself; and
//! slices that are tilted, as the window copies them.

use crate::tool::Sandbox;

/// A head of three channels.
const HEAD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/volumes/head.zip");

#[test]
fn every_picture_of_a_path_is_the_view_from_its_place() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "round.path",
        b"vastex path 1\nfps 2\n0 volume:x=49,y=58,z=47,zoom=1,yaw=0,pitch=0\n1 volume:x=49,y=58,z=47,zoom=2,yaw=60,pitch=30\n",
    );
    let shown = "--mode mip --channels 0:ff8000:0..255";
    let words = format!(
        "render {HEAD} --on volume --camera-path round.path {shown} --size 24x20 --json -o p-%02d.png"
    );
    let told = sandbox.run(&words.split(' ').collect::<Vec<_>>()).expect_code(0).json();
    assert_eq!((&told["converged"], &told["tiles_reloaded"]), (&true.into(), &0.into()), "{told}");
    assert!(!sandbox.path("p-03.png").exists());
    let places =
        ["zoom=1,yaw=0,pitch=0", "zoom=1.4142135623730951,yaw=30,pitch=15", "zoom=2,yaw=60,pitch=30"];
    let mut all = Vec::new();
    for (nth, place) in places.iter().enumerate() {
        let words = format!(
            "render {HEAD} --view volume:x=49,y=58,z=47,{place};panes=3d {shown} --size 24x20 -o alone.png"
        );
        sandbox.run(&words.split(' ').collect::<Vec<_>>()).expect_code(0);
        let (along, alone) = (sandbox.read_rgb(&format!("p-{nth:02}.png")), sandbox.read_rgb("alone.png"));
        let off =
            along.iter().zip(&alone).flat_map(|(a, b)| (0..3).map(|c| a[c].abs_diff(b[c]))).max().unwrap();
        assert!(off <= 1 && along.iter().any(|pixel| pixel[0] > 100), "{place}: {off}");
        all.push(along);
    }
    assert!(all[0] != all[1] && all[1] != all[2]);
    // What is shown may be said by a view, whose camera the path takes the place of; and fewer pictures.
    let view = "volume:x=1,y=1,z=1,zoom=9,yaw=9,pitch=9;panes=z;mode=mip;channel=0:color=ff8000:range=0..255";
    let words =
        ["render", HEAD, "--view", view, "--camera-path", "round.path", "--frames", "2", "--size", "24x20"];
    sandbox.run(&[&words[..], &["--format", "raw", "-o", "all.raw"]].concat()).expect_code(0);
    let raw = sandbox.read("all.raw");
    assert_eq!(raw.len(), 2 * 24 * 20 * 4);
    let first: Vec<[u8; 3]> = raw[..24 * 20 * 4].chunks(4).map(|p| [p[0], p[1], p[2]]).collect();
    let off = first.iter().zip(&all[0]).flat_map(|(a, b)| (0..3).map(|c| a[c].abs_diff(b[c]))).max().unwrap();
    assert!(off <= 1, "{off}");
}

#[test]
fn what_is_wrong_with_a_path_is_told() {
    let sandbox = Sandbox::new();
    sandbox.write("bad.path", b"vastex path 1\n0 image:x=1,y=2,zoom=3\n");
    sandbox.write("good.path", b"vastex path 1\n0 volume:x=1,y=2,z=3,zoom=1,yaw=0,pitch=0\n");
    for (words, code, part) in [
        ("--on volume --camera-path bad.path", 1, "bad.path: line 2"),
        ("--on volume --camera-path none.path", 1, "none.path"),
        ("--on volume --camera-path bad.path --view +x", 2, "leave out one of them"),
        ("--on slices --slice z=1 --camera-path bad.path", 2, "--on volume"),
        ("--on volume --camera-path bad.path --compare", 2, "of one picture"),
        ("--on volume --frames 3", 2, "--camera-path"),
        ("--on volume -o -", 2, "--format raw"),
        ("--on volume --camera-path good.path --stats-csv good.path", 1, "as well as the output"),
    ] {
        let words: Vec<&str> = ["render", HEAD].into_iter().chain(words.split(' ')).collect();
        let told = sandbox.run(&words).expect_code(code).stderr;
        assert!(told.contains(part), "{words:?}: {told}");
    }
}

/// Slices and times of a path, of a volume whose voxels are `10 * z` at the first time and 100 more at the
/// second.
#[test]
fn a_path_leads_through_slices_and_times() {
    let sandbox = Sandbox::new();
    let voxels: Vec<u8> =
        (0..2u8).flat_map(|t| (0..10u8).flat_map(move |z| [100 * t + 10 * z; 64])).collect();
    sandbox.write("stack.raw", &voxels);
    sandbox.write(
        "stack.raw.toml",
        b"width = 8\nheight = 8\ndepth = 10\ntimes = 2\nsample = \"u8\"\norder = \"planar\"\n",
    );
    let camera = "volume:x=4,y=4,z=5,zoom=1,yaw=0,pitch=0";
    let line = |z: u32, time: u32| format!("{camera};slices=4,4,{z};time={time}");
    let path = format!("vastex path 1\nfps 1\n0 {}\n1 {}\n2 {}\n", line(2, 0), line(7, 0), line(7, 1));
    sandbox.write("slices.path", path.as_bytes());
    let shown = format!("--view {camera};panes=z;channel=0:color=ffffff:range=0..255 --size 32x32");
    let words = format!("render stack.raw {shown} --camera-path slices.path --json -o s-%d.png");
    let told = sandbox.run(&words.split(' ').collect::<Vec<_>>()).expect_code(0).json();
    assert_eq!(told["converged"], true, "{told}");
    let middle = |name: &str| sandbox.read_rgb(name)[16 * 32 + 16];
    for (nth, value) in [20, 70, 170].into_iter().enumerate() {
        let seen = middle(&format!("s-{nth}.png"));
        assert!(seen.iter().all(|code| code.abs_diff(value) <= 1), "{nth}: {seen:?}, not {value}");
    }
    // Where no slice is asked for alone, all of it is seen along y: z is 5 in the middle.
    let words = "render stack.raw --on volume --channels 0:ffffff:0..255 --size 32x32 --camera-path slices.path -o v-%d.png";
    sandbox.run(&words.split(' ').collect::<Vec<_>>()).expect_code(0);
    for (nth, value) in [48, 48, 148].into_iter().enumerate() {
        let seen = middle(&format!("v-{nth}.png"));
        assert!(seen.iter().all(|code| code.abs_diff(value) <= 3), "{nth}: {seen:?}, not {value}");
    }
    // What is read of labels is counted of all times.
    for name in ["raw", "raw.toml"] {
        sandbox.write(&format!("labels.{name}"), &sandbox.read(&format!("stack.{name}")));
    }
    let bytes_read = |more: &str| {
        let words =
            format!("render stack.raw --on volume --size 32x32 --camera-path slices.path --json{more}");
        let told = sandbox.run(&words.split(' ').collect::<Vec<_>>()).expect_code(0).json();
        told["bytes_read"].as_u64().unwrap()
    };
    assert_eq!(bytes_read(" --labels labels.raw") - bytes_read(""), voxels.len() as u64);
    sandbox.write("late.path", path.replace("time=1", "time=5").as_bytes());
    let words = "render stack.raw --on volume --size 32x32 --camera-path late.path -o v-%d.png";
    let told = sandbox.run(&words.split(' ').collect::<Vec<_>>()).expect_code(1).stderr;
    assert!(told.contains("late.path: time=5: ") && told.contains("has the times 0 to 1"), "{told}");
}

/// A text with a tilted slice alone is drawn as the plane that it is.
#[test]
fn a_tilted_slice_is_a_plane() {
    let sandbox = Sandbox::new();
    let shown = "--channels 0:ffffff:0..255 --filter exact --size 60x60";
    let drawn = |view: &str| {
        let words = format!(
            "render {HEAD} --view volume:x=49,y=58,z=47,zoom=1,yaw=0,pitch=0;panes=z;{view} {shown} -o a.png"
        );
        sandbox.run(&words.split(' ').collect::<Vec<_>>()).expect_code(0);
        sandbox.read_rgb("a.png")
    };
    let upright = drawn("slices=49,58,40");
    assert_eq!(drawn("slices=49,58,40;tilt=off"), upright);
    let tilted = drawn("slices=49,58,40;tilt=z:30,-20");
    assert!(tilted != upright && tilted.iter().any(|pixel| pixel[0] > 100));
    // The place in the middle is on both.
    let middle = 30 * 60 + 30;
    assert!(
        upright[middle][0].abs_diff(tilted[middle][0]) < 40,
        "{:?} {:?}",
        upright[middle],
        tilted[middle]
    );
    let words = ["render", HEAD, "--view", "volume:x=1,y=1,z=1,zoom=1,yaw=0,pitch=0;tilt=z:95,0"];
    assert!(sandbox.run(&words).expect_code(2).stderr.contains("-89 to 89"));
}
