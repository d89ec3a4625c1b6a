//! What is made of the inputs: names, and the words that the program is given, one command after the other.
//!
//! `%` stands for the directory of inputs. `short N COMMAND` may write files of N blocks of 512 bytes at most
//! and fails there; `state NAME` takes down what lies there at that moment. What lies there at the end is
//! taken down in any case.

use super::inputs::{KINDS, name};
use super::volumes;

/// A directory in which commands run.
pub(super) struct Step {
    pub(super) name: String,
    pub(super) commands: Vec<String>,
}

/// A few steps that show that all of it works.
pub const FEW: [&str; 4] = ["plain-u8-3-page-60-1-none", "parts", "resumed", "volume"];

const BUILD: &str = "build % -o out.vastex";

/// All steps but those of the small sound files.
pub(super) fn all() -> Vec<Step> {
    let mut steps = Vec::new();
    let mut add = |name: String, commands: &[&str]| {
        let commands = commands.iter().map(|command| (*command).to_owned()).collect();
        steps.push(Step { name, commands });
    };
    for (sample, channels) in KINDS {
        let image = format!("%/{}", name(sample, channels));
        let build = |more: &str| format!("build {image} -o out.vastex {more}");
        for (page, border) in [(128, 4), (60, 1), (256, 8)] {
            for compress in ["none", "lz4", "zstd"] {
                let more = format!("--page {page} --border {border} --compress {compress}");
                add(format!("plain-{sample}-{channels}-page-{page}-{border}-{compress}"), &[&build(&more)]);
            }
        }
        for edges in ["wrap", "mirror", "border:96646E80", "wrap,clamp"] {
            let said = edges.replace([':', ','], "-");
            add(
                format!("edges-{sample}-{channels}-{said}"),
                &[&build(&format!("--page 60 --address {edges}"))],
            );
        }
        for filter in FILTERS {
            add(format!("filter-{sample}-{channels}-{filter}"), &[&build(&format!("--filter {filter}"))]);
        }
        for from in ["two", "zero"] {
            let more = format!("--page 60 --levels-from {from}");
            add(format!("levels-from-{sample}-{channels}-{from}"), &[&build(&more)]);
        }
        add(format!("linear-off-{sample}-{channels}"), &[&build("--linear off")]);
        let one = build("--page 60 --threads 1 --memory-mib 400");
        add(format!("one-thread-{sample}-{channels}"), &[&one]);
    }
    for (format, image) in FORMATS {
        for quality in ["fast", "normal"] {
            let build =
                format!("build %/{image} -o out.vastex --page 60 --format {format} --quality {quality}");
            add(format!("format-{format}-{quality}"), &[&build]);
        }
    }
    for format in ["bc1", "bc7-srgb"] {
        let build = format!("build %/patch4.raw -o out.vastex --page 60 --format {format} --quality best");
        add(format!("format-{format}-best"), &[&build]);
    }
    for (name, commands) in ONES.iter().chain(volumes::STEPS) {
        add((*name).to_owned(), commands);
    }
    for (layout, more) in LAYOUTS {
        let export = format!("export a.vastex --layout {layout} -o tree {more}");
        let built = "build %/u8-3.raw -o a.vastex --page 64";
        let said = format!("{layout}{}", more.replace("--", "-").replace(' ', ""));
        add(format!("export-{said}"), &[built, &export, "build tree -o again.vastex --page 100"]);
    }
    for (sample, channels) in KINDS {
        let built = format!("build %/{} -o a.vastex --page 64", name(sample, channels));
        let exports =
            ["deepzoom", "gaiasky"].map(|layout| format!("export a.vastex --layout {layout} -o {layout}"));
        add(format!("export-of-{sample}-{channels}"), &[&built, &exports[0], &exports[1]]);
    }
    steps
}

/// A build of each small sound file.
pub(super) fn of_seeds(inputs: &[String]) -> Vec<Step> {
    let step = |input: &String| {
        let build = BUILD.replace('%', &format!("%/{input}"));
        Step {
            name: format!("input-{}", input.replace('/', "-")),
            commands: vec![format!("{build} --page 8 --border 1 --tolerant")],
        }
    };
    inputs.iter().map(step).collect()
}

const FILTERS: [&str; 17] = [
    "box",
    "box-linear",
    "box-normal",
    "gauss4",
    "gauss3-linear",
    "sharpen4",
    "sharpen5",
    "kaiser",
    "kaiser-linear",
    "lanczos",
    "lanczos-linear",
    "min",
    "max",
    "majority",
    "nearest",
    "gauss3",
    "sharpen5-linear",
];

/// Every format of layers, with an image for it.
pub(super) const FORMATS: [(&str, &str); 18] = [
    ("r8", "u8-1.raw"),
    ("rg8", "u8-2.raw"),
    ("rgba8", "u8-4.raw"),
    ("rgba8-srgb", "u8-3.raw"),
    ("r16", "u16-1.raw"),
    ("rgba16", "u16-3.raw"),
    ("r16f", "f32-1.raw"),
    ("rgba16f", "f32-3.raw"),
    ("r32f", "f32-1.raw"),
    ("bc1", "u8-3.raw"),
    ("bc1-srgb", "u8-3.raw"),
    ("bc3", "u8-4.raw"),
    ("bc3-srgb", "u8-4.raw"),
    ("bc4", "u8-1.raw"),
    ("bc5", "u8-2.raw"),
    ("bc6h", "f32-3.raw"),
    ("bc7", "u8-4.raw"),
    ("bc7-srgb", "u8-4.raw"),
];

