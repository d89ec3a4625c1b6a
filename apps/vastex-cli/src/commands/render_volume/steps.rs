//! Words of what is refused of a picture of a volume, since its rays would be cut, and what tells the library
//! how they are sampled: it counts the samples, bricks and labels that they meet before anything is drawn.

use std::sync::Arc;

use anyhow::{Result, bail};
use glam::DVec3;
use vastex::RAY_BRICKS;
use vastex_viewer::volume::{RayBounds, RayCut, RayVoxels, VolumeClip, VolumeView};
use vastex_volume::{VolumeAbout, VolumeOptions, levels_of};

use super::box_of;
use crate::args::RenderVolumeArgs;
use crate::commands::render_labels::Labels;

/// How rays are sampled of so many channels of what is left of a volume, in bricks of so many voxels a side.
pub(super) fn bounds_of(
    args: &RenderVolumeArgs,
    is_processor: bool,
    ((about, channels, clip), brick): ((&VolumeAbout, usize, &VolumeClip), u32),
    labels: Option<&Labels>,
) -> Result<RayBounds> {
    let (_, levels) = levels_of(about, brick, VolumeOptions::default().border)?;
    let labels = labels.map(|labels| {
        let (of, begin) = labels.place();
        let levels = labels.source.levels().clone();
        (RayVoxels::new(of, begin.into(), (levels, brick), clip), labels.turns(args))
    });
    let (of, levels) = (box_of(about)?, Arc::new(levels));
    let (mode, step) = (args.look.mode(), args.look.step());
    let image = RayVoxels::new(of, DVec3::ZERO, (levels, brick), clip);
    Ok(RayBounds { mode, channels, step, is_processor, image, labels })
}

/// Fails where rays of a view may be cut.
pub(super) fn check(bounds: &RayBounds, view: &VolumeView, size: [u32; 2]) -> Result<()> {
    bounds.cut(view, size).map_or(Ok(()), |cut| refused(cut, bounds.step, bounds.is_processor))
}

fn refused(cut: RayCut, step: f64, is_processor: bool) -> Result<()> {
    let who = if is_processor { "this adapter, a processor," } else { "a ray" };
    match cut {
        RayCut::Bricks(bricks) => bail!(
            "rays would meet up to {bricks} bricks, and {RAY_BRICKS} are shown at most; draw a smaller picture, of which \
             coarser levels are seen, look along a shorter side, or give a larger --pool-mib, which makes bricks larger"
        ),
        RayCut::Labels([voxels, most]) => bail!(
            "rays would pass up to {voxels:.0} voxels of labels, and {who} takes {most} at most; draw a smaller picture, of which \
             coarser levels are seen, look along a shorter side, or leave the labels out"
        ),
        RayCut::Samples([samples, most], least) => {
            let advice = match least {
                Some(step) => format!("write {step} or more"),
                None => "no step is long enough; show fewer channels, or no labels".to_owned(),
            };
            bail!(
                "--step {step}: rays would have up to {samples:.0} samples, and {who} takes {most} at most; {advice}"
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_refused_is_said_with_what_would_be_taken() {
        let text = |cut, is_processor| refused(cut, 0.2, is_processor).unwrap_err().to_string();
        let samples = |step| RayCut::Samples([1_310_000.0, 262_144.0], step);
        let said = text(samples(Some(1.14)), false);
        assert_eq!(
            said,
            "--step 0.2: rays would have up to 1310000 samples, and a ray takes 262144 at most; write 1.14 or more"
        );
        assert!(
            text(samples(None), true).contains("a processor, takes 262144 at most; no step is long enough")
        );
        let said = text(RayCut::Bricks(4126.0), false);
        assert!(said.contains("4126 bricks") && !said.contains("--step"), "{said}");
        let said = text(RayCut::Labels([31_900.0, 32_000.0]), true);
        assert!(
            said.contains("31900 voxels of labels, and this adapter, a processor, takes 32000"),
            "{said}"
        );
    }
}
