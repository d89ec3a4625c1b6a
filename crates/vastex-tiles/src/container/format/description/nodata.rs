//! Which values stand for no data: what the names of filters say of it, and the section that says what they
//! do not.

use vastex_core::{Description, NodataValue};

use super::DescriptionFault;
use crate::container::format::layout::Fields;

/// What stands in the name of a filter before the value that it leaves out.
const IN_NAME: &str = "/nodata=";

/// The name of a filter that leaves texels without data out, from that of the filter which takes all texels.
pub fn filter_without(name: &str, nodata: Option<NodataValue>) -> String {
    nodata.map_or_else(|| name.to_owned(), |nodata| format!("{name}{IN_NAME}{nodata}"))
}

/// The name of the filter that takes all texels, and the value that this one leaves out, if it leaves one
/// out.
pub fn nodata_of_filter(name: &str) -> (&str, Option<NodataValue>) {
    match name.rsplit_once(IN_NAME).map(|(base, value)| (base, value.parse())) {
        Some((base, Ok(nodata))) => (base, Some(nodata)),
        _ => (name, None),
    }
}

/// For each layer the value that its filter leaves out.
pub(super) fn by_filters(filters: &[String], layers: usize) -> Vec<Option<NodataValue>> {
    (0..layers).map(|layer| nodata_of_filter(filters.get(layer)?).1).collect()
}

/// The section of a description, where filters do not say the same.
pub(super) fn section(description: &Description, filters: &[String]) -> Option<Vec<u8>> {
    let values: Vec<_> = description.layers.iter().map(|layer| layer.nodata).collect();
    let bytes = |value: &Option<NodataValue>| {
        let [a, b, c, d] = value.map_or(0.0, NodataValue::value).to_le_bytes();
        [u8::from(value.is_some()), a, b, c, d]
    };
    (values != by_filters(filters, values.len())).then(|| values.iter().flat_map(bytes).collect())
}

/// What such a section says of each layer.
pub(super) fn decode(section: &[u8]) -> Result<Vec<Option<NodataValue>>, DescriptionFault> {
    let mut fields = Fields::new(section);
    let mut values = Vec::new();
    while !fields.is_empty() {
        let (is_there, bits) = (fields.u8()?, fields.u32()?);
        let value = NodataValue::new(f32::from_bits(bits));
        if is_there > 1 || value.value().to_bits() != bits || is_there == 0 && bits != 0 {
            return Err("of a layer it does not say clearly which value stands for no data"
                .to_string()
                .into());
        }
        values.push((is_there == 1).then_some(value));
    }
    Ok(values)
}
