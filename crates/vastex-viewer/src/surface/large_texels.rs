//! When texels that are large in the picture are shown as they are, blended with nothing.

/// Pixels a texel from which texels are shown as they are.
const CRISP: f64 = 4.0;
/// Pixels a texel below which they are blended again: between this and [`CRISP`] nothing changes, so that
/// nothing flickers.
const BLENDED: f64 = 3.5;

/// Returns true if an image that is seen at so many pixels a texel shows its texels as they are, blended with
/// nothing. `did` says that it did so before: then it goes on to a little less.
pub fn shows_large_texels(magnification: f64, did: bool) -> bool {
    magnification >= CRISP || did && magnification > BLENDED
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_texels_are_shown_as_they_are_a_little_longer_than_they_begin_to_be() {
        let seen = |did| [3.0, 3.5, 3.6, 4.0, 9.0].map(|scale| shows_large_texels(scale, did));
        assert_eq!(seen(false), [false, false, false, true, true]);
        assert_eq!(seen(true), [false, false, true, true, true]);
    }
}
