//! Shader texts in a browser: headless Chromium, which holds them to WGSL as browsers do.
//!
//! A page from a server of this program's own, on localhost, makes a module of each text and a pipeline of
//! each kind, and posts back what it was told. The suite shows the browser a part of the texts, `cargo xtask
//! campaign browser` all. A browser checks shaders on one thread, so several run at
//! once, and each takes the next texts that nobody has. Texts whose names say so it is to refuse, as it alone
//! does: where derivatives are taken behind a condition. Where there is no browser and none can be installed
//! the step is skipped, loudly; where CI runs it fails.

pub(crate) mod site;

use std::collections::{BTreeMap, HashSet};

use anyhow::{Result, bail, ensure};

use crate::outcome::Outcome;
use crate::{setup, shaders, shell};
use site::{Answer, Site};

const PAGE: &str = include_str!("browser.html");
/// Entry points of the compute shaders, by the file that has their text.
const COMPUTED: &str = r#"[["library-tables", "fill"], ["library-tables", "evict"], ["library-tables", "load"],
    ["library-tables", "write"], ["library-compact", "count"], ["library-compact", "append"],
    ["library-inline", "forget"], ["library-inline", "settle"]]"#;
/// What the names of texts begin with that are to be refused.
const TO_BE_REFUSED: &str = "refused-";
/// What the names of texts begin with of which nothing is drawn: of tests and benchmarks, of what is to be
/// refused, and of what only calls all functions of the library.
const WITHOUT_PIPELINE: [&str; 4] = ["test-", "bench-", "library-surface-", TO_BE_REFUSED];
/// Bytes of texts in one answer.
const BATCH: usize = 1 << 20;
/// Browsers at work at once, at most; each needs some 500 MiB.
const BROWSERS: usize = 4;
/// Faults that are shown.
const SHOWN: usize = 20;
/// Of so many texts that no test used and that declare nothing new the suite shows one.
const ONE_OF: u64 = 16;

/// The step: a module of every text that `is_shown` names, and every pipeline.
pub(crate) fn check() -> Result<Outcome> {
    check_texts(false)
}

/// `cargo xtask campaign browser`: a module of every text there is, written anew, and every pipeline. It
/// takes two minutes of two processors.
pub(crate) fn campaign() -> Result<()> {
    match check_texts(true)? {
        Outcome::Passed => Ok(()),
        Outcome::Skipped(why) => bail!("nothing was shown: {why}"),
    }
}

fn check_texts(are_all_shown: bool) -> Result<Outcome> {
    if let Err(error) = setup::ensure(&setup::BROWSER) {
        if shell::is_ci() {
            return Err(error);
        }
        println!("\n!!!! SKIPPED: {error:#}, so nothing says whether browsers take the shaders !!!!\n");
        return Ok(Outcome::Skipped("no browser".to_owned()));
    }
    // In the suite the step `shaders` has written them.
    if are_all_shown || !shaders::written_to_be_refused().is_dir() {
        shaders::write_anew()?;
    }
    let mut texts: BTreeMap<String, String> = shaders::texts(&shaders::written())?.into_iter().collect();
    texts.extend(shaders::texts(&shaders::written_to_be_refused())?);
    if let Some((entry, text)) = without_pipeline(&texts) {
        bail!("xtask/src/browser.html makes no pipeline of the entry point {entry}, which {text} has");
    }
    let used = if are_all_shown { HashSet::new() } else { used()? };
    let shown: Vec<(&str, &str)> = match are_all_shown {
        true => texts.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect(),
        false => part(&texts, &used),
    };
    if !are_all_shown {
        println!(
            "{} of {} texts are shown: the {} that tests used, those that declare what none before them does, and \
             one of {ONE_OF} of the others; `cargo xtask campaign browser` shows all",
            shown.len(),
            texts.len(),
            count_used(&texts, &used)?
        );
    }
    let at_once = std::thread::available_parallelism().map_or(1, usize::from).min(BROWSERS);
    let mut told = Told::new(&texts, &shown, at_once);
    site::show(&mut told, at_once)?;
    if !told.wrong.is_empty() {
        let shown: Vec<&str> = told.wrong.iter().take(SHOWN).map(String::as_str).collect();
        bail!("the browser has {} complaints, such as\n{}", told.wrong.len(), shown.join("\n"));
    }
    if told.modules != shown.len() {
        bail!("the browser has made {} modules of {} texts", told.modules, shown.len());
    }
    let to_be_refused = texts.keys().filter(|name| name.starts_with(TO_BE_REFUSED)).count();
    if to_be_refused == 0 || told.refused != to_be_refused {
        bail!("the browser has refused {} of {to_be_refused} texts that it is to refuse", told.refused);
    }
    if told.pipelines_made == 0 || told.pipelines_made != told.pipelines_of_page {
        bail!("the browser has made {} pipelines of {}", told.pipelines_made, told.pipelines_of_page);
    }
    println!(
        "{at_once} browsers took {} texts without a word, but for {to_be_refused} that they are to refuse; each said:",
        shown.len()
    );
    told.done.iter().for_each(|done| println!("  {done}"));
    Ok(Outcome::Passed)
}

