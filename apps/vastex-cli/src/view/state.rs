//! What the program remembers from one run to the next: small files of JSON in the system's place for state.
//!
//! What cannot be written is left. What cannot be read counts as empty, and is not written over: a person may
//! mend it. What a later version wrote stays.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::Duration;
use std::{env, fs, io, process, thread};

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::report;

/// `vastex/NAME` in `$XDG_STATE_HOME`, in `%LOCALAPPDATA%` on Windows, or else in `~/.local/state`; `None` if
/// the system names none of them.
pub(super) fn place_of(name: &str) -> Option<PathBuf> {
    let named =
        |variable: &str| env::var_os(variable).map(PathBuf::from).filter(|directory| directory.is_absolute());
    let of_system = if cfg!(windows) { named("LOCALAPPDATA") } else { None };
    let states = named("XDG_STATE_HOME").or(of_system);
    Some(states.or_else(|| Some(named("HOME")?.join(".local/state")))?.join("vastex").join(name))
}

/// How often a file that another program changes is tried again, and in how long.
const TRIES: u32 = 20;
const BETWEEN: Duration = Duration::from_millis(10);

/// What is written down in a file; the default if it cannot be read.
pub(super) fn load<T: DeserializeOwned + Default>(place: &Path) -> T {
    read(place).unwrap_or_default()
}

/// What is written down in a file; the default if there is no file, or nothing in it.
pub(super) fn read<T: DeserializeOwned + Default>(place: &Path) -> io::Result<T> {
    match fs::read(place) {
        Ok(text) if text.trim_ascii().is_empty() => Ok(T::default()),
        Ok(text) => Ok(serde_json::from_slice(&text)?),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(T::default()),
        Err(error) => Err(error),
    }
}

/// Says once why what is kept in a file is so for this run alone, and what to do. Nothing is said where the
/// system names no place for it.
pub(super) fn say_once(is_said: &mut bool, place: Option<&Path>, what: &str, error: &io::Error) {
    let (Some(place), false) = (place, std::mem::replace(is_said, true)) else { return };
    let place = place.display();
    report::say(&format!(
        "note: {place}: {what} for this run alone: {error}; mend the file, move it away, or allow it to be read and written"
    ));
}

/// Keeps other programs from changing a file until what is given back is dropped. Fails where one takes
/// longer than that should take.
pub(super) fn lock(place: &Path) -> io::Result<File> {
    if let Some(directory) = place.parent() {
        fs::create_dir_all(directory)?;
    }
    let file = File::options().create(true).append(true).open(place.with_extension("lock"))?;
    for _ in 0..TRIES {
        match file.try_lock() {
            Ok(()) => return Ok(file),
            Err(TryLockError::WouldBlock) => thread::sleep(BETWEEN),
            Err(TryLockError::Error(error)) => return Err(error),
        }
    }
    Err(io::Error::new(io::ErrorKind::WouldBlock, "another program changes it"))
}

/// Makes the object of a file what `now` is, field by field. `read_as` says what this program makes of the
/// object: a field that says the same as `now` stays as it is written, and so does all that neither has:
/// fields of later versions, and values that nobody can use. Fails, and changes nothing, where the file has
/// no object that can be read, or another program changes it.
pub(super) fn change_fields<T: Serialize>(
    place: &Path,
    read_as: impl FnOnce(Value) -> T,
    now: &T,
) -> io::Result<()> {
    let _lock = lock(place)?;
    let written = read::<Value>(place)?;
    let mut fields = match &written {
        Value::Null => Map::new(),
        Value::Object(fields) => fields.clone(),
        _ => return Err(io::Error::new(io::ErrorKind::InvalidData, "it has no fields")),
    };
    let [before, now] = [serde_json::to_value(read_as(written))?, serde_json::to_value(now)?];
    if let (Value::Object(before), Value::Object(now)) = (&before, &now) {
        change(&mut fields, before, now);
    }
    write(place, &fields)
}

