// Reads labels of a volume at voxels from a buffer: x, y, z and level before; after, the label there and that of the next voxel along x.

@group(1) @binding(0) var<storage, read_write> places: array<vec4<u32>>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&places) { return; }
    let place = places[id.x];
    let anchor = vec3<u32>(7u, 3u, 11u);
    let middle = (vec3<f32>(place.xyz) + 0.5) * vastex_volume_scale(ID, place.w);
    let offset = middle - vec3<f32>(anchor);
    let brick = vastex_brick(ID, anchor, offset, f32(place.w));
    let beside = vastex_brick_whole_at(brick, brick.base + offset * brick.scale + vec3<f32>(1.0, 0.0, 0.0));
    let here = vastex_volume_whole(ID, anchor, offset, f32(place.w));
    // Whoever reads a coarser level than was asked for shall notice.
    places[id.x] = select(vec4<u32>(0u), vec4<u32>(here, beside), brick.shown == place.w);
}
