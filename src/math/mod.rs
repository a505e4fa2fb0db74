//! Frames, warps, random sequences, colour, tabulated distributions, compact codes. `glam` types throughout.

pub mod bricks;
pub mod cells;
pub mod color;
pub mod density;
pub mod distribution;
pub mod frame;
pub mod noise;
pub mod octahedral;
pub mod sampler;
pub mod shared_exponent;
#[cfg(test)]
mod testing;
pub mod warp;

pub use color::{LUMINANCE, luminance};
pub use frame::Frame;
pub use octahedral::Octahedral;
pub use sampler::Sampler;
pub use shared_exponent::SharedExponent;

/// Largest `f32` below one: the upper end of every unit random number.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;
