//! The panel of the window under the hands of a person.

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use super::super::{Bookmark, FileBands, PanelTexture, ShownTextures, unnamed};
use super::*;
use crate::layers::CompareMode;
use crate::surface::LayerOptions;
use crate::view_text::ViewText;

struct Window {
    panel: WindowPanel,
    bookmarks: Vec<Bookmark>,
    textures: Vec<PanelTexture>,
    compare_mode: CompareMode,
    shown: Vec<LayerOptions>,
    notice: Option<&'static str>,
    images: Vec<(String, std::ffi::OsString)>,
    asked: Vec<WindowAsked>,
}

fn bands() -> FileBands {
    let names = ["1 coastal", "2", "3", "4 red"].map(str::to_owned).to_vec();
    FileBands { file: "a.tif".into(), names, shown: vec![1, 2, 3] }
}

fn window(notice: Option<&'static str>) -> Harness<'static, Window> {
    let layers = vec![vastex::Layer::new("color", vastex::LayerFormat::R16)];
    let textures = vec![PanelTexture { name: "a.png".to_owned(), layers }];
    let window = Window {
        panel: WindowPanel::default(),
        bookmarks: Vec::new(),
        textures,
        compare_mode: CompareMode::Off,
        shown: Vec::new(),
        notice,
        images: vec![("first".to_owned(), "a.svs".into()), ("label".to_owned(), "a.svs:label".into())],
        asked: Vec::new(),
    };
    let show = |ui: &mut Ui, window: &mut Window| {
        let Window { panel, bookmarks, textures, compare_mode, shown, notice, images, asked } = window;
        let texture = Some(ShownTextures { textures, shown, compare_mode, placement: None, histogram: None });
        let mut told = WindowStatus {
            name: "a.png",
            opening: Some(("b.png", 0.25)),
            notice: *notice,
            below: Some("3, 4   255 0 7   level 2"),
            panes: 1,
            scene: Scene::Image,
            position: (Pose::first(Scene::Image), [1000, 500]),
            texel_size: None,
            map: None,
            bands: Some(&bands()),
            rows: &[("size".to_owned(), "1000 x 500 texels".to_owned())],
            images,
            planet: None,
            texture,
            recent: &[],
            bookmarks,
        };
        asked.extend(panel.show(ui, &mut told).0);
    };
    Harness::builder().with_size([800.0, 1000.0]).build_ui_state(show, window)
}

fn click(harness: &mut Harness<'_, Window>, label: &str) {
    harness.get_by_label(label).click();
    harness.run();
}

#[test]
fn the_ground_is_chosen_and_by_default_goes_with_the_theme() {
    use crate::layers::Ground;

    let mut harness = window(None);
    click(&mut harness, "Panel");
    assert_eq!(harness.state().panel.ground.beside(true), Ground::Dark);
    assert_eq!(harness.state().panel.ground.beside(false), Ground::Light);
    click(&mut harness, "Ground");
    click(&mut harness, "chequers");
    assert_eq!(harness.state().panel.ground.beside(true), Ground::Chequers);
}

#[test]
fn a_file_is_asked_for_by_its_path() {
    let mut harness = window(None);
    assert!(harness.query_by_label("Open").is_none(), "closed at first");
    click(&mut harness, "Panel");
    click(&mut harness, "Open");
    assert_eq!(harness.state().asked, [], "nothing is written");
    harness.get_by_label("Path").focus();
    harness.run();
    harness.get_by_label("Path").type_text("/of/moon.tif ");
    harness.run();
    harness.key_press(egui::Key::Enter);
    harness.run();
    assert_eq!(harness.state().asked, [WindowAsked::Open("/of/moon.tif".into())]);
    click(&mut harness, "Lay over");
    assert_eq!(harness.state().asked[1..], [WindowAsked::LayOver("/of/moon.tif".into())]);
    harness.state_mut().asked.truncate(1);
    for (label, asked) in [
        ("Open…", WindowAsked::Choose),
        ("Open folder…", WindowAsked::ChooseFolder),
        ("Lay over a file…", WindowAsked::ChooseOver),
        ("label", WindowAsked::Open("a.svs:label".into())),
        ("Next", WindowAsked::File(1)),
        ("globe", WindowAsked::Scene(Scene::Globe)),
        ("Show all", WindowAsked::Fit),
    ] {
        click(&mut harness, label);
        assert_eq!(harness.state().asked.last(), Some(&asked));
    }
    click(&mut harness, "About this file");
    assert!(harness.query_by_label("1000 x 500 texels").is_some());
    click(&mut harness, "Hide");
    assert!(!harness.state().panel.is_open());
}

/// A stack in TIFF is shown page by page, and is a volume as well.
#[test]
fn a_stack_is_asked_for_as_a_volume_by_a_click() {
    let mut harness = window(None);
    let ways = [("as a volume", "a.tif:volume"), ("first", "a.tif:first"), ("image 2", "a.tif:image 2")];
    harness.state_mut().images = ways.map(|(name, path)| (name.to_owned(), path.into())).into();
    click(&mut harness, "Panel");
    for (label, path) in ways {
        click(&mut harness, label);
        assert_eq!(harness.state().asked.last(), Some(&WindowAsked::Open(path.into())), "{label}");
    }
    assert_eq!(harness.state().asked.len(), ways.len());
}

/// Where the system has no dialog.
#[test]
fn the_field_for_a_path_is_offered_with_the_keys_in_it() {
    let mut harness = window(None);
    harness.run();
    assert!(harness.query_by_label("Path").is_none());
    harness.state_mut().panel.ask_for_path();
    harness.run();
    assert!(harness.get_by_label("Path").is_focused());
    harness.get_by_label("Path").type_text("/of/moon.tif");
    harness.run();
    harness.key_press(egui::Key::Enter);
    harness.run();
    assert_eq!(harness.state().asked, [WindowAsked::Open("/of/moon.tif".into())]);
    // Once; after that the keys go where a person has them.
    harness.get_by_label("View").focus();
    harness.run();
    assert!(!harness.get_by_label("Path").is_focused());
}

#[test]
fn what_a_file_says_of_itself_is_shown_at_once() {
    let mut harness = window(None);
    harness.state_mut().panel.show_about();
    harness.run();
    assert!(harness.query_by_label("1000 x 500 texels").is_some());
}

/// The panel and what the machine does, in a window of so many points.
fn beside_the_machine(width: f32) -> Harness<'static, (WindowPanel, bool, f32)> {
    let panel = WindowPanel::default();
    let show = |ui: &mut Ui, (panel, machine_is_shown, left): &mut (WindowPanel, bool, f32)| {
        if panel.leaves_room_beside(ui, *machine_is_shown) && *machine_is_shown {
            let machine = egui::Panel::left("hud").resizable(false).exact_size(crate::hud::Hud::WIDTH);
            machine.show(ui, |ui| ui.label("what the machine does"));
        }
        let mut told = WindowStatus {
            name: "a.png",
            opening: Some(("b.png", 0.25)),
            notice: None,
            below: None,
            panes: 1,
            scene: Scene::Image,
            position: (Pose::first(Scene::Image), [1000, 500]),
            texel_size: None,
            map: None,
            bands: None,
            rows: &[],
            images: &[],
            planet: None,
            texture: None,
            recent: &[],
            bookmarks: &[],
        };
        panel.show(ui, &mut told);
        *left = ui.available_width();
    };
    Harness::builder().with_size([width, 400.0]).build_ui_state(show, (panel, false, 0.0))
}

