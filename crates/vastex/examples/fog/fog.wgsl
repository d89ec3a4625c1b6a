// The application's own march through a volume: mist between the camera and what the scene has drawn.
// The text after this one is `Textures::wgsl`, which brings the functions and types of Vastex.

struct Fog {
    world_from_clip: mat4x4<f32>,
    eye: vec3<f32>,
    growth: f32,      // side of a pixel at a distance of 1
    low: vec3<f32>,   // the first corner of the volume in the world
    voxel: f32,       // side of a voxel of level 0
    anchor: vec3<u32>,
    volume: u32,      // which texture
    colour: vec3<f32>,
    density: f32,     // of the densest mist, per length of the world
    size: vec2<f32>,  // of the picture [pixels]
    view: u32,        // that asks for bricks
    unused: u32,
}

@group(0) @binding(0) var<uniform> fog: Fog;
@group(2) @binding(0) var depth: texture_depth_2d;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) at: vec2<f32>,
}

fn corner(index: u32) -> vec2<f32> {
    return vec2<f32>(f32(index % 2u), f32(index / 2u)) * 2.0 - 1.0;
}

// The ray of a place of the picture, as far as something stands at that depth.
fn ray_of(at: vec2<f32>, depth: f32) -> VastexRay {
    let far = fog.world_from_clip * vec4<f32>(at, depth, 1.0);
    let toward = far.xyz / far.w - fog.eye;
    let origin = (fog.eye - fog.low) / fog.voxel - vec3<f32>(fog.anchor);
    let growth = vec3<f32>(fog.growth / fog.voxel);
    let direction = normalize(toward) / fog.voxel;
    let ray = VastexRay(fog.anchor, origin, direction, 0.0, length(toward), vec3<f32>(0.0), growth);
    return vastex_ray_within(ray, vastex_volume_size(fog.volume));
}

@vertex
fn place(@builtin(vertex_index) index: u32) -> Corner {
    return Corner(vec4<f32>(corner(index), 0.0, 1.0), corner(index));
}

@fragment
fn shade(fragment: Corner) -> @location(0) vec4<f32> {
    let ray = ray_of(fragment.at, textureLoad(depth, vec2<u32>(fragment.clip.xy), 0));
    var through = 1.0;
    var march = vastex_march(ray);
    while through > 0.01 && vastex_march_next(&march, fog.volume, ray) {
        // One look-up for all samples of a brick; none where there is no mist in it.
        if vastex_brick_range(march.brick).y == 0.0 {
            continue;
        }
        let samples = max(ceil((march.end - march.begin) / (fog.voxel * exp2(f32(march.brick.wanted)))), 1.0);
        let step = (march.end - march.begin) / samples;
        for (var nth = 0.5; nth < samples; nth += 1.0) {
            let mist = vastex_brick_sample(march.brick, vastex_ray_at(ray, march.begin + nth * step)).x;
            through *= exp(-fog.density * mist * step);
        }
    }
    return vec4<f32>(fog.colour * (1.0 - through), 1.0 - through); // blended over the scene
}

@vertex
fn place_feedback(@builtin(vertex_index) index: u32) -> Corner {
    return Corner(vastex_feedback_clip(fog.view, vec4<f32>(corner(index), 0.0, 1.0)), corner(index));
}

@fragment
fn want(fragment: Corner) -> @location(0) vec4<u32> {
    // Several pixels of the target ask for bricks of one ray: that of the pixel of the picture that all of them look at.
    let flip = vec2<f32>(0.5, -0.5);
    let pixel = vastex_ray_pixel(fog.view, fragment.clip, (fragment.at * flip + 0.5) * fog.size);
    // The ground is below the mist, so the box itself ends the ray.
    let ray = ray_of((pixel / fog.size - 0.5) / flip, 1.0);
    if vastex_ray_seeks(fog.view) {
        return vastex_march_gap(fog.volume, fog.view, fragment.clip, ray);
    }
    return vastex_march_feedback(fog.volume, fog.view, fragment.clip, ray);
}