/// The texts that tests and the window have handed to a device since the step `tests` last began, be it in an
/// earlier run; none where nothing has.
fn used() -> Result<HashSet<String>> {
    let place = shaders::handed_over();
    if !place.is_dir() {
        return Ok(HashSet::new());
    }
    Ok(shaders::texts(&place)?.into_iter().map(|(_, text)| text).collect())
}

/// How many of the texts were used. Some are, where any were: otherwise names or bytes are compared that are
/// no longer alike.
fn count_used(texts: &BTreeMap<String, String>, used: &HashSet<String>) -> Result<usize> {
    let count = texts.values().filter(|text| used.contains(*text)).count();
    ensure!(
        count > 0 || used.is_empty(),
        "tests handed {} texts to devices, and none of them is among the {} that are written",
        used.len(),
        texts.len()
    );
    Ok(count)
}

/// The texts that the suite shows: those that [`is_drawn`], and of the others each that declares something
/// that no text before it does, so that a browser sees every function, structure, binding and constant there
/// is. What the page makes pipelines of it has besides.
fn part<'a>(texts: &'a BTreeMap<String, String>, used: &HashSet<String>) -> Vec<(&'a str, &'a str)> {
    let texts = texts.iter().map(|(name, text)| (name.as_str(), text.as_str()));
    let (mut shown, others): (Vec<_>, Vec<_>) = texts.partition(|(name, text)| is_drawn(name, text, used));
    let mut seen: HashSet<&str> = shown.iter().flat_map(|(_, text)| declarations(text)).collect();
    for (name, text) in others {
        let before = seen.len();
        seen.extend(declarations(text));
        if seen.len() > before {
            shown.push((name, text));
        }
    }
    shown.sort_unstable();
    shown
}

/// Returns true for a text that the tests used, for one that is to be refused, and of the others for a fixed
/// sample by their names, so that a new text moves no other one into the sample or out of it.
fn is_drawn(name: &str, text: &str, used: &HashSet<String>) -> bool {
    name.starts_with(TO_BE_REFUSED) || used.contains(text) || drawn(name).is_multiple_of(ONE_OF)
}

/// The declarations of a text: what stands on a line of its own, and what ends with a brace at the beginning
/// of a line, with the lines of comments and attributes above it.
fn declarations(text: &str) -> impl Iterator<Item = &str> {
    let (mut rest, mut is_within) = (text, false);
    let mut begun = 0;
    std::iter::from_fn(move || {
        while let Some(line) = rest[begun..].split_inclusive('\n').next() {
            begun += line.len();
            let line = line.trim_end();
            let ends = if is_within { line == "}" } else { line.ends_with([';', '}']) };
            is_within = (is_within || line.ends_with('{')) && line != "}";
            if ends {
                let (declaration, after) = rest.split_at(begun);
                (rest, begun) = (after, 0);
                return Some(declaration.trim_start());
            }
        }
        let last = std::mem::take(&mut rest);
        begun = 0;
        (!last.trim().is_empty()).then_some(last)
    })
}

