//! The words of `vastex learn`.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use vastex::prefetch::LearnSettings;

/// What `vastex learn` is told.
#[derive(Debug, ClapArgs)]
#[command(after_help = "\
Examples:
  vastex render earth.vastex --on globe --camera-path teleport --record-trace tour.vxtrace
  vastex learn tour.vxtrace -o tour.vxsets
  vastex render earth.vastex --on globe --camera-path teleport --prefetch-sets tour.vxsets

The space of the camera is cut into cells. Of each the pages are kept that were wanted while the camera was in it and shortly
after, those wanted over the most pixels first.")]
pub(crate) struct LearnArgs {
    /// Traces of one texture, recorded by `vastex render --record-trace`
    #[arg(required = true)]
    pub(crate) traces: Vec<PathBuf>,
    /// Where to write the sets
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Sides of a cell along the three axes of the camera's space, 0 along one that tells nothing apart; by
    /// default as far as the camera moves in 8 frames
    #[arg(long, value_name = "A,B,C", value_parser = parse_sides)]
    cell: Option<[f32; 3]>,
    /// Frames after the camera has left a cell whose pages belong to it
    #[arg(long, default_value_t = LearnSettings::default().ahead_frames, value_name = "N", value_parser = clap::value_parser!(u32).range(..=100_000))]
    ahead_frames: u32,
    /// Pages of a cell at most
    #[arg(long, default_value_t = LearnSettings::default().max_pages as u64, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    pages: u64,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

impl LearnArgs {
    pub(crate) fn settings(&self) -> LearnSettings {
        LearnSettings { sides: self.cell, ahead_frames: self.ahead_frames, max_pages: self.pages as usize }
    }
}

fn parse_sides(text: &str) -> Result<[f32; 3], String> {
    let sides: Result<Vec<f32>, _> = text.split(',').map(|side| side.trim().parse()).collect();
    let sides = sides.ok().and_then(|sides| <[f32; 3]>::try_from(sides).ok());
    let is_side = |side: &f32| side.is_finite() && *side >= 0.0;
    sides
        .filter(|sides| sides.iter().all(is_side))
        .ok_or("write three numbers from 0 on, as in 10,10,2".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_checked() {
        assert_eq!(parse_sides("10, 0.5,0"), Ok([10.0, 0.5, 0.0]));
        for bad in ["", "1", "1,2", "1,2,3,4", "1,2,-3", "1,2,nan", "inf,1,1", "a,b,c"] {
            assert!(parse_sides(bad).is_err(), "{bad}");
        }
    }
}
