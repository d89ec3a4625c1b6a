//! Sizes of pictures and places in them, as they are written.

/// Width and height in pixels. The adapter may allow less than what is allowed here.
pub(super) fn parse_size(text: &str) -> Result<[u32; 2], String> {
    const MAX: u32 = 1 << 16;
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match sides {
        Some(size) if size.iter().all(|side| (1..=MAX).contains(side)) => Ok(size),
        Some(_) => Err(format!("each side must have 1 to {MAX} pixels")),
        None => Err("write width and height in pixels, as in 1280x720".into()),
    }
}

/// A place in a picture.
pub(super) fn parse_pixel(text: &str) -> Result<[u32; 2], String> {
    let place =
        text.split_once(',').and_then(|(x, y)| Some([x.trim().parse().ok()?, y.trim().parse().ok()?]));
    place.ok_or_else(|| "write column and row of a pixel, as in 640,360".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_checked() {
        assert_eq!(parse_pixel("640, 0"), Ok([640, 0]));
        for bad in ["", "640", "-1,5", "1,2,3", "1x2", "99999999999,1"] {
            assert!(parse_pixel(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn sizes_are_checked() {
        assert_eq!(parse_size("640x480"), Ok([640, 480]));
        for bad in ["", "640", "0x480", "640x", "x", "-1x5", "640x480x2", "99999999999x1", "70000x1", "a x b"]
        {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
    }
}
