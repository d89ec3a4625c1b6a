//! Directories that are broken, lie or are something else: an error that names the place, never a panic.

use std::fs;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

use png::BitDepth::{Eight, Sixteen};
use png::ColorType::{Grayscale, Rgb};
use vastex_build::{BuildOptions, ExportOptions, Layout, TileFormat, build};

use crate::common::{texels, write_png};
use crate::directories::pictures::Sandbox;

/// A sandbox with every layout, exported: `earth`, `zoom` and `pages`.
fn exported() -> Sandbox {
    let sandbox = Sandbox::new();
    let container = sandbox.rgb([256, 128]);
    for (layout, name) in
        [(Layout::GaiaSky, "earth"), (Layout::DeepZoom, "zoom"), (Layout::Prototype, "proto")]
    {
        let options = ExportOptions { format: Some(TileFormat::Png), ..ExportOptions::new(layout) };
        let tile_size = (layout != Layout::Prototype).then_some(64);
        sandbox.export(&container, name, &ExportOptions { tile_size, ..options });
    }
    sandbox
}

fn built(sandbox: &Sandbox, input: &str) -> Result<(), String> {
    let output = sandbox.path("out.vastex");
    build(&[sandbox.path(input)], &output, &BuildOptions::default(), &())
        .map(drop)
        .map_err(|error| error.to_string())
}

/// Breaks a copy of the exported directories and builds `input`; the error must say all of `says`.
#[track_caller]
fn check(input: &str, says: &[&str], spoil: impl Fn(&dyn Fn(&str) -> PathBuf)) {
    let sandbox = exported();
    spoil(&|name| sandbox.path(name));
    let error = built(&sandbox, input).unwrap_err();
    assert!(says.iter().all(|part| error.contains(part)), "{error}\nlacks one of {says:?}");
    assert!(!sandbox.path("out.vastex").exists());
}

fn rewrite(path: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(path).unwrap();
    assert!(text.contains(from), "{text}");
    fs::write(path, text.replace(from, to)).unwrap();
}

#[test]
fn what_is_no_tile_directory_is_refused() {
    check("void", &["void: no tile layout recognised in this directory"], |at| {
        fs::create_dir(at("void")).unwrap();
    });
    check("deep", &["no tile layout recognised"], |at| fs::create_dir_all(at("deep/level0")).unwrap());
    check("notes.dzi", &["notes.dzi: is a text file"], |at| {
        fs::write(at("notes.dzi"), "dear reader").unwrap();
    });
    check("zoom/zoom_files", &["no tile layout recognised", ".dzi"], |at| {
        fs::create_dir(at("zoom/zoom_files/15")).unwrap();
    });
    check("earth", &["Deep Zoom", "Gaia Sky"], |at| {
        fs::copy(at("zoom/zoom.dzi"), at("earth/zoom.dzi")).unwrap();
    });
    check("zoom", &["2 Deep Zoom images", "name one"], |at| {
        fs::copy(at("zoom/zoom.dzi"), at("zoom/again.dzi")).unwrap();
    });
}

