//! Whether a program has anything left to do, as the system sees its threads. How fast the machine is, and
//! who else is at work on it, makes no difference: a thread that waits for a processor is at work.

use std::collections::BTreeMap;
use std::path::Path;
use std::{fs, io};

use anyhow::{Context, Result};

/// The threads of programs, each with how often it went on and off a processor.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Threads(BTreeMap<String, u64>);

impl Threads {
    /// Looks at all threads of some programs; `None` if one runs, waits for a processor or for a disk. If two
    /// looks are the same, no thread did anything between them.
    pub(super) fn look(programs: &[u32]) -> Result<Option<Threads>> {
        let mut threads = BTreeMap::new();
        for program in programs {
            for thread in fs::read_dir(format!("/proc/{program}/task"))? {
                // One that has ended since is gone in the next look, too.
                let Some((name, is_waiting, switches)) = look_at(&thread?.path())? else { continue };
                if !is_waiting {
                    return Ok(None);
                }
                threads.insert(name, switches);
            }
        }
        Ok(Some(Threads(threads)))
    }
}

/// The name of a thread, whether it waits for something to happen, and how often it was switched on and off;
/// `None` if it is no more.
fn look_at(thread: &Path) -> Result<Option<(String, bool, u64)>> {
    let status = match fs::read_to_string(thread.join("status")) {
        Ok(status) => status,
        Err(error) if is_gone(&error) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    let field = |name: &str| status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'));
    let state = field("State").context("a thread without a state")?.trim();
    let switches = ["voluntary_ctxt_switches", "nonvoluntary_ctxt_switches"].map(|name| {
        let count = field(name).context("a thread whose switches nobody counts")?;
        Ok(count.trim().parse::<u64>()?)
    });
    let [of_its_own, forced]: [Result<u64>; 2] = switches;
    let is_waiting = !state.starts_with(['R', 'D']);
    Ok(Some((thread.display().to_string(), is_waiting, of_its_own? + forced?)))
}

/// Returns true if a thread ended while it was looked at.
fn is_gone(error: &io::Error) -> bool {
    /// No such process.
    const ESRCH: i32 = 3;
    error.kind() == io::ErrorKind::NotFound || error.raw_os_error() == Some(ESRCH)
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;
    use std::process;
    use std::sync::mpsc;
    use std::time::Duration;

    use super::*;

    const PATIENCE: Duration = Duration::from_secs(60);

    /// The state of a thread of this program.
    fn of(thread: &Path) -> (bool, u64) {
        let (_, is_waiting, switches) = look_at(thread).unwrap().unwrap();
        (is_waiting, switches)
    }

    #[test]
    fn a_thread_at_work_is_told_from_one_that_waits() {
        // Who looks is at work.
        assert_eq!(Threads::look(&[process::id()]).unwrap(), None);
        let (place, places) = mpsc::channel();
        let (go, goes) = mpsc::channel::<()>();
        let (done, dones) = mpsc::channel();
        let thread = std::thread::spawn(move || {
            let id = fs::read_link("/proc/thread-self").unwrap();
            place.send(PathBuf::from("/proc").join(id)).unwrap();
            while goes.recv_timeout(PATIENCE).is_ok() {
                done.send(()).unwrap();
            }
        });
        let path = places.recv_timeout(PATIENCE).unwrap();
        let waiting = || (0..100_000).map(|_| of(&path)).find(|(is_waiting, _)| *is_waiting).unwrap().1;
        // It may wait for something else before it waits for what it is told.
        let at_rest = || {
            let mut looks = (0..1000).map(|_| {
                let before = waiting();
                std::thread::sleep(Duration::from_millis(20));
                (before, waiting())
            });
            looks.find(|(before, after)| before == after).unwrap().0
        };
        let before = at_rest();
        go.send(()).unwrap();
        dones.recv_timeout(PATIENCE).unwrap();
        assert!(at_rest() > before, "it woke up");
        drop(go);
        thread.join().unwrap();
        assert!(look_at(&path).unwrap().is_none(), "it is no more");
    }
}
