//! The words for estimates: what a view wants, known without a feedback pass.

use clap::Args as ClapArgs;
use vastex::survey::SurveySettings;
use vastex_scenes::{Estimate, Estimating};

use super::named;

/// What `vastex render` is told of estimates.
#[derive(Clone, Copy, Debug, ClapArgs)]
pub(crate) struct EstimateArgs {
    /// Work out what each view wants from where the surface lies, without a feedback pass
    #[arg(long, value_name = "NAME", value_parser = named(&Estimate::ALL, Estimate::name))]
    estimate: Option<Estimate>,
    /// Keep the feedback pass; what is estimated is loaded after everything that it finds
    #[arg(long, requires = "estimate")]
    beside: bool,
    /// Load what is hidden or beside the picture too, after everything in view, so many levels coarser than
    /// if it were seen
    #[arg(long, value_name = "LEVELS", requires = "estimate", value_parser = parse_levels)]
    estimate_unseen: Option<f32>,
}

impl EstimateArgs {
    /// How to estimate; `None` if it is not wanted.
    pub(crate) fn estimating(&self) -> Option<Estimating> {
        let settings = SurveySettings { unseen: self.estimate_unseen, ..SurveySettings::default() };
        self.estimate.map(|estimate| Estimating { estimate, beside: self.beside, settings })
    }
}

fn parse_levels(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(levels) if (0.0..=32.0).contains(&levels) => Ok(levels),
        _ => Err("give a number of levels from 0 to 32, as in 2".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_checked() {
        assert_eq!((parse_levels("0"), parse_levels("2.5")), (Ok(0.0), Ok(2.5)));
        for bad in ["-1", "33", "nan", "inf", "", "x"] {
            assert!(parse_levels(bad).is_err(), "{bad}");
        }
    }
}
