//! The property image: every pixel of a picture says which texel it came from, and the pages that were asked
//! for are counted. Both are compared with an oracle that is written from the definitions, in f64, and shares
//! no code with the shaders or their twins.

use std::collections::BTreeMap;

use crate::common::{Mapping, PICTURE, Screen, property, settings};
use vastex::diagnostics::PageState;
use vastex::{AddressMode, PageId, PagePos, PoolSettings, Settings};
use vastex_core::{Dims, shader_constants};
use vastex_tiles::PropertySource;

const SIZES: [[u32; 2]; 3] = [[1000, 777], [777, 1000], [1, 1]];
const PAGES: [u32; 2] = [128, 254];
/// How close to the next texel a position may be, in texels, for single precision to be sure of it.
const DOUBT: f64 = 1e-3;

/// Magnified, about 1:1, minified by several levels, stretched, over the edges, and all of it at once.
fn mappings(size: [u32; 2]) -> [Mapping; 7] {
    [
        Mapping::new(size, [0.41, 0.63], 0.11, 1.0, 0.3),
        Mapping::new(size, [0.52, 0.47], 1.02, 1.0, 0.7),
        Mapping::new(size, [0.37, 0.58], 2.9, 0.8, -0.4),
        Mapping::new(size, [0.48, 0.51], 1.3, 3.3, 1.9),
        Mapping::new(size, [0.97, 0.04], 1.7, 1.0, 2.6),
        Mapping::new(size, [0.02, 0.99], 0.9, 1.2, -2.2),
        Mapping::new(size, [0.55, 0.45], 11.0, 1.0, 0.2),
    ]
}

/// What each pixel should show and want.
struct Oracle<'a> {
    size: [u32; 2],
    page: u32,
    address: AddressMode,
    tail_level: u8,
    mapping: &'a Mapping,
}

impl Oracle<'_> {
    fn level_size(&self, level: u8) -> [u32; 2] {
        let mut size = self.size;
        (0..level).for_each(|_| size = size.map(|n| n.div_ceil(2)));
        size
    }

    fn coarsest(&self) -> u8 {
        (0..).find(|&level| self.level_size(level) == [1, 1]).unwrap_or(u8::MAX)
    }

    /// `min(max(log2(texels per pixel), 0) + bias, coarsest)`.
    fn exact_level(&self, bias: f64) -> f64 {
        let texels = |uv: [f32; 2]| {
            (f64::from(uv[0]) * f64::from(self.size[0])).hypot(f64::from(uv[1]) * f64::from(self.size[1]))
        };
        let longest = texels(self.mapping.along_x).max(texels(self.mapping.along_y));
        assert!((longest.log2() - longest.log2().round()).abs() > DOUBT, "a mapping too close to a level");
        (longest.log2().max(0.0) + bias).min(f64::from(self.coarsest()))
    }

    fn level(&self, bias: f64) -> u8 {
        self.exact_level(bias).floor() as u8
    }

    fn folded(&self, uv: f64) -> f64 {
        match self.address {
            AddressMode::Clamp | AddressMode::Border => uv.clamp(0.0, 1.0),
            AddressMode::Wrap => uv.rem_euclid(1.0),
            AddressMode::Mirror => 1.0 - (uv.rem_euclid(2.0) - 1.0).abs(),
        }
    }

    /// The texel of `level` under the centre of a pixel, moved by so many texels.
    fn moved_texel(&self, level: u8, pixel: [u32; 2], by: [f64; 2]) -> [u32; 2] {
        let [x, y] = pixel.map(|n| f64::from(n) + 0.5);
        std::array::from_fn(|a| {
            let of = |uv: [f32; 2]| f64::from(uv[a]);
            let uv = of(self.mapping.origin) + of(self.mapping.along_x) * x + of(self.mapping.along_y) * y;
            let scale = f64::from(1 << level);
            let size = f64::from(self.size[a]);
            let texel = self.folded(uv + by[a] * scale / size) * size / scale;
            (texel.floor() as u32).min(self.level_size(level)[a] - 1)
        })
    }

    /// The texels that single precision might take for it: one, unless it is at an edge.
    fn texels(&self, level: u8, pixel: [u32; 2]) -> Vec<[u32; 2]> {
        let corners = [[-DOUBT; 2], [DOUBT; 2], [-DOUBT, DOUBT], [DOUBT, -DOUBT]];
        let mut texels = corners.map(|by| self.moved_texel(level, pixel, by)).to_vec();
        texels.sort_unstable();
        texels.dedup();
        texels
    }

    /// The page of a texel; the tail's, from its finest level on.
    fn page(&self, level: u8, texel: [u32; 2]) -> PagePos {
        if level >= self.tail_level {
            return PagePos::new_2d(self.tail_level, 0, 0);
        }
        PagePos::new_2d(level, texel[0] / self.page, texel[1] / self.page)
    }
}

