//! No output is one of the inputs: every command that writes, with each of its outputs at each file that it
//! reads. The command is refused, and every file has the bytes that it had.

use std::collections::BTreeMap;
use std::path::Path;

use crate::tool::{Ended, Sandbox};

/// Bytes of every file below a directory, by path. Links are followed.
fn files(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![directory.to_owned()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => open.push(path),
                false => {
                    let name = path.strip_prefix(directory).unwrap().display().to_string();
                    found.insert(name, std::fs::read(&path).unwrap());
                }
            }
        }
    }
    found
}

/// Runs commands, of which each is refused: nothing changes, nothing is left, and the message says what to
/// do.
fn refused(sandbox: &Sandbox, commands: &[&str]) {
    refused_in(sandbox, "", commands);
}

/// The same in one of the sandbox's directories.
fn refused_in(sandbox: &Sandbox, directory: &str, commands: &[&str]) {
    let before = files(&sandbox.path(""));
    for words in commands {
        let mut command = sandbox.command(&words.split_whitespace().collect::<Vec<_>>());
        let ended = Ended::of(command.current_dir(sandbox.path(directory)));
        assert_eq!(ended.code, Some(1), "{words}: {ended}");
        let is_said = ["choose another name", "choose another place", "choose a place outside it"];
        assert!(is_said.iter().any(|said| ended.stderr.contains(said)), "{words}: {ended}");
        let after = files(&sandbox.path(""));
        let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&before), names(&after), "{words}");
        let changed = before.iter().find(|(name, bytes)| after.get(*name) != Some(bytes));
        assert!(changed.is_none(), "{words}: {:?} is written over", changed.map(|(name, _)| name));
    }
}

/// A raw image `x.raw`, a mosaic `m.txt` of two pictures, a directory of tiles `zoom`, and other things that
/// a picture is drawn by.
fn images() -> Sandbox {
    let sandbox = Sandbox::with_container();
    sandbox.write("x.raw", &[7; 16 * 8]);
    sandbox.write("x.raw.toml", b"width = 16\nheight = 8\nsample = \"u8\"\n");
    sandbox.write_png("m_0_0.png", [64, 64]);
    sandbox.write_png("m_1_0.png", [64, 64]);
    sandbox.write("m.txt", b"vastex mosaic\ngrid m_{x}_{y}.png\n");
    let export = "export image.vastex --layout deepzoom -o zoom --format png --quiet";
    sandbox.run(&export.split(' ').collect::<Vec<_>>()).expect_code(0);
    for named in ["a.path", "a.vxsets", "a.toml", "a.geojson", "index.html"] {
        sandbox.write(named, b"vastex path 1\n0 image:x=9,y=9,zoom=1\n");
    }
    sandbox
}

#[test]
fn no_picture_of_an_image_is_written_over_a_file_that_is_read() {
    let sandbox = images();
    refused(
        &sandbox,
        &[
            "render x.raw -o x.raw.toml",
            "render x.raw --stats-csv x.raw.toml",
            "render x.raw --stats-json ./x.raw.toml",
            "render x.raw --record-trace x.raw.toml",
            "render x.raw.toml -o x.raw",
            "render image.vastex --over x.raw -o x.raw.toml",
            "render image.vastex --on planet --height x.raw --stats-csv x.raw.toml",
            "render image.vastex --on planet --night x.raw -o x.raw.toml",
            "render image.vastex --on planet --clouds x.raw --record-trace x.raw",
            "render planet:8:x.raw -o x.raw.toml",
            "render m.txt -o m_0_0.png",
            "render m.txt -o m_%d_0.png --camera-path fly",
            "render m.txt --stats-json m_1_0.png",
            "render image.vastex --over m.txt --record-trace m_1_0.png",
            "render zoom -o zoom/zoom_files/9/1_0.png",
            "render zoom/zoom.dzi -o zoom/zoom_files/9/1_0.png",
            "render zoom/zoom.dzi -o zoom/zoom_files/9/new.png",
            "render zoom/zoom.dzi -o zoom/zoom_files/9/%d_0.png --camera-path fly",
            "render zoom --report zoom/zoom_files/new",
            "render image.png --report . --settings index.html",
            "render image.vastex --camera-path a.path --stats-csv a.path",
            "render image.vastex --camera-path a.path --format raw -o a.path",
            "render image.vastex --prefetch-sets a.vxsets --record-trace a.vxsets",
            "render image.vastex --settings a.toml --stats-json a.toml",
            "crop m.txt --at 0,0 --size 4x4 -o m_0_0.png",
            "crop image.png --at 0,0 --size 4x4 -o image.png",
            "crop zoom --at 0,0 --size 4x4 -o zoom/zoom_files/9/1_0.png",
            "crop zoom/zoom.dzi --at 0,0 --size 4x4 -o zoom/zoom_files/9/1_0.png",
        ],
    );
}

