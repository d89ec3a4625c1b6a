//! Texels without data: what a file says of them is followed where it is shown and built, until somebody says
//! otherwise.

use crate::tool::{Ended, Sandbox};

/// Runs the program with these words.
fn run(sandbox: &Sandbox, words: &str) -> Ended {
    sandbox.run(&words.split_whitespace().collect::<Vec<_>>())
}

/// A TIFF file of one strip of texels of so many bytes that says which value, one digit, stands for no data.
pub(crate) fn tiff(size: [u32; 2], samples: u32, nodata: u8, texels: &[u8]) -> Vec<u8> {
    let text = u32::from_le_bytes([b'0' + nodata, 0, 0, 0]);
    let [width, height] = size;
    let entries: [(u16, u16, u32, u32); 10] = [
        (256, 4, 1, width),
        (257, 4, 1, height),
        (258, 3, 1, 8),
        (259, 3, 1, 1),
        (262, 3, 1, 1),
        (273, 4, 1, 8 + 2 + 10 * 12 + 4),
        (277, 3, 1, samples),
        (278, 4, 1, height),
        (279, 4, 1, width * height * samples),
        (42113, 2, 2, text),
    ];
    let mut file = vec![b'I', b'I', 42, 0, 8, 0, 0, 0, 10, 0];
    for (tag, kind, count, value) in entries {
        file.extend(tag.to_le_bytes());
        file.extend(kind.to_le_bytes());
        file.extend(count.to_le_bytes());
        file.extend(value.to_le_bytes());
    }
    file.extend([0; 4]);
    file.extend(texels);
    file
}

/// The left half and, in the right half, a texel of every three are without data; the others are 200.
fn texel(i: u32) -> u8 {
    let [x, y] = [i % 64, i / 64];
    if x < 32 || (x + y).is_multiple_of(3) { 0 } else { 200 }
}

#[test]
fn what_is_without_data_is_not_drawn_and_mixed_with_nothing() {
    let sandbox = Sandbox::new();
    let texels: Vec<u8> = (0..64 * 64).map(texel).collect();
    sandbox.write("a.tif", &tiff([64, 64], 1, 0, &texels));
    run(&sandbox, "build a.tif -o a.vastex").expect_code(0);
    let info = run(&sandbox, "info a.vastex").expect_code(0);
    assert!(info.stdout.contains("filter box/nodata=0, no data 0"), "{info}");
    let picture = |words: &str, side: u32| {
        run(&sandbox, &format!("render {words} --size {side}x{side} --cache off -o a.png")).expect_code(0);
        sandbox.read_rgb("a.png")
    };
    // What is seen beside every image.
    let background = [22, 25, 31];
    for file in ["a.tif", "a.vastex"] {
        // Two levels down all that is left of the right half is what is known of it.
        let far = picture(file, 16);
        for (i, pixel) in far.iter().enumerate() {
            let expected = if i % 16 < 8 { background } else { [200; 3] };
            assert_eq!(*pixel, expected, "{file}, pixel {i}");
        }
        // From near each pixel shows one texel.
        let near = picture(file, 128);
        for (i, pixel) in (0..).zip(&near) {
            let value = texel(i % 128 / 2 + i / 128 / 2 * 64);
            assert_eq!(*pixel, if value == 0 { background } else { [200; 3] }, "{file}, pixel {i}");
        }
        // Somebody may want to see the value, or leave out another one.
        let all = picture(&format!("{file} --layer :nodata=off:filter=nearest"), 64);
        assert!(all.iter().zip(&texels).all(|(pixel, texel)| *pixel == [*texel; 3]), "{file}");
        // Or the value has a colour, in a list of layers as well, where maps and opacities are of data.
        let holes = [255, 0, 128];
        let expected = |texel: u8| if texel == 0 { holes } else { [200; 3] };
        let drawn = picture(&format!("{file} --layer :nodata-color=ff0080"), 64);
        assert!(drawn.iter().zip(&texels).all(|(pixel, texel)| *pixel == expected(*texel)), "{file}");
        let over =
            format!("{file} --layer :nodata=off:filter=nearest --layer :nodata-color=ff0080:map=viridis");
        let drawn = picture(&over, 64);
        let of_map = drawn[texels.iter().position(|texel| *texel == 200).unwrap()];
        assert!(of_map[0] < 160 && of_map[1] > 180, "the colour of viridis for 200: {of_map:?}");
        let expected = |texel: u8| if texel == 0 { holes } else { of_map };
        assert!(drawn.iter().zip(&texels).all(|(pixel, texel)| *pixel == expected(*texel)), "{file}");
        let other = picture(&format!("{file} --layer :nodata=200"), 64);
        let expected = |texel: u8| if texel == 0 { [0; 3] } else { background };
        assert!(other.iter().zip(&texels).all(|(pixel, texel)| *pixel == expected(*texel)), "{file}");
    }
    // What is built without, is mixed.
    run(&sandbox, "build a.tif -o b.vastex --nodata off").expect_code(0);
    assert!(!run(&sandbox, "info b.vastex").expect_code(0).stdout.contains("no data"));
    assert!(picture("b.vastex", 16).iter().any(|pixel| (80..180).contains(&pixel[0])));
    run(&sandbox, "build a.tif -o b.vastex --nodata black").expect_code(2);
}