const LAYOUTS: [(&str, &str); 8] = [
    ("gaiasky", ""),
    ("gaiasky", "--format png --tile-size 64 --overlap 1"),
    ("celestia", "--tile-size 128"),
    ("celestia", "--tile-size 128 --format png"),
    ("deepzoom", ""),
    ("deepzoom", "--format png --tile-size 100 --overlap 3"),
    ("deepzoom", "--quality 60"),
    ("prototype", ""),
];

/// What is done once.
const ONES: &[(&str, &[&str])] = &[
    (
        "layers",
        &["build -o out.vastex --layer color=%/u8-3.raw --layer height=%/u16-1.raw --layer mask=%/u8-1.raw"],
    ),
    (
        "layers-in-blocks",
        &[
            "build -o out.vastex --page 60 --layer color=%/u8-4.raw:bc7-srgb --layer normal=%/u8-2.raw:bc5 --layer height=%/half.raw:r16:max",
        ],
    ),
    ("mask", &["build %/u8-3.raw -o out.vastex --page 60 --mask %/mask.raw"]),
    ("drop-transparent", &["build %/u8-4.raw -o out.vastex --page 16 --border 1 --drop-transparent"]),
    ("align", &["build %/u8-3.raw -o out.vastex --page 60 --align 4K"]),
    ("reorder", &["build %/u8-3.raw -o out.vastex --page 60 --reorder"]),
    (
        "parts",
        &[
            "build %/u8-3.raw -o 1.part --page 60 --shard 1/3",
            "build %/u8-3.raw -o 2.part --page 60 --shard 2/3",
            "build %/u8-3.raw -o 3.part --page 60 --shard 3/3",
            "merge 2.part 3.part 1.part -o out.vastex",
        ],
    ),
    (
        "parts-in-blocks",
        &[
            "build %/u8-4.raw -o 1.part --page 60 --format bc3 --address wrap --shard 1/2",
            "build %/u8-4.raw -o 2.part --page 60 --format bc3 --address wrap --shard 2/2",
            "merge 1.part 2.part -o out.vastex",
        ],
    ),
    (
        "replace",
        &[
            "build %/u8-3.raw -o out.vastex --page 60",
            "replace out.vastex --at 311,77 %/patch.raw",
            "state once",
            "replace out.vastex --at 0,350 %/patch.raw",
        ],
    ),
    (
        "replace-wrapped",
        &[
            "build %/u8-3.raw -o out.vastex --page 60 --address wrap",
            "replace out.vastex --at 540,400 %/patch.raw",
        ],
    ),
    (
        "replace-in-blocks",
        &[
            "build %/u8-4.raw -o out.vastex --page 60 --format bc7-srgb --quality fast",
            "replace out.vastex --at 101,55 %/patch4.raw --quality fast",
        ],
    ),
    (
        "replace-layers",
        &[
            "build -o out.vastex --page 60 --layer color=%/u8-3.raw:bc1-srgb --layer height=%/half.raw:r16:max",
            "replace out.vastex --at 100,50 --layer color=%/patch.raw --layer height=%/patch16.raw",
        ],
    ),
    (
        "replace-sparse",
        &[
            "build %/u8-3.raw -o out.vastex --page 60 --mask %/mask.raw",
            "replace out.vastex --at 200,100 %/patch.raw",
        ],
    ),
    ("inset", &["build %/u8-3.raw -o out.vastex --page 60 --inset %/patch.raw@150,100,0"]),
    (
        "insets-finer",
        &[
            "build %/u8-3.raw -o out.vastex --page 60 --inset %/patch.raw@1200,900,2 --inset %/patch.raw@700,300,1",
        ],
    ),
    (
        "insets-in-blocks",
        &[
            "build %/u8-4.raw -o out.vastex --page 60 --format bc7-srgb --quality fast --inset %/patch4.raw@1200,900,2",
        ],
    ),
    (
        "insets-of-layers",
        &[
            "build -o out.vastex --page 60 --layer color=%/u8-3.raw --layer height=%/u16-1.raw --inset color=%/patch.raw@200,100,1",
        ],
    ),
    (
        "resumed",
        &[
            "short 600 build %/u8-3.raw -o out.vastex --page 60 --compress none --threads 1 --resume",
            "state interrupted",
            "build %/u8-3.raw -o out.vastex --page 60 --compress none --threads 2 --resume",
        ],
    ),
    (
        "resumed-in-blocks",
        &[
            "short 200 build %/u8-4.raw -o out.vastex --page 60 --format bc3 --threads 1 --resume",
            "state interrupted",
            "build %/u8-4.raw -o out.vastex --page 60 --format bc3 --resume",
        ],
    ),
    (
        "resumed-insets",
        &[
            "short 600 build %/u8-3.raw -o out.vastex --page 60 --compress none --threads 1 --resume --inset %/patch.raw@1200,900,2",
            "state interrupted",
            "build %/u8-3.raw -o out.vastex --page 60 --compress none --resume --inset %/patch.raw@1200,900,2",
        ],
    ),
    (
        "export-part",
        &[
            "build %/tiles.raw -o a.vastex --page 64",
            "export a.vastex --layout gaiasky -o tree --tile-size 64 --finest-level 4 --first-column 3 --first-row 2",
        ],
    ),
    ("earth", &["build %/earth.jpg -o out.vastex --address wrap,clamp"]),
    ("elevation", &["build %/elevation.png -o out.vastex --address wrap,clamp --filter max"]),
    ("refused", &["build %/u8-3.raw -o out.vastex --page 60 --border 40"]),
    ("refused-parts", &["build %/u8-3.raw -o 1.part --page 60 --shard 1/3", "merge 1.part -o out.vastex"]),
];
