//! Red, green and blue of cyan, magenta, yellow and black: each is what two filters one behind the other let
//! through, `(1 - ink) * (1 - black)`. What an ink looks like on a paper only a profile of both could tell.

/// Of samples of 8 bits, 255 of which is all of an ink.
pub(super) fn rgb_from_inks([cyan, magenta, yellow, black]: [u8; 4]) -> [u8; 3] {
    let left = |ink: u8| 255 - u32::from(ink);
    [cyan, magenta, yellow].map(|ink| ((left(ink) * left(black) + 127) / 255) as u8)
}

/// Of samples of 16 bits, 65535 of which is all of an ink.
pub(super) fn rgb_from_inks_16([cyan, magenta, yellow, black]: [u16; 4]) -> [u16; 3] {
    let left = |ink: u16| 65_535 - u32::from(ink);
    [cyan, magenta, yellow].map(|ink| ((left(ink) * left(black) + 32_767) / 65_535) as u16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inks_take_their_colours_away() {
        assert_eq!(rgb_from_inks([0; 4]), [255; 3]);
        assert_eq!(rgb_from_inks([255, 0, 0, 0]), [0, 255, 255]);
        assert_eq!(rgb_from_inks([0, 255, 0, 0]), [255, 0, 255]);
        assert_eq!(rgb_from_inks([0, 0, 0, 255]), [0; 3]);
        // Three quarters and a half of what there is: 191 * 128 / 255 = 95.87.
        assert_eq!(rgb_from_inks([64, 0, 255, 127]), [96, 128, 0]);
        assert_eq!(rgb_from_inks_16([0; 4]), [65_535; 3]);
        assert_eq!(rgb_from_inks_16([0, 65_535, 0, 32_767]), [32_768, 0, 32_768]);
    }
}
