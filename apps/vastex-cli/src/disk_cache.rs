//! The disk cache of `render` and `view`. Where it cannot be had, they do without and say so.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::thread;
use std::time::Duration;

use serde::Serialize;
use vastex::TileSource;
use vastex_tiles::{DiskCache, DiskTier, DiskTierError, TierStats, same_file};

use crate::args::DiskCacheArgs;
use crate::report;

/// Opens the cache that was asked for, later: on a thread that begins now, as urgent as the one that begins
/// it. That may build an image meanwhile and give way to others from then on, for good, and so do the threads
/// that it starts; what keeps tiles is not to.
pub(crate) struct Later {
    directory: PathBuf,
    bytes: u64,
    /// Wakes the thread, which ends with this otherwise; and what it opened. `None` if the system gives
    /// no thread.
    thread: Option<(Sender<()>, Receiver<Opened>)>,
}

type Opened = Result<Arc<DiskTier>, DiskTierError>;

/// The directories that this program has as caches: all of its sources share one, which nobody can open
/// twice.
static OPEN: Mutex<Vec<(PathBuf, Weak<DiskTier>)>> = Mutex::new(Vec::new());

/// A directory as a cache: the one that other sources of this program have, where they do.
fn shared(directory: &Path, bytes: u64) -> Opened {
    let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    open.retain(|(_, tier)| tier.strong_count() > 0);
    let same = |other: &Path| same_file(other, directory);
    if let Some(tier) = open.iter().filter(|(other, _)| same(other)).find_map(|(_, tier)| tier.upgrade()) {
        return Ok(tier);
    }
    let tier = Arc::new(DiskTier::open(directory, bytes)?);
    open.push((directory.to_owned(), Arc::downgrade(&tier)));
    Ok(tier)
}

impl Later {
    /// `None` if no cache was asked for.
    pub(crate) fn new(args: &DiskCacheArgs) -> Option<Later> {
        let (directory, bytes) = (args.disk_cache.clone()?, args.disk_cache_mib << 20);
        let ((ask, asked), (give, given)) = (channel(), channel());
        let of_thread = directory.clone();
        let open = move || {
            if asked.recv().is_ok() {
                drop(give.send(shared(&of_thread, bytes)));
            }
        };
        let thread = thread::Builder::new().name("vastex-tier".into()).spawn(open);
        Some(Later { directory, bytes, thread: thread.is_ok().then_some((ask, given)) })
    }

    fn open(self) -> Opened {
        let of_thread = self.thread.and_then(|(ask, given)| {
            ask.send(()).ok()?;
            given.recv().ok()
        });
        of_thread.unwrap_or_else(|| shared(&self.directory, self.bytes))
    }
}

/// The cache that was asked for, for sources that are not there yet. Where it cannot be had that is said.
#[cfg(feature = "volumes")]
pub(crate) fn asked(args: &DiskCacheArgs) -> Option<Arc<DiskTier>> {
    match Later::new(args)?.open() {
        Ok(tier) => Some(tier),
        Err(error) => {
            report::say(&format!("note: {error}; nothing is kept on disk in this run"));
            None
        }
    }
}

/// A source of bricks of a volume, behind a cache if there is one and the source can be known again.
#[cfg(feature = "volumes")]
pub(crate) fn before_volume(
    source: &Arc<vastex_volume::VolumeSource>,
    tier: Option<&Arc<DiskTier>>,
) -> Arc<dyn TileSource> {
    match (tier, source.identity()) {
        (Some(tier), Some(key)) => Arc::new(DiskCache::new(source.clone(), tier.clone(), key)),
        _ => source.clone(),
    }
}

/// What is said of a volume that no cache keeps though one was asked for.
#[cfg(feature = "volumes")]
pub(crate) fn say_not_kept(source: &vastex_volume::VolumeSource) {
    if source.identity().is_none() {
        report::say(&format!(
            "note: {}: not kept on disk: only volumes in one file, of which no level is made in the background, are",
            source.volume().about().path
        ));
    }
}

