//! Volumes: raw ones that are made here, the same each time; what is built of them, and how they are drawn.

use std::path::Path;

use anyhow::Result;

use super::write;

/// A raw volume: its name, voxels along each side, the kind of its values, channels, times, and the sides
/// of a voxel.
type Raw = (&'static str, [u32; 3], &'static str, u32, u32, [u32; 3]);

const RAW: [Raw; 8] = [
    ("volume", [128, 96, 80], "u8", 1, 1, [1, 1, 1]),
    ("volume-channels", [80, 64, 40], "u16", 2, 2, [1, 1, 2]),
    ("volume-i16", [70, 60, 50], "i16", 1, 1, [1, 1, 1]),
    ("volume-f16", [70, 60, 50], "f16", 1, 1, [1, 1, 1]),
    ("volume-f32", [70, 60, 50], "f32", 1, 1, [1, 1, 1]),
    ("volume-u32", [70, 60, 50], "u32", 1, 1, [1, 1, 1]),
    // Voxel on voxel of the first, and of half as many along each side.
    ("labels", [128, 96, 80], "labels", 1, 1, [1, 1, 1]),
    ("labels-wide", [64, 48, 40], "wide-labels", 1, 1, [2, 2, 2]),
];

/// Writes the raw volumes that steps and scenes name, and a path round the first.
pub(super) fn make(directory: &Path) -> Result<()> {
    for (name, size, sample, channels, times, voxel) in RAW {
        let [width, height, depth] = size;
        let mut bytes = Vec::new();
        for (time, z) in (0..times).flat_map(|time| (0..depth).map(move |z| (time, z))) {
            for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
                for channel in 0..channels {
                    push(&mut bytes, sample, value([x, y, z], size, channel + 2 * time), [x, y, z]);
                }
            }
        }
        write(&directory.join(format!("{name}.raw")), bytes)?;
        let stored = match sample {
            "labels" => "u32",
            "wide-labels" => "u64",
            other => other,
        };
        let text = format!(
            "width = {width}\nheight = {height}\ndepth = {depth}\nchannels = {channels}\ntimes = {times}\n\
             sample = \"{stored}\"\nscale = {voxel:?}\n"
        );
        write(&directory.join(format!("{name}.raw.toml")), text)?;
    }
    let path = "vastex path 1\nfps 2\n0 volume:x=64,y=48,z=40,zoom=1,yaw=0,pitch=0\n\
                1 volume:x=64,y=48,z=40,zoom=3,yaw=50,pitch=30\n";
    write(&directory.join("round.path"), path)
}

/// Values of 16 bits that are larger lie in the balls of [`value`].
const MIST: u32 = 20_000;

/// A value of 16 bits: a smooth ball and a grainy one, above in a thin mist and below in nothing. Channels
/// and times have the balls elsewhere.
fn value([x, y, z]: [u32; 3], [width, height, depth]: [u32; 3], other: u32) -> u32 {
    // Whole numbers only, so that every machine makes the same.
    let ball = |at: [u32; 3], radius: u32| {
        let far: u32 = [x, y, z].iter().zip(at).map(|(from, to)| from.abs_diff(to).pow(2)).sum();
        65_535_u32.saturating_sub(far * 512 / (radius * radius) * 128)
    };
    let smooth = ball([width / 3 + other * 9, height / 2, depth / 2], height / 2);
    let grainy = ball([width * 3 / 4, height / 2, depth / 3 + other * 5], height / 3);
    let grain = x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663) ^ z.wrapping_mul(83_492_791);
    let grain = grain.wrapping_mul(2_654_435_761) >> 17;
    let mist = if y < height / 2 { 2000 + 100 * x + 60 * z } else { 0 };
    smooth.max(if grainy > 0 { grainy / 2 + grain } else { 0 }).max(mist.min(MIST))
}

