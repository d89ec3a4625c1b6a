// Feedback: the page that a pixel wants at mip bias 0, and how far it is into that level.
// CPU twin: twins/feedback.rs.
//
// A pixel of the target is (page id low, page id high, eighth, flag), the id packed as vastex_core::PageId packs it.

// What the fragment shader of the feedback pass returns. Fragment stage, uniform control flow.
fn vastex_feedback(uv: vec2<f32>) -> vec4<u32> {
    let texel = uv * vec2<f32>(vastex_texture.size.xy);
    return vastex_feedback_texel_grad(vastex_position_from_uv(uv), dpdx(texel), dpdy(texel));
}

// The same for a surface sampled with vastex_sample_wrapped. Fragment stage, uniform control flow.
fn vastex_feedback_wrapped(uv: vec2<f32>) -> vec4<u32> {
    let dx = vastex_texels_wrapped(dpdx(uv));
    return vastex_feedback_texel_grad(vastex_position_from_uv(uv), dx, vastex_texels_wrapped(dpdy(uv)));
}

// The same with gradients of uv along one pixel of the target.
fn vastex_feedback_grad(uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> vec4<u32> {
    let size = vec2<f32>(vastex_texture.size.xy);
    return vastex_feedback_texel_grad(vastex_position_from_uv(uv), ddx * size, ddy * size);
}

// The same for a surface sampled with vastex_sample_level; it is always wanted, even where it means one point.
fn vastex_feedback_level(uv: vec2<f32>, level: f32) -> vec4<u32> {
    return vastex_feedback_lambda(vastex_position_from_uv(uv), level, VASTEX_FEEDBACK_WANTED);
}

// The same at a position, with gradients in texels of level 0 along one pixel of the target.
fn vastex_feedback_texel_grad(position: VastexPosition, dx: vec2<f32>, dy: vec2<f32>) -> vec4<u32> {
    let ordinary = vastex_degenerate_lambda(dx, dy) == 0.0;
    let flag = select(VASTEX_FEEDBACK_DEGENERATE, VASTEX_FEEDBACK_WANTED, ordinary);
    return vastex_feedback_lambda(position, vastex_lambda(dx, dy) + vastex_view.level_offset, flag);
}

fn vastex_feedback_lambda(position: VastexPosition, lambda: f32, flag: u32) -> vec4<u32> {
    let steps = u32(floor(vastex_unbiased_level(lambda) * f32(VASTEX_STEPS_PER_LEVEL)));
    let level = min(steps / VASTEX_STEPS_PER_LEVEL, vastex_texture.tail_level);
    let eighth = min(steps - level * VASTEX_STEPS_PER_LEVEL, VASTEX_STEPS_PER_LEVEL - 1u);
    var page = vec2<u32>(0u);
    if level < vastex_texture.tail_level {
        page = vastex_page_from_texel(position.texel, level);
    }
    let id = vastex_page_id(page, level);
    return vec4<u32>(id, eighth, flag);
}

// The id of a page of the texture, low half first.
fn vastex_page_id(page: vec2<u32>, level: u32) -> vec2<u32> {
    return vastex_page_key(page, level) | vec2<u32>(0u, vastex_texture.number << (VASTEX_TEXTURE_SHIFT - 32u));
}
