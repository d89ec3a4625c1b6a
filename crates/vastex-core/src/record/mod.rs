//! What was wanted, as files: traces of whole runs, and what was learnt of them.

pub(crate) mod file;
pub(crate) mod prefetch_sets;
pub(crate) mod trace;