#[test]
fn planets_must_have_roots_and_tiles_of_one_size() {
    check("earth", &["lacks the root tile of column 1, row 0"], |at| {
        fs::remove_file(at("earth/level0/tx_1_0.png")).unwrap();
    });
    check("earth", &["has no level 0"], |at| fs::remove_dir_all(at("earth/level0")).unwrap());
    check("earth/earth.ctx", &["has no level 0"], |at| fs::remove_dir_all(at("earth/level0")).unwrap());
    check("earth", &["level1/tx_2_1.png", "has 32x64 texels where 64x64 are expected"], |at| {
        write_png(&at("earth/level1/tx_2_1.png"), [32, 64], Rgb, Eight, &texels(32 * 64 * 3, 1));
    });
    check("earth", &["level0/tx_0_0.png", "has 60x60 texels", "a power of two"], |at| {
        write_png(&at("earth/level0/tx_0_0.png"), [60, 60], Rgb, Eight, &texels(60 * 60 * 3, 1));
    });
    check("earth", &["level1", "16-bit grey", "one kind"], |at| {
        write_png(&at("earth/level1/tx_2_1.png"), [64, 64], Grayscale, Sixteen, &texels(64 * 64 * 2, 1));
    });
    check("earth", &["tx_4_0.png", "outside its level's grid of 4x2"], |at| {
        fs::copy(at("earth/level1/tx_0_0.png"), at("earth/level1/tx_4_0.png")).unwrap();
    });
    check("earth", &["two tiles for column 0, row 0 of level 1"], |at| {
        fs::copy(at("earth/level1/tx_0_0.png"), at("earth/level1/tx_0-0.png")).unwrap();
    });
    check("earth", &["two directories for level 1"], |at| fs::create_dir(at("earth/level01")).unwrap());
    check("earth", &["level15", "levels are numbered 0 to 14"], |at| {
        fs::create_dir(at("earth/level15")).unwrap();
    });
}

#[test]
fn broken_tiles_are_named() {
    for (input, tile) in
        [("earth", "level1/tx_3_0.png"), ("zoom", "zoom_files/8/1_0.png"), ("proto", "pages/0_0_0.png")]
    {
        let name = format!("{input}/{tile}");
        check(input, &[tile, "truncated"], |at| {
            let bytes = fs::read(at(&name)).unwrap();
            fs::write(at(&name), &bytes[..bytes.len() / 2]).unwrap();
        });
        check(input, &[tile, "is empty"], |at| fs::write(at(&name), "").unwrap());
        check(input, &[tile, "is a text file"], |at| {
            fs::write(at(&name), "<Image TileSize=\"1\"/>").unwrap();
        });
    }
    check("earth", &["level1/tx_3_0.png", "this directory"], |at| {
        fs::remove_file(at("earth/level1/tx_3_0.png")).unwrap();
        fs::create_dir(at("earth/level1/tx_3_0.png")).unwrap();
    });
    check("zoom", &["8/2_1.png", "there is no such file"], |at| {
        fs::remove_file(at("zoom/zoom_files/8/2_1.png")).unwrap();
    });
    check("proto", &["has no page of the finest level"], |at| {
        fs::rename(at("proto/pages/0_0_0.png"), at("proto/pages/1_0_0.png")).unwrap();
    });
    check("proto", &["has 2 of the 3x1 pages"], |at| {
        fs::copy(at("proto/pages/0_0_0.png"), at("proto/pages/0_2_0.png")).unwrap();
    });
}

#[cfg(unix)]
#[test]
fn pipes_are_refused_and_never_waited_for() {
    let pipe = |path: &Path| {
        fs::remove_file(path).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(path).status().unwrap().success());
    };
    for (input, file) in [
        ("zoom", "zoom/zoom.dzi"),
        ("earth/earth.ctx", "earth/earth.ctx"),
        ("proto", "proto/size.txt"),
        ("proto", "proto/pages/0_0_0.png"),
        ("zoom/zoom.dzi", "zoom/zoom_files/8/2_1.png"),
        ("zoom/zoom.dzi", "zoom/zoom_files/8/0_0.png"),
        ("earth", "earth/level0/tx_0_0.png"),
        ("earth", "earth/level1/tx_2_1.png"),
    ] {
        check(input, &[file, "is a device or a pipe"], |at| pipe(&at(file)));
    }
    let sandbox = exported();
    pipe(&sandbox.path("earth/earth.ctx"));
    fs::remove_dir_all(sandbox.path("earth/level0")).unwrap();
    fs::remove_dir_all(sandbox.path("earth/level1")).unwrap();
    let error = built(&sandbox, "earth").unwrap_err();
    assert!(error.contains("earth.ctx: is a device or a pipe"), "{error}");
}