fn pixels() -> impl Iterator<Item = [u32; 2]> {
    (0..PICTURE[1]).flat_map(|y| (0..PICTURE[0]).map(move |x| [x, y]))
}

/// Every pixel has the texel that the oracle names at the level of `level_of` (from the level shown); less
/// than 1 % are in doubt.
fn check_texels(screen: &Screen, oracle: &Oracle<'_>, level_of: impl Fn(u8) -> u8) {
    let mut in_doubt = 0;
    for (pixel, colour) in pixels().zip(screen.picture()) {
        let (shown, [x, y, _]) = PropertySource::texel_from_color(Dims::D2, colour);
        assert_eq!(shown, level_of(shown), "{pixel:?} {:?}", oracle.mapping);
        let texels = oracle.texels(shown, pixel);
        match texels[..] {
            [texel] => assert_eq!([x, y], texel, "{pixel:?} level {shown} {:?}", oracle.mapping),
            _ => in_doubt += 1,
        }
    }
    assert!(in_doubt * 100 < PICTURE[0] * PICTURE[1], "{in_doubt} pixels in doubt: {:?}", oracle.mapping);
}

/// The pages that every pixel together wants are those of the oracle, with their numbers of pixels.
fn check_requests(screen: &mut Screen, oracle: &Oracle<'_>) {
    let level = oracle.level(0.0);
    let mut counts: BTreeMap<PagePos, (u32, u32)> = BTreeMap::new(); // fewest, most
    for pixel in pixels() {
        let texels = oracle.texels(level, pixel);
        let mut pages: Vec<_> = texels.iter().map(|&texel| oracle.page(level, texel)).collect();
        pages.sort_unstable();
        pages.dedup();
        for &page in &pages {
            let count = counts.entry(page).or_default();
            count.0 += u32::from(pages.len() == 1);
            count.1 += 1;
        }
    }
    let feedback = screen.feedback_of_every_pixel();
    let steps = shader_constants::STEPS_PER_LEVEL as u8;
    let exact_eighth = (oracle.exact_level(0.0) * f64::from(steps)).floor() as u8;
    let eighth = (exact_eighth - level.min(oracle.tail_level) * steps).min(steps - 1);
    let mut total = 0;
    for wanted in &feedback.pages {
        let (fewest, most) = counts.remove(&wanted.page.pos(Dims::D2)).unwrap_or_default();
        assert!((fewest..=most).contains(&wanted.pixels), "{wanted:?}: {fewest} to {most}");
        assert!(wanted.pixels > 0);
        assert_eq!(wanted.eighth, eighth, "{wanted:?}");
        total += wanted.pixels;
    }
    counts.retain(|_, (fewest, _)| *fewest > 0);
    assert!(counts.is_empty(), "never asked for: {counts:?}");
    assert_eq!((total, feedback.degenerate), (PICTURE[0] * PICTURE[1], 0));
}

fn screen_of(size: [u32; 2], page: u32, address: AddressMode, settings: Settings) -> (Screen, u8) {
    let source = property(size, page, address);
    let tail_level = source.description().geometry.tail().first_level();
    (Screen::new(&[source], settings), tail_level)
}

