//! What a lookup costs by the kind of page table: direct and filled downward, direct with a loop up the levels in the shader, hashed;
//! with everything wanted resident, and with less and less of it.

use std::fmt::Write as _;

use anyhow::Result;
use vastex_wgpu::TableKind;

use crate::lookups::{Lookups, PICTURE, TEXELS};
use crate::texts::Own;
use crate::world::{Bench, Part, Verdict};

/// Of a direct table's time, that of a hashed one at most where everything wanted is resident.
const ASKED: f64 = 1.3;

pub(crate) fn section(bench: &Bench) -> Result<Part> {
    let lookups = Lookups::new(bench)?;
    let mut page = format!(
        "## Page tables\n\nMilliseconds of {}x{} trilinear samples of a texture of {TEXELS}x{TEXELS} texels, with all pages resident and with none finer than\n\
         a level, as while a view loads; in brackets over the first column. Asked for: hashed at most {ASKED} once converged.\n\n\
         | resident | direct, filled downward | direct, loop in the shader | hashed |\n\
         |---|---|---|---|\n",
        PICTURE[0], PICTURE[1],
    );
    let mut verdicts = Vec::new();
    for finest in [0, 1, 2, 3, 5] {
        let resident = lookups.resident(finest);
        let filled = lookups.table(TableKind::Direct, &resident)?;
        let unfilled = lookups.unfilled(&resident)?;
        let hashed = lookups.table(TableKind::Hashed, &resident)?;
        let taken = lookups.measure(&[
            lookups.case(&filled, None),
            lookups.case(&unfilled, Some(Own::Loop)),
            lookups.case(&hashed, None),
        ]);
        let first = taken[0];
        if finest == 0 {
            let what = "a lookup by a hashed table, of one by a direct table";
            verdicts.push(Verdict::at_most(ASKED, what, taken[2] / first));
        }
        let [_, others @ ..] = taken.map(|ms| format!("{ms:.2} ({:.2})", ms / first));
        let name =
            if finest == 0 { "everything wanted".to_owned() } else { format!("from level {finest} on") };
        writeln!(page, "| {name} | {first:.2} | {} |", others.join(" | "))?;
    }
    Ok((page, verdicts))
}
