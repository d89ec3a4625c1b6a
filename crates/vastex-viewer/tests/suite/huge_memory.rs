//! What a process has in memory while it explores a volume of 10^15 voxels and four channels is what it has
//! while it explores one of 10^9, no more and no less; and pictures leave nothing behind.
//!
//! `VASTEX_HUGE_PLACES` says how many places are looked at in the place of so many bricks: what
//! docs/volumes.md says of 60 is measured so.
#![allow(clippy::print_stdout, reason = "a process of its own tells so what it took")]

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use glam::DVec3;
use vastex_viewer::volume::{VolumeCamera, VolumeFace, VolumeMode, VolumePlane, VolumeView};

use super::huge::{HUGE, SMALL, World};

/// Tells the test below that it is in a process of its own, and how many voxels a side has.
const ALONE: &str = "VASTEX_HUGE_ALONE";
/// Time that such a process has.
const DEADLINE: Duration = Duration::from_secs(600);

/// Bricks that are loaded: as many of either volume, up to those of a frame, so that as much has been
/// read and uploaded.
const BRICKS: u64 = 400;
/// Places that are looked at for that, at most.
const PLACES: u32 = 60;
/// Looks at so many places of both volumes, whatever is loaded for that.
const PLACES_ASKED: &str = "VASTEX_HUGE_PLACES";
/// Stands for a process that only has the shaders compiled, which a driver may keep for those that
/// follow.
const SHADERS: u32 = 0;

/// Pictures before memory is looked at, pictures over which it may not grow, and by how many bytes for each
/// it may seem to.
const FIRST: u32 = 2;
const PICTURES: u32 = 3;
const MOST_PER_PICTURE: f64 = 1_048_576.0;

/// Looks at all of a volume, and at what is around voxels of it, until so many bricks have been loaded.
fn explore(side: u32) {
    let asked = std::env::var(PLACES_ASKED).ok().and_then(|places| places.parse().ok());
    let (side, places) = if side == SHADERS { (SMALL, 1) } else { (side, asked.unwrap_or(PLACES)) };
    let bricks = if asked.is_some() { u64::MAX } else { BRICKS };
    // So few that either volume has more to upload, and has read as many more.
    let mut world = World::with_uploads(side, 1 << 20, 2 << 20);
    let whole = VolumeView::Face(VolumeFace::PlusZ);
    world.drawn(VolumeMode::Average, 1.0, whole);
    let around = |place: u32| {
        let share = DVec3::new(0.61, 0.2, 0.81) + f64::from(place) * DVec3::new(0.6180, 0.7549, 0.5698);
        let target = (share.fract() * f64::from(side)).floor() + 0.5;
        let eye = target - DVec3::new(90.0, 70.0, -40.0);
        VolumeView::Around(VolumeCamera { target, eye, down: DVec3::Z, half_height: 0.35 })
    };
    let is_explored = world.explored((VolumeMode::Emission, 10.0), (0..places).map(around), bricks);
    let stats = world.textures.stats();
    let (loaded, of_device) = (stats.pager.loaded, stats.pool_bytes + stats.table_bytes);
    println!("{loaded} bricks were loaded; {of_device} bytes of pools and tables");
    assert!(is_explored || places == 1 || asked.is_some(), "{loaded} bricks");
}

/// Bytes that this process had in memory at most.
fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() << 10
}

/// Bytes that this process has in memory.
fn resident_bytes() -> u64 {
    let statm = std::fs::read_to_string("/proc/self/statm").unwrap();
    let pages: u64 = statm.split(' ').nth(1).unwrap().parse().unwrap();
    pages * 4096
}

/// Runs a test of this module in a process of its own, which is told `what`; gives the bytes that it
/// prints.
fn bytes_of(test: &str, what: u32) -> f64 {
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", &format!("huge_memory::{test}"), "--nocapture"])
        .env(ALONE, what.to_string())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begun.elapsed() > DEADLINE {
            child.kill().unwrap();
            panic!("{test} of {what} is not done after {DEADLINE:?}");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let ran = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&ran.stdout);
    let bytes =
        said.lines().find_map(|line| line.strip_prefix("bytes: ")).and_then(|bytes| bytes.parse().ok());
    println!("{said}");
    bytes.unwrap_or_else(|| panic!("{said}"))
}

/// What a process of its own is told.
fn told() -> Option<u32> {
    std::env::var(ALONE).ok()?.parse().ok()
}

/// A software driver's textures are among it.
#[test]
fn memory_of_the_process_does_not_grow_with_the_volume() {
    if let Some(side) = told() {
        explore(side);
        return println!("\nbytes: {}", peak_bytes());
    }
    let of = |side| bytes_of("memory_of_the_process_does_not_grow_with_the_volume", side);
    let [_, small, huge] = [SHADERS, SMALL, HUGE].map(of);
    assert!((huge / small - 1.0).abs() < 0.05, "{huge} of {small} bytes");
}

/// Draws the same picture again and again, in most ways; gives by how many bytes memory grew for a picture,
/// at most.
fn drawn_again() -> u64 {
    let mut world = World::with_uploads(SMALL, 1 << 20, 2 << 20);
    let target = DVec3::splat(500.5);
    let eye = target - DVec3::new(90.0, 70.0, -40.0);
    let around = VolumeView::Around(VolumeCamera { target, eye, down: DVec3::Z, half_height: 0.35 });
    let slice =
        VolumeView::Plane(VolumePlane { middle: target, right: DVec3::X, down: DVec3::Y, pixel: 1.0 });
    let looks = [
        (VolumeMode::Average, VolumeView::Face(VolumeFace::PlusZ)),
        (VolumeMode::Emission, around),
        (VolumeMode::Iso, around),
        (VolumeMode::Mip, slice),
    ];
    let grown = looks.map(|(mode, view)| {
        let mut before = 0;
        let views = (0..FIRST + PICTURES).map(|nth| {
            if nth == FIRST {
                before = resident_bytes();
            }
            view
        });
        world.explored((mode, 10.0), views, u64::MAX);
        let grown = resident_bytes().saturating_sub(before) / u64::from(PICTURES);
        println!("{mode:?}: {grown} bytes a picture");
        grown
    });
    grown.into_iter().max().unwrap_or(0)
}

/// Mesa's lavapipe kept 4 MB of each picture in emission: a shader that it had made for the numbers of that
/// picture (`volume_shows` of volume.wgsl).
#[test]
fn pictures_leave_nothing_behind() {
    const TEST: &str = "pictures_leave_nothing_behind";
    if told().is_some() {
        return println!("\nbytes: {}", drawn_again());
    }
    let grown = bytes_of(TEST, SMALL);
    assert!(grown < MOST_PER_PICTURE, "{grown} bytes a picture");
}