#[cfg(feature = "view")]
#[test]
fn no_picture_of_the_window_is_written_over_a_file_that_is_read() {
    let sandbox = images();
    // Pictures of the window have the ending of one.
    std::fs::rename(sandbox.path("a.geojson"), sandbox.path("a.png")).unwrap();
    refused(
        &sandbox,
        &[
            "view image.png --screenshot image.png",
            "view x.raw --screenshot x.raw.toml",
            "view m.txt --screenshot m_0_0.png",
            "view x.raw --over m.txt --screenshot m_1_0.png",
            "view zoom --screenshot zoom/zoom_files/9/1_0.png",
            "view zoom/zoom.dzi --screenshot zoom/zoom_files/9/1_0.png",
            "view image.vastex --shapes a.png --screenshot a.png",
            "view image.vastex --settings a.png --screenshot a.png",
        ],
    );
}

#[test]
fn nothing_is_built_over_a_file_that_is_read() {
    let sandbox = images();
    let run = |words: &str| sandbox.run(&words.split(' ').collect::<Vec<_>>()).expect_code(0);
    run("build image.png -o part.1 --shard 1/2 --page 64 --quiet");
    run("build image.png -o part.2 --shard 2/2 --page 64 --quiet");
    refused(
        &sandbox,
        &[
            "build x.raw -o x.raw",
            "build x.raw -o x.raw.toml",
            "build --layer color=x.raw -o x.raw.toml",
            "build m.txt -o m_0_0.png",
            "build m.txt -o m_0_0.png --reorder",
            "build m.txt -o m_0_0.png --resume",
            "build m.txt -o m_0_0.png --shard 1/2",
            "build image.png --mask m.txt -o m_1_0.png",
            "build image.png --inset x.raw@0,0,0 -o x.raw.toml",
            "build zoom -o zoom/zoom_files/9/1_0.png",
            "build zoom/zoom.dzi --levels keep -o zoom/zoom_files/9/1_0.png",
            "merge part.1 part.2 -o part.2",
            "learn a.vxsets -o ./a.vxsets",
        ],
    );
    // What a container is made of is no container, and no directory is made where a file is.
    let before = files(&sandbox.path(""));
    for words in ["replace x.raw --at 0,0 x.raw", "export image.vastex --layout deepzoom -o image.vastex"] {
        sandbox.run(&words.split(' ').collect::<Vec<_>>()).expect_code(1);
        assert_eq!(before, files(&sandbox.path("")), "{words}");
    }
}

#[cfg(unix)]
#[test]
fn names_that_are_links_mean_the_file_that_is_read() {
    use std::os::unix::fs::symlink;

    let sandbox = images();
    symlink("x.raw.toml", sandbox.path("link")).unwrap();
    symlink("zoom", sandbox.path("into")).unwrap();
    std::fs::hard_link(sandbox.path("x.raw.toml"), sandbox.path("hard")).unwrap();
    std::fs::hard_link(sandbox.path("m_0_0.png"), sandbox.path("hard.png")).unwrap();
    std::fs::hard_link(sandbox.path("a.vxsets"), sandbox.path("hard.vxsets")).unwrap();
    refused(
        &sandbox,
        &[
            "render x.raw -o link",
            "render x.raw -o hard",
            "render x.raw --format raw --camera-path fly -o hard",
            "render x.raw --stats-csv link",
            "render x.raw --record-trace hard",
            "render zoom -o into/zoom_files/9/1_0.png",
            "render into -o zoom/zoom_files/9/1_0.png",
            "crop m.txt --at 0,0 --size 4x4 -o hard.png",
            "build x.raw -o link",
            "build x.raw -o hard",
            "build m.txt -o hard.png",
            "build into -o zoom/zoom_files/9/1_0.png",
            "learn a.vxsets -o hard.vxsets",
        ],
    );
}

