//! How surfaces scatter light, and how emitters send it out.

pub mod emitters;
