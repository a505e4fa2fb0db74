//! The parts of segment transport against closed forms: cluster areas, étendue along chains, densities, and clusters
//! of one and of very many.

#[path = "../common/mod.rs"]
mod common;

mod areas;
mod chains;
mod densities;
mod sizes;
mod support;