/// A raw volume `v.raw`, a pair of NIfTI `n.hdr` and `n.img`, and a Zarr `vol.zarr`.
#[cfg(feature = "volumes")]
fn volumes() -> Sandbox {
    let sandbox = Sandbox::new();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../crates/vastex-volume/fixtures");
    let fixture = |name: &str| std::fs::read(fixtures.join(name)).unwrap();
    sandbox.write("v.raw", &[7; 8 * 8 * 8]);
    sandbox.write("v.raw.toml", b"width = 8\nheight = 8\ndepth = 8\nsample = \"u8\"\n");
    sandbox.write("list.zip", &fixture("v04-center.zip"));
    // One file of NIfTI, whose values begin behind 352 bytes, as a header and its image.
    let one = fixture("one.nii");
    let mut header = one[..348].to_vec();
    header[344..347].copy_from_slice(b"ni1");
    header[108..112].copy_from_slice(&0_f32.to_le_bytes());
    sandbox.write("n.hdr", &header);
    sandbox.write("n.img", &one[352..]);
    sandbox.run(&["info", "n.hdr"]).expect_code(0);
    sandbox.run(&["build", "v.raw", "-o", "vol.zarr", "--quiet"]).expect_code(0);
    sandbox.run(&["build", "v.raw", "-o", "v.vastex", "--quiet"]).expect_code(0);
    sandbox.write("a.path", b"vastex path 1\n");
    sandbox
}

#[cfg(feature = "volumes")]
#[test]
fn nothing_is_written_over_a_volume_that_is_read() {
    let sandbox = volumes();
    refused(
        &sandbox,
        &[
            "build n.hdr -o n.img",
            "build n.hdr -o n.hdr",
            "build v.raw -o v.raw.toml",
            "build v.raw.toml -o v.raw",
            "build vol.zarr -o vol.zarr/zarr.json",
            "build vol.zarr/0 -o vol.zarr/out.vastex",
            "build list.zip -o list.zip",
            "build list.zip/1 -o list.zip",
            "build v.vastex -o v.vastex",
            "render v.raw --on volume -o v.raw.toml",
            "render v.raw --on volume --stats-csv v.raw.toml",
            "render v.raw --on slices --slice z=1 --stats-json v.raw.toml",
            "render n.hdr --on volume --record-trace n.img",
            "render n.hdr --on volume --format raw -o n.img --camera-path a.path",
            "render n.hdr --on volume -o n.img",
            "render vol.zarr --on volume -o vol.zarr/zarr.json",
            "render vol.zarr --on volume -o vol.zarr/new.png",
            "render vol.zarr/0 --on slices --slice z=1 -o vol.zarr/zarr.json",
            "render vol.zarr --on volume -o vol.zarr/0/%d --camera-path a.path",
            "render list.zip --on volume -o list.zip",
            "render v.raw --on volume --camera-path a.path --stats-csv a.path",
            "crop vol.zarr --at 0,0,0 --size 2x2x2 -o vol.zarr/new.npy",
            "crop vol.zarr/0 --at 0,0,0 --size 2x2x2 -o vol.zarr/new.npy",
        ],
    );
    // In a Zarr that one stands in.
    refused_in(
        &sandbox,
        "vol.zarr",
        &[
            "build . -o out.vastex",
            "build . -o 0/out.vastex",
            "build 0 -o out.vastex",
            "render 0 --on volume --stats-json zarr.json",
            "render . --on volume -o new.png",
        ],
    );
    refused_in(
        &sandbox,
        "vol.zarr/0",
        &[
            "render . --on volume --stats-json ../zarr.json",
            "build .. -o new.vastex",
            "crop . --at 0,0,0 --size 2x2x2 -o ../new.npy",
        ],
    );
    // Pictures and arrays have the endings of such.
    #[cfg(unix)]
    {
        let link = |to: &str, name: &str| {
            std::os::unix::fs::symlink(to, sandbox.path(name)).unwrap();
        };
        link("n.img", "n.npy");
        link("v.raw.toml", "v.png");
        std::fs::hard_link(sandbox.path("n.img"), sandbox.path("hard.vastex")).unwrap();
        refused(
            &sandbox,
            &[
                "crop n.hdr --at 0,0,0 --size 2x2x2 -o n.npy",
                "build n.hdr -o hard.vastex",
                "build v.raw -o v.png",
                "render v.raw --on volume -o v.png",
            ],
        );
        #[cfg(feature = "view")]
        refused(&sandbox, &["view v.raw --screenshot v.png", "view v.raw --screenshot v.raw.toml"]);
    }
}
