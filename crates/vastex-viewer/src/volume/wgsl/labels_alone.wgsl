// What volume.wgsl calls of Vastex, where there are labels alone: no channel is shown, so nothing is sampled.

// Whether any channel is shown.
const VOLUME_HAS_IMAGE: bool = false;

fn vastex_brick(id: u32, anchor: vec3<u32>, offset: vec3<f32>, level: f32) -> VastexBrick {
    return vastex_brick_label(id, anchor, offset, level);
}

fn vastex_volume_whole_level(id: u32, level: f32) -> u32 {
    return vastex_volume_whole_level_label(id, level);
}

fn vastex_brick_sample(brick: VastexBrick, offset: vec3<f32>) -> vec4<f32> {
    return vec4<f32>(0.0);
}

fn vastex_brick_exact(brick: VastexBrick, offset: vec3<f32>) -> vec4<f32> {
    return vec4<f32>(0.0);
}

fn vastex_brick_range(brick: VastexBrick) -> vec2<f32> {
    return vec2<f32>(0.0);
}
