// A planet under its sun: ground, sea, what shines on it at night, clouds with their shadows, and the air in front of and beside it.
// The scene is told by planet.rs. Nothing branches on what it is told, so that no driver compiles a shader anew where that changes.
//
// The air is exponential in height. How much of it a ray goes through has a closed form (the Chapman function, nearly); the light that is
// scattered on the way is taken to be that of the densest place on it. So a pixel takes a few exponentials, and no loop.

// What is seen of the planet in a pixel.
struct PlanetSite {
    up: vec3<f32>,
    normal: vec3<f32>,     // of the ground
    ray: vec3<f32>,        // from the camera
    height_of_sun: f32,    // its sine
    sea: f32,              // 1 where there is a sea
    coast: f32,            // and not much above it
    clouds: vec2<f32>,     // the step in uv to the cloud that is before the place
    shadow: vec2<f32>,     // and to the one that is between it and the sun
}

// What the air does to light on a ray.
struct PlanetAir {
    kept: vec3<f32>,       // the share that comes through
    scattered: vec3<f32>,  // the light that comes from the air itself
}

// Of the air straight up from the ground: how much light is scattered by the gas and by haze. Colours are red, green and blue.
const PLANET_GAS: vec3<f32> = vec3<f32>(0.023, 0.057, 0.140);
const PLANET_HAZE: vec3<f32> = vec3<f32>(0.011, 0.011, 0.011);
// The height in radii over which the air becomes thinner by a factor of e: five times the Earth's, so that it is seen.
const PLANET_SCALE_HEIGHT: f32 = 0.0062;
// How high clouds are, in radii.
const PLANET_CLOUD_HEIGHT: f32 = 0.0022;
// The light of the sun on ground that it shines straight down on, and of a clear sky and of the stars.
const PLANET_SUNLIGHT: f32 = 1.85;
const PLANET_SKYLIGHT: vec3<f32> = vec3<f32>(0.05, 0.085, 0.15);
const PLANET_STARLIGHT: vec3<f32> = vec3<f32>(0.009, 0.0125, 0.022);
// Maps have paler colours than a planet. What is taken from those of land, which the air makes bluer again, and from green ones.
const PLANET_LAND: vec3<f32> = vec3<f32>(1.04, 0.98, 0.82);
const PLANET_LEAVES: vec3<f32> = vec3<f32>(0.86, 0.68, 0.36);
// How much light water gives back, in the deep.
const PLANET_WATER: vec3<f32> = vec3<f32>(0.011, 0.04, 0.095);
// The colour of lights that are told as one channel.
const PLANET_LAMPS: vec3<f32> = vec3<f32>(1.0, 0.72, 0.38);
// Red of a surface in moonlight, as a share of its blue less its red.
const PLANET_MOONLIGHT: f32 = 0.08;
// What the background is far from the planet.
const PLANET_SPACE: vec3<f32> = vec3<f32>(0.0006, 0.0008, 0.0014);
// From where on light is compressed rather than clipped.
const PLANET_KNEE: f32 = 0.72;

// The ray from the camera through a place of the picture.
fn planet_ray(at: vec2<f32>) -> vec3<f32> {
    // Panes beside each other show the same.
    let pane = (at + scene.origin) / scene.picture;
    let view = vec2<f32>(fract(pane.x), pane.y) * 2.0 - 1.0;
    let planet = scene.planet;
    return normalize((planet.ahead + (planet.across * view.x)) - (planet.upward * view.y));
}

// How much air there is on a ray out of it, by that straight up from its start; the sine of its height is not negative.
fn planet_chapman(radius: f32, sine: f32) -> f32 {
    let level = sqrt(1.5707963 * radius / PLANET_SCALE_HEIGHT);
    return level / (((level - 1.0) * sine) + 1.0);
}

// The share of the sun's light that comes through the air to a place, which is so dense there.
fn planet_sunlight(sine: f32, density: f32) -> vec3<f32> {
    let x = 1.0 / PLANET_SCALE_HEIGHT;
    let outward = planet_chapman(1.0, abs(sine));
    // Below the horizon the ray dips into denser air first.
    let cosine = sqrt(max(1.0 - (sine * sine), 0.0));
    let through = (2.0 * sqrt(1.5707963 * x * cosine) * exp(min(x * (1.0 - cosine), 12.0))) - outward;
    let air = select(through, outward, sine >= 0.0) * density * scene.planet.density;
    // Much of what is scattered out of the ray arrives all the same.
    return exp(-(PLANET_GAS + PLANET_HAZE) * (0.8 * air));
}

