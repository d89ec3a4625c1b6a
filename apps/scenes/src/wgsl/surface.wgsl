// A surface with a virtual texture on it: where its corners lie, and how the texture's value becomes a colour.
// The text after this one is generated: vastex's own, and constants.

// What channels mean, SCENE_GREY and its kin; see look.rs.
override SCENE_LOOK: u32;
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

struct Scene {
    clip_from_world: mat4x4<f32>,
    background: vec4<f32>,
    range: vec2<f32>, // the value that is black, and 1 over its distance from the one that is white
    picture: vec2<f32>, // size in pixels
    relief: Relief,
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

// The colour of a texture's value: grey, grey with alpha, red and green, or a colour; over the background. Alpha 1 says
// "covered".
fn scene_colour(value: vec4<f32>) -> vec4<f32> {
    let shown = (value.rgb - scene.range.x) * scene.range.y;
    if SCENE_LOOK == SCENE_GREY {
        return vec4<f32>(shown.rrr, 1.0);
    }
    if SCENE_LOOK == SCENE_GREY_ALPHA {
        return vec4<f32>(mix(scene.background.rgb, shown.rrr, value.g), 1.0);
    }
    if SCENE_LOOK == SCENE_RED_GREEN {
        return vec4<f32>(shown.rg, 0.0, 1.0);
    }
    return vec4<f32>(mix(scene.background.rgb, shown, value.a), 1.0);
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
