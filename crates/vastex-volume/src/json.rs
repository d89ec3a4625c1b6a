//! JSON as others write it: bare NaN and infinities are taken as strings, and a mark of the byte order is
//! left out.

use serde_json::Value;

use crate::fault::{Oddities, VolumeError, VolumeFault, damaged};
use crate::keys::{KeyStore, Span, shown};

/// Bytes that metadata may have: those of a plate with all of its images are some megabytes, and as values in
/// memory they take up to a hundred times as much.
pub(crate) const MOST_METADATA: u64 = 8 << 20;

/// Reads metadata; `None` if there is no such key. What was wrong with the text is added to `oddities`.
pub(crate) async fn read_json(
    keys: &dyn KeyStore,
    key: &str,
    oddities: &mut Oddities,
) -> Result<Option<Value>, VolumeError> {
    let read = keys.read(key, Span::Whole { most: MOST_METADATA }).await;
    let read = read.map_err(|error| match error.fault {
        VolumeFault::TooLarge(_) => VolumeFault::TooLarge(format!(
            "has more than {} MiB of metadata, which is the most that is read; take out of it what is not of the image",
            MOST_METADATA >> 20
        ))
        .at(error.path),
        _ => error,
    });
    let Some(bytes) = read? else { return Ok(None) };
    let (value, is_odd) = parse(&bytes).map_err(|fault| fault.at(shown(keys, key)))?;
    if is_odd {
        oddities.push(format!(
            "{key}: has NaN or infinities, which are no JSON; they are taken as if they were quoted"
        ));
    }
    Ok(Some(value))
}

/// The value of a text, and whether it had to be mended.
pub(crate) fn parse(bytes: &[u8]) -> Result<(Value, bool), VolumeFault> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let error = match serde_json::from_slice(bytes) {
        Ok(value) => return Ok((value, false)),
        Err(error) => error,
    };
    let wrong = || damaged(format!("is no sound JSON: {error}"));
    let text = std::str::from_utf8(bytes).map_err(|_| wrong())?;
    match quote_bare(text).map(|mended| serde_json::from_str(&mended)) {
        Some(Ok(value)) => Ok((value, true)),
        _ => Err(wrong()),
    }
}

/// The text with quotes about bare NaN and infinities; `None` if there are none.
fn quote_bare(text: &str) -> Option<String> {
    const BARE: [&str; 3] = ["-Infinity", "Infinity", "NaN"];
    let mut mended = String::with_capacity(text.len() + 16);
    let mut is_mended = false;
    let mut is_quoted = false;
    let mut rest = text;
    while let Some(character) = rest.chars().next() {
        let bare = BARE.iter().find(|bare| !is_quoted && rest.starts_with(**bare));
        if let Some(bare) = bare {
            mended.push_str(&format!("\"{bare}\""));
            rest = &rest[bare.len()..];
            is_mended = true;
            continue;
        }
        let taken = match character {
            '\\' if is_quoted => 1 + rest[1..].chars().next().map_or(0, char::len_utf8),
            other => other.len_utf8(),
        };
        is_quoted ^= character == '"';
        mended.push_str(&rest[..taken]);
        rest = &rest[taken..];
    }
    is_mended.then_some(mended)
}

/// A number, also one that is written as a string, if it is finite.
pub(crate) fn finite(value: &Value) -> Option<f64> {
    let number = match value {
        Value::Number(number) => number.as_f64(),
        Value::String(text) => text.trim().parse().ok(),
        _ => None,
    };
    number.filter(|number| number.is_finite())
}

/// The text of a value.
pub(crate) fn text<'a>(value: &'a Value, key: &str) -> Option<&'a str> {
    value.get(key)?.as_str()
}

/// The values of a list; none where there is no list.
pub(crate) fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn bare_numbers_are_mended_and_strings_stay() {
        let odd = br#"{"a": NaN, "b": [-Infinity, Infinity], "NaN": "is \" NaN"}"#;
        let (value, is_odd) = parse(odd).unwrap();
        assert!(is_odd);
        assert_eq!(value, json!({"a": "NaN", "b": ["-Infinity", "Infinity"], "NaN": "is \" NaN"}));
        assert_eq!(parse(b"\xef\xbb\xbf[1]").unwrap(), (json!([1]), false));
        for bad in [&b"{"[..], b"{NaN", b"", b"\"\\", b"\xff", b"[NaN, \"\xc3\"]"] {
            assert!(parse(bad).is_err(), "{bad:?}");
        }
        let deep = "[".repeat(100_000);
        assert!(parse(deep.as_bytes()).is_err());
    }
}
