//! The leaves of a JSON text: where each is and what it is. Enough to list keys, and to read what cargo says
//! of what it built.

use anyhow::{Result, bail};

/// A value without parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// The keys that lead to it, as in `.tiles[].size`.
    pub path: String,
    /// `number`, `string`, `true or false`, `null`, or `nothing` for an empty list or object.
    pub kind: &'static str,
    /// Of a string what it says, of everything else what stands there.
    pub text: String,
}

/// The leaves of the first value of a text, in order.
pub fn leaves(text: &str) -> Result<Vec<Leaf>> {
    let mut reader = Reader { rest: text, leaves: Vec::new() };
    reader.value("")?;
    Ok(reader.leaves)
}

struct Reader<'a> {
    rest: &'a str,
    leaves: Vec<Leaf>,
}

impl Reader<'_> {
    fn value(&mut self, path: &str) -> Result<()> {
        self.rest = self.rest.trim_start();
        let before = self.leaves.len();
        match self.rest.chars().next() {
            Some('{') => {
                self.parts('}', |reader| {
                    let key = reader.string()?;
                    reader.take(':')?;
                    reader.value(&format!("{path}.{key}"))
                })?;
                self.nothing(before, path);
            }
            Some('[') => {
                self.parts(']', |reader| reader.value(&format!("{path}[]")))?;
                self.nothing(before, path);
            }
            Some('"') => {
                let text = self.string()?;
                self.leaf(path, "string", text);
            }
            Some(_) => {
                let end = self.rest.find([',', '}', ']', ' ', '\n']).unwrap_or(self.rest.len());
                let (word, rest) = self.rest.split_at(end);
                self.rest = rest;
                let kind = match word {
                    "true" | "false" => "true or false",
                    "null" => "null",
                    _ if word.parse::<f64>().is_ok() => "number",
                    _ => bail!("'{word}' is no JSON"),
                };
                self.leaf(path, kind, word.to_owned());
            }
            None => bail!("the JSON ends early"),
        }
        Ok(())
    }

    fn leaf(&mut self, path: &str, kind: &'static str, text: String) {
        self.leaves.push(Leaf { path: path.to_owned(), kind, text });
    }

    fn nothing(&mut self, before: usize, path: &str) {
        if self.leaves.len() == before {
            self.leaf(path, "nothing", String::new());
        }
    }

    /// The parts of an object or a list, up to its end.
    fn parts(&mut self, end: char, part: impl Fn(&mut Self) -> Result<()>) -> Result<()> {
        self.rest = &self.rest[1..];
        loop {
            self.rest = self.rest.trim_start_matches([' ', '\n', '\t', '\r', ',']);
            if self.rest.starts_with(end) {
                return self.take(end);
            }
            part(self)?;
        }
    }

    fn take(&mut self, sign: char) -> Result<()> {
        match self.rest.trim_start().strip_prefix(sign) {
            Some(rest) => self.rest = rest,
            None => bail!("the JSON has no '{sign}' where one is due"),
        }
        Ok(())
    }

    fn string(&mut self) -> Result<String> {
        self.take('"')?;
        let mut text = String::new();
        let mut signs = self.rest.char_indices();
        while let Some((at, sign)) = signs.next() {
            match sign {
                '"' => {
                    self.rest = &self.rest[at + 1..];
                    return Ok(text);
                }
                // What is escaped is taken as it stands: keys and paths have nothing else.
                '\\' => text.extend(signs.next().map(|(_, escaped)| escaped)),
                sign => text.push(sign),
            }
        }
        bail!("a string of the JSON has no end")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_are_found_with_their_paths_and_kinds() {
        let text = r#"{"a": [1, {"b": "x\"}", "c": true}], "d": {}, "e": null, "f": -1.5e3 }"#;
        let leaves: Vec<_> = leaves(text).unwrap().into_iter().map(|l| (l.path, l.kind, l.text)).collect();
        let leaf = |path: &str, kind, text: &str| (path.to_owned(), kind, text.to_owned());
        assert_eq!(
            leaves,
            [
                leaf(".a[]", "number", "1"),
                leaf(".a[].b", "string", "x\"}"),
                leaf(".a[].c", "true or false", "true"),
                leaf(".d", "nothing", ""),
                leaf(".e", "null", "null"),
                leaf(".f", "number", "-1.5e3"),
            ]
        );
        for bad in ["", "{", "{\"a\" 1}", "[1", "\"a", "nul"] {
            assert!(super::leaves(bad).is_err(), "{bad}");
        }
    }
}
