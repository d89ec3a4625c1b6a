//! Which textures hold the channels of a volume at a time, and which are still to come.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use vastex::{TextureId, Textures, VoxelLevels};

use super::look::{VolumeFacts, VolumeLook};
use crate::gpu::Gpu;
use crate::volume::{
    LabelColors, VolumeBox, VolumeChannel, VolumeDesc, VolumeError, VolumeLabels, VolumeRenderer,
    drawable_range,
};

use super::picture::{PASSES, PICTURE};

/// Counts renderers of all scenes.
static NEXT: AtomicU64 = AtomicU64::new(1);

/// A channel at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Held {
    Absent,
    Asked,
    Refused,
    Here(TextureId),
}

/// One of the textures of what is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Channel(usize),
    Labels(usize),
}

/// Where labels lie in the scene's world, and the colours that they were given.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelsPlace {
    /// The labels' box.
    pub of: VolumeBox,
    /// Where the labels' box begins.
    pub begin: [f64; 3],
    /// The colours of those that do not have the usual one.
    pub colors: Arc<LabelColors>,
    /// The least and the greatest number that their values can have.
    pub bounds: [i128; 2],
    /// Where the voxels of their levels lie, if that is known.
    pub levels: Option<Arc<VoxelLevels>>,
}

impl LabelsPlace {
    /// A label as it stands in textures: with a sign in two's complement of 32 bits, or of 64 where they have
    /// these. One that there cannot be is as no label is, where any is not: of 32 bits and less with upper
    /// bits. `None` where none is so.
    fn bits_of(&self, label: i128) -> Option<u64> {
        let [least, most] = self.bounds;
        let is_wide = least < i128::from(i32::MIN) || most > i128::from(u32::MAX);
        match ((least..=most).contains(&label), is_wide) {
            (true, true) => Some(label as u64),
            (true, false) => Some(u64::from(label as i64 as u32)),
            (false, true) => None,
            (false, false) => Some(u64::MAX),
        }
    }
}

/// The channels at one time, and what draws them.
#[derive(Debug)]
pub(super) struct Channels {
    pub(super) time: u64,
    held: Vec<Held>,
    /// Of each of the labels beside them.
    labels: Vec<(Held, Option<LabelsPlace>)>,
    renderer: Option<VolumeRenderer>,
    /// Which it is of all that there have been.
    made: u64,
}

impl Channels {
    pub(super) fn new(time: u64, facts: &VolumeFacts) -> Channels {
        let held = vec![Held::Absent; facts.channels.len()];
        let labels = vec![(Held::Absent, None); facts.labels.len()];
        Channels { time, held, labels, renderer: None, made: 0 }
    }

    /// The labels that are shown, where they were not asked for yet: they are from here on.
    pub(super) fn ask_labels(&mut self, look: &VolumeLook) -> Option<usize> {
        let nth = look.labels.shown?;
        let (held, _) = self.labels.get_mut(nth)?;
        let is_new = *held == Held::Absent;
        if is_new {
            *held = Held::Asked;
        }
        is_new.then_some(nth)
    }

    /// Labels are here. Gives back a texture that they were before.
    pub(super) fn put_labels(
        &mut self,
        nth: usize,
        texture: TextureId,
        place: LabelsPlace,
    ) -> Option<TextureId> {
        let labels = self.labels.get_mut(nth)?;
        match std::mem::replace(labels, (Held::Here(texture), Some(place))) {
            (Held::Here(before), _) => Some(before),
            _ => None,
        }
    }

    /// Labels cannot be had.
    pub(super) fn refuse_labels(&mut self, nth: usize) {
        if let Some((held, _)) = self.labels.get_mut(nth) {
            *held = Held::Refused;
        }
    }

    /// What draws those that are shown, if any is here, and which renderer that is of all that there have
    /// been of any time: a camera of another one may be bound by another layout, and must not be used.
    pub(super) fn drawn_by(&self) -> Option<(u64, &VolumeRenderer)> {
        self.renderer.as_ref().map(|renderer| (self.made, renderer))
    }

    fn labels_wait(&self, look: &VolumeLook) -> bool {
        let held = look.labels.shown.and_then(|nth| self.labels.get(nth)).map(|(held, _)| *held);
        matches!(held, Some(Held::Absent | Held::Asked))
    }

