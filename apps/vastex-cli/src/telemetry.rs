//! How each pool stood after each frame of a run, as CSV and as JSON.

use std::path::Path;

use anyhow::Result;
use vastex::Textures;
use vastex::diagnostics::PoolRecord;

use crate::output::Output;

/// What is to be written of a run, in the making.
pub(crate) struct StatsExport {
    csv: Option<(Output, String)>,
    json: Option<(Output, Vec<PoolRecord>)>,
}

impl StatsExport {
    /// Finds out whether the files can be written.
    pub(crate) fn new(csv: Option<&Path>, json: Option<&Path>) -> Result<StatsExport> {
        let csv = csv.map(Output::at).transpose()?;
        let json = json.map(Output::at).transpose()?;
        Ok(StatsExport {
            csv: csv.map(|output| (output, PoolRecord::csv_header())),
            json: json.map(|output| (output, Vec::new())),
        })
    }

    /// A frame has been played.
    pub(crate) fn note(&mut self, textures: &Textures) {
        for record in textures.inspect().telemetry().newest() {
            if let Some((_, csv)) = &mut self.csv {
                record.write_csv(csv);
            }
            if let Some((_, records)) = &mut self.json {
                records.push(*record);
            }
        }
    }

    /// Writes what was noted.
    pub(crate) fn write(&self) -> Result<()> {
        if let Some((output, csv)) = &self.csv {
            output.write(csv.as_bytes())?;
        }
        if let Some((output, records)) = &self.json {
            output.write(&serde_json::to_vec(records)?)?;
        }
        Ok(())
    }
}
