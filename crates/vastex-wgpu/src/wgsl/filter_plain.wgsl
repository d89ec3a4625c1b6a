// One tap at a level: nearest, bilinear and trilinear filters.
// CPU twin: twins/sample.rs.

fn vastex_filtered(position: VastexPosition, footprint: VastexFootprint, level: f32) -> vec4<f32> {
    let finer = u32(floor(level));
    let place = vastex_place(position, finer);
    if VASTEX_FILTER == VASTEX_FILTER_NEAREST {
        return vastex_atlas_nearest(place);
    }
    let sharp = vastex_atlas_linear(place);
    let share = level - f32(finer);
    if VASTEX_FILTER == VASTEX_FILTER_BILINEAR || share == 0.0 {
        return sharp;
    }
    // There is a coarser level, since the coarsest is a whole number.
    return mix(sharp, vastex_atlas_linear(vastex_place(position, finer + 1u)), share);
}
