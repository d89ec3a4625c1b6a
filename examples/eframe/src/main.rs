//! An image that is larger than any texture, in a window of eframe: pixels in memory, and one widget to look
//! at them.

use std::sync::Arc;

use eframe::egui;
use vastex::{ImageSource, Settings, TextureSettings};
use vastex_viewer::widget::VastexImage;

/// Columns and rows: more than a texture may have on most graphics cards.
const SIZE: [u32; 2] = [24_000, 12_000];

fn main() -> eframe::Result {
    let options = eframe::NativeOptions { renderer: eframe::Renderer::Wgpu, ..Default::default() };
    eframe::run_native("An image of any size", options, Box::new(|context| Ok(Box::new(App::new(context)?))))
}

struct App {
    image: VastexImage,
}

impl App {
    fn new(context: &eframe::CreationContext<'_>) -> Result<App, Box<dyn std::error::Error + Send + Sync>> {
        let state = context.wgpu_render_state.as_ref().ok_or("eframe does not draw by wgpu")?;
        let mut image = VastexImage::new(state, Settings::default())?;
        let source = Arc::new(ImageSource::rgba8(SIZE[0], SIZE[1], pixels())?);
        image.set_image(image.preparer().read_blocking(source, TextureSettings::default())?)?;
        Ok(App { image })
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        egui::Panel::top("bar").show(ui, |ui| {
            ui.horizontal(|ui| {
                if ui.button("Fit").clicked() {
                    self.image.fit();
                }
                let [width, height] = SIZE;
                ui.label(format!("{width} by {height} texels"));
                let pointer = ui.input(|input| input.pointer.latest_pos());
                if let Some(texel) = pointer.and_then(|pointer| self.image.texel_at(pointer)) {
                    let [column, row] = texel.texel;
                    ui.separator();
                    ui.label(format!("{column},{row}: {:?}", texel.values));
                }
            });
        });
        egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| {
            self.image.show(ui);
        });
    }
}

/// Waves over one another, and a grid with a line for every hundred texels.
fn pixels() -> Vec<u8> {
    let wave = |n: u32, length: f32| 0.5 + 0.5 * (n as f32 / length).sin();
    let columns: Vec<[f32; 3]> =
        (0..SIZE[0]).map(|x| [900.0, 2100.0, 61.0].map(|length| wave(x, length))).collect();
    let mut pixels = Vec::with_capacity(SIZE[0] as usize * SIZE[1] as usize * 4);
    for y in 0..SIZE[1] {
        let row = [1300.0, 700.0, 83.0].map(|length| wave(y, length));
        for (x, column) in (0u32..).zip(&columns) {
            let [red, green, fine] = std::array::from_fn(|n| column[n] * row[n]);
            let line = if x % 100 == 0 || y % 100 == 0 { 0.55 } else { 1.0 };
            let light = [0.2 + 0.8 * red, 0.15 + 0.6 * green, 0.35 + 0.5 * (1.0 - red) + 0.15 * fine];
            pixels.extend(light.map(|light| (255.0 * light.min(1.0) * line) as u8));
            pixels.push(255);
        }
    }
    pixels
}
