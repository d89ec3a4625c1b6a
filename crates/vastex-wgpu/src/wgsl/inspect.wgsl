// What sampling goes by at a place, for pictures of the machine at work and for an application's own debugging.

// At `uv`, at a level computed from screen-space derivatives. Fragment stage, uniform control flow.
fn vastex_inspect(uv: vec2<f32>) -> VastexInspection {
    return vastex_inspect_grad(uv, dpdx(uv), dpdy(uv));
}

// The same with gradients of uv along one pixel, in any stage.
fn vastex_inspect_grad(uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> VastexInspection {
    let size = vec2<f32>(vastex_texture.size.xy);
    return vastex_inspect_lambda(vastex_position_from_uv(uv), vastex_lambda(ddx * size, ddy * size));
}

fn vastex_inspect_lambda(position: VastexPosition, lambda: f32) -> VastexInspection {
    let level = vastex_level(lambda);
    let place = vastex_place(position, u32(floor(level)));
    let scale = vec2<f32>(vastex_texture.levels[place.level].scale.xy);
    let level_size = vec2<f32>(vastex_texture.levels[place.level].size);
    let is_paged = place.level < vastex_texture.tail_level;
    let page_size = select(level_size, vec2<f32>(vastex_texture.page.xy), is_paged);
    let from_page = vastex_texel_in_page(position.texel, place.page, place.level);
    let page_texel = (vec2<f32>(from_page) + position.fraction) / scale;
    let wanted = vastex_unbiased_level(lambda);
    return VastexInspection(wanted, level, place.level, place.page, page_texel, page_size, level_size);
}

// The level of the finest resident page that covers a page of the texture.
fn vastex_inspect_page(page: vec2<u32>, level: u32) -> u32 {
    let texel = page * vastex_texture.page.xy * vastex_texture.levels[level].scale.xy;
    let first = min(texel, vastex_texture.size.xy - 1u);
    return vastex_place(VastexPosition(first, vec2<f32>(0.5), vec2<f32>(1.0)), level).level;
}

// A texel of a slot of the pool, `tile_texel` texels of the texture from the first of its border, 0 to the size of a slot.
fn vastex_inspect_slot(slot: u32, tile_texel: vec2<f32>) -> vec4<f32> {
    let last = vec2<f32>(vastex_pool.tile * vastex_pool.layer_scale) - 0.5;
    let within = clamp(tile_texel, vec2<f32>(0.0), last);
    return vastex_atlas_nearest(vastex_place_in_slot(slot, within, 0u, vec2<u32>(0u)));
}
