// What an application's shaders see of volumes. No function takes derivatives, so all may be called anywhere.

// The brick of a place at a level, which counts from the finest and need not be whole: vastex_volume_level_NAME gives what a pixel wants.
// The pool's mip bias is added.
fn vastex_brick_NAME(id: u32, anchor: vec3<u32>, offset: vec3<f32>, level: f32) -> VastexBrick {
    return vastexi_brick_POOL(id, anchor, offset, level);
}

// The level that is looked up where such a level is wanted, the mip bias included; what is there may be coarser.
fn vastex_volume_whole_level_NAME(id: u32, level: f32) -> u32 {
    return vastexi_whole_level_POOL(vastexi_volume(id), level);
}

// A march along a ray before its first brick: vastex_march_next leads to that.
fn vastex_march_NAME(ray: VastexRay) -> VastexMarch {
    var march: VastexMarch;
    march.begin = ray.begin;
    march.end = ray.begin;
    return march;
}

// Goes on to the next brick of a ray, at the level that a pixel wants there. Returns false at the end of the ray.
fn vastex_march_next_NAME(march: ptr<function, VastexMarch>, id: u32, ray: VastexRay) -> bool {
    let along = (*march).end;
    if !(along < ray.end) {
        return false;
    }
    let within = min(along + vastexi_ray_beyond(ray, along), ray.end);
    let at = vastex_ray_at(ray, within);
    let level = vastex_volume_level_NAME(id, vastexi_ray_pixel(ray, along));
    let brick = vastexi_brick_POOL(id, ray.anchor, at, level);
    let exit = within + vastex_brick_exit(brick, at, ray.direction);
    *march = VastexMarch(brick, level, along, vastexi_ray_onward(ray, along, exit));
    return true;
}

// A feedback pixel for one of the bricks of a ray that are not there, in a pass that looks for gaps (vastex_ray_seeks): of a texture, be it by
// itself or a member of a group. The ray is that of vastex_ray_pixel. `position` is @builtin(position) in the feedback pass.
fn vastex_march_gap_NAME(id: u32, view: u32, position: vec4<f32>, ray: VastexRay) -> vec4<u32> {
    var found = vec4<u32>(0u, 0u, 0u, VASTEX_FEEDBACK_EMPTY);
    var left = vastex_ray_passes_over(view, position);
    var bricks = 0u;
    var along = ray.begin;
    while along < ray.end && bricks < VASTEX_RAY_BRICKS {
        let next = vastexi_march_end_NAME(id, ray, along);
        let at = vastex_ray_at(ray, 0.5 * (along + next));
        let level = vastex_volume_level_NAME(id, vastexi_ray_pixel(ray, along));
        if vastex_brick_lacks(vastex_brick_NAME(id, ray.anchor, at, level)) {
            found = vastex_volume_feedback_NAME(id, ray.anchor, at, level);
            if left == 0u {
                break;
            }
            left--;
        }
        along = next;
        bricks++;
    }
    return found;
}
