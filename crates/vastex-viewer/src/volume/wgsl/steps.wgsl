// Where along a ray of volume.wgsl, which stands before this, samples lie.

// Where in its part of a ray a sample lies: 0 to 1.
fn volume_within() -> f32 {
    return select(0.5, volume_jitter, VOLUME_JITTERS);
}

// What a pixel adds to where samples lie: as good as chance, 0 to 1.
fn volume_noise(pixel: vec2<f32>) -> f32 {
    var word = (u32(pixel.x) * 0x9e3779b1u) + (u32(pixel.y) * 0x85ebca6bu);
    word = (word ^ (word >> 16u)) * 0x7feb352du;
    word = (word ^ (word >> 15u)) * 0x846ca68bu;
    return f32((word ^ (word >> 16u)) >> 8u) / 16777216.0;
}

// How far samples of a level are apart [world]. A ray whose way through the box is shorter than half of that has one sample, in the middle; where
// samples jitter one that is shorter than all of it, anywhere.
fn volume_step(ray: VolumeRay, id: u32, level: u32) -> f32 {
    let voxels = abs(ray.direction) / vastex_volume_scale(id, level);
    let step = volume_scene.step / max(max(voxels.x, voxels.y), voxels.z);
    let length = ray.end - ray.begin;
    let shortest = select(0.5, 1.0, VOLUME_JITTERS);
    return select(step, length, shortest * step >= length);
}

// Where samples of a ray lie: the `nth` of those that are `step` apart after `base`, in the middle of its part if nothing jitters.
struct VolumeSteps {
    base: f32,
    nth: u32,
    level: u32,
    step: f32,
}

fn volume_front(steps: VolumeSteps) -> f32 {
    return steps.base + f32(steps.nth) * steps.step;
}

fn volume_middle(steps: VolumeSteps) -> f32 {
    return steps.base + (f32(steps.nth) + volume_within()) * steps.step;
}

// Where samples in a brick end. In perspective the level is chosen anew after some of them, however large the brick is.
fn volume_exit(ray: VolumeRay, brick: VastexBrick, middle: f32, step: f32) -> f32 {
    let exit = min(ray.end, middle + vastex_brick_exit(brick, volume_at(ray, middle), ray.direction));
    return select(exit, min(exit, middle + f32(VOLUME_STRETCH) * step), volume_scene.pixel_growth > 0.0);
}

// How many samples of a ray lie before `exit`, the next one in any case.
fn volume_samples_to(steps: VolumeSteps, exit: f32) -> u32 {
    return u32(max(ceil((exit - steps.base) / steps.step - volume_within()) - f32(steps.nth), 1.0));
}

// Where samples go on at the level that is wanted there.
fn volume_steps_on(before: VolumeSteps, ray: VolumeRay, id: u32, level: u32) -> VolumeSteps {
    if level == before.level {
        return before;
    }
    return VolumeSteps(volume_front(before), 0u, level, volume_step(ray, id, level));
}
