//! What a person chose of pools, by what the pools are: where textures are made anew, and in another run,
//! they have other numbers.

use std::collections::BTreeMap;

use vastex::{BiasRule, Description, PoolId, Textures};

/// The kind of a pool: how large its tiles are, and what formats their layers have, as `136x136 rgba8-srgb`.
/// Of several such pools the further ones have a number as well, in the order in which they came.
pub type PoolKind = String;

/// The kind of each pool that has a texture, in the order of their numbers.
pub fn pool_kinds(textures: &Textures) -> BTreeMap<PoolId, PoolKind> {
    let mut kinds: BTreeMap<PoolId, PoolKind> = BTreeMap::new();
    let all = textures.inspect().textures().filter_map(|texture| textures.texture(texture).ok());
    for texture in all {
        if let Some(pool) = texture.pool() {
            kinds.entry(pool).or_insert_with(|| kind_of(texture.description()));
        }
    }
    let mut seen: BTreeMap<PoolKind, u32> = BTreeMap::new();
    for kind in kinds.values_mut() {
        let count = seen.entry(kind.clone()).or_insert(0);
        *count += 1;
        if *count > 1 {
            *kind = format!("{kind} #{count}");
        }
    }
    kinds
}

fn kind_of(description: &Description) -> PoolKind {
    let tile = match description.geometry.tile() {
        [width, height, 1] => format!("{width}x{height}"),
        [width, height, depth] => format!("{width}x{height}x{depth}"),
    };
    let layer = |layer: &vastex::Layer| match layer.scale {
        1 => layer.format.name().to_owned(),
        scale => format!("{}/{scale}", layer.format.name()),
    };
    let layers: Vec<String> = description.layers.iter().map(layer).collect();
    format!("{tile} {}", layers.join("+"))
}

/// What a person chose of pools, which is theirs again where textures are made anew.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChosenPools {
    /// Bytes of pools that were sized by hand.
    pub sizes: BTreeMap<PoolKind, u64>,
    /// How the mip bias of pools is decided; `None` for never one.
    pub rules: BTreeMap<PoolKind, Option<BiasRule>>,
}

impl ChosenPools {
    /// Gives the pools of textures the sizes and rules that were chosen of such pools. Gives back which of
    /// them cannot have its size, and why.
    pub fn give(&self, textures: &mut Textures) -> Vec<(PoolKind, vastex::Error)> {
        let mut refused = Vec::new();
        if self.sizes.is_empty() && self.rules.is_empty() {
            return refused;
        }
        // One that is not there yet comes with another file.
        for (pool, kind) in pool_kinds(textures) {
            if let Some(rule) = self.rules.get(&kind) {
                drop(textures.memory().set_bias_rule(pool, *rule));
            }
            if let Some(bytes) = self.sizes.get(&kind)
                && let Err(error) = textures.memory().resize_pool(pool, *bytes)
            {
                refused.push((kind, error));
            }
        }
        refused
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use vastex::{ImageSource, Settings, TextureId};

    use super::*;
    use crate::gpu::Gpu;

    const MIB: u64 = 1 << 20;

    fn grey(textures: &mut Textures) -> TextureId {
        let image = ImageSource::r16(512, 512, vec![7; 512 * 512]).unwrap();
        textures.add_blocking(Arc::new(image)).unwrap()
    }

    fn coloured(textures: &mut Textures) -> TextureId {
        let image = ImageSource::rgba8(512, 512, vec![9; 512 * 512 * 4]).unwrap();
        textures.add_blocking(Arc::new(image)).unwrap()
    }

    fn bytes_of(textures: &Textures, texture: TextureId) -> u64 {
        let pool = textures.texture(texture).unwrap().pool().unwrap();
        textures.stats().pools.iter().find(|there| there.pool == pool).unwrap().bytes
    }

    /// Where the grey pool was the second one it may be the first one later, and the other way round.
    #[test]
    fn a_size_that_was_chosen_goes_to_the_same_kind_of_pool_whatever_its_number() {
        let gpu = pollster::block_on(Gpu::headless()).unwrap();
        let made = || Textures::new(&gpu.device, &gpu.queue, Settings::default()).unwrap();
        let mut before = made();
        let (first, second) = (coloured(&mut before), grey(&mut before));
        let pool = |texture| before.texture(texture).unwrap().pool().unwrap();
        assert_ne!(pool(first), pool(second));
        let kinds = pool_kinds(&before);
        assert_eq!(kinds.len(), 2, "{kinds:?}");
        let kind = kinds[&pool(second)].clone();
        assert!(kind.ends_with(" r16"), "{kind}");
        let mut chosen = ChosenPools::default();
        chosen.sizes.insert(kind.clone(), 3 * MIB);
        chosen.rules.insert(kind, None);
        let [of_coloured, of_grey] = [first, second].map(|texture| bytes_of(&before, texture));
        for order in [[true, false], [false, true]] {
            let mut after = made();
            let [one, other] = order.map(|is_grey| match is_grey {
                true => (true, grey(&mut after)),
                false => (false, coloured(&mut after)),
            });
            assert!(chosen.give(&mut after).is_empty());
            for (is_grey, texture) in [one, other] {
                let (bytes, pool) = (bytes_of(&after, texture), after.texture(texture).unwrap().pool());
                let is_as_chosen = match is_grey {
                    true => bytes != of_grey && (2 * MIB..=3 * MIB).contains(&bytes),
                    false => bytes == of_coloured,
                };
                assert!(is_as_chosen, "{bytes} bytes; before {of_coloured} and {of_grey}");
                assert_eq!(after.inspect().bias_rule(pool.unwrap()).is_none(), is_grey);
            }
        }
    }

    #[test]
    fn a_pool_that_cannot_be_so_large_is_named() {
        let gpu = pollster::block_on(Gpu::headless()).unwrap();
        let mut textures = Textures::new(&gpu.device, &gpu.queue, Settings::default()).unwrap();
        let texture = grey(&mut textures);
        let before = bytes_of(&textures, texture);
        let kind = pool_kinds(&textures).into_values().next().unwrap();
        let chosen = ChosenPools { sizes: [(kind.clone(), 1)].into(), ..ChosenPools::default() };
        let refused = chosen.give(&mut textures);
        assert!(matches!(&refused[..], [(of, _)] if *of == kind), "{refused:?}");
        assert_eq!(bytes_of(&textures, texture), before);
    }
}
