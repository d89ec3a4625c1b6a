//! How a volume is shown at first: as the command line says, in the words of `vastex render`, else as the
//! file does.

use anyhow::{Result, bail};
use vastex_viewer::volume::usual_channel_color;
use vastex_viewer::volume_scene::VolumeLook;

use super::{OpenedVolume, labels};
use crate::args::ViewArgs;

impl OpenedVolume {
    /// How it is shown at first: as the command line says, else as the file does.
    pub(crate) fn initial_look(&self, args: &ViewArgs) -> Result<VolumeLook> {
        let facts = &self.facts;
        let mut look = VolumeLook::first(facts);
        if let Some(view) = args.scene.volume_view() {
            view.change(&mut look, facts)?;
        }
        let asked = &args.volume;
        look.mode = asked.mode.unwrap_or(look.mode);
        look.iso = asked.iso.or(look.iso);
        look.step = asked.step.unwrap_or(look.step);
        look.density = asked.density.unwrap_or(look.density);
        if let Some(time) = asked.time.filter(|time| *time >= facts.times) {
            bail!("--time {time}: {} has the times 0 to {}", facts.name, facts.times - 1);
        }
        look.time = asked.time.unwrap_or(look.time);
        self.channels_of(args, &mut look)?;
        labels::shown_at_first(&asked.labels, facts, &mut look)?;
        Ok(look)
    }

    /// The channels that are asked for, in the words of `vastex render`.
    fn channels_of(&self, args: &ViewArgs, look: &mut VolumeLook) -> Result<()> {
        let (facts, asked) = (&self.facts, &args.volume.channels);
        let of_all = |[low, high]: [f64; 2]| match facts.bounds {
            Some([least, most]) => [low, high].map(|share| least + share * (most - least)),
            None => [low, high],
        };
        let range = args.scene.layers.range.map(|range| range.map(f64::from));
        let range = range.filter(|range| *range != [0.0, 1.0]);
        if asked.is_empty() {
            // A channel of a view may have one of its own.
            let view = args.scene.volume_view().and_then(|view| view.channels).unwrap_or_default();
            let has_own =
                |nth: usize| view.iter().any(|said| said.channel == nth as u64 && said.range.is_some());
            let range = range.map(of_all);
            for (_, channel) in look.channels.iter_mut().enumerate().filter(|(nth, _)| !has_own(*nth)) {
                channel.range = range.or(channel.range);
            }
            return Ok(());
        }
        if facts.channels.is_empty() {
            bail!("--channels: {} is a volume of labels, which have colours of their own", facts.name);
        }
        look.channels.iter_mut().for_each(|channel| channel.is_shown = false);
        for one in asked {
            let channel = usize::try_from(one.channel).ok().and_then(|nth| look.channels.get_mut(nth));
            let Some(channel) = channel else {
                bail!(
                    "--channels {}: {} has the channels 0 to {}",
                    one.channel,
                    facts.name,
                    facts.channels.len() - 1
                );
            };
            channel.is_shown = true;
            let nth = one.channel as usize;
            let usual = usual_channel_color(nth, facts.channels.len(), facts.channels[nth].color);
            channel.color = one.color.unwrap_or(if asked.len() == 1 { [255; 3] } else { usual });
            channel.map = one.map;
            channel.range = Some(one.range.unwrap_or_else(|| of_all(range.unwrap_or([0.0, 1.0]))));
            (channel.opacity, channel.gamma) = (one.opacity.unwrap_or(1.0), one.gamma.unwrap_or(1.0));
        }
        Ok(())
    }
}
