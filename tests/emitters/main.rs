//! Emitters against closed forms, against quadrature, and against each other: next event, light paths
//! and rays must agree on how much light arrives.

mod chi_square;
mod extremes;
mod guiding;
mod irradiance;
mod references;
mod scene_data;
mod selection;
mod support;
