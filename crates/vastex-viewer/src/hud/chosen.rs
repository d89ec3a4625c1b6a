//! What a person chose of how textures are sampled and kept: in the window, which remembers it, or in words
//! of the host's, as a command line, which have the last word.

use vastex::{BiasRule, FeedbackMode, Filter, Settings, Textures};

use super::chosen_pools::{ChosenPools, PoolKind};
use crate::gpu::Gpu;
use crate::remembered::{KeptPool, Remembered};
use crate::surface::LayerOptions;

/// What a host's own words name, so that nothing of earlier runs takes its place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NamedByHost {
    /// True if they name how texels are blended.
    pub filter: bool,
    /// True if they name how views say what they want.
    pub feedback: bool,
    /// True if they name how many bytes are copied to the GPU in a frame.
    pub uploads: bool,
}

/// What a person chose of how textures are sampled and kept, in this run or in an earlier one.
#[derive(Clone, Debug, Default)]
pub struct Chosen {
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
    /// Each of the budgets by itself.
    budgets: [bool; 2],
    sizes: Vec<PoolKind>,
    rules: Vec<PoolKind>,
}

impl Chosen {
    /// What was chosen in earlier runs, as far as the host's words and the settings that they come to do not
    /// say otherwise.
    pub fn before(before: &Remembered, named: NamedByHost, settings: &Settings) -> Chosen {
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
            filter: before.filter.filter(|_| !named.filter),
            feedback: before.feedback.filter(|_| !named.feedback),
            budgets: [before.upload_bytes_per_frame.filter(|_| !named.uploads), before.in_flight_bytes],
            pools,
            changed: Changed::default(),
        }
    }

    /// Textures with these settings and the mode of feedback that was chosen. Where the device does not have
    /// that, it is left out, and said in a note.
    pub fn textures(
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
    pub fn budgeted(&self, settings: Settings) -> Settings {
        let [uploads, in_flight] = self.budgets;
        Settings {
            upload_bytes_per_frame: uploads.unwrap_or(settings.upload_bytes_per_frame),
            in_flight_bytes: in_flight.unwrap_or(settings.in_flight_bytes),
            ..settings
        }
    }

    /// Settings of a volume with the budgets that were chosen, but for bytes on their way no fewer than
    /// `settings` have: its bricks need them.
    pub fn budgeted_for_volume(&self, settings: Settings) -> Settings {
        let least = settings.in_flight_bytes;
        let budgeted = self.budgeted(settings);
        Settings { in_flight_bytes: budgeted.in_flight_bytes.max(least), ..budgeted }
    }

    /// What is to be remembered, of what was before and what was chosen in this run.
    pub fn remembered(&self, before: &Remembered) -> Remembered {
        let mut window = before.clone();
        if self.changed.filter {
            window.filter = self.filter;
        }
        if self.changed.feedback {
            window.feedback = self.feedback;
        }
        let budgets = [&mut window.upload_bytes_per_frame, &mut window.in_flight_bytes];
        for (n, kept) in budgets.into_iter().enumerate().filter(|(n, _)| self.changed.budgets[*n]) {
            *kept = self.budgets[n];
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
    pub fn pools(&self) -> &ChosenPools {
        &self.pools
    }

    /// Texels are blended by this filter from here on; by what suits the magnification where none is named.
    pub fn set_filter(&mut self, filter: Option<Filter>) {
        (self.filter, self.changed.filter) = (filter, true);
    }

    /// Views say so what they want from here on.
    pub fn set_feedback(&mut self, mode: FeedbackMode) {
        (self.feedback, self.changed.feedback) = (Some(mode), true);
    }

    /// Sets the budgets of `textures` from here on: bytes copied to the GPU in a frame, and bytes of tiles on
    /// their way. One that stays as it is was not chosen: the host's words may have named it, or a volume may
    /// have needed more.
    pub fn set_budgets(&mut self, textures: &mut Textures, budgets: [u64; 2]) {
        let before = budgets_of(textures.inspect().settings());
        textures.memory().set_budgets(budgets[0], budgets[1]);
        for n in (0..2).filter(|n| budgets[*n] != before[*n]) {
            (self.budgets[n], self.changed.budgets[n]) = (Some(budgets[n]), true);
        }
    }

    /// A pool has a size of its own from here on, or follows the picture.
    pub fn set_size(&mut self, kind: PoolKind, bytes: Option<u64>) {
        match bytes {
            Some(bytes) => drop(self.pools.sizes.insert(kind.clone(), bytes)),
            None => drop(self.pools.sizes.remove(&kind)),
        }
        self.changed.sizes.push(kind);
    }

    /// The mip bias of a pool is decided so from here on; nothing for never one.
    pub fn set_rule(&mut self, kind: PoolKind, rule: Option<BiasRule>) {
        self.pools.rules.insert(kind.clone(), rule);
        self.changed.rules.push(kind);
    }

    /// A pool cannot have the size that was chosen. It stays remembered: another device may have the memory.
    pub fn give_size_up(&mut self, kind: &PoolKind) {
        self.pools.sizes.remove(kind);
        self.changed.sizes.retain(|changed| changed != kind);
    }

    /// The layers that are shown first of so many textures, with the filter that was chosen where they name
    /// none.
    pub fn filtered(&self, mut layers: Vec<LayerOptions>, textures: usize) -> Vec<LayerOptions> {
        if self.filter.is_none() {
            return layers;
        }
        if layers.is_empty() {
            layers = (0..textures).map(LayerOptions::first_of).collect();
        }
        layers.iter_mut().for_each(|layer| layer.filter = layer.filter.or(self.filter));
        layers
    }
}

/// Bytes copied to the GPU in a frame, and of tiles on their way.
fn budgets_of(settings: &Settings) -> [u64; 2] {
    [settings.upload_bytes_per_frame, settings.in_flight_bytes]
}

#[cfg(test)]
mod tests {
    use vastex::{PoolRule, PoolTuning};

    use super::*;
    use crate::remembered::KeptRule;

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

    fn chosen(named: NamedByHost, settings: &Settings) -> Chosen {
        Chosen::before(&before(), named, settings)
    }

    #[test]
    fn the_host_has_the_last_word_and_what_it_does_not_say_is_as_before() {
        let nothing = NamedByHost::default();
        let usual = Settings::default();
        let with = |change: &dyn Fn(&mut PoolTuning)| {
            let mut settings = usual.clone();
            change(&mut settings.pools.default_pool);
            settings
        };
        let sized = with(&|pool| pool.bytes = Some(9 << 20));
        let ruled = with(&|pool| pool.mip_bias_rule = Some(BiasRule::Solved));
        let tuning = PoolTuning { allow_size_scale: Some(true), ..PoolTuning::default() };
        let mut scaled = usual.clone();
        scaled.pools.rules.push(PoolRule { tuning, ..PoolRule::default() });
        let (filter, feedback) = (Some(Filter::Bicubic), Some(FeedbackMode::Raw));
        for (named, settings, expected) in [
            (nothing, &usual, (filter, feedback, true, true)),
            (NamedByHost { filter: true, ..nothing }, &usual, (None, feedback, true, true)),
            (NamedByHost { feedback: true, ..nothing }, &usual, (filter, None, true, true)),
            (nothing, &sized, (filter, feedback, false, true)),
            (nothing, &scaled, (filter, feedback, false, true)),
            (nothing, &ruled, (filter, feedback, true, false)),
        ] {
            let Chosen { filter, feedback, pools, .. } = chosen(named, settings);
            let has = (pools.sizes.contains_key(KIND), pools.rules.contains_key(KIND));
            assert_eq!((filter, feedback, has.0, has.1), expected, "{named:?}");
        }
    }

    #[test]
    fn budgets_are_as_before_unless_the_host_names_some() {
        let usual = Settings::default();
        let named = NamedByHost { uploads: true, ..NamedByHost::default() };
        for (named, expected) in
            [(NamedByHost::default(), [3 << 20, 5 << 20]), (named, [usual.upload_bytes_per_frame, 5 << 20])]
        {
            let chosen = chosen(named, &usual);
            assert_eq!(budgets_of(&chosen.budgeted(usual.clone())), expected, "{named:?}");
        }
    }

    #[test]
    fn a_budget_is_remembered_where_it_was_changed_and_the_other_is_not() {
        let gpu = pollster::block_on(Gpu::headless()).unwrap();
        let kept = |after: &Remembered| (after.upload_bytes_per_frame, after.in_flight_bytes);
        let named = NamedByHost { uploads: true, ..NamedByHost::default() };
        for (budgets, expected) in [
            // The host named the first, for this run alone.
            ([7 << 10, 2 << 20], (Some(3 << 20), Some(2 << 20))),
            ([1 << 20, 5 << 20], (Some(1 << 20), Some(5 << 20))),
            ([1 << 20, 2 << 20], (Some(1 << 20), Some(2 << 20))),
            ([7 << 10, 5 << 20], kept(&before())),
        ] {
            let settings = Settings { upload_bytes_per_frame: 7 << 10, ..Settings::default() };
            let mut chosen = chosen(named, &settings);
            let mut textures = chosen.textures(&gpu, settings, &mut Vec::new()).unwrap();
            assert_eq!(budgets_of(textures.inspect().settings()), [7 << 10, 5 << 20]);
            chosen.set_budgets(&mut textures, budgets);
            assert_eq!(budgets_of(textures.inspect().settings()), budgets);
            assert_eq!(kept(&chosen.remembered(&before())), expected, "{budgets:?}");
        }
        // Of a volume more are on their way than was chosen, and that is not chosen by changing the other.
        let mut chosen = chosen(NamedByHost::default(), &Settings::default());
        let needed = Settings { in_flight_bytes: 16 << 20, ..Settings::default() };
        let settings = chosen.budgeted_for_volume(needed.clone());
        assert_eq!(budgets_of(&settings), [3 << 20, 16 << 20]);
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings).unwrap();
        chosen.set_budgets(&mut textures, [1 << 20, 16 << 20]);
        assert_eq!(kept(&chosen.remembered(&before())), (Some(1 << 20), Some(5 << 20)));
        assert_eq!(budgets_of(&chosen.budgeted_for_volume(needed)), [1 << 20, 16 << 20]);
    }

    #[test]
    fn what_was_not_changed_in_a_run_stays_remembered_whatever_the_command_line_said() {
        let window = before();
        let mut chosen = Chosen::before(
            &window,
            NamedByHost { filter: true, feedback: true, uploads: false },
            &Settings::default(),
        );
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
        let chosen = chosen(NamedByHost::default(), &Settings::default());
        let named = LayerOptions { filter: Some(Filter::Nearest), ..LayerOptions::first_of(1) };
        let layers = chosen.filtered(vec![LayerOptions::first_of(0), named.clone()], 2);
        assert_eq!(
            layers,
            [LayerOptions { filter: Some(Filter::Bicubic), ..LayerOptions::first_of(0) }, named]
        );
        let of_both = [0, 1]
            .map(|texture| LayerOptions { filter: Some(Filter::Bicubic), ..LayerOptions::first_of(texture) });
        assert_eq!(chosen.filtered(Vec::new(), 2), of_both);
        assert!(Chosen::default().filtered(Vec::new(), 2).is_empty());
    }

    #[test]
    fn a_mode_of_feedback_that_the_device_has_not_is_no_reason_not_to_start() {
        let gpu = pollster::block_on(Gpu::headless()).unwrap();
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
