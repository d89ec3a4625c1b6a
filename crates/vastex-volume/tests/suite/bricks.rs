//! Bricks beside a naive oracle: every voxel asked for by itself, its place clamped to the level.

use pollster::block_on;
use vastex_volume::{Brick, BrickLayout, BrickPos, Volume, VolumeRegion};

use crate::fixtures::{path, volume};

/// The same numbers every time.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, count: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % count
    }
}

/// The whole of a level, voxel by voxel.
struct Oracle {
    values: Vec<u8>,
    size: [u64; 3],
    width: usize,
}

impl Oracle {
    fn new(volume: &Volume, level: usize, channel: u64, time: u64) -> Oracle {
        let size = volume.about().levels[level].size;
        let region = VolumeRegion { level, channel, time, at: [0; 3], size };
        let values = block_on(volume.read(&region)).unwrap();
        Oracle { values, size, width: volume.about().dtype.bytes() }
    }

    fn brick(&self, layout: BrickLayout, at: [u64; 3]) -> Vec<u8> {
        let outer = i64::from(layout.outer());
        let mut brick = Vec::new();
        for n in 0..outer.pow(3) {
            let within = [n % outer, n / outer % outer, n / outer / outer];
            let place: [u64; 3] = std::array::from_fn(|axis| {
                let voxel =
                    at[axis] as i64 * i64::from(layout.side) - i64::from(layout.border) + within[axis];
                voxel.clamp(0, self.size[axis] as i64 - 1) as u64
            });
            let at = ((place[2] * self.size[1] + place[1]) * self.size[0] + place[0]) as usize * self.width;
            brick.extend_from_slice(&self.values[at..at + self.width]);
        }
        brick
    }
}

fn read(
    volume: &Volume,
    layout: BrickLayout,
    wanted: &[BrickPos],
) -> (Vec<(BrickPos, Brick)>, vastex_volume::BrickWork) {
    let mut found = Vec::new();
    let work =
        block_on(volume.read_bricks(layout, wanted, &mut |pos, brick| found.push((pos, brick.unwrap()))))
            .unwrap();
    (found, work)
}

#[test]
fn bricks_of_any_size_equal_the_oracle() {
    let mut numbers = Numbers(7);
    for name in [
        "v04-center",
        "v05-shards",
        "v3-shards-transposed",
        "v2-fortran",
        "v05-flat",
        "v05-axis-order",
        "v05-corner",
        "ome-zarr-py-05",
    ] {
        let volume = volume(&path(&format!("{name}.zip")));
        let about = volume.about();
        for _ in 0..12 {
            let layout = BrickLayout { side: 1 + numbers.below(20) as u32, border: numbers.below(4) as u32 };
            let level = numbers.below(about.levels.len() as u64) as usize;
            let (channel, time) = (numbers.below(about.channels), numbers.below(about.times));
            let oracle = Oracle::new(&volume, level, channel, time);
            let grid = oracle.size.map(|side| side.div_ceil(layout.side.into()));
            let wanted: Vec<BrickPos> = (0..6)
                .map(|_| BrickPos { level, channel, time, at: grid.map(|count| numbers.below(count)) })
                .collect();
            let (found, _) = read(&volume, layout, &wanted);
            assert_eq!(found.len(), wanted.len(), "{name}");
            for (pos, brick) in found {
                let expected = oracle.brick(layout, pos.at);
                if brick.is_absent {
                    let inner = BrickLayout { border: 0, ..layout };
                    let payload = oracle.brick(inner, pos.at);
                    assert!(
                        payload.chunks(oracle.width).all(|value| value == &payload[..oracle.width]),
                        "{name} {pos:?}"
                    );
                } else {
                    assert!(brick.values == expected, "{name}: {pos:?} of {layout:?}");
                }
            }
        }
    }
}

#[test]
fn a_chunk_is_decoded_once_for_all_that_want_it() {
    let volume = volume(&path("v04-center.zip"));
    // Chunks of 8x8x3 with both channels: 3 x 3 x 2 of them, for each of two times.
    let layout = BrickLayout { side: 5, border: 1 };
    let mut wanted = Vec::new();
    for channel in 0..2 {
        for n in 0..5 * 4 * 2 {
            wanted.push(BrickPos { level: 0, channel, time: 1, at: [n % 5, n / 5 % 4, n / 20] });
        }
    }
    let (found, work) = read(&volume, layout, &wanted);
    assert_eq!((found.len(), work.chunks_decoded, work.chunks_absent), (wanted.len(), 18, 0));
    assert!(work.parts > 18);
}

#[test]
fn bricks_of_absent_chunks_hold_nothing() {
    let volume = volume(&path("v2-absent.zip"));
    let layout = BrickLayout { side: 20, border: 1 };
    let at = |at: [u64; 3]| BrickPos { level: 0, channel: 0, time: 0, at };
    let (found, work) = read(&volume, layout, &[at([0, 0, 0]), at([1, 0, 0]), at([3, 3, 3])]);
    let absent: Vec<bool> = found.iter().map(|(_, brick)| brick.is_absent).collect();
    // The second has stored voxels in its border alone.
    assert_eq!(
        found.iter().filter(|(pos, brick)| brick.is_absent != (pos.at != [0; 3])).count(),
        0,
        "{absent:?}"
    );
    assert_eq!(work.chunks_decoded, 1);
    let oracle = Oracle::new(&volume, 0, 0, 0);
    let first = found.iter().find(|(pos, _)| pos.at == [0; 3]).unwrap();
    assert!(first.1.values == oracle.brick(layout, [0; 3]));
}

#[test]
fn what_is_no_brick_is_refused() {
    let volume = volume(&path("v05-flat.zip"));
    let sound = BrickPos { level: 0, channel: 0, time: 0, at: [0; 3] };
    for (layout, pos) in [
        (BrickLayout { side: 0, border: 1 }, sound),
        (BrickLayout { side: 64, border: 9 }, sound),
        (BrickLayout { side: 8, border: 1 }, BrickPos { at: [5, 0, 0], ..sound }),
        (BrickLayout { side: 8, border: 1 }, BrickPos { level: 1, ..sound }),
        (BrickLayout { side: 8, border: 1 }, BrickPos { channel: 1, ..sound }),
    ] {
        assert!(block_on(volume.read_bricks(layout, &[pos], &mut |_, _| {})).is_err(), "{layout:?} {pos:?}");
    }
}
