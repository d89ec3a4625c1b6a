// Feedback from the main pass: the pixel of each cell that is asked in this frame leaves a record of what it wants.
// inline.wgsl finds the nearest.

@group(VASTEX_GROUP) @binding(VASTEX_BINDING_CELLS) var<storage, read_write> vastex_cells: array<VastexCell>;

// Whether a pixel is asked in this frame. `position` is @builtin(position).
fn vastex_asked(position: vec4<f32>) -> bool {
    let pixel = vec2<u32>(position.xy);
    return all(pixel % VASTEX_FEEDBACK_SCALE == vastex_view.jitter)
        && pixel.x / VASTEX_FEEDBACK_SCALE < vastex_view.columns;
}

// Tells what a pixel wants, if it is asked: what vastex_feedback or one of its kin gives.
fn vastex_tell(position: vec4<f32>, wanted: vec4<u32>) {
    let at = vec2<u32>(position.xy) / VASTEX_FEEDBACK_SCALE;
    let cell = at.y * vastex_view.columns + at.x;
    if !vastex_asked(position) || wanted.w == VASTEX_FEEDBACK_EMPTY || cell >= arrayLength(&vastex_cells) {
        return;
    }
    let place = atomicAdd(&vastex_cells[cell].count, 1u);
    if place < VASTEX_RECORDS {
        let depth = bitcast<u32>(clamp(position.z, 0.0, 1.0));
        let nearness = select(~depth, depth, vastex_view.reversed_depth != 0u);
        let eighth_and_flag = (wanted.z << VASTEX_FLAG_BITS) | wanted.w;
        vastex_cells[cell].told[place] = VastexTold(wanted.x, wanted.y, eighth_and_flag, nearness);
    }
}