/// The source of `path`, behind the cache that was asked for; and that cache, where it can be had. Else
/// `tell` is told why not, too.
pub(crate) fn before(
    tiles: Arc<dyn TileSource>,
    path: &Path,
    later: Option<Later>,
    tell: &dyn Fn(&str),
) -> (Arc<dyn TileSource>, Option<Arc<DiskTier>>) {
    let Some(later) = later else { return (tiles, None) };
    let say = |note: String| {
        report::say(&format!("note: {note}"));
        tell(&note);
    };
    let Some(key) = tiles.identity() else {
        say(format!("{}: not kept on disk: the dates of its files cannot be read", path.display()));
        return (tiles, None);
    };
    match later.open() {
        Ok(tier) => (Arc::new(DiskCache::new(tiles, tier.clone(), key)), Some(tier)),
        Err(error) => {
            say(format!("{error}; nothing is kept on disk in this run"));
            (tiles, None)
        }
    }
}

/// What `--json` says of the cache. Scripts rely on these names.
#[derive(Serialize)]
pub(crate) struct Summary {
    hits: u64,
    misses: u64,
    evictions: u64,
    failures: u64,
    /// Not kept since the disk was slower than what was read.
    skipped: u64,
    tiles: u64,
    /// Of all its files.
    bytes: u64,
    bytes_read: u64,
    bytes_written: u64,
}

impl Summary {
    pub(crate) fn new(tier: &DiskTier) -> Summary {
        // So that what is told is what a later run finds. A disk that takes longer is not waited for.
        tier.flush(Duration::from_secs(2));
        let TierStats { hits, misses, evictions, failures, skipped, tiles, bytes, bytes_read, bytes_written } =
            tier.stats();
        Summary { hits, misses, evictions, failures, skipped, tiles, bytes, bytes_read, bytes_written }
    }

    pub(crate) fn text(&self) -> String {
        let Summary { hits, misses, evictions, failures, tiles, .. } = self;
        let bytes = report::bytes(self.bytes);
        let reads = hits + misses;
        let mut text =
            format!("disk cache: {hits} of {reads} reads, {evictions} evicted; holds {tiles} tiles, {bytes}");
        if *failures > 0 {
            text += &format!("; {failures} failures");
        }
        if self.skipped > 0 {
            text += &format!("; {} not kept, since the disk is slower than the source", self.skipped);
        }
        text
    }
}

#[cfg(all(test, target_os = "linux", feature = "build"))]
mod tests {
    use super::*;

    /// How much less urgent than others a thread is, and its name, as the system has them.
    fn urgency(of: &Path) -> Option<(String, i64)> {
        let text = std::fs::read_to_string(of.join("stat")).ok()?;
        let (before, after) = text.rsplit_once(')')?;
        // The 19th field; the third is the first after the name.
        let urgency = after.split_whitespace().nth(16)?.parse().ok()?;
        Some((before.split_once('(')?.1.to_owned(), urgency))
    }

    #[test]
    fn all_sources_of_a_program_share_a_directory() {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join("tiles");
        let first = shared(&place, 1 << 20).unwrap();
        let again = shared(&directory.path().join(".").join("tiles"), 1 << 20).unwrap();
        assert!(Arc::ptr_eq(&first, &again));
        assert!(!Arc::ptr_eq(&first, &shared(&directory.path().join("others"), 1 << 20).unwrap()));
        assert!(DiskTier::open(&place, 1 << 20).is_err(), "another program");
        drop((first, again));
        shared(&place, 1 << 20).unwrap();
    }

    #[test]
    fn what_keeps_tiles_does_not_give_way_after_a_build_on_the_thread_that_opens_it() {
        let directory = tempfile::tempdir().unwrap();
        let args =
            |name: &str| DiskCacheArgs { disk_cache: Some(directory.path().join(name)), disk_cache_mib: 1 };
        let opened = std::thread::scope(|scope| {
            let open = || {
                let later = Later::new(&args("tiles")).unwrap();
                assert!(vastex_build::give_way());
                later.open().unwrap()
            };
            scope.spawn(open).join().unwrap()
        });
        let of_program = urgency(Path::new("/proc/self")).unwrap().1;
        let keeping = || {
            let threads = std::fs::read_dir("/proc/self/task").unwrap();
            let known = threads.filter_map(|thread| urgency(&thread.ok()?.path()));
            known.filter(|(name, _)| name == "vastex keep").collect::<Vec<_>>()
        };
        // A thread has its name once it runs.
        let begun = std::time::Instant::now();
        while keeping().is_empty() && begun.elapsed() < std::time::Duration::from_secs(30) {
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        let keeping = keeping();
        assert!(!keeping.is_empty() && keeping.iter().all(|(_, of)| *of == of_program), "{keeping:?}");
        drop(opened);
        // Whoever is never asked goes, and has opened nothing.
        drop(Later::new(&args("never")));
        assert!(!directory.path().join("never").exists());
    }
}
