//! A sample for each block of every component, as coefficients give it, and as rows of the small picture take
//! it.

use std::io::BufRead;

use super::bits::Bits;
use super::frame::{FirstOf, FirstScan, Frame};
use super::stop::Stop;

/// Rows of samples of one component.
pub(super) struct Plane {
    row: usize,
    samples: Vec<u8>,
}

impl Plane {
    /// Of a component, as many rows as so many rows of MCUs have.
    pub(super) fn new(frame: &Frame, component: usize, mcu_rows: usize) -> Plane {
        let [across, down] = frame.components[component].blocks;
        let row = frame.mcus()[0] * across;
        Plane { row, samples: vec![0; row * mcu_rows * down] }
    }

    /// What it takes of memory.
    pub(super) fn bytes(&self) -> u64 {
        self.samples.len() as u64
    }

    /// One of its rows.
    pub(super) fn row(&self, row: usize) -> &[u8] {
        &self.samples[row * self.row..][..self.row]
    }
}

/// A scan that is being decoded.
pub(super) struct Decoding {
    scan: FirstScan,
    /// The last coefficient of each of its components.
    last: Vec<i32>,
    /// MCUs until decoding begins anew, where it does, and the number of the marker there.
    until_restart: u16,
    next_restart: u8,
}

impl Decoding {
    pub(super) fn new(scan: FirstScan) -> Decoding {
        let (last, until_restart) = (vec![0; scan.components.len()], scan.restart_interval);
        Decoding { scan, last, until_restart, next_restart: 0 }
    }

    /// The numbers of the components that it holds.
    pub(super) fn components(&self) -> impl Iterator<Item = usize> {
        self.scan.components.iter().map(|first| first.component)
    }

    /// Rows of its MCUs. Where it holds one component, an MCU is a block.
    pub(super) fn rows(&self, frame: &Frame) -> usize {
        self.mcus(frame)[1]
    }

    fn mcus(&self, frame: &Frame) -> [usize; 2] {
        match &self.scan.components[..] {
            [single] => frame.blocks(single.component),
            _ => frame.mcus(),
        }
    }

    /// Decodes its next row of MCUs; it is the one with number `row` of those that the planes have room for.
    pub(super) fn row<R: BufRead>(
        &mut self,
        frame: &Frame,
        bits: &mut Bits<R>,
        planes: &mut [Plane],
        row: usize,
    ) -> Result<(), Stop> {
        let is_single = self.scan.components.len() == 1;
        for column in 0..self.mcus(frame)[0] {
            self.restart(bits)?;
            for (first, last) in self.scan.components.iter().zip(&mut self.last) {
                let blocks = frame.components[first.component].blocks;
                let [across, down] = if is_single { [1, 1] } else { blocks };
                let plane = &mut planes[first.component];
                for y in 0..down {
                    let start = (row * down + y) * plane.row + column * across;
                    for sample in &mut plane.samples[start..start + across] {
                        *last = last.wrapping_add(bits.difference(&first.table)?);
                        *sample = sample_of(*last, first, self.scan.missing_bits);
                        if let Some(ac) = &first.ac {
                            bits.pass_over_ac(ac)?;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Begins anew, where it is time for that.
    fn restart<R: BufRead>(&mut self, bits: &mut Bits<R>) -> Result<(), Stop> {
        if self.scan.restart_interval == 0 {
            return Ok(());
        }
        if self.until_restart == 0 {
            bits.restart(self.next_restart)?;
            self.next_restart = (self.next_restart + 1) % 8;
            self.until_restart = self.scan.restart_interval;
            self.last.fill(0);
        }
        self.until_restart -= 1;
        Ok(())
    }
}

/// The mean of a block by its coefficient, of which the lowest bits may be missing: these are taken for half
/// of the most that they can be.
fn sample_of(coefficient: i32, first: &FirstOf, missing_bits: u8) -> u8 {
    // As many bits as decoders keep.
    let known = i64::from(coefficient.wrapping_shl(missing_bits.into()) as i16);
    let missing = first.quant * ((1 << missing_bits) - 1) / 2;
    // A coefficient is eight times the mean, which is 0 for a grey in the middle.
    let mean = (known * first.quant + missing + 4) >> 3;
    (mean + 128).clamp(0, 255) as u8
}

/// Writes a row of texels, grey or RGB: of each component a row of samples, and how many texels each of them
/// is for.
pub(super) fn write_row(texels: &mut [u8], samples: &[(&[u8], usize)], is_ycbcr: bool) {
    match samples {
        [(grey, _)] => texels.iter_mut().zip(*grey).for_each(|(texel, sample)| *texel = *sample),
        [first, second, third] => {
            let [first, second, third] = [first, second, third]
                .map(|&(samples, texels)| samples.iter().flat_map(move |&s| std::iter::repeat_n(s, texels)));
            let colors = first.zip(second).zip(third);
            for (texel, ((a, b), c)) in texels.as_chunks_mut::<3>().0.iter_mut().zip(colors) {
                *texel = if is_ycbcr { rgb_of(a, b, c) } else { [a, b, c] };
            }
        }
        _ => {}
    }
}

/// YCbCr as RGB, exactly as libjpeg does it.
fn rgb_of(y: u8, cb: u8, cr: u8) -> [u8; 3] {
    // 1.402, 0.34414, 0.71414 and 1.772, times 65536; and half of that.
    const CR_TO_RED: i32 = 91_881;
    const CB_TO_GREEN: i32 = -22_554;
    const CR_TO_GREEN: i32 = -46_802;
    const CB_TO_BLUE: i32 = 116_130;
    const HALF: i32 = 1 << 15;
    let (y, cb, cr) = (i32::from(y), i32::from(cb) - 128, i32::from(cr) - 128);
    let parts = [CR_TO_RED * cr, CB_TO_GREEN * cb + CR_TO_GREEN * cr, CB_TO_BLUE * cb];
    parts.map(|part| (y + ((part + HALF) >> 16)).clamp(0, 255) as u8)
}
