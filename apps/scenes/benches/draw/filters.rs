//! The price of a virtual texture, filter by filter, beside an ordinary one with the same taps; and how far
//! the adapter's own filter is from ours, on a real image.

use std::fmt::Write as _;
use std::time::Duration;

use anyhow::Result;
use glam::DVec3;
use vastex::{Filter, MaxTaps};
use vastex_scenes::{Pose, Scene};

use crate::world::{Bench, Part, Verdict, earth, picture, property, resident};

/// Draws of each kind, in turns.
const ROUNDS: usize = 25;
/// Of an ordinary texture's time, that of a virtual one at most, on a GPU.
const ASKED: f64 = 1.25;

const GROUND: Pose = Pose::Plane { eye: DVec3::new(0.1, -0.9, 0.12), yaw: 0.2, pitch: 0.25 };
const CLOSE: Pose = Pose::Plane { eye: DVec3::new(0.1, -0.3, 0.004), yaw: 0.2, pitch: 1.2 };

pub(crate) fn section(bench: &Bench) -> Result<Part> {
    let [width, height] = picture(&bench.gpu);
    let mut page = format!(
        "## Filters\n\nA frame of {width}x{height} of a texture of which every page is resident, beside an ordinary mip-mapped texture\n\
         with the same taps in the same draw (two explicit levels), and by the adapter's own trilinear or anisotropic filter.\n\
         Asked for on a GPU: {ASKED} for trilinear and anisotropic8.\n\n\
         | view | filter | virtual ms | ordinary ms | virtual / ordinary | adapter's own ms |\n|---|---|---|---|---|---|\n"
    );
    let filters = [Filter::Nearest, Filter::Bilinear, Filter::Trilinear].into_iter().chain(anisotropic());
    let views = filters
        .map(|filter| ("along the ground", GROUND, filter))
        .chain([Filter::Trilinear, Filter::Bicubic].map(|filter| ("close to it", CLOSE, filter)));
    let ms = |taken: Duration| taken.as_secs_f64() * 1e3;
    let mut verdicts = Vec::new();
    for (view, pose, filter) in views {
        let costs = resident(bench, property()?, filter, Scene::Plane, pose)?.costs(&bench.clock, ROUNDS)?;
        let (own, ordinary, by_adapter) = (ms(costs.of_virtual), ms(costs.of_ordinary), ms(costs.of_adapter));
        let ratio = own / ordinary;
        writeln!(page, "| {view} | {filter} | {own:.2} | {ordinary:.2} | {ratio:.2} | {by_adapter:.2} |")?;
        if ["trilinear", "anisotropic8"].contains(&filter.to_string().as_str()) {
            let what = format!("a frame of {filter} {view}, of an ordinary texture's");
            verdicts.push(Verdict::at_most(ASKED, what, ratio));
        }
    }
    page += "\nHow alike the picture is to that of the adapter's own filter, on the Earth (2700x1350 texels of \
             `assets/earth-color-10800x5400.jpg`):\n\n\
             | scene | filter | dB | pixels within 1/255 | beyond 3/255 |\n|---|---|---|---|---|\n";
    let earth = earth()?;
    for (scene, pose) in [(Scene::Plane, GROUND), (Scene::Globe, Pose::first(Scene::Globe))] {
        for filter in [Filter::Trilinear].into_iter().chain(anisotropic()) {
            let alike =
                resident(bench, earth.clone(), filter, scene, pose)?.costs(&bench.clock, 1)?.to_adapter;
            let percent = [alike.share_within_1_255, alike.share_beyond_3_255].map(|share| 1e2 * share);
            let (name, [within, beyond]) = (scene.name(), percent);
            writeln!(page, "| {name} | {filter} | {:.1} | {within:.2} % | {beyond:.2} % |", alike.psnr_db)?;
        }
    }
    Ok((page, verdicts))
}

fn anisotropic() -> impl Iterator<Item = Filter> {
    MaxTaps::ALL.into_iter().map(Filter::Anisotropic)
}
