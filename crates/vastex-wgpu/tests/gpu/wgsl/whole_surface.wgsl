// An application that calls all that there is, of one texture or of a member of a group.

@vertex fn vertex(@location(0) at: vec4<f32>) -> @builtin(position) vec4<f32> {
    return vastex_feedback_clip(1u, at) + vastex_sample_NAME_level(7u, at.xy, 1.0)
        + vastex_sample_NAME_nearest_level(7u, at.xy, 1.0);
}
@fragment fn main_pass(@builtin(position) at: vec4<f32>, @location(0) @interpolate(flat) id: u32) -> @location(0) vec4<f32> {
    if vastex_asked(2u, at) && vastex_dither(2u, at, 0.5) {
        vastex_report(2u, at, vastex_feedback_NAME_grad(id, 2u, at.xy, at.yx, at.zw));
    }
    let inspected = vastex_inspect_NAME(id, at.xy);
    let shown = vastex_inspect_NAME_page(id, inspected.page, inspected.shown);
    let size = vec2<f32>(vastex_size(id) + vastex_inspect_NAME_slot_size());
    let slot = vastex_inspect_NAME_slot(shown, at.xy) * vastex_level_of_NAME(id, at.xy, at.zw) * size.xyxy;
    return slot + vastex_sample_NAME(id, at.xy) + vastex_sample_NAME_wrapped(id, at.xy)
        + vastex_sample_NAME_nearest(id, at.xy) + vastex_sample_NAME_nearest_grad(id, at.xy, at.yx, at.zw)
        + vastex_sample_NAME_grad(id, at.xy, at.yx, at.zw) + vastex_sample_NAME_fixed(id, vec2<u32>(7u), at.xy)
        + vastex_sample_NAME_fixed_grad(id, vec2<u32>(7u), at.xy, at.yx, at.zw)
        + vastex_sample_NAME_fixed_level(id, vec2<u32>(7u), at.xy, 1.0);
}
@fragment fn feedback_pass(@builtin(position) at: vec4<f32>) -> @location(0) vec4<u32> {
    let along = vastex_gradients(at, at.yx) * vastex_pixel_scale(1u);
    let id = vastex_turn(1u, at, 3u);
    return vastex_feedback_NAME(id, 1u, at.xy) + vastex_feedback_NAME_wrapped(id, 1u, at.xy)
        + vastex_feedback_NAME_grad(id, 1u, at.xy, along[0], along[1])
        + vastex_feedback_NAME_level(id, 1u, at.xy, 1.0) + vastex_feedback_NAME_fixed(id, 1u, vec2<u32>(7u), at.xy)
        + vastex_feedback_NAME_fixed_grad(id, 1u, vec2<u32>(7u), at.xy, at.yx, at.zw)
        + vastex_feedback_NAME_fixed_level(id, 1u, vec2<u32>(7u), at.xy, 1.0);
}
@fragment fn texture_space(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    return vastex_texture_space_NAME(7u, at.xy, at, at.zw) + vastex_texture_space_NAME_front(7u, at.xy, at, at.zw)
        + vastex_texture_space_clip(at.xy);
}
