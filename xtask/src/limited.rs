//! Programs that are run for what they print, and for no longer than a limit: one that hangs ends as an error
//! that says what it printed.
//!
//! How long a program may take, and what its output means, is decided by the callers.

use std::fmt;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

/// Time between two looks at a program that has closed its output and has not ended.
const PAUSE: Duration = Duration::from_millis(2);
/// Time that is left to what was printed before a program was killed, or had ended, to arrive here.
const GRACE: Duration = Duration::from_secs(1);

/// A program at work, whose output is gathered meanwhile. It is killed where this is dropped before it has
/// ended.
#[derive(Debug)]
pub struct Limited {
    child: Child,
    name: String,
    begun: Instant,
    limit: Duration,
    stdout: Gathered,
    stderr: Gathered,
    /// Says once of each of the two that nobody can write to it any more.
    closed: Receiver<()>,
}

type Gathered = Arc<Mutex<Vec<u8>>>;

/// Runs a command to its end, without input, and gives what it printed and how it ended.
///
/// Fails where it cannot be started, and where it has not ended after `limit`: then it is killed, and the
/// error says what it had printed. Programs that it started are not killed; their output is not waited for
/// beyond the limit either.
pub fn within(command: &mut Command, limit: Duration) -> Result<Output> {
    Limited::start(command, limit)?.end()
}

impl Limited {
    /// Starts a command without input, from which on its limit counts.
    pub fn start(command: &mut Command, limit: Duration) -> Result<Limited> {
        let (begun, name) = (Instant::now(), line(command));
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().with_context(|| format!("cannot start `{name}`"))?;
        let (sender, closed) = channel();
        let stdout = child.stdout.take().map(|pipe| gather(pipe, sender.clone())).unwrap_or_default();
        let stderr = child.stderr.take().map(|pipe| gather(pipe, sender)).unwrap_or_default();
        Ok(Limited { child, name, begun, limit, stdout, stderr, closed })
    }

    /// What the system calls the program.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Returns true if it has ended, without waiting for it.
    pub fn has_ended(&mut self) -> Result<bool> {
        Ok(self.child.try_wait()?.is_some())
    }

    /// Waits for its end, as [`within`] does.
    pub fn end(mut self) -> Result<Output> {
        let deadline = self.begun + self.limit;
        // Until nobody can print any more; mostly that is its end.
        let is_closed = self.is_closed_before(deadline);
        let status = self.status_before(deadline)?;
        let Some(status) = status else {
            self.kill();
            self.is_closed_before(Instant::now() + GRACE);
            bail!("`{}` has not ended after {:?} and was killed; {self}", self.name, self.limit);
        };
        // Time may have run out right before its end.
        if !is_closed && !self.is_closed_before(Instant::now() + GRACE) {
            bail!(
                "`{}` ended ({status}), and {:?} after it began a program that it started still holds its output; {self}",
                self.name,
                self.limit
            );
        }
        Ok(Output { status, stdout: taken(&self.stdout), stderr: taken(&self.stderr) })
    }

    /// Returns true if both of its outputs are closed, which is waited for until then.
    fn is_closed_before(&self, deadline: Instant) -> bool {
        loop {
            match self.closed.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
                Ok(()) => {}
                // Whoever reads an output holds a sender until it is closed.
                Err(ended) => return ended == std::sync::mpsc::RecvTimeoutError::Disconnected,
            }
        }
    }

    fn status_before(&mut self, deadline: Instant) -> Result<Option<ExitStatus>> {
        loop {
            let status = self.child.try_wait()?;
            if status.is_some() || Instant::now() >= deadline {
                return Ok(status);
            }
            thread::sleep(PAUSE);
        }
    }

    fn kill(&mut self) {
        // It may have ended at this very moment, which is no failure.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Limited {
    fn drop(&mut self) {
        if !matches!(self.child.try_wait(), Ok(Some(_))) {
            self.kill();
        }
    }
}

