//! The example for eframe, whose source is compiled here as it stands, so that it goes with the widget. No
//! test builds eframe itself: what the example uses of that is declared in its place.

/// As much of eframe 0.37 as the example names.
pub(crate) mod stand_in {
    use std::error::Error;
    use std::marker::PhantomData;

    type Fault = Box<dyn Error + Send + Sync>;
    type Creator = Box<dyn FnOnce(&CreationContext<'_>) -> std::result::Result<Box<dyn App>, Fault>>;

    pub(crate) type Result<T = (), E = Fault> = std::result::Result<T, E>;

    #[derive(Default)]
    pub(crate) enum Renderer {
        #[default]
        Wgpu,
    }

    #[derive(Default)]
    pub(crate) struct NativeOptions {
        pub(crate) renderer: Renderer,
        pub(crate) centered: bool,
    }

    pub(crate) struct CreationContext<'s> {
        pub(crate) wgpu_render_state: Option<egui_wgpu::RenderState>,
        storage: PhantomData<&'s ()>,
    }

    pub(crate) struct Frame;

    pub(crate) trait App {
        fn ui(&mut self, ui: &mut egui::Ui, frame: &mut Frame);
    }

    /// Makes the program, which has no window to be shown in.
    pub(crate) fn run_native(_: &str, options: NativeOptions, creator: Creator) -> Result {
        let _of_the_window = options;
        creator(&CreationContext { wgpu_render_state: None, storage: PhantomData }).map(drop)
    }
}

#[path = "../../../../examples/eframe/src/main.rs"]
mod example;
