// Feedback has a pass of its own, so the main pass reports nothing.

fn vastex_asked(view: u32, position: vec4<f32>) -> bool {
    return false;
}

fn vastex_report(view: u32, position: vec4<f32>, wanted: vec4<u32>) {
}