fn check_converged(address: AddressMode) {
    for (size, page) in SIZES.into_iter().flat_map(|size| PAGES.map(|page| (size, page))) {
        let (mut screen, tail_level) = screen_of(size, page, address, settings());
        for mapping in &mappings(size) {
            let oracle = Oracle { size, page, address, tail_level, mapping };
            screen.set_mapping(0, mapping);
            screen.converge();
            let level = oracle.level(0.0);
            check_texels(&screen, &oracle, |_| level);
            check_requests(&mut screen, &oracle);
        }
    }
}

#[test]
fn every_pixel_shows_its_texel_where_edges_are_clamped() {
    check_converged(AddressMode::Clamp);
}

#[test]
fn every_pixel_shows_its_texel_where_edges_wrap() {
    check_converged(AddressMode::Wrap);
}

#[test]
fn every_pixel_shows_its_texel_where_edges_mirror() {
    check_converged(AddressMode::Mirror);
}

#[test]
fn a_pool_too_small_moves_every_pixel_to_the_level_of_its_bias() {
    for (size, page) in [([1000, 777], 32), ([777, 1000], 128)] {
        let address = AddressMode::Wrap;
        let side = u64::from(page + 8);
        let small = Settings { pools: PoolSettings::of_bytes(4 * side * side * 4), ..settings() };
        let (mut screen, tail_level) = screen_of(size, page, address, small);
        let mapping = &Mapping::new(size, [0.5, 0.5], 1.15, 1.0, 0.3);
        screen.set_mapping(0, mapping);
        screen.converge();
        let oracle = Oracle { size, page, address, tail_level, mapping };
        let bias = f64::from(screen.textures.stats().pager.bias_eighths)
            / f64::from(shader_constants::STEPS_PER_LEVEL);
        assert!(bias > 0.0, "{:?}", screen.textures.stats());
        let level = oracle.level(bias);
        assert!(level > oracle.level(0.0), "a bias of {bias} levels");
        check_texels(&screen, &oracle, |_| level);
        check_requests(&mut screen, &oracle); // which do not depend on the bias
    }
}

/// Returns true if a page is there to be sampled.
fn resident(screen: &Screen, pos: PagePos) -> bool {
    let page = PageId::new(screen.texture(0).number(), Dims::D2, pos).unwrap_or(PageId::NONE);
    matches!(screen.textures.inspect().state(page), PageState::Resident(_))
}

#[test]
fn until_then_every_pixel_shows_its_finest_resident_ancestor() {
    let (size, page, address) = ([1000, 777], 32, AddressMode::Clamp);
    // One tile a frame, so that there is much in between.
    let slow = Settings { upload_bytes_per_frame: 40 * 40 * 4, ..settings() };
    let (mut screen, tail_level) = screen_of(size, page, address, slow);
    let mapping = &Mapping::new(size, [0.45, 0.55], 1.3, 1.0, 0.5);
    let oracle = Oracle { size, page, address, tail_level, mapping };
    screen.set_mapping(0, mapping);
    let mut levels = std::collections::BTreeSet::new();
    for frame in 1..=30 {
        screen.frame().unwrap();
        if frame % 3 != 0 {
            continue;
        }
        check_texels(&screen, &oracle, |shown| shown.max(oracle.level(0.0)));
        for (pixel, colour) in pixels().zip(screen.picture()) {
            let (shown, _) = PropertySource::texel_from_color(Dims::D2, colour);
            levels.insert(shown);
            for level in oracle.level(0.0)..=shown.min(tail_level) {
                if let [texel] = oracle.texels(level, pixel)[..] {
                    let is_shown = level == shown.min(tail_level);
                    let pos = oracle.page(level, texel);
                    assert_eq!(resident(&screen, pos), is_shown, "{pixel:?} shows level {shown}; {pos}");
                }
            }
        }
    }
    assert!(levels.len() > 2, "levels on the way: {levels:?}");
    assert!(!screen.textures.stats().converged);
}