#[test]
fn a_narrow_window_shows_of_the_panel_and_the_machine_what_was_asked_for_last() {
    for (width, has_room_for_both) in [(640.0, false), (800.0, false), (900.0, true)] {
        let mut harness = beside_the_machine(width);
        let mut seen = |change: &dyn Fn(&mut WindowPanel, &mut bool)| {
            let (panel, machine, _) = harness.state_mut();
            change(panel, machine);
            harness.run();
            let has = |label: &str| harness.query_by_label(label).is_some();
            let found = (has("Path"), has("what the machine does"));
            assert!(harness.state().2 >= 200.0, "the picture has room: {}", harness.state().2);
            // The button that opens the panel is there where that is not seen.
            assert_ne!(has("Path"), has("Panel"));
            found
        };
        assert_eq!(seen(&|panel, _| panel.open_or_close()), (true, false));
        let ask_machine = |panel: &mut WindowPanel, is_shown: &mut bool| {
            *is_shown = true;
            panel.machine_comes();
        };
        assert_eq!(seen(&ask_machine), (has_room_for_both, true));
        assert_eq!(seen(&|panel, _| panel.open()), (true, has_room_for_both));
        assert_eq!(seen(&ask_machine), (has_room_for_both, true));
        // It comes back once there is room.
        assert_eq!(seen(&|_, is_shown| *is_shown = false), (true, false));
        assert_eq!(seen(&|panel, _| panel.open_or_close()), (false, false));
    }
    let mut harness = beside_the_machine(640.0);
    let (panel, machine, _) = harness.state_mut();
    (panel.is_open, *machine) = (true, true);
    panel.machine_comes();
    harness.run();
    harness.get_by_label("Panel").click();
    harness.run();
    assert!(harness.query_by_label("Path").is_some(), "its button brings the panel back");
    assert!(harness.state().0.hides_machine());
}

