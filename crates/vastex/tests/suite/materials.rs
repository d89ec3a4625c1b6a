//! The example of many materials works as it stands: every pixel of each of its textures is what its image has there.

#[path = "../../examples/many_materials/main.rs"]
#[allow(dead_code, reason = "the test gives the argument that `main` reads")]
mod many_materials;

use many_materials::{TEXTURES, draw, plain, uv_of};

/// 32 by 32 pixels for each texture.
const SIZE: [u32; 2] = [640, 320];

#[test]
fn two_hundred_textures_are_drawn_with_a_bind_group_for_each_pool() {
    let drawn = draw(SIZE).unwrap();
    assert_eq!((drawn.kinds, drawn.pools, drawn.bind_groups_set), (3, 4, 4));
    let encoded = |light: f32| 255.0 * (1.055 * light.powf(1.0 / 2.4) - 0.055);
    for nth in 0..TEXTURES {
        let [left, top] = [nth % 20, nth / 20].map(|at| at as u32 * 32);
        let [u0, v0, u1, v1] = uv_of(nth);
        for (y, x) in (0..32).flat_map(|y| (0..32).map(move |x| (y, x))) {
            let at = [x, y].map(|at| (at as f32 + 0.5) / 32.0);
            // What is sampled at an edge of the image is folded there.
            let uv = [u0 + (u1 - u0) * at[0], v0 + (v1 - v0) * at[1]];
            if nth % 4 == 3 && uv.iter().any(|at| !(0.1..0.9).contains(at)) {
                continue;
            }
            let pixel = ((top + y) * SIZE[0] + left + x) as usize * 4;
            let (shown, expected) = (&drawn.pixels[pixel..pixel + 3], plain::light(nth, uv).map(encoded));
            let is_close = shown.iter().zip(expected).all(|(&a, b)| (f32::from(a) - b).abs() < 2.0);
            assert!(is_close, "texture {nth}, pixel {x},{y}: {shown:?} in the place of {expected:?}");
        }
    }
}
