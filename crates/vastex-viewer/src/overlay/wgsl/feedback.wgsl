// Feedback as seen: each pixel of the target as a block, in a colour of its own for each page, the darker the sharper it
// is needed; magenta where gradients said nothing.

@group(2) @binding(0) var overlay_feedback: texture_2d<u32>;

fn overlay_page(id: vec2<u32>) -> vec3<f32> {
    var hash = (id.x ^ (id.y * 0x9e3779b1u)) * 0x85ebca6bu;
    hash = (hash ^ (hash >> 15u)) * 0xc2b2ae35u;
    hash = hash ^ (hash >> 13u);
    let channels = vec3<u32>(hash & 255u, (hash >> 8u) & 255u, (hash >> 16u) & 255u);
    return 0.25 + 0.7 * vec3<f32>(channels) / 255.0;
}

@fragment
fn shade_feedback(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    // It is of one pane, as wide as all of the picture.
    let wide = plan_at(at) * vec2<f32>(scene.panes, 1.0);
    let pixel = textureLoad(overlay_feedback, vec2<u32>(wide) / VASTEX_FEEDBACK_SCALE, 0);
    if pixel.w == VASTEX_FEEDBACK_DEGENERATE {
        return vec4<f32>(1.0, 0.0, 1.0, 1.0);
    }
    if pixel.w != VASTEX_FEEDBACK_WANTED {
        return vec4<f32>(PLAN_PAPER, 1.0);
    }
    let sharp = 0.6 + 0.4 * f32(pixel.z) / f32(VASTEX_STEPS_PER_LEVEL);
    return vec4<f32>(overlay_page(pixel.xy) * sharp, 1.0);
}
