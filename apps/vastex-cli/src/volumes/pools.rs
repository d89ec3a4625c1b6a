//! GPU memory for volumes in the window: what the bricks of channels and of labels take where nobody says how
//! much.

use anyhow::Result;
use vastex::{
    Description, Layer, LayerFormat, PoolRule, PoolSettings, PoolTuning, Settings, TileSource, wgpu,
};
use vastex_viewer::volume_scene::VolumeLook;
use vastex_volume::VolumeSource;

use super::OpenedVolume;
use crate::args::SceneArgs;
use crate::commands::render;
use crate::commands::render_pools::MOST_BYTES;

/// GPU memory that is taken for bricks at least where nobody says how much, which is little.
const LEAST_BYTES: u64 = 32 << 20;
/// Times of which bricks are kept: the one that is seen, the one that comes, and two ahead.
const TIMES: u64 = 4;

/// A channel of a volume as devices hold it at most: those that do not filter 8 bits well hold them as 16.
pub(super) fn held(source: &VolumeSource) -> Description {
    let mut held = Description::clone(source.description());
    for layer in &mut held.layers {
        if layer.format == LayerFormat::R8 {
            layer.format = LayerFormat::R16;
        }
    }
    held
}

/// The bytes of a brick, and how many there are of a channel at a time.
pub(super) fn bricks_of(held: &Description) -> (u64, u64) {
    (held.tile_bytes() as u64, held.geometry.page_count())
}

impl OpenedVolume {
    /// Settings of the textures of a volume, for the channels that are shown at first: with memory for all of
    /// their bricks, up to a gibibyte, where nobody says how much, and as much for labels of its size.
    pub(crate) fn settings(&self, args: &SceneArgs) -> Result<Settings> {
        let settings = render::settings(args)?;
        let pools = args.pool_mib.map_or_else(|| self.usual_pools(), |mib| PoolSettings::of_bytes(mib << 20));
        Ok(Settings {
            pools,
            // Bricks are large, and nothing else needs the way.
            upload_bytes_per_frame: settings.upload_bytes_per_frame.max(8 << 20),
            in_flight_bytes: settings.in_flight_bytes.max(32 << 20),
            fade: std::time::Duration::ZERO,
            filter: vastex::Filter::Trilinear,
            feedback: None,
            whole_bytes: 0,
            ..settings
        })
    }

    fn usual_pools(&self) -> PoolSettings {
        let shown = VolumeLook::first(&self.facts).shown().count().max(1) as u64;
        let times = self.facts.times.min(TIMES);
        // Tails and some bricks of each channel that may be shown beside them.
        let others = self.facts.channels.len().min(16) as u64 * 2 + 2;
        let default_pool = pool(&self.held, self.bricks(shown * times), others);
        let of_labels = |format: LayerFormat| {
            let held = Description { layers: vec![Layer::new("labels", format)], ..self.held.clone() };
            let tuning = pool(&held, self.bricks(times), 2);
            PoolRule { formats: Some(vec![format]), tuning, ..PoolRule::default() }
        };
        let rules = [LayerFormat::R32Uint, LayerFormat::Rg32Uint].map(of_labels).to_vec();
        PoolSettings { default_pool, rules, ..PoolSettings::default() }
    }

    /// Bricks of so many channels and times.
    fn bricks(&self, sets: u64) -> u64 {
        self.held.geometry.page_count().saturating_mul(sets)
    }
}

/// A pool that shows so many bricks at once, if that takes no more than a gibibyte, with so many others.
fn pool(held: &Description, bricks: u64, others: u64) -> PoolTuning {
    let tiles = bricks.saturating_add(others);
    // The usual limits: it is too early to ask for those of a device.
    let bytes = PoolTuning::bytes_for(tiles, held, &wgpu::Limits::default()).unwrap_or(u64::MAX);
    let most = MOST_BYTES + others * held.tile_bytes() as u64;
    PoolTuning { bytes: Some(bytes.clamp(LEAST_BYTES, most)), ..PoolTuning::default() }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use vastex::{BiasRule, Geometry, GeometrySpec};
    use vastex_core::{ArrayLimits, PoolLayout};

    use super::*;
    use crate::volumes::{OpenHow, open_volume};

    const LIMITS: ArrayLimits = ArrayLimits { max_side: 8192, max_images: 256, max_side_3d: 2048 };

    #[test]
    fn all_bricks_of_channels_and_of_labels_have_room() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/volumes/nuclei.zip");
        let opened = open_volume(&path, OpenHow::default()).unwrap();
        for side in [64, 256, 300, 390, 520, 650] {
            let spec = GeometrySpec { page: 64, border: 1, ..GeometrySpec::volume([side, side, 256]) };
            let held = Description::one_layer(Geometry::new(spec).unwrap(), LayerFormat::R16);
            let bricks = held.geometry.page_count();
            let opened = OpenedVolume { held, facts: opened.facts.clone(), ..reopened(&opened) };
            let pools = opened.usual_pools();
            let labels = |format| {
                let of = |rule: &&PoolRule| rule.formats.as_deref() == Some(&[format]);
                let bytes = pools.rules.iter().find(of).unwrap().tuning.bytes.unwrap();
                (Description { layers: vec![Layer::new("labels", format)], ..opened.held.clone() }, bytes)
            };
            let all = [
                (opened.held.clone(), pools.default_pool.bytes.unwrap()),
                labels(LayerFormat::R32Uint),
                labels(LayerFormat::Rg32Uint),
            ];
            for (held, bytes) in all {
                let slots = PoolLayout::fit(&held, bytes, LIMITS).unwrap().slots();
                let has_room = u64::from(BiasRule::room(slots)) >= bricks;
                assert!(has_room || bytes >= MOST_BYTES, "{side}: {bricks} bricks, {slots} slots");
            }
        }
    }

    fn reopened(opened: &OpenedVolume) -> OpenedVolume {
        OpenedVolume {
            volume: opened.volume.clone(),
            facts: opened.facts.clone(),
            held: opened.held.clone(),
            how: OpenHow::default(),
            brick: opened.brick,
        }
    }
}
