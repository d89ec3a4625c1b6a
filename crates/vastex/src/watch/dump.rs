//! What is in the pools, and whose it is, for people and scripts: the first thing to look at when a pool is
//! too small.

use std::fmt;

use serde::Serialize;

/// All pools, in the order of their numbers. Shown as text with `{}`, serialized under the names of its
/// fields, which scripts rely on.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct PoolDump {
    /// The pools.
    pub pools: Vec<DumpedPool>,
}

/// What is in a pool.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DumpedPool {
    /// Number of the pool.
    pub pool: u16,
    /// The pool's tiles, for people: size in texels, formats of the layers.
    pub tiles: String,
    /// The pool's bytes in GPU memory; 0 while it has no textures.
    pub bytes: u64,
    /// Slots of the pool.
    pub slots: u32,
    /// Slots that hold a tile.
    pub occupied: u32,
    /// The pages whose tiles those are: more, where pages of the same content share one.
    pub pages: u32,
    /// Slots that are not given up whatever is in view: tails, and what is pinned by hand.
    pub locked: u32,
    /// The mip bias in force, in levels.
    pub bias: f64,
    /// The pool's textures, the one with the most pages first.
    pub textures: Vec<DumpedTexture>,
}

/// What a pool holds of one texture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DumpedTexture {
    /// Number of the texture.
    pub texture: u16,
    /// The name that the application gave it, if it did.
    pub name: Option<String>,
    /// The texture's pages whose tiles are in slots, the tail among them.
    pub pages: u32,
    /// The texture's pages in slots by level, finest first, levels without pages left out; the tail counts as
    /// its finest level.
    pub levels: Vec<LevelPages>,
    /// The finest level that may be shown or asked for.
    pub finest: u8,
    /// The coarsest, before the pool's mip bias.
    pub coarsest: u8,
    /// The texture's own bias, in levels.
    pub bias: f32,
}

/// The pages of a level that are in the pool.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct LevelPages {
    /// The level.
    pub level: u8,
    /// Pages of that level whose tiles are in slots.
    pub pages: u32,
}

impl fmt::Display for PoolDump {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (nth, pool) in self.pools.iter().enumerate() {
            let separator = if nth == 0 { "" } else { "\n" };
            write!(f, "{separator}{pool}")?;
        }
        Ok(())
    }
}

impl fmt::Display for DumpedPool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let DumpedPool { pool, tiles, slots, occupied, pages, locked, bias, .. } = self;
        let share = 100.0 * f64::from(*occupied) / f64::from((*slots).max(1));
        write!(f, "pool {pool}, tiles of {tiles}: {slots} slots, {occupied} occupied ({share:.1} %)")?;
        if pages > occupied {
            write!(f, " by {pages} pages")?;
        }
        write!(f, ", {locked} locked; mip bias {bias}")?;
        self.textures.iter().try_for_each(|texture| write!(f, "\n{texture}"))
    }
}

impl fmt::Display for DumpedTexture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let DumpedTexture { texture, name, pages, levels, finest, coarsest, bias } = self;
        let pages_word = if *pages == 1 { "page" } else { "pages" };
        write!(f, "{pages:>7} {pages_word} of texture {texture}")?;
        if let Some(name) = name {
            write!(f, " ({name})")?;
        }
        for (nth, LevelPages { level, pages }) in levels.iter().enumerate() {
            let separator = if nth == 0 { ": " } else { ", " };
            write!(f, "{separator}{pages} of level {level}")?;
        }
        write!(f, "; levels {finest} to {coarsest}, bias {bias}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_see_the_largest_first_with_their_names() {
        let texture = |texture, name: Option<&str>, levels: &[(u8, u32)]| DumpedTexture {
            texture,
            name: name.map(str::to_owned),
            pages: levels.iter().map(|&(_, pages)| pages).sum(),
            levels: levels.iter().map(|&(level, pages)| LevelPages { level, pages }).collect(),
            finest: 0,
            coarsest: 7,
            bias: 0.5,
        };
        let textures = vec![texture(4, Some("earth"), &[(0, 20), (5, 1)]), texture(0, None, &[(7, 1)])];
        let (tiles, bytes) = ("40x40 texels of rgba8".to_owned(), 6400 * 100);
        let pool = DumpedPool {
            pool: 1,
            tiles,
            bytes,
            slots: 88,
            occupied: 22,
            pages: 22,
            locked: 2,
            bias: 0.125,
            textures,
        };
        let shared = DumpedPool { occupied: 3, textures: Vec::new(), ..pool.clone() };
        let (slots, locked) = ("88 slots, 3 occupied (3.4 %) by 22 pages", "2 locked; mip bias 0.125");
        assert_eq!(shared.to_string(), format!("pool 1, tiles of 40x40 texels of rgba8: {slots}, {locked}"));
        let expected = "pool 1, tiles of 40x40 texels of rgba8: 88 slots, 22 occupied (25.0 %), 2 locked; mip bias 0.125\n     \
                        21 pages of texture 4 (earth): 20 of level 0, 1 of level 5; levels 0 to 7, bias 0.5\n      \
                        1 page of texture 0: 1 of level 7; levels 0 to 7, bias 0.5";
        assert_eq!(PoolDump { pools: vec![pool] }.to_string(), expected);
    }
}
