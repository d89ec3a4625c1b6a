// What is seen and what it is sampled by, on a surface as it is.

fn overlay_picture(surface: Surface) -> vec3<f32> {
    return scene_colour(vastex_sample(scene.ids.color, surface.uv)).rgb;
}

fn overlay_inspect(surface: Surface) -> VastexInspection {
    return vastex_inspect(scene.ids.color, surface.uv);
}
