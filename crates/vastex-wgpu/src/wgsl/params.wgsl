// What the shaders are told about a texture, its pool and the view.
// The mirrors of these structs stand in mirror.rs; a test compares sizes and offsets.

// One level of a virtual texture.
struct VastexLevel {
    scale: vec3<u32>,       // texels of level 0 along one texel of this level
    first_entry: u32,       // where the level's entries begin in the page table
    pages: vec3<u32>,       // pages along each axis
    unused_0: u32,
    page_texels: vec2<u32>, // texels of level 0 along a page; all there can be in the tail, whose levels are one page
    page_shift: vec2<u32>,  // their log2, rounded down; 31 in the tail
    size: vec2<u32>,        // of the level [texels]
    origin: vec2<f32>,      // in a tile: where the level's payload begins [texels]
    inverse_scale: vec2<f32>,
    sample_offset: vec2<f32>, // added to a position of level 0 divided by the scale [texels], up to a half
}

// One virtual texture.
struct VastexTexture {
    size: vec3<u32>,        // texels of level 0
    level_count: u32,
    page: vec3<u32>,        // payload of a page [texels]
    tail_level: u32,        // the finest level of the tail
    border: vec3<u32>,      // border on each side [texels]
    tail_slot: u32,
    address: vec3<u32>,     // VASTEX_ADDRESS_*, per axis
    number: u32,            // the texture's number in a page id
    bias: f32,              // levels added to every level computed from gradients
    finest: f32,            // the finest and the coarsest level wanted
    coarsest: f32,
    table_level: u32,       // the finest level that is looked up in the page table; nothing finer is resident, or the table still grows
    table_places: u32,      // of a hashed page table, a power of two; 0 where it is direct
    table_seed: u32,        // what the hashes of its pages begin with
    unused_0: u32,
    unused_1: u32,
    levels: array<VastexLevel, VASTEX_MAX_LEVELS>,
}

// The pool in which the texture's tiles lie, and the layer of it that is sampled.
struct VastexPool {
    tile: vec2<u32>,        // size of a slot [texels of the layer]
    slots: vec2<u32>,       // along x and y of an image
    inverse_slots: vec2<f32>,
    texel: vec2<f32>,       // size of one of the layer's texels [atlas uv]
    bias: f32,              // levels added to every level, so that the working set fits
    layer_scale: u32,       // texels of the texture along one of the layer: 1, 2 or 4
    layer_share: f32,       // its inverse
    unused_0: u32,
}

// The view that is being drawn: into a feedback target or, where feedback is inline, its picture.
struct VastexView {
    clip_scale: vec2<f32>,  // clip.xy * clip_scale + clip_offset * clip.w puts the picture onto the target
    clip_offset: vec2<f32>,
    level_offset: f32,      // levels added because a pixel of the target is larger than one of the picture
    frame: u32,             // its number, for those that take turns
    jitter: vec2<u32>,      // inline: which pixel of each cell is asked
    columns: u32,           // inline: cells along x; 0 where nothing is asked
    cell: u32,              // pixels per side that give one answer: 1 in a feedback target
    reversed_depth: u32,    // inline: 1 where nearer is a larger depth
    unused_0: u32,
}
