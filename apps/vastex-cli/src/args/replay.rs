//! The words of `vastex replay`.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use vastex_core::{Policy, PoolSize};

use super::named;

/// What `vastex replay` is told.
#[derive(Debug, ClapArgs)]
#[command(after_help = "\
Examples:
  vastex render earth.vastex --on globe --camera-path spin --record-trace spin.vxtrace
  vastex replay spin.vxtrace --pool-share 1.5 --policy lru
  vastex replay spin.vxtrace --pool-tiles 900 --latency-frames 3 --tiles-per-frame 8 --json | jq .frames_to_full

A frame's set is what its feedback wanted, with all ancestors and the tails, at mip bias 0. Without latency or limit each
frame's set becomes resident in that frame, whatever was loaded before; the optimum is Belady's, who knows what comes.")]
pub(crate) struct ReplayArgs {
    /// The trace, recorded by `vastex render --record-trace`
    pub(crate) file: PathBuf,
    /// Tiles that the pool holds, tails included
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1 << 32), conflicts_with = "pool_share")]
    pool_tiles: Option<u64>,
    /// Size of the pool, as a multiple of the largest frame's set
    #[arg(long, default_value = "1.5", value_name = "X", value_parser = parse_share)]
    pool_share: f64,
    /// Which page gives up its slot
    #[arg(long, default_value = "vastex", value_name = "NAME", value_parser = named(&Policy::ALL, Policy::name))]
    pub(crate) policy: Policy,
    /// Frames that a load takes
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u64).range(..=1000))]
    pub(crate) latency_frames: u64,
    /// Loads begun per frame at most
    #[arg(long, default_value = "unlimited", value_name = "N|unlimited", value_parser = parse_limit)]
    pub(crate) tiles_per_frame: Limit,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

/// So many at most, or as many as there are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limit(pub(crate) Option<u64>);

impl ReplayArgs {
    pub(crate) fn pool(&self) -> PoolSize {
        self.pool_tiles.map_or(PoolSize::Share(self.pool_share), PoolSize::Tiles)
    }
}

fn parse_share(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(share) if (1.0..=1e6).contains(&share) => Ok(share),
        Ok(_) => Err("a pool below the largest frame's set cannot hold it; give 1 to 1000000".into()),
        Err(_) => Err("give a number from 1 to 1000000, as in 1.5".into()),
    }
}

fn parse_limit(text: &str) -> Result<Limit, String> {
    match text.parse() {
        _ if text == "unlimited" => Ok(Limit(None)),
        Ok(tiles) if tiles >= 1 => Ok(Limit(Some(tiles))),
        _ => Err("give a number of tiles from 1 on, or 'unlimited'".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_and_limits_are_checked() {
        assert_eq!((parse_share("1.1"), parse_share("1")), (Ok(1.1), Ok(1.0)));
        for bad in ["0.9", "-1", "nan", "inf", "1e9", "", "x"] {
            assert!(parse_share(bad).is_err(), "{bad}");
        }
        assert_eq!((parse_limit("8"), parse_limit("unlimited")), (Ok(Limit(Some(8))), Ok(Limit(None))));
        for bad in ["0", "-1", "all", ""] {
            assert!(parse_limit(bad).is_err(), "{bad}");
        }
    }
}
