// A plane seen aslant: from magnified below to some levels up above.

@group(1) @binding(0) var<storage, read_write> pixels: array<vec4<f32>>;
@compute @workgroup_size(8, 8) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = vec2<f32>(320.0, 192.0);
    let at = vec2<f32>(id.xy) / size;
    let depth = 1.0 / (0.06 + at.y);
    let uv = vec2<f32>(0.5 + (at.x - 0.5) * depth * 0.055, 0.05 + 0.055 * depth);
    let along = depth * 0.055 / size.x;
    pixels[id.y * 320u + id.x] =
        vastex_sample_grad(ID, uv, vec2<f32>(along, 0.0), vec2<f32>(0.0, along * depth * 0.6));
}
