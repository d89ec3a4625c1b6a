//! Levels made straight from level 0, in one pass: sums that stay open while its rows pass by.
//!
//! Each row of level 0 is mixed along itself down to the width of every coarser level, and what comes out is
//! added, weighted, to each row of that level that it is part of. A row is rounded once, when its last part
//! has come. Sums are of 64-bit floats, since thousands of texels go into one, and take their parts in the
//! order of level 0's rows, so they depend on no number of threads.
//!
//! Open are as many rows of a level as its kernel is wide, those that a batch of rows adds, and where the
//! vertical edge wraps the last ones from the beginning, for the first rows of level 0 are part of them. So
//! memory follows the width and never the height; weights across the rows, which are as many as level 0 has,
//! are computed when they are wanted.

use std::collections::BTreeMap;
use std::ops::Range;

use vastex_core::{AddressMode, Geometry, LayerFormat};

use super::descent::factor;
use super::layout::RowLayout;
use super::rows::Rows;
use super::schedule::row_at;
use crate::texels::filter::{LayerFilter, Mixing, Stretched};
use crate::threads;

/// Rows of level 0 that are best added at once.
pub(crate) const ROWS_AT_ONCE: u32 = 8;

/// Bytes that making `level` takes at most.
pub(crate) fn memory(geometry: &Geometry, format: LayerFormat, filter: LayerFilter, level: u8) -> u64 {
    let factor = factor(filter.from, level);
    let Stretched { first, count, .. } = filter.kernel.stretched(factor);
    let channels = Mixing::new(filter, format).channels() as u64;
    let (width, coarse_width) = (geometry.level(0).size[0], geometry.level(level).size[0]);
    let reached = (count as u64).div_ceil(factor.into()) + 1;
    let at_edges = (-first) as u64 / u64::from(factor) + reached + 2;
    let open =
        (reached + u64::from(ROWS_AT_ONCE / factor) + at_edges).min(geometry.level(level).size[1].into());
    let rows =
        (open + u64::from(ROWS_AT_ONCE)) * u64::from(coarse_width) * channels * size_of::<f64>() as u64;
    let weights = (at_edges.min(coarse_width.into()) + 1) * (count as u64).min(width.into());
    // All levels share the rows of level 0 as floats.
    let shared = if level == 1 { u64::from(ROWS_AT_ONCE) * u64::from(width) } else { 0 };
    rows + weights * size_of::<f64>() as u64 + shared * channels * size_of::<f32>() as u64
}

/// All levels but level 0, in the making.
pub(crate) struct Straight {
    mixing: Mixing,
    /// Level 1 first.
    levels: Vec<Level>,
    /// Rows of level 0 added so far.
    added: u32,
    allocated: u64,
}

impl Straight {
    /// `color` is a texel of the border colour.
    pub(crate) fn new(
        geometry: &Geometry,
        format: LayerFormat,
        filter: LayerFilter,
        color: &[u8],
    ) -> Straight {
        let mixing = Mixing::new(filter, format);
        let color: Vec<f64> = mixing.prepared(color).into_iter().map(f64::from).collect();
        let level = |level| {
            let factor = factor(filter.from, level);
            let kernel = filter.kernel.stretched(factor);
            let sum = kernel.sum();
            Level {
                columns: Columns::new(geometry, level, factor, &kernel, sum, &color),
                down: Down::new(geometry, level, factor, kernel, sum),
                open: BTreeMap::new(),
            }
        };
        let levels = (1..=geometry.coarsest()).map(level).collect();
        Straight { mixing, levels, added: 0, allocated: 0 }
    }

    /// Bytes of rows and sums held at once; never falls.
    pub(crate) fn allocated(&self) -> u64 {
        self.allocated
    }

    /// Adds the next rows of level 0.
    pub(crate) fn add(&mut self, rows: &[&[u8]]) {
        let (mixing, first) = (self.mixing, self.added);
        let texels = threads::map(rows, 1, |row| mixing.prepared(row));
        let sums: usize =
            threads::map(&mut self.levels, 1, |level| level.add(first, &texels)).into_iter().sum();
        let floats: usize = texels.iter().map(Vec::len).sum();
        self.allocated = self.allocated.max((sums * size_of::<f64>() + floats * size_of::<f32>()) as u64);
        self.added += rows.len() as u32;
    }

    /// Makes every row of a level, which is not 0, whose last part has been added.
    pub(crate) fn finish(&mut self, level: usize, coarse: &mut Rows, layout: &RowLayout) {
        let (mixing, added) = (self.mixing, self.added);
        let Level { down, open, .. } = &mut self.levels[level - 1];
        while !coarse.is_complete() {
            let (first, row_bytes) = (coarse.next(), coarse.row_bytes());
            let rows = first..first + coarse.room();
            let count = rows.take_while(|&y| down.needs(y) <= added).count() as u32;
            if count == 0 {
                return;
            }
            let sums: Vec<_> = (first..first + count).map(|y| open.remove(&y).unwrap_or_default()).collect();
            threads::map(coarse.grow(count).chunks_exact_mut(row_bytes).zip(sums), 1, |(row, sums)| {
                let mixed: Vec<f32> = sums.iter().map(|&sum| sum as f32).collect();
                mixing.finished(&mixed, layout.payload_mut(row));
                layout.pad(row);
            });
        }
    }
}

