// What an application's shader calls in the place of textureSample. Derivatives are taken of uv alone, before anything is read.

// The texture of an id at `uv`, at a level computed from screen-space derivatives. Fragment stage, uniform control flow.
fn vastex_sample_NAME(id: u32, uv: vec2<f32>) -> vec4<f32> {
    return vastex_sample_NAME_grad(id, uv, dpdx(uv), dpdy(uv));
}

// The same for a uv that jumps from 1 to 0 between neighbouring pixels where a surface closes, as one that is computed in the shader
// from a direction or an angle does: along wrapping axes neighbours lie the shorter way round, less than half a turn apart.
// Fragment stage, uniform control flow.
fn vastex_sample_NAME_wrapped(id: u32, uv: vec2<f32>) -> vec4<f32> {
    let ddx = dpdx(uv);
    let ddy = dpdy(uv);
    let texture = vastexi_texture(id);
    return vastex_sample_NAME_grad(id, uv, vastexi_wrapped(texture, ddx), vastexi_wrapped(texture, ddy));
}

// The same with gradients of uv along one pixel, in any stage.
fn vastex_sample_NAME_grad(id: u32, uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> vec4<f32> {
    let texture = vastexi_texture_by_uv(id);
    let size = vec2<f32>(texture.size);
    return vastexi_sample_texels_KIND(texture, vastexi_position_from_uv(texture, uv), ddx * size, ddy * size);
}

// The same `level` levels coarser than level 0, in any stage; the biases of texture and pool are added. Below 0 it says how many
// times the texture is enlarged. Whatever the filter, all axes count alike.
fn vastex_sample_NAME_level(id: u32, uv: vec2<f32>, level: f32) -> vec4<f32> {
    let texture = vastexi_texture_by_uv(id);
    let footprint = VastexiFootprint(level, vec2<f32>(0.0));
    return vastexi_sample_KIND(texture, vastexi_position_from_uv(texture, uv), footprint);
}

// One texel, whatever the filter. Fragment stage, uniform control flow.
fn vastex_sample_NAME_nearest(id: u32, uv: vec2<f32>) -> vec4<f32> {
    return vastex_sample_NAME_nearest_grad(id, uv, dpdx(uv), dpdy(uv));
}

// The same with gradients of uv along one pixel, in any stage.
fn vastex_sample_NAME_nearest_grad(id: u32, uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> vec4<f32> {
    let texture = vastexi_texture_by_uv(id);
    let size = vec2<f32>(texture.size);
    let lambda = vastexi_footprint(ddx * size, ddy * size, 1u).lambda;
    return vastexi_nearest_KIND(texture, vastexi_position_from_uv(texture, uv), lambda);
}

// The same at an explicit level, in any stage.
fn vastex_sample_NAME_nearest_level(id: u32, uv: vec2<f32>, level: f32) -> vec4<f32> {
    let texture = vastexi_texture_by_uv(id);
    return vastexi_nearest_KIND(texture, vastexi_position_from_uv(texture, uv), level);
}

// In fixed point, for textures of any size: a whole-numbered anchor that a draw is measured from, and an offset from it that is
// interpolated. An offset below 2^16 texels is known to 1/128 of one, wherever in 2^31 of them the anchor is.
//
// The texture `offset` texels of level 0 from the beginning of texel `anchor`, which is the same over the draw, at a level
// computed from screen-space derivatives. Fragment stage, uniform control flow.
fn vastex_sample_NAME_fixed(id: u32, anchor: vec2<u32>, offset: vec2<f32>) -> vec4<f32> {
    return vastex_sample_NAME_fixed_grad(id, anchor, offset, dpdx(offset), dpdy(offset));
}

// The same with gradients in texels of level 0 along one pixel, in any stage.
fn vastex_sample_NAME_fixed_grad(
    id: u32,
    anchor: vec2<u32>,
    offset: vec2<f32>,
    ddx: vec2<f32>,
    ddy: vec2<f32>,
) -> vec4<f32> {
    let texture = vastexi_texture(id);
    let position = vastexi_position_from_fixed(texture, anchor, offset);
    return vastexi_sample_texels_KIND(texture, position, ddx, ddy);
}

// The same `level` levels coarser than level 0, in any stage; the biases of texture and pool are added.
fn vastex_sample_NAME_fixed_level(id: u32, anchor: vec2<u32>, offset: vec2<f32>, level: f32) -> vec4<f32> {
    let texture = vastexi_texture(id);
    let position = vastexi_position_from_fixed(texture, anchor, offset);
    return vastexi_sample_KIND(texture, position, VastexiFootprint(level, vec2<f32>(0.0)));
}

// What sampling goes by at `uv`, at a level computed from screen-space derivatives. Fragment stage, uniform control flow.
fn vastex_inspect_NAME(id: u32, uv: vec2<f32>) -> VastexInspection {
    return vastex_inspect_NAME_grad(id, uv, dpdx(uv), dpdy(uv));
}

// The same with gradients of uv along one pixel, in any stage.
fn vastex_inspect_NAME_grad(id: u32, uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> VastexInspection {
    let texture = vastexi_texture_by_uv(id);
    let size = vec2<f32>(texture.size);
    let lambda = vastexi_footprint(ddx * size, ddy * size, VASTEXI_TAPS_KIND).lambda;
    return vastexi_inspect_KIND(texture, vastexi_position_from_uv(texture, uv), lambda);
}

// The same in fixed point, with gradients in texels of level 0 along one pixel, in any stage.
fn vastex_inspect_NAME_fixed_grad(
    id: u32,
    anchor: vec2<u32>,
    offset: vec2<f32>,
    ddx: vec2<f32>,
    ddy: vec2<f32>,
) -> VastexInspection {
    let texture = vastexi_texture(id);
    let lambda = vastexi_footprint(ddx, ddy, VASTEXI_TAPS_KIND).lambda;
    return vastexi_inspect_KIND(texture, vastexi_position_from_fixed(texture, anchor, offset), lambda);
}

// The level of the finest resident page that covers a page of the texture.
fn vastex_inspect_NAME_page(id: u32, page: vec2<u32>, level: u32) -> u32 {
    let texture = vastexi_texture(id);
    let of_level = vastexi_level(texture, level, VASTEXI_POWERS_POOL);
    let texel = page * vastexi_page_texels(texture, VASTEXI_POWERS_POOL) * vastexi_scale(of_level, VASTEXI_POWERS_POOL);
    let first = min(texel, texture.size - 1u);
    let position = VastexiPosition(first, vec2<f32>(0.5), vec2<f32>(1.0));
    return vastexi_place_POOL(texture, position, level, VASTEXI_SCALE_LAYER).level;
}

// A texel of a slot of the pool, `tile_texel` texels of the texture from the first of its border, 0 to the size of a slot.
fn vastex_inspect_NAME_slot(slot: u32, tile_texel: vec2<f32>) -> vec4<f32> {
    let last = vec2<f32>(vastexi_pool_POOL.tile) - 0.5;
    let within = clamp(tile_texel, vec2<f32>(0.0), last);
    let no_page = vec2<u32>(0u);
    let place = vastexi_place_in_slot(vastexi_pool_POOL, slot, within, vec2<f32>(1.0), 0u, no_page, VASTEXI_SCALE_LAYER);
    return vastexi_texel_LAYER(place, vec2<u32>(floor(place.tile_texel)));
}

// Size of a slot of the pool, in texels of the texture.
fn vastex_inspect_NAME_slot_size() -> vec2<u32> {
    return vastexi_pool_POOL.tile;
}
