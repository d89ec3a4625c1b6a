// What a planet is told of a place by each way of looking at it.

fn planet_uv_mesh(look: Look) -> vec2<f32> {
    return look.offset;
}

fn planet_uv_fixed(look: Look) -> vec2<f32> {
    return (vec2<f32>(look.anchor) + look.offset) / vec2<f32>(scene.grid[scene_zero].size);
}

// What is looked at a step in uv beside a place.
fn planet_moved_mesh(look: Look, step: vec2<f32>) -> Look {
    let uv = look.offset + step;
    let at = vec2<f32>(fract(uv.x), clamp(uv.y, 0.0, 1.0));
    return Look(look.anchor, at, look.ddx, look.ddy, look.steps, look.is_met);
}

fn planet_moved_fixed(look: Look, step: vec2<f32>) -> Look {
    let offset = look.offset + (step * vec2<f32>(scene.grid[scene_zero].size));
    return Look(look.anchor, offset, look.ddx, look.ddy, look.steps, look.is_met);
}

fn planet_site_mesh(look: Look, at: vec2<f32>) -> PlanetSite {
    return planet_site(planet_uv_mesh(look), slope_mesh(look), at);
}

fn planet_site_fixed(look: Look, at: vec2<f32>) -> PlanetSite {
    return planet_site(planet_uv_fixed(look), slope_fixed(look), at);
}
