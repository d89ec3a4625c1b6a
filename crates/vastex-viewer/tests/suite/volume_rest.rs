//! A volume in a window, without the window, whose picture rests: it becomes the mean of several.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use vastex::Pace;
use vastex_viewer::stage::Clock;
use vastex_viewer::volume::VolumeMode;
use vastex_viewer::volume_scene::{VolumePane, VolumePictures};

use super::volume_scenes::Host;

/// A clock that goes on by so much whenever it is looked at.
fn steady(step: Duration) -> Clock {
    let looks = AtomicU64::new(0);
    Arc::new(move || step * looks.fetch_add(1, Ordering::Relaxed) as u32)
}

/// Draws frames until none is due.
fn rest(host: &mut Host) {
    let begun = std::time::Instant::now();
    while host.scene.is_due() {
        assert!(begun.elapsed() < Duration::from_secs(100), "it never rests");
        host.frame(VolumePictures::Parts);
        let timeout = Some(Duration::from_secs(60));
        host.gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout }).unwrap();
    }
}

/// Where nothing changes, more pictures of what is seen come, and then no more.
#[test]
fn a_picture_that_rests_becomes_the_mean_of_several() {
    let mut host = Host::with_clock(1, 1, Pace::Realtime, steady(Duration::from_millis(5)));
    host.scene.look.mode = VolumeMode::Emission;
    host.settle(VolumePictures::Parts);
    assert!(host.scene.is_due() && host.scene.passes(VolumePane::Space) <= 1);
    let first = host.picture(VolumePane::Space);
    rest(&mut host);
    assert_eq!(host.scene.passes(VolumePane::Space), 16);
    assert_eq!(host.scene.passes(VolumePane::Z), 1, "a slice is of one picture");
    let mean = host.picture(VolumePane::Space);
    assert!(mean.1.iter().zip(&first.1).all(|(m, f)| m[0].abs_diff(f[0]) < 40) && mean.0 == first.0);
    let painted = host.scene.painted();
    for _ in 0..5 {
        host.frame(VolumePictures::Parts);
        assert!(!host.scene.is_due() && host.scene.painted() == painted);
    }
    // Seen from elsewhere it begins anew.
    host.scene.look.orbit.yaw += 40.0;
    host.frame(VolumePictures::Parts);
    assert_eq!(host.scene.passes(VolumePane::Space), 1);
    rest(&mut host);
    assert_eq!(host.scene.passes(VolumePane::Space), 16);
    // After a detour it is made anew, and no single picture is taken for it.
    let mean = host.picture(VolumePane::Space);
    host.scene.look.mode = VolumeMode::Mip;
    (0..3).for_each(|_| host.frame(VolumePictures::Parts));
    host.scene.look.mode = VolumeMode::Emission;
    host.frame(VolumePictures::Parts);
    assert_eq!(host.scene.passes(VolumePane::Space), 1);
    rest(&mut host);
    assert!(host.scene.passes(VolumePane::Space) == 16 && host.picture(VolumePane::Space) == mean);
    // What is drawn whole, for a file, is one picture as ever.
    let mut whole = Host::lockstep(1, 1);
    whole.scene.look.mode = VolumeMode::Emission;
    whole.settle(VolumePictures::Whole);
    assert!(whole.scene.passes(VolumePane::Space) == 1 && whole.picture(VolumePane::Space) == first);
}

/// A device that takes seconds for a picture is not kept busy by pictures that hardly differ. Of a GPU it is
/// not known how long it took that was done when it was first asked, so it draws on for the time that it may.
#[test]
fn a_slow_device_rests_after_its_picture() {
    let mut host = Host::with_clock(1, 1, Pace::Realtime, steady(Duration::from_millis(700)));
    host.scene.look.mode = VolumeMode::Emission;
    host.settle(VolumePictures::Parts);
    rest(&mut host);
    let most = if host.gpu.is_processor() { 1 } else { 5 };
    assert!((1..=most).contains(&host.scene.passes(VolumePane::Space)));
}
