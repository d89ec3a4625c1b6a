// Where each pixel is on the texture: uv, and its gradients along one pixel. For pictures that the CPU makes.

struct Coordinates {
    @location(0) uv_and_dx: vec4<f32>,
    @location(1) dy_and_covered: vec4<f32>,
}

@fragment
fn tell(surface: Surface) -> Coordinates {
    return Coordinates(vec4<f32>(surface.uv, dpdx(surface.uv)), vec4<f32>(dpdy(surface.uv), 1.0, 0.0));
}
