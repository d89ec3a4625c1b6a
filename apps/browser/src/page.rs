//! What a page in a browser calls: a container's bytes go in, frames are asked for, pictures come out.

#![allow(unsafe_code, reason = "wasm-bindgen writes the functions that JavaScript calls")]

use wasm_bindgen::prelude::{JsError, wasm_bindgen};

use crate::show::{Drawn, Show};

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = console, js_name = error)]
    fn say(text: &str);
}

/// The pictures of a volume.
#[wasm_bindgen]
pub struct Page(Show);

/// A picture.
#[wasm_bindgen]
pub struct PagePicture(Drawn);

#[wasm_bindgen]
impl Page {
    /// Opens the bytes of a container. What ends the program is said to the console.
    pub async fn open(name: String, container: Vec<u8>) -> Result<Page, JsError> {
        std::panic::set_hook(Box::new(|info| say(&info.to_string())));
        Ok(Page(Show::open(&name, container).await?))
    }

    /// What draws.
    pub fn adapter(&self) -> String {
        self.0.adapter()
    }

    /// Returns true if every picture has been drawn.
    pub fn is_done(&self) -> bool {
        self.0.is_done()
    }

    /// The next frame. The page lets others run between two of them.
    pub fn frame(&mut self) -> Result<Option<PagePicture>, JsError> {
        Ok(self.0.frame()?.map(PagePicture))
    }
}

#[wasm_bindgen]
impl PagePicture {
    /// What it is called.
    pub fn name(&self) -> String {
        self.0.name.to_owned()
    }

    /// Its width in pixels.
    pub fn width(&self) -> u32 {
        self.0.size[0]
    }

    /// How many frames it took, and with how many bricks in GPU memory.
    pub fn cost(&self) -> String {
        format!("{} frames, {} bricks", self.0.frames, self.0.bricks)
    }

    /// Red, green, blue and alpha of each pixel, row by row.
    pub fn pixels(&self) -> Vec<u8> {
        self.0.pixels.clone()
    }
}
