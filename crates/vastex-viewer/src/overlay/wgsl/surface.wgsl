// Overlays that colour the surface by what is sampled there. After this stands what a scene samples: overlay_plain.wgsl or
// overlay_relief.wgsl.

@fragment
fn shade_levels(surface: Surface) -> @location(0) vec4<f32> {
    let picture = overlay_picture(surface);
    return overlay_over(picture, overlay_level(overlay_inspect(surface).shown));
}

@fragment
fn shade_wanted(surface: Surface) -> @location(0) vec4<f32> {
    let picture = overlay_picture(surface);
    let wanted = overlay_inspect(surface).wanted;
    let finer = u32(wanted);
    return overlay_over(picture, mix(overlay_level(finer), overlay_level(finer + 1u), wanted - f32(finer)));
}

@fragment
fn shade_deficit(surface: Surface) -> @location(0) vec4<f32> {
    let picture = overlay_picture(surface);
    let inspected = overlay_inspect(surface);
    return overlay_over(picture, overlay_deficit(f32(inspected.shown) - floor(inspected.wanted)));
}

// Lines of a pixel on both sides of each page's edge, in the colour of its level.
@fragment
fn shade_pages(surface: Surface) -> @location(0) vec4<f32> {
    let picture = overlay_picture(surface);
    let inspected = overlay_inspect(surface);
    let texels_per_pixel = fwidth(surface.uv) * inspected.level_size;
    let page = inspected.page_size;
    let from_edge = min(inspected.page_texel, page - inspected.page_texel) / max(texels_per_pixel, vec2<f32>(1e-9));
    let is_edge = min(from_edge.x, from_edge.y) < 1.0;
    return vec4<f32>(select(picture, overlay_level(inspected.shown), is_edge), 1.0);
}
