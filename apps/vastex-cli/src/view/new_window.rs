//! A window before anything is in it.

use std::sync::Arc;

use anyhow::{Result, anyhow};
use vastex_viewer::Remembered;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
use winit::window::Window;

use super::screen_reader::{self, Reader};
use super::{Message, events, remembered};

/// Opens it: as large as is `asked`, or as before, or as is `usual`; where it was before, if one there would
/// be seen.
pub(super) fn open(
    events: &ActiveEventLoop,
    (asked, usual): (Option<[u32; 2]>, [u32; 2]),
    before: &Remembered,
    proxy: &EventLoopProxy<Message>,
) -> Result<(Arc<Window>, Reader)> {
    let [width, height] = asked.or(before.size).unwrap_or(usual);
    let mut attributes = Window::default_attributes()
        .with_title("vastex")
        .with_inner_size(PhysicalSize::new(width, height))
        .with_min_inner_size(PhysicalSize::new(64, 64))
        .with_maximized(asked.is_none() && before.is_maximized);
    if let Some([x, y]) = remembered::position_on_a_screen(before, events) {
        attributes = attributes.with_position(PhysicalPosition::new(x, y));
    }
    let made = screen_reader::create_window(events, attributes, proxy);
    let (window, reader) = made.map_err(|error| {
        let why = events::without_place(&error.to_string()).to_owned();
        anyhow!("no window can be opened; draw to a file with `vastex render`: {why}")
    })?;
    Ok((Arc::new(window), reader))
}
