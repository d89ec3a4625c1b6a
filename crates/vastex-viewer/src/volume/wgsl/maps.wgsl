// The colours of channels: each its own, or those of a colour map. What volume.wgsl calls; points of maps are looked up by palette_place
// and its neighbours, which are the layers'.

// The colour of a channel by its map, as a display value.
fn volume_mapped(nth: u32, x: f32) -> vec3<f32> {
    let at = palette_place(x);
    let first = palette_first(at);
    let low = volume_scene.maps[nth][first / 4u][first % 4u];
    let high = volume_scene.maps[nth][(first + 1u) / 4u][(first + 1u) % 4u];
    return palette_between(low, high, at - f32(first));
}

// The same of what a channel is reduced to: its colour times x, or that of its map.
fn volume_color(nth: u32, x: f32) -> vec3<f32> {
    if volume_scene.of_channel[nth].map == 0u {
        return volume_scene.of_channel[nth].color * x;
    }
    return volume_mapped(nth, x);
}
