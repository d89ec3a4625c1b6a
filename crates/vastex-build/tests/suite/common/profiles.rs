//! ICC profiles, written by hand, and what they mean, by the definition of their primaries and curves.

/// x and y of white, red, green and blue.
pub type Points = [[f64; 2]; 4];

const D65: [f64; 2] = [0.3127, 0.3290];
pub const SRGB: Points = [D65, [0.64, 0.33], [0.30, 0.60], [0.15, 0.06]];
pub const DISPLAY_P3: Points = [D65, [0.680, 0.320], [0.265, 0.690], [0.150, 0.060]];
pub const ADOBE_RGB: Points = [D65, [0.64, 0.33], [0.21, 0.71], [0.15, 0.06]];

/// What leads from stored numbers to light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Curve {
    Srgb,
    Gamma(f64),
}

impl Curve {
    pub fn light(self, stored: f64) -> f64 {
        match self {
            Curve::Gamma(gamma) => stored.powf(gamma),
            Curve::Srgb if stored <= 0.04045 => stored / 12.92,
            Curve::Srgb => ((stored + 0.055) / 1.055).powf(2.4),
        }
    }

    /// As a tag of a profile.
    fn tag(self) -> Vec<u8> {
        match self {
            // A number with 8 bits behind the point.
            Curve::Gamma(gamma) => {
                let gamma = ((gamma * 256.0).round() as u16).to_be_bytes();
                [&b"curv\0\0\0\0\0\0\0\x01"[..], &gamma, &[0, 0]].concat()
            }
            Curve::Srgb => {
                let numbers = [2.4, 1.0 / 1.055, 0.055 / 1.055, 1.0 / 12.92, 0.04045];
                [&b"para\0\0\0\0\0\x03\0\0"[..], &numbers.map(fixed).concat()].concat()
            }
        }
    }
}

type Matrix = [[f64; 3]; 3];

fn times(m: Matrix, v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn inverse(m: Matrix) -> Matrix {
    let minor = |r: usize, c: usize| {
        let at = |i: usize, j: usize| m[(r + i) % 3][(c + j) % 3];
        at(1, 1) * at(2, 2) - at(1, 2) * at(2, 1)
    };
    let determinant: f64 = (0..3).map(|c| m[0][c] * minor(0, c)).sum();
    [0, 1, 2].map(|r| [0, 1, 2].map(|c| minor(c, r) / determinant))
}

fn xyz([x, y]: [f64; 2]) -> [f64; 3] {
    [x / y, 1.0, (1.0 - x - y) / y]
}

/// From red, green and blue light to XYZ, white having Y = 1.
fn xyz_from_rgb([white, red, green, blue]: Points) -> Matrix {
    let [r, g, b] = [red, green, blue].map(xyz);
    let columns = [0, 1, 2].map(|i| [r[i], g[i], b[i]]);
    let scale = times(inverse(columns), xyz(white));
    columns.map(|row| [0, 1, 2].map(|i| row[i] * scale[i]))
}

/// A texel in sRGB, or in its light; all numbers 0 to 1. Both must have the same white.
pub fn in_srgb(texel: [f64; 3], curve: Curve, points: Points, is_linear: bool) -> [f64; 3] {
    assert_eq!(points[0], SRGB[0]);
    let light = texel.map(|stored| curve.light(stored));
    let light = times(inverse(xyz_from_rgb(SRGB)), times(xyz_from_rgb(points), light));
    light.map(|light| {
        let light = light.clamp(0.0, 1.0);
        match light {
            _ if is_linear => light,
            light if light <= 0.003_130_8 => 12.92 * light,
            light => 1.055 * light.powf(1.0 / 2.4) - 0.055,
        }
    })
}

/// A number with 16 bits behind the point.
fn fixed(value: f64) -> [u8; 4] {
    ((value * 65536.0).round() as i32).to_be_bytes()
}

fn xyz_tag(value: [f64; 3]) -> Vec<u8> {
    [&b"XYZ \0\0\0\0"[..], &value.map(fixed).concat()].concat()
}

/// A display profile of three primaries and a curve; its white is adapted to D50, as the connection space
/// wants it.
pub fn rgb_profile(name: &str, curve: Curve, points: Points) -> Vec<u8> {
    let bradford = [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];
    let d50 = [0.9642, 1.0, 0.8249];
    let [from, to] = [xyz(points[0]), d50].map(|white| times(bradford, white));
    let matrix = xyz_from_rgb(points);
    let adapted = [0, 1, 2].map(|channel| {
        let cone = times(bradford, matrix.map(|row| row[channel]));
        times(inverse(bradford), [0, 1, 2].map(|i| cone[i] * to[i] / from[i]))
    });
    let [red, green, blue] = adapted.map(xyz_tag);
    let white = xyz_tag(d50);
    profile(
        b"RGB ",
        name,
        &[
            (b"wtpt", white),
            (b"rXYZ", red),
            (b"gXYZ", green),
            (b"bXYZ", blue),
            (b"rTRC", curve.tag()),
            (b"gTRC", curve.tag()),
            (b"bTRC", curve.tag()),
        ],
    )
}

/// A profile for grey.
pub fn grey_profile(name: &str, curve: Curve) -> Vec<u8> {
    profile(b"GRAY", name, &[(b"wtpt", xyz_tag([0.9642, 1.0, 0.8249])), (b"kTRC", curve.tag())])
}

/// A profile of version 4 of the kind `space` with these tags and a name.
pub fn profile(space: &[u8; 4], name: &str, tags: &[(&[u8; 4], Vec<u8>)]) -> Vec<u8> {
    let utf16: Vec<u8> = name.encode_utf16().flat_map(u16::to_be_bytes).collect();
    let len = (utf16.len() as u32).to_be_bytes();
    let text = [&b"mluc\0\0\0\0\0\0\0\x01\0\0\0\x0cenUS"[..], &len, &[0, 0, 0, 28], &utf16].concat();
    let tags: Vec<_> = tags.iter().cloned().chain([(b"desc", text)]).collect();
    let (mut table, mut data) = ((tags.len() as u32).to_be_bytes().to_vec(), Vec::new());
    let start = 128 + 4 + 12 * tags.len();
    for (kind, body) in &tags {
        table.extend_from_slice(*kind);
        table.extend(((start + data.len()) as u32).to_be_bytes());
        table.extend((body.len() as u32).to_be_bytes());
        data.extend(body);
        data.resize(data.len().next_multiple_of(4), 0);
    }
    let mut header = vec![0; 128];
    header[..4].copy_from_slice(&((start + data.len()) as u32).to_be_bytes());
    header[8..12].copy_from_slice(&[4, 0x30, 0, 0]);
    header[12..16].copy_from_slice(b"mntr");
    header[16..20].copy_from_slice(space);
    header[20..24].copy_from_slice(b"XYZ ");
    header[24..36].copy_from_slice(&[7, 0xe8, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0]);
    header[36..40].copy_from_slice(b"acsp");
    header[68..80].copy_from_slice(&[0.9642, 1.0, 0.8249].map(fixed).concat());
    [header, table, data].concat()
}
