// What a pixel looks at, which every way of placing a surface says in the same words.
//
// There are two ways, `mesh` and `fixed`, each with a struct `Seen_WAY` that its vertex stage gives, and with `look_WAY`, `wanted_WAY` and
// `light_WAY`. What is shown has `shown_WAY` and `inspected_WAY` (layers). Entry points are written once, and `WAY` is replaced in them.

struct Look {
    anchor: vec2<u32>,  // in fixed point the texel that offsets are measured from
    offset: vec2<f32>,  // in fixed point texels of level 0 from the anchor; else uv
    ddx: vec2<f32>,     // of the offset, along one pixel to the right
    ddy: vec2<f32>,     // and downward
    steps: vec4<f32>,   // what changes evenly over the picture, along one pixel to the right and downward; see fixed.wgsl
    is_met: bool,       // whether a surface is there
}

// The same in fixed point, told from a texel near it where the anchor is far: sampling takes offsets of up to 2^30 texels.
fn look_from_near(look: Look, size: vec2<u32>) -> Look {
    let whole = floor(look.offset);
    if all(abs(whole) < vec2<f32>(536870912.0)) {
        return look;
    }
    let on = min(vec2<u32>(max(whole, vec2<f32>(0.0))), (size - 1u) - look.anchor);
    let back = min(vec2<u32>(max(-whole, vec2<f32>(0.0))), look.anchor);
    let rest = (look.offset - vec2<f32>(on)) + vec2<f32>(back);
    return Look((look.anchor + on) - back, rest, look.ddx, look.ddy, look.steps, look.is_met);
}
