// The application's own shader, which has a bind group for each of view, light, material and object. The textures' bindings lie among the
// material's, behind its own; `vastex_sample` comes with the text after this one.

struct View {
    clip_from_world: mat4x4<f32>,
    world_from_clip: mat4x4<f32>,
    eye: vec4<f32>, // of the sun: the way to it
}

struct Material {
    texture: u32,   // Vastex: which
    roughness: f32, // 0 to 1
}

struct Object {
    world_from_object: mat4x4<f32>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(1) @binding(0) var<uniform> sun: View; // as the shadow map is drawn
@group(1) @binding(1) var shadows: texture_depth_2d;
@group(1) @binding(2) var shadow_sampler: sampler_comparison;
@group(2) @binding(0) var<uniform> material: Material;
@group(3) @binding(0) var<uniform> object: Object;

struct Vertex {
    @location(0) place: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
}

struct Surface {
    @builtin(position) @invariant clip: vec4<f32>, // invariant, since the prepass draws the same
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @location(3) @interpolate(flat) texture: u32,
    @location(4) @interpolate(flat) roughness: f32,
}

fn clip_position(place: vec3<f32>) -> vec4<f32> {
    return view.clip_from_world * (object.world_from_object * vec4<f32>(place, 1.0));
}

fn surface(vertex: Vertex) -> Surface {
    let world = object.world_from_object * vec4<f32>(vertex.place, 1.0);
    let normal = object.world_from_object * vec4<f32>(vertex.normal, 0.0);
    let clip = clip_position(vertex.place);
    return Surface(clip, world.xyz, normal.xyz, vertex.uv, material.texture, material.roughness);
}

// Depth alone: of the shadow map, and before the picture.
@vertex
fn place_depth(vertex: Vertex) -> @builtin(position) @invariant vec4<f32> {
    return clip_position(vertex.place);
}

@vertex
fn place(vertex: Vertex) -> Surface {
    return surface(vertex);
}

// What is seen in a direction where nothing stands: a dim room with a window.
fn room(way: vec3<f32>) -> vec3<f32> {
    let height = smoothstep(-0.15, 0.75, way.z);
    let walls = mix(vec3<f32>(0.05, 0.037, 0.031), vec3<f32>(0.16, 0.17, 0.2), height);
    let across = normalize(cross(sun.eye.xyz, vec3<f32>(0.0, 0.0, 1.0)));
    let upward = cross(across, sun.eye.xyz);
    let from_middle = abs(vec2<f32>(dot(way, across), dot(way, upward)));
    let pane = smoothstep(vec2<f32>(0.42, 0.5), vec2<f32>(0.34, 0.42), from_middle);
    let bars = smoothstep(0.012, 0.03, from_middle.x) * smoothstep(0.012, 0.03, from_middle.y);
    let is_ahead = select(0.0, 1.0, dot(way, sun.eye.xyz) > 0.0);
    return walls + is_ahead * pane.x * pane.y * bars * vec3<f32>(3.4, 3.3, 3.0);
}

// How much of the sun reaches a place, 0 to 1.
fn sunlit(world: vec3<f32>) -> f32 {
    let clip = sun.clip_from_world * vec4<f32>(world, 1.0);
    let uv = clip.xy * vec2<f32>(0.5, -0.5) + 0.5;
    let texel = 1.0 / vec2<f32>(textureDimensions(shadows));
    var lit = 0.0;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let at = uv + vec2<f32>(f32(x), f32(y)) * 1.6 * texel;
            lit += textureSampleCompareLevel(shadows, shadow_sampler, at, clip.z);
        }
    }
    return lit / 9.0;
}

// To a display's range, with soft highlights.
fn exposed(radiance: vec3<f32>) -> vec3<f32> {
    let x = radiance * 0.95;
    return clamp((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), vec3<f32>(0.0), vec3<f32>(1.0));
}

@fragment
fn shade(surface: Surface) -> @location(0) vec4<f32> {
    let colour = vastex_sample(surface.texture, surface.uv).rgb; // Vastex: in the place of textureSample(..)
    let normal = normalize(surface.normal);
    let eyeward = normalize(view.eye.xyz - surface.world);
    let sunward = sun.eye.xyz;
    let facing = max(dot(normal, eyeward), 0.0);
    let lit = max(dot(normal, sunward), 0.0) * sunlit(surface.world + 0.02 * normal);

    // The room from above, and what the table throws back from below; less of either near the ground.
    let open = mix(0.45, 1.0, smoothstep(-0.3, 0.9, surface.world.z));
    let is_upright = 1.0 - abs(normal.z);
    let from_room = mix(vec3<f32>(0.20, 0.14, 0.10), vec3<f32>(0.34, 0.37, 0.43), 0.5 + 0.5 * normal.z);
    let diffuse = colour * (vec3<f32>(2.1, 1.8, 1.42) * lit + from_room * mix(1.0, open, is_upright));

    // Of polish: a highlight of the sun and a picture of the room, more at a glance.
    let fresnel = 0.04 + 0.96 * pow(1.0 - facing, 5.0);
    let sharpness = 4.0 / (surface.roughness * surface.roughness + 0.002);
    let highlight = pow(max(dot(normal, normalize(sunward + eyeward)), 0.0), sharpness);
    let gloss = (1.0 - surface.roughness) * (1.0 - surface.roughness);
    let mirrored = room(reflect(-eyeward, normal)) * gloss;
    let specular = fresnel * (mirrored + lit * highlight * sharpness * 0.09 * vec3<f32>(1.0, 0.95, 0.85));

    // The table goes over into the dark.
    let far = smoothstep(5.0, 17.0, length(surface.world.xy));
    return vec4<f32>(exposed(mix(diffuse + specular, room(-eyeward), far)), 1.0);
}

struct Behind {
    @builtin(position) clip: vec4<f32>,
    @location(0) way: vec3<f32>,
}

// The whole picture, as far away as can be.
@vertex
fn cover(@builtin(vertex_index) corner: u32) -> Behind {
    let at = vec2<f32>(f32(corner & 1u) * 4.0 - 1.0, f32(corner >> 1u) * 4.0 - 1.0);
    let ahead = view.world_from_clip * vec4<f32>(at, 0.5, 1.0);
    return Behind(vec4<f32>(at, 0.0, 1.0), ahead.xyz / ahead.w - view.eye.xyz);
}

@fragment
fn shade_behind(behind: Behind) -> @location(0) vec4<f32> {
    return vec4<f32>(exposed(room(normalize(behind.way))), 1.0);
}