    /// Where the voxels of the labels that are shown lie, if that is known.
    pub(super) fn levels_of_labels(&self, look: &VolumeLook) -> Option<Arc<VoxelLevels>> {
        let (_, place) = self.labels.get(look.labels.shown?)?;
        place.as_ref()?.levels.clone()
    }

    fn shown_labels(&self, look: &VolumeLook) -> Option<VolumeLabels> {
        let (held, place) = self.labels.get(look.labels.shown?)?;
        let (Held::Here(texture), Some(place)) = (held, place) else { return None };
        Some(VolumeLabels {
            begin: place.begin,
            opacity: look.labels.opacity,
            outlines: look.labels.outlines,
            selected: look.labels.selected.and_then(|label| place.bits_of(label)).filter(|bits| *bits != 0),
            others: look.labels.others,
            colors: place.colors.clone(),
            ..VolumeLabels::new(*texture, place.of)
        })
    }

    /// The channels that are shown and were not asked for yet: they are from here on.
    pub(super) fn ask(&mut self, look: &VolumeLook) -> Vec<usize> {
        let held = &mut self.held;
        let is_new = |channel: &usize| held.get(*channel) == Some(&Held::Absent);
        let asked: Vec<usize> = look.shown().filter(is_new).collect();
        asked.iter().for_each(|channel| held[*channel] = Held::Asked);
        asked
    }

    /// A channel is here. Gives back a texture that it was before.
    pub(super) fn put(&mut self, channel: usize, texture: TextureId) -> Option<TextureId> {
        let held = self.held.get_mut(channel)?;
        match std::mem::replace(held, Held::Here(texture)) {
            Held::Here(before) => Some(before),
            _ => None,
        }
    }

    /// A channel cannot be had.
    pub(super) fn refuse(&mut self, channel: usize) {
        if let Some(held) = self.held.get_mut(channel) {
            *held = Held::Refused;
        }
    }

    /// A channel that could not be had may be asked for once more.
    pub(super) fn ask_again(&mut self, channel: usize) {
        if let Some(held) = self.held.get_mut(channel).filter(|held| !matches!(held, Held::Here(_))) {
            *held = Held::Absent;
        }
    }

    /// Labels that could not be had may be asked for once more.
    pub(super) fn ask_labels_again(&mut self, nth: usize) {
        if let Some((held, _)) = self.labels.get_mut(nth).filter(|(held, _)| !matches!(held, Held::Here(_))) {
            *held = Held::Absent;
        }
    }

    /// Returns true if every channel that is shown is here, or will never be.
    pub(super) fn is_complete(&self, look: &VolumeLook) -> bool {
        let is_there = |channel| matches!(self.held.get(channel), Some(Held::Here(_) | Held::Refused));
        look.shown().all(is_there) && !self.labels_wait(look)
    }

    /// Returns true if a channel that is shown is still to come.
    pub(super) fn waits(&self, look: &VolumeLook) -> bool {
        let is_to_come = |channel| matches!(self.held.get(channel), Some(Held::Asked | Held::Absent));
        look.shown().any(is_to_come) || self.labels_wait(look)
    }

