//! The modes of feedback give the same, and over a jitter cycle find what every pixel wants.

use std::collections::BTreeMap;
use std::sync::Arc;

use vastex::{FeedbackMode, Filter, Geometry, PageId, Settings, TileSource};
use vastex_core::GeometrySpec;
use vastex_scenes::{Offscreen, Path, Pose, Scene};
use vastex_tiles::PropertySource;

use crate::common::{gpu, settings};

const PICTURE: [u32; 2] = [640, 360];
/// Frames after which the feedback of a whole jitter cycle has come: it acts two frames later.
const FRAMES: u64 = vastex::JITTER_CYCLE as u64 + 2;

/// Pages, and over how many pixels each is wanted.
type Wanted = BTreeMap<PageId, u64>;

fn source() -> Arc<dyn TileSource> {
    let spec = GeometrySpec { page: 64, ..GeometrySpec::image(16384, 8192) };
    Arc::new(PropertySource::new(Geometry::new(spec).unwrap()))
}

fn offscreen(mode: FeedbackMode, scene: Scene) -> Offscreen {
    let settings = Settings { feedback: Some(mode), ..settings(16, Filter::Nearest) };
    Offscreen::new(gpu(), source(), scene, PICTURE, settings).unwrap()
}

/// What the views of a whole jitter cycle want together.
fn cycle(offscreen: &mut Offscreen, pose: Pose) -> Wanted {
    offscreen.textures_mut().ahead().trace().record();
    for _ in 0..FRAMES {
        offscreen.frame(pose).unwrap();
    }
    let trace = offscreen.textures_mut().ahead().trace().take().unwrap().unwrap();
    assert_eq!(trace.frames().len() as u64, FRAMES - 2);
    let mut wanted = Wanted::new();
    for page in trace.frames().iter().flatten() {
        *wanted.entry(page.page).or_default() += u64::from(page.pixels);
    }
    wanted
}

/// Share of the pixels of `a` that want another page in `b`.
fn difference(a: &Wanted, b: &Wanted) -> f64 {
    let in_both: u64 = a.iter().map(|(page, pixels)| (*pixels).min(b.get(page).copied().unwrap_or(0))).sum();
    let most = a.values().sum::<u64>().max(b.values().sum());
    1.0 - in_both as f64 / most as f64
}

fn poses() -> impl Iterator<Item = (Scene, Path, Pose)> {
    let paths = [(Path::Still, 0), (Path::Fly, 0), (Path::Zoom, 150)];
    let of_scene = move |scene| paths.map(move |(path, frame)| (scene, path, path.pose(scene, 2.0, frame)));
    Scene::SMOOTH.into_iter().flat_map(of_scene)
}

#[test]
fn a_jitter_cycle_finds_what_every_pixel_wants_and_the_same_in_every_mode() {
    for (scene, path, pose) in poses() {
        let found_by = |mode| {
            let mut offscreen = offscreen(mode, scene);
            let found = cycle(&mut offscreen, pose);
            let every = offscreen.wanted_by_every_pixel(pose).unwrap();
            let (mut all, mut seen) = (0, 0);
            for page in &every.pages {
                all += page.pixels;
                seen += if found.contains_key(&page.page) { page.pixels } else { 0 };
            }
            let share = f64::from(seen) / f64::from(all);
            println!("{}/{} {}: {share:.5} of {all} pixels", scene.name(), path.name(), mode.name());
            assert!(share >= 0.99, "{}/{} {}: {share}", scene.name(), path.name(), mode.name());
            found
        };
        let [separate, inline, raw] = FeedbackMode::ALL.map(found_by);
        let line = format!("{}/{}", scene.name(), path.name());
        println!("{line}: {} pages, inline {:.5}", separate.len(), difference(&separate, &inline));
        assert!(separate == raw, "{line}: what is read back raw is the same");
        assert!(difference(&separate, &inline) <= 0.01, "{line}: {}", difference(&separate, &inline));
    }
}

