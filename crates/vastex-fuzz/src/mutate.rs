//! Mutations: what goes wrong with files, on disks, in transfers and by intent.

use crate::reseal::reseal;
use crate::rng::Rng;
use crate::targets::{Form, Target};
use crate::tree::Tree;

/// Numbers at which arithmetic goes wrong.
const NUMBERS: [u64; 16] = [
    0,
    1,
    2,
    3,
    7,
    8,
    0x7f,
    0xff,
    0x100,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0xffff_ffff,
    0x1_0000_0000,
    0x7fff_ffff_ffff_ffff,
    u64::MAX,
];

/// Bytes beyond which nothing grows.
const MAX_BYTES: usize = 1 << 18;

/// Damages an input of the target in one to four places, as `seed` says. Half of the time checksums are made
/// right again.
pub fn mutate(target: &Target, input: &[u8], seed: u64) -> Vec<u8> {
    let mut rng = Rng::new(seed);
    match target.form {
        Form::File => {
            let mut bytes = input.to_vec();
            damage(&mut bytes, &mut rng);
            bytes
        }
        Form::Tree => {
            let mut tree = Tree::decode(input);
            for _ in 0..1 + rng.below(2) {
                damage_tree(&mut tree, &mut rng);
            }
            tree.encode()
        }
    }
}

fn damage_tree(tree: &mut Tree, rng: &mut Rng) {
    if tree.files.is_empty() {
        return;
    }
    let at = rng.below(tree.files.len());
    match rng.below(12) {
        0 => drop(tree.files.remove(at)),
        1 => tree.files[at].1.clear(),
        2 => tree.files[at].0 = renamed(&tree.files[at].0, rng),
        3 => {
            let (name, content) = tree.files[at].clone();
            tree.files.push((renamed(&name, rng), content));
        }
        4 => {
            let other = rng.below(tree.files.len());
            let content = tree.files[other].1.clone();
            tree.files[at].1 = content;
        }
        // A directory where a file was.
        5 => tree.files[at].0.push_str("/x"),
        _ => damage(&mut tree.files[at].1, rng),
    }
}

fn renamed(name: &str, rng: &mut Rng) -> String {
    let mut bytes = name.as_bytes().to_vec();
    if !put_text_number(&mut bytes, rng) || rng.one_in(4) {
        change(&mut bytes, rng);
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn damage(bytes: &mut Vec<u8>, rng: &mut Rng) {
    for _ in 0..1 + rng.below(4) {
        change(bytes, rng);
    }
    bytes.truncate(MAX_BYTES);
    if rng.one_in(2) {
        reseal(bytes);
    }
}

fn change(bytes: &mut Vec<u8>, rng: &mut Rng) {
    let at = rng.below(bytes.len());
    match rng.below(12) {
        0..=2 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << rng.below(8);
            }
        }
        3 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte = rng.next() as u8;
            }
        }
        4 | 5 => put_number(bytes, at, rng),
        6 => drop(put_text_number(bytes, rng)),
        7 => {
            let count = 1 + rng.below(16);
            let new: Vec<u8> = (0..count).map(|_| rng.next() as u8).collect();
            bytes.splice(at..at, new);
        }
        8 => drop(bytes.drain(at..at + rng.below(bytes.len() - at + 1).min(64))),
        9 => bytes.truncate(at),
        10 => {
            let run = bytes[at..at + rng.below(bytes.len() - at + 1).min(64)].to_vec();
            let to = rng.below(bytes.len());
            bytes.splice(to..to, run);
        }
        _ => {
            let run = bytes[at..at + rng.below(bytes.len() - at + 1).min(16)].to_vec();
            let to = rng.below(bytes.len() - run.len() + 1);
            bytes[to..to + run.len()].copy_from_slice(&run);
        }
    }
}

/// A number of 1 to 8 bytes in either order: one at which arithmetic goes wrong, or one beside what is there.
fn put_number(bytes: &mut [u8], at: usize, rng: &mut Rng) {
    let width = rng.pick(&[1, 2, 4, 8]);
    let Some(place) = bytes.get_mut(at..at + width) else { return };
    let is_little = rng.one_in(2);
    if !is_little {
        place.reverse();
    }
    let there = place.iter().rev().fold(0u64, |sum, &byte| sum << 8 | u64::from(byte));
    let new = match rng.below(3) {
        0 => there.wrapping_add(rng.below(9) as u64).wrapping_sub(4),
        _ => rng.pick(&NUMBERS).wrapping_sub(rng.below(2) as u64),
    };
    place.copy_from_slice(&new.to_le_bytes()[..width]);
    if !is_little {
        place.reverse();
    }
}

/// Another number in place of one that is written in digits; whether there was one.
fn put_text_number(bytes: &mut Vec<u8>, rng: &mut Rng) -> bool {
    let starts: Vec<usize> = (0..bytes.len().min(4096))
        .filter(|&at| bytes[at].is_ascii_digit() && (at == 0 || !bytes[at - 1].is_ascii_digit()))
        .collect();
    if starts.is_empty() {
        return false;
    }
    let first = rng.pick(&starts);
    let digits = bytes[first..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let new = match rng.below(4) {
        0 => "-1".to_owned(),
        1 => rng.below(40).to_string(),
        _ => rng.pick(&NUMBERS).to_string(),
    };
    bytes.splice(first..first + digits, new.into_bytes());
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TARGETS;

    #[test]
    fn a_mutation_follows_from_its_seed_and_seldom_leaves_all_as_it_was() {
        for target in TARGETS {
            let sound = target.seeds().unwrap().remove(0);
            let same = (0..200).filter(|&seed| mutate(target, &sound, seed) == sound).count();
            assert!(same < 40, "{}: {same}", target.name);
            assert_eq!(mutate(target, &sound, 7), mutate(target, &sound, 7));
            for seed in 0..50 {
                mutate(target, &[], seed);
            }
        }
    }
}
