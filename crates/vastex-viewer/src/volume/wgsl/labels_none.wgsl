// In the place of labels.wgsl where a volume has no labels.

// Whether any channel is shown.
const VOLUME_HAS_IMAGE: bool = true;

fn volume_with_labels(ray: VolumeRay, light: vec3<f32>) -> vec3<f32> {
    return light;
}

fn volume_label_met(ray: VolumeRay) -> VolumeRay {
    return ray;
}

fn volume_label_bricks(ray: VolumeRay, own: VolumeRay) -> u32 {
    return 0u;
}

fn volume_label_wanted(ray: VolumeRay, own: VolumeRay, nth: u32) -> vec4<u32> {
    return vec4<u32>(0u, 0u, 0u, VASTEX_FEEDBACK_EMPTY);
}

fn volume_label_gap(ray: VolumeRay, over: u32) -> vec4<u32> {
    return vec4<u32>(0u, 0u, 0u, VASTEX_FEEDBACK_EMPTY);
}
