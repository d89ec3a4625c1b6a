// Folds fixed-point positions by the address modes, for every case of a buffer.

const MODES = array<u32, 4>(
    0xffffffffu, VASTEXI_ADDRESS_WRAP, VASTEXI_ADDRESS_MIRROR, VASTEXI_ADDRESS_BORDER);
struct Fold { anchor: u32, offset: f32, size: u32, mode: u32 }
struct Folded { texel: u32, fraction: f32, direction: f32, unused: u32 }
@group(1) @binding(0) var<storage, read> inputs: array<Fold>;
@group(1) @binding(1) var<storage, read_write> outputs: array<Folded>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&inputs) { return; }
    let in = inputs[id.x];
    var modes = MODES;
    let at = vastexi_folded_texel(in.anchor, in.offset, in.size, modes[in.mode]);
    outputs[id.x] = Folded(at.texel, at.fraction, at.direction, 0u);
}
