//! Tile directories of other programs: written, read as those programs would, and built again.

mod exports;
mod hostile;
mod lacking;
mod pictures;
mod programs;
mod refusals;
mod round_trips;
mod sources;
mod trees;
