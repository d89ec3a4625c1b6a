//! Direct and hashed page tables through the frame loop, and textures of up to 2^31 texels per axis, which
//! have the latter.

use std::sync::Arc;

use crate::common::texts::fixed;
use crate::common::{Mapping, PICTURE, SCREEN, Screen, add_with, property, settings};
use vastex::diagnostics::FrameStats;
use vastex::{
    AddressMode, PoolId, PoolSettings, Settings, TableChoice, TextureSettings, Textures, TileSource,
};
use vastex_core::Dims;
use vastex_tiles::PropertySource;
use vastex_wgpu::test_device::TestDevice;

/// Bytes of a tile of the property image.
const TILE: u64 = 136 * 136 * 4;

fn screen(source: Arc<dyn TileSource>, settings: Settings, page_table: TableChoice, shader: &str) -> Screen {
    Screen::showing(settings, shader, |textures| {
        add_with(textures, source, TextureSettings { page_table, ..Default::default() }).unwrap()
    })
}

fn endless(address: AddressMode) -> Arc<dyn TileSource> {
    property([1 << 31, 1 << 31], 128, address)
}

/// Texels in the place of uv; `turn` in radians.
fn in_texels(origin: [f32; 2], texels: f32, turn: f32) -> Mapping {
    let (sin, cos) = (texels * turn.sin(), texels * turn.cos());
    Mapping { origin, along_x: [cos, sin], along_y: [-sin, cos] }
}

#[test]
fn pictures_are_the_same_through_either_kind_in_every_frame() {
    let source = property([9000, 7000], 128, AddressMode::Wrap);
    let settings = || Settings { pools: PoolSettings::of_bytes(60 * TILE), ..settings() };
    let mut screens = [TableChoice::Direct, TableChoice::Hashed]
        .map(|choice| screen(source.clone(), settings(), choice, SCREEN));
    for frame in 0..90u32 {
        let t = f64::from(frame) / 90.0;
        let mapping =
            Mapping::new([9000, 7000], [0.2 + t, 0.3 + 0.5 * t], 8.0 * 0.05f64.powf(t), 1.0, 3.0 * t);
        if frame == 50 {
            screens.iter_mut().for_each(|screen| {
                screen.textures.memory().resize_pool(PoolId::new(0), 35 * TILE).unwrap();
            });
        }
        if frame == 70 {
            screens = screens.map(Screen::on_another_device);
        }
        let pictures = screens.each_mut().map(|screen| {
            screen.set_mapping(0, &mapping);
            screen.frame().unwrap();
            screen.picture()
        });
        assert!(pictures[0] == pictures[1], "frame {frame}");
    }
    let [direct, hashed] = screens.map(|screen| screen.textures.stats());
    assert_eq!(direct.pager, hashed.pager);
    assert!(hashed.table_bytes < direct.table_bytes, "{} {}", hashed.table_bytes, direct.table_bytes);
    assert!(hashed.pager.evicted > 100, "{:?}", hashed.pager);
}

/// Every pixel has the texel that whole-numbered arithmetic names, wherever it is; those within 1/100 of an
/// edge are in doubt.
fn check_texels(screen: &Screen, mapping: &Mapping, anchor: [u32; 2]) {
    let mut in_doubt = 0;
    for (n, colour) in (0..).zip(screen.picture()) {
        let (level, shown) = PropertySource::texel_from_color(Dims::D2, colour);
        let [x, y] = [n % PICTURE[0], n / PICTURE[0]].map(|pixel| f64::from(pixel) + 0.5);
        let offset: [f64; 2] = std::array::from_fn(|a| {
            let of = |part: [f32; 2]| f64::from(part[a]);
            of(mapping.origin) + of(mapping.along_x) * x + of(mapping.along_y) * y
        });
        let scale = f64::from(1 << level);
        let is_near_edge = offset.iter().zip(anchor).any(|(offset, anchor)| {
            let into = (f64::from(anchor % (1 << level)) + offset) / scale;
            (into - into.round()).abs() < 0.01
        });
        if is_near_edge {
            in_doubt += 1;
            continue;
        }
        for a in 0..2 {
            let texel = (i64::from(anchor[a]) + offset[a].floor() as i64).rem_euclid(1 << 31) >> level;
            assert_eq!(
                i64::from(shown[a]),
                texel % 4096,
                "pixel {x},{y} level {level} of {anchor:?} {mapping:?}"
            );
        }
    }
    assert!(in_doubt < 20_000 / 16, "{in_doubt} in doubt");
}

