// What sampling goes by at a place, for pictures of the machine at work and for an application's own debugging.

struct VastexInspection {
    wanted: f32,           // the level at mip bias 0
    level: f32,            // the level that is sampled
    shown: u32,            // the level whose texels are there, that or a coarser one
    page: vec2<u32>,       // the page of that level; 0,0 in the tail
    page_texel: vec2<f32>, // the place in the page, in texels of that level from its first
    page_size: vec2<f32>,  // texels of the page; in the tail those of the level
    level_size: vec2<f32>, // texels of that level
}

fn vastexi_inspection(
    texture: VastexiTexture,
    position: VastexiPosition,
    place: VastexiPlace,
    lambda: f32,
    level: f32,
    powers: bool,
) -> VastexInspection {
    let shown = vastexi_level(texture, place.level, powers);
    let level_size = vec2<f32>(vastexi_level_size(texture, shown, powers));
    let is_paged = place.level < texture.tail_level;
    let page_size = select(level_size, vec2<f32>(vastexi_page_texels(texture, powers)), is_paged);
    let from_page = vastexi_texel_in_page(shown.sides, position.texel, place.page, powers);
    let page_texel = (vec2<f32>(from_page) + position.fraction) / vec2<f32>(vastexi_scale(shown, powers));
    let wanted = vastexi_unbiased_level(texture, lambda);
    return VastexInspection(wanted, level, place.level, place.page, page_texel, page_size, level_size);
}
