//! What is refused, damaged or interrupted, and what is left behind: nothing.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::path::Path;

use vastex_build::{
    ContainerOptions, Progress, VolumeBuildError, VolumeOptions, ZarrCodec, ZarrOptions, ZarrVersion,
    build_volume,
};
use vastex_volume::{DType, Reduction};

use super::{Raw, container, opened, whole, zarr};

fn names(directory: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(directory).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn small() -> VolumeOptions {
    zarr(ZarrOptions { chunk: [16; 3], codec: ZarrCodec::Zstd(1), ..ZarrOptions::default() })
}

fn refusal(input: &Path, output: &Path, options: &VolumeOptions) -> String {
    build_volume(input, output, options, &()).unwrap_err().to_string()
}

#[test]
fn what_is_read_is_never_written_over() {
    let raw = Raw::new(DType::U8, [20; 3], 1, 1);
    raw.build("in.zarr", &small());
    let input = raw.out("in.zarr");
    for (from, to) in [
        (input.clone(), input.clone()),
        (input.clone(), input.join("out.zarr")),
        (input.clone(), raw.dir.path().to_owned()),
        (input.clone(), input.join("0/out.vastex")),
        (raw.path(), raw.path()),
        (raw.path(), raw.out("in.raw.toml")),
        (raw.out("in.raw.toml"), raw.path()),
    ] {
        let error = refusal(&from, &to, &small());
        assert!(error.contains("is read; choose another place"), "{error}");
    }
    assert_eq!(names(raw.dir.path()), ["in.raw", "in.raw.toml", "in.zarr"]);
    assert!(whole(&opened(&input), 0, 0, 0) == raw.values);
}

#[test]
fn only_what_was_made_here_makes_way() {
    let raw = Raw::new(DType::U8, [20; 3], 1, 1);
    let out = raw.out("out.zarr");
    std::fs::create_dir(&out).unwrap();
    raw.build("out.zarr", &small());
    for version in [ZarrVersion::V04, ZarrVersion::V05, ZarrVersion::V04] {
        let options = zarr(ZarrOptions { version, ..ZarrOptions::default() });
        let (_, volume) = raw.build("out.zarr", &options);
        assert_eq!(volume.about().version.as_deref(), Some(version.name()));
    }
    std::fs::write(out.join(".zattrs"), "{\"multiscales\": [{\"metadata\": {\"method\": \"another\"}}]}")
        .unwrap();
    let error = refusal(&raw.path(), &out, &small());
    assert!(error.contains("out.zarr") && error.contains("is not empty"), "{error}");
    let file = raw.out("file.zarr");
    std::fs::write(&file, b"a file").unwrap();
    let error = refusal(&raw.path(), &file, &small());
    assert!(error.contains("there is a file of this name"), "{error}");
    let error = refusal(&raw.path(), &raw.out("no/out.zarr"), &small());
    assert!(error.contains("no/out.zarr") || error.contains("directory does not exist"), "{error}");
    assert_eq!(names(raw.dir.path()), ["file.zarr", "in.raw", "in.raw.toml", "out.zarr"]);
}

#[test]
fn options_that_do_not_go_together_are_named() {
    let raw = Raw::new(DType::U8, [100; 3], 1, 1);
    let out = raw.out("out.zarr");
    let with = |options: ZarrOptions| refusal(&raw.path(), &out, &zarr(options));
    let error = with(ZarrOptions { version: ZarrVersion::V04, shards: 2, ..ZarrOptions::default() });
    assert!(error.contains("0.4 has no shards"), "{error}");
    let huge = VolumeOptions { memory_limit: 1 << 10, ..small() };
    let error = refusal(&raw.path(), &out, &huge);
    assert!(error.contains("--memory-mib"), "{error}");
    // Metadata that lie: neither output is begun.
    raw.build("lying.zarr", &small());
    let lying = raw.out("lying.zarr");
    let file = lying.join("0/zarr.json");
    let said = std::fs::read_to_string(&file).unwrap().replace("100", "2000000000");
    std::fs::write(&file, said).unwrap();
    let error = refusal(&lying, &out, &small());
    assert!(error.contains("would have") && error.contains("lying.zarr"), "{error}");
    let error = refusal(&lying, &raw.out("out.vastex"), &container(ContainerOptions::default()));
    assert!(error.contains("lying.zarr") || error.contains("at most 2147483648 are allowed"), "{error}");
    assert_eq!(names(raw.dir.path()), ["in.raw", "in.raw.toml", "lying.zarr"]);
    let dir = tempfile::tempdir().unwrap();
    let labels =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../vastex-volume/fixtures/v04-center.zip/labels/cells");
    let mean = VolumeOptions { downsample: Some(Reduction::Mean), ..small() };
    let error = refusal(&labels, &dir.path().join("out.zarr"), &mean);
    assert!(error.contains("--downsample majority"), "{error}");
    let plate = Path::new(env!("CARGO_MANIFEST_DIR")).join("../vastex-volume/fixtures/plate.zip");
    let error = refusal(&plate, &dir.path().join("out.zarr"), &small());
    assert!(error.contains("a plate") && error.contains("A/1/0"), "{error}");
    assert_eq!(names(dir.path()), Vec::<String>::new());
}

#[test]
fn damage_is_named_or_filled() {
    let raw = Raw::new(DType::U8, [40, 40, 40], 1, 1);
    raw.build("in.zarr", &small());
    let input = raw.out("in.zarr");
    let chunk = input.join("0/c/1/0/2");
    std::fs::write(&chunk, b"damaged").unwrap();
    for (options, name) in [(small(), "out.zarr"), (container(ContainerOptions::default()), "out.vastex")] {
        let out = raw.out(name);
        let error = refusal(&input, &out, &options);
        assert!(error.contains("0/c/1/0/2"), "{error}");
        assert!(!out.exists());
        let tolerant = VolumeOptions { tolerant: true, ..options };
        let report = build_volume(&input, &out, &tolerant, &()).unwrap();
        assert!(report.notes.len() == 1 && report.notes[0].contains("0/c/1/0/2"), "{:?}", report.notes);
        let (found, mut expected) = (whole(&opened(&out), 0, 0, 0), raw.values.clone());
        for z in 16..32 {
            for y in 0..16 {
                expected[(z * 40 + y) * 40 + 32..][..8].fill(0);
            }
        }
        assert!(found == expected, "{name}");
    }
    assert_eq!(names(raw.dir.path()), ["in.raw", "in.raw.toml", "in.zarr", "out.vastex", "out.zarr"]);
}

/// Stops after so many calls.
struct Stop(Cell<u32>);

impl Progress for Stop {
    fn advance(&self, done: u64, total: u64, _: u64) -> ControlFlow<()> {
        assert!(done <= total);
        self.0.set(self.0.get().saturating_sub(1));
        if self.0.get() == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[test]
fn what_is_interrupted_leaves_nothing() {
    let raw = Raw::new(DType::U16, [100, 70, 50], 1, 1);
    for calls in 1..4 {
        for (options, name) in [
            (small(), "out.zarr"),
            (container(ContainerOptions { page: 16, ..ContainerOptions::default() }), "out.vastex"),
        ] {
            let options = VolumeOptions { memory_limit: 200 << 10, ..options };
            let stopped = build_volume(&raw.path(), &raw.out(name), &options, &Stop(Cell::new(calls)));
            assert!(matches!(stopped, Err(VolumeBuildError::Cancelled)), "{name}");
            assert_eq!(names(raw.dir.path()), ["in.raw", "in.raw.toml"]);
        }
    }
}

#[test]
fn nothing_is_built_of_a_volume_without_its_finest_level() {
    let raw = Raw::new(DType::U8, [40; 3], 1, 1);
    raw.build("in.zarr", &small());
    let file = raw.out("in.zarr/0/zarr.json");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("\"zstd\"", "\"numcodecs.delta\"")).unwrap();
    for (output, options) in [("out.zarr", small()), ("out.vastex", container(ContainerOptions::default()))] {
        let error = refusal(&raw.out("in.zarr"), &raw.out(output), &options);
        assert!(error.contains("0/zarr.json") && error.contains("numcodecs.delta"), "{error}");
    }
    assert_eq!(names(raw.dir.path()), ["in.raw", "in.raw.toml", "in.zarr"]);
    // A coarser one is no matter.
    std::fs::write(&file, text).unwrap();
    let file = raw.out("in.zarr/1/zarr.json");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("\"zstd\"", "\"numcodecs.delta\"")).unwrap();
    build_volume(&raw.out("in.zarr"), &raw.out("out.zarr"), &small(), &()).unwrap();
    assert!(whole(&opened(&raw.out("out.zarr")), 0, 0, 0) == raw.values);
}
