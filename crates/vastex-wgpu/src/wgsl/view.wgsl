// The views that are being drawn, into a feedback target or with inline feedback, by their numbers.

// Where a vertex of the picture lies in the feedback target: the picture is fitted to whole pixels of the target and
// shifted to this frame's jitter.
fn vastex_feedback_clip(view: u32, clip: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(clip.xy * vastexi_views[view].clip_scale + vastexi_views[view].clip_offset * clip.w, clip.zw);
}

// The gradients of uv, or of anything else that is interpolated over a triangle, along one pixel: first to the right, then
// downward. Differences between the pixels of a feedback target, 8 of the picture's apart, are those in the middle between
// them; these are those at the pixel, exactly on a flat triangle in perspective, and beside its edge too. `position` is
// @builtin(position). Fragment stage, uniform control flow.
fn vastex_gradients(position: vec4<f32>, uv: vec2<f32>) -> mat2x2<f32> {
    // Over the screen uv / w and 1 / w are linear, and position.w is 1 / w.
    let over_w = vec3<f32>(uv, 1.0) * position.w;
    let along_x = dpdx(over_w);
    let along_y = dpdy(over_w);
    return mat2x2<f32>((along_x.xy - uv * along_x.z) / position.w, (along_y.xy - uv * along_y.z) / position.w);
}

// Whether a surface of an opacity from 0 to 1 says what it wants at this pixel in this frame, or leaves that to what lies
// behind it: by chance, as often as it is opaque, but for something between 0 and 1 seldom enough and often enough that over
// a jitter cycle both are wanted. `position` is @builtin(position).
fn vastex_dither(view: u32, position: vec4<f32>, opacity: f32) -> bool {
    if opacity <= 0.0 || opacity >= 1.0 {
        return opacity >= 1.0;
    }
    // Surfaces behind one another draw lots of their own.
    let seed = vec4<u32>(vec2<u32>(position.xy), vastexi_views[view].frame, bitcast<u32>(position.z));
    var lot = (seed.x * 0x9e3779b1u) ^ (seed.y * 0x85ebca6bu) ^ (seed.z * 0xc2b2ae35u) ^ (seed.w * 0x27d4eb2fu);
    lot = (lot ^ (lot >> 15u)) * 0x2c1b3c6du;
    lot = (lot ^ (lot >> 12u)) * 0x297a2d39u;
    lot = lot ^ (lot >> 15u);
    return f32(lot >> 8u) < clamp(opacity, 0.125, 0.875) * f32(1u << 24u);
}

// Of several answers that a pixel of the target could give, which one it gives in this frame: 0 to `count` - 1. Neighbours
// give different ones, and each pixel gives every one from all positions of the jitter cycle within `count` cycles.
fn vastex_turn(view: u32, position: vec4<f32>, count: u32) -> u32 {
    let cycle = vastexi_views[view].frame / VASTEX_JITTER_CYCLE;
    let cell = vec2<u32>(position.xy) / vastexi_views[view].cell;
    return (cell.x + cell.y + vastexi_views[view].frame % VASTEX_JITTER_CYCLE + cycle) % count;
}

// Pixels of the picture along one of what is being drawn: more than 1 in a feedback target.
fn vastex_pixel_scale(view: u32) -> f32 {
    return exp2(-vastexi_views[view].level_offset);
}
