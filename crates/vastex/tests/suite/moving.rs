//! What the tests of recording ahead and of failures share: two textures of one pool side by side, seen from
//! a camera that moves so fast that page tables grow and pages leave, and what each pixel may show.

use std::fmt::Debug;
use std::ops::Range;

use vastex::{
    AddressMode, Dims, FeedbackMode, PoolSettings, Sampled, Settings, TableChoice, TextureSettings, Textures,
};
use vastex_tiles::PropertySource;

use crate::common::texts::telling;
use crate::common::{Mapping, PICTURE, Screen, add_with, property, settings};

pub(crate) const SIZES: [[u32; 2]; 2] = [[4000, 3000], [900, 900]];

/// What is alike in a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Case {
    pub(crate) mode: FeedbackMode,
    pub(crate) tables: TableChoice,
}

impl Case {
    /// Every feedback mode with either kind of page table.
    pub(crate) fn all() -> impl Iterator<Item = Case> {
        let of = |mode| [TableChoice::Direct, TableChoice::Hashed].map(move |tables| Case { mode, tables });
        FeedbackMode::ALL.into_iter().flat_map(of)
    }

    /// Texels of a page's side: so few where a hashed table is to grow that it has many pages.
    pub(crate) fn page(self) -> u32 {
        if self.tables == TableChoice::Hashed { 16 } else { 64 }
    }

    /// Bytes of a pool for so many pages in the view of a direct table, and of as many as it takes for a
    /// hashed one to grow.
    pub(crate) fn pool_bytes(self, tiles: u64) -> u64 {
        let side = u64::from(self.page()) + 8;
        tiles * side * side * 4 * if self.tables == TableChoice::Hashed { 12 } else { 1 }
    }

    pub(crate) fn add(self, textures: &mut Textures, nth: usize) -> Sampled {
        let source = property(SIZES[nth], self.page(), AddressMode::Clamp);
        let settings = TextureSettings { page_table: self.tables, ..Default::default() };
        add_with(textures, source, settings).unwrap().into()
    }

    fn settings(self, pool_bytes: u64) -> Settings {
        Settings {
            feedback: Some(self.mode),
            pools: PoolSettings::of_bytes(pool_bytes),
            upload_bytes_per_frame: self.pool_bytes(6),
            ..settings()
        }
    }

    /// Both textures, seen as in the first frame.
    pub(crate) fn screen(self, tiles: u64) -> Screen {
        let settings = self.settings(self.pool_bytes(tiles));
        let mut screen = Screen::showing_all(settings, &telling(), |textures| {
            (0..2).map(|nth| self.add(textures, nth)).collect()
        });
        screen.set_mapping(1, &beside());
        screen
    }

    /// The first texture alone, in a pool of exactly so many tiles.
    pub(crate) fn of_one(self, tiles: u64) -> Screen {
        let side = u64::from(self.page()) + 8;
        let settings = self.settings(tiles * side * side * 4);
        Screen::showing(settings, &telling(), |textures| self.add(textures, 0))
    }
}

/// Down from an overview to level 0, and on over the texture, fast enough for pages to leave.
pub(crate) fn flight(frame: u32) -> Mapping {
    let down = f64::from(frame.min(15)) / 15.0;
    let on = f64::from(frame.saturating_sub(15)) / 20.0;
    let centre = [0.45 + 0.3 * (1.3 * on).sin(), 0.45 + 0.25 * (2.1 * on).sin()];
    Mapping::new(SIZES[0], centre, 12.0 * (0.9 / 12.0f64).powf(down), 1.0, 0.4)
}

/// How the second texture is seen, in the right half of the picture.
pub(crate) fn beside() -> Mapping {
    Mapping::new(SIZES[1], [0.4, 0.5], 1.3, 1.0, 0.2)
}

/// The columns of the picture that show a texture.
pub(crate) fn columns(nth: usize) -> Range<u32> {
    let half = PICTURE[0] / 2;
    if nth == 0 { 0..half } else { half..PICTURE[0] }
}

/// How many pixels of a texture show something else than the texel where they are, at whatever level; those
/// within 1/50 of an edge may be either.
pub(crate) fn wrong_pixels(picture: &[[u8; 4]], nth: usize, mapping: &Mapping) -> usize {
    wrong_among(picture, nth, mapping, &columns(nth))
}

/// The same where the first texture is all over the picture.
pub(crate) fn wrong_in_all(picture: &[[u8; 4]], mapping: &Mapping) -> usize {
    wrong_among(picture, 0, mapping, &(0..PICTURE[0]))
}

fn wrong_among(picture: &[[u8; 4]], nth: usize, mapping: &Mapping, columns: &Range<u32>) -> usize {
    let is_wrong = |(n, colour): (u32, &[u8; 4])| {
        let (level, shown) = PropertySource::texel_from_color(Dims::D2, *colour);
        let at = [n % PICTURE[0], n / PICTURE[0]].map(|pixel| f64::from(pixel) + 0.5);
        let texel: [f64; 2] = std::array::from_fn(|a| {
            let of = |part: [f32; 2]| f64::from(part[a]);
            let uv = of(mapping.origin) + of(mapping.along_x) * at[0] + of(mapping.along_y) * at[1];
            uv * f64::from(SIZES[nth][a]) / 2f64.powi(i32::from(level))
        });
        let is_near_edge = texel.iter().any(|texel| (texel - texel.round()).abs() < 0.02);
        level > 12 || !is_near_edge && (0..2).any(|a| texel[a].floor() as i64 % 4096 != i64::from(shown[a]))
    };
    let is_shown = |n: u32| columns.contains(&(n % PICTURE[0]));
    (0..).zip(picture).filter(|&(n, colour)| is_shown(n) && is_wrong((n, colour))).count()
}

/// Nothing is missing, telemetry has a record of each frame, and all of them together are what has happened.
/// The settings keep that many records.
#[track_caller]
pub(crate) fn check_counts(screen: &Screen, what: &impl Debug) {
    let textures = &screen.textures;
    let stats = textures.stats();
    assert_eq!(stats.pager.missing, 0, "{what:?}: {stats:?}");
    let records: Vec<_> = textures.inspect().telemetry().iter().map(|record| record.pager).collect();
    let frames: Vec<u64> = records.iter().map(|record| record.frame).collect();
    assert!(frames.iter().copied().eq(0..stats.frame), "{what:?}: {frames:?}");
    let sum = |of: fn(&vastex::diagnostics::Stats) -> u64| {
        records.iter().map(|record| of(&record.stats)).sum::<u64>()
    };
    let counted = [sum(|s| s.loaded), sum(|s| s.evicted), sum(|s| s.uploaded_bytes), sum(|s| s.requests)];
    let of = &stats.pager;
    assert_eq!(counted, [of.loaded, of.evicted, of.uploaded_bytes, of.requests], "{what:?}");
}
