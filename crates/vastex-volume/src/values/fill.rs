//! The value of absent chunks, as metadata of Zarr write it.

use serde_json::Value;

use super::DType;

/// The bytes of a fill value, little-endian, in the first bytes of eight; and whether the text could be taken
/// as it is. What is no value of the kind becomes the nearest one, or 0.
pub(crate) fn fill_of(value: &Value, dtype: DType) -> ([u8; 8], bool) {
    match dtype.bounds() {
        Some((least, most)) => match whole(value) {
            Some(number) => {
                let clamped = number.clamp(least, most);
                (low_bytes(clamped as u64), clamped == number)
            }
            None => ([0; 8], value.is_null()),
        },
        None => match float(value, dtype) {
            Some(bits) => (low_bytes(bits), true),
            None => ([0; 8], value.is_null()),
        },
    }
}

fn low_bytes(bits: u64) -> [u8; 8] {
    bits.to_le_bytes()
}

fn whole(value: &Value) -> Option<i128> {
    match value {
        Value::Bool(is_true) => Some((*is_true).into()),
        Value::Number(number) => {
            let whole = number.as_u64().map(i128::from).or_else(|| number.as_i64().map(i128::from));
            whole.or_else(|| number.as_f64().filter(|float| float.fract() == 0.0).map(|float| float as i128))
        }
        Value::String(text) => text.trim().parse().ok(),
        _ => None,
    }
}

fn float(value: &Value, dtype: DType) -> Option<u64> {
    if let Value::String(text) = value
        && let Some(digits) = text.strip_prefix("0x")
    {
        return u64::from_str_radix(digits, 16).ok();
    }
    let number = match value {
        Value::Number(number) => number.as_f64()?,
        Value::Bool(is_true) => f64::from(u8::from(*is_true)),
        Value::String(text) => match text.trim() {
            "NaN" | "nan" => f64::NAN,
            "Infinity" | "inf" => f64::INFINITY,
            "-Infinity" | "-inf" => f64::NEG_INFINITY,
            text => text.parse().ok()?,
        },
        _ => return None,
    };
    Some(match dtype {
        DType::F16 => half_bits(number as f32).into(),
        DType::F32 => (number as f32).to_bits().into(),
        _ => number.to_bits(),
    })
}

/// The nearest float of 16 bits; ties go to the even one.
fn half_bits(number: f32) -> u16 {
    let bits = number.to_bits();
    let sign = ((bits >> 16) & 0x8000) as u16;
    let magnitude = number.abs();
    if number.is_nan() {
        return sign | 0x7e00;
    }
    if magnitude >= 65_520.0 {
        return sign | 0x7c00;
    }
    if magnitude < 6.103_515_6e-5 {
        // Below the least normal one: steps of 2^-24. The addition rounds.
        let step = (magnitude * 16_777_216.0 + 8_388_608.0).to_bits() - 8_388_608_f32.to_bits();
        return sign | step as u16;
    }
    let rounded = bits & 0x7fff_ffff;
    let rounded = rounded + 0xfff + ((rounded >> 13) & 1);
    sign | ((rounded >> 13) - (112 << 10)) as u16
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn fills_are_what_is_written() {
        let bytes = |value: Value, dtype| fill_of(&value, dtype).0;
        assert_eq!(bytes(json!(258), DType::U16)[..2], [2, 1]);
        assert_eq!(bytes(json!(-2), DType::I16)[..2], [0xfe, 0xff]);
        assert_eq!(bytes(json!(u64::MAX), DType::U64), [0xff; 8]);
        assert_eq!(bytes(json!(3.0), DType::U8)[0], 3);
        assert_eq!(bytes(json!(true), DType::Bool)[0], 1);
        assert_eq!(bytes(json!(1.5), DType::F32)[..4], 1.5_f32.to_le_bytes());
        assert_eq!(bytes(json!("0x7fc00000"), DType::F32)[..4], [0, 0, 0xc0, 0x7f]);
        assert_eq!(bytes(json!("-Infinity"), DType::F64), f64::NEG_INFINITY.to_le_bytes());
        assert!(f32::from_le_bytes(bytes(json!("NaN"), DType::F32)[..4].try_into().unwrap()).is_nan());
        assert_eq!(bytes(json!(1.0), DType::F16)[..2], [0, 0x3c]);
        assert_eq!(bytes(json!(65504.0), DType::F16)[..2], [0xff, 0x7b]);
        assert_eq!(bytes(json!(5.960_464_5e-8), DType::F16)[..2], [1, 0]);
        assert_eq!(bytes(json!(0.1), DType::F16)[..2], [0x66, 0x2e]);
    }

    #[test]
    fn what_is_no_value_is_told() {
        assert_eq!(fill_of(&json!(null), DType::U16), ([0; 8], true));
        assert_eq!(fill_of(&json!(70_000), DType::U16), ([0xff, 0xff, 0, 0, 0, 0, 0, 0], false));
        assert_eq!(fill_of(&json!("black"), DType::U16), ([0; 8], false));
        assert_eq!(fill_of(&json!({"a": 1}), DType::F32), ([0; 8], false));
    }
}
