//! The shader texts of what lookups cost. The list of all shader texts has them from here.

/// The texture's id.
pub(crate) const ID: u32 = vastex_wgpu::shader_id(NUMBER, 1);
/// Its number.
pub(crate) const NUMBER: vastex_core::TextureNumber = vastex_core::TextureNumber::new(3).unwrap();

/// A plane seen aslant.
const ASLANT: &str = include_str!("wgsl/aslant.wgsl");

/// What stands in the place of a function of Vastex's.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Own {
    /// In the place of the filter one lookup, and the second level of the same slot.
    OneLookup,
    /// In the place of `vastexi_found` the walk up the levels of a table in which a page that is not resident
    /// has no entry.
    Loop,
}

impl Own {
    fn function(self) -> (&'static str, &'static str) {
        match self {
            Own::OneLookup => ("vastexi_filtered_0", include_str!("wgsl/one_lookup.wgsl")),
            Own::Loop => ("vastexi_found_0", include_str!("wgsl/loop.wgsl")),
        }
    }
}

/// The picture by Vastex's text, or with a function of its own in the place of one there.
pub(crate) fn picture(vastex: &str, own: Option<Own>) -> String {
    let replaced = |own: Own| {
        let (name, function) = own.function();
        vastex.replace(&format!("fn {name}("), &format!("fn other_{name}(")) + function
    };
    format!("{ASLANT}const ID: u32 = {ID}u;\n") + &own.map_or_else(|| vastex.to_owned(), replaced)
}
