//! What a person chose of how textures are sampled and kept: in the window, which remembers it, or on the
//! command line, which has the last word.

use vastex::{BiasRule, FeedbackMode, Filter, PoolId, Settings, Textures};
use vastex_scenes::{Gpu, LayerOptions};

use super::super::remembered::{KeptPool, Remembered};
use super::Viewer;
use super::pools::{ChosenPools, PoolKind, kinds_of};
use crate::args::SceneArgs;

/// What a person chose, in this run or in an earlier one.
#[derive(Clone, Debug, Default)]
pub(super) struct Chosen {
    /// How texels are blended where layers do not say that themselves.
    filter: Option<Filter>,
    /// How views say what they want.
    feedback: Option<FeedbackMode>,
    /// Bytes copied to the GPU in a frame, and of tiles on their way.
    budgets: [Option<u64>; 2],
    pools: ChosenPools,
    changed: Changed,
}

/// What was chosen in this run, and so is to be remembered.
#[derive(Clone, Debug, Default)]
struct Changed {
    filter: bool,
    feedback: bool,
    budgets: bool,
    sizes: Vec<PoolKind>,
    rules: Vec<PoolKind>,
}

impl Chosen {
    /// What was chosen in earlier runs, as far as the command line and the settings that it names do not say
    /// otherwise.
    pub(super) fn before(before: &Remembered, args: &SceneArgs, settings: &Settings) -> Chosen {
        let (default_pool, rules) = (settings.pools.default_pool, &settings.pools.rules);
        let tunings = || std::iter::once(default_pool).chain(rules.iter().map(|rule| rule.tuning));
        let says_sizes = tunings().any(|tuning| tuning.bytes.is_some() || tuning.allow_size_scale.is_some());
        let says_rules =
            tunings().any(|tuning| tuning.mip_bias_rule.is_some() || tuning.residency_mip_bias.is_some());
        let mut pools = ChosenPools::default();
        for (kind, KeptPool { bytes, rule }) in &before.pools {
            if let Some(bytes) = bytes.filter(|_| !says_sizes) {
                pools.sizes.insert(kind.clone(), bytes);
            }
            if let Some(rule) = rule.filter(|_| !says_rules) {
                pools.rules.insert(kind.clone(), rule.into());
            }
        }
        Chosen {
            filter: before.filter.filter(|_| args.filter.is_none()),
            feedback: before.feedback.filter(|_| args.feedback.is_none()),
            budgets: [
                before.upload_bytes_per_frame.filter(|_| args.upload_kib_per_frame.is_none()),
                before.in_flight_bytes,
            ],
            pools,
            changed: Changed::default(),
        }
    }

    /// Textures with these settings and the mode of feedback that was chosen. Where the device does not have
    /// that, it is left out, and said in a note.
    pub(super) fn textures(
        &mut self,
        gpu: &Gpu,
        settings: Settings,
        notes: &mut Vec<String>,
    ) -> Result<Textures, vastex::Error> {
        let settings = self.budgeted(settings);
        let Some(mode) = self.feedback else { return Textures::new(&gpu.device, &gpu.queue, settings) };
        let asked = Settings { feedback: Some(mode), ..settings.clone() };
        Textures::new(&gpu.device, &gpu.queue, asked).or_else(|error| {
            notes.push(format!("the feedback mode {} of the last window is left out: {error}", mode.name()));
            self.feedback = None;
            Textures::new(&gpu.device, &gpu.queue, settings)
        })
    }

    /// Settings with the budgets that were chosen.
    pub(super) fn budgeted(&self, settings: Settings) -> Settings {
        let [uploads, in_flight] = self.budgets;
        Settings {
            upload_bytes_per_frame: uploads.unwrap_or(settings.upload_bytes_per_frame),
            in_flight_bytes: in_flight.unwrap_or(settings.in_flight_bytes),
            ..settings
        }
    }

    /// The same of a volume, of whose bricks no fewer are on their way than it needs.
    #[cfg(feature = "volumes")]
    pub(super) fn budgeted_for_volume(&self, settings: Settings) -> Settings {
        let least = settings.in_flight_bytes;
        let budgeted = self.budgeted(settings);
        Settings { in_flight_bytes: budgeted.in_flight_bytes.max(least), ..budgeted }
    }

