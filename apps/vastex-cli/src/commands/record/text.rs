//! Feedback, traces and geometries as lines.

use std::fmt::Write;
use std::sync::Arc;

use vastex::prefetch::Trace;
use vastex::{AddressMode, Geometry, PageId};
use vastex_core::{Dims, WantedPage};

/// `texture:level/x,y`, with `,z` in volumes.
pub(super) fn of_page(page: PageId, dims: Dims) -> String {
    let pos = page.pos(dims);
    let deep = if dims == Dims::D3 { format!(",{}", pos.z) } else { String::new() };
    format!("{}:{}/{},{}{deep}", page.texture().number(), pos.level, pos.x, pos.y)
}

/// A line for each page: `PAGE xPIXELS +EIGHTHS`. `geometries` are those of the textures, by number.
pub(super) fn of_pages(pages: &[WantedPage], geometries: &[Arc<Geometry>]) -> String {
    let line = |wanted: &WantedPage| {
        let geometry = geometries.get(usize::from(wanted.page.texture().number()));
        let dims = geometry.map_or(Dims::D2, |geometry| geometry.dims());
        format!("{} x{} +{}\n", of_page(wanted.page, dims), wanted.pixels, wanted.eighth)
    };
    pages.iter().map(line).collect()
}

pub(super) fn of_trace(trace: &Trace) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    for (number, geometry) in trace.geometries().iter().enumerate() {
        let _ = write!(text, "texture {number}\n{}", of_geometry(geometry));
    }
    for (number, (pages, place)) in trace.frames().iter().zip(trace.camera_positions()).enumerate() {
        let _ = match place {
            Some([x, y, z]) => writeln!(text, "frame {number} at {x},{y},{z}"),
            None => writeln!(text, "frame {number}"),
        };
        text.push_str(&of_pages(pages, trace.geometries()));
    }
    text
}

fn of_geometry(geometry: &Geometry) -> String {
    let mut text = String::new();
    let triple = |[x, y, z]: [u32; 3]| format!("{x}x{y}x{z}");
    let _ = writeln!(text, "page {} border {}", triple(geometry.page()), triple(geometry.border()));
    let address = geometry.address().map(|mode| match mode {
        AddressMode::Clamp => "clamp",
        AddressMode::Wrap => "wrap",
        AddressMode::Mirror => "mirror",
        AddressMode::Border => "border",
    });
    let _ = writeln!(text, "address {}", address.join(","));
    for (number, level) in geometry.levels().iter().enumerate() {
        let _ = writeln!(text, "level {number} size {} pages {}", triple(level.size), triple(level.pages));
    }
    let tail = geometry.tail_pos();
    let _ = writeln!(text, "tail from level {}", tail.level);
    text
}
