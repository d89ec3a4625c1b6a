//! How large pools are and whether their pictures may become coarser; `vastex.toml` says the same (`file`).

use vastex_core::{BiasRule, Description, LayerFormat, Pager, PoolEstimate, PoolLayout};
use vastex_wgpu::array_limits;

/// The settings of all pools.
///
/// A pool gets the settings of `default_pool`, then those of each rule that suits its textures, in order: a
/// later rule overrides the settings that it names, and leaves the rest.
///
/// Later versions may have more fields: write `PoolSettings { default_pool, ..PoolSettings::default() }`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoolSettings {
    /// The settings of every pool, unless a rule overrides them.
    pub default_pool: PoolTuning,
    /// Rules for some pools.
    pub rules: Vec<PoolRule>,
    /// What the sizes of pools in a scale group are multiplied by.
    pub scale_groups: ScaleGroups,
}

/// Settings for the pools of some textures. A rule without conditions suits all.
///
/// Later versions may have more fields: write `PoolRule { tuning, ..PoolRule::default() }`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoolRule {
    /// The formats of the layers, in order, as the file or as the device has them; `None` suits any.
    pub formats: Option<Vec<LayerFormat>>,
    /// Texels per side of a tile, border included, at least; of one that is not square, of its longer side.
    pub tile_min: Option<u32>,
    /// Texels per side of a tile, border included, at most; of one that is not square, of its longer side.
    pub tile_max: Option<u32>,
    /// The settings for pools that the rule suits.
    pub tuning: PoolTuning,
}

/// The settings of a pool; `None` leaves a setting as it is.
///
/// Later versions may have more fields: write `PoolTuning { bytes, ..PoolTuning::default() }`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoolTuning {
    /// GPU memory in bytes, an upper bound. Unset, it follows from the picture: see [`PoolEstimate`] (which
    /// is 1 GiB at most) and [`Settings::picture`](crate::Settings::picture).
    pub bytes: Option<u64>,
    /// `Some(true)` multiplies the size by the factor of the pool's scale group; unset, it is not multiplied.
    pub allow_size_scale: Option<bool>,
    /// The scale group, 0 to 2; unset, 0.
    pub scale_group: Option<u8>,
    /// `Some(false)` keeps the picture from becoming coarser if the pool is too small; unset, it may. If it
    /// may not, the pages that came first are shown, and the others by their ancestors.
    pub residency_mip_bias: Option<bool>,
    /// How the mip bias is decided if there may be one; unset, it is solved. All pools with an integrating
    /// rule share the largest bias of any of them.
    pub mip_bias_rule: Option<BiasRule>,
    /// The share of the slots that pins may take, tails included, in percent: at most 80; unset, 50.
    pub pin_share: Option<u32>,
}

/// The factors of the scale groups, 1 unless set: so that one number makes many pools smaller or larger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScaleGroups(pub [f64; 3]);

impl Default for ScaleGroups {
    fn default() -> ScaleGroups {
        ScaleGroups([1.0; 3])
    }
}

/// What a pool is made with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PoolPlan {
    pub(crate) bytes: u64,
    pub(crate) mip_bias: Option<BiasRule>,
    pub(crate) pin_share: u32,
}

impl PoolSettings {
    /// Every pool of `bytes`.
    pub fn of_bytes(bytes: u64) -> PoolSettings {
        let default_pool = PoolTuning { bytes: Some(bytes), ..PoolTuning::default() };
        PoolSettings { default_pool, ..PoolSettings::default() }
    }

    /// Makes every pool of `bytes`, whatever the settings said of sizes and scales.
    pub fn set_bytes(&mut self, bytes: u64) {
        let size = PoolTuning { bytes: Some(bytes), allow_size_scale: Some(false), ..PoolTuning::default() };
        self.rules.push(PoolRule { tuning: size, ..PoolRule::default() });
    }

    /// The pool of textures like this, as the file and as the device has it, for a picture of so many pixels.
    pub(crate) fn plan(&self, stored: &Description, held: &Description, picture: [u32; 2]) -> PoolPlan {
        let suiting = self.rules.iter().filter(|rule| rule.suits(stored) || rule.suits(held));
        let tuning = suiting.fold(self.default_pool, |tuning, rule| tuning.overridden_by(rule.tuning));
        let bytes = tuning.bytes.unwrap_or_else(|| PoolEstimate::new(held, picture).bytes());
        let group = usize::from(tuning.scale_group.unwrap_or(0));
        let factor = self.scale_groups.0.get(group).filter(|_| tuning.allow_size_scale.unwrap_or(false));
        let may_be_coarser = tuning.residency_mip_bias.unwrap_or(true);
        PoolPlan {
            bytes: factor.map_or(bytes, |factor| (bytes as f64 * factor) as u64),
            mip_bias: may_be_coarser.then(|| tuning.mip_bias_rule.unwrap_or_default()),
            pin_share: tuning.pin_share.unwrap_or(Pager::PIN_SHARE),
        }
    }
}

impl PoolRule {
    fn suits(&self, description: &Description) -> bool {
        let [width, height, _] = description.geometry.tile();
        let side = width.max(height);
        let formats = || description.layers.iter().map(|layer| layer.format);
        self.formats.as_ref().is_none_or(|wanted| formats().eq(wanted.iter().copied()))
            && self.tile_min.is_none_or(|min| side >= min)
            && self.tile_max.is_none_or(|max| side <= max)
    }
}

impl PoolTuning {
    /// GPU memory in bytes of a pool that shows so many tiles at once, of textures that the device holds like
    /// `held`, without becoming coarser ([`BiasRule::Solved`]), on a device of such limits: more than the
    /// tiles take, since a tenth of the slots is kept free, and slots are a grid. `None` where no pool of the
    /// device has so many.
    pub fn bytes_for(tiles: u64, held: &Description, limits: &wgpu::Limits) -> Option<u64> {
        PoolLayout::budget_for(held, BiasRule::slots_for(tiles), array_limits(limits))
    }

    pub(crate) fn overridden_by(self, other: PoolTuning) -> PoolTuning {
        PoolTuning {
            bytes: other.bytes.or(self.bytes),
            allow_size_scale: other.allow_size_scale.or(self.allow_size_scale),
            scale_group: other.scale_group.or(self.scale_group),
            residency_mip_bias: other.residency_mip_bias.or(self.residency_mip_bias),
            mip_bias_rule: other.mip_bias_rule.or(self.mip_bias_rule),
            pin_share: other.pin_share.or(self.pin_share),
        }
    }
}
