//! What differs between two texts, line by line.

/// Lines that were and are no more, and lines that are new, which stand in one place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Change<'a> {
    /// What the lines of that place belong to: the nearest line before that is a head.
    pub(crate) head: &'a str,
    /// The line of the old text, counted from 1.
    pub(crate) line: usize,
    pub(crate) was: Vec<&'a str>,
    pub(crate) is: Vec<&'a str>,
}

/// Pairs of lines that are looked at: above, what differs is one change.
const MOST: usize = 4_000_000;

/// The changes from one text to another, in order. `is_head` tells heads from other lines.
pub(crate) fn changes<'a>(was: &'a str, is: &'a str, is_head: fn(&str) -> bool) -> Vec<Change<'a>> {
    let (was, is): (Vec<&str>, Vec<&str>) = (was.lines().collect(), is.lines().collect());
    let before = was.iter().zip(&is).take_while(|(a, b)| a == b).count();
    let after = was[before..].iter().rev().zip(is[before..].iter().rev()).take_while(|(a, b)| a == b).count();
    let (old, new) = (&was[before..was.len() - after], &is[before..is.len() - after]);
    let mut changes: Vec<Change<'a>> = Vec::new();
    let mut add = |at: usize, old: &[&'a str], new: &[&'a str]| {
        let line = before + at + 1;
        match changes.last_mut() {
            Some(last) if last.line + last.was.len() == line => {
                last.was.extend(old);
                last.is.extend(new);
            }
            _ => {
                let head = was[..before + at].iter().rev().find(|line| is_head(line)).copied();
                let (was, is) = (old.to_vec(), new.to_vec());
                changes.push(Change { head: head.unwrap_or_default(), line, was, is });
            }
        }
    };
    if old.is_empty() && new.is_empty() {
        return Vec::new();
    }
    if old.len().saturating_mul(new.len()) > MOST {
        add(0, old, new);
        return changes;
    }
    let (mut o, mut n) = (0, 0);
    let common = common(old, new);
    while o < old.len() || n < new.len() {
        let best = common[o * (new.len() + 1) + n];
        if o < old.len() && n < new.len() && old[o] == new[n] {
            (o, n) = (o + 1, n + 1);
        } else if o < old.len() && common[(o + 1) * (new.len() + 1) + n] == best {
            add(o, &old[o..=o], &[]);
            o += 1;
        } else {
            add(o, &[], &new[n..=n]);
            n += 1;
        }
    }
    changes
}

/// Lines in common of what is left of both from each pair of lines on.
fn common(old: &[&str], new: &[&str]) -> Vec<u32> {
    let width = new.len() + 1;
    let mut common = vec![0; (old.len() + 1) * width];
    for o in (0..old.len()).rev() {
        for n in (0..new.len()).rev() {
            common[o * width + n] = match old[o] == new[n] {
                true => common[(o + 1) * width + n + 1] + 1,
                false => common[(o + 1) * width + n].max(common[o * width + n + 1]),
            };
        }
    }
    common
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_that_came_went_and_changed_are_found_where_they_are() {
        let was = "frame 1\na\nb\nframe 2\nc\nd\ne\n";
        let is = "frame 1\na\nframe 2\nx\nd\ne\nf\n";
        let changes = changes(was, is, |line| line.starts_with("frame "));
        let told: Vec<_> = changes
            .iter()
            .map(|change| (change.head, change.line, change.was.join(" "), change.is.join(" ")))
            .collect();
        let line = |head, line, was: &str, is: &str| (head, line, was.to_owned(), is.to_owned());
        assert_eq!(
            told,
            [line("frame 1", 3, "b", ""), line("frame 2", 5, "c", "x"), line("frame 2", 8, "", "f")]
        );
    }

    #[test]
    fn equal_texts_have_no_changes() {
        assert_eq!(changes("a\nb\n", "a\nb\n", |_| false), []);
    }
}