#[test]
fn numbers_too_large_for_any_grid_are_not_passed_over() {
    for (input, name) in [
        ("earth", "earth/level1/tx_99999999999_0.png"),
        ("earth/earth.ctx", "earth/level1/tx_0_99999999999.png"),
    ] {
        check(input, &[&name[6..], "outside its level's grid"], |at| {
            fs::copy(at("earth/level1/tx_0_0.png"), at(name)).unwrap();
        });
    }
    check("proto", &["0_99999999999_0.png", "beyond 2^31"], |at| {
        fs::copy(at("proto/pages/0_0_0.png"), at("proto/pages/0_99999999999_0.png")).unwrap();
    });
    let sandbox = exported();
    for name in ["level123456", "level99999999999", "level00001"] {
        fs::create_dir(sandbox.path("earth").join(name)).unwrap();
    }
    for input in ["earth", "earth/earth.ctx"] {
        let output = sandbox.path("out.vastex");
        let report = build(&[sandbox.path(input)], &output, &BuildOptions::default(), &()).unwrap();
        let notices: Vec<_> = report.notices().map(ToString::to_string).collect();
        let ignored = |name: &str| notices.iter().any(|notice| notice.contains(name));
        assert!(
            ignored("level123456") && ignored("level99999999999") && ignored("level00001"),
            "{notices:?}"
        );
    }
}

#[test]
fn a_size_is_read_in_part_and_shown_without_control_characters() {
    let sandbox = exported();
    for text in [vec![0; 2000], b"\x1b[31mred".repeat(1000), vec![b'9'; 1 << 20]] {
        fs::write(sandbox.path("proto/size.txt"), text).unwrap();
        let error = built(&sandbox, "proto").unwrap_err();
        assert!(error.contains("correct it") && !error.contains(char::is_control), "{error:?}");
        assert!(error.len() < 1000, "{} bytes", error.len());
    }
}

#[test]
fn nothing_is_written_among_the_tiles_of_the_input() {
    let sandbox = exported();
    let list_of = |sandbox: &Sandbox| {
        let mut files = Vec::new();
        list(&sandbox.path("."), &mut files);
        files.into_iter().map(|path| fs::read(&path).map(|bytes| (path, bytes)).unwrap()).collect::<Vec<_>>()
    };
    fs::create_dir(sandbox.path("elsewhere")).unwrap();
    let before = list_of(&sandbox);
    for (input, output) in [
        ("earth", "earth/level1/tx_2_1.png"),
        ("earth", "earth/new.vastex"),
        ("earth", "elsewhere/../earth/level0/new"),
        ("earth/earth.ctx", "earth/level1/tx_2_1.png"),
        ("zoom", "zoom/zoom.dzi"),
        ("zoom/zoom.dzi", "zoom/zoom.dzi"),
        ("zoom/zoom.dzi", "zoom/zoom_files/8/0_0.png"),
        ("proto", "proto/pages/0_0_0.png"),
        ("proto/pages", "proto/pages/1.vastex"),
    ] {
        let options = BuildOptions::default();
        let error =
            build(&[sandbox.path(input)], &sandbox.path(output), &options, &()).unwrap_err().to_string();
        assert!(error.contains("choose"), "{error}");
        assert!(list_of(&sandbox) == before, "{output}");
    }
    build(&[sandbox.path("zoom/zoom.dzi")], &sandbox.path("zoom/zoom.vastex"), &BuildOptions::default(), &())
        .unwrap();
}

