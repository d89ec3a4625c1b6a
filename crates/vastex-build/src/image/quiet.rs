//! Panics of other people's decoders that become errors here: caught, and nothing is printed of them.
//!
//! What is printed of a panic is the hook's business, and there is one hook for the whole program. So the
//! first call puts one in front of whatever hook there is, which says nothing while its thread is in here,
//! and hands on everything else.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;
use std::thread;

thread_local! {
    /// True if this thread's panics are caught in here.
    static IS_QUIET: Cell<bool> = const { Cell::new(false) };
}

static HOOK: Once = Once::new();

/// Runs something that may panic, without a word. Nothing that it was given may be used after a panic. A hook
/// that the program sets later is asked as ever.
pub(super) fn catch<R>(run: impl FnOnce() -> R) -> thread::Result<R> {
    // Hooks cannot be changed while a thread unwinds.
    if !thread::panicking() {
        HOOK.call_once(|| {
            let before = take_hook();
            set_hook(Box::new(move |panic| {
                if !IS_QUIET.try_with(Cell::get).unwrap_or(false) {
                    before(panic);
                }
            }));
        });
    }
    let was_quiet = IS_QUIET.replace(true);
    let result = catch_unwind(AssertUnwindSafe(run));
    IS_QUIET.set(was_quiet);
    result
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use super::*;

    const CHILD: &str = "VASTEX_TEST_QUIET";

    /// Runs itself in a process of its own, of which everything that it prints is seen.
    #[test]
    fn nothing_is_printed_of_what_is_caught_and_everything_of_other_panics() {
        if std::env::var_os(CHILD).is_some() {
            assert!(catch(|| panic!("a caught one")).is_err());
            assert!(catch_unwind(|| panic!("a loud one")).is_err());
            assert!(catch(|| catch(|| panic!("a caught one")).is_err()).is_ok_and(|is_caught| is_caught));
            let other = thread::spawn(|| panic!("one of another thread"));
            assert!(catch(|| other.join().is_err()).is_ok_and(|has_panicked| has_panicked));
            return;
        }
        let module = module_path!().split_once("::").unwrap().1;
        let name = format!("{module}::nothing_is_printed_of_what_is_caught_and_everything_of_other_panics");
        let mut child = Command::new(std::env::current_exe().unwrap());
        let ran = child.args(["--exact", &name, "--nocapture"]).env(CHILD, "1").output().unwrap();
        let said = String::from_utf8_lossy(&ran.stderr);
        assert!(ran.status.success() && String::from_utf8_lossy(&ran.stdout).contains("1 passed"), "{said}");
        let told = ["a caught one", "a loud one", "one of another thread"].map(|one| said.contains(one));
        assert_eq!(told, [false, true, true], "{said}");
    }
}