/// A number by chance that is a name's: FNV-1a, the upper half folded into the lower one, whose last bits
/// alone depend on few bits of the name.
fn drawn(name: &str) -> u64 {
    const SEED: u64 = 0xcbf2_9ce4_8422_2325;
    let number = name
        .bytes()
        .fold(SEED, |number, byte| (number ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    number ^ (number >> 32)
}

/// What the pages ask for, and what they have said.
struct Told<'a> {
    /// All there are, since pipelines are made of some that are not shown.
    texts: &'a BTreeMap<String, String>,
    /// Of those that are shown: not taken yet.
    batches: Vec<Vec<(&'a str, &'a str)>>,
    /// How many of the pipelines, which the page numbers, are taken.
    pipelines: usize,
    /// How many of them the pages say they have made, and how many there are.
    pipelines_made: usize,
    pipelines_of_page: usize,
    /// How many modules the pages say they have made, and how many of those they have refused as they should.
    modules: usize,
    refused: usize,
    wrong: Vec<String>,
    /// What each page said at its end, and how many pages there are.
    done: Vec<String>,
    pages: usize,
}

impl<'a> Told<'a> {
    /// The texts that are shown are taken in batches.
    fn new(texts: &'a BTreeMap<String, String>, shown: &[(&'a str, &'a str)], pages: usize) -> Told<'a> {
        let (mut batches, mut bytes) = (vec![Vec::new()], 0);
        for (name, text) in shown {
            if bytes > BATCH {
                batches.push(Vec::new());
                bytes = 0;
            }
            bytes += text.len();
            if let Some(batch) = batches.last_mut() {
                batch.push((*name, *text));
            }
        }
        let (wrong, done) = (Vec::new(), Vec::new());
        Told {
            texts,
            batches,
            pipelines: 0,
            pipelines_made: 0,
            pipelines_of_page: 0,
            modules: 0,
            refused: 0,
            wrong,
            done,
            pages,
        }
    }
}

impl Site for Told<'_> {
    fn respond(&mut self, path: &str, body: &str) -> Answer {
        if let Some(name) = path.strip_prefix("/text/") {
            return self.texts.get(name).map_or_else(Answer::missing, Answer::plain);
        }
        match path {
            "/" => return Answer::of("text/html; charset=utf-8", page()),
            "/take/texts" => {
                let Some(batch) = self.batches.pop() else { return Answer::empty() };
                let texts: String =
                    batch.iter().map(|(name, text)| format!("{name}\u{1}{text}\u{1}")).collect();
                return Answer::plain(texts);
            }
            "/take/pipeline" => {
                self.pipelines += 1;
                return Answer::plain((self.pipelines - 1).to_string());
            }
            "/pipeline" => {
                self.pipelines_made += 1;
                self.pipelines_of_page = body.parse().unwrap_or(0);
            }
            "/made" => self.modules += body.parse().unwrap_or(0),
            "/refused" => self.refused += 1,
            "/wrong" => self.wrong.push(body.to_owned()),
            "/done" => self.done.push(body.to_owned()),
            _ => return Answer::missing(),
        }
        Answer::plain("")
    }

    fn is_done(&self) -> bool {
        self.done.len() >= self.pages
    }
}

/// An entry point of a text that is drawn or computed with, of which the page makes no pipeline; `None` if
/// there is one of each.
fn without_pipeline(texts: &BTreeMap<String, String>) -> Option<(&str, &str)> {
    let page = page();
    let is_drawn = |name: &str| !WITHOUT_PIPELINE.iter().any(|family| name.starts_with(family));
    let of_texts = texts.iter().filter(|(name, _)| is_drawn(name));
    let entries: BTreeMap<&str, &str> = of_texts
        .flat_map(|(name, text)| entry_points(text).map(move |entry| (entry, name.as_str())))
        .collect();
    entries.into_iter().find(|(entry, _)| !page.contains(&format!("\"{entry}\"")))
}

/// The names of the entry points of a text.
fn entry_points(text: &str) -> impl Iterator<Item = &str> {
    const STAGES: [&str; 3] = ["@vertex", "@fragment", "@compute"];
    let of_stage = |stage| text.match_indices(stage).map(|(at, _)| &text[at..]);
    STAGES.into_iter().flat_map(of_stage).filter_map(|from| {
        let named = from.split_once("fn ")?.1;
        named.split('(').next()
    })
}

fn page() -> String {
    PAGE.replace("COMPUTED_ENTRIES", COMPUTED).replace("TO_BE_REFUSED", &format!("{TO_BE_REFUSED:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_text_that_is_shown_is_taken_once_and_all_can_be_had() {
        let texts: BTreeMap<String, String> =
            (0..40).map(|n| (format!("{n}.wgsl"), "x".repeat(BATCH / 7))).collect();
        let shown: Vec<(&str, &str)> =
            texts.iter().skip(3).map(|(name, text)| (name.as_str(), text.as_str())).collect();
        let mut told = Told::new(&texts, &shown, 1);
        let asked = |told: &mut Told<'_>, path: &str| {
            let Answer { status, body, .. } = told.respond(path, "");
            (status, String::from_utf8(body).unwrap())
        };
        let mut taken = Vec::new();
        loop {
            let (status, batch) = asked(&mut told, "/take/texts");
            if status == "204 No Content" {
                break;
            }
            taken.extend(batch.split('\u{1}').step_by(2).filter(|name| !name.is_empty()).map(str::to_owned));
        }
        taken.sort();
        assert_eq!(taken, texts.keys().skip(3).cloned().collect::<Vec<_>>());
        assert_eq!(asked(&mut told, "/text/0.wgsl").0, "200 OK");
        assert_eq!(asked(&mut told, "/take/pipeline").1, "0");
        assert_eq!(asked(&mut told, "/take/pipeline").1, "1");
        assert_eq!(asked(&mut told, "/text/none.wgsl").0, "404 Not Found");
        assert!(asked(&mut told, "/").1.contains("name.startsWith(\"refused-\")"));
        told.respond("/refused", "refused-a: derivatives");
        told.respond("/made", "17");
        told.respond("/made", "3");
        told.respond("/pipeline", "7");
        told.respond("/pipeline", "7");
        told.respond("/wrong", "a: b");
        assert!(!told.is_done());
        told.respond("/done", "all");
        assert_eq!((told.modules, told.refused, told.wrong.len()), (20, 1, 1));
        assert!(told.is_done() && told.done == ["all"]);
        assert_eq!((told.pipelines_made, told.pipelines_of_page), (2, 7));
    }

    #[test]
    fn the_suite_shows_what_tests_used_what_is_refused_and_a_fixed_part_of_the_rest() {
        let used = HashSet::from(["used".to_owned()]);
        let names: Vec<String> = (0..16_000).map(|n| format!("scene-{n}.wgsl")).collect();
        let shown = names.iter().filter(|name| is_drawn(name, "other", &used)).count();
        assert!((900..1100).contains(&shown), "{shown} of {}", names.len());
        assert!(names.iter().all(|name| is_drawn(name, "used", &used)));
        let refused = names.iter().map(|name| format!("{TO_BE_REFUSED}{name}"));
        assert!(refused.into_iter().all(|name| is_drawn(&name, "other", &used)));
        // The sample is the same each time.
        assert_eq!(drawn("scene-0.wgsl"), drawn("scene-0.wgsl"));
        assert_eq!(drawn(""), 0xcbf2_9ce4_8422_2325 ^ 0xcbf2_9ce4);
    }

    #[test]
    fn whatever_is_declared_anywhere_is_shown_in_some_text() {
        let own = |n: usize| format!("@group(0) @binding({n}) var<uniform> own_{n}: u32;\n");
        let common = "// A function.\nfn common() {\n    if true {\n    }\n}\n";
        let other = "struct Other {\n    a: u32,\n}\nfn last() {}\n";
        assert_eq!(
            declarations(&[&own(0), common, other].concat()).collect::<Vec<_>>(),
            [&own(0), common, "struct Other {\n    a: u32,\n}\n", "fn last() {}\n"]
        );
        let mut texts: BTreeMap<String, String> =
            (0..200).map(|n| (format!("{n:03}.wgsl"), [&own(n % 7), common].concat())).collect();
        let of_own = |shown: &[(&str, &str)], n| shown.iter().any(|(_, text)| text.starts_with(&own(n)));
        let before = part(&texts, &HashSet::new()).len();
        assert!((7..40).contains(&before), "{before}");
        assert!((0..7).all(|n| of_own(&part(&texts, &HashSet::new()), n)));
        // A text that is not drawn, with a function that no other has.
        let name = (0..).map(|n| format!("x{n}")).find(|name| !drawn(name).is_multiple_of(ONE_OF)).unwrap();
        texts.insert(name.clone(), [&own(0), common, other].concat());
        let shown = part(&texts, &HashSet::new());
        assert!(shown.len() == before + 1 && shown.iter().any(|(shown, _)| *shown == name));
        assert!(shown.is_sorted());
    }

    #[test]
    fn texts_that_were_used_are_counted_among_the_written_ones() {
        let texts: BTreeMap<String, String> =
            ["a", "b", "c"].map(|text| (format!("{text}.wgsl"), text.to_owned())).into();
        let counted = |used: &[&str]| {
            count_used(&texts, &used.iter().map(|&text| text.to_owned()).collect()).map_err(|e| e.to_string())
        };
        assert_eq!(counted(&["a", "c", "gone"]), Ok(2));
        assert_eq!(counted(&[]), Ok(0));
        let none = counted(&["gone"]).unwrap_err();
        assert!(none.contains("1 texts") && none.contains("among the 3"), "{none}");
    }

    #[test]
    fn an_entry_point_without_a_pipeline_is_named() {
        let text = "@vertex\nfn encode_fill(@builtin(vertex_index) n: u32) -> A {}\n@fragment fn encode() {}";
        assert_eq!(entry_points(text).collect::<Vec<_>>(), ["encode_fill", "encode"]);
        let texts = |name: &str, text: &str| BTreeMap::from([(name.to_owned(), text.to_owned())]);
        assert_eq!(without_pipeline(&texts("encode", text)), None);
        let forgotten = "@compute @workgroup_size(64)\nfn forgotten() {}";
        assert_eq!(without_pipeline(&texts("encode", forgotten)), Some(("forgotten", "encode")));
        assert_eq!(without_pipeline(&texts("test-encode", forgotten)), None);
    }
}
