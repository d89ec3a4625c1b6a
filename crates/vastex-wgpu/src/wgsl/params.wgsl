// What shaders are told of pools and views, and how they bind it; records.wgsl has what they are told of textures.
// The mirrors of these structs stand in mirror.rs; a test compares sizes and offsets.

// A pool, in which the tiles of textures lie: those of images in the images of a texture array, those of volumes in a 3-D texture.
struct VastexiPool {
    tile: vec2<u32>,        // size of a slot along x and y [texels of the texture]
    slots: vec2<u32>,       // along x and y of the atlas
    inverse_slots: vec2<f32>,
    texel: vec2<f32>,       // size of a texel of the texture along x and y [atlas uv]
    unknown: vec4<f32>,     // what an id shows that names no texture
    bias: f32,              // levels added to every level, so that the working set fits
    depth: u32,             // size of a slot along z: 1 in a texture array
    texel_z: f32,           // size of a texel along z [atlas uv]
    last_image: u32,        // of the texture array, bounds a slot's image (see place.wgsl); 0 of a 3-D texture
    tile_side: vec2<f32>,   // tile and slots once more, as numbers that places are computed with
    slots_side: vec2<f32>,
}

// A view that is being drawn: into a feedback target or, where feedback is inline, its picture.
struct VastexiView {
    clip_scale: vec2<f32>,  // clip.xy * clip_scale + clip_offset * clip.w puts the picture onto the target
    clip_offset: vec2<f32>,
    level_offset: f32,      // levels added because a pixel of the target is larger than one of the picture
    frame: u32,             // its number, for those that take turns
    jitter: vec2<u32>,      // inline: which pixel of each cell is asked
    columns: u32,           // inline: cells along x; 0 where nothing is asked
    cell: u32,              // pixels per side that give one answer: 1 in a feedback target
    reversed_depth: u32,    // inline: 1 where nearer is a larger depth
    first_cell: u32,        // inline: where the view's cells begin among those of all views
    rows: u32,              // inline: cells along y
    answers: u32,           // of rays: pixels of the target below one another that look at one pixel of the picture
    block: u32,             // pixels of the picture per side for which they stand
    gaps: u32,              // of rays that look for gaps: which pass that is, from 1, in the lowest 8 bits, above them of how many bricks each names one; else 0
}

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_VIEWS) var<uniform> vastexi_views: array<VastexiView, VASTEXI_VIEWS>;
@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_SAMPLER) var vastexi_sampler: sampler;
