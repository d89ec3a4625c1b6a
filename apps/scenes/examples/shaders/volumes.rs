//! The texts of volumes: the library's for one channel, which serves all channels of a pool, and the
//! viewer's.

use vastex::{Dims, Filter};
use vastex_viewer::volume::volume_text;
use vastex_wgpu::{Kind, Kinds, PageSides, wgsl};

use super::{Options, Visit, name_of};

/// Calls `visit` with every text of volumes. A volume's filter is nearest, or the blend of eight voxels.
pub(super) fn each(visit: &mut Visit<'_>) {
    let filters = vec![Filter::Nearest, Filter::Trilinear];
    Options { filters, pages: vec![PageSides::Any], ..Options::all() }.each(|choice| {
        let kinds = Kinds::of(Kind { dims: Dims::D3, ..choice.kind() }, choice.feedback, choice.fade);
        let (name, text) = (name_of(choice), wgsl(&kinds, choice.place()));
        visit(&format!("volume-{name}"), volume_text(&text));
        visit(&format!("library-volume-{name}"), text);
    });
}
