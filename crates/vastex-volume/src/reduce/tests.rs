//! Every rule, kind of number and odd side against a naive version that works voxel by voxel in whole numbers
//! of 128 bits, or in floats of 64 bits.

use super::*;

/// Values that tell mistakes apart: all bits for whole numbers, small floats with some that are no numbers.
fn values(dtype: DType, count: usize) -> Vec<u8> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut bytes = Vec::new();
    for n in 0..count {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        // Often the same, so that something is most frequent.
        let bits = if state >> 61 == 0 { state >> 7 } else { (state >> 40) % 3 };
        let float = (bits as f64 % 4096.0 - 700.0) / 8.0;
        let float = if n % 11 == 3 { f64::NAN } else { float };
        match dtype {
            DType::Bool => bytes.push((bits & 1) as u8),
            DType::F16 => bytes.extend(number_f16(float).to_le_bytes()),
            DType::F32 => bytes.extend((float as f32).to_le_bytes()),
            DType::F64 => bytes.extend(float.to_le_bytes()),
            _ => bytes.extend(&bits.wrapping_sub(1).to_le_bytes()[..dtype.bytes()]),
        }
    }
    bytes
}

/// A float of 16 bits of a multiple of 1/8 below 512, found by trying all of them.
fn number_f16(number: f64) -> u16 {
    if number.is_nan() {
        return 0x7e01;
    }
    (0..=u16::MAX).find(|bits| f16(*bits) == number).unwrap_or(0)
}

fn f16(bits: u16) -> f64 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023) / 1024.0);
    match exponent {
        31 => f64::NAN,
        0 => sign * fraction * 2_f64.powi(-14),
        _ => sign * (1.0 + fraction) * 2_f64.powi(exponent - 15),
    }
}

fn whole(dtype: DType, bytes: &[u8]) -> i128 {
    let mut wide = [0; 16];
    wide[..bytes.len()].copy_from_slice(bytes);
    let number = i128::from_le_bytes(wide);
    let is_signed = matches!(dtype, DType::I8 | DType::I16 | DType::I32 | DType::I64);
    let bits = 8 * bytes.len() as u32;
    if is_signed && number >> (bits - 1) == 1 { number - (1 << bits) } else { number }
}

fn float(bytes: &[u8]) -> f64 {
    match *bytes {
        [a, b] => f16(u16::from_le_bytes([a, b])),
        [a, b, c, d] => f32::from_le_bytes([a, b, c, d]).into(),
        _ => f64::from_le_bytes(bytes.try_into().unwrap()),
    }
}

/// Returns true if a result is what the voxels that it covers make it.
fn is_right(dtype: DType, rule: Reduction, covered: &[&[u8]], found: &[u8]) -> bool {
    if rule == Reduction::Majority {
        let times = |value: &[u8]| covered.iter().filter(|other| **other == value).count();
        let most = covered.iter().map(|value| times(value)).max().unwrap();
        let reversed = |value: &[u8]| value.iter().rev().copied().collect::<Vec<u8>>();
        let least = covered.iter().filter(|value| times(value) == most).map(|value| reversed(value)).min();
        return Some(reversed(found)) == least;
    }
    if !dtype.is_float() {
        let numbers: Vec<i128> = covered.iter().map(|value| whole(dtype, value)).collect();
        let count = numbers.len() as i128;
        let sum: i128 = numbers.iter().sum();
        let expected = match rule {
            Reduction::Mean => (2 * sum + count).div_euclid(2 * count),
            Reduction::Max => *numbers.iter().max().unwrap(),
            _ => *numbers.iter().min().unwrap(),
        };
        return whole(dtype, found) == expected;
    }
    let numbers: Vec<f64> =
        covered.iter().map(|value| float(value)).filter(|value| !value.is_nan()).collect();
    if numbers.is_empty() {
        return float(found).is_nan();
    }
    // Sums of so small multiples of 1/8 are exact in any order; a mean is rounded to the kind once.
    match rule {
        Reduction::Mean => {
            let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
            match dtype {
                DType::F64 => float(found) == mean,
                DType::F32 => float(found) == f64::from(mean as f32),
                _ => (float(found) - mean).abs() <= (mean.abs() / 2048.0).max(2_f64.powi(-25)),
            }
        }
        Reduction::Max => {
            numbers.iter().all(|number| *number <= float(found)) && numbers.contains(&float(found))
        }
        _ => numbers.iter().all(|number| *number >= float(found)) && numbers.contains(&float(found)),
    }
}

#[test]
fn every_value_is_that_of_the_naive_version() {
    for dtype in DType::ALL {
        for (size, factor) in [
            ([7, 5, 3], [2, 2, 2]),
            ([8, 4, 6], [2, 2, 2]),
            ([6, 5, 3], [2, 2, 1]),
            ([5, 1, 9], [1, 1, 2]),
            ([9, 3, 1], [2, 1, 2]),
            ([4, 3, 2], [1, 1, 1]),
            ([1, 1, 1], [2, 2, 2]),
        ] {
            let width = dtype.bytes();
            let values = values(dtype, size.iter().product());
            let coarse = reduced_size(size, factor);
            for rule in Reduction::ALL {
                let mut output = vec![0xaa; coarse.iter().product::<usize>() * width];
                reduce_into(dtype, rule, &values, size, factor, &mut output).unwrap();
                for (n, found) in output.chunks_exact(width).enumerate() {
                    let at = [n % coarse[0], n / coarse[0] % coarse[1], n / coarse[0] / coarse[1]];
                    let mut covered = Vec::new();
                    let range =
                        |axis: usize| at[axis] * factor[axis]..size[axis].min((at[axis] + 1) * factor[axis]);
                    for z in range(2) {
                        for y in range(1) {
                            covered.extend(range(0).map(|x| {
                                let from = ((z * size[1] + y) * size[0] + x) * width;
                                &values[from..from + width]
                            }));
                        }
                    }
                    assert!(
                        is_right(dtype, rule, &covered, found),
                        "{dtype:?} {rule:?} {size:?} by {factor:?} at {at:?}: {found:?} of {covered:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn lengths_and_factors_must_fit() {
    let mut output = [0; 1];
    let mut reduced = |values: usize, size, factor| {
        reduce_into(DType::U8, Reduction::Mean, &vec![0; values], size, factor, &mut output)
    };
    assert_eq!(reduced(8, [2; 3], [2; 3]), Some(()));
    for (values, size, factor) in [
        (7, [2; 3], [2; 3]),
        (8, [2; 3], [2, 2, 1]),
        (27, [3; 3], [3; 3]),
        (1, [1; 3], [0; 3]),
        (0, [usize::MAX; 3], [2; 3]),
        (0, [0; 3], [2; 3]),
    ] {
        assert_eq!(reduced(values, size, factor), None, "{size:?} {factor:?}");
    }
}

#[test]
fn halves_go_upwards_and_names_lead_back() {
    let mean = |values: [i8; 2]| {
        let mut output = [0];
        let bytes = values.map(|value| value as u8);
        reduce_into(DType::I8, Reduction::Mean, &bytes, [2, 1, 1], [2, 1, 1], &mut output).unwrap();
        output[0] as i8
    };
    assert_eq!([mean([-1, -2]), mean([1, 2]), mean([-128, 127]), mean([-1, 0])], [-1, 2, 0, 0]);
    for rule in Reduction::ALL {
        assert_eq!(Reduction::named(rule.name()), Some(rule));
    }
    assert_eq!(Reduction::named("median"), None);
}
