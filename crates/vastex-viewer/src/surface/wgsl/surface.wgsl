// A surface with a virtual texture on it: where its corners lie, and how the texture's value becomes a colour.
// The text after this one is generated: vastex's own, and constants.

// What channels mean, in the lowest two bits SCENE_GREY and its kin; then two bits each for the channels that are red, green and blue;
// then SCENE_NODATA where what is no number or infinite stands for no data, and SCENE_NODATA_VALUE where a value does; and how values become
// shades: SCENE_LOG and its kin. Of a list of layers the last of these alone: those that any layer has. See layers/mod.rs.
override SCENE_LOOK: u32;
// Whether the layer's values are display values and the target is given light, or the other way round; see layers/mod.rs.
override SCENE_DECODES: bool;
override SCENE_ENCODES: bool;
// How the texture lies on the surface; see tiling.rs.
override SCENE_REPEATS_U: f32;
override SCENE_REPEATS_V: f32;
override SCENE_FIRST_U: f32;
override SCENE_FIRST_V: f32;
override SCENE_FOLDS_U: bool;
override SCENE_FOLDS_V: bool;

// What displaces a surface with heights; see relief.wgsl.
struct Relief {
    eye: vec3<f32>,         // the camera over the surface without heights: as far above it as above the ground
    scale: f32,             // how high a value of 1 rises
    spacing: vec2<f32>,     // uv from one vertex to the next, by distance
    texels: vec2<f32>,      // of the heights, level 0
    extent: vec2<f32>,      // in the world, for a step of 1 in uv
    zero: f32,              // the value that is not displaced
    range_per_side: f32,    // the distance within which a patch is drawn, by its side along u
}

// What is sampled, by its ids, and the number of the view that is drawn.
struct SceneIds {
    all: u32,    // what is wanted together: all visible layers, and the heights
    color: u32,  // the first layer, or of several the one that overlays inspect
    height: u32,
    view: u32,
}

// What is told of a camera where every pixel works out by itself what it sees; see fixed.wgsl and fixed.rs.
struct Fixed {
    anchor: vec2<u32>,            // the texel in the middle of the view
    fraction: vec2<f32>,          // how far into it the middle is
    low: vec2<f32>,               // the edges of the texture, in texels from the anchor
    high: vec2<f32>,
    half: vec2<f32>,              // half the view, of the image in texels, of the globe in tangents
    texels_per_unit: vec2<f32>,   // texels in a radian of the globe, or in a step of 1 in the world
    sine_and_cosine: vec2<f32>,   // of the latitude below the camera
    altitude: f32,                // in radii, or in the world
    turn: mat2x2<f32>,            // from steps to the right and upwards in the view to those in an image
    aim: vec4<f32>,               // over a globe, sine and cosine of the heading and of the tilt of the camera
}

// The grid that vertices with heights stand on in fixed point; see relief_fixed.wgsl and fixed_relief.rs.
struct ReliefGrid {
    step: vec2<f32>,      // texels along a step of the grid
    rest: vec2<f32>,      // texels from the grid's point before the camera to the camera
    poles: vec4<i32>,     // rows of the poles from that point, high and low parts: the north, the south
    size: vec2<u32>,      // of the texture
    turn: i32,            // steps round the globe, in high parts
    range_per_step: f32,  // the distance within which a patch is drawn, by the steps along a quad
}

// A texture beside the one that places in fixed point are told of, where it has a size of its own.
struct LayerPlace {
    anchor: vec2<u32>,   // its texel in the middle of the view, or the nearest to it
    fraction: vec2<f32>, // how far into it the middle is
    ratio: vec2<f32>,    // its texels in one of the other's
    end: vec2<f32>,      // where it ends, in its texels from the anchor
}

// How a planet is lit and looked at; see planet.wgsl and planet.rs.
struct Planet {
    sun: vec3<f32>,       // towards it
    lit: f32,             // 1 where the sun shines; 0 where all is as light as it can be
    eye: vec3<f32>,       // the camera, in radii from the middle of the planet
    density: f32,         // how dense the atmosphere is, the Earth's being 1
    ahead: vec3<f32>,     // the ray in the middle of the view
    sea: f32,             // 1 over the value above which nothing is sea; 0 where there is none
    across: vec3<f32>,    // from there to the right edge of the view
    night: f32,           // how bright lights are
    upward: vec3<f32>,    // and to the upper edge
    pixel: f32,           // the angle of a pixel
}

// Beside the layers of a list: the places of heights, and those of what is wanted together.
const PLACE_HEIGHT: u32 = 8u;
const PLACE_WANTED: u32 = 9u;

