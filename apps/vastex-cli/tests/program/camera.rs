//! `render --view`: where the camera is, in the words of the window's panel.

use crate::tool::{Ended, Sandbox};

fn run(sandbox: &Sandbox, command: &str) -> Ended {
    sandbox.run(&command.split_whitespace().collect::<Vec<_>>())
}

#[test]
fn a_view_is_drawn_as_it_is_written() {
    let sandbox = Sandbox::new();
    let relief = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/earth-elevation-1080x540-u16.png");
    std::fs::copy(relief, sandbox.path("relief.png")).unwrap();
    run(&sandbox, "build relief.png -o relief.vastex --page 64 --quiet").expect_code(0);
    let picture = |words: &str| {
        run(&sandbox, &format!("render relief.vastex {words} -o out.png")).expect_code(0);
        sandbox.read_rgb("out.png")
    };
    let whole = picture("--size 216x108");
    let upright = picture("--size 216x108 --view image:x=540,y=270,zoom=1");
    assert_eq!(whole, upright, "the first view of an image");
    let apart = |one: &[[u8; 3]], other: Vec<[u8; 3]>| {
        assert_eq!(one.len(), other.len(), "pictures of one size");
        let channels = one.as_flattened().iter().zip(other.as_flattened());
        channels.map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(u8::MAX)
    };
    // Turned by a half it is the same picture from its end, mirrored each row from its end, turned by a
    // quarter each column a row.
    let turned = picture("--size 216x108 --view image:x=540,y=270,zoom=1,turn=180");
    assert!(apart(&turned, whole.iter().rev().copied().collect()) <= 1);
    let mirrored = picture("--size 216x108 --view image:x=540,y=270,zoom=1,mirror=1");
    assert!(apart(&mirrored, whole.chunks(216).flat_map(|row| row.iter().rev().copied()).collect()) <= 1);
    let quarter = picture("--size 108x216 --view image:x=540,y=270,zoom=1,turn=90");
    let columns = (0..216).flat_map(|x| (0..108).rev().map(move |y| (x, y)));
    assert!(apart(&quarter, columns.map(|(x, y)| whole[y * 216 + x]).collect()) <= 1);
    // The scene is the view's.
    let view = "--view globe:lon=10,lat=46,alt=2000000m --size 160x90";
    let of_view = picture(view);
    assert_eq!(of_view, picture(&format!("{view} --on globe")));
    assert_ne!(of_view, picture("--on globe --size 160x90"));
    for (words, said) in [
        ("--view moon:x=1", "'moon:x=1' is no view, because of 'moon'"),
        ("--view image:x=1,y=2", "because of 'zoom'"),
        ("--view image:x=1,y=2,zoom=3 --camera-path fly", "cannot be used with"),
    ] {
        let ended = run(&sandbox, &format!("render relief.vastex {words} -o x.png")).expect_code(2);
        assert!(ended.stderr.contains(said), "{words}: {ended}");
    }
}
