// What volume.wgsl calls of Vastex, where the text has labels beside the image: a member `image`, which stands for all channels, and a member
// `label`. What is asked for, and where, hangs on ids alone.

// Whether any channel is shown.
const VOLUME_HAS_IMAGE: bool = true;

fn vastex_brick(id: u32, anchor: vec3<u32>, offset: vec3<f32>, level: f32) -> VastexBrick {
    return vastex_brick_image(id, anchor, offset, level);
}

fn vastex_volume_whole_level(id: u32, level: f32) -> u32 {
    return vastex_volume_whole_level_image(id, level);
}

fn vastex_brick_sample(brick: VastexBrick, offset: vec3<f32>) -> vec4<f32> {
    return vastex_brick_sample_image(brick, offset);
}

fn vastex_brick_exact(brick: VastexBrick, offset: vec3<f32>) -> vec4<f32> {
    return vastex_brick_exact_image(brick, offset);
}

fn vastex_brick_range(brick: VastexBrick) -> vec2<f32> {
    return vastex_brick_range_image(brick);
}
