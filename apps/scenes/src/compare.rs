//! How alike two pictures are.

use vastex_viewer::Picture;

/// How alike two pictures are, over the pixels that the texture covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Peak signal-to-noise ratio of the colours in dB, at most 99.
    pub psnr_db: f64,
    /// The largest difference of a channel, in steps of 1/255.
    pub max_error: u8,
    /// Share of the pixels of which no channel differs by more than one step.
    pub share_within_1_255: f64,
    /// Share of the pixels of which some channel differs by more than three steps.
    pub share_beyond_3_255: f64,
}

impl Comparison {
    /// Compares two pictures of the same size. A pixel that only one of them covers counts as wholly
    /// different.
    pub fn of(one: &Picture, other: &Picture) -> Comparison {
        let (mut pixels, mut within, mut beyond, mut max_error, mut squares) = (0u64, 0u64, 0u64, 0u8, 0u64);
        for (a, b) in one.rgba.chunks_exact(4).zip(other.rgba.chunks_exact(4)) {
            if a[3] == 0 && b[3] == 0 {
                continue;
            }
            let difference =
                |channel: usize| if a[3] == b[3] { a[channel].abs_diff(b[channel]) } else { 255 };
            let differences = [difference(0), difference(1), difference(2)];
            let largest = differences.into_iter().fold(0, u8::max);
            pixels += 1;
            within += u64::from(largest <= 1);
            beyond += u64::from(largest > 3);
            max_error = max_error.max(largest);
            squares += differences.iter().map(|&d| u64::from(d) * u64::from(d)).sum::<u64>();
        }
        let of_pixels = |count: u64| if pixels == 0 { 0.0 } else { count as f64 / pixels as f64 };
        let mean_square = of_pixels(squares) / 3.0;
        let psnr =
            if mean_square == 0.0 { f64::INFINITY } else { 10.0 * (255.0 * 255.0 / mean_square).log10() };
        Comparison {
            psnr_db: psnr.min(99.0),
            max_error,
            share_within_1_255: if pixels == 0 { 1.0 } else { of_pixels(within) },
            share_beyond_3_255: of_pixels(beyond),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_covered_pixels_count() {
        let picture = |pixels: [[u8; 4]; 4]| Picture { size: [4, 1], rgba: pixels.concat() };
        let (covered, beside) = ([10, 20, 30, 255], [0, 0, 0, 0]);
        let a = picture([covered, covered, covered, beside]);
        assert_eq!(Comparison::of(&a, &a).psnr_db, 99.0);
        let b = picture([[11, 20, 30, 255], [10, 25, 30, 255], covered, beside]);
        let c = Comparison::of(&a, &b);
        assert_eq!((c.max_error, c.share_within_1_255, c.share_beyond_3_255), (5, 2.0 / 3.0, 1.0 / 3.0));
        let missing = picture([covered, covered, beside, beside]);
        assert_eq!(Comparison::of(&a, &missing).max_error, 255);
    }
}
