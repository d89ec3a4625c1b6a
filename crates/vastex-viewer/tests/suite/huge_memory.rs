//! What a process has in memory while it explores a volume of 10^15 voxels and four channels is what it has
//! while it explores one of 10^9, no more and no less; and pictures leave nothing behind.
//!
//! `VASTEX_HUGE_PLACES` says how many places are looked at, whatever is loaded for that: without a limit of
//! time, and what memory was taken at most is told after each.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a process of its own tells so what it took")]

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use glam::DVec3;
use vastex_viewer::volume::{VolumeCamera, VolumeFace, VolumeMode, VolumePlane, VolumeView};

use super::huge::{HUGE, SMALL, World};

/// Tells the test below that it is in a process of its own, and how many voxels a side has.
const ALONE: &str = "VASTEX_HUGE_ALONE";
/// Time that such a process has; three follow one another in a program of tests that is killed after 600 s.
const DEADLINE: Duration = Duration::from_secs(150);

/// Bricks that are loaded: as many of either volume, up to those of a frame, so that as much has been
/// read and uploaded.
const BRICKS: u64 = 400;
/// Places that are looked at for that, at most.
const PLACES: u32 = 60;
/// Says that so many places of both volumes are to be looked at.
const PLACES_ASKED: &str = "VASTEX_HUGE_PLACES";
/// Stands for a process that only has the shaders compiled, which a driver may keep for those that
/// follow.
const SHADERS: u32 = 0;

/// Pictures before memory is looked at, pictures over which it may not grow, and by how many bytes for each
/// it may seem to.
const FIRST: u32 = 2;
const PICTURES: u32 = 10;
const MOST_PER_PICTURE: f64 = 262_144.0;
/// Pixels of these pictures: of what a picture may leave behind nothing depends on them.
const PIXELS: [u32; 2] = [16, 16];

/// Looks at all of a volume, and at what is around voxels of it, until so many bricks have been loaded.
fn explore(side: u32) {
    let asked = places_asked();
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
    let views = (0..places).map(|place| {
        if asked.is_some() {
            eprintln!("{side} voxels a side, {place} places: {} bytes", bytes_in_memory("VmHWM:"));
        }
        around(place)
    });
    let is_explored = world.explored((VolumeMode::Emission, 10.0), views, bricks);
    let stats = world.textures.stats();
    let (loaded, of_device) = (stats.pager.loaded, stats.pool_bytes + stats.table_bytes);
    println!("{loaded} bricks were loaded; {of_device} bytes of pools and tables");
    assert!(is_explored || places == 1 || asked.is_some(), "{loaded} bricks");
}

/// Bytes that this process has in memory by a line of what Linux says of it: `VmRSS:` now, `VmHWM:` at most.
fn bytes_in_memory(name: &str) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix(name)).unwrap();
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() << 10
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
    let (begun, deadline) = (Instant::now(), deadline());
    while child.try_wait().unwrap().is_none() {
        if deadline.is_some_and(|deadline| begun.elapsed() > deadline) {
            child.kill().unwrap();
            panic!("{test} of {what} is not done after {deadline:?}");
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

/// What a process of its own is told; from then on its time counts, so that it ends where nobody waits for it
/// any more, too.
fn told() -> Option<u32> {
    let what = std::env::var(ALONE).ok()?.parse().ok()?;
    if let Some(deadline) = deadline() {
        std::thread::spawn(move || {
            std::thread::sleep(deadline);
            eprintln!("not done after {deadline:?}");
            std::process::abort();
        });
    }
    Some(what)
}

fn places_asked() -> Option<u32> {
    std::env::var(PLACES_ASKED).ok()?.parse().ok()
}

/// None where somebody asks for places.
fn deadline() -> Option<Duration> {
    places_asked().is_none().then_some(DEADLINE)
}

/// A software driver's textures are among it.
#[test]
fn memory_of_the_process_does_not_grow_with_the_volume() {
    if let Some(side) = told() {
        explore(side);
        return println!("\nbytes: {}", bytes_in_memory("VmHWM:"));
    }
    let of = |side| bytes_of("memory_of_the_process_does_not_grow_with_the_volume", side);
    let [_, small, huge] = [SHADERS, SMALL, HUGE].map(of);
    assert!((huge / small - 1.0).abs() < 0.05, "{huge} of {small} bytes");
}

/// Draws the same picture again and again, in most ways; gives by how many bytes memory grew for a picture,
/// at most.
fn drawn_again() -> u64 {
    let mut world = World::with_uploads(SMALL, 1 << 20, 2 << 20);
    world.size = PIXELS;
    let target = DVec3::splat(500.5);
    let eye = target - DVec3::new(90.0, 70.0, -40.0);
    let around = VolumeView::Around(VolumeCamera { target, eye, down: DVec3::Z, half_height: 0.35 });
    let slice =
        VolumeView::Plane(VolumePlane { middle: target, right: DVec3::X, down: DVec3::Y, pixel: 1.0 });
    let looks = [
        (VolumeMode::Average, VolumeView::Face(VolumeFace::PlusZ)),
        (VolumeMode::Average, around),
        (VolumeMode::Emission, around),
        (VolumeMode::Iso, around),
        (VolumeMode::Mip, slice),
    ];
    let grown = looks.map(|(mode, view)| {
        let mut before = 0;
        let views = (0..FIRST + PICTURES).map(|nth| {
            if nth == FIRST {
                before = bytes_in_memory("VmRSS:");
            }
            view
        });
        world.explored((mode, 10.0), views, u64::MAX);
        let grown = bytes_in_memory("VmRSS:").saturating_sub(before) / u64::from(PICTURES);
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
