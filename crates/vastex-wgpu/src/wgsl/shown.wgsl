// What is shown of tiles that are there at once: what the filter takes of the finest. fade.wgsl stands in its place where they fade in.
// CPU twin: twins/fade.rs.

fn vastex_shown(position: VastexPosition, taps: VastexTaps, wanted: u32) -> vec4<f32> {
    return vastex_taken(position, vastex_place(position, wanted), taps, wanted);
}
