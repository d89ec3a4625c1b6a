//! What an image of labels says of them: `image-label`.

use serde_json::Value;

use crate::fault::Oddities;
use crate::json::list;
use crate::values::DType;

/// Labels whose colours are taken, the first ones of more.
const MOST_COLORS: usize = 65_536;

/// The colours that a file gives to labels, as they stand in tiles: those with a sign in two's complement, of
/// 32 bits where the values have up to 32. Red, green, blue and how opaque they are.
pub(super) fn colors(attributes: &Value, dtype: DType, oddities: &mut Oddities) -> Vec<(u64, [u8; 4])> {
    let Some(label) = attributes.get("image-label") else { return Vec::new() };
    let listed = list(label, "colors");
    if listed.len() > MOST_COLORS {
        oddities.push(format!(
            "image-label: {} labels have colours; the first {MOST_COLORS} are taken, others have those of their numbers",
            listed.len()
        ));
    }
    let read: Vec<_> = listed.iter().take(MOST_COLORS).map(|entry| color(entry, dtype)).collect();
    let missing = read.iter().filter(|entry| entry.is_none()).count();
    if missing > 0 {
        oddities.push(format!(
            "image-label: {missing} of {} colours lack a whole number as label-value, or four codes from 0 to 255 as rgba; \
             they are left out",
            read.len()
        ));
    }
    read.into_iter().flatten().collect()
}

fn color(entry: &Value, dtype: DType) -> Option<(u64, [u8; 4])> {
    let value = entry.get("label-value")?;
    let label = match (value.as_u64(), value.as_i64()) {
        (Some(label), _) => label,
        (None, Some(label)) if dtype.bytes() < 8 => u64::from(i32::try_from(label).ok()? as u32),
        (None, Some(label)) => label as u64,
        // As floats others write whole numbers, too.
        (None, None) => value.as_f64().filter(|f| f.fract() == 0.0 && (0.0..9e15).contains(f))? as u64,
    };
    let codes: Vec<u8> =
        list(entry, "rgba").iter().map(|code| u8::try_from(code.as_u64()?).ok()).collect::<Option<_>>()?;
    match codes[..] {
        [red, green, blue, alpha] => Some((label, [red, green, blue, alpha])),
        [red, green, blue] => Some((label, [red, green, blue, 255])),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn colours_are_read_with_their_faults() {
        let mut odd = Oddities::default();
        let said = json!({"image-label": {"colors": [
            {"label-value": 18_446_744_073_709_551_615_u64, "rgba": [1, 2, 3, 128]},
            {"label-value": -1, "rgba": [4, 5, 6]}, {"label-value": 7.0, "rgba": [0, 0, 0, 0]},
            {"label-value": 0.5, "rgba": [1, 2, 3, 4]}, {"label-value": 1, "rgba": [256, 0, 0, 0]},
            {"rgba": [1, 2, 3, 4]}, {"label-value": 1}, 7
        ]}});
        let last = u64::from(u32::MAX);
        let expected = [(u64::MAX, [1, 2, 3, 128]), (last, [4, 5, 6, 255]), (7, [0; 4])];
        assert_eq!(colors(&said, DType::I32, &mut odd), expected);
        assert_eq!(colors(&said, DType::I64, &mut Oddities::default())[1].0, u64::MAX);
        let odd = odd.into_vec();
        assert!(odd.len() == 1 && odd[0].contains("5 of 8"), "{odd:?}");
        assert_eq!(colors(&json!({"image-label": 3}), DType::U8, &mut Oddities::default()), []);
        assert_eq!(colors(&json!({}), DType::U8, &mut Oddities::default()), []);
    }
}
