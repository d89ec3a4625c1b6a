//! How far the tiles of a pool have faded in: a byte for each slot, which says how much of what was on screen
//! before remains.
//!
//! 255 is nothing of the new tile, 0 all of it. Shaders of [kinds](crate::Kinds::fade) whose tiles fade blend
//! by it (`wgsl/fade.wgsl`). Which tiles fade, and how much time has passed, is the caller's to say; here it
//! is counted down and what has changed is sent, row by row of slots. While nothing fades nothing is done and
//! nothing sent.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use vastex_core::{PoolLayout, Slot, SlotMove};

/// What remains where a tile has just come.
const ALL_OLD: f64 = 255.0;

/// How far the tiles of a pool have faded in. One texel of an 8-bit texture for each slot of the pool, where
/// the slot lies.
#[derive(Debug)]
pub struct Fades {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    countdown: Countdown,
}

impl Fades {
    /// For a pool in which everything is there.
    pub(crate) fn new(device: &wgpu::Device, layout: &PoolLayout) -> Fades {
        let [columns, rows, images] = layout.grid;
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("vastex fades"),
            size: wgpu::Extent3d { width: columns, height: rows, depth_or_array_layers: images },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::R8Uint,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        Fades { texture, view, countdown: Countdown::new(layout) }
    }

    /// The tile of a slot of the pool has just come, and fades in over `time`; with no time it is there at
    /// once.
    pub fn begin(&mut self, slot: Slot, time: Duration) {
        self.countdown.set(slot.index(), Fade { time, left: time });
    }

    /// The tile of a slot is all there.
    pub fn end(&mut self, slot: Slot) {
        self.countdown.set(slot.index(), Fade::OVER);
    }

    /// Lets time pass. Costs a few operations for each tile that fades.
    pub fn pass(&mut self, time: Duration) {
        self.countdown.pass(time);
    }

    /// Tells the GPU what has changed, for all commands submitted after this call, and returns the bytes
    /// sent: one for each slot of the rows of slots with a change. To be called once per frame, before the
    /// main pass.
    pub fn send(&mut self, queue: &wgpu::Queue) -> u64 {
        let (columns, rows) = (self.countdown.columns, self.countdown.rows);
        let mut sent = 0;
        while let Some((first, count)) = self.countdown.take_changed_rows() {
            let bytes = self.countdown.rows_of_shares(first, count);
            queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture: &self.texture,
                    mip_level: 0,
                    origin: wgpu::Origin3d { x: 0, y: first % rows, z: first / rows },
                    aspect: wgpu::TextureAspect::All,
                },
                bytes,
                wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(columns), rows_per_image: None },
                wgpu::Extent3d { width: columns, height: count, depth_or_array_layers: 1 },
            );
            sent += bytes.len() as u64;
        }
        sent
    }

    /// Tiles that fade in at the moment.
    pub fn fading(&self) -> usize {
        self.countdown.fading.len()
    }

    /// How much of what was on screen before remains, of 255, by slot.
    pub fn shares(&self) -> &[u8] {
        &self.countdown.shares
    }

    /// Takes over how far tiles have faded in that come from another pool.
    pub(crate) fn follow(&mut self, other: &Fades, moves: &[SlotMove]) {
        for SlotMove { from, to } in moves {
            if let Some(&fade) = other.countdown.fading.get(&from.index()) {
                self.countdown.set(to.index(), fade);
            }
        }
    }

    pub(crate) fn view(&self) -> &wgpu::TextureView {
        &self.view
    }
}

/// How far a tile is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Fade {
    /// How long it takes.
    time: Duration,
    left: Duration,
}

impl Fade {
    const OVER: Fade = Fade { time: Duration::ZERO, left: Duration::ZERO };

    /// Of 255.
    fn share(self) -> u8 {
        if self.left.is_zero() {
            return 0;
        }
        let share = self.left.as_secs_f64() / self.time.as_secs_f64();
        (ALL_OLD * share.min(1.0)).round() as u8
    }
}

/// The bytes, and what changes of them; rows are counted through all images.
#[derive(Debug)]
struct Countdown {
    columns: u32,
    /// Of an image.
    rows: u32,
    shares: Vec<u8>,
    fading: BTreeMap<u32, Fade>,
    changed_rows: BTreeSet<u32>,
}

impl Countdown {
    fn new(layout: &PoolLayout) -> Countdown {
        Countdown {
            columns: layout.grid[0],
            rows: layout.grid[1],
            shares: vec![0; layout.slots() as usize],
            fading: BTreeMap::new(),
            changed_rows: BTreeSet::new(),
        }
    }

