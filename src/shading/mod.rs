//! How surfaces scatter light, and how emitters send it out.

pub mod bsdf;
pub mod emitters;
pub mod lobes;
