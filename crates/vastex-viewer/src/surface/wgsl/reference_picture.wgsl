// The pictures from the ordinary texture.

@fragment
fn shade_ordinary_WAY(seen: Seen_WAY) -> @location(0) vec4<f32> {
    let look = reference_look_WAY(seen);
    if !look.is_met {
        return scene_beside();
    }
    let footprint = reference_footprint(look.ddx, look.ddy);
    let level = vastexi_sampled_level(reference_texture(), footprint.lambda, vastexi_pool_0.bias);
    let taps = vastexi_tap_count(footprint.axis, level, VASTEXI_TAPS_0);
    let finer = u32(floor(level));
    let sharp = ordinary_filtered(look.uv, footprint, taps, finer);
    if VASTEXI_FILTER_0 == VASTEXI_FILTER_NEAREST || VASTEXI_FILTER_0 == VASTEXI_FILTER_BILINEAR {
        return scene_colour(sharp);
    }
    let coarser = min(finer + 1u, reference_texture().last_level);
    return scene_colour(mix(sharp, ordinary_filtered(look.uv, footprint, taps, coarser), level - f32(finer)));
}

// The same by the adapter's own filter, to see how far its approximations are from it.
@fragment
fn shade_by_adapter_WAY(seen: Seen_WAY) -> @location(0) vec4<f32> {
    let look = reference_look_WAY(seen);
    if !look.is_met {
        return scene_beside();
    }
    let share = reference_params.share;
    let at = reference_uv(look.uv, vec2<f32>(0.0));
    return scene_colour(textureSampleGrad(reference, reference_sampler, at, look.ddx * share, look.ddy * share));
}

@fragment
fn shade_reference_WAY(seen: Seen_WAY) -> @location(0) vec4<f32> {
    let look = reference_look_WAY(seen);
    if !look.is_met {
        return scene_beside();
    }
    let footprint = reference_footprint(look.ddx, look.ddy);
    let level = vastexi_sampled_level(reference_texture(), footprint.lambda, vastexi_pool_0.bias);
    let finer = u32(floor(level));
    let sharp = reference_filtered(look, footprint, level, finer);
    if VASTEXI_FILTER_0 == VASTEXI_FILTER_NEAREST || VASTEXI_FILTER_0 == VASTEXI_FILTER_BILINEAR {
        return scene_colour(sharp);
    }
    let coarser = min(finer + 1u, reference_texture().last_level);
    return scene_colour(mix(sharp, reference_filtered(look, footprint, level, coarser), level - f32(finer)));
}
