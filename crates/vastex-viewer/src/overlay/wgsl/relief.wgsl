// What is seen and what it is sampled by, on a surface displaced by heights: its colours.

fn overlay_picture(surface: Surface) -> vec3<f32> {
    let ddx = dpdx(surface.uv);
    let ddy = dpdy(surface.uv);
    let value = vastex_sample_color_grad(scene.ids.color, surface.uv, ddx, ddy);
    return scene_lit(value, scene_light(surface.uv, ddx, ddy)).rgb;
}

fn overlay_inspect(surface: Surface) -> VastexInspection {
    return vastex_inspect_color(scene.ids.color, surface.uv);
}
