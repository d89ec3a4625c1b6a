// Where each pixel is on the texture: the place, and its gradients along one pixel, whether a surface is there, and how light it is. For
// pictures that the CPU makes, and to measure by.

struct Coordinates_WAY {
    @location(0) place_and_dx: vec4<f32>,
    @location(1) dy_covered_and_light: vec4<f32>,
}

@fragment
fn locate_WAY(seen: Seen_WAY) -> Coordinates_WAY {
    let look = look_WAY(seen);
    let covered = select(0.0, 1.0, look.is_met);
    return Coordinates_WAY(vec4<f32>(look.offset, look.ddx), vec4<f32>(look.ddy, covered, light_WAY(look)));
}
