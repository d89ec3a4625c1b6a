// What a lookup goes through, from a virtual uv to a texel of the atlas.
// CPU twin: twins/lookup.rs.

// A texel of level 0, split so that page arithmetic is in whole numbers.
struct VastexPosition {
    texel: vec2<u32>,
    fraction: vec2<f32>, // into the texel, 0 to 1; beyond an edge that is clamped or has a border colour, less or more
    way: vec2<f32>,      // -1 where a mirrored texture runs backwards, else 1
}

// A place in the atlas, in texels of the layer that is sampled.
struct VastexPlace {
    image: u32,
    cell: vec2<u32>,        // the slot's column and row there
    origin: vec2<u32>,      // the slot's first texel
    tile_texel: vec2<f32>,  // from there
    level: u32,             // the level that lies there
    page: vec2<u32>,        // the page of that level; 0,0 in the tail
}

// What a filter takes of a level.
struct VastexTaps {
    axis: vec2<f32>,        // along which taps lie around the position [texels of level 0]
    count: u32,             // of them
    cubic_share: f32,       // of 4x4 texels around the position, the rest of one tap
}

// No branch here depends on nothing but a uniform: Mesa's software driver makes a shader anew for each draw, and keeps it, if one does.

// A coordinate folded into 0 to 1 by an address mode. Where nothing repeats it stays as it is, so far as it matters, since taps of
// a place beyond the edge may lie within.
fn vastex_folded_uv(uv: f32, mode: u32) -> f32 {
    let turn = uv - 2.0 * floor(0.5 * uv);
    let mirrored = select(turn, 2.0 - turn, turn > 1.0);
    let repeated = select(uv - floor(uv), mirrored, mode == VASTEX_ADDRESS_MIRROR);
    let repeats = (mode == VASTEX_ADDRESS_WRAP) | (mode == VASTEX_ADDRESS_MIRROR);
    return select(clamp(uv, -8.0, 9.0), repeated, repeats);
}

// Which way a coordinate runs once it is folded: -1 where a mirrored texture runs backwards, else 1.
fn vastex_folded_way(uv: f32, mode: u32) -> f32 {
    let turn = uv - 2.0 * floor(0.5 * uv);
    return select(1.0, -1.0, (mode == VASTEX_ADDRESS_MIRROR) & (turn > 1.0));
}

// A place along one axis: a texel of level 0, and how far into it.
struct VastexCoordinate {
    texel: u32,
    fraction: f32,
    way: f32,
}

// The place `offset` texels after the beginning of texel `anchor`, folded into `size` texels by an address mode. Nothing here
// overflows: a size has at most 2^31 texels, and an offset reaches VASTEX_FIXED_REACH of them.
fn vastex_folded_texel(anchor: u32, offset: f32, size: u32, mode: u32) -> VastexCoordinate {
    let reach = f32(VASTEX_FIXED_REACH);
    let floored = floor(clamp(offset, -reach, reach));
    let fraction = clamp(offset, -reach, reach) - floored;
    let start = min(anchor, size - 1u);
    let back = u32(max(-floored, 0.0));
    let is_before = back > start;
    // Whole texels from the edge: onward from texel 0, or back from it.
    let steps = select(start - back + u32(max(floored, 0.0)), back - start, is_before);
    // What is inside already is not folded.
    switch select(mode, VASTEX_ADDRESS_CLAMP, !is_before && steps < size) {
        case VASTEX_ADDRESS_WRAP: {
            let rest = steps % size;
            return VastexCoordinate(select(rest, size - rest, is_before && rest != 0u), fraction, 1.0);
        }
        case VASTEX_ADDRESS_MIRROR: {
            // Before the edge lies the image of what is after it; every other turn is turned round.
            let place = select(steps, steps - 1u, is_before);
            let is_turned = is_before != ((place / size) % 2u == 1u);
            let rest = place % size;
            return VastexCoordinate(
                select(rest, size - 1u - rest, (place / size) % 2u == 1u),
                select(fraction, 1.0 - fraction, is_turned),
                select(1.0, -1.0, is_turned),
            );
        }
        default: {
            let inside = select(min(steps, size - 1u), 0u, is_before);
            let beyond = select(f32(steps - inside), -f32(steps), is_before);
            return VastexCoordinate(inside, beyond + fraction, 1.0);
        }
    }
}
