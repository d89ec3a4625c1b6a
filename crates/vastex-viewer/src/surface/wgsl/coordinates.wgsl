// Where each pixel is on the texture: uv, and its gradients along one pixel, and how light it is. For pictures that the CPU makes.

struct Coordinates {
    @location(0) uv_and_dx: vec4<f32>,
    @location(1) dy_covered_and_light: vec4<f32>,
}

@fragment
fn tell(surface: Surface) -> Coordinates {
    let ddx = dpdx(surface.uv);
    let ddy = dpdy(surface.uv);
    return Coordinates(vec4<f32>(surface.uv, ddx), vec4<f32>(ddy, 1.0, scene_light(surface.uv, ddx, ddy)));
}
