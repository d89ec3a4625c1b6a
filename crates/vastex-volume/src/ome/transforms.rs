//! Transformations of coordinates, as far as they are a scale and a translation along each axis.

use serde_json::Value;

use crate::fault::Oddities;
use crate::json::{finite, list, text};
use crate::zarr::shortened;

/// World = scale * index + translation, along each axis of the array.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Diagonal {
    pub(super) scale: Vec<f64>,
    pub(super) translation: Vec<f64>,
    /// True if anything said what the scale is.
    pub(super) is_given: bool,
}

/// Sequences within sequences that are followed.
const MOST_DEEP: usize = 8;

impl Diagonal {
    pub(super) fn identity(axes: usize) -> Diagonal {
        Diagonal { scale: vec![1.0; axes], translation: vec![0.0; axes], is_given: false }
    }

    /// Applies a list of transformations after this one. `of` says whose they are.
    pub(super) fn apply(&mut self, transformations: &[Value], of: &str, oddities: &mut Oddities) {
        self.apply_within(transformations, of, oddities, 0);
    }

    fn apply_within(&mut self, transformations: &[Value], of: &str, oddities: &mut Oddities, depth: usize) {
        for transformation in transformations {
            match text(transformation, "type").unwrap_or("without a type") {
                "identity" => {}
                "scale" => {
                    if let Some(scale) = self.vector(transformation.get("scale"), 1.0, "scale", of, oddities)
                    {
                        self.scale_by(&scale, of, oddities);
                    }
                }
                "translation" => {
                    let moved =
                        self.vector(transformation.get("translation"), 0.0, "translation", of, oddities);
                    self.move_by(&moved.unwrap_or_default(), of, oddities);
                }
                "sequence" if depth < MOST_DEEP => {
                    self.apply_within(list(transformation, "transformations"), of, oddities, depth + 1);
                }
                "affine" => self.apply_affine(transformation.get("affine"), of, oddities),
                other => oddities.push(format!(
                    "{of}: a transformation '{}' is no scale and no translation, and is left out",
                    shortened(other)
                )),
            }
        }
    }

    /// Applies what others came to after this one.
    pub(super) fn then(&mut self, other: &Diagonal, of: &str, oddities: &mut Oddities) {
        if other.is_given {
            self.scale_by(&other.scale, of, oddities);
        }
        self.move_by(&other.translation, of, oddities);
    }

    fn move_by(&mut self, moved: &[f64], of: &str, oddities: &mut Oddities) {
        for (axis, (own, by)) in self.translation.iter_mut().zip(moved).enumerate() {
            if (*own + by).is_finite() {
                *own += by;
            } else {
                oddities.push(format!(
                    "{of}: the translation {by} of axis {axis} leads beyond all numbers, and is left out"
                ));
            }
        }
    }

    fn scale_by(&mut self, scale: &[f64], of: &str, oddities: &mut Oddities) {
        self.is_given = true;
        for (axis, by) in scale.iter().enumerate() {
            let mut by = *by;
            if by <= 0.0 {
                let made = if by < 0.0 { -by } else { 1.0 };
                oddities.push(format!("{of}: the scale {by} of axis {axis} is not above 0; {made} is taken"));
                by = made;
            }
            let (scale, translation) = (self.scale[axis] * by, self.translation[axis] * by);
            if scale.is_normal() && translation.is_finite() {
                (self.scale[axis], self.translation[axis]) = (scale, translation);
            } else {
                oddities.push(format!(
                    "{of}: the scale {by} of axis {axis} leads beyond all numbers, and is left out"
                ));
            }
        }
    }

    /// The diagonal of a matrix with a column for the translation.
    fn apply_affine(&mut self, matrix: Option<&Value>, of: &str, oddities: &mut Oddities) {
        let axes = self.scale.len();
        let rows: Option<Vec<Vec<f64>>> = matrix
            .and_then(Value::as_array)
            .and_then(|rows| rows.iter().map(|row| row.as_array()?.iter().map(finite).collect()).collect());
        let rows =
            rows.filter(|rows| rows.len() >= axes && rows.iter().take(axes).all(|row| row.len() == axes + 1));
        let Some(rows) = rows else {
            oddities.push(format!(
                "{of}: an affine transformation is no matrix of {axes} rows and {} columns, and is left out",
                axes + 1
            ));
            return;
        };
        let is_off = |row: usize, column: usize| row != column && rows[row][column] != 0.0;
        if (0..axes).any(|row| (0..axes).any(|column| is_off(row, column))) {
            oddities.push(format!(
                "{of}: an affine transformation turns or shears; only its lengths along the axes are taken"
            ));
        }
        // The length of what a step along each axis becomes.
        let length = |column: usize| (0..axes).map(|row| rows[row][column].powi(2)).sum::<f64>().sqrt();
        let scale: Vec<f64> = (0..axes).map(length).collect();
        self.scale_by(&scale, of, oddities);
        let moved: Vec<f64> = rows.iter().take(axes).map(|row| row[axes]).collect();
        self.move_by(&moved, of, oddities);
    }