// What the air on a ray does, of which there is so much, where its densest place is so dense and the sun so high there.
fn planet_air(ray: vec3<f32>, air: f32, height_of_sun: f32, density: f32) -> PlanetAir {
    let kept = exp(-(PLANET_GAS + PLANET_HAZE) * (air * scene.planet.density));
    let towards_sun = dot(ray, scene.planet.sun);
    let of_gas = 0.75 * (1.0 + (towards_sun * towards_sun));
    // Haze scatters forward.
    let of_haze = 0.75 / pow(max(1.25 - towards_sun, 0.1), 1.5);
    let colour = ((PLANET_GAS * of_gas) + (PLANET_HAZE * of_haze)) / (PLANET_GAS + PLANET_HAZE);
    let sunlight = planet_sunlight(height_of_sun, 0.45 * density) * smoothstep(-0.3, 0.02, height_of_sun);
    let scattered = colour * sunlight * (1.0 - kept) * (0.34 * PLANET_SUNLIGHT);
    return PlanetAir(kept, scattered * scene.planet.lit);
}

// The air between the camera and a place on the ground.
fn planet_air_before(site: PlanetSite) -> PlanetAir {
    let eye = scene.planet.eye;
    let radius = length(eye);
    let from_ground = planet_chapman(1.0, max(-dot(site.ray, site.up), 0.0));
    let from_eye = exp(-(radius - 1.0) / PLANET_SCALE_HEIGHT) * planet_chapman(radius, max(-dot(site.ray, eye) / radius, 0.0));
    return planet_air(site.ray, max(from_ground - from_eye, 0.0), site.height_of_sun, 1.0);
}

// The air on a ray that meets no ground.
fn planet_air_beside(ray: vec3<f32>) -> PlanetAir {
    let eye = scene.planet.eye;
    let radius = length(eye);
    let sine = dot(ray, eye) / radius;
    let at_eye = exp(-(radius - 1.0) / PLANET_SCALE_HEIGHT);
    let outward = at_eye * planet_chapman(radius, abs(sine));
    // Where it is nearest to the planet.
    let nearest = eye - (ray * dot(ray, eye));
    let closest = max(length(nearest), 1e-3);
    let density = exp(-max(closest - 1.0, 0.0) / PLANET_SCALE_HEIGHT);
    let through = (2.0 * sqrt(1.5707963 * closest / PLANET_SCALE_HEIGHT) * density) - outward;
    let is_upward = sine >= 0.0;
    let densest = select(nearest / closest, eye / radius, is_upward);
    let air = select(through, outward, is_upward);
    return planet_air(ray, max(air, 0.0), dot(densest, scene.planet.sun), select(density, at_eye, is_upward));
}

// Light as it is shown: what is lighter than can be shown is compressed.
fn planet_shown(light: vec3<f32>) -> vec3<f32> {
    let over = max(light - PLANET_KNEE, vec3<f32>(0.0)) / (1.0 - PLANET_KNEE);
    let compressed = PLANET_KNEE + ((1.0 - PLANET_KNEE) * (1.0 - exp(-over)));
    let is_over = light > vec3<f32>(PLANET_KNEE);
    return mix(light, select(light, compressed, is_over), scene.planet.lit);
}

// A number from 0 to 1 for whole numbers.
fn planet_hash(at: vec3<u32>) -> f32 {
    var n = (at.x * 0x9e3779b1u) ^ (at.y * 0x85ebca6bu) ^ (at.z * 0xc2b2ae35u);
    n = (n ^ (n >> 15u)) * 0x2c1b3c6du;
    n = (n ^ (n >> 12u)) * 0x297a2d39u;
    return f32((n ^ (n >> 15u)) >> 8u) / 16777216.0;
}