/// Where a surface turns away from the eye, where it ends, and where its triangles are smaller than pixels,
/// derivatives are taken beside it. No mode asks for a level there that is finer than any that a hundredth of
/// the pixels want.
#[test]
fn silhouettes_and_slivers_never_ask_for_fine_levels() {
    let globe = |altitude| Pose::globe(0.2, 0.1, altitude);
    let plane = |pitch| Pose::Plane { eye: glam::DVec3::new(0.0, -0.6, 0.02), yaw: 0.3, pitch };
    let poses = [
        (Scene::Globe, globe(0.8)),
        (Scene::Globe, globe(6.0)),
        (Scene::Globe, globe(19.0)),
        (Scene::Plane, plane(0.0)),
        (Scene::Plane, plane(0.2)),
    ];
    for (scene, pose) in poses {
        for mode in FeedbackMode::ALL {
            let mut offscreen = offscreen(mode, scene);
            let every = offscreen.wanted_by_every_pixel(pose).unwrap();
            let all: u32 = every.pages.iter().map(|page| page.pixels).sum();
            let of_level = |level: u8| every.pages.iter().filter(move |page| page.page.level() == level);
            let pixels = |level| of_level(level).map(|page| page.pixels).sum::<u32>();
            let finest = (0..32).find(|&level| pixels(level) * 100 > all).unwrap();
            let found = cycle(&mut offscreen, pose);
            let finer = found.keys().filter(|page| page.level() < finest).count();
            println!("{pose:?} {}: level {finest} is the finest, of {} pages", mode.name(), found.len());
            assert_eq!(finer, 0, "{pose:?} {}: pages finer than level {finest}", mode.name());
        }
    }
}

/// What is read back is bounded by what is wanted: 48 KiB, and 24 bytes for each distinct page beyond the
/// 4,096 that these hold.
#[test]
fn compacted_feedback_is_read_back_in_proportion_to_its_pages() {
    const LEAST: u64 = 48 << 10;
    // Pages smaller than a feedback pixel, so that there are more of them than the least holds; and as many
    // as usual.
    let fine = GeometrySpec { page: 8, ..GeometrySpec::image(4096, 2048) };
    let fine: Arc<dyn TileSource> = Arc::new(PropertySource::new(Geometry::new(fine).unwrap()));
    // Of thousands of new pages in a frame a few frames will do.
    let cases = [
        (source(), Scene::Plane, FeedbackMode::Separate, 20, PICTURE),
        (source(), Scene::Globe, FeedbackMode::Inline, 20, PICTURE),
        (fine, Scene::Plane, FeedbackMode::Separate, 4, [1280, 720]),
    ];
    for (source, scene, mode, frames, picture) in cases {
        let settings = Settings { feedback: Some(mode), ..settings(16, Filter::Nearest) };
        let mut offscreen = Offscreen::new(gpu(), source, scene, picture, settings).unwrap();
        offscreen.textures_mut().ahead().trace().record();
        let mut read = Vec::new();
        for frame in 0..frames {
            let before = offscreen.textures().stats().feedback_bytes_read;
            offscreen.frame(Path::Fly.pose(scene, 2.0, frame)).unwrap();
            read.push(offscreen.textures().stats().feedback_bytes_read - before);
        }
        let trace = offscreen.textures_mut().ahead().trace().take().unwrap().unwrap();
        // What a frame wanted is read two frames later, behind a head of 16 bytes.
        for (pages, &read) in trace.frames().iter().zip(&read[2..]) {
            let pages = pages.len() as u64;
            let most = LEAST + 16 + 24 * pages.saturating_sub(4096);
            assert!(
                (12 * pages..=most).contains(&read),
                "{} {}: {read} for {pages}",
                scene.name(),
                mode.name()
            );
        }
        let most = trace.frames().iter().map(Vec::len).max().unwrap();
        assert!(frames == 20 || most > 4096, "{most} pages are no more than the least holds");
        println!(
            "{} {}: up to {most} pages, {} bytes",
            scene.name(),
            mode.name(),
            read.iter().max().unwrap()
        );
    }
}