    /// A vector with a number for each axis. What is no finite number becomes `neutral`.
    fn vector(
        &self,
        value: Option<&Value>,
        neutral: f64,
        name: &str,
        of: &str,
        oddities: &mut Oddities,
    ) -> Option<Vec<f64>> {
        let axes = self.scale.len();
        let Some(numbers) = value.and_then(Value::as_array) else {
            oddities.push(format!("{of}: a {name} has no list of numbers, and is left out"));
            return None;
        };
        let number = |value: &Value| {
            finite(value).unwrap_or_else(|| {
                let found = shortened(&value.to_string());
                oddities.push(format!("{of}: {found} in a {name} is no finite number; {neutral} is taken"));
                neutral
            })
        };
        // Far more numbers than axes are somebody's joke.
        let mut numbers: Vec<f64> = numbers.iter().rev().take(axes).map(number).collect();
        numbers.reverse();
        let given = value.and_then(Value::as_array).map_or(0, Vec::len);
        if given != axes {
            oddities.push(format!(
                "{of}: a {name} has {given} numbers for {axes} axes; they are taken for the last axes"
            ));
            numbers.splice(0..0, std::iter::repeat_n(neutral, axes - numbers.len()));
        }
        Some(numbers)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn applied(axes: usize, transformations: &Value) -> (Diagonal, Vec<String>) {
        let (mut own, mut oddities) = (Diagonal::identity(axes), Oddities::default());
        own.apply(transformations.as_array().unwrap(), "0", &mut oddities);
        (own, oddities.into_vec())
    }

    #[test]
    fn transformations_follow_one_another() {
        let (own, odd) = applied(
            2,
            &json!([{"type": "scale", "scale": [2, 0.5]}, {"type": "translation", "translation": [1, 3]}, {"type": "scale", "scale": [10, 10]}]),
        );
        assert_eq!((own.scale, own.translation, odd), (vec![20.0, 5.0], vec![10.0, 30.0], vec![]));
        let (own, odd) = applied(
            2,
            &json!([{"type": "sequence", "transformations": [{"type": "scale", "scale": [2, 3]}, {"type": "identity"},
                {"type": "affine", "affine": [[1, 0, 5], [0, 2, 6]]}]}]),
        );
        assert_eq!((own.scale, own.translation, odd), (vec![2.0, 6.0], vec![5.0, 6.0], vec![]));
    }

    #[test]
    fn what_makes_no_sense_is_said_and_left_out() {
        for (bad, scale) in [
            (json!([{"type": "scale", "scale": ["NaN", 2]}]), [1.0, 2.0]),
            (json!([{"type": "scale", "scale": [0, -2]}]), [1.0, 2.0]),
            (json!([{"type": "scale", "scale": [7]}]), [1.0, 7.0]),
            (json!([{"type": "scale", "scale": [9, 8, 7]}]), [8.0, 7.0]),
            (json!([{"type": "scale", "path": "somewhere"}]), [1.0, 1.0]),
            (
                json!([{"type": "scale", "scale": [1e308, 1]}, {"type": "scale", "scale": [1e308, 1]}]),
                [1e308, 1.0],
            ),
            (
                json!([{"type": "translation", "translation": [1e308, 0]}, {"type": "translation", "translation": [1e308, 0]}]),
                [1.0, 1.0],
            ),
            (
                json!([{"type": "translation", "translation": [1e308, 0]}, {"type": "affine", "affine": [[1, 0, 1e308], [0, 1, 0]]}]),
                [1.0, 1.0],
            ),
            (json!([{"type": "rotation", "rotation": []}]), [1.0, 1.0]),
            (json!([{"type": "affine", "affine": [[0, 3, 0], [4, 0, 0]]}]), [4.0, 3.0]),
            (json!([{"type": "affine", "affine": [[0, 3]]}]), [1.0, 1.0]),
            (json!([17]), [1.0, 1.0]),
        ] {
            let (own, odd) = applied(2, &bad);
            assert_eq!(own.scale, scale, "{bad}");
            assert!(own.translation.iter().all(|side| side.is_finite()), "{bad}");
            assert!(!odd.is_empty(), "{bad}");
        }
    }
}
