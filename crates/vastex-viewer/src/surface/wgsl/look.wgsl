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
