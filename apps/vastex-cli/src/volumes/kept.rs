//! Room for levels that were made of volumes: those that were not used for longest go.
//!
//! `CACHE/volumes/SUM-N` has what was made of one channel of a volume at one time, with `volume.txt`, which
//! is read whenever it is used. What goes while another program uses it is made again there.

use std::fs;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// What tells such a directory.
const IDENTITY: &str = "volume.txt";

/// Removes what was not used for longest, until the rest fits into a budget. What cannot be listed or removed
/// stays.
pub(super) fn make_room(cache: &Path, budget: u64) {
    let Ok(entries) = fs::read_dir(cache.join("volumes")) else { return };
    let places = entries.flatten().map(|entry| entry.path());
    let mut kept: Vec<_> =
        places.filter_map(|place| Some((last_use(&place)?, bytes_in(&place, 2), place))).collect();
    kept.sort_unstable();
    let mut bytes: u64 = kept.iter().map(|(_, bytes, _)| bytes).sum();
    for (_, own, place) in kept {
        if bytes <= budget {
            return;
        }
        if fs::remove_dir_all(&place).is_ok() {
            bytes -= own;
        }
    }
}

/// When a directory of made levels was used last; `None` of another.
fn last_use(place: &Path) -> Option<SystemTime> {
    let name = place.file_name()?.to_str()?;
    let (sum, number) = name.split_once('-')?;
    let is_one =
        sum.len() == 8 && sum.bytes().all(|byte| byte.is_ascii_hexdigit()) && number.parse::<u32>().is_ok();
    let found = fs::metadata(place.join(IDENTITY)).ok().filter(|_| is_one)?;
    [found.accessed(), found.modified()].into_iter().flatten().max().or(Some(UNIX_EPOCH))
}

/// Bytes of the files in a directory, so many directories deep.
fn bytes_in(place: &Path, depth: u32) -> u64 {
    let Ok(entries) = fs::read_dir(place) else { return 0 };
    let of = |entry: fs::DirEntry| match entry.metadata() {
        Ok(found) if found.is_dir() && depth > 0 => bytes_in(&entry.path(), depth - 1),
        Ok(found) => found.len(),
        Err(_) => 0,
    };
    entries.flatten().map(of).sum()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn what_was_not_used_for_longest_goes_and_nothing_else() {
        let cache = tempfile::tempdir().unwrap();
        let volumes = cache.path().join("volumes");
        make_room(cache.path(), 0);
        for (nth, name) in ["0000000a-0", "0000000b-1", "mine", "0000000c-x"].iter().enumerate() {
            let place = volumes.join(name);
            fs::create_dir_all(place.join("0")).unwrap();
            fs::write(place.join("0/0.0.0"), [0; 1000]).unwrap();
            let identity = fs::File::create(place.join(IDENTITY)).unwrap();
            let used = UNIX_EPOCH + Duration::from_secs(1_000_000 - nth as u64);
            identity.set_times(fs::FileTimes::new().set_accessed(used).set_modified(used)).unwrap();
        }
        let is_there = |name: &str| volumes.join(name).exists();
        make_room(cache.path(), 2000);
        assert!(is_there("0000000a-0") && is_there("0000000b-1"));
        make_room(cache.path(), 1500);
        assert!(is_there("0000000a-0") && !is_there("0000000b-1"), "the one that was used before");
        make_room(cache.path(), 0);
        assert!(!is_there("0000000a-0") && is_there("mine") && is_there("0000000c-x"));
    }
}
