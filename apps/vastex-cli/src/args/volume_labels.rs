//! What `vastex render` is told of labels over a volume.

use clap::Args as ClapArgs;
use vastex_viewer::volume::OtherLabels;

use super::named;

/// Which labels are drawn, and how.
#[derive(Clone, Debug, Default, ClapArgs)]
pub(crate) struct LabelArgs {
    /// Labels to be drawn over the image: the name of those beside it, as `vastex info` lists them, or the
    /// path of a volume of whole numbers
    #[arg(long, value_name = "NAME|PATH")]
    pub(crate) labels: Option<String>,
    /// How much labels hide of what lies under them, 0 to 1 [default: 0.5; 1 where there is no image]
    #[arg(long, value_name = "N", value_parser = parse_opacity)]
    pub(crate) label_opacity: Option<f32>,
    /// Show on slices the outlines of labels alone
    #[arg(long)]
    pub(crate) label_outlines: bool,
    /// The label that is shown in full, through all others
    #[arg(long, value_name = "ID", value_parser = parse_label, allow_hyphen_values = true)]
    pub(crate) label_selected: Option<i128>,
    /// What others than the selected label look like: dimmed, or hidden
    #[arg(long, default_value = "dimmed", value_name = "HOW", value_parser = named(&OtherLabels::ALL, OtherLabels::name))]
    pub(crate) label_others: OtherLabels,
}

impl LabelArgs {
    /// An option that is given and means nothing without labels.
    pub(crate) fn of_labels_alone(&self) -> Option<&'static str> {
        let given = [
            (self.label_opacity.is_some(), "--label-opacity"),
            (self.label_outlines, "--label-outlines"),
            (self.label_selected.is_some(), "--label-selected"),
            (self.label_others != OtherLabels::default(), "--label-others"),
        ];
        given.iter().find(|(is_given, _)| *is_given).map(|(_, name)| *name)
    }
}

fn parse_opacity(text: &str) -> Result<f32, String> {
    let opacity = text.parse().ok().filter(|opacity| (0.0..=1.0).contains(opacity));
    opacity.ok_or_else(|| "write a number from 0 to 1, as in 0.3".into())
}

/// What values of 64 bits can be, with or without a sign. 0 is no label.
fn parse_label(text: &str) -> Result<i128, String> {
    let within = i128::from(i64::MIN)..=i128::from(u64::MAX);
    match text.parse().ok().filter(|label| within.contains(label)) {
        Some(0) => Err("0 is where there is no label; write another whole number".into()),
        Some(label) => Ok(label),
        None => Err("write a whole number of up to 64 bits, as in 4294967301".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_have_up_to_64_bits() {
        assert_eq!(parse_label("18446744073709551615"), Ok(i128::from(u64::MAX)));
        assert_eq!(parse_label("-9223372036854775808"), Ok(i128::from(i64::MIN)));
        for bad in ["18446744073709551616", "-9223372036854775809", "0", "1.5", "cells", ""] {
            assert!(parse_label(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_opacity("0.25"), Ok(0.25));
        assert!(["-0.1", "1.5", "nan", "x"].iter().all(|bad| parse_opacity(bad).is_err()));
    }
}
