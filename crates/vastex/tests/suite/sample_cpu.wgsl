// Samples a texture at places from a buffer, for queries on the CPU to be compared with.

@group(1) @binding(0) var<storage, read_write> points: array<vec4<f32>>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&points) { return; }
    points[id.x] = vastex_sample_level(ID, points[id.x].xy, points[id.x].z);
}
