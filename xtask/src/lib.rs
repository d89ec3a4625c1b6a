//! The part of this program that others call too: the record, a short form of which runs in the suite of the program `vastex`.
//!
//! What a person types is `main`'s business.

pub mod record;
