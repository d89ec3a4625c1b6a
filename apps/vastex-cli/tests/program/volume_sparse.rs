//! Pictures of volumes of one level without the coarser ones: sparse ones of any size, and large ones of
//! which a picture shows little.

use crate::tool::Sandbox;

/// Writes a Zarr of one level with so many voxels a side, of which one chunk is stored, if any.
fn write(sandbox: &Sandbox, name: &str, side: u64, stored: Option<[u64; 3]>) {
    let meta = format!(
        "{{\"zarr_format\":2,\"shape\":[{side},{side},{side}],\"chunks\":[64,64,64],\"dtype\":\"|u1\",\"compressor\":null,\
         \"fill_value\":0,\"order\":\"C\",\"filters\":null,\"dimension_separator\":\".\"}}"
    );
    std::fs::create_dir(sandbox.path(name)).unwrap();
    sandbox.write(&format!("{name}/.zarray"), meta.as_bytes());
    if let Some([x, y, z]) = stored {
        sandbox.write(&format!("{name}/{z}.{y}.{x}"), &[200; 64 * 64 * 64]);
    }
}

#[test]
fn a_level_with_one_stored_chunk_is_drawn_at_once_whatever_its_size() {
    let sandbox = Sandbox::new();
    for (side, stored) in [(8000, Some([62, 62, 62])), (100_000, None)] {
        let name = format!("{side}.zarr");
        write(&sandbox, &name, side, stored);
        for of in ["--on volume --mode mip", "--on slices --slice z=4000"] {
            let words =
                format!("render {name} {of} --channels 0 --range 0,1 --size 125x125 --json -o out.png");
            let words: Vec<&str> = words.split(' ').collect();
            let told = sandbox.run(&words).expect_code(0).json();
            let decoded = u64::from(stored.is_some());
            assert_eq!(
                (&told["converged"], &told["chunks_decoded"]),
                (&true.into(), &decoded.into()),
                "{told}"
            );
            // 64 voxels are a pixel: the chunk is the one in the middle.
            let pixels = sandbox.read_rgb("out.png");
            let bright: Vec<usize> = (0..pixels.len()).filter(|nth| pixels[*nth][0] > 0).collect();
            let expected = if stored.is_some() { vec![62 * 125 + 62] } else { Vec::new() };
            assert_eq!(bright, expected, "{name} {of}");
        }
    }
}

/// Of a level of more than 64 MiB that lacks the coarser ones a slice at its own size reads what it shows,
/// and some for the preview that is always in memory; a picture of all of it reads all, and shows no preview.
#[test]
fn what_a_picture_does_not_show_is_not_read() {
    let sandbox = Sandbox::new();
    let [width, height, depth] = [128, 66, 8064];
    let value = |z: usize| ((z / 128) * 37 % 200 + 20) as u8;
    let mut values = Vec::new();
    (0..depth).for_each(|z| values.resize(values.len() + width * height, value(z)));
    sandbox.write("tall.raw", &values);
    let about = format!("width = {width}\nheight = {height}\ndepth = {depth}\nsample = \"u8\"\n");
    sandbox.write("tall.raw.toml", about.as_bytes());
    let drawn = |words: &str| {
        let words = format!("render tall.raw {words} --channels 0 --range 0,1 --json -o out.png");
        let told = sandbox.run(&words.split(' ').collect::<Vec<_>>()).expect_code(0).json();
        assert_eq!(told["converged"], true, "{told}");
        let [read, chunks] = ["bytes_read", "chunks_decoded"].map(|key| told[key].as_u64().unwrap());
        let volumes = if words.contains("--labels") { 2 } else { 1 };
        assert!(0 < read && read <= volumes * values.len() as u64, "{told}");
        (chunks, sandbox.read_rgb("out.png").iter().map(|pixel| pixel[0]).collect::<Vec<u8>>())
    };
    let (all, (chunks, slice)) = (66, drawn("--on slices --slice z=300 --size 128x66"));
    assert!(chunks <= all / 8 + 3, "{chunks}");
    assert_eq!(slice, [value(300); 128 * 66]);
    // A pixel is a voxel of the coarsest level but those of one voxel across, or of one that is finer.
    for (size, side) in [([1, 63], 128), ([4, 252], 32)] {
        let words = format!("--on slices --slice y=30 --size {}x{}", size[0], size[1]);
        let (chunks, slice) = drawn(&words);
        assert_eq!(chunks, all);
        let expected: Vec<u8> =
            (0..size[1]).flat_map(|z| vec![value(z * side + side / 2); size[0]]).collect();
        assert_eq!(slice, expected, "{words}");
    }
    // So it is of labels, which are a volume of their own here.
    let (chunks, slice) = drawn("--on slices --slice z=300 --size 128x66 --labels tall.raw");
    assert!(chunks <= 2 * (all / 8 + 3), "{chunks}");
    assert!(slice.iter().all(|pixel| *pixel == slice[0]) && slice[0] != value(300));
    let (chunks, slice) = drawn("--on slices --slice y=30 --size 1x63 --labels tall.raw --label-opacity 1");
    assert_eq!(chunks, 2 * all);
    for (z, other) in (0..63).flat_map(|z| (0..z).map(move |other| (z, other))) {
        let is_one = value(z * 128) == value(other * 128);
        assert!(!is_one || slice[z] == slice[other], "labels at {z} and {other}");
    }
    assert!(slice.windows(2).filter(|two| two[0] != two[1]).count() > 40);
    // In perspective, too: the ray in the middle meets it, and of rays beside it nothing is made.
    assert_eq!(drawn("--on volume --mode average --view around:yaw=30,pitch=20 --size 9x9").0, all);
    assert!(drawn("--on volume --mode average --view around:yaw=30,pitch=20 --size 8x8").0 <= all / 8 + 3);
    let near = "--view volume:x=64,y=33,z=4000,zoom=300,yaw=0,pitch=0;panes=3d;mode=average";
    assert!(drawn(&format!("{near} --size 33x33")).0 <= all / 8 + 6);
}

