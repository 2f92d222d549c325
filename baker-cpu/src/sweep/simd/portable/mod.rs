//! The code for every machine, which the hand-written SIMD versions are tested against.

pub(in crate::sweep) mod crossings;
pub(in crate::sweep) mod silhouettes;
pub(in crate::sweep) mod summation;
