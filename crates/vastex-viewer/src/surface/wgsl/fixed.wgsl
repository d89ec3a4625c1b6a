// The image, or the globe, for textures and cameras of any size and nearness: every pixel works out by itself which place of the texture
// it sees, in texels from the one in the middle of the view. What is near has small numbers, which f32 holds exactly enough.
// The scene is told by fixed.rs. The text after this one is generated: vastex's own, constants, surface.wgsl.

override FIXED_GLOBE: bool;

// What a fragment is told of the camera comes with the triangle: Mesa's lavapipe (22.3) crashes where a fragment shader that samples in
// fixed point reads it from the uniform buffer.
struct Seen_fixed {
    @builtin(position) clip: vec4<f32>,
    @location(0) seen: vec2<f32>, // from the middle of the view, to the right and upwards: texels of an image, tangents of a globe's view
    @location(1) @interpolate(flat) anchor: vec2<u32>,
    @location(2) @interpolate(flat) fraction_and_scale: vec4<f32>, // of the middle in its texel; texels in a radian
    @location(3) @interpolate(flat) edges: vec4<f32>, // of the texture, in texels from the anchor
    @location(4) @interpolate(flat) sphere: vec3<f32>, // sine and cosine of the latitude below the camera, and its altitude
    @location(5) @interpolate(flat) aim: vec4<f32>, // sine and cosine of the camera's heading and of its tilt, over the globe
}

// What a ray meets.
struct Ground {
    offset: vec2<f32>, // texels of level 0 from the anchor
    is_met: bool,
}

// One triangle that is larger than any view, wherever feedback has its pixels.
fn fixed_corner(index: u32) -> vec2<f32> {
    return vec2<f32>(f32(index % 2u), f32(index / 2u)) * 12.0 - 3.0;
}

fn fixed_ray(clip: vec4<f32>, at: vec2<f32>) -> Seen_fixed {
    let told = scene.fixed[0];
    let fraction_and_scale = vec4<f32>(told.fraction, told.texels_per_unit);
    let sphere = vec3<f32>(told.sine_and_cosine, told.altitude);
    let seen = (at * scene.part.xy) + scene.part.zw;
    return Seen_fixed(clip, told.turn * (seen * told.half), told.anchor, fraction_and_scale, vec4<f32>(told.low, told.high), sphere, told.aim);
}

@vertex
fn place_fixed(@builtin(vertex_index) index: u32) -> Seen_fixed {
    let at = fixed_corner(index);
    return fixed_ray(vec4<f32>(at, 0.0, 1.0), at);
}

@vertex
fn place_fixed_feedback(@builtin(vertex_index) index: u32) -> Seen_fixed {
    let at = fixed_corner(index);
    return fixed_ray(vastex_feedback_clip(scene.ids.view, vec4<f32>(at, 0.0, 1.0)), at);
}

// The angle of a vector, to some 1e-7 of it: what WGSL promises of atan2 is a thousand times less.
fn fixed_angle(y: f32, x: f32) -> f32 {
    let low = min(abs(x), abs(y));
    let high = max(max(abs(x), abs(y)), 1e-30);
    let is_wide = low > (0.41421357 * high);
    let ratio = select(low, low - high, is_wide) / select(high, low + high, is_wide);
    let z = ratio * ratio;
    let series = (((0.080537445 * z - 0.13877685) * z + 0.19977711) * z - 0.3333295) * z;
    var angle = ratio + (ratio * series) + select(0.0, 0.78539816, is_wide);
    angle = select(angle, 1.5707963 - angle, abs(y) > abs(x));
    angle = select(angle, 3.1415927 - angle, x < 0.0);
    return select(angle, -angle, y < 0.0);
}