    /// What is to be remembered, of what was before and what was chosen in this run.
    pub(super) fn remembered(&self, before: &Remembered) -> Remembered {
        let mut window = before.clone();
        if self.changed.filter {
            window.filter = self.filter;
        }
        if self.changed.feedback {
            window.feedback = self.feedback;
        }
        if self.changed.budgets {
            [window.upload_bytes_per_frame, window.in_flight_bytes] = self.budgets;
        }
        for kind in &self.changed.sizes {
            window.pools.entry(kind.clone()).or_default().bytes = self.pools.sizes.get(kind).copied();
        }
        for kind in &self.changed.rules {
            let rule = self.pools.rules.get(kind).map(|rule| (*rule).into());
            window.pools.entry(kind.clone()).or_default().rule = rule;
        }
        window.pools.retain(|_, pool| !pool.is_empty());
        window
    }

    /// What was chosen of pools.
    pub(super) fn pools(&self) -> &ChosenPools {
        &self.pools
    }

    /// Texels are blended so from here on; by what suits the magnification where no filter is named.
    pub(super) fn set_filter(&mut self, filter: Option<Filter>) {
        (self.filter, self.changed.filter) = (filter, true);
    }

    /// Views say so what they want from here on.
    pub(super) fn set_feedback(&mut self, mode: FeedbackMode) {
        (self.feedback, self.changed.feedback) = (Some(mode), true);
    }

    /// So many bytes are copied to the GPU in a frame, and are of tiles on their way, from here on.
    pub(super) fn set_budgets(&mut self, budgets: [u64; 2]) {
        (self.budgets, self.changed.budgets) = (budgets.map(Some), true);
    }

    /// A pool has a size of its own from here on, or follows the picture.
    pub(super) fn set_size(&mut self, kind: PoolKind, bytes: Option<u64>) {
        match bytes {
            Some(bytes) => drop(self.pools.sizes.insert(kind.clone(), bytes)),
            None => drop(self.pools.sizes.remove(&kind)),
        }
        self.changed.sizes.push(kind);
    }

    /// The mip bias of a pool is decided so from here on; nothing for never one.
    pub(super) fn set_rule(&mut self, kind: PoolKind, rule: Option<BiasRule>) {
        self.pools.rules.insert(kind.clone(), rule);
        self.changed.rules.push(kind);
    }

    /// A pool cannot have the size that was chosen. It stays remembered: another device may have the memory.
    fn give_size_up(&mut self, kind: &PoolKind) {
        self.pools.sizes.remove(kind);
        self.changed.sizes.retain(|changed| changed != kind);
    }

    /// The layers that are shown first of so many textures, with the filter that was chosen where they name
    /// none.
    pub(super) fn filtered(&self, mut layers: Vec<LayerOptions>, textures: usize) -> Vec<LayerOptions> {
        if self.filter.is_none() {
            return layers;
        }
        if layers.is_empty() {
            layers = (0..textures).map(first_of).collect();
        }
        layers.iter_mut().for_each(|layer| layer.filter = layer.filter.or(self.filter));
        layers
    }
}

/// The first layer of a texture, as it is.
pub(super) fn first_of(texture: usize) -> LayerOptions {
    LayerOptions { texture, ..LayerOptions::default() }
}

impl Viewer {
    /// The window is as it was when it was closed last.
    pub(in super::super) fn show_as_before(&mut self, before: &Remembered) {
        self.panel.show_as_before(before);
        self.shell.set_theme(before.theme);
        self.hud.show_as_before(before.hud_is_shown);
    }

    /// Tells what of that could not be had.
    pub(in super::super) fn note_left_out(&mut self, notes: &[String]) {
        for note in notes {
            crate::report::say(&format!("note: {note}"));
            self.note(note);
        }
    }

