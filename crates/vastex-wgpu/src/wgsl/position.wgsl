// What a lookup goes through, from a virtual uv to a texel of the atlas.
// CPU twin: twins/lookup.rs.

// A texel of level 0, split so that page arithmetic is in whole numbers.
struct VastexPosition {
    texel: vec2<u32>,
    fraction: vec2<f32>, // into the texel, 0 to 1; beyond an edge with a border colour, less or more
}

// A place in the atlas, in texels of the layer that is sampled.
struct VastexPlace {
    image: u32,
    origin: vec2<u32>,      // the slot's first texel
    tile_texel: vec2<f32>,  // from there
    level: u32,             // the level that lies there
}

// A coordinate folded into 0 to 1 by an address mode; a border colour needs it as it is, so far as it matters.
fn vastex_folded_uv(uv: f32, mode: u32) -> f32 {
    switch mode {
        case VASTEX_ADDRESS_WRAP: {
            return uv - floor(uv);
        }
        case VASTEX_ADDRESS_MIRROR: {
            let turn = uv - 2.0 * floor(0.5 * uv);
            return select(turn, 2.0 - turn, turn > 1.0);
        }
        case VASTEX_ADDRESS_BORDER: {
            return clamp(uv, -8.0, 9.0);
        }
        default: {
            return clamp(uv, 0.0, 1.0);
        }
    }
}