/// Where a stored brick cannot be read the picture has the level that is made, which lacks the chunk alone,
/// and not the preview that stood for it.
#[test]
fn a_damaged_chunk_is_shown_by_the_level_that_is_made() {
    let sandbox = Sandbox::new();
    let meta = "{\"zarr_format\":2,\"shape\":[4160,128,128],\"chunks\":[64,64,64],\"dtype\":\"|u1\",\"compressor\":null,\
                \"fill_value\":0,\"order\":\"C\",\"filters\":null,\"dimension_separator\":\".\"}";
    std::fs::create_dir(sandbox.path("tall.zarr")).unwrap();
    sandbox.write("tall.zarr/.zarray", meta.as_bytes());
    // A preview is made of the chunks with 200 right beside the one that is cut off.
    for (z, place) in (0..65).flat_map(|z| ["0.0", "0.1", "1.0", "1.1"].map(|place| (z, place))) {
        let chunk = vec![if z % 2 == 0 { 200 } else { 100 }; 64 * 64 * 64];
        let is_cut = (z, place) == (5, "0.0");
        sandbox.write(&format!("tall.zarr/{z}.{place}"), if is_cut { &chunk[..1000] } else { &chunk });
    }
    let words = "render tall.zarr --on slices --slice z=340 --channels 0 --range 0,1 --size 128x128 --json -o out.png";
    let ended = sandbox.run(&words.split(' ').collect::<Vec<_>>()).expect_code(0);
    assert!(ended.stderr.contains("5.0.0"), "{}", ended.stderr);
    let told = ended.json();
    assert!(told["converged"] == true && told["bricks_failed"].as_u64() > Some(0), "{told}");
    let pixels = sandbox.read_rgb("out.png");
    let is_at_edge = |at: usize| (60..68).contains(&at);
    for (x, y) in (0..128).flat_map(|y| (0..128).map(move |x| (x, y))) {
        let expected = if x < 64 && y < 64 { 0 } else { 100 };
        assert!(is_at_edge(x) || is_at_edge(y) || pixels[y * 128 + x][0] == expected, "{x}, {y}");
    }
}

/// A picture is drawn of the made levels and in their window also where these are there before it begins,
/// their first bricks having been read as a preview.
#[test]
fn levels_that_are_made_before_the_first_frame_are_shown() {
    let sandbox = Sandbox::new();
    let [width, height, depth] = [128, 66, 8064];
    let noise: Vec<u8> = (0..width * height + 4096_usize)
        .map(|n| ((n as u32).wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect();
    let mut values = Vec::with_capacity(width * height * depth);
    for z in 0..depth {
        let plane = &noise[z * 1000 % 4093..][..width * height];
        values.extend(plane.iter().map(|value| value / (1 + (z / 256 % 5) as u8)));
    }
    sandbox.write("tall.raw", &values);
    let about = format!("width = {width}\nheight = {height}\ndepth = {depth}\nsample = \"u8\"\n");
    sandbox.write("tall.raw.toml", about.as_bytes());
    let drawn = |cache: &str| {
        let words =
            format!("render tall.raw --on slices --slice y=30 --size 1x63 --cache {cache} --json -o out.png");
        let told = sandbox.run(&words.split(' ').collect::<Vec<_>>()).expect_code(0).json();
        assert_eq!(told["converged"], true, "{told}");
        (told["chunks_decoded"].as_u64().unwrap(), sandbox.read_rgb("out.png"))
    };
    let (first, again) = (drawn("kept"), drawn("kept"));
    assert!(first.0 > 0 && again.0 == 0, "the second run has all that the first one made");
    assert!(first.1.iter().any(|pixel| *pixel != first.1[0]));
    assert_eq!(first.1, again.1);
}

/// Sides of which no brick has a name are refused with what can be done about it.
#[test]
fn what_is_too_large_to_be_drawn_says_how_large_it_may_be() {
    let sandbox = Sandbox::new();
    write(&sandbox, "huge.zarr", (1 << 31) - 1, None);
    let words = "render huge.zarr --on volume --range 0,1 --size 8x8 -o out.png";
    let words: Vec<&str> = words.split(' ').collect();
    let told = sandbox.run(&words).expect_code(1).stderr;
    let said =
        ["2147483647 voxels: 4194304 at most", "bricks of 64", "take a coarser level, or a part of it"];
    assert!(said.iter().all(|part| told.contains(part)) && !told.contains("pages"), "{told}");
}

/// A path from all of a large volume to one of its voxels, and through to within: rays are long, and few of
/// their samples are of fine levels.
#[test]
fn a_path_leads_into_a_large_volume() {
    let sandbox = Sandbox::new();
    write(&sandbox, "large.zarr", 100_000, None);
    let at = "volume:x=50000,y=50000,z=50000";
    let path = format!(
        "vastex path 1\nfps 1\n0 {at},zoom=1,yaw=0,pitch=0\n1 {at},zoom=1000,yaw=20,pitch=10\n2 {at},zoom=50000,yaw=60,pitch=30\n"
    );
    sandbox.write("into.path", path.as_bytes());
    let words = "render large.zarr --on volume --mode mip --camera-path into.path --channels 0 --range 0,1 --size 16x12 --json -o p-%d.png";
    let told = sandbox.run(&words.split(' ').collect::<Vec<_>>()).expect_code(0).json();
    assert_eq!(told["converged"], true, "{told}");
    assert!(sandbox.read_rgb("p-2.png").iter().all(|pixel| *pixel == [0; 3]));
}
