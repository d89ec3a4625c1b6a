// A planet of several textures under a sun: ground, relief from heights, lights where it is night, clouds.
// The text after this one is generated: vastex's own, and planet_color, planet_height, planet_night and planet_clouds, each
// (uv, ddx, ddy) -> vec4, from its member of the group where there is one.

struct Planet {
    clip_from_world: mat4x4<f32>,
    sun: vec3<f32>,         // towards it
    relief: f32,            // slope of the ground, for heights that rise by 1 over a whole turn of the planet
    height_texel: vec2<f32>, // uv of a texel of the heights
    ids: array<vec4<u32>, 2>, // of the whole group, then of its members
}

@group(1) @binding(0) var<uniform> planet: Planet;

struct Corner {
    @location(0) position: vec3<f32>,
    @location(1) uv: vec2<f32>,
}

struct Surface {
    @builtin(position) clip: vec4<f32>,
    @location(0) up: vec3<f32>,
    @location(1) uv: vec2<f32>,
}

const PLANET_LIGHTS: vec3<f32> = vec3<f32>(1.0, 0.78, 0.45);

// The ground's normal where heights rise: the slope to the east and to the north, over a texel or a pixel.
fn planet_normal(surface: Surface, ddx: vec2<f32>, ddy: vec2<f32>) -> vec3<f32> {
    let up = normalize(surface.up);
    let east = normalize(vec3<f32>(-up.y, up.x, 0.0) + vec3<f32>(0.0, 1e-6, 0.0));
    let north = cross(up, east);
    let step = max(planet.height_texel, abs(ddx) + abs(ddy));
    let here = planet_height(surface.uv, ddx, ddy).r;
    let eastward = planet_height(surface.uv + vec2<f32>(step.x, 0.0), ddx, ddy).r - here;
    let northward = planet_height(surface.uv - vec2<f32>(0.0, step.y), ddx, ddy).r - here;
    let slope = planet.relief * vec2<f32>(eastward, northward) / step;
    return normalize(up - slope.x * east - slope.y * north);
}

@vertex
fn place(corner: Corner) -> Surface {
    return Surface(planet.clip_from_world * vec4<f32>(corner.position, 1.0), corner.position, corner.uv);
}

@fragment
fn shade(surface: Surface) -> @location(0) vec4<f32> {
    let ddx = dpdx(surface.uv);
    let ddy = dpdy(surface.uv);
    if vastex_asked(0u, surface.clip) {
        vastex_report(0u, surface.clip, vastex_feedback_grad(planet.ids[0].x, 0u, surface.uv, ddx, ddy));
    }
    let ground = planet_color(surface.uv, ddx, ddy).rgb;
    let clouds = planet_clouds(surface.uv, ddx, ddy).r;
    let lights = planet_night(surface.uv, ddx, ddy).r;
    let height_of_sun = dot(normalize(surface.up), planet.sun);
    let day = smoothstep(-0.08, 0.12, height_of_sun);
    let light = day * max(dot(planet_normal(surface, ddx, ddy), planet.sun), 0.0);
    let lit = mix(ground * (0.06 + 1.1 * light), vec3<f32>(0.04 + max(height_of_sun, 0.0)), clouds);
    return vec4<f32>(lit + (1.0 - day) * (1.0 - 0.8 * clouds) * lights * PLANET_LIGHTS, 1.0);
}
