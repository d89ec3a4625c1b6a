// The picture, from virtual textures. Where feedback is inline, it reports what it wants.

@fragment
fn shade_WAY(seen: Seen_WAY) -> @location(0) vec4<f32> {
    let look = look_WAY(seen);
    if !look.is_met {
        return scene_beside();
    }
    if vastex_asked(scene.ids.view, seen.clip) {
        vastex_report(scene.ids.view, seen.clip, wanted_WAY(seen, look));
    }
    return shown_WAY(look, seen.clip.xy);
}