    /// A slot that there is not is left out.
    fn set(&mut self, slot: u32, fade: Fade) {
        if slot as usize >= self.shares.len() {
            return;
        }
        if fade.left.is_zero() {
            self.fading.remove(&slot);
        } else {
            self.fading.insert(slot, fade);
        }
        self.set_share(slot, fade.share());
    }

    fn set_share(&mut self, slot: u32, share: u8) {
        if std::mem::replace(&mut self.shares[slot as usize], share) != share {
            self.changed_rows.insert(slot / self.columns);
        }
    }

    fn pass(&mut self, time: Duration) {
        let mut fading = std::mem::take(&mut self.fading);
        fading.retain(|&slot, fade| {
            fade.left = fade.left.saturating_sub(time);
            self.set_share(slot, fade.share());
            !fade.left.is_zero()
        });
        self.fading = fading;
    }

    /// The next rows below one another in an image of which each has a change: the first and how many.
    fn take_changed_rows(&mut self) -> Option<(u32, u32)> {
        let first = self.changed_rows.pop_first()?;
        let mut end = first + 1;
        while end % self.rows != 0 && self.changed_rows.remove(&end) {
            end += 1;
        }
        Some((first, end - first))
    }

    fn rows_of_shares(&self, first: u32, count: u32) -> &[u8] {
        let [begin, bytes] = [first, count].map(|rows| rows as usize * self.columns as usize);
        &self.shares[begin..begin + bytes]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// 3 slots to a row, 4 rows to an image, 2 images.
    fn countdown() -> Countdown {
        Countdown::new(&PoolLayout { tile: [8, 8, 1], grid: [3, 4, 2], tile_bytes: 256 })
    }

    fn changed(countdown: &mut Countdown) -> Vec<(u32, u32)> {
        std::iter::from_fn(|| countdown.take_changed_rows()).collect()
    }

    fn begin(time: Duration) -> Fade {
        Fade { time, left: time }
    }

    #[test]
    fn a_tile_comes_with_nothing_of_it_and_is_all_there_when_its_time_is_over() {
        let mut countdown = countdown();
        countdown.set(4, begin(100 * MS));
        let mut shares = vec![countdown.shares[4]];
        for _ in 0..4 {
            countdown.pass(25 * MS);
            shares.push(countdown.shares[4]);
        }
        assert_eq!(shares, [255, 191, 128, 64, 0]);
        assert!(countdown.fading.is_empty() && countdown.shares.iter().all(|&share| share == 0));
        // However long the frame that ends it took.
        countdown.set(4, begin(MS));
        countdown.pass(Duration::MAX);
        assert!(countdown.fading.is_empty() && countdown.shares[4] == 0);
    }

    #[test]
    fn without_time_it_is_there_at_once() {
        let mut countdown = countdown();
        countdown.set(4, begin(Duration::ZERO));
        assert!(countdown.fading.is_empty() && changed(&mut countdown).is_empty());
        countdown.set(4, begin(MS));
        countdown.set(4, Fade::OVER);
        assert!(countdown.fading.is_empty() && countdown.shares[4] == 0);
    }

    #[test]
    fn only_rows_with_a_change_are_sent_and_none_while_nothing_fades() {
        let mut countdown = countdown();
        assert!(changed(&mut countdown).is_empty());
        // Rows 1, 2 and 3 of the first image, 0 of the second, which is no neighbour of them; no such slot.
        for slot in [3, 8, 10, 12, 13, 24, u32::MAX] {
            countdown.set(slot, begin(10 * MS));
        }
        assert_eq!(changed(&mut countdown), [(1, 3), (4, 1)]);
        assert_eq!(countdown.rows_of_shares(1, 3), [255, 0, 0, 0, 0, 255, 0, 255, 0]);
        assert!(changed(&mut countdown).is_empty());
        // Too little time for another byte.
        countdown.pass(Duration::from_micros(1));
        assert!(changed(&mut countdown).is_empty());
        countdown.set(8, Fade::OVER);
        assert_eq!(changed(&mut countdown), [(2, 1)]);
        countdown.pass(10 * MS);
        assert_eq!(changed(&mut countdown), [(1, 1), (3, 1), (4, 1)]);
        countdown.pass(10 * MS);
        assert!(changed(&mut countdown).is_empty());
    }
}
