//! Why a pixel shows what it shows, as `render --explain` and a right click in `view` tell it.

use serde::Serialize;
use vastex::Dims;
use vastex::diagnostics::{Explanation, PageState};

/// What is told of a pixel. Scripts rely on these names.
#[derive(Serialize)]
pub(crate) struct Explained {
    /// Column and row in the picture.
    pixel: [u32; 2],
    /// What it wants; empty if it shows no texture.
    pages: Vec<ExplainedPage>,
}

#[derive(Serialize)]
struct ExplainedPage {
    texture: u16,
    pool: u16,
    /// The page wanted at mip bias 0.
    wanted: Page,
    /// How far into its level, in levels.
    wanted_fraction: f64,
    /// Levels.
    mip_bias: f64,
    /// The page wanted at that bias.
    at_bias: Page,
    /// The finest resident page that covers it.
    shown: Page,
    state: &'static str,
    /// The same for people, with what it waits for and what has happened to it.
    text: String,
}

#[derive(Serialize)]
struct Page {
    level: u8,
    x: u32,
    y: u32,
    /// Of bricks of volumes alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    z: Option<u32>,
}

impl Explained {
    pub(crate) fn new(pixel: [u32; 2], explained: &[Explanation]) -> Explained {
        Explained { pixel, pages: explained.iter().map(ExplainedPage::new).collect() }
    }

    /// The most important of it, on one line.
    #[cfg(feature = "view")]
    pub(crate) fn line(&self) -> String {
        let [x, y] = self.pixel;
        let Some(page) = self.pages.first() else {
            return format!("pixel {x},{y}: no texture is seen there");
        };
        let said: Vec<&str> = page.text.lines().take(2).collect();
        let said = said.join(", ");
        format!("pixel {x},{y} {}", said.split_once(": ").map_or(said.as_str(), |(_, said)| said))
    }

    pub(crate) fn text(&self) -> String {
        let [x, y] = self.pixel;
        let mut text = format!("pixel {x},{y}");
        match self.pages.as_slice() {
            [] => text += ": no texture is seen there",
            pages => pages.iter().for_each(|page| text += &format!("\n{}", page.text)),
        }
        text
    }
}

impl ExplainedPage {
    fn new(explanation: &Explanation) -> ExplainedPage {
        let page = |page: vastex::PageId| {
            let pos = page.pos(explanation.dims);
            let z = (explanation.dims == Dims::D3).then_some(pos.z);
            Page { level: pos.level, x: pos.x, y: pos.y, z }
        };
        let wanted = explanation.wanted;
        ExplainedPage {
            texture: wanted.page.texture().number(),
            pool: explanation.pool.number(),
            wanted: page(wanted.page),
            wanted_fraction: f64::from(wanted.eighth) / 8.0,
            mip_bias: f64::from(explanation.bias_eighths) / 8.0,
            at_bias: page(explanation.at_bias),
            shown: page(explanation.shown),
            state: match explanation.state {
                PageState::Absent => "absent",
                PageState::Queued => "queued",
                PageState::Loading => "loading",
                PageState::Ready => "ready",
                PageState::Resident(_) => "resident",
                PageState::Failed { .. } => "failed",
            },
            text: explanation.to_string(),
        }
    }
}
