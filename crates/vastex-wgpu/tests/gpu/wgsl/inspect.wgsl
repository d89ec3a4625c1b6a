// Says of points from a buffer what the shader sees of the page table there.

struct Input { uv: vec2<f32>, step: f32, unused: f32 }
struct Output { wanted: f32, level: f32, shown: u32, of_page: u32, page: vec2<u32>, page_texel: vec2<f32> }
@group(1) @binding(0) var<storage, read> inputs: array<Input>;
@group(1) @binding(1) var<storage, read_write> outputs: array<Output>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&inputs) { return; }
    let in = inputs[id.x];
    let step = in.step / vec2<f32>(vastex_size(ID));
    let found = vastex_inspect_grad(ID, in.uv, vec2<f32>(step.x, 0.0), vec2<f32>(0.0, step.y));
    outputs[id.x] = Output(found.wanted, found.level, found.shown, vastex_inspect_page(ID, found.page, found.shown),
        found.page, found.page_texel);
}
