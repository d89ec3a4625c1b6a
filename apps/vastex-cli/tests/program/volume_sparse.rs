//! Pictures of sparse volumes of one level without the coarser ones.

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
