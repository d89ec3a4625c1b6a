//! What becomes of what a person changes in the panel of what the machine does: the same of the textures of
//! surfaces as of those of a volume.

use vastex::{FeedbackMode, Filter, PoolId, Textures};

use super::Beside;
use crate::hud::{HudChange, pool_kinds};
use crate::overlay::Overlay;

/// Textures that a person tunes.
pub(crate) struct Tuned<'a> {
    /// Name of what is shown of them.
    pub(crate) name: &'a str,
    pub(crate) textures: &'a mut Textures,
    /// True if what is chosen of a pool is of every pool of its kind, in later windows, too.
    pub(crate) keeps_pools: bool,
}

/// How textures are sampled, drawn and asked, which is each scene's own to change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Sampling {
    Filter(Option<Filter>),
    Overlay(Option<Overlay>),
    Feedback(FeedbackMode),
}

impl Beside {
    /// Changes what a person changed. What cannot be is said, and stays as it was. Gives back what is the
    /// scene's to change.
    pub(crate) fn tune(&mut self, tuned: Tuned<'_>, change: &HudChange) -> Option<Sampling> {
        let Tuned { name, textures, keeps_pools } = tuned;
        let kind =
            |textures: &Textures, pool: PoolId| pool_kinds(textures).remove(&pool).filter(|_| keeps_pools);
        let (mut sampling, mut failed) = (None, None);
        match *change {
            HudChange::PoolBytes(pool, bytes) => {
                let sized = match bytes {
                    Some(bytes) => textures.memory().resize_pool(pool, bytes).map(drop),
                    None => textures.memory().fit_pool(pool).map(drop),
                };
                match (sized, kind(textures, pool)) {
                    (Ok(()), Some(kind)) => self.chosen.set_size(kind, bytes),
                    (sized, _) => failed = sized.err(),
                }
            }
            HudChange::Rule(pool, rule) => {
                if let Some(kind) = kind(textures, pool) {
                    self.chosen.set_rule(kind, rule);
                }
                failed = textures.memory().set_bias_rule(pool, rule).err();
            }
            HudChange::Budgets { uploads, in_flight } => {
                self.chosen.set_budgets(textures, [uploads, in_flight]);
            }
            HudChange::Filter(filter) => sampling = Some(Sampling::Filter(filter)),
            HudChange::Overlay(overlay) => sampling = Some(Sampling::Overlay(overlay)),
            HudChange::Feedback(mode) => sampling = Some(Sampling::Feedback(mode)),
        }
        match failed {
            None => drop(self.forget(TOPIC)),
            Some(error) => {
                self.log(format!("{name}: {error}"));
                self.show_error(TOPIC, &error.to_string());
            }
        }
        self.shortage_is_said = false;
        sampling
    }
}

/// What is said of a change, as a topic.
const TOPIC: &str = "change";
