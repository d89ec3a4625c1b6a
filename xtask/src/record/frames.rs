//! Scenes, filters, formats, lists of layers and modes of feedback: which are drawn. The program draws them,
//! and volumes, in lock-step.

use std::path::Path;

use anyhow::Result;

use crate::limited::within;

use super::steps::FORMATS;
use super::{LIMIT, Program, at_once, inputs, make, volumes, write};

/// A few scenes that show that all of it works.
pub const FEW: [&str; 5] = ["plane-trilinear", "image-raw", "planet-lit", "list-over", "volume-mip"];

/// What scenes show: names of containers, and the words that build them.
const CONTAINERS: [(&str, &str); 7] = [
    ("globe", "in/globe.raw --page 64 --address wrap,clamp"),
    ("mirror", "in/u8-3.raw --page 60 --address mirror"),
    ("wrap", "in/u8-3.raw --page 60 --address wrap"),
    ("border", "in/u8-4.raw --page 60 --address border:96646E80"),
    ("sparse", "in/u8-3.raw --page 60 --mask in/mask.raw"),
    ("tiny-pages", "in/globe.raw --page 8 --border 4"),
    ("high", "--layer color=in/globe.raw --layer height=in/heights.raw --page 64 --address wrap,clamp"),
];

const FILTERS: [&str; 8] = [
    "nearest",
    "bilinear",
    "trilinear",
    "anisotropic2",
    "anisotropic4",
    "anisotropic8",
    "anisotropic16",
    "bicubic",
];

/// Draws all scenes, or those named, into `directory`/frames. `desk` is where containers are made for them.
pub fn record(program: &Program, desk: &Path, directory: &Path, only: &[&str]) -> Result<()> {
    let into = make(&directory.join("frames"))?;
    let desk = make(desk)?;
    inputs::make(&make(&desk.join("in"))?)?;
    write(&desk.join("small.toml"), "[default_pool]\nsize_mib = 0.35\n")?;
    let cases: Vec<(String, String)> =
        cases().into_iter().filter(|(name, _)| only.is_empty() || only.contains(&name.as_str())).collect();
    let is_shown = |container: &str| {
        let file = format!("{container}.vastex");
        cases.iter().any(|(_, words)| words.split([' ', ':']).any(|word| word == file))
    };
    let containers = CONTAINERS
        .iter()
        .chain(&volumes::CONTAINERS)
        .map(|(name, words)| ((*name).to_owned(), (*words).to_owned()));
    let of_format = |(format, image): &(&str, &str)| {
        ((*format).to_owned(), format!("in/{image} --page 60 --format {format} --quality fast"))
    };
    let containers = containers.chain(FORMATS.iter().map(of_format)).filter(|(name, _)| is_shown(name));
    at_once(&containers.collect::<Vec<_>>(), |(name, words)| {
        let build = format!("build {words} -o {name}.vastex --quiet");
        program.output(&desk, &build.split(' ').collect::<Vec<_>>()).map(drop)
    })?;
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(cases.len().max(1));
    let parts: Vec<usize> = (0..threads).collect();
    at_once(&parts, |part| {
        let lines = cases.iter().skip(*part).step_by(threads);
        let lines: String = lines.map(|(name, words)| format!("{name} {words}\n")).collect();
        let list = format!("cases-{part}");
        write(&desk.join(&list), lines)?;
        let mut command = program.command(&desk);
        command.args(["record", "frames"]).arg(&into).arg(&list);
        let output = within(&mut command, LIMIT)?;
        anyhow::ensure!(output.status.success(), "scenes were not drawn: {}", super::said(&output));
        Ok(())
    })?;
    Ok(std::fs::remove_dir_all(&desk)?)
}

