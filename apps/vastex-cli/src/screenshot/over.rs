//! What lies over the picture in the window but for its panel, painted over a picture without one, row of
//! parts by row of parts: what the machine does, titles of panes, the line of a comparison, and guides.

use anyhow::Result;
use vastex_scenes::{Gpu, Offscreen, Overlay, Picture, Pose};
use vastex_viewer::hud::{Hud, HudData, MachineThumbnail};
use vastex_viewer::overlay::SmallOverlay;
use vastex_viewer::panels::{ImageView, Minimap, Panes, swipe_line};
use vastex_viewer::stage::LinearTarget;
use vastex_viewer::surface_scene::Guided;

use super::paint::{FORMAT, OverPainter};
use super::{Shot, Sources};
use crate::parts::Part;

/// What lies over the picture of a shot.
pub(super) struct Over<'a> {
    shot: &'a Shot,
    gpu: &'a Gpu,
    sources: &'a Sources,
    painter: OverPainter<'a>,
    panes: Panes,
    titles: Vec<String>,
    view: ImageView,
    can_compare: bool,
    hud: Hud,
    /// Of each pane.
    minimaps: Vec<Minimap>,
    /// What the machine did when the first row was drawn, which all rows show; and pictures of it.
    told: Option<HudData>,
    machine: Vec<SmallOverlay>,
}

impl<'a> Over<'a> {
    /// Of a picture that `drawn` draws, before any of it is.
    pub(super) fn new(
        shot: &'a Shot,
        gpu: &'a Gpu,
        drawn: &Offscreen,
        pose: Pose,
        sources: &'a Sources,
    ) -> Over<'a> {
        let layers = drawn.renderer().layers();
        let panes = drawn.renderer().panes_in(shot.size);
        let name = |layer: vastex::LayerId| {
            let texture = drawn.textures().texture(layer.texture()).ok();
            texture.and_then(|texture| texture.name().map(str::to_owned)).unwrap_or_default()
        };
        let titles = match panes.count {
            0 | 1 => Vec::new(),
            _ => layers.in_panes().map(|shown| name(shown.layer)).collect(),
        };
        Over {
            painter: OverPainter::new(gpu, shot.size, shot.pixels_per_point),
            view: ImageView {
                pose,
                picture: [panes.width, shot.size[1]],
                image: sources.lowest.size,
                left: panes.left,
            },
            can_compare: layers.can_compare(),
            panes,
            titles,
            shot,
            gpu,
            sources,
            hud: Hud::default(),
            minimaps: (0..panes.count).map(|_| Minimap::default()).collect(),
            told: None,
            machine: Vec::new(),
        }
    }

    /// Paints what lies over these parts, which make up a row that was drawn.
    pub(super) fn paint(&mut self, drawn: &Offscreen, parts: &[Part], row: &mut Picture) -> Result<()> {
        if self.shot.has_hud && self.told.is_none() {
            self.ask_machine(drawn);
        }
        let Over { shot, sources, panes, titles, view, hud, minimaps, told, can_compare, .. } = self;
        let mut compare_mode = shot.options.compare_mode;
        self.painter.run(|ui| {
            if let Some(told) = told {
                // Nobody is there to change anything.
                drop(hud.show(ui, told));
            }
            let all = ui.available_rect_before_wrap();
            let free = |pane: u32| panes.rect(pane, all, ui.pixels_per_point());
            panes.paint(ui.painter(), all, titles, None);
            if shot.overlay.is_some() {
                return;
            }
            if *can_compare {
                swipe_line(ui.ctx(), free(0), view.picture[0], &mut compare_mode);
            }
            if shot.has_guides {
                let guided = Guided {
                    textures: drawn.textures(),
                    renderer: drawn.renderer(),
                    view,
                    texel_size: sources.about.texel_size.as_ref(),
                    shapes: sources.shapes.as_ref(),
                    is_settled: true,
                    is_seen: true,
                };
                for (pane, minimap) in (0..).zip(minimaps.iter_mut()) {
                    guided.show(ui, pane, free(pane), minimap);
                }
            }
            for (measure, pane) in
                shot.measure.iter().flat_map(|measure| (0..panes.count).map(move |n| (measure, n)))
            {
                let view = ImageView { left: panes.first(pane), ..*view };
                measure.paint(ui.painter(), free(pane), &view, sources.about.texel_size.as_ref());
            }
        });
        self.painter.paint(parts, row)
    }

    /// Has told what the machine does, and draws pictures of it.
    fn ask_machine(&mut self, drawn: &Offscreen) {
        let mut data = HudData::of(drawn.textures());
        data.overlay = self.shot.overlay;
        // They are drawn by pipelines of the scene, into pictures like its own.
        let format = match drawn.renderer().format() {
            LinearTarget::FORMAT => FORMAT,
            format => format,
        };
        for overlay in [Overlay::Table, Overlay::Atlas] {
            let small = SmallOverlay::new(self.gpu, drawn.textures(), drawn.renderer(), overlay, format);
            let Ok(mut small) = small else { continue };
            if small.draw(self.gpu, drawn.textures(), drawn.renderer(), &drawn.pose()).is_ok() {
                let picture = self.painter.register(small.view());
                data.thumbnails.push(MachineThumbnail { overlay, picture, size: small.size() });
                self.machine.push(small);
            }
        }
        self.told = Some(data);
    }
}