    /// The same with what is shown in the window now, and what was chosen there.
    pub(in super::super) fn remembered(&self, window: &Remembered) -> Remembered {
        Remembered {
            panel_is_open: self.panel.is_open(),
            guides_are_hidden: !self.panel.guides_are_shown(),
            values_are_hidden: !self.panel.values_are_shown(),
            hud_is_shown: self.hud.is_shown(),
            theme: self.shell.theme(),
            ground: self.panel.ground,
            ..self.chosen.remembered(window)
        }
    }

    /// What a pool is, if it has a texture.
    pub(super) fn kind_of_pool(&self, pool: PoolId) -> Option<PoolKind> {
        kinds_of(&self.textures).remove(&pool)
    }

    /// Pools have the sizes and rules again that a person chose.
    pub(super) fn change_pools_again(&mut self) {
        for (kind, error) in self.chosen.pools.give(&mut self.textures) {
            // It is said once.
            self.chosen.give_size_up(&kind);
            self.notify(&format!("a pool of {kind} keeps its size: {error}"));
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;
    use vastex_scenes::headless_gpu;

    use super::super::super::remembered::KeptRule;
    use super::*;
    use crate::args::{Args, Command};
    use crate::commands::render;

    const KIND: &str = "136x136 r16";

    fn before() -> Remembered {
        let pool = KeptPool { bytes: Some(3 << 20), rule: Some(KeptRule::Never) };
        Remembered {
            filter: Some(Filter::Bicubic),
            feedback: Some(FeedbackMode::Raw),
            upload_bytes_per_frame: Some(3 << 20),
            in_flight_bytes: Some(5 << 20),
            pools: [(KIND.to_owned(), pool)].into(),
            ..Remembered::default()
        }
    }

    fn chosen(words: &str) -> Chosen {
        let words = format!("vastex view {words} a.vastex");
        let Command::View(args) = Args::parse_from(words.split(' ')).command else { panic!("{words}") };
        Chosen::before(&before(), &args.scene, &render::settings(&args.scene).unwrap())
    }

    #[test]
    fn the_command_line_has_the_last_word_and_what_it_does_not_say_is_as_before() {
        let directory = tempfile::tempdir().unwrap();
        let settings = |name: &str, text: &str| {
            let place = directory.path().join(name);
            std::fs::write(&place, text).unwrap();
            format!("--settings {}", place.display())
        };
        let sizes = settings("sizes.toml", "[default_pool]\nsize_mib = 64\n");
        let rules = settings("rules.toml", "[default_pool]\nmip_bias_rule = \"integrating\"\n");
        let all = (Some(Filter::Bicubic), Some(FeedbackMode::Raw), true, true);
        let (filter, feedback, ..) = all;
        for (words, expected) in [
            ("--fade-ms 0", all),
            ("--filter nearest", (None, feedback, true, true)),
            // The default is as good as any other where somebody asks for it.
            ("--filter trilinear", (None, feedback, true, true)),
            ("--feedback separate", (filter, None, true, true)),
            ("--pool-mib 9", (filter, feedback, false, true)),
            (&*sizes, (filter, feedback, false, true)),
            (&*rules, (filter, feedback, true, false)),
        ] {
            let Chosen { filter, feedback, pools, .. } = chosen(words);
            let has = (pools.sizes.contains_key(KIND), pools.rules.contains_key(KIND));
            assert_eq!((filter, feedback, has.0, has.1), expected, "{words}");
        }
    }

    #[test]
    fn budgets_are_as_before_unless_the_command_line_names_some() {
        let budgets_of = |settings: &Settings| [settings.upload_bytes_per_frame, settings.in_flight_bytes];
        let usual = Settings::default();
        for (words, expected) in [
            ("--fade-ms 0", [3 << 20, 5 << 20]),
            ("--upload-kib-per-frame 7", [7 << 10, 5 << 20]),
            ("--upload-kib-per-frame 2048", [usual.upload_bytes_per_frame, 5 << 20]),
        ] {
            let line = format!("vastex view {words} a.vastex");
            let Command::View(args) = Args::parse_from(line.split(' ')).command else { panic!("{words}") };
            let settings = render::settings(&args.scene).unwrap();
            let chosen = Chosen::before(&before(), &args.scene, &settings);
            assert_eq!(budgets_of(&chosen.budgeted(settings)), expected, "{words}");
        }
        let mut chosen = chosen("--fade-ms 0");
        chosen.set_budgets([1 << 20, 2 << 20]);
        assert_eq!(budgets_of(&chosen.budgeted(usual.clone())), [1 << 20, 2 << 20]);
        let after = chosen.remembered(&before());
        assert_eq!((after.upload_bytes_per_frame, after.in_flight_bytes), (Some(1 << 20), Some(2 << 20)));
        #[cfg(feature = "volumes")]
        assert_eq!(budgets_of(&chosen.budgeted_for_volume(usual)), [1 << 20, 16 << 20]);
    }

    #[test]
    fn what_was_not_changed_in_a_run_stays_remembered_whatever_the_command_line_said() {
        let window = before();
        let mut chosen = chosen("--filter nearest --feedback inline --pool-mib 9");
        assert_eq!(chosen.remembered(&window), window);
        chosen.set_filter(None);
        chosen.set_feedback(FeedbackMode::Separate);
        chosen.set_size(KIND.to_owned(), None);
        chosen.set_size("8x8 r8".to_owned(), Some(1 << 20));
        chosen.set_rule("8x8 r8".to_owned(), Some(BiasRule::Solved));
        let after = chosen.remembered(&window);
        assert_eq!((after.filter, after.feedback), (None, Some(FeedbackMode::Separate)));
        assert_eq!(after.pools[KIND], KeptPool { bytes: None, rule: Some(KeptRule::Never) });
        let small = KeptPool { bytes: Some(1 << 20), rule: Some(KeptRule::Solved) };
        assert_eq!(after.pools["8x8 r8"], small);
        // A size that this device has no memory for may be one that another has.
        chosen.give_size_up(&"8x8 r8".to_owned());
        assert_eq!(chosen.remembered(&after).pools["8x8 r8"], small);
        chosen.set_rule(KIND.to_owned(), None);
        chosen.set_size(KIND.to_owned(), None);
        chosen.pools.rules.remove(KIND);
        assert!(!chosen.remembered(&window).pools.contains_key(KIND), "nothing is left of it");
    }

    #[test]
    fn layers_that_name_no_filter_have_the_one_that_was_chosen() {
        let chosen = chosen("--fade-ms 0");
        let named = LayerOptions { filter: Some(Filter::Nearest), ..first_of(1) };
        let layers = chosen.filtered(vec![first_of(0), named.clone()], 2);
        assert_eq!(layers, [LayerOptions { filter: Some(Filter::Bicubic), ..first_of(0) }, named]);
        let of_both =
            [0, 1].map(|texture| LayerOptions { filter: Some(Filter::Bicubic), ..first_of(texture) });
        assert_eq!(chosen.filtered(Vec::new(), 2), of_both);
        assert!(Chosen::default().filtered(Vec::new(), 2).is_empty());
    }

    #[test]
    fn a_mode_of_feedback_that_the_device_has_not_is_no_reason_not_to_start() {
        let gpu = headless_gpu().unwrap();
        let mut notes = Vec::new();
        for mode in FeedbackMode::ALL {
            let mut chosen = Chosen { feedback: Some(mode), ..Chosen::default() };
            let textures = chosen.textures(&gpu, Settings::default(), &mut notes).unwrap();
            assert_eq!((textures.inspect().feedback_mode(), &notes[..]), (mode, &[][..]));
        }
        // A device that has less.
        let limits = wgpu::Limits::downlevel_webgl2_defaults();
        let described = wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() };
        let (device, queue) = pollster::block_on(gpu.adapter.request_device(&described)).unwrap();
        let small = Gpu::new(gpu.instance.clone(), gpu.adapter.clone(), device, queue);
        let mut chosen = Chosen { feedback: Some(FeedbackMode::Inline), ..Chosen::default() };
        let textures = chosen.textures(&small, Settings::default(), &mut notes).unwrap();
        assert_eq!(textures.inspect().feedback_mode(), FeedbackMode::Raw);
        assert!(matches!(&notes[..], [note] if note.contains("the feedback mode inline")), "{notes:?}");
    }
}
