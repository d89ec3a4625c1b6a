// Feedback from the main pass: the pixel of each cell that is asked in this frame leaves a report of what it wants.
// inline.wgsl finds the nearest.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_CELLS) var<storage, read_write> vastexi_cells: array<VastexiCell>;

// Whether a pixel is asked in this frame. `position` is @builtin(position).
fn vastex_asked(view: u32, position: vec4<f32>) -> bool {
    let pixel = vec2<u32>(position.xy);
    let cell = pixel / VASTEX_FEEDBACK_SCALE;
    return all(pixel % VASTEX_FEEDBACK_SCALE == vastexi_views[view].jitter)
        && cell.x < vastexi_views[view].columns
        && cell.y < vastexi_views[view].rows;
}

// Reports what a pixel wants, if it is asked: what vastex_feedback or one of its kin gives.
fn vastex_report(view: u32, position: vec4<f32>, wanted: vec4<u32>) {
    let at = vec2<u32>(position.xy) / VASTEX_FEEDBACK_SCALE;
    let cell = vastexi_views[view].first_cell + (at.y * vastexi_views[view].columns) + at.x;
    if !vastex_asked(view, position) || wanted.w == VASTEX_FEEDBACK_EMPTY || cell >= arrayLength(&vastexi_cells) {
        return;
    }
    let place = atomicAdd(&vastexi_cells[cell].count, 1u);
    if place < VASTEXI_RECORDS {
        let depth = bitcast<u32>(clamp(position.z, 0.0, 1.0));
        let nearness = select(~depth, depth, vastexi_views[view].reversed_depth != 0u);
        let eighth_and_flag = (wanted.z << VASTEXI_FLAG_BITS) | wanted.w;
        vastexi_cells[cell].reports[place] = VastexiReport(wanted.x, wanted.y, eighth_and_flag, nearness);
    }
}
