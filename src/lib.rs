//! Segue: a physically based render engine whose unit of light transport is the segment.
//!
//! The rooms of the crate, from the ground up; a room imports only from rooms above it in this list.
//! `ARCHITECTURE.md` says what each is for, and `tests/architecture.rs` holds the code to it.

pub mod math;
pub mod scene;

pub mod film;

pub mod accel;
pub mod shading;
pub mod transport;

pub mod integrators;
pub mod session;

mod bridge;
