//! Pictures of raw volumes by `render` as it is called without any care: beside the values that were written.

use serde_json::Value;

use crate::tool::{Sandbox, draws_by_gpu};

/// Writes a raw volume of so many voxels along x, y and z, with what else its description says.
fn write(sandbox: &Sandbox, [width, height, depth]: [usize; 3], sample: &str, values: &[u8]) {
    sandbox.write("volume.raw", values);
    let about = format!("width = {width}\nheight = {height}\ndepth = {depth}\nsample = \"{sample}\"\n");
    sandbox.write("volume.raw.toml", about.as_bytes());
}

/// What a run tells, and the red of its picture.
fn drawn(sandbox: &Sandbox, words: &str) -> (Value, Vec<u8>) {
    let words = format!("render volume.raw {words} --json -o picture.png");
    let words: Vec<&str> = words.split(' ').collect();
    let ended = sandbox.run(&words).expect_code(0);
    assert!(!ended.stderr.contains("--pool-mib"), "{}", ended.stderr);
    (ended.json(), sandbox.read_rgb("picture.png").iter().map(|pixel| pixel[0]).collect())
}

/// A picture shows these values, by a GPU within a step, as its filter is exact to no more.
fn assert_shows(picture: &[u8], values: &[u8]) {
    let apart = picture.iter().zip(values).map(|(shown, value)| shown.abs_diff(*value)).max();
    assert!(picture == values || apart <= Some(1) && draws_by_gpu(), "{apart:?} apart");
}

/// Of 74 bricks, and of 139: numbers for which a tenth more slots have no room, as a pool keeps a tenth free.
#[test]
fn all_bricks_of_a_volume_are_shown_where_nobody_says_how_large_the_pool_is() {
    let sandbox = Sandbox::new();
    let side = 256;
    let value = |x: usize, y: usize, z: usize| ((x * 7 + y * 13) % 199 + (z * 31 + x) % 57) as u8;
    let mut values = Vec::with_capacity(side * side * side);
    for (z, y) in (0..side).flat_map(|z| (0..side).map(move |y| (z, y))) {
        values.extend((0..side).map(|x| value(x, y, z)));
    }
    write(&sandbox, [side; 3], "u8", &values);
    let (told, picture) = drawn(&sandbox, "--on volume --mode mip --view +z --channels 0 --size 256x256");
    assert_eq!((&told["mip_bias"], &told["converged"]), (&0.0.into(), &true.into()), "{told}");
    let most = |at: usize| (0..side).map(|z| values[z * side * side + at]).max();
    let most: Vec<u8> = (0..side * side).map(|at| most(at).unwrap()).collect();
    assert_shows(&picture, &most);
    let size @ [nx, ny, nz] = [600, 600, 12];
    let values: Vec<u8> = (0..nx * ny * nz).map(|at| value(at % nx, at / nx % ny, at / nx / ny)).collect();
    write(&sandbox, size, "u8", &values);
    let (told, picture) = drawn(&sandbox, "--on slices --slice z=6 --channels 0 --size 600x600");
    assert_eq!((&told["mip_bias"], &told["converged"]), (&0.0.into(), &true.into()), "{told}");
    assert_shows(&picture, &values[6 * nx * ny..7 * nx * ny]);
}

/// Of a ray of 70,000 samples of which the last ones alone are bright these are seen, or it is refused: by a
/// software driver, which would end it without a word.
#[test]
fn no_ray_ends_before_the_volume_does_unless_it_is_said() {
    let sandbox = Sandbox::new();
    let mut values = vec![7; 4 * 699];
    values.extend([200; 4]);
    write(&sandbox, [2, 2, 700], "u8", &values);
    let words =
        "render volume.raw --on volume --mode mip --view +z --channels 0 --size 2x2 -o picture.png --step";
    for step in ["0.01", "0.012", "0.1"] {
        let ended = sandbox.run(&words.split(' ').chain([step]).collect::<Vec<_>>());
        if ended.code == Some(0) {
            assert_eq!(sandbox.read_rgb("picture.png"), [[200; 3]; 4], "{step}");
        } else {
            assert_eq!((ended.code, step), (Some(1), "0.01"), "{ended}");
            assert!(ended.stderr.contains("70000 samples") && ended.stderr.contains("write 0.02"), "{ended}");
        }
    }
}