#[test]
fn descriptions_that_lie_are_refused() {
    let dzi = "zoom/zoom.dzi";
    check(dzi, &["finest level", "zoom_files/20"], |at| {
        rewrite(&at(dzi), "Width=\"256\" Height=\"128\"", "Width=\"1000000\" Height=\"1000000\"");
    });
    check(dzi, &["zoom_files/8/3_3.png", "there is no such file"], |at| {
        rewrite(&at(dzi), "Height=\"128\"", "Height=\"250\"");
    });
    check(dzi, &["0_0.png", "has 65x65 texels where"], |at| {
        rewrite(&at(dzi), "TileSize=\"64\"", "TileSize=\"65\"");
    });
    check(dzi, &["tiles of 0 texels"], |at| rewrite(&at(dzi), "TileSize=\"64\"", "TileSize=\"0\""));
    check(dzi, &["zoom_files/8/0_0.jpg"], |at| rewrite(&at(dzi), "Format=\"png\"", "Format=\"jpg\""));
    check("earth/earth.ctx", &["tiles of type 'dds'", "TileType"], |at| {
        rewrite(&at("earth/earth.ctx"), "\"png\"", "\"dds\"");
    });
    check("earth/earth.ctx", &["BaseSplit '17'", "0 to 8"], |at| {
        rewrite(&at("earth/earth.ctx"), "BaseSplit 0", "BaseSplit 17");
    });
    check("earth/earth.ctx", &["lacks the root tile of column 0, row 1"], |at| {
        rewrite(&at("earth/earth.ctx"), "BaseSplit 0", "BaseSplit 1");
    });
    check("earth/earth.ctx", &["has no level 0"], |at| {
        rewrite(&at("earth/earth.ctx"), "\".\"", "\"nowhere\"");
    });
    for size in ["0x0", "513x128", "99999999999999999999x1", "", "256", "-1x5", "256x128x1"] {
        check("proto", &["size.txt", "correct it"], |at| fs::write(at("proto/size.txt"), size).unwrap());
    }
}

#[test]
fn a_seeded_sample_of_spoilt_directories_never_panics() {
    let mut state = 0x2545_f491u32;
    let mut random = move |below: usize| {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state as usize % below
    };
    let (mut refused, mut taken) = (0, 0);
    for _ in 0..6 {
        let sandbox = exported();
        for _ in 0..20 {
            let input = ["earth", "earth/earth.ctx", "zoom", "proto"][random(4)];
            let directory = input.split('/').next().unwrap();
            let mut files = Vec::new();
            list(&sandbox.path(directory), &mut files);
            if files.is_empty() {
                break;
            }
            spoil(&files, &mut random);
            match catch_unwind(|| built(&sandbox, input)).expect("a panic") {
                Ok(()) => taken += 1,
                Err(message) => {
                    refused += 1;
                    assert!(message.contains(directory) && message.len() > 20, "{message}");
                }
            }
        }
    }
    assert!(refused > 10 && taken > 10, "{refused} refused, {taken} taken: the sample shows little");
}

fn list(directory: &Path, files: &mut Vec<PathBuf>) {
    let mut entries: Vec<_> = fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() { list(&path, files) } else { files.push(path) }
    }
}

/// Changes one of the files in one of a few ways.
fn spoil(files: &[PathBuf], random: &mut impl FnMut(usize) -> usize) {
    let path = &files[random(files.len())];
    let mut bytes = fs::read(path).unwrap();
    match random(6) {
        0 => fs::remove_file(path).unwrap(),
        1 => fs::write(path, &bytes[..random(bytes.len() + 1)]).unwrap(),
        2 if !bytes.is_empty() => {
            let at = random(bytes.len());
            bytes[at] ^= 1 << random(8);
            fs::write(path, bytes).unwrap();
        }
        3 => {
            fs::copy(&files[random(files.len())], path).unwrap();
        }
        4 => {
            let names = ["tx_9_9.png", "level055", "tx_0_0.jpg", "0_99_0.png", "size.txt", "b.dzi", "x.ctx"];
            fs::rename(path, path.with_file_name(names[random(names.len())])).unwrap();
        }
        _ => {
            fs::write(path, "VirtualTexture { ImageDirectory \"..\" BaseSplit 3 TileType \"png\" }").unwrap();
        }
    }
}