// Stars: in some cells of a cube around the camera one, as large as a pixel at least.
fn planet_stars(ray: vec3<f32>) -> vec3<f32> {
    let size = abs(ray);
    let is_x = size.x >= max(size.y, size.z);
    let is_y = !is_x && size.y >= size.z;
    let face = select(select(ray.xyz, ray.zxy, is_y), ray.yzx, is_x);
    let cells = 50.0;
    let at = (face.xy / abs(face.z)) * cells;
    let cell = floor(at);
    let side = select(0u, 1u, face.z > 0.0) + select(select(4u, 2u, is_y), 0u, is_x);
    let key = vec3<u32>(vec2<u32>(vec2<i32>(cell) + 1024), side);
    let bright = planet_hash(key);
    let place = vec2<f32>(planet_hash(key + vec3<u32>(0u, 0u, 8u)), planet_hash(key + vec3<u32>(0u, 0u, 16u)));
    let apart = length((at - cell) - (0.15 + (0.7 * place))) / cells;
    let reach = 0.8 * max(scene.planet.pixel, 0.0006);
    // As bright in a small picture, of which a pixel covers more of the sky, as in a large one.
    let share = min(0.0014 / reach, 1.0);
    let power = pow(max(bright - 0.8, 0.0) / 0.2, 7.0) * (share * share);
    let tint = mix(vec3<f32>(1.0, 0.82, 0.66), vec3<f32>(0.72, 0.83, 1.0), place.x);
    return tint * power * 0.9 * exp(-(apart * apart) / (reach * reach));
}

// What is seen beside the planet.
fn planet_sky_light(ray: vec3<f32>) -> vec3<f32> {
    let air = planet_air_beside(ray);
    return planet_shown(((PLANET_SPACE + planet_stars(ray)) * air.kept) + air.scattered);
}

@vertex
fn planet_fill(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2<f32>(f32(index % 2u), f32(index / 2u)) * 4.0 - 1.0;
    return vec4<f32>(corner, 0.0, 1.0);
}

// The picture behind the planet. Alpha 0 says "not covered".
@fragment
fn planet_sky(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    return scene_stored(vec4<f32>(planet_sky_light(planet_ray(at.xy)), 0.0));
}

// The step in uv from a place towards a direction by which something so high is seen.
fn planet_step(up: vec3<f32>, towards: vec3<f32>) -> vec2<f32> {
    let rise = max(dot(up, towards), 0.12);
    let along = (towards - (up * dot(up, towards))) * (PLANET_CLOUD_HEIGHT / rise);
    let parallel = max(length(up.xy), 0.02);
    let east = ((up.x * along.y) - (up.y * along.x)) / parallel;
    let north = along.z / max(length(up.xy), 0.2);
    return vec2<f32>(east / (6.2831853 * parallel), -north / 3.1415927);
}

fn planet_site(uv: vec2<f32>, slope: vec3<f32>, at: vec2<f32>) -> PlanetSite {
    let up = relief_up(uv);
    let ray = planet_ray(at);
    let east = vec3<f32>(-up.y, up.x, 0.0) / max(length(up.xy), 1e-4);
    let north = cross(up, east);
    let normal = normalize(up - ((east * slope.x) + (north * slope.y)));
    let height_of_sun = dot(up, scene.planet.sun);
    // By how much the ground is above the sea, in heights of a beach.
    let above = (slope.z - scene.relief[scene_zero].zero) * scene.planet.sea;
    let sea = clamp(vec2<f32>(1.0 - above, 1.5 - (0.05 * above)), vec2<f32>(0.0), vec2<f32>(min(scene.planet.sea, 1.0)));
    return PlanetSite(up, normal, ray, height_of_sun, sea.x, sea.y, planet_step(up, -ray), planet_step(up, scene.planet.sun));
}

// The light of lamps on the ground. Pictures of the night have land, ice and sea in moonlight as well, which is blue, and is taken out: what is
// more blue than red is none of lamps. What has no colour is in that of lamps.
fn planet_lights(value: vec4<f32>, n: u32) -> vec3<f32> {
    let light = layered_over(vec3<f32>(0.0), value, n, 1.0);
    let is_grey = (layered[n].look & 3u) <= SCENE_GREY_ALPHA;
    let most = max(light.r, max(light.g, light.b));
    let least = min(light.r, min(light.g, light.b));
    let coloured = select(smoothstep(0.15, 0.5, (most - least) / max(most, 1e-4)), 0.0, is_grey);
    let lamps = light * mix(PLANET_LAMPS, vec3<f32>(1.0), coloured);
    // Of what is bluer, red tells how much is of lamps.
    let bluer = select(max(light.b - light.r, 0.0), 0.0, is_grey);
    let beside_moonlight = PLANET_LAMPS * max(light.r - (PLANET_MOONLIGHT * bluer), 0.0);
    return mix(lamps, beside_moonlight, smoothstep(0.0, 0.1, bluer / max(light.b, 1e-4)));
}

