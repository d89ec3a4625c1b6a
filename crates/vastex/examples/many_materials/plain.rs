//! Images that are an affine function of the place, on every level, each with a colour of its own: whatever
//! samples one rightly gives that.

use vastex::{GeometryError, GeometrySpec, LayerFormat};

use super::common::painted::Painted;

pub(crate) fn image(nth: usize) -> Result<Painted, GeometryError> {
    let (side, page) = [(2048, 64), (1500, 50), (2048, 64), (128, 64)][nth % 4];
    let spec = GeometrySpec { page, ..GeometrySpec::image(side, side) };
    Painted::new(spec, LayerFormat::Rgba8, move |at, _| {
        let [r, g, b] = light(nth, at.map(|n| n / side as f32)).map(|n| (n * 255.0).round() as u8);
        [r, g, b, 255]
    })
}

/// The light at a place of the image, each channel 0 to 1.
pub(crate) fn light(nth: usize, [u, v]: [f32; 2]) -> [f32; 3] {
    let own = (nth * 37 % 101) as f32 / 101.0;
    [0.2 + 0.5 * own + 0.2 * u, 0.8 - 0.4 * own - 0.2 * v, 0.3 + 0.3 * (u * (1.0 - own) + v * own)]
}
