// The types of a lookup, and folding by address modes. What a lookup goes through: ARCHITECTURE.md, "Where it is decided".
// CPU twin: twins/lookup.rs.

// A whole number from 0 to 2^23 - 1 that is a float. The sum has it in its lowest bits: a conversion would be guarded against numbers
// that it cannot make.
fn vastexi_whole(number: f32) -> u32 {
    return bitcast<u32>(number + 8388608.0) & 0x7fffffu;
}

fn vastexi_wholes(numbers: vec2<f32>) -> vec2<u32> {
    return bitcast<vec2<u32>>(numbers + 8388608.0) & vec2<u32>(0x7fffffu);
}

// A texel of level 0, split so that page arithmetic is in whole numbers.
struct VastexiPosition {
    texel: vec2<u32>,
    fraction: vec2<f32>,  // into the texel, 0 to 1; beyond an edge that is clamped or has a border colour, less or more
    direction: vec2<f32>, // -1 where a mirrored texture runs backwards, else 1
}

// A place in the atlas, in texels of the layer that is sampled.
struct VastexiPlace {
    image: u32,
    cell: vec2<f32>,        // the slot's column and row there
    origin: vec2<f32>,      // the slot's first texel
    tile_texel: vec2<f32>,  // from there
    inverse_scale: vec2<f32>, // texels along one of level 0
    level: u32,             // the level that lies there
    page: vec2<u32>,        // the page of that level; 0,0 in the tail
}

// What a filter takes of a level.
struct VastexiTaps {
    axis: vec2<f32>,        // along which taps lie around the position [texels of level 0]
    count: u32,             // of them
    cubic_share: f32,       // of 4x4 texels around the position, the rest of one tap
}

// How far beyond an edge a coordinate is told from others where nothing repeats, so far as it matters, since taps of a place beyond the
// edge may lie within.
const VASTEXI_NEAR: vec2<f32> = vec2<f32>(-8.0, 9.0);

// A coordinate folded into 0 to 1 by an address mode, and which way it runs then: -1 where a mirrored texture runs backwards, else 1. Where
// nothing repeats it stays as it is, within VASTEXI_NEAR.
//
// What follows from the mode is the same for a draw: a GPU finds it once for all pixels, and what is left for each of them has no case.
fn vastexi_folded(uv: f32, mode: u32) -> vec2<f32> {
    let mirrors = mode == VASTEXI_ADDRESS_MIRROR;
    let repeats = mirrors | (mode == VASTEXI_ADDRESS_WRAP);
    let reach = select(VASTEXI_NEAR, vec2<f32>(-1e30, 1e30), repeats);
    let period = select(1.0, 2.0, mirrors);
    let periods_in_one = select(select(0.0, 1.0, repeats), 0.5, mirrors);
    let turn = select(16.0, 1.0, mirrors); // where it turns back; beyond reach where it does not
    let near = clamp(uv, reach.x, reach.y);
    let within = near - period * floor(near * periods_in_one);
    return vec2<f32>(min(within, 2.0 * turn - within), select(1.0, -1.0, within > turn));
}

// A place along one axis: a texel of level 0, and how far into it.
struct VastexiCoordinate {
    texel: u32,
    fraction: f32,
    direction: f32,
}

// The place `offset` texels after the beginning of texel `anchor`, folded into `size` texels by an address mode. Nothing here
// overflows: a size has at most 2^31 texels, and an offset reaches VASTEXI_FIXED_REACH of them.
fn vastexi_folded_texel(anchor: u32, offset: f32, size: u32, mode: u32) -> VastexiCoordinate {
    let reach = f32(VASTEXI_FIXED_REACH);
    let floored = floor(clamp(offset, -reach, reach));
    let fraction = clamp(offset, -reach, reach) - floored;
    let start = min(anchor, size - 1u);
    let back = u32(max(-floored, 0.0));
    let is_before = back > start;
    // Whole texels from the edge: onward from texel 0, or back from it.
    let steps = select(start - back + u32(max(floored, 0.0)), back - start, is_before);
    // What is inside already is not folded.
    switch select(mode, VASTEXI_ADDRESS_CLAMP, !is_before && steps < size) {
        case VASTEXI_ADDRESS_WRAP: {
            let rest = steps % size;
            return VastexiCoordinate(select(rest, size - rest, is_before && rest != 0u), fraction, 1.0);
        }
        case VASTEXI_ADDRESS_MIRROR: {
            // Before the edge lies the image of what is after it; every other turn is turned round.
            let place = select(steps, steps - 1u, is_before);
            let is_turned = is_before != ((place / size) % 2u == 1u);
            let rest = place % size;
            return VastexiCoordinate(
                select(rest, size - 1u - rest, (place / size) % 2u == 1u),
                select(fraction, 1.0 - fraction, is_turned),
                select(1.0, -1.0, is_turned),
            );
        }
        default: {
            let inside = select(min(steps, size - 1u), 0u, is_before);
            let beyond = select(f32(steps - inside), -f32(steps), is_before);
            return VastexiCoordinate(inside, beyond + fraction, 1.0);
        }
    }
}