/// No trembling: whatever texel a view is at, what is shown is exact, and moves as the view moves.
#[test]
fn single_texels_of_the_largest_texture_are_where_they_should_be() {
    let small = Settings { pools: PoolSettings::of_bytes(120 * TILE), ..settings() };
    let mut screen = screen(endless(AddressMode::Wrap), small, TableChoice::BySize, &fixed());
    let last = (1 << 31) - 1;
    for anchor in [[1_234_567_891, 2_000_000_000], [last, 0], [0, last], [1 << 30, 77]] {
        for step in 0..3u8 {
            // About the edges in one direction and the other, magnified, and turned.
            let origin = [-20.0 - 0.37 * f32::from(step), 11.2 - 30.0 * f32::from(step)];
            let mapping = in_texels(origin, [0.23, 0.9, 0.11][usize::from(step)], 0.6 * f32::from(step));
            screen.set_anchored(0, &mapping, anchor);
            screen.converge();
            check_texels(&screen, &mapping, anchor);
            assert!(screen.picture().iter().all(|colour| colour[3] == 255), "level 0 everywhere");
        }
    }
    assert_eq!(screen.feedback_of_every_pixel().degenerate, 0);
}

/// From all of it down to single texels.
fn descend(texels: u32) -> FrameStats {
    let settings = Settings { pools: PoolSettings::of_bytes(200 * TILE), ..settings() };
    let mut screen =
        screen(property([texels; 2], 128, AddressMode::Wrap), settings, TableChoice::Hashed, &fixed());
    let anchor = [texels / 3, texels / 7 * 2];
    let widest = f64::from(texels) / f64::from(PICTURE[0]);
    let (mut pool_bytes, mut mapping) = (None, in_texels([0.0; 2], 1.0, 0.0));
    for frame in 0..=120 {
        let scale = (widest * (0.43 / widest).powf(f64::from(frame) / 120.0)) as f32;
        let [right, down] = PICTURE.map(|side| scale * side as f32 / 2.0);
        mapping = in_texels([-right, -down], scale, 0.0);
        screen.set_anchored(0, &mapping, anchor);
        screen.frame().unwrap();
        let stats = screen.textures.stats();
        assert_eq!(*pool_bytes.get_or_insert(stats.pool_bytes), stats.pool_bytes, "frame {frame}");
        assert!(stats.table_bytes <= 12 * 1024 + 4096, "frame {frame}: {} bytes", stats.table_bytes);
    }
    screen.converge();
    check_texels(&screen, &mapping, anchor);
    screen.textures.stats()
}

/// 2^13 to 2^31 texels per axis: the pool as large, and all GPU memory but for 5 %.
#[test]
fn memory_does_not_follow_the_size_of_the_texture() {
    let stats: Vec<FrameStats> = [13, 16, 20, 25, 31].map(|bits| descend(1 << bits)).into();
    for at in &stats {
        assert_eq!(at.pool_bytes, stats[0].pool_bytes);
        let all = |stats: &FrameStats| (stats.pool_bytes + stats.table_bytes) as f64;
        assert!((all(at) / all(&stats[1]) - 1.0).abs() < 0.05, "{} and {}", all(at), all(&stats[1]));
        assert!(at.converged && at.pager.failed == 0, "{at:?}");
    }
}

/// Every table that was added could grow to its full size; the one that could not is hashed, and says so by
/// its kinds.
#[test]
fn a_texture_for_whose_table_its_pool_has_no_room_has_a_hashed_one() {
    let gpu = TestDevice::new();
    let mut textures = Textures::new(&gpu.device, &gpu.queue, settings()).unwrap();
    // 2 Mi pages of 16 texels at level 0, half a Mi at level 1 ..: eleven of them fit into 32 Mi entries.
    let source = property([2048 * 16, 1024 * 16], 16, AddressMode::Clamp);
    let mut add = |page_table| {
        let settings = TextureSettings { page_table, ..Default::default() };
        let texture = add_with(&mut textures, source.clone(), settings).unwrap();
        textures.kinds(texture).unwrap()
    };
    let [direct, hashed] = [TableChoice::Direct, TableChoice::Hashed].map(&mut add);
    assert_ne!(direct, hashed);
    let by_size: Vec<bool> = (0..12).map(|_| add(TableChoice::BySize) == hashed).collect();
    assert_eq!(by_size, [[false; 10].as_slice(), &[true; 2]].concat());
}
