//! What is drawn of a volume at one time, and how pictures of a path go on to another.

use std::sync::Arc;

use anyhow::Result;
use vastex::{TextureSettings, Textures, TileSource};
use vastex_scenes::Gpu;
use vastex_tiles::DiskTier;
use vastex_viewer::volume::{
    VolumeBox, VolumeChannel, VolumeClip, VolumeDesc, VolumeRenderer, volume_tables,
};
use vastex_volume::VolumeSource;

use super::super::render_labels::Labels;
use super::asked::Asked;
use super::{Drawing, PICTURE, all_as_shown, middle_of, sampled};
use crate::args::{AskedChannel, RenderVolumeArgs, VolumeFilter};
use crate::made_levels::LevelMaker;
use crate::{disk_cache, report};

/// What is shown of a volume at one time, in textures, and what draws it.
pub(super) struct AtTime {
    pub(super) shown: Vec<(AskedChannel, Arc<VolumeSource>)>,
    pub(super) maker: LevelMaker,
    pub(super) renderer: VolumeRenderer,
}

impl AtTime {
    pub(super) fn new(
        (args, gpu): (&RenderVolumeArgs, &Gpu),
        textures: &mut Textures,
        (of, channels, sources): (VolumeBox, &[AskedChannel], &[Arc<VolumeSource>]),
        labels: Option<&Labels>,
        (clip, disk): (VolumeClip, Option<&Arc<DiskTier>>),
    ) -> Result<AtTime> {
        let shown: Vec<_> = channels.iter().copied().zip(sources.iter().cloned()).collect();
        let mut ids = Vec::new();
        for source in sources {
            let voxels = Some(source.levels().clone());
            let page_table = volume_tables(source.description().geometry.page_count(), channels.len());
            let own = TextureSettings { voxels, page_table, ..TextureSettings::default() };
            let tiles = disk_cache::before_volume(source, disk);
            let prepared = textures.preparer().read_blocking(tiles, own)?;
            ids.push(textures.add_volume(prepared)?);
        }
        let of_labels = labels.iter().map(|labels| &labels.source);
        if let Some(lacking) = sources.iter().chain(of_labels).find(|source| source.has_levels_to_make()) {
            let path = &lacking.volume().about().path;
            report::say(&format!("note: {path}: levels that the file lacks are made meanwhile"));
        }
        let mut maker = LevelMaker::start(ids.iter().copied().zip(sources.iter().cloned()).collect())?;
        let plain: Vec<VolumeChannel> = ids.into_iter().map(VolumeChannel::new).collect();
        let channels = all_as_shown(args, &plain, &shown)?;
        let iso = args.look.iso.zip(sources.first()).map(|(iso, source)| sampled(source, iso));
        let mut shown_labels = None;
        if let Some(labels) = labels {
            let shown = labels.add(args, textures, sources.is_empty())?;
            maker.add(shown.layer.texture(), labels.source.clone())?;
            shown_labels = Some(shown);
        }
        let desc = VolumeDesc {
            mode: args.look.mode(),
            step: args.look.step(),
            density: args.look.density(),
            clip,
            // In the middle of what is seen, where a view leaves it there.
            iso: iso.unwrap_or_else(|| middle_of(&channels)) as f32,
            is_exact: args.filter == VolumeFilter::Exact,
            labels: shown_labels,
            ..VolumeDesc::new(of, channels)
        };
        let renderer = VolumeRenderer::new(gpu, textures, desc, PICTURE)?;
        Ok(AtTime { shown, maker, renderer })
    }
}

impl Drawing<'_> {
    /// Shows the volume at another time; nothing of the one before stays in the pools.
    pub(super) fn go_to(&mut self, asked: &Asked, brick: u32, disk: Option<&Arc<DiskTier>>) -> Result<()> {
        let (labels, sources) = (asked.labels(self.args, brick)?, asked.sources(self.args, brick)?);
        let before = self.renderer.desc().clone();
        self.renderer.give_back(&mut self.textures);
        let layers = before.channels.iter().map(|channel| channel.layer);
        for layer in layers.chain(before.labels.as_ref().map(|labels| labels.layer)) {
            self.textures.remove(layer.texture());
        }
        let (with, what) = ((self.args, self.gpu), (before.of, &asked.channels[..], &sources[..]));
        let at = AtTime::new(with, &mut self.textures, what, labels.as_ref(), (before.clip, disk))?;
        (self.shown, self.maker, self.renderer) = (at.shown, at.maker, at.renderer);
        Ok(())
    }
}
