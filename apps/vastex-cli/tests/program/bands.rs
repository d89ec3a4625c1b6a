//! TIFF files of more bands than a picture has: which of them are shown, built and cut out is said in two
//! ways.

use crate::nodata::tiff;
use crate::tool::{Ended, Sandbox};

/// Runs the program with these words.
fn run(sandbox: &Sandbox, words: &str) -> Ended {
    sandbox.run(&words.split_whitespace().collect::<Vec<_>>())
}

#[test]
fn bands_are_chosen_for_a_layer_or_with_the_file() {
    let sandbox = Sandbox::new();
    let value = |i: u32, band: u32| (40 * band + i % 16 + 1) as u8;
    let texels: Vec<u8> = (0..16 * 16).flat_map(|i| (0..6).map(move |band| value(i, band))).collect();
    sandbox.write("six.tif", &tiff([16, 16], 6, 0, &texels));
    let picture = |words: &str| {
        run(&sandbox, &format!("render {words} --size 16x16 --cache off -o a.png")).expect_code(0);
        sandbox.read_rgb("a.png")
    };
    let of = |bands: [u32; 3]| -> Vec<[u8; 3]> {
        (0..16 * 16).map(|i| bands.map(|band| value(i, band - 1))).collect()
    };
    assert_eq!(picture("six.tif --layer :filter=nearest"), of([1, 2, 3]));
    assert_eq!(picture("six.tif --layer :bands=5,4,3:filter=nearest"), of([5, 4, 3]));
    assert_eq!(picture("six.tif:bands=5,4,3 --layer :filter=nearest"), of([5, 4, 3]));
    assert_eq!(picture("six.tif --layer :bands=6:filter=nearest"), of([6, 6, 6]));
    // Another one of it over it.
    let over = "six.tif --over six.tif --layer :bands=1 --layer :file=2:bands=6:filter=nearest";
    assert_eq!(picture(over), of([6, 6, 6]));
    let info = run(&sandbox, "info six.tif").expect_code(0);
    assert!(info.stdout.contains("1, 2, 3, 4, 5, 6"), "{info}");
    assert_eq!(
        run(&sandbox, "info six.tif --json").expect_code(0).json()["shown_bands"],
        serde_json::json!([1, 2, 3])
    );
    run(&sandbox, "build six.tif:bands=6,5,4 -o six.vastex").expect_code(0);
    assert_eq!(picture("six.vastex --layer :filter=nearest"), of([6, 5, 4]));
    run(&sandbox, "crop six.tif --at 3,2 --size 4x1 -o a.npy").expect_code(0);
    let array = sandbox.read("a.npy");
    assert!(array.ends_with(&texels[(2 * 16 + 3) * 6..][..24]));
    assert!(String::from_utf8_lossy(&array[..128]).contains("(1, 4, 6)"));
    // The alpha that a picture of three bands has on a GPU is none of the file.
    sandbox.write_png("three.png", [16, 16]);
    for (words, why) in [
        ("render three.png --layer :bands=4 -o b.png", "three.png: has no bands '4'; it has 3"),
        ("render three.png --layer :bands=9 -o b.png", "three.png: has no bands '9'; it has 3"),
        ("render six.tif --layer :bands=7 -o b.png", "has no bands '7'; it has 6"),
        ("render six.tif:bands=1,2 -o b.png", "has no bands '1,2'; it has 6"),
        ("render six.tif --layer :bands=1 --layer :bands=2 -o b.png", "two layers ask for different bands"),
        ("render six.vastex --layer :bands=5 -o b.png", "there are no bands 5"),
    ] {
        let ended = run(&sandbox, words).expect_code(1);
        assert!(ended.stderr.contains(why), "{words}: {ended}");
    }
}
