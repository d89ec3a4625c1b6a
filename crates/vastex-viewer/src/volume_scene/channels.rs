//! Which textures hold the channels of a volume at a time, and which are still to come.

use vastex::{TextureId, Textures};

use super::look::{VolumeFacts, VolumeLook};
use crate::gpu::Gpu;
use crate::volume::{VolumeChannel, VolumeDesc, VolumeError, VolumeRenderer};

use super::picture::PICTURE;

/// A channel at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Held {
    Absent,
    Asked,
    Refused,
    Here(TextureId),
}

/// The channels at one time, and what draws them.
#[derive(Debug)]
pub(super) struct Channels {
    pub(super) time: u64,
    held: Vec<Held>,
    renderer: Option<VolumeRenderer>,
}

impl Channels {
    pub(super) fn new(time: u64, count: usize) -> Channels {
        Channels { time, held: vec![Held::Absent; count], renderer: None }
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

    /// Whether every channel that is shown is here, or will never be.
    pub(super) fn is_complete(&self, look: &VolumeLook) -> bool {
        look.shown().all(|channel| matches!(self.held.get(channel), Some(Held::Here(_) | Held::Refused)))
    }

    /// Whether a channel that is shown is still to come.
    pub(super) fn waits(&self, look: &VolumeLook) -> bool {
        look.shown().any(|channel| matches!(self.held.get(channel), Some(Held::Asked | Held::Absent)))
    }

    /// The texture of a channel, if it is here.
    pub(super) fn texture(&self, channel: usize) -> Option<TextureId> {
        match self.held.get(channel) {
            Some(Held::Here(texture)) => Some(*texture),
            _ => None,
        }
    }

    /// The textures of all channels that are here.
    pub(super) fn textures(&self) -> impl Iterator<Item = TextureId> + '_ {
        self.held.iter().filter_map(|held| match held {
            Held::Here(texture) => Some(*texture),
            _ => None,
        })
    }

    /// What draws those that are shown, if any is here.
    pub(super) fn renderer(&self) -> Option<&VolumeRenderer> {
        self.renderer.as_ref()
    }

    /// Has it drawn what is to be shown.
    pub(super) fn show(
        &mut self,
        gpu: &Gpu,
        textures: &mut Textures,
        (look, facts): (&VolumeLook, &VolumeFacts),
    ) -> Result<(), VolumeError> {
        let shown: Vec<VolumeChannel> = look.shown().filter_map(|nth| self.shown(nth, look, facts)).collect();
        if shown.is_empty() {
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
            ..VolumeDesc::new(facts.of, shown)
        };
        match &mut self.renderer {
            Some(renderer) if *renderer.desc() == desc => Ok(()),
            Some(renderer) => renderer.show(textures, desc),
            None => {
                self.renderer = Some(VolumeRenderer::new(gpu, textures, desc, PICTURE)?);
                Ok(())
            }
        }
    }

    fn shown(&self, nth: usize, look: &VolumeLook, facts: &VolumeFacts) -> Option<VolumeChannel> {
        let (Some(Held::Here(texture)), Some(channel)) = (self.held.get(nth), look.channels.get(nth)) else {
            return None;
        };
        let [low, high] = channel.range.unwrap_or(facts.bounds.unwrap_or([0.0, 1.0]));
        // A range without a middle shows what is above it.
        let high = if low == high { low + facts.gain.abs() * 1e-6 } else { high };
        let range = [low, high].map(|stored| ((stored - facts.base) / facts.gain) as f32);
        Some(VolumeChannel {
            range,
            gamma: channel.gamma,
            opacity: channel.opacity,
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