/// One level in the making.
struct Level {
    columns: Columns,
    down: Down,
    /// Sums of the rows that have some of their parts, by their numbers.
    open: BTreeMap<u32, Vec<f64>>,
}

impl Level {
    /// Adds rows of level 0 from row `first` on. Returns the numbers held meanwhile.
    fn add(&mut self, first: u32, rows: &[Vec<f32>]) -> usize {
        let Level { columns, down, open } = self;
        let lines = threads::map(rows, 1, |row| columns.along(row));
        for y in down.touched(&(first..first + rows.len() as u32)) {
            open.entry(y).or_insert_with(|| columns.line_of_color(down.beyond(y)));
        }
        threads::map(&mut *open, 1, |(&y, sums)| {
            for (row, line) in (first..).zip(&lines) {
                let weight = down.weight(y, row);
                if weight != 0.0 {
                    sums.iter_mut().zip(line).for_each(|(sum, value)| *sum += weight * value);
                }
            }
        });
        lines.iter().chain(open.values()).map(Vec::len).sum()
    }
}

/// How the rows of level 0 are spread over those of a level.
struct Down {
    mode: AddressMode,
    /// Rows of level 0.
    height: i64,
    /// Rows of the level.
    coarse_height: i64,
    factor: i64,
    kernel: Stretched,
    /// Of the kernel's weights.
    sum: f64,
}

impl Down {
    fn new(geometry: &Geometry, level: u8, factor: u32, kernel: Stretched, sum: f64) -> Down {
        Down {
            mode: geometry.address()[1],
            height: geometry.level(0).size[1].into(),
            coarse_height: geometry.level(level).size[1].into(),
            factor: factor.into(),
            kernel,
            sum,
        }
    }

    /// The rows that row `y` of the level is made of; some may lie beyond the edges.
    fn reach(&self, y: i64) -> Range<i64> {
        let first = self.factor * y + self.kernel.first;
        first..first + self.kernel.count
    }

    /// Rows of level 0 after which nothing is missing to row `y`.
    fn needs(&self, y: u32) -> u32 {
        let Range { start, end } = self.reach(y.into());
        let to_the_end = self.mode == AddressMode::Wrap && start < 0;
        (if to_the_end { self.height } else { end.min(self.height) }) as u32
    }

    /// How much of row `y` of the level is row `row` of level 0.
    fn weight(&self, y: u32, row: u32) -> f64 {
        let (Range { start, end }, row, n) = (self.reach(y.into()), i64::from(row), self.height);
        let of = |place: i64| self.kernel.weight(place - start);
        let every = |place: i64, step: i64| -> f64 {
            let nearest = start + (place - start).rem_euclid(step);
            (nearest..end).step_by(step as usize).map(of).sum()
        };
        let sum: f64 = match self.mode {
            AddressMode::Wrap => every(row, n),
            AddressMode::Mirror => every(row, 2 * n) + every(2 * n - 1 - row, 2 * n),
            AddressMode::Border => (row.max(start)..(row + 1).min(end)).map(of).sum(),
            AddressMode::Clamp => {
                let from = if row == 0 { start } else { row.max(start) };
                let to = if row == n - 1 { end } else { end.min(row + 1) };
                (from..to).map(of).sum()
            }
        };
        sum / self.sum
    }

    /// How much of row `y` of the level is the border colour.
    fn beyond(&self, y: u32) -> f64 {
        if self.mode != AddressMode::Border {
            return 0.0;
        }
        let Range { start, end } = self.reach(y.into());
        let outside = (start..end.min(0)).chain(start.max(self.height)..end);
        outside.map(|place| self.kernel.weight(place - start)).sum::<f64>() / self.sum
    }

    /// The rows of the level that these rows of level 0 are part of. Some may come twice.
    fn touched(&self, rows: &Range<u32>) -> impl Iterator<Item = u32> + use<'_> {
        let Stretched { first, count, .. } = self.kernel;
        let (rows, all) = (rows.clone(), 0..self.coarse_height);
        let from = (i64::from(rows.start) - first - count).div_euclid(self.factor) + 1;
        let to = (i64::from(rows.end) - 1 - first).div_euclid(self.factor) + 1;
        // Those at the edges take rows that lie far away.
        let top = 0..(-first).div_euclid(self.factor) + 1;
        let bottom = (self.height - first - count).div_euclid(self.factor) + 1..self.coarse_height;
        let far = top.chain(bottom.start.max(0)..bottom.end);
        let far = far
            .filter(move |&y| all.contains(&y) && rows.clone().any(|row| self.weight(y as u32, row) != 0.0));
        (from.max(0)..to.min(self.coarse_height)).chain(far).map(|y| y as u32)
    }
}

/// How the texels of a row of level 0 become those of a row of a level.
struct Columns {
    width: usize,
    factor: usize,
    /// What texels of the level are made of that look beyond no edge: from `factor` times their number plus
    /// `first` on.
    first: i64,
    weights: Vec<f64>,
    inner: Range<usize>,
    /// What the others are made of, from left to right.
    outer: Vec<Outer>,
    color: Vec<f64>,
}