// How much of the ground clouds hide: how light they are, and by their alpha.
fn planet_coverage(value: vec4<f32>, n: u32) -> f32 {
    let colour = layered_color(value, n);
    let shown = select(display_from_light(colour.rgb), colour.rgb, (layered[n].look & LAYERED_DISPLAY) != 0u);
    return clamp(dot(shown, vec3<f32>(0.2126, 0.7152, 0.0722)), 0.0, 1.0) * colour.a * layered[n].opacity;
}

// The light that is seen of a place.
fn planet_seen(site: PlanetSite, ground: vec3<f32>, lights: vec3<f32>, clouds: f32, shadow: f32) -> vec3<f32> {
    let planet = scene.planet;
    let sunlight = planet_sunlight(site.height_of_sun, 1.0) * PLANET_SUNLIGHT;
    let day = smoothstep(-0.03, 0.05, site.height_of_sun);
    let skylight = (PLANET_SKYLIGHT * (smoothstep(-0.2, 0.5, site.height_of_sun) * planet.density)) + PLANET_STARLIGHT;
    let facing = max(dot(site.normal, planet.sun), 0.0) * day;
    // Maps have pale seas; water is dark.
    let lightness = dot(ground, vec3<f32>(0.2126, 0.7152, 0.0722));
    let leaves = clamp((1.6 * (ground.g - ground.r)) / max(ground.g, 1e-3), 0.0, 1.0);
    let vivid = max(mix(vec3<f32>(lightness), ground, 1.25), vec3<f32>(0.0)) * mix(PLANET_LAND, PLANET_LEAVES, leaves);
    // What is blue beside a sea is water.
    let blue = smoothstep(0.0, 0.025, ground.b - max(ground.r, ground.g)) * site.coast;
    let water = max(blue, site.sea * smoothstep(-0.06, -0.01, ground.b - ground.r));
    let albedo = mix(vivid, PLANET_WATER * (0.35 + (1.3 * lightness)), water);
    let below = albedo * ((sunlight * (facing * (1.0 - (0.6 * shadow)))) + skylight);
    // The sun in the sea, which is rough.
    let halfway = normalize(planet.sun - site.ray);
    let grazing = 1.0 - clamp(-dot(site.ray, site.up), 0.0, 1.0);
    let mirrored = 0.02 + (0.5 * pow(grazing, 5.0));
    let towards = max(dot(site.up, halfway), 0.0);
    let glint = ((2.5 * pow(towards, 36.0)) + (9.0 * pow(towards, 260.0))) * (mirrored * water * day);
    let lamps = lights * (1.6 * planet.night * (1.0 - smoothstep(-0.1, 0.06, site.height_of_sun)));
    // Clouds stand out of the shadow of the planet a little longer.
    let over_clouds = smoothstep(-0.06, 0.1, site.height_of_sun) * (0.2 + (0.8 * max(site.height_of_sun, 0.0)));
    let of_clouds = (planet_sunlight(site.height_of_sun, 0.7) * (PLANET_SUNLIGHT * 0.82 * over_clouds)) + (skylight * 0.9);
    let surface = mix(below + (sunlight * glint), of_clouds, clouds) + (lamps * (1.0 - (0.75 * clouds)));
    // Without a sun all is as light as it can be.
    let even = mix(ground, vec3<f32>(1.0), clouds);
    let air = planet_air_before(site);
    let seen = (mix(even, surface, planet.lit) * air.kept) + air.scattered;
    return planet_limb(site, planet_shown(seen));
}

// The edge of the planet, which is as smooth as a pixel allows.
fn planet_limb(site: PlanetSite, light: vec3<f32>) -> vec3<f32> {
    let eye = scene.planet.eye;
    let beside = length(eye - (site.ray * dot(site.ray, eye)));
    let inside = (1.0 - beside) / (max(-dot(site.ray, eye), 1e-6) * scene.planet.pixel);
    // Ground that rises above the sphere has another edge.
    let level = sqrt(max(1.0 - (beside * beside), 0.0));
    let is_level = 1.0 - smoothstep(0.01, 0.03, abs(level + dot(site.ray, site.up)));
    let share = 1.0 - ((1.0 - clamp(inside, 0.0, 1.0)) * is_level);
    let air = planet_air_beside(site.ray);
    let sky = planet_shown((PLANET_SPACE * air.kept) + air.scattered);
    return mix(sky, light, select(share, 1.0, beside > 1.0));
}
