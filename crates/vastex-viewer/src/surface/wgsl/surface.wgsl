// A surface with a virtual texture on it: where its corners lie, and how the texture's value becomes a colour.
// The text after this one is generated: vastex's own, and constants.

// What channels mean, SCENE_GREY and its kin; see layers.rs.
override SCENE_LOOK: u32;
// The exponent of values in their range, and the colour map of a single channel; see palette.rs.
override SCENE_GAMMA: f32;
override SCENE_MAP: u32;
// Whether the layer's values are display values and the target is given light, or the other way round; see layers.rs.
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
    all: u32,    // colour and heights together; without heights the colour
    color: u32,
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
    texels_per_radian: vec2<f32>,
    sine_and_cosine: vec2<f32>,   // of the latitude below the camera
    altitude: f32,                // in radii
}

struct Scene {
    clip_from_world: mat4x4<f32>,
    background: vec4<f32>,
    range: vec2<f32>, // the value that is black, and 1 over its distance from the one that is white
    picture: vec2<f32>, // size in pixels
    relief: Relief,
    ids: SceneIds,
    fixed: Fixed,
}

@group(1) @binding(0) var<uniform> scene: Scene;

struct Corner {
    @location(0) position: vec3<f32>,
    @location(1) uv: vec2<f32>,
}

struct Surface {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

// What the target is given for the colour of a texture's value on ground that is so light.
fn scene_lit(value: vec4<f32>, light: f32) -> vec4<f32> {
    let colour = scene_mapped(value);
    let lit = colour.rgb * light;
    if SCENE_DECODES {
        return vec4<f32>(light_from_display(lit), colour.a);
    }
    if SCENE_ENCODES {
        return vec4<f32>(display_from_light(lit), colour.a);
    }
    return vec4<f32>(lit, colour.a);
}

// What the target is given where no texture is; its alpha says "not covered".
fn scene_beside() -> vec4<f32> {
    var background = scene.background.rgb;
    if SCENE_DECODES {
        background = light_from_display(background);
    }
    if SCENE_ENCODES {
        background = display_from_light(background);
    }
    return vec4<f32>(background, 0.0);
}

// As `scene_lit` on ground as light as it can be.
fn scene_colour(value: vec4<f32>) -> vec4<f32> {
    return scene_lit(value, 1.0);
}

// The colour of a texture's value, as light or as a display value, as the layer has it: grey, grey with alpha, red and green, or a
// colour; over the background. Alpha 1 says "covered".
fn scene_mapped(value: vec4<f32>) -> vec4<f32> {
    let colour = scene_value_color(value, SCENE_LOOK, scene.range, SCENE_GAMMA, SCENE_MAP);
    return vec4<f32>(mix(scene.background.rgb, colour.rgb, colour.a), 1.0);
}

// The colour of a value and how much it hides, by what channels mean, the range, the exponent of values in it, and the colour map of a
// single channel.
fn scene_value_color(value: vec4<f32>, channels: u32, range: vec2<f32>, gamma: f32, map: u32) -> vec4<f32> {
    var shown = (value.rgb - range.x) * range.y;
    if gamma != 1.0 {
        shown = pow(max(shown, vec3<f32>(0.0)), vec3<f32>(gamma));
    }
    if channels == SCENE_GREY || channels == SCENE_GREY_ALPHA {
        let alpha = select(1.0, value.g, channels == SCENE_GREY_ALPHA);
        if map == 0u {
            return vec4<f32>(shown.rrr, alpha);
        }
        return vec4<f32>(palette_color(map, shown.r), alpha);
    }
    if channels == SCENE_RED_GREEN {
        return vec4<f32>(shown.rg, 0.0, 1.0);
    }
    return vec4<f32>(shown, value.a);
}

fn scene_clip(corner: Corner) -> vec4<f32> {
    return scene.clip_from_world * vec4<f32>(corner.position, 1.0);
}

// Where on the texture a corner is. It goes on beyond 0 to 1, without a jump, so that whatever a picture is compared with has none.
fn scene_texture_uv(corner: Corner) -> vec2<f32> {
    return corner.uv * vec2<f32>(SCENE_REPEATS_U, SCENE_REPEATS_V) + vec2<f32>(SCENE_FIRST_U, SCENE_FIRST_V);
}

// The same as a shader has it that computes uv in turns, which jumps.
fn scene_folded_uv(uv: vec2<f32>) -> vec2<f32> {
    return select(uv, fract(uv), vec2<bool>(SCENE_FOLDS_U, SCENE_FOLDS_V));
}

@vertex
fn place(corner: Corner) -> Surface {
    return Surface(scene_clip(corner), scene_texture_uv(corner));
}