/// What was open when a window was closed does not hide the picture of the next one.
#[test]
fn a_window_too_narrow_for_either_shows_the_picture_until_one_is_asked_for() {
    let mut harness = beside_the_machine(480.0);
    let before = Remembered { panel_is_open: true, ..Remembered::default() };
    let (panel, machine, _) = harness.state_mut();
    panel.show_as_before(&before);
    *machine = true;
    let seen = |harness: &mut Harness<'_, (WindowPanel, bool, f32)>| {
        harness.run();
        let has = |label: &str| harness.query_by_label(label).is_some();
        (has("Path"), has("what the machine does"))
    };
    assert_eq!(seen(&mut harness), (false, false));
    assert!(harness.state().0.hides_machine());
    harness.get_by_label("Panel").click();
    assert_eq!(seen(&mut harness), (true, false));
    harness.state_mut().0.machine_comes();
    assert_eq!(seen(&mut harness), (false, true));
    harness.state_mut().0.open_or_close();
    assert_eq!(seen(&mut harness), (true, false));
    // Once it was wider that counts no more.
    harness.set_size([900.0, 400.0].into());
    assert_eq!(seen(&mut harness), (true, true));
    harness.set_size([480.0, 400.0].into());
    assert_eq!(seen(&mut harness), (false, false));
    harness.set_size([560.0, 400.0].into());
    assert_eq!(seen(&mut harness), (true, false));
}

#[test]
fn other_bands_are_asked_for() {
    let mut harness = window(None);
    click(&mut harness, "Panel");
    assert!(harness.query_by_label("4 bands").is_some());
    harness.get_by_label("Red band").click();
    harness.run();
    click(&mut harness, "4 red");
    assert_eq!(harness.state().asked, [WindowAsked::OpenBands("a.tif".into(), vec![4, 2, 3])]);
    click(&mut harness, "one");
    assert_eq!(harness.state().asked[1..], [WindowAsked::OpenBands("a.tif".into(), vec![1])]);
}

#[test]
fn what_there_is_to_say_is_said_in_the_window() {
    let mut harness = window(Some("the file ends in the middle of a tile"));
    harness.run();
    assert!(harness.query_by_label("the file ends in the middle of a tile").is_some());
    assert!(harness.query_by_label_contains("opening b.png – 25 %").is_some());
    click(&mut harness, "Panel");
    click(&mut harness, "Keys");
    assert!(harness.query_by_label("Keys and gestures").is_some());
}

