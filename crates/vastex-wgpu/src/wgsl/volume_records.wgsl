// What a record says of a volume or a group of volumes, and of its levels; what nobody uses of it the compiler leaves out, and its reads
// with it. The mirror is in record/volume.rs.
//
// A place in a volume is `offset` voxels of level 0 from the first corner of voxel `anchor` of level 0. The anchor is whole numbers, the
// same for a draw, so that what is near it is exact however large the volume is; of levels whose voxels are not 2^n of level 0, to 24 bits of a
// voxel's number.
//
// Bricks are boxes of texels, which nest by whole factors; what lies in them are voxels, whose sides and beginnings are the file's
// (VoxelLevels of vastex-core). Where the two are the same grid at every level the volume is aligned, and its record is shorter.

// A volume, or the shape of a group of volumes.
struct VastexiVolume {
    is_known: bool,         // whether the id names a volume that there is
    number: u32,            // in page ids
    size: vec3<u32>,        // voxels of level 0
    last_level: u32,        // the coarsest level that it has
    table_level: u32,       // as of VastexiTexture
    table_end: u32,
    former_end: u32,
    former_level: u32,
    first_level: u32,
    tail_level: u32,        // the finest level of the tail
    tail_slot: u32,
    bias: f32,              // levels added to every level computed from a pixel's size
    finest: f32,            // the finest and the coarsest level wanted
    coarsest: f32,
    page: u32,              // payload of a brick [texels per side]
    border: u32,            // on each side [texels]
    is_aligned: bool,
}

// One level.
struct VastexiVolumeLevel {
    first: u32,               // where its entries begin in a direct page table
    pages: vec2<u32>,         // bricks along x and y
    shift: vec3<u32>,         // log2 of the scale where the level's voxels are 2^n of level 0, and begin with them; else 31
    inverse_scale: vec3<f32>, // voxels of the level along one of level 0
    first_voxel: vec3<f32>,   // the beginning of level 0 [voxels of the level]
    texel_scale: vec3<u32>,   // texels of level 0 along one of the level
    base: vec3<i32>,          // in a tile: where voxel 0 of the level lies, or of an aligned volume where its brick's payload begins [voxels]
}

// An anchor as a level has it: a voxel, and how far into it.
struct VastexiVolumeAnchor {
    voxel: vec3<i32>,
    fraction: vec3<f32>,
}

// The volume of an id. Its record has the id with all bits turned over, so that no function for images takes a volume for an image, nor one
// for volumes an image for a volume; a record of zeros is of neither.
fn vastexi_volume(id: u32) -> VastexiVolume {
    let number = id & VASTEXI_NUMBER_MASK;
    let shape = vastexi_param(number, 0u);
    let rule = vastexi_param(number, 1u);
    let brick = vastexi_param(number, 2u);
    return VastexiVolume(
        (shape.z == ~id) && (shape.z != 0u) && (id != 0u),
        number,
        vec3<u32>(shape.xy, shape.w),
        brick.z & 31u,
        (brick.z >> 5u) & 31u,
        1u << (rule.w & 31u),
        1u << ((rule.w >> 5u) & 31u),
        (rule.w >> 10u) & 31u,
        (rule.w >> 15u) & 31u,
        rule.y >> VASTEXI_ENTRY_SLOT_BITS,
        rule.y & ((1u << VASTEXI_ENTRY_SLOT_BITS) - 1u),
        bitcast<f32>(rule.x),
        f32((brick.z >> 10u) & 31u),
        f32((brick.z >> 15u) & 31u),
        brick.x,
        brick.y,
        ((brick.z >> 20u) & 1u) == 0u,
    );
}

// The `n`-th 16 bytes of what a record has of a level.
fn vastexi_volume_word(volume: VastexiVolume, number: u32, n: u32) -> vec4<u32> {
    let of_level = select(VASTEXI_RECORD_VOLUME_LEVEL, VASTEXI_RECORD_LEVEL, volume.is_aligned);
    return vastexi_param(volume.number, VASTEXI_RECORD_HEAD + (of_level * number) + n);
}

fn vastexi_volume_level(volume: VastexiVolume, number: u32) -> VastexiVolumeLevel {
    let table = vastexi_volume_word(volume, number, 0u);
    let scale = vastexi_volume_word(volume, number, 1u);
    let first = vastexi_volume_word(volume, number, 2u);
    let base = vastexi_volume_word(volume, number, 3u);
    return VastexiVolumeLevel(
        table.x,
        table.yz,
        (vec3<u32>(table.w) >> vec3<u32>(0u, 5u, 10u)) & vec3<u32>(31u),
        bitcast<vec3<f32>>(scale.xyz),
        bitcast<vec3<f32>>(vec3<u32>(scale.w, first.xy)),
        vec3<u32>(first.zw, base.x),
        bitcast<vec3<i32>>(base.yzw),
    );
}

// Voxels of a level along one of level 0.
fn vastexi_volume_inverse_scale(volume: VastexiVolume, number: u32) -> vec3<f32> {
    return bitcast<vec3<f32>>(vastexi_volume_word(volume, number, 1u).xyz);
}