/// Every scene: its name, and the words for `vastex render`.
fn cases() -> Vec<(String, String)> {
    let mut cases = Vec::new();
    let mut add = |name: String, words: String| {
        cases.push((name, format!("{words} --size 128x72")));
    };
    const MOVING: &str = "--camera-path fly --frames 20";
    for (scene, container) in
        [("image", "globe"), ("plane", "globe"), ("globe", "globe"), ("terrain", "high"), ("planet", "globe")]
    {
        let drawn = format!("{container}.vastex --on {scene}");
        for filter in FILTERS {
            add(format!("{scene}-{filter}"), format!("{drawn} --filter {filter} {MOVING}"));
        }
        for way in ["separate", "inline", "raw"] {
            add(format!("{scene}-{way}"), format!("{drawn} --feedback {way} {MOVING} --overlay table"));
            add(format!("{scene}-{way}-settled"), format!("{drawn} --feedback {way}"));
            let slanted =
                format!("{drawn} --feedback {way} --filter anisotropic8 --camera-path spin --frames 16");
            add(format!("{scene}-{way}-anisotropic8"), slanted);
        }
        for path in ["spin", "zoom", "teleport"] {
            add(format!("{scene}-{path}"), format!("{drawn} --camera-path {path} --frames 40"));
        }
        let small = format!("{drawn} --settings small.toml {MOVING}");
        add(format!("{scene}-small-pool"), small);
        add(format!("{scene}-fading"), format!("{drawn} --fade-ms 200 {MOVING}"));
    }
    for (format, _) in FORMATS {
        for (scene, filter) in [("plane", "trilinear"), ("image", "bicubic")] {
            let words = format!("{format}.vastex --on {scene} --filter {filter} --frames 6");
            add(format!("format-{format}-{scene}"), words);
        }
        add(format!("format-{format}-raw"), format!("{format}.vastex --on plane --feedback raw --frames 6"));
    }
    for container in ["mirror", "wrap", "border", "sparse", "tiny-pages"] {
        for scene in ["image", "plane"] {
            add(format!("{container}-{scene}"), format!("{container}.vastex --on {scene} {MOVING}"));
        }
        add(format!("{container}-raw"), format!("{container}.vastex --on plane --feedback raw --frames 10"));
    }
    for (name, more) in [
        ("stereo", "--views stereo"),
        ("mirrored", "--views mirror"),
        ("predicted", "--predict --latency-frames 4"),
        ("quadtree", "--estimate quadtree"),
        ("distance", "--estimate distance"),
        ("texture-space", "--estimate texture-space"),
        ("beside", "--estimate quadtree --beside --estimate-unseen 2"),
        ("whole", "--whole-kib 40000"),
        ("few-uploads", "--upload-kib-per-frame 32"),
    ] {
        for scene in ["plane", "globe"] {
            add(format!("{scene}-{name}"), format!("globe.vastex --on {scene} {more} {MOVING}"));
        }
    }
    add("globe-high".into(), format!("high.vastex --on globe --height-scale 0.1 {MOVING}"));
    add(
        "plane-height".into(),
        format!("high.vastex --on plane --layer-shown height --range 0.2,0.8 {MOVING}"),
    );
    for (name, words) in PLANETS {
        let far = "--view globe:lon=10,lat=30,alt=9000000m --frames 10";
        add(format!("planet-{name}"), format!("{words} --on planet {far}"));
    }
    let near = "--view globe:lon=10,lat=30,alt=300000m,heading=40,tilt=60;sun=-30,10 --frames 12";
    add("planet-near".into(), format!("high.vastex --on planet --height-scale 0.02 {near}"));
    add("planet-generated-map".into(), format!("planet:12 --on image {MOVING}"));
    for (name, words) in LISTS {
        for scene in ["image", "plane"] {
            let name = if scene == "image" { (*name).to_owned() } else { format!("{name}-{scene}") };
            add(format!("list-{name}"), format!("{words} --on {scene} --camera-path fly --frames 8"));
        }
    }
    for way in ["separate", "inline", "raw"] {
        let list = format!("{OVER} --feedback {way}");
        add(format!("list-{way}"), format!("{list} --on globe {MOVING} --overlay table"));
    }
    cases.extend(volumes::cases());
    cases
}

/// Planets: what each is lit by, and what lies over it.
const PLANETS: [(&str, &str); 8] = [
    (
        "lit",
        "high.vastex --height-layer height --height-scale 0.02 --sun -60,10 --exaggeration 4 --night wrap.vastex",
    ),
    ("unlit", "globe.vastex --sun off --atmosphere 0"),
    ("airy", "globe.vastex --sun 20,-30 --atmosphere 3"),
    ("clouds", "globe.vastex --sun -60,10 --clouds border.vastex"),
    ("height-file", "globe.vastex --sun -60,10 --height r16.vastex --height-scale 0.03"),
    ("over", "globe.vastex --sun -60,10 --over border.vastex"),
    ("generated", "planet:12 --sun -60,10"),
    ("generated-of-image", "planet:12:globe.vastex --sun -60,10"),
];

/// One texture over another, of which the upper one can be seen through.
const OVER: &str = "globe.vastex --over border.vastex --layer :gamma=0.7 --layer :file=2:opacity=0.6";

/// Lists of layers: what they show, and how they are compared.
const LISTS: &[(&str, &str)] = &[
    ("over", OVER),
    ("layers", "high.vastex --layer color --layer height:range=0.1..0.8:map=viridis:opacity=0.5"),
    ("three", "globe.vastex --over sparse.vastex --over border.vastex --layer :file=3:opacity=0.4"),
    (
        "filters",
        "globe.vastex --over wrap.vastex --layer :filter=bicubic --layer :file=2:filter=nearest:opacity=0.5",
    ),
    ("hidden", "globe.vastex --over wrap.vastex --layer :hidden --layer :file=2"),
    ("bands", "globe.vastex --layer :bands=3,1,2 --layer :bands=2:map=magma:opacity=0.5"),
    ("nodata", "r16.vastex --layer :map=terrain:nodata=0:nodata-color=ff00ff"),
    (
        "curves",
        "r16f.vastex --over r32f.vastex --layer :range=-1..3:curve=aces:exposure=-1 --layer :file=2:range=-1..3:log:opacity=0.5",
    ),
    ("palette", "r8.vastex --layer :map=coolwarm_r:range=0.2..0.9"),
    ("swipe", "globe.vastex --over mirror.vastex --compare-mode swipe:0.4"),
    ("flicker", "globe.vastex --over mirror.vastex --compare-mode flicker:0.1"),
    ("difference", "globe.vastex --over mirror.vastex --compare-mode difference:6"),
    ("beside", "globe.vastex --over mirror.vastex --compare-mode beside"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_has_a_name_of_its_own_and_the_few_are_among_them() {
        let cases = cases();
        let mut names: Vec<&String> = cases.iter().map(|(name, _)| name).collect();
        let all = names.len();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), all);
        assert!(FEW.iter().all(|few| names.iter().any(|name| name == few)));
    }
}
