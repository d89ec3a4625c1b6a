//! What commands say of themselves, and the keys of what they print for scripts.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::{Context, Result};

use super::json::leaves;
use super::{Program, inputs, make, write};

/// Writes `help.txt`, in which `own` is the help of this program, and `json.txt`.
pub fn record(program: &Program, own: &str, desk: &Path, directory: &Path) -> Result<()> {
    let mut text = format!("== cargo xtask ==\n{own}");
    tell(program, &[], &mut text)?;
    // Of volumes `render` takes other words, which are no command of their own there.
    tell(program, &["render", "--on", "volume"], &mut text)?;
    write(&directory.join("help.txt"), text)?;
    let desk = make(desk)?;
    inputs::make(&make(&desk.join("in"))?)?;
    let mut keys = String::new();
    for (name, words) in JSON {
        let words: Vec<&str> = words.split(' ').collect();
        let printed = program.output(&desk, &words)?;
        let printed = match words.iter().position(|word| *word == "--stats-json") {
            Some(at) => std::fs::read(desk.join(words[at + 1]))?,
            None => printed,
        };
        let printed = leaves(&String::from_utf8_lossy(&printed)).with_context(|| (*name).to_owned())?;
        let lines: BTreeSet<String> =
            printed.iter().map(|leaf| format!("{name} {}: {}\n", leaf.path, leaf.kind)).collect();
        keys.extend(lines);
    }
    write(&directory.join("json.txt"), keys)?;
    Ok(std::fs::remove_dir_all(&desk)?)
}

/// The help of a command, and that of each command below it.
fn tell(program: &Program, command: &[&str], text: &mut String) -> Result<()> {
    let help = program.output(Path::new("."), &[command, &["--help"]].concat())?;
    let help = String::from_utf8_lossy(&help);
    text.push_str(&format!("== {} ==\n{help}", [&["vastex"][..], command].concat().join(" ")));
    let below = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    for line in below.take_while(|line| !line.is_empty()) {
        let name = line.split_whitespace().next().unwrap_or_default();
        // A longer text goes on in the next line, further in.
        if line.starts_with("  ") && !line.starts_with("   ") && name != "help" {
            tell(program, &[command, &[name]].concat(), text)?;
        }
    }
    Ok(())
}

/// Every command that prints JSON, with all that adds keys.
const JSON: &[(&str, &str)] = &[
    ("build", "build in/u8-3.raw -o a.vastex --page 60 --json"),
    (
        "build-layers",
        "build -o b.vastex --page 60 --layer color=in/u8-3.raw:bc1-srgb --layer height=in/half.raw --inset color=in/patch.raw@200,100,1 --json",
    ),
    ("build-shard", "build in/u8-3.raw -o 1.part --shard 1/2 --json"),
    ("build-shard", "build in/u8-3.raw -o 2.part --shard 2/2 --json"),
    ("merge", "merge 1.part 2.part -o c.vastex --json"),
    ("replace", "replace c.vastex --at 5,5 in/patch.raw --json"),
    ("info", "info a.vastex --json"),
    ("info-layers", "info b.vastex --json"),
    ("info-estimate", "info a.vastex --estimate 640x360 --json"),
    ("verify", "verify a.vastex --json"),
    ("export", "export a.vastex --layout gaiasky -o tree --json"),
    (
        "render",
        "render a.vastex --size 64x36 --on plane --record-trace t.vxtrace --disk-cache cache --compare --dump-pools --explain 32,30 --camera-path fly --frames 20 --json",
    ),
    ("render-stats", "render a.vastex --size 64x36 --frames 3 --stats-json stats.json"),
    ("replay", "replay t.vxtrace --json"),
    ("replay-timed", "replay t.vxtrace --latency-frames 2 --tiles-per-frame 4 --json"),
    ("learn", "learn t.vxtrace -o t.vxsets --json"),
    ("info-image", "info in/u8-3.raw --json"),
    ("info-volume", "info in/volume-channels.raw --json"),
    ("build-volume", "build in/volume.raw -o v.vastex --json"),
    ("build-zarr", "build in/volume.raw -o v.zarr --json"),
    ("info-volume-built", "info v.vastex --json"),
    ("crop", "crop a.vastex --at 5,5 --size 8x8 -o crop.npy --json"),
    ("crop-volume", "crop v.vastex --at 5,5,5 --size 8x8x8 -o volume.npy --json"),
    (
        "render-slice",
        "render in/volume.raw --on slices --slice z=35 --size 64x36 --record-trace v.vxtrace --disk-cache bricks --compare --dump-pools --explain 32,18 --json",
    ),
    ("render-rays", "render v.vastex --on volume --mode average --size 64x36 --compare --json"),
    ("render-rays-stats", "render v.vastex --on volume --size 64x36 --stats-json rays.json"),
    ("replay-volume", "replay v.vxtrace --json"),
];
