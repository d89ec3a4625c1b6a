// What sampling goes by at a place: see inspect.wgsl.

struct VastexInspection {
    wanted: f32,           // the level at mip bias 0
    level: f32,            // the level that is sampled
    shown: u32,            // the level whose texels are there, that or a coarser one
    page: vec2<u32>,       // the page of that level; 0,0 in the tail
    page_texel: vec2<f32>, // the place in the page, in texels of that level from its first
    page_size: vec2<f32>,  // texels of the page; in the tail those of the level
    level_size: vec2<f32>, // texels of that level
}
