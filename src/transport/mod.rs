//! Segment-based light transport (Wang, West and Hachisuka 2025), after its Algorithm 1: sample, cluster, weigh,
//! propagate, gather. `docs/method.md` tells the method in one piece.

pub mod area;
pub mod camera;
pub mod cluster;
pub mod grid;
pub mod kernel;
pub mod light;
pub mod propagate;
pub mod store;
pub mod walk;
pub mod weigh;

/// Asked now and then whether to stop.
#[derive(Clone, Copy)]
pub struct Cut<'a>(pub &'a (dyn Fn() -> bool + Sync));

impl Cut<'_> {
    /// Whether to stop.
    #[inline]
    pub fn is_raised(&self) -> bool {
        (self.0)()
    }
}
