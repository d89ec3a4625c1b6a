// What is seen and what it is sampled by, on a surface displaced by heights: its colours.

fn overlay_picture(surface: Surface) -> vec3<f32> {
    let ddx = dpdx(surface.uv);
    let ddy = dpdy(surface.uv);
    let colour = scene_colour(vastex_sample_color_grad(surface.uv, ddx, ddy));
    return colour.rgb * scene_light(surface.uv, ddx, ddy);
}

fn overlay_inspect(surface: Surface) -> VastexInspection {
    return vastex_inspect_color(surface.uv);
}
