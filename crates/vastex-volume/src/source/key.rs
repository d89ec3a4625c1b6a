//! Under which key bricks of a volume are found again in another run.

use std::fmt::Write;
use std::path::Path;

use vastex_tiles::SourceKey;

use super::VolumeSource;

/// Changes when bricks of a volume come out otherwise.
const VERSION: u32 = 2;

/// The key of a source; `None` where its bricks may be others in another run, though nothing tells so: of
/// directories, in which a chunk may be written anew beside all others, and where levels are made in the
/// background, of which a brick is a preview first.
pub(super) fn key(source: &VolumeSource) -> Option<SourceKey> {
    let about = source.volume.about();
    if source.may_lack_levels() {
        return None;
    }
    // The file or the archive that it lies in.
    let path = Path::new(&about.path);
    let file = path.ancestors().find(|path| path.exists())?;
    let mut text = format!("volume {VERSION} {:?} {:?} {:?}\n", about.path, about.dtype, source.description);
    writeln!(text, "{:?} {}", VolumeOptionsInKey::of(source), source.levels.levels().len()).ok()?;
    // Where levels lie beside one another says which voxels a brick has.
    writeln!(text, "{}", about.convention.name()).ok()?;
    // Values and what describes them may be two files.
    let described = Path::new(&format!("{}.toml", file.display())).to_owned();
    for (nth, file) in [file.to_owned(), described, file.with_extension("img")].into_iter().enumerate() {
        match std::fs::metadata(&file) {
            Ok(found) if found.is_file() => {
                let written = found.modified().ok()?;
                let whole = file.canonicalize().ok()?;
                writeln!(text, "{} {} {written:?}", whole.display(), found.len()).ok()?;
            }
            _ if nth == 0 => return None,
            _ => {}
        }
    }
    Some(SourceKey::of(text))
}

/// What of the options changes bricks.
#[derive(Debug)]
#[expect(dead_code, reason = "it is told by its text")]
struct VolumeOptionsInKey {
    channel: u64,
    time: u64,
    labels: bool,
    reduction: Option<crate::reduce::Reduction>,
}

impl VolumeOptionsInKey {
    fn of(source: &VolumeSource) -> VolumeOptionsInKey {
        let super::VolumeOptions { channel, time, reduction, .. } = source.options;
        VolumeOptionsInKey { channel, time, labels: source.is_labels, reduction }
    }
}
