// Samples at points from a buffer, for values of 16 bits that are exact.

struct Input { anchor: vec2<u32>, offset: vec2<f32>, level: f32, unused: f32 }
@group(1) @binding(0) var<storage, read> inputs: array<Input>;
@group(1) @binding(1) var<storage, read_write> outputs: array<vec4<f32>>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&inputs) {
        let in = inputs[id.x];
        outputs[id.x] = vastex_sample_fixed_level(ID, in.anchor, in.offset, in.level);
    }
}