// How values become shades: by their range and the exposure, and the curve and the exponent within it; see layers/tone.rs.
struct Tone {
    range: vec2<f32>, // the value that is black, and how much lighter one more is: 1 over the distance to white, times the exposure
    curve: f32,       // by how much a logarithm spreads what is dark
    gamma: f32,
}

struct Scene {
    clip_from_world: mat4x4<f32>,
    background: vec4<f32>,
    tone: Tone,
    picture: vec2<f32>, // size in pixels, of the whole where parts are drawn, of a pane where there are several
    map: u32,           // 1 where the palette makes colours of a single channel
    nodata: f32,        // the value that stands for no data
    part: vec4<f32>,    // of a picture that is drawn in parts: from places of the part, -1 to 1, to those of the whole, a factor and an offset
    origin: vec2<f32>,  // the part's first pixel in the whole
    panes: f32,         // beside each other
    unused: f32,
    nodata_colour: vec4<f32>, // of what is without data, as the layer's values are; alpha 0 where it is not drawn
    ground: vec4<f32>,  // what is seen through the surface, as the layer's values are, and how much lighter every other square of it is
    growing: vec4<f32>, // of a texture whose rows are still coming, where those end that are there: in uv, and in rows; the rest is unused
    relief: array<Relief, 2>,     // the first of each; see scene_zero
    ids: SceneIds,
    fixed: array<Fixed, 2>,
    grid: array<ReliefGrid, 2>,
    places: array<LayerPlace, 10>,
    planet: Planet,
    palette: array<vec4<u32>, PALETTE_WORDS>, // the points of the colour map, evenly spread; four 8-bit numbers each
}

@group(1) @binding(0) var<uniform> scene: Scene;

// 0, as no compiler knows: surfaces with heights find by it what levels, and so conditions, follow from (ARCHITECTURE.md, "Where the text
// bends to a driver").
var<private> scene_zero: u32;

// The pixel that is drawn, where what is seen through the surface depends on it.
var<private> scene_at: vec2<f32>;

// 1 where the row that is looked at of a texture that grows is not there yet.
var<private> scene_missing: f32;

// Whether a row lies behind those that are there, as a number.
fn scene_behind(row: f32, end: f32) -> f32 {
    return select(0.0, 1.0, row > end);
}

// What is seen through the surface: plain, or squares of 12 pixels a side.
fn scene_ground() -> vec3<f32> {
    let square = floor((scene_at + scene.origin) / 12.0);
    let sum = square.x + square.y;
    return scene.ground.rgb + vec3<f32>(scene.ground.a * (sum - (2.0 * floor(sum / 2.0))));
}

// What the target is given for the colour of a texture's value on ground that is so light.
fn scene_lit(value: vec4<f32>, light: f32) -> vec4<f32> {
    let colour = scene_mapped(value);
    return scene_stored(vec4<f32>(colour.rgb * light, colour.a));
}

// What the target is given for a colour that is told as the layer's are.
fn scene_stored(colour: vec4<f32>) -> vec4<f32> {
    if SCENE_DECODES {
        return vec4<f32>(light_from_display(colour.rgb), colour.a);
    }
    if SCENE_ENCODES {
        return vec4<f32>(display_from_light(colour.rgb), colour.a);
    }
    return colour;
}

// What the target is given where no texture is; its alpha says "not covered".
fn scene_beside() -> vec4<f32> {
    return scene_stored(vec4<f32>(scene.background.rgb, 0.0));
}

// As `scene_lit` on ground as light as it can be.
fn scene_colour(value: vec4<f32>) -> vec4<f32> {
    return scene_lit(value, 1.0);
}

// The colour of a texture's value, as light or as a display value, as the layer has it: grey, grey with alpha, red and green, or a
// colour; over the background. Alpha 1 says "covered".
fn scene_mapped(value: vec4<f32>) -> vec4<f32> {
    let plain = scene_value_color(value, SCENE_LOOK, scene.nodata, scene.tone);
    var colour = scene_or_nodata(plain, scene.nodata_colour);
    if scene_takes_map(plain, SCENE_LOOK, scene.map) {
        let at = palette_place(plain.r);
        let first = palette_first(at);
        let low = scene.palette[first / 4u][first % 4u];
        let high = scene.palette[(first + 1u) / 4u][(first + 1u) % 4u];
        colour = vec4<f32>(palette_between(low, high, at - f32(first)), plain.a);
    }
    return vec4<f32>(mix(scene_ground(), colour.rgb, colour.a * (1.0 - scene_missing)), 1.0);
}