/// What it has printed so far.
impl fmt::Display for Limited {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [stdout, stderr] = [&self.stdout, &self.stderr].map(|gathered| {
            let bytes = gathered.lock().unwrap_or_else(PoisonError::into_inner);
            String::from_utf8_lossy(&bytes).into_owned()
        });
        write!(f, "it printed:\n{stdout}\nand as errors:\n{stderr}")
    }
}

/// Reads a pipe on a thread of its own, so that a program never waits for room in it; the sender is dropped
/// when it is closed.
fn gather(mut pipe: impl Read + Send + 'static, closed: Sender<()>) -> Gathered {
    let gathered = Gathered::default();
    let into = Arc::clone(&gathered);
    thread::spawn(move || {
        let mut buffer = vec![0; 1 << 16];
        loop {
            match pipe.read(&mut buffer) {
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Ok(0) | Err(_) => break,
                Ok(bytes) => {
                    into.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(&buffer[..bytes]);
                }
            }
        }
        drop(closed);
    });
    gathered
}

fn taken(gathered: &Gathered) -> Vec<u8> {
    std::mem::take(&mut gathered.lock().unwrap_or_else(PoisonError::into_inner))
}

/// The command as a person would type it, the program by its name alone.
fn line(command: &Command) -> String {
    let program = Path::new(command.get_program());
    let name = program.file_name().unwrap_or(command.get_program()).to_string_lossy().into_owned();
    command.get_args().fold(name, |line, argument| format!("{line} {}", argument.to_string_lossy()))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    /// Longer than a shell takes on any machine.
    const LONG: Duration = Duration::from_secs(120);

    fn shell(script: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        command
    }

    #[test]
    fn a_program_that_ends_says_how_and_what() {
        let ended = within(&mut shell("read line; echo \"out $line\"; echo err >&2; exit 3"), LONG).unwrap();
        assert_eq!(ended.status.code(), Some(3));
        assert_eq!((&ended.stdout[..], &ended.stderr[..]), (&b"out \n"[..], &b"err\n"[..]));
        // More than a pipe has room for, on both at once.
        let much = "i=0; while [ $i -lt 20000 ]; do echo 0123456789; echo 9876543210 >&2; i=$((i+1)); done";
        let ended = within(&mut shell(much), LONG).unwrap();
        assert_eq!((ended.stdout.len(), ended.stderr.len()), (220_000, 220_000));
        assert!(within(&mut Command::new("no-such-program"), LONG).is_err());
    }

    #[test]
    fn a_program_that_does_not_end_is_killed_and_says_what_it_printed() {
        let hang = "echo begun; echo trouble >&2; exec sleep 1000";
        let begun = Instant::now();
        let error = within(&mut shell(hang), Duration::from_millis(700)).unwrap_err().to_string();
        assert!(begun.elapsed() < LONG, "{error}");
        for word in ["`sh -c echo begun", "has not ended after 700ms", "begun", "trouble"] {
            assert!(error.contains(word), "{error}");
        }
        // One that closes its output and goes on is seen to be there all the same.
        let silent = within(&mut shell("exec >&- 2>&-; exec sleep 1000"), Duration::from_millis(300));
        assert!(silent.unwrap_err().to_string().contains("has not ended after 300ms"));
    }

    #[test]
    fn what_a_program_leaves_behind_is_not_waited_for_without_limit() {
        let mut command = shell("sleep 20 & echo done");
        let error = within(&mut command, Duration::from_millis(300)).unwrap_err().to_string();
        assert!(error.contains("still holds its output") && error.contains("done"), "{error}");
    }

    #[test]
    fn a_program_that_nobody_waits_for_is_killed() {
        let mut running = Limited::start(&mut shell("exec sleep 1000"), LONG).unwrap();
        let is_there = |id: u32| Path::new(&format!("/proc/{id}")).exists();
        let id = running.id();
        assert!(!running.has_ended().unwrap());
        drop(running);
        assert!(!cfg!(target_os = "linux") || !is_there(id));
    }
}