/// A voxel as it is stored.
fn push(bytes: &mut Vec<u8>, sample: &str, value: u32, [x, y, z]: [u32; 3]) {
    match sample {
        "u8" => bytes.push((value >> 8) as u8),
        "u16" => bytes.extend((value as u16).to_le_bytes()),
        "i16" => bytes.extend(((value as i32 - 32_768) as i16).to_le_bytes()),
        // As whole numbers these grow as the floats do.
        "f16" => bytes.extend((0x3000 + (value >> 5) as u16).to_le_bytes()),
        "f32" => bytes.extend((value as f32 / 16_384.0 - 1.0).to_le_bytes()),
        "u32" => bytes.extend((value * 60_000).to_le_bytes()),
        // Cells of the balls; the wide ones differ in their upper half alone.
        "labels" => bytes.extend((if value > MIST { 1 + cell([x, y, z], 24) } else { 0 }).to_le_bytes()),
        _ => {
            let wide = u64::from(cell([x, y, z], 12)) << 32 | 7;
            bytes.extend((if value > MIST { wide } else { 0 }).to_le_bytes());
        }
    }
}

fn cell([x, y, z]: [u32; 3], side: u32) -> u32 {
    x / side + 10 * (y / side) + 100 * (z / side)
}

/// What is built and cut of volumes: names, and commands as steps have them.
pub(super) const STEPS: &[(&str, &[&str])] = &[
    ("volume", &["build %/volume.raw -o out.vastex --page 32"]),
    ("volume-one-thread", &["build %/volume.raw -o out.vastex --page 32 --threads 1"]),
    (
        "volume-rules",
        &[
            "build %/volume.raw -o mean.vastex --compress none",
            "build %/volume.raw -o max.vastex --downsample max --compress zstd",
            "build %/volume.raw -o min.vastex --downsample min",
            "build %/volume.raw -o majority.vastex --downsample majority",
        ],
    ),
    (
        "volume-kinds",
        &[
            "build %/volume-channels.raw -o channels.vastex --keep-z",
            "build %/volume-i16.raw -o i16.vastex",
            "build %/volume-f16.raw -o f16.vastex",
            "build %/volume-f32.raw -o f32.vastex",
            "build %/volume-u32.raw -o u32.vastex",
        ],
    ),
    ("volume-zarr", &["build %/volume-channels.raw -o out.zarr --page 32 --shards 2"]),
    ("volume-zarr-04", &["build %/volume.raw -o out.zarr --zarr 0.4 --compress gzip"]),
    (
        "volume-crop",
        &[
            "build %/volume-channels.raw -o a.zarr --page 32",
            "crop a.zarr --at 5,7,3 --size 31x20x11 --channel 1 --time 1 -o stored.npy",
            "crop a.zarr --at 2,3,1 --size 20x10x8 --level 1 -o coarser.npy",
        ],
    ),
];

/// What volumes are seen in that are built: as scenes have them.
pub(super) const CONTAINERS: [(&str, &str); 1] = [("volume", "in/volume.raw --page 32")];

/// Modes of rays, with what they need.
const MODES: [(&str, &str); 5] = [
    ("mip", "--mode mip"),
    ("minip", "--mode minip --range 0,0.3"),
    ("average", "--mode average --range 0,0.3"),
    ("emission", "--mode emission --density 0.05"),
    ("iso", "--mode iso --iso 120"),
];

