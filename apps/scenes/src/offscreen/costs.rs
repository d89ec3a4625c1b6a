//! What the picture of a view costs, beside the same view of an ordinary texture.

use std::time::Duration;

use super::{Offscreen, OffscreenError, draw_again};
use crate::clock::GpuClock;
use crate::compare::Comparison;
use crate::reference::{Reference, Taps};

/// What the draw of a view takes, the least of several in turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawCosts {
    /// From the virtual texture.
    pub of_virtual: Duration,
    /// From an ordinary texture, by the same taps.
    pub of_ordinary: Duration,
    /// From an ordinary texture, by the adapter's own trilinear or anisotropic filter.
    pub of_adapter: Duration,
    /// How alike the pictures of the virtual texture and of the adapter's own filter are.
    pub to_adapter: Comparison,
}

/// What the draw of a view takes beside other views.
#[derive(Clone, Debug, PartialEq)]
pub struct CostsBeside {
    /// The median of this one's.
    pub of_this: Duration,
    /// For each of the others the median of its time over this one's, each pair taken in one turn.
    pub others_to_this: Vec<f64>,
}

impl Offscreen {
    /// Draws the last frame's picture `rounds` times in turns with those of others on the same device, from
    /// what is in the pools now. One view alone of each.
    pub fn costs_beside(&self, others: &[Offscreen], clock: &GpuClock, rounds: usize) -> CostsBeside {
        let all: Vec<&Offscreen> = std::iter::once(self).chain(others).collect();
        for offscreen in &all {
            offscreen.renderer.set_pose(
                &self.gpu.queue,
                &offscreen.textures,
                &offscreen.pose,
                offscreen.canvas.size(),
            );
        }
        let draws: Vec<_> =
            all.iter().map(|&offscreen| move |encoder: &mut _| offscreen.draw_again(encoder)).collect();
        let draws: Vec<&dyn Fn(&mut wgpu::CommandEncoder)> = draws.iter().map(|draw| draw as _).collect();
        let mut taken = clock.in_turns(&self.gpu, &draws, rounds).into_iter();
        let of_this = taken.next().unwrap_or_default();
        let to_this = |taken: Vec<Duration>| {
            let ratios = taken.iter().zip(&of_this).map(|(a, b)| a.as_secs_f64() / b.as_secs_f64());
            median_of(ratios.collect(), f64::total_cmp)
        };
        let others_to_this = taken.map(to_this).collect();
        CostsBeside { of_this: median(of_this), others_to_this }
    }

    /// Draws the last frame's picture once more, from what is in the pool now, and reads nothing back. One
    /// view alone.
    pub fn draw_again(&self, encoder: &mut wgpu::CommandEncoder) {
        let (renderer, target) = (&self.renderer, self.canvas.target());
        draw_again(encoder, &self.textures, renderer, renderer.camera(), &target);
    }

    /// Draws the last frame's picture `rounds` times in each way, from what is in the pool now. One view
    /// alone.
    pub fn costs(&self, clock: &GpuClock, rounds: usize) -> Result<DrawCosts, OffscreenError> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let reference =
            |taps| Reference::new(device, queue, &self.textures, &self.renderer, &*self.source, taps);
        let (same, own) = (reference(Taps::Ordinary)?, reference(Taps::Adapter)?);
        self.renderer.set_pose(queue, &self.textures, &self.pose, self.canvas.size());
        let draw = |reference: &Reference, encoder: &mut wgpu::CommandEncoder| {
            let target = self.canvas.target();
            reference.draw(encoder, &self.renderer, &self.textures, &target);
            target.encode(encoder);
        };
        let draws: [&dyn Fn(&mut wgpu::CommandEncoder); 3] =
            [&|encoder| self.draw_again(encoder), &|encoder| draw(&same, encoder), &|encoder| {
                draw(&own, encoder);
            }];
        let taken = clock.in_turns(&self.gpu, &draws, rounds);
        let by_adapter = self.draw_and_read(|encoder, _| draw(&own, encoder));
        let [of_virtual, of_ordinary, of_adapter] =
            [0, 1, 2].map(|n| taken[n].iter().copied().min().unwrap_or_default());
        Ok(DrawCosts {
            of_virtual,
            of_ordinary,
            of_adapter,
            to_adapter: Comparison::of(&self.picture(), &by_adapter),
        })
    }
}

fn median(taken: Vec<Duration>) -> Duration {
    median_of(taken, Duration::cmp)
}

fn median_of<T: Copy + Default>(mut values: Vec<T>, order: impl Fn(&T, &T) -> std::cmp::Ordering) -> T {
    values.sort_by(order);
    values.get(values.len() / 2).copied().unwrap_or_default()
}
