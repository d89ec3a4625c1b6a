//! YCbCr to RGB for JPEG 2000 in TIFF, whose decoder hands out what is stored. Of JPEG tiles libjpeg does it
//! (`jpeg/part`).

/// Turns full-range BT.601 YCbCr texels into RGB, in place, rounding to nearest.
pub(super) fn rgb_from_ycbcr(texels: &mut [u8]) {
    // The coefficients of JFIF, times 2^16.
    const HALF: i32 = 1 << 15;
    for texel in texels.as_chunks_mut::<3>().0 {
        let [y, cb, cr] = texel.map(i32::from);
        let (y, cb, cr) = (y << 16, cb - 128, cr - 128);
        let r = y + 91_881 * cr + HALF;
        let g = y - 22_554 * cb - 46_802 * cr + HALF;
        let b = y + 116_130 * cb + HALF;
        *texel = [r, g, b].map(|v| (v >> 16).clamp(0, 255) as u8);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colours() {
        for (ycbcr, rgb) in [
            ([0, 128, 128], [0, 0, 0]),
            ([255, 128, 128], [255, 255, 255]),
            ([76, 85, 255], [254, 0, 0]),
            ([29, 255, 107], [0, 0, 254]),
        ] {
            let mut texel = ycbcr;
            rgb_from_ycbcr(&mut texel);
            assert_eq!(texel, rgb);
        }
    }
}