// What is seen somewhere in the view of a ray.
fn fixed_ground(ray: Seen_fixed, seen: vec2<f32>) -> Ground {
    let fraction = ray.fraction_and_scale.xy;
    if !FIXED_GLOBE {
        let offset = fraction + vec2<f32>(seen.x, -seen.y);
        return Ground(offset, all(offset >= ray.edges.xy) && all(offset <= ray.edges.zw));
    }
    // The ray by its steps to the right and onward for a step down, then to the east and to the north.
    let fall = ray.aim.w - (ray.aim.z * seen.y);
    let level = vec2<f32>(seen.x, (ray.aim.w * seen.y) + ray.aim.z) / max(fall, 1e-6);
    let steps = vec2<f32>((ray.aim.y * level.x) + (ray.aim.x * level.y), (ray.aim.y * level.y) - (ray.aim.x * level.x));
    // The camera is an altitude above the unit sphere: the nearer point of the ray on it.
    let altitude = ray.sphere.z;
    let power = altitude * (2.0 + altitude);
    let miss = dot(steps, steps) * power; // above 1 beside the globe
    let along = power / ((1.0 + altitude) + sqrt(max(1.0 - miss, 0.0)));
    let east = along * steps.x;
    let north = along * steps.y;
    let up = sqrt(max(1.0 - (dot(steps, steps) * along * along), 0.0));
    // Longitude and latitude from those below the camera, with no difference of large numbers that are nearly the same.
    let sine = ray.sphere.x;
    let cosine = ray.sphere.y;
    let meridian = (up * cosine) - (north * sine);
    let parallel = sqrt((east * east) + (meridian * meridian));
    let bulge = select(parallel - meridian, (east * east) / max(parallel + meridian, 1e-30), meridian > 0.0);
    let sine_north = north - (sine * bulge);
    let cosine_north = (((north * cosine) + (up * sine)) * sine) + (parallel * cosine);
    let turns = vec2<f32>(fixed_angle(east, meridian), -fixed_angle(sine_north, cosine_north));
    return Ground(fraction + (turns * ray.fraction_and_scale.zw), miss <= 1.0 && fall > 0.0);
}

// A difference of offsets, on the globe the shorter way round.
fn fixed_shorter(ray: Seen_fixed, difference: vec2<f32>) -> vec2<f32> {
    let round_it = ray.fraction_and_scale.z * 6.2831853;
    let shorter = difference.x - (round_it * round(difference.x / round_it));
    return vec2<f32>(select(difference.x, shorter, FIXED_GLOBE), difference.y);
}

fn look_fixed(ray: Seen_fixed) -> Look {
    let steps = vec4<f32>(dpdx(ray.seen), dpdy(ray.seen));
    let ground = fixed_ground(ray, ray.seen);
    let ddx = fixed_shorter(ray, dpdx(ground.offset));
    let ddy = fixed_shorter(ray, dpdy(ground.offset));
    return Look(ray.anchor, ground.offset, ddx, ddy, steps, ground.is_met);
}

fn wanted_fixed(ray: Seen_fixed, look: Look) -> vec4<u32> {
    // Differences between pixels of feedback are too far apart where the ground curves away.
    let share = 0.125;
    let ddx = fixed_shorter(ray, fixed_ground(ray, ray.seen + (look.steps.xy * share)).offset - look.offset) / share;
    let ddy = fixed_shorter(ray, fixed_ground(ray, ray.seen + (look.steps.zw * share)).offset - look.offset) / share;
    return asked_fixed(Look(look.anchor, look.offset, ddx, ddy, look.steps, look.is_met), ray.clip);
}

fn light_fixed(look: Look) -> f32 {
    return 1.0;
}

// What is looked at where sampling a texture of an id is to find it.
fn fixed_place(look: Look, id: u32) -> Look {
    return look_from_near(look, vastex_size(id));
}

@fragment
fn want_fixed(ray: Seen_fixed) -> @location(0) vec4<u32> {
    let look = look_fixed(ray);
    return select(vec4<u32>(0u), wanted_fixed(ray, look), look.is_met); // as the target is cleared
}