/// Changes fields of which `before` was made into those of which `now` is.
fn change(fields: &mut Map<String, Value>, before: &Map<String, Value>, now: &Map<String, Value>) {
    for (name, value) in now {
        match (fields.get_mut(name), before.get(name), value) {
            (Some(_), Some(before), value) if before == value => {}
            (Some(Value::Object(fields)), Some(Value::Object(before)), Value::Object(now)) => {
                change(fields, before, now);
            }
            _ => drop(fields.insert(name.clone(), value.clone())),
        }
    }
    // What was chosen is chosen no longer.
    for (name, value) in before.iter().filter(|(name, _)| !now.contains_key(*name)) {
        if let (Some(Value::Object(fields)), Value::Object(before)) = (fields.get_mut(name), value) {
            change(fields, before, &Map::new());
            if !fields.is_empty() {
                continue;
            }
        }
        fields.remove(name);
    }
}

/// Writes it down, whole or not at all.
pub(super) fn write<T: Serialize>(place: &Path, kept: &T) -> io::Result<()> {
    let text = serde_json::to_vec_pretty(kept)?;
    if let Some(directory) = place.parent() {
        fs::create_dir_all(directory)?;
    }
    let unfinished = place.with_extension(format!("{}.tmp", process::id()));
    let written = fs::write(&unfinished, text).and_then(|()| fs::rename(&unfinished, place));
    written.inspect_err(|_| drop(fs::remove_file(&unfinished)))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// What this program makes of a file: numbers, and those of a list by name.
    fn read_as(written: Value) -> Value {
        let Value::Object(fields) = written else { return json!({}) };
        let is_known = |(_, value): &(String, Value)| value.is_number() || value.is_object();
        let inner = |(name, value): (String, Value)| match value {
            Value::Object(_) => (name, read_as(value)),
            value => (name, value),
        };
        Value::Object(fields.into_iter().filter(is_known).map(inner).collect())
    }

    #[test]
    fn what_a_program_does_not_know_stays_as_it_was_written() {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join("of/state.json");
        change_fields(&place, read_as, &json!({"a": 1, "list": {"x": 1}})).unwrap();
        assert_eq!(read::<Value>(&place).unwrap(), json!({"a": 1, "list": {"x": 1}}), "the first time");
        let written = json!({
            "a": 1, "b": 2, "typo": "lanczos", "later": [1], "gone": 5,
            "list": {"x": 1, "y": 2, "typo": "?"}, "left": {"z": 1, "typo": "?"}, "all": {"z": 1}
        });
        fs::write(&place, written.to_string()).unwrap();
        change_fields(&place, read_as, &json!({"a": 1, "b": 3, "c": 4, "list": {"x": 9, "n": 1}})).unwrap();
        let expected = json!({
            "a": 1, "b": 3, "c": 4, "typo": "lanczos", "later": [1],
            "list": {"x": 9, "n": 1, "typo": "?"}, "left": {"typo": "?"}
        });
        assert_eq!(read::<Value>(&place).unwrap(), expected);
        // Who chooses something in the place of a typo wants that.
        change_fields(&place, read_as, &json!({"typo": 7})).unwrap();
        assert_eq!(read::<Value>(&place).unwrap()["typo"], json!(7));
        // Nothing is what an empty file says.
        fs::write(&place, "\n").unwrap();
        change_fields(&place, read_as, &json!({"a": 1})).unwrap();
        assert_eq!(read::<Value>(&place).unwrap(), json!({"a": 1}));
    }

    #[test]
    fn what_cannot_be_read_is_not_written_over() {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join("state.json");
        for text in ["{\"a\": 1,}", "[1]", "7", "\u{0}"] {
            fs::write(&place, text).unwrap();
            change_fields(&place, read_as, &json!({"a": 2})).unwrap_err();
            assert_eq!(fs::read_to_string(&place).unwrap(), text);
        }
        fs::write(&place, "{}").unwrap();
        let held = lock(&place).unwrap();
        let error = change_fields(&place, read_as, &json!({"a": 2})).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::WouldBlock);
        assert_eq!(fs::read_to_string(&place).unwrap(), "{}");
        drop(held);
        change_fields(&place, read_as, &json!({"a": 2})).unwrap();
    }
}
