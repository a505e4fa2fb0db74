//! The size of the kernel, and how it shrinks.

/// How the kernel's size changes over the iterations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shrinking {
    /// It stays as it is.
    Fixed,
    /// Its area shrinks as in progressive photon mapping (Knaus and Zwicker 2011): by `(i + alpha) / (i + 1)` after
    /// iteration `i`, counted from one.
    Progressive {
        /// In (0,1): near one it shrinks slowly.
        alpha: f32,
    },
    /// The same, but larger or smaller place by place, as blur and noise ask for.
    Adaptive {
        /// As above.
        alpha: f32,
    },
}

/// The kernel: a voxel as large as some pixels where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernel {
    /// Edge of the voxels in the first iteration, in pixels.
    pub start: f32,
    /// What becomes of it.
    pub shrinking: Shrinking,
}

/// The paper's rate of shrinking.
pub const DEFAULT_ALPHA: f32 = 0.67;

impl Default for Kernel {
    fn default() -> Self {
        Self { start: 4.0, shrinking: Shrinking::Adaptive { alpha: DEFAULT_ALPHA } }
    }
}

impl Kernel {
    /// Whether its size is chosen place by place.
    pub fn adapts(&self) -> bool {
        matches!(self.shrinking, Shrinking::Adaptive { .. })
    }

    /// Edge of the voxels after `iterations` iterations, in pixels.
    pub fn edge(&self, iterations: u32) -> f32 {
        match self.shrinking {
            Shrinking::Fixed => self.start,
            Shrinking::Progressive { alpha } | Shrinking::Adaptive { alpha } => {
                let factor = |i: u32| ((f64::from(i) + f64::from(alpha)) / (f64::from(i) + 1.0)).ln();
                let log_area: f64 = (1..=iterations).map(factor).sum();
                self.start * (0.5 * log_area).exp() as f32
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_area_shrinks_like_a_power_of_the_iterations() {
        let k = Kernel::default();
        assert_eq!(k.edge(0), 4.0);
        let ratio = |a: u32, b: u32| (k.edge(b) / k.edge(a)).powi(2);
        // area ~ i^(alpha - 1)
        approx::assert_relative_eq!(ratio(100, 10_000), 100f32.powf(0.67 - 1.0), max_relative = 0.01);
        assert_eq!(Kernel { shrinking: Shrinking::Fixed, ..k }.edge(1000), 4.0);
    }
}
