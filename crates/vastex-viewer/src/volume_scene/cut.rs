//! Whether rays of what is seen meet more than is taken, so that what lies behind is not seen.

use glam::DVec3;

use super::VolumeScene;
use crate::volume::{RayBounds, RayCut, RayVoxels};

impl VolumeScene {
    /// Of what the rays of the picture in 3-D may meet more than is taken: what lies behind that is not seen.
    /// Nothing is said of a volume whose levels are not known ([`super::VolumeFacts::levels`]).
    pub fn ray_cut(&self) -> Option<RayCut> {
        let (desc, facts) = (self.current.renderer()?.desc(), &self.facts);
        let (levels, brick) = (facts.levels.clone()?, facts.brick);
        let panes = self.panes();
        let pane = panes.iter().find(|pane| pane.pane.axis().is_none())?;
        let of_labels = self.current.levels_of_labels(&self.look);
        let labels = desc.labels.as_ref().zip(of_labels).map(|(labels, levels)| {
            let begin = DVec3::from_array(labels.begin);
            (RayVoxels::new(labels.of, begin, (levels, brick), &desc.clip), labels.turns())
        });
        let bounds = RayBounds {
            mode: desc.mode,
            channels: desc.channels.len(),
            step: desc.step,
            is_processor: self.gpu.is_processor(),
            image: RayVoxels::new(facts.of, DVec3::ZERO, (levels, brick), &desc.clip),
            labels,
        };
        bounds.cut(&self.sight(pane).view(1), pane.size)
    }
}