/// Of what a texel near an edge is made.
struct Outer {
    /// Weights of texels side by side, from the first of each run on.
    runs: Vec<(usize, Vec<f64>)>,
    /// Weight of the border colour.
    beyond: f64,
}

impl Columns {
    fn new(
        geometry: &Geometry,
        level: u8,
        factor: u32,
        kernel: &Stretched,
        sum: f64,
        color: &[f64],
    ) -> Columns {
        let (mode, size) = (geometry.address()[0], geometry.level(0).size[0]);
        let (width, factor) = (geometry.level(level).size[0] as usize, factor as usize);
        let start = |x: usize| (factor * x) as i64 + kernel.first;
        let is_inner = |x: &usize| start(*x) >= 0 && start(*x) + kernel.count <= i64::from(size);
        let first_inner = (0..width).find(is_inner).unwrap_or(width);
        let inner = first_inner..first_inner + (first_inner..width).take_while(is_inner).count();
        // One after the other: the kernels of the coarsest levels are as long as the longer axis, which need
        // not be this.
        let weight = |tap| kernel.weight(tap) / sum;
        let all = (0..if inner.is_empty() { 0 } else { kernel.count }).map(weight);
        let outer: Vec<usize> = (0..inner.start).chain(inner.end..width).collect();
        let outer =
            threads::map(outer, 1, |x| Outer::new(mode, size, start(x), (0..kernel.count).map(weight)));
        Columns {
            width,
            factor,
            first: kernel.first,
            weights: all.collect(),
            outer,
            inner,
            color: color.to_vec(),
        }
    }

    /// A row of level 0, as wide as the level.
    fn along(&self, texels: &[f32]) -> Vec<f64> {
        match self.color.len() {
            1 => self.mix_along::<1>(texels),
            2 => self.mix_along::<2>(texels),
            3 => self.mix_along::<3>(texels),
            4 => self.mix_along::<4>(texels),
            _ => self.mix_along::<5>(texels),
        }
    }

    fn mix_along<const C: usize>(&self, texels: &[f32]) -> Vec<f64> {
        let texels = texels.as_chunks::<C>().0;
        let mut line = vec![0.0; self.width * C];
        let (targets, _) = line.as_chunks_mut::<C>();
        let is_outer = (0..self.inner.start).chain(self.inner.end..self.width);
        for (x, outer) in is_outer.zip(&self.outer) {
            let beyond = std::array::from_fn(|c| outer.beyond * self.color[c]);
            targets[x] = outer.runs.iter().fold(beyond, |sum: [f64; C], (first, weights)| {
                let part = weighted(weights, &texels[*first..]);
                std::array::from_fn(|c| sum[c] + part[c])
            });
        }
        for x in self.inner.clone() {
            let first = (self.factor * x) as i64 + self.first;
            targets[x] = weighted(&self.weights, &texels[first as usize..]);
        }
        line
    }

    /// A row of the level in the border colour, weighted.
    fn line_of_color(&self, weight: f64) -> Vec<f64> {
        self.color.iter().map(|value| weight * value).collect::<Vec<_>>().repeat(self.width)
    }
}

impl Outer {
    /// For weights from texel `start` on, of rows of `size`.
    fn new(mode: AddressMode, size: u32, start: i64, weights: impl Iterator<Item = f64>) -> Outer {
        let mut of_texel = vec![0.0; size as usize];
        let mut beyond = 0.0;
        for (place, weight) in (start..).zip(weights) {
            match row_at(mode, place, size) {
                Some(texel) => of_texel[texel as usize] += weight,
                None => beyond += weight,
            }
        }
        let mut runs: Vec<(usize, Vec<f64>)> = Vec::new();
        for (texel, &weight) in of_texel.iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
            match runs.last_mut() {
                Some((first, run)) if *first + run.len() == texel => run.push(weight),
                _ => runs.push((texel, vec![weight])),
            }
        }
        Outer { runs, beyond }
    }
}

/// The sum of texels, each times its weight: four sums side by side, so that none waits for the other.
fn weighted<const C: usize>(weights: &[f64], texels: &[[f32; C]]) -> [f64; C] {
    let (fours, rest) = weights.as_chunks::<4>();
    let (texels, last) = texels[..weights.len()].split_at(fours.len() * 4);
    let mut sums = [[0.0; C]; 4];
    for (four, texels) in fours.iter().zip(texels.as_chunks::<4>().0) {
        for (sum, (weight, texel)) in sums.iter_mut().zip(four.iter().zip(texels)) {
            for c in 0..C {
                sum[c] += weight * f64::from(texel[c]);
            }
        }
    }
    for (sum, (weight, texel)) in sums.iter_mut().zip(rest.iter().zip(last)) {
        for c in 0..C {
            sum[c] += weight * f64::from(texel[c]);
        }
    }
    std::array::from_fn(|c| (sums[0][c] + sums[1][c]) + (sums[2][c] + sums[3][c]))
}
