//! Experiments: traces played in a pool under several rules of eviction, beside the optimum.

pub(crate) mod pages;
pub(crate) mod policies;
pub(crate) mod pool;
pub(crate) mod replay;
