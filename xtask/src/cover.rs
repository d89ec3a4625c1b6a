//! A sample of names that stands for all of them: whatever two words stand together in some name do so in one
//! of the sample.
//!
//! The names are those of variants, such as of shader texts: words joined by `-`, one for each thing in which
//! variants differ. Most faults of variants come of one choice or of two together, and such a sample of
//! thousands of names is some hundreds (pairwise testing: R. Kuhn, D. Wallace, A. Gallo, "Software fault
//! interactions and implications for software testing", IEEE TSE 30(6), 2004).

use std::collections::{BTreeSet, HashSet};

/// Two words at their places, in names of a family: those of the same first word that have as many words.
type Pair<'a> = (&'a str, usize, [(usize, &'a str); 2]);

/// Such a sample, always the same of the same names. Names of a single word are in it. Greedy, so not the
/// smallest there is; some 0.1 s for 5,000 names.
pub(crate) fn of_pairs<'a>(names: impl IntoIterator<Item = &'a str>) -> BTreeSet<&'a str> {
    let mut left: Vec<(&str, Vec<Pair<'_>>)> =
        names.into_iter().map(|name| (name, pairs(name).collect())).collect();
    let (mut sample, mut covered) = (BTreeSet::new(), HashSet::new());
    left.retain(|(name, pairs)| !pairs.is_empty() || !sample.insert(*name));
    // Those that bring many new pairs come first: a name is looked at once for each number of pairs that it
    // may bring.
    let most = left.iter().map(|(_, pairs)| pairs.len()).max().unwrap_or(0);
    for wanted in (1..=most).rev() {
        left.retain_mut(|(name, pairs)| {
            if pairs.len() < wanted {
                return true;
            }
            pairs.retain(|pair| !covered.contains(pair));
            if pairs.len() >= wanted {
                sample.insert(*name);
                covered.extend(pairs.drain(..));
            }
            !pairs.is_empty()
        });
    }
    sample
}

fn pairs(name: &str) -> impl Iterator<Item = Pair<'_>> {
    let words: Vec<&str> = name.split('-').collect();
    let (first, count) = (words[0], words.len());
    (0..count).flat_map(move |before| {
        let words = words.clone();
        (before + 1..count).map(move |n| (first, count, [(before, words[before]), (n, words[n])]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_of_words_is_in_a_small_sample() {
        let filters = ["nearest", "bilinear", "trilinear", "bicubic"];
        let mut names = vec!["encode".to_owned(), "library-tables".to_owned()];
        for (filter, way, kind) in filters.into_iter().flat_map(|filter| {
            ["inline", "raw", "separate"]
                .into_iter()
                .flat_map(move |way| ["direct", "hashed"].map(|kind| (filter, way, kind)))
        }) {
            names.push(format!("scene-{filter}-{way}-{kind}"));
        }
        let sample = of_pairs(names.iter().map(String::as_str));
        let all: HashSet<Pair<'_>> = names.iter().flat_map(|name| pairs(name)).collect();
        let sampled: HashSet<Pair<'_>> = sample.iter().flat_map(|name| pairs(name)).collect();
        assert_eq!(sampled, all);
        assert!(sample.contains("encode") && sample.contains("library-tables"));
        assert!((14..=18).contains(&sample.len()), "4 filters in 3 ways, and two others: {sample:?}");
        assert_eq!(sample, of_pairs(names.iter().map(String::as_str)));
        assert!(of_pairs([]).is_empty());
    }
}
