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
        assert!(0 < read && read <= values.len() as u64, "{told}");
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
    assert_eq!(drawn("--on volume --mode average --view around:yaw=30,pitch=20 --size 8x8").0, all);
}
