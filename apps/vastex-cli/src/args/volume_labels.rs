//! Options of labels over a volume, of `render` and `view`.

use std::ffi::OsString;

use clap::Args as ClapArgs;
use vastex_viewer::volume::{OtherLabels, parse_label};

use super::named;

/// Which labels are drawn, and how.
#[derive(Clone, Debug, Default, ClapArgs)]
pub(crate) struct LabelArgs {
    /// Labels to be drawn over the image: the name of those beside it, as `vastex info` lists them; of
    /// `render` also the path of any volume of whole numbers
    #[arg(long, value_name = "NAME|PATH")]
    pub(crate) labels: Option<OsString>,
    /// How much labels hide of what lies under them, 0 to 1 [default: 0.5; 1 where there is no image]
    #[arg(long, value_name = "N", value_parser = parse_opacity)]
    pub(crate) label_opacity: Option<f32>,
    /// Show on slices the outlines of labels alone
    #[arg(long)]
    pub(crate) label_outlines: bool,
    /// The label that is shown in full, through all others
    #[arg(long, value_name = "ID", value_parser = parse_label, allow_hyphen_values = true)]
    pub(crate) label_selected: Option<i128>,
    /// What others than the selected label look like: dimmed, or hidden [default: dimmed]
    #[arg(long, value_name = "HOW", value_parser = named(&OtherLabels::ALL, OtherLabels::name))]
    pub(crate) label_others: Option<OtherLabels>,
}

impl LabelArgs {
    /// An option that is given and means nothing without labels.
    pub(crate) fn of_labels_alone(&self) -> Option<&'static str> {
        let given = [
            (self.label_opacity.is_some(), "--label-opacity"),
            (self.label_outlines, "--label-outlines"),
            (self.label_selected.is_some(), "--label-selected"),
            (self.label_others.is_some(), "--label-others"),
        ];
        given.iter().find(|(is_given, _)| *is_given).map(|(_, name)| *name)
    }
}

fn parse_opacity(text: &str) -> Result<f32, String> {
    let opacity = text.parse().ok().filter(|opacity| (0.0..=1.0).contains(opacity));
    opacity.ok_or_else(|| "write a number from 0 to 1, as in 0.3".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opacities_are_checked() {
        assert_eq!(parse_opacity("0.25"), Ok(0.25));
        assert!(["-0.1", "1.5", "nan", "x"].iter().all(|bad| parse_opacity(bad).is_err()));
    }
}