/// What is infinite is beyond every range, on its side, whatever is blended with it.
#[test]
fn infinite_values_are_the_ends_of_the_range() {
    let sandbox = Sandbox::new();
    let (most, least) = (f32::INFINITY, f32::NEG_INFINITY);
    let row = [most, most, 1.0, 3.0, 3.0, 2.0, least, least];
    let values: Vec<u8> = row.iter().cycle().take(8 * 8 * 8).flat_map(|value| value.to_le_bytes()).collect();
    write(&sandbox, [8; 3], "f32", &values);
    for of in ["volume --mode mip --view +z", "volume --mode minip --view +z", "slices --slice z=3"] {
        for filter in ["linear", "exact"] {
            let words = format!("--on {of} --channels 0:FFFFFF:0..4 --size 8x8 --filter {filter}");
            let (_, picture) = drawn(&sandbox, &words);
            for row in picture.chunks_exact(8) {
                // The two that touch what is infinite are blended with that by a device that rounds.
                let found = [row[0], row[1], row[3], row[4], row[6], row[7]];
                assert_eq!(found, [255, 255, 191, 191, 0, 0], "{words}");
            }
        }
    }
    // A pixel between two voxels is between the ends, and no gap.
    let words = "--on slices --slice z=3 --channels 0:FFFFFF:0..4 --size 96x96 --filter exact";
    let (_, picture) = drawn(&sandbox, words);
    assert!(picture[..24].iter().all(|code| *code == 255), "{:?}", &picture[..24]);
}

/// Infinite values along a ray of long voxels, four above all and eight below: their mean is below all, from
/// either side, and how steep the surface between them is can be told.
#[test]
fn infinite_values_have_a_mean_and_a_surface() {
    let sandbox = Sandbox::new();
    let row = [[f32::INFINITY; 4], [f32::NEG_INFINITY; 4], [f32::NEG_INFINITY; 4]].concat();
    let values: Vec<u8> = row.iter().cycle().take(12 * 64).flat_map(|value| value.to_le_bytes()).collect();
    write(&sandbox, [12, 8, 8], "f32", &values);
    let mut about = sandbox.read("volume.raw.toml");
    about.extend(b"scale = [1, 1, 4]\n");
    sandbox.write("volume.raw.toml", &about);
    for (mode, code) in [("average", 0), ("iso --iso 0", 255)] {
        for view in ["+x", "-x"] {
            let words =
                format!("--on volume --mode {mode} --view {view} --channels 0:FFFFFF:-4..4 --size 8x8");
            let (_, picture) = drawn(&sandbox, &words);
            assert!(picture.iter().all(|found| *found == code), "{words}: {picture:?}");
        }
    }
}

/// Labels that a ray meets when it has gone as far as 200,000 of their voxels are long: there its way is so
/// long that a part of a voxel is lost in rounding. They lie in the second of two bricks.
#[test]
fn labels_are_seen_at_the_end_of_a_long_ray() {
    let sandbox = Sandbox::new();
    write(&sandbox, [2, 2, 8], "u8", &[0; 4 * 8]);
    sandbox.write("image.raw", &sandbox.read("volume.raw"));
    let about = [&sandbox.read("volume.raw.toml")[..], b"scale = [1, 1, 25000]\n"].concat();
    sandbox.write("image.raw.toml", &about);
    let mut values = vec![0; 4 * 128];
    values[..4 * 32].fill(7);
    write(&sandbox, [2, 2, 128], "u8", &values);
    let words = "render image.raw --on volume --mode mip --view -z --channels 0 --labels volume.raw --label-opacity 1 --size 2x2 \
                 --json -o picture.png";
    let told = sandbox.run(&words.split_whitespace().collect::<Vec<_>>()).expect_code(0).json();
    assert_eq!((&told["mip_bias"], &told["converged"]), (&0.0.into(), &true.into()), "{told}");
    let picture = sandbox.read_rgb("picture.png");
    assert!(picture.iter().all(|pixel| *pixel != [0; 3]), "{picture:?}");
}