    /// The textures of what is shown, as far as they are here.
    pub(super) fn parts(&self, look: &VolumeLook) -> impl Iterator<Item = (Part, TextureId)> + '_ {
        let channels: Vec<usize> = look.shown().collect();
        let channels = channels.into_iter().map(|nth| (Part::Channel(nth), self.held.get(nth)));
        let labels = look.labels.shown;
        let labels = labels.map(|nth| (Part::Labels(nth), self.labels.get(nth).map(|(held, _)| held)));
        channels.chain(labels).filter_map(|(part, held)| match held {
            Some(Held::Here(texture)) => Some((part, *texture)),
            _ => None,
        })
    }

    /// The textures of all channels that are here.
    pub(super) fn textures(&self) -> impl Iterator<Item = TextureId> + '_ {
        let labels = self.labels.iter().map(|(held, _)| held);
        self.held.iter().chain(labels).filter_map(|held| match held {
            Held::Here(texture) => Some(*texture),
            _ => None,
        })
    }

    /// What draws those that are shown, if any is here.
    pub(super) fn renderer(&self) -> Option<&VolumeRenderer> {
        self.renderer.as_ref()
    }

    /// Has it drawn what is to be shown; where nothing draws it yet, by the shaders of what draws another
    /// time, if they are the same.
    pub(super) fn show(
        &mut self,
        gpu: &Gpu,
        textures: &mut Textures,
        (look, facts): (&VolumeLook, &VolumeFacts),
        beside: Option<&VolumeRenderer>,
    ) -> Result<(), VolumeError> {
        let shown: Vec<VolumeChannel> = look.shown().filter_map(|nth| self.shown(nth, look, facts)).collect();
        let labels = self.shown_labels(look);
        if shown.is_empty() && labels.is_none() {
            if let Some(before) = self.renderer.take() {
                before.forget(textures);
            }
            return Ok(());
        }
        let iso = look.iso_or_middle();
        let desc = VolumeDesc {
            mode: look.mode,
            step: look.step,
            density: look.density,
            iso: iso.map_or(0.5, |stored| (stored - facts.base) / facts.gain) as f32,
            clip: look.clip.of(&facts.of),
            labels,
            passes: PASSES,
            ..VolumeDesc::new(facts.of, shown)
        };
        // Other labels, or none, are another text.
        let of_labels = |desc: &VolumeDesc| {
            desc.labels.as_ref().map(|labels| (labels.layer, labels.colors.clone(), desc.channels.is_empty()))
        };
        let is_other = |before: &VolumeRenderer| of_labels(before.desc()) != of_labels(&desc);
        if let Some(before) = self.renderer.take_if(|before| is_other(before)) {
            before.forget(textures);
        }
        match &mut self.renderer {
            Some(renderer) if *renderer.desc() == desc => Ok(()),
            Some(renderer) => renderer.show(textures, desc),
            None => {
                let beside = beside.and_then(|other| other.beside(textures, desc.clone()).ok());
                let renderer = match beside {
                    Some(renderer) => renderer,
                    None => VolumeRenderer::new(gpu, textures, desc, PICTURE)?,
                };
                self.renderer = Some(renderer);
                self.made = NEXT.fetch_add(1, Ordering::Relaxed);
                Ok(())
            }
        }
    }

    fn shown(&self, nth: usize, look: &VolumeLook, facts: &VolumeFacts) -> Option<VolumeChannel> {
        let (Some(Held::Here(texture)), Some(channel)) = (self.held.get(nth), look.channels.get(nth)) else {
            return None;
        };
        let [low, high] = channel.range.unwrap_or(facts.bounds.unwrap_or([0.0, 1.0]));
        let range = drawable_range([low, high].map(|stored| (stored - facts.base) / facts.gain));
        Some(VolumeChannel {
            range,
            gamma: channel.gamma,
            opacity: channel.opacity,
            map: channel.map,
            ..VolumeChannel::new(*texture).in_color(channel.color)
        })
    }

    /// The device is another: what draws is to be made anew.
    pub(super) fn forget_device(&mut self, textures: &mut Textures) {
        if let Some(before) = self.renderer.take() {
            before.forget(textures);
        }
    }

    /// Gives back what it has of the textures.
    pub(super) fn remove(mut self, textures: &mut Textures) {
        self.forget_device(textures);
        for texture in self.textures() {
            textures.remove(texture);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_beyond_what_values_can_be_is_none_of_them() {
        let bits = |bounds: [i128; 2], label: i128| {
            let of = VolumeBox::new([1; 3], [1.0; 3]);
            LabelsPlace { of, begin: [0.0; 3], colors: Arc::default(), bounds, levels: None }.bits_of(label)
        };
        let (of_u8, of_i8, of_u32) = ([0, 255], [-128, 127], [0, i128::from(u32::MAX)]);
        let (of_i64, of_u64) = ([i64::MIN.into(), i64::MAX.into()], [0, u64::MAX.into()]);
        assert_eq!(
            (bits(of_u8, 44), bits(of_i8, -1), bits(of_u64, 1 << 32)),
            (Some(44), Some(0xffff_ffff), Some(1 << 32))
        );
        assert_eq!((bits(of_u32, u32::MAX.into()), bits(of_i64, -1)), (Some(0xffff_ffff), Some(u64::MAX)));
        for (bounds, label) in [(of_u8, 300), (of_u32, -1), (of_u32, (1 << 32) | 5), (of_u32, 1 << 32)] {
            assert!(bits(bounds, label).unwrap() >> 32 != 0, "{label}: no value has upper bits");
        }
        assert_eq!((bits(of_u64, -1), bits(of_i64, u64::MAX.into())), (None, None));
    }
}
