// Samples at points from a buffer by an explicit level.

struct Input { uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>, level: f32, at_level: u32 }
struct Output { color: vec4<f32>, feedback: vec4<u32> }
@group(1) @binding(0) var<storage, read> inputs: array<Input>;
@group(1) @binding(1) var<storage, read_write> outputs: array<Output>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&inputs) { return; }
    let in = inputs[id.x];
    if in.at_level == 1u {
        outputs[id.x] = Output(vastex_sample_level(ID, in.uv, in.level), vastex_feedback_level(ID, 0u, in.uv, in.level));
    } else {
        outputs[id.x] = Output(
            vastex_sample_grad(ID, in.uv, in.ddx, in.ddy), vastex_feedback_grad(ID, 0u, in.uv, in.ddx, in.ddy));
    }
}
