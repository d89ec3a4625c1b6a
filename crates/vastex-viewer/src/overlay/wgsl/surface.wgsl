// Overlays that colour the surface by what is sampled there.

fn overlay_picture_WAY(seen: Seen_WAY, look: Look) -> vec3<f32> {
    return shown_WAY(look, seen.clip.xy).rgb;
}

@fragment
fn shade_levels_WAY(seen: Seen_WAY) -> @location(0) vec4<f32> {
    let look = look_WAY(seen);
    if !look.is_met {
        return scene_beside();
    }
    return overlay_over(overlay_picture_WAY(seen, look), overlay_level(inspected_WAY(look, seen.clip.xy).shown));
}

@fragment
fn shade_wanted_WAY(seen: Seen_WAY) -> @location(0) vec4<f32> {
    let look = look_WAY(seen);
    if !look.is_met {
        return scene_beside();
    }
    let wanted = inspected_WAY(look, seen.clip.xy).wanted;
    let finer = u32(wanted);
    let color = mix(overlay_level(finer), overlay_level(finer + 1u), wanted - f32(finer));
    return overlay_over(overlay_picture_WAY(seen, look), color);
}

@fragment
fn shade_deficit_WAY(seen: Seen_WAY) -> @location(0) vec4<f32> {
    let look = look_WAY(seen);
    if !look.is_met {
        return scene_beside();
    }
    let inspected = inspected_WAY(look, seen.clip.xy);
    return overlay_over(overlay_picture_WAY(seen, look), overlay_deficit(f32(inspected.shown) - floor(inspected.wanted)));
}

// Lines of a pixel on both sides of each page's edge, in the colour of its level.
@fragment
fn shade_pages_WAY(seen: Seen_WAY) -> @location(0) vec4<f32> {
    let look = look_WAY(seen);
    if !look.is_met {
        return scene_beside();
    }
    let inspected = inspected_WAY(look, seen.clip.xy);
    let texels_per_pixel = overlay_texels_WAY(look, inspected.level_size);
    let page = inspected.page_size;
    let from_edge = min(inspected.page_texel, page - inspected.page_texel) / max(texels_per_pixel, vec2<f32>(1e-9));
    let is_edge = min(from_edge.x, from_edge.y) < 1.0;
    return vec4<f32>(select(overlay_picture_WAY(seen, look), overlay_level(inspected.shown), is_edge), 1.0);
}
