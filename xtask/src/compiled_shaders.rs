//! What Mesa's drivers have compiled stays of use to programs whose cache is a place of their own: to compile
//! it again takes longer than small pictures do.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Command;

/// Names to Mesa the directory in which it keeps what it has compiled.
const PLACE: &str = "MESA_SHADER_CACHE_DIR";

/// Has a command find what was compiled by programs whose cache is this one's, whatever it is told of caches
/// else. A place that a person has named to Mesa is left alone.
pub fn share(command: &mut Command) -> &mut Command {
    command.envs(place(|name| std::env::var_os(name)).map(|place| (PLACE, place)))
}

/// Where Mesa keeps it by these variables; `None` where it is told so already, or there is no home.
fn place(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let set = |name| variable(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    if set(PLACE).is_some() {
        return None;
    }
    set("XDG_CACHE_HOME").or_else(|| Some(set("HOME")?.join(".cache")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_that_a_person_has_named_is_left_alone_and_an_empty_one_is_none() {
        let place = |set: &[(&str, &str)]| {
            let place = place(|name| set.iter().find(|(there, _)| *there == name).map(|(_, at)| at.into()));
            place.map(|place| place.to_string_lossy().into_owned())
        };
        let (home, caches) = (("HOME", "/home"), ("XDG_CACHE_HOME", "/caches"));
        assert_eq!(place(&[home]).as_deref(), Some("/home/.cache"));
        assert_eq!(place(&[home, caches]).as_deref(), Some("/caches"));
        assert_eq!(place(&[home, ("XDG_CACHE_HOME", "")]).as_deref(), Some("/home/.cache"));
        assert_eq!(place(&[home, caches, (PLACE, "/own")]), None);
        assert_eq!(place(&[]), None);
    }
}
