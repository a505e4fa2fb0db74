//! Frames, warps, random sequences, colour, tabulated distributions. `glam` types throughout.

pub mod color;
pub mod density;
pub mod distribution;
pub mod frame;
pub mod sampler;
pub mod warp;

pub use color::{LUMINANCE, luminance};
pub use frame::Frame;
pub use sampler::Sampler;

/// Largest `f32` below one: the upper end of every unit random number.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;
