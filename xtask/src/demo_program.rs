//! What of the program the demo compiles; a test keeps the list of crates that this brings in.

/// What cargo is told: no encoder of block-compressed layers, and a window only where there is a display.
pub(crate) fn features(window: bool) -> [&'static str; 3] {
    ["--no-default-features", "--features", if window { "build,view" } else { "build" }]
}