// How near to the value that stands for no data others count as the same, by the scale of stored values: see layers/stored.rs.
fn scene_nodata_within(look: u32, nodata: f32) -> f32 {
    switch (look / SCENE_NODATA_SCALE) & 3u {
        case 1u: {
            return 0.5 / 255.0;
        }
        case 2u: {
            return 0.5 / 65535.0;
        }
        case 3u: {
            return (0.4 / 255.0) * max(2.27488 * pow(max(nodata, 0.0), 0.583333), 1.0 / 12.92);
        }
        default: {
            return abs(nodata) * 1e-6;
        }
    }
}

// Whether all values stand for no data: whether each is that value, where there is one, or is no number or infinite by its bits, since shaders may
// compute as if all were numbers.
fn scene_is_nodata(values: vec3<f32>, look: u32, nodata: f32) -> bool {
    let magnitudes = bitcast<vec3<u32>>(values) & vec3<u32>(0x7fffffffu);
    let is_number = magnitudes < vec3<u32>(0x7f800000u);
    let is_other = abs(values - nodata) > vec3<f32>(scene_nodata_within(look, nodata));
    let is_any_value = (look & SCENE_NODATA_VALUE) == 0u;
    return !any(is_number & (is_other | vec3<bool>(is_any_value)));
}

// What `scene_value_color` gives, or the colour of what is without data.
fn scene_or_nodata(plain: vec4<f32>, nodata_colour: vec4<f32>) -> vec4<f32> {
    return select(plain, nodata_colour, plain.a < -1e30);
}

// Whether a colour map makes the colour of a value that is there, of which `scene_value_color` gave the shade.
fn scene_takes_map(plain: vec4<f32>, look: u32, map: u32) -> bool {
    let channels = look & 3u;
    let is_value = !(plain.a < -1e30);
    return is_value & (map != 0u) & ((channels == SCENE_GREY) | (channels == SCENE_GREY_ALPHA));
}

// Light that is brighter than a screen as light on it, by the numbers of a curve; see layers/tone.rs.
fn scene_rolled_off(light: vec3<f32>, above: vec2<f32>, below: vec3<f32>) -> vec3<f32> {
    let x = clamp(light, vec3<f32>(0.0), vec3<f32>(SCENE_MOST_LIGHT));
    return min((x * ((x * above.x) + above.y)) / ((x * ((x * below.x) + below.y)) + below.z), vec3<f32>(1.0));
}

// The colour of a value and how much it hides, by what channels mean, the value that stands for no data, and how values become shades: of a
// single channel the shade, which a colour map may make a colour of. What is without data has an alpha that no value has.
fn scene_value_color(value: vec4<f32>, look: u32, nodata: f32, tone: Tone) -> vec4<f32> {
    let channels = look & 3u;
    let bands = vec3<u32>(look >> 2u, look >> 4u, look >> 6u) & vec3<u32>(3u);
    let values = vec3<f32>(value[bands.x], value[bands.y], value[bands.z]);
    // Asked of the value first, which every value is: no condition depends on a uniform alone.
    let is_value = !(value.a < -1e30);
    if (is_value & ((look & SCENE_NODATA) != 0u)) && scene_is_nodata(values, look, nodata) {
        return vec4<f32>(0.0, 0.0, 0.0, -2e30);
    }
    var shown = (values - tone.range.x) * tone.range.y;
    if is_value & ((look & SCENE_LOG) != 0u) {
        shown = log2(max(shown, vec3<f32>(0.0)) * tone.curve + 1.0) / log2(tone.curve + 1.0);
    }
    if is_value & ((look & SCENE_REINHARD) != 0u) {
        shown = scene_rolled_off(shown, SCENE_REINHARD_ABOVE, SCENE_REINHARD_BELOW);
    }
    if is_value & ((look & SCENE_ACES) != 0u) {
        shown = scene_rolled_off(shown, SCENE_ACES_ABOVE, SCENE_ACES_BELOW);
    }
    if is_value & ((look & SCENE_LIGHT) != 0u) {
        shown = display_from_light(shown);
    }
    if is_value & ((look & SCENE_GAMMA) != 0u) {
        shown = pow(max(shown, vec3<f32>(0.0)), vec3<f32>(tone.gamma));
    }
    if is_value & ((channels == SCENE_GREY) | (channels == SCENE_GREY_ALPHA)) {
        let alpha = select(1.0, value.g, channels == SCENE_GREY_ALPHA);
        return vec4<f32>(shown.rrr, alpha);
    }
    if is_value & (channels == SCENE_RED_GREEN) {
        return vec4<f32>(shown.rg, 0.0, 1.0);
    }
    return vec4<f32>(shown, value.a);
}