// The voxel of a level finer than the tail that lies at the corner of a brick's tile, in fixed point: the twin of VoxelLevel::first_voxel.
fn vastexi_first_voxel(volume: VastexiVolume, number: u32, page: vec3<u32>) -> vec3<i32> {
    if volume.is_aligned {
        return vec3<i32>(page * volume.page) - i32(volume.border);
    }
    let step = vastexi_volume_word(volume, number, 4u); // the last of each is whole voxels of the step
    let offset = vastexi_volume_word(volume, number, 5u);
    let whole = vastexi_volume_word(volume, number, 6u);
    // page * step + offset, of which the 32 bits below the voxel give what is carried over; a page has 16 bits.
    let low = page * (step.xyz & vec3<u32>(0xffffu));
    let high = page * (step.xyz >> vec3<u32>(16u));
    let carried = ((low & vec3<u32>(0xffffu)) + (offset.xyz & vec3<u32>(0xffffu))) >> vec3<u32>(16u);
    let middle = (low >> vec3<u32>(16u)) + (high & vec3<u32>(0xffffu)) + (offset.xyz >> vec3<u32>(16u)) + carried;
    let above = (high >> vec3<u32>(16u)) + (middle >> vec3<u32>(16u));
    return vec3<i32>((page * vec3<u32>(step.w, offset.w, whole.w)) + above) + bitcast<vec3<i32>>(whole.xyz);
}

fn vastexi_volume_anchor(level: VastexiVolumeLevel, anchor: vec3<u32>) -> VastexiVolumeAnchor {
    let whole = anchor >> level.shift;
    let rest = vec3<f32>(anchor - (whole << level.shift)) * level.inverse_scale;
    let computed = vec3<f32>(anchor) * level.inverse_scale + level.first_voxel;
    let is_shifted = level.shift < vec3<u32>(31u);
    let voxel = select(vec3<i32>(floor(computed)), vec3<i32>(whole), is_shifted);
    return VastexiVolumeAnchor(voxel, select(computed - floor(computed), rest, is_shifted));
}

// The texel of level 0 that a place is in; outside of the volume the nearest one.
fn vastexi_volume_texel(volume: VastexiVolume, anchor: vec3<u32>, offset: vec3<f32>) -> vec3<u32> {
    let reach = f32(VASTEXI_FIXED_REACH);
    let texel = vec3<i32>(anchor) + vec3<i32>(floor(clamp(offset, vec3<f32>(-reach), vec3<f32>(reach))));
    return vec3<u32>(clamp(texel, vec3<i32>(0), vec3<i32>(volume.size - 1u)));
}

// The brick of a level finer than the tail that covers a texel of level 0.
fn vastexi_brick_page(volume: VastexiVolume, level: VastexiVolumeLevel, texel: vec3<u32>) -> vec3<u32> {
    return (texel / level.texel_scale) / volume.page;
}

// The id of a brick, low half first: x, y and z of VASTEXI_COORD_BITS_3D bits each, level, number of the volume.
fn vastexi_brick_id(number: u32, page: vec3<u32>, level: u32) -> vec2<u32> {
    let low = page.x | (page.y << VASTEXI_COORD_BITS_3D);
    let high = page.z | (level << (VASTEXI_LEVEL_SHIFT - 32u)) | (number << (VASTEXI_TEXTURE_SHIFT - 32u));
    return vec2<u32>(low, high);
}

// How many levels coarser than level 0 a pixel wants that covers so many voxels of level 0 along each axis. Its whole part is the coarsest
// level of which no voxel is larger than the pixel, along no axis, but that those of level 0 may be. The rest says how near the next one
// is: 0 where the pixel just has this one, 1 where it would have the next.
fn vastexi_volume_lambda(volume: VastexiVolume, pixel: vec3<f32>) -> f32 {
    // Sizes that are computed in two ways are not to differ by a level.
    let most = max(pixel, vec3<f32>(1.0)) * 1.00001;
    var finer = vec3<f32>(1.0);
    for (var number = 1u; number <= volume.last_level; number++) {
        let scale = 1.0 / vastexi_volume_inverse_scale(volume, number);
        let over = scale / most;
        let largest = max(max(over.x, over.y), over.z);
        if !(largest <= 1.0) {
            let steps = scale / finer;
            let step = max(max(steps.x, steps.y), max(steps.z, 1.001));
            return f32(number) - clamp(log2(largest) / log2(step), 0.001, 1.0);
        }
        finer = scale;
    }
    return f32(volume.last_level);
}

// Voxels of level 0 along one of a level, per axis; of a level that there is not those of the coarsest.
fn vastex_volume_scale(id: u32, level: u32) -> vec3<f32> {
    let volume = vastexi_volume(id);
    return 1.0 / vastexi_volume_inverse_scale(volume, min(level, volume.last_level));
}

// The size of the volume of an id, in voxels of level 0; 0 where the id names none.
fn vastex_volume_size(id: u32) -> vec3<u32> {
    let volume = vastexi_volume(id);
    return select(vec3<u32>(0u), volume.size, volume.is_known);
}
