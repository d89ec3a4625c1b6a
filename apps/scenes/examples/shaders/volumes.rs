//! The texts of volumes: the library's for one channel, which serves all channels of a pool, and for labels,
//! the viewer's, and that of the example with mist.

use vastex::{Dims, FeedbackMode, Filter};
use vastex_viewer::volume::{LabelsInText, volume_text};
use vastex_wgpu::{Atlas, Kind, KindMember, Kinds, PageSides, TableKind, wgsl};

use super::of_tests::of_test;
use super::{Choice, Options, Visit, group, name_of, vastex_tests};

/// Calls `visit` with every text of volumes. A volume's filter is nearest, or the blend of eight voxels.
pub(super) fn each(visit: &mut Visit<'_>) {
    let fog = include_str!("../../../../crates/vastex/examples/fog/fog.wgsl");
    let filters = vec![Filter::Nearest, Filter::Trilinear];
    let of_fog = Options { places: vec![(1, 0)], fades: vec![false], ..Options::all() };
    Options { filters: vec![Filter::Trilinear], pages: vec![PageSides::Any], ..of_fog }.each(|choice| {
        visit(&format!("fog-{}", name_of(choice)), fog.to_owned() + &alone(choice, solid(choice)));
    });
    let atlases = [&Atlas::ALL[..], &[Atlas::HighLow]].concat();
    let options = Options { filters, atlases, pages: vec![PageSides::Any], ..Options::all() };
    options.each(|choice| {
        let text = alone(choice, solid(choice));
        let name = name_of(choice);
        visit(&format!("volume-{name}"), volume_text(&text, LabelsInText::None, choice.feedback));
        visit(&format!("library-volume-{name}"), text);
    });
    labels(visit);
    let atlases = vec![Atlas::Float, Atlas::Unfiltered, Atlas::Uint16, Atlas::HighLow];
    Options { atlases, ..options }.each(|choice| {
        for tables in [TableKind::Direct, TableKind::Hashed] {
            let kind = Kind { tables, ..of_labels(choice) };
            let members = vec![member("image", 0, solid(choice)), member("label", 1, kind)];
            let text = volume_text(&group(choice, members), LabelsInText::Over, choice.feedback);
            visit(&format!("volume-labels-{tables:?}-{}", name_of(choice)), text);
        }
    });
}

/// Labels by themselves.
fn labels(visit: &mut Visit<'_>) {
    let (filters, pages, atlases) = (vec![Filter::Nearest], vec![PageSides::Any], vec![Atlas::Whole]);
    Options { filters, pages, atlases, ..Options::all() }.each(|choice| {
        let (text, name) = (alone(choice, of_labels(choice)), name_of(choice));
        if choice.feedback == FeedbackMode::Separate {
            visit(&format!("test-labels-{name}"), of_test(vastex_tests::LABELS, &text));
        }
        visit(&format!("library-labels-{name}"), text);
        let alone = group(choice, vec![member("label", 0, of_labels(choice))]);
        visit(&format!("labels-{name}"), volume_text(&alone, LabelsInText::Alone, choice.feedback));
    });
}

fn solid(choice: &Choice) -> Kind {
    Kind { dims: Dims::D3, ..choice.kind() }
}

/// The kind of labels: nothing blends them.
fn of_labels(choice: &Choice) -> Kind {
    Kind { atlas: Atlas::Whole, filter: Filter::Nearest, is_mixed: false, ..solid(choice) }
}

fn member(name: &str, pool: usize, kind: Kind) -> KindMember {
    KindMember { name: name.to_owned(), pool, kind }
}

fn alone(choice: &Choice, kind: Kind) -> String {
    wgsl(&Kinds::of(kind, choice.feedback, choice.fade), choice.place())
}
