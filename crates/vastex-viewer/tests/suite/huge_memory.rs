//! What a process has in memory while it explores a volume of 10^15 voxels and four channels is what it has
//! while it explores one of 10^9.
#![allow(clippy::print_stdout, reason = "a process of its own tells so what it took")]

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use glam::DVec3;
use vastex_viewer::volume::{VolumeCamera, VolumeFace, VolumeMode, VolumeView};

use super::huge::{HUGE, SMALL, World};

/// Tells the test below that it is in a process of its own, and how many voxels a side has.
const ALONE: &str = "VASTEX_HUGE_ALONE";
/// Time that such a process has.
const DEADLINE: Duration = Duration::from_secs(300);

/// Bricks that are loaded: as many of either volume, up to those of a frame, so that as much has been
/// read and uploaded.
const BRICKS: u64 = 400;
/// Places that are looked at for that, at most.
const PLACES: u32 = 60;
/// Stands for a process that only has the shaders compiled, which a driver may keep for those that
/// follow.
const SHADERS: u32 = 0;

/// Looks at all of a volume, and at what is around voxels of it, until so many bricks have been loaded.
fn explore(side: u32) {
    let (side, places) = if side == SHADERS { (SMALL, 1) } else { (side, PLACES) };
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
    let is_explored = world.explored((VolumeMode::Emission, 10.0), (0..places).map(around), BRICKS);
    let stats = world.textures.stats();
    println!("{} bricks were loaded; {} bytes of pools", stats.pager.loaded, stats.pool_bytes);
    assert!(is_explored || places == 1, "{} bricks", stats.pager.loaded);
}

/// Bytes that this process had in memory at most.
fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() << 10
}

/// Explores a volume in a process of its own; gives the bytes that it had in memory at most.
fn peak_of(side: u32) -> f64 {
    let name = "huge_memory::memory_of_the_process_does_not_grow_with_the_volume";
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", name, "--nocapture"])
        .env(ALONE, side.to_string())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begun.elapsed() > DEADLINE {
            child.kill().unwrap();
            panic!("a volume of {side} voxels a side is not explored after {DEADLINE:?}");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let ran = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&ran.stdout);
    let peak = said.lines().find_map(|line| line.strip_prefix("peak: ")).and_then(|peak| peak.parse().ok());
    println!("{said}");
    peak.unwrap_or_else(|| panic!("{said}"))
}

/// A software driver's textures are among it.
#[test]
fn memory_of_the_process_does_not_grow_with_the_volume() {
    if let Some(side) = std::env::var(ALONE).ok().and_then(|side| side.parse().ok()) {
        explore(side);
        return println!("\npeak: {}", peak_bytes());
    }
    let [_, small, huge] = [SHADERS, SMALL, HUGE].map(peak_of);
    assert!(huge < 1.05 * small, "{huge} of {small} bytes");
}
