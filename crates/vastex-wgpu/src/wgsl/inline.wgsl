// From what a main pass reported to the pixels of a feedback target: of each cell the nearest report, and of those as near the
// first. Where fragments run that fail the depth test, or in any order, hidden surfaces have reported something too.

@group(0) @binding(0) var<storage, read_write> cells: array<VastexiCell>;
@group(0) @binding(1) var raw: texture_storage_2d<rgba32uint, write>;

// Before the main pass. Reports beyond a cell's count nobody reads, so that they stay as they are.
@compute @workgroup_size(VASTEX_WORKGROUP)
fn forget(@builtin(global_invocation_id) invocation: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let cell = invocation.y * groups.x * VASTEX_WORKGROUP + invocation.x;
    if cell < arrayLength(&cells) {
        atomicStore(&cells[cell].count, 0u);
    }
}

// After it.
@compute @workgroup_size(VASTEX_WORKGROUP)
fn settle(@builtin(global_invocation_id) invocation: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let size = textureDimensions(raw);
    let cell = invocation.y * groups.x * VASTEX_WORKGROUP + invocation.x;
    if cell >= size.x * size.y {
        return;
    }
    var pixel = vec4<u32>(0u);
    var nearness = 0u;
    for (var place = 0u; place < min(atomicLoad(&cells[cell].count), VASTEXI_RECORDS); place++) {
        let report = cells[cell].reports[place];
        if place == 0u || report.nearness > nearness {
            let eighth = report.eighth_and_flag >> VASTEXI_FLAG_BITS;
            let flag = report.eighth_and_flag & ((1u << VASTEXI_FLAG_BITS) - 1u);
            pixel = vec4<u32>(report.page_low, report.page_high, eighth, flag);
            nearness = report.nearness;
        }
    }
    textureStore(raw, vec2<u32>(cell % size.x, cell / size.x), pixel);
}
