// Feedback: the page that a pixel wants at mip bias 0, and how far it is into that level.
// CPU twin: twins/feedback.rs.
//
// A pixel of the target is (page id low, page id high, eighth, flag), the id packed as vastex_core::PageId packs it.

// At a position, with gradients in texels of level 0 along one pixel of the target.
fn vastexi_feedback(
    texture: VastexiTexture,
    view: u32,
    position: VastexiPosition,
    dx: vec2<f32>,
    dy: vec2<f32>,
    most_taps: u32,
    powers: bool,
) -> vec4<u32> {
    let ordinary = vastexi_degenerate_lambda(dx, dy) == 0.0;
    let flag = select(VASTEX_FEEDBACK_DEGENERATE, VASTEX_FEEDBACK_WANTED, ordinary);
    let lambda = vastexi_footprint(dx, dy, most_taps).lambda + vastexi_views[view].level_offset;
    return vastexi_feedback_lambda(texture, position, lambda, flag, powers);
}

fn vastexi_feedback_lambda(
    texture: VastexiTexture,
    position: VastexiPosition,
    lambda: f32,
    flag: u32,
    powers: bool,
) -> vec4<u32> {
    if !texture.is_known {
        return vec4<u32>(0u, 0u, 0u, VASTEX_FEEDBACK_EMPTY);
    }
    let steps = u32(floor(vastexi_unbiased_level(texture, lambda) * f32(VASTEX_STEPS_PER_LEVEL)));
    let level = min(steps / VASTEX_STEPS_PER_LEVEL, texture.tail_level);
    let eighth = min(steps - (level * VASTEX_STEPS_PER_LEVEL), VASTEX_STEPS_PER_LEVEL - 1u);
    var page = vec2<u32>(0u);
    if level < texture.tail_level {
        page = vastexi_page(vastexi_level(texture, level, powers).sides, position.texel, powers);
    }
    return vec4<u32>(vastexi_page_id(texture.number, page, level), eighth, flag);
}
