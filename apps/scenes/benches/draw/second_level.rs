//! Tried: slots that hold a second level, so that the hardware does trilinear in one lookup.
//! docs/second-level.md says what came of it.

use anyhow::Result;
use vastex_wgpu::TableKind;

use crate::lookups::Lookups;
use crate::texts::Own;
use crate::world::{Bench, Part};

pub(crate) fn section(bench: &Bench) -> Result<Part> {
    let lookups = Lookups::new(bench)?;
    let table = lookups.table(TableKind::Direct, &lookups.resident(0))?;
    let [two, one] =
        lookups.measure(&[lookups.case(&table, None), lookups.case(&table, Some(Own::OneLookup))]);
    let page = format!(
        "## A second level in each slot\n\nThe samples of the section before, everything resident, beside one lookup in an atlas whose slots hold the next level too\n\
         ([what came of it](second-level.md)).\n\n\
         | | ms | of two lookups | pool memory and uploads |\n|---|---|---|---|\n\
         | two lookups | {two:.2} | 1.00 | 1.00 |\n| one, by the hardware's trilinear | {one:.2} | {:.2} | 1.25 |\n",
        one / two
    );
    Ok((page, Vec::new()))
}
