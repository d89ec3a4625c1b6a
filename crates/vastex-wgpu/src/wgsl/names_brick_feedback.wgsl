// What an application's shaders say that they want of volumes.

// The level that a pixel wants that covers so many voxels of level 0 along each axis, at mip bias 0: the coarsest of which no voxel is larger
// than the pixel, and how near the next one is.
fn vastex_volume_level_NAME(id: u32, pixel: vec3<f32>) -> f32 {
    let volume = vastexi_volume(id);
    return min(max(vastexi_volume_lambda(volume, pixel) + volume.bias, volume.finest), volume.coarsest);
}

// The box of the brick that feedback names for a place and such a level.
fn vastex_volume_box_NAME(id: u32, anchor: vec3<u32>, offset: vec3<f32>, level: f32) -> VastexBox {
    let volume = vastexi_volume(id);
    let number = u32(floor(min(max(level, volume.finest), volume.coarsest)));
    if number >= volume.tail_level {
        return vastexi_box(volume, anchor, number, vec3<u32>(0u));
    }
    let shape = vastexi_volume_level(volume, number);
    let page = vastexi_brick_page(volume, shape, vastexi_volume_texel(volume, anchor, offset));
    return vastexi_box(volume, anchor, number, page);
}

// A feedback pixel for a place at such a level: what the fragment shader of a view's feedback pass returns. A ray that meets several bricks
// names some of them in each frame (vastex_march_feedback_NAME).
fn vastex_volume_feedback_NAME(id: u32, anchor: vec3<u32>, offset: vec3<f32>, level: f32) -> vec4<u32> {
    return vastexi_brick_feedback(vastexi_volume(id), anchor, offset, level);
}

// How far along a ray the brick ends that feedback names so far along it.
fn vastexi_march_end_NAME(id: u32, ray: VastexRay, along: f32) -> f32 {
    let within = min(along + vastexi_ray_beyond(ray, along), ray.end);
    let at = vastex_ray_at(ray, within);
    let box = vastex_volume_box_NAME(id, ray.anchor, at, vastex_volume_level_NAME(id, vastexi_ray_pixel(ray, along)));
    return vastexi_ray_onward(ray, along, within + vastex_box_exit(box, at, ray.direction));
}

// A feedback pixel for a ray: the brick that this pixel of the target asks for in this frame, of those that the ray meets from its beginning to
// its end; what lies behind something opaque is left out by an earlier end. The ray is that of vastex_ray_pixel. `position` is @builtin(position)
// in the feedback pass of a view that says how many bricks a ray meets. Costs a few reads for each of them, twice. Where gaps are looked for
// (vastex_ray_seeks) vastex_march_gap_NAME takes its place.
fn vastex_march_feedback_NAME(id: u32, view: u32, position: vec4<f32>, ray: VastexRay) -> vec4<u32> {
    var bricks = 0u;
    var along = ray.begin;
    while along < ray.end && bricks < VASTEX_RAY_BRICKS {
        along = vastexi_march_end_NAME(id, ray, along);
        bricks++;
    }
    let turn = vastex_ray_turn(view, position, bricks);
    if turn >= bricks {
        return vec4<u32>(0u, 0u, 0u, VASTEX_FEEDBACK_EMPTY);
    }
    along = ray.begin;
    for (var nth = 0u; nth < turn; nth++) {
        along = vastexi_march_end_NAME(id, ray, along);
    }
    let middle = 0.5 * (along + vastexi_march_end_NAME(id, ray, along));
    let level = vastex_volume_level_NAME(id, vastexi_ray_pixel(ray, along));
    return vastex_volume_feedback_NAME(id, ray.anchor, vastex_ray_at(ray, middle), level);
}
