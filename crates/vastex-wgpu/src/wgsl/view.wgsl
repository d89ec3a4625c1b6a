// The view that is being drawn into a feedback target.

// Where a vertex of the picture lies in the feedback target: the picture is fitted to whole pixels of the target and
// shifted to this frame's jitter.
fn vastex_feedback_clip(clip: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(clip.xy * vastex_view.clip_scale + vastex_view.clip_offset * clip.w, clip.zw);
}

// Of several answers that a pixel of the target could give, which one it gives in this frame: 0 to `count` - 1. Neighbours
// give different ones, and each pixel gives every one from all positions of the jitter cycle within `count` cycles.
fn vastex_turn(position: vec4<f32>, count: u32) -> u32 {
    let cycle = vastex_view.frame / VASTEX_JITTER_CYCLE;
    return (u32(position.x) + u32(position.y) + vastex_view.frame % VASTEX_JITTER_CYCLE + cycle) % count;
}