#[test]
fn a_view_is_written_kept_and_gone_back_to() {
    let mut harness = window(None);
    click(&mut harness, "Panel");
    let first = "image:x=500,y=250,zoom=1";
    assert_eq!(harness.get_by_label("View").value().as_deref(), Some(first));
    click(&mut harness, "Keep view");
    click(&mut harness, "Copy view");
    click(&mut harness, "Copy link");
    assert_eq!(
        harness.state().asked,
        [WindowAsked::Keep(String::new()), WindowAsked::CopyView, WindowAsked::CopyLink]
    );
    harness.state_mut().asked.clear();
    // The host says all that is shown.
    let view = format!("{first};layer=:gamma=0.5");
    let bookmark = Bookmark { name: String::new(), view: view.clone() };
    harness.state_mut().bookmarks.push(bookmark);
    harness.run();
    click(&mut harness, first);
    let view = ViewText::from_text(&view, [1000, 500]).unwrap();
    assert_eq!(harness.state().asked, [WindowAsked::Show(Box::new(view))]);
    let all = egui::Modifiers::COMMAND;
    for (text, asked) in [("100,2000", None), ("100,200", Some([0.1005, 0.401]))] {
        harness.get_by_label("View").focus();
        harness.run();
        harness.key_press_modifiers(all, egui::Key::A);
        harness.run();
        harness.get_by_label("View").type_text(text);
        harness.run();
        assert_eq!(harness.get_by_label("View").value().as_deref(), Some(text));
        harness.key_press(egui::Key::Enter);
        harness.run();
        let asked = asked.map(|centre| WindowAsked::Go(Pose::image(centre.into(), 1.0)));
        assert_eq!(harness.query_by_label_contains("lies beside the image").is_some(), asked.is_none());
        assert_eq!(harness.state().asked.get(1), asked.as_ref(), "{text}");
    }
    assert!(harness.state().panel.guides_are_shown());
    click(&mut harness, "Guides");
    assert!(!harness.state().panel.guides_are_shown());
}

#[test]
fn every_control_has_a_name_and_the_keyboard_reaches_them() {
    let mut harness = window(None);
    assert_eq!(unnamed(&harness.root()), Vec::<String>::new());
    click(&mut harness, "Panel");
    assert_eq!(unnamed(&harness.root()), Vec::<String>::new());
    harness.key_press(egui::Key::Tab);
    harness.run();
    assert!(harness.get_by_label("Open…").is_focused());
    harness.key_press(egui::Key::Tab);
    harness.run();
    assert!(harness.get_by_label("Previous").is_focused());
    harness.key_press(egui::Key::Space);
    harness.run();
    assert_eq!(harness.state().asked, [WindowAsked::File(-1)]);
}

#[test]
fn the_theme_is_chosen_and_remembered() {
    let mut harness = window(None);
    let before = Remembered { panel_is_open: true, guides_are_hidden: true, ..Remembered::default() };
    harness.state_mut().panel.show_as_before(&before);
    harness.run();
    assert!(harness.state().panel.is_open() && !harness.state().panel.guides_are_shown());
    for (name, theme) in [("light", ThemePreference::Light), ("dark", ThemePreference::Dark)] {
        click(&mut harness, name);
        assert_eq!(harness.ctx.options(|options| options.theme_preference), theme);
    }
}

/// Where guides are hidden and the panel is closed the picture is alone, until values are asked for.
#[test]
fn values_are_shown_where_they_are_asked_for() {
    let mut panel = WindowPanel::default();
    let are_seen = |panel: &WindowPanel| panel.values_are_shown() && panel.values_have_place();
    assert!(are_seen(&panel));
    panel.show_or_hide_guides();
    assert!(!are_seen(&panel));
    for is_seen in [true, false, true] {
        panel.show_or_hide_values(false);
        assert_eq!(are_seen(&panel), is_seen);
    }
    (0..2).for_each(|_| panel.show_or_hide_guides());
    assert!(!are_seen(&panel), "guides are hidden again");
    // They are seen where they have their place in any case, and so are hidden.
    panel.show_or_hide_values(true);
    assert!(!panel.values_are_shown());
}

/// Where dropped files do not arrive, the list of keys names the ways that there are.
#[test]
fn the_list_of_keys_says_how_to_open_files_where_none_can_be_dropped() {
    let told = |lacks_drops: bool| {
        let mut harness = window(None);
        harness.state_mut().panel.lacks_drops = lacks_drops;
        harness.state_mut().panel.show_or_hide_keys();
        harness.run();
        let says = |text: &str| harness.query_by_label(text).is_some();
        assert!(says("dropped files") && says("previous file"));
        says(WITHOUT_DROPS)
    };
    assert!(told(true) && !told(false));
}
