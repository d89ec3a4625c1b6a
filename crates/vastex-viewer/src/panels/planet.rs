//! A planet's sun, relief, air, lights and clouds, for a person to change.

use std::ops::RangeInclusive;

use egui::{Slider, SliderClamping, Ui};

use crate::surface::{LayerOptions, PlanetLight, PlanetOptions};

/// Shows how a planet is lit and what is seen of its parts, and changes it in place. Returns true if anything
/// is to be another.
pub fn planet_controls(ui: &mut Ui, planet: &mut PlanetOptions) -> bool {
    let before = planet.clone();
    let PlanetOptions { night, clouds, light } = planet;
    let mut is_lit = light.sun.is_some();
    let sun = ui.checkbox(&mut is_lit, "Sun");
    if sun.on_hover_text("without it all of the planet is as light as it can be").changed() {
        light.sun = if is_lit { PlanetLight::default().sun } else { None };
    }
    if let Some([longitude, latitude]) = &mut light.sun {
        let degrees = |ui: &mut Ui, angle: &mut f64, most: f64, name: &str| {
            // One beyond the slider stays until it is moved.
            let slider = Slider::new(angle, -most..=most).clamping(SliderClamping::Edits);
            ui.add(slider.suffix("°").max_decimals(1).text(name));
        };
        degrees(ui, longitude, 180.0, "Sun's longitude");
        degrees(ui, latitude, 90.0, "Sun's latitude");
    }
    number(ui, &mut light.exaggeration, 0.0..=50.0, "Heights", "how many times as high as they are");
    number(ui, &mut light.atmosphere, 0.0..=5.0, "Air", "how dense it is, the Earth's being 1");
    if part(ui, night, "Lights at night") {
        number(ui, &mut light.night, 0.0..=4.0, "Lights", "how bright they are");
    }
    if part(ui, clouds, "Clouds")
        && let Some(clouds) = clouds
    {
        number(ui, &mut clouds.opacity, 0.0..=1.0, "Clouds", "how much of the ground they hide");
    }
    // What is written into a field may be any number.
    planet.light = planet.light.within();
    *planet != before
}

/// A slider for a number, which is taken as it is where it lies beyond.
fn number(ui: &mut Ui, number: &mut f32, range: RangeInclusive<f32>, name: &str, what: &str) {
    let slider = Slider::new(number, range).clamping(SliderClamping::Never).max_decimals(2);
    ui.add(slider.text(name)).on_hover_text(what);
}

/// Returns true if a part is there and seen, which a person may change.
fn part(ui: &mut Ui, layer: &mut Option<LayerOptions>, name: &str) -> bool {
    let Some(layer) = layer else { return false };
    ui.checkbox(&mut layer.is_visible, name);
    layer.is_visible
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;

    fn panel(planet: PlanetOptions) -> Harness<'static, (PlanetOptions, bool)> {
        let show = |ui: &mut Ui, (planet, is_changed): &mut (PlanetOptions, bool)| {
            *is_changed |= planet_controls(ui, planet);
        };
        Harness::builder().with_size([400.0, 400.0]).build_ui_state(show, (planet, false))
    }

    #[test]
    fn suns_and_parts_are_put_out_and_lit_again() {
        let night = Some(LayerOptions { texture: 1, ..LayerOptions::default() });
        let mut harness = panel(PlanetOptions { night, ..PlanetOptions::default() });
        harness.run();
        assert!(!harness.state().1, "nothing changes by being shown");
        assert!(harness.query_by_label("Clouds").is_none(), "there are none");
        harness.get_by_label("Lights at night").click();
        harness.run();
        assert!(harness.state().1 && !harness.state().0.night.as_ref().unwrap().is_visible);
        harness.get_by_label("Sun").click();
        harness.run();
        assert_eq!(harness.state().0.light.sun, None);
        assert!(harness.query_by_label("Sun's longitude").is_none());
        harness.get_by_label("Sun").click();
        harness.run();
        assert_eq!(harness.state().0.light, PlanetLight::default());
    }

    #[test]
    fn numbers_beyond_a_slider_stay_what_they_are() {
        let light = PlanetLight { exaggeration: 200.0, atmosphere: 20.0, ..PlanetLight::default() };
        let mut harness = panel(PlanetOptions { light, ..PlanetOptions::default() });
        harness.run();
        assert_eq!(*harness.state(), (PlanetOptions { light, ..PlanetOptions::default() }, false));
    }
}