/// Every picture of a volume: its name, and the words for `vastex render`.
pub(super) fn cases() -> Vec<(String, String)> {
    let mut cases = Vec::new();
    let mut add = |name: String, words: String| {
        cases.push((format!("volume-{name}"), format!("in/{words} --size 96x64")));
    };
    // So near that all of the finest level is wanted.
    const NEAR: &str = "--view volume:x=64,y=48,z=40,zoom=2,yaw=30,pitch=20;panes=3d";
    let rays = format!("volume.raw --on volume {NEAR}");
    const SLICE: &str = "volume.raw --on slices --slice";
    for (mode, words) in MODES {
        // A pool for which bricks are cut of 32 voxels, and that does not hold all of them.
        add(mode.into(), format!("{rays} {words} --pool-mib 2"));
        add(format!("{mode}-face"), format!("volume.raw --on volume --view -x {words}"));
        let channels = "volume-channels.raw --on volume --time 1 --channels 0:00ff80,1:magma:5000..60000:0.7";
        add(format!("{mode}-channels"), format!("{channels} --view around:yaw=-60,pitch=40 {words}"));
        add(format!("{mode}-labels"), format!("{rays} {words} --labels in/labels.raw --label-opacity 0.6"));
    }
    for face in ["+x", "+y", "-y", "+z", "-z"] {
        add(format!("face-{face}"), format!("volume.raw --on volume --mode mip --view {face}"));
    }
    for (name, plane) in
        [("x", "x=60"), ("y", "y=40"), ("z", "z=35"), ("oblique", "plane:x=60,y=48,z=40,nx=1,ny=-1,nz=0.5")]
    {
        add(format!("slice-{name}"), format!("{SLICE} {plane}"));
        let labels = "--labels in/labels.raw";
        add(format!("slice-{name}-labels"), format!("{SLICE} {plane} {labels}"));
        add(format!("slice-{name}-outlines"), format!("{SLICE} {plane} {labels} --label-outlines"));
    }
    for filter in ["linear", "exact", "nearest"] {
        add(filter.into(), format!("{rays} --mode average --filter {filter}"));
        let slice = "volume-channels.raw --on slices --slice plane:x=40,y=30,z=20,nx=1,ny=1,nz=1";
        add(format!("{filter}-slice"), format!("{slice} --filter {filter}"));
    }
    for feedback in ["separate", "inline", "raw"] {
        let glowing = format!("{rays} --mode emission --density 0.05 --pool-mib 2");
        add(feedback.into(), format!("{glowing} --feedback {feedback}"));
        add(format!("{feedback}-slice"), format!("{SLICE} z=35 --feedback {feedback}"));
    }
    for kind in ["i16", "f16", "f32", "u32"] {
        add(kind.into(), format!("volume-{kind}.raw --on volume --mode mip --view +y"));
        add(format!("{kind}-slice"), format!("volume-{kind}.raw --on slices --slice x=30"));
    }
    // Labels in two halves, elsewhere than the voxels of the image, by themselves, and one of them.
    let wide = "--labels in/labels-wide.raw --label-opacity 1";
    add("wide-labels".into(), format!("{rays} {wide}"));
    add("wide-labels-slice".into(), format!("{SLICE} z=35 {wide}"));
    for others in ["dimmed", "hidden"] {
        let one = format!("--labels in/labels.raw --label-selected 123 --label-others {others}");
        add(format!("selected-{others}"), format!("{rays} {one}"));
        add(format!("selected-{others}-slice"), format!("{SLICE} z=30 {one}"));
    }
    add("small-pool".into(), format!("{rays} --mode mip --pool-mib 1"));
    add("fine-steps".into(), format!("{rays} --mode emission --step 0.5 --density 0.1"));
    let path = "--camera-path in/round.path";
    add("path".into(), format!("volume.raw --on volume --mode mip --pool-mib 1 {path}"));
    let camera = "volume:x=64,y=48,z=40,zoom=1.3,yaw=30,pitch=20";
    let cut = "mode=emission;channel=0:map=viridis:gamma=0.7;clip=0.1..0.9,0..1,0.2..0.8;plane=20,10,0.45";
    add("cut".into(), format!("volume.raw --view {camera};panes=3d;{cut}"));
    let tilted = "panes=z;slices=64,48,40:zoom=1.5;tilt=z:20,10;channel=0:color=ff8000";
    add("tilted".into(), format!("volume.raw --view {camera};{tilted}"));
    // The same from the container, whose levels are stored.
    cases.push(("volume-built".into(), format!("{} --size 96x64", rays.replace(".raw", ".vastex"))));
    cases
}
