//! Weights of the techniques that can make the same path (balance heuristic), from sums carried along sub-paths.
//!
//! A path has vertices `v_0` (on a light), `v_1`, ..., `v_n` (on the lens), with a generalised segment between
//! neighbours. `F_k` is the density with which light paths make `v_k`, given the vertices before it; `B_k` that
//! of camera paths, given those behind it. Techniques are
//!
//! - `C_k`, the connection of a light path's `v_{k-1}` with a camera path's `v_k`: density `F_0..F_{k-1} B_k..B_n`.
//!   `C_0` is a camera path that meets a light, `C_1` next-event estimation, `C_n` the connection to the lens;
//! - `M_k`, the merging of a light path that arrives at `v_k` with a camera path that does: density
//!   `F_0..F_k B_k..B_n` times `eta_k = N pi r_k^2`, for `N` light paths and a radius `r_k` (the acceptance
//!   probability of Georgiev et al. 2012, eq. 7).
//!
//! The techniques with fewer light vertices than `C_{k+1}` have together `B_k D_k` times its density, where
//! `D_k = eta_k + (1 + B_{k-1} D_{k-1}) / F_k`: the sum grows by one vertex a step. The tech report of Georgiev
//! (2012) carries it in three numbers. In densities per étendue two do: with `P` per projected solid angle and
//! `G` the geometry term of a segment, `F_k = P G`, and `B_{k-1} / F_k` has no `G` left, only the ratio of
//! squared indices, so that a segment through mirrors and glass is one like any other, but for `C_k`, which is
//! not possible there. Of `B_{k-1}` only the scattering at `v_k` is unknown until the path goes on: `D_k` is
//! a linear function of it. All this holds for camera paths with the roles exchanged.

use crate::transport::walk::Chain;

/// The sum `D` at the end of a sub-path, as a linear function of the density with which a path the other way
/// would be scattered there, roulette included.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sum {
    /// Its constant part.
    pub fixed: f32,
    /// What is multiplied with the density.
    pub slope: f32,
}

/// Densities at a vertex, for one more segment that leaves it in a known direction.
#[derive(Clone, Copy, Debug, Default)]
pub struct Turn {
    /// With which the sub-path itself goes there, per projected solid angle, roulette included.
    pub onward: f32,
    /// Probability that a path the other way, which arrives by that segment, ends its segment here.
    pub end_back: f32,
    /// The vertex's sum, now that the direction is known.
    pub sum: f32,
}

impl Sum {
    /// Its value at a density.
    #[inline]
    pub fn at(self, density: f32) -> f32 {
        if density > 0.0 { self.fixed + density * self.slope } else { self.fixed }
    }

    /// After one more segment. `connected`: the density `P G` of its end if a connection along it is a
    /// technique. `merged`: `eta` of its end.
    pub fn after(turn: &Turn, chain: &Chain, connected: Option<f32>, merged: f32) -> Self {
        let squeeze = 1.0 / (chain.index * chain.index);
        let made = turn.onward * chain.forward;
        Self {
            fixed: merged + connected.map_or(0.0, f32::recip),
            slope: chain.reverse * turn.end_back * squeeze * turn.sum / made,
        }
    }
}

/// One over the sum of all densities relative to that of the technique used; zero where that sum is unbounded.
#[inline]
fn weight(sum: f32) -> f32 {
    let w = 1.0 / sum;
    if w.is_finite() { w } else { 0.0 }
}

/// Weight of the connection of two vertices, `g` being the geometry term between them.
#[inline]
pub fn connection(light: &Turn, camera: &Turn, g: f32) -> f32 {
    let fewer = camera.onward * light.end_back * g * light.sum;
    let more = light.onward * camera.end_back * g * camera.sum;
    weight(1.0 + fewer + more)
}

/// Weight of a light vertex's connection to the lens. `density`: of camera rays per area of the surface there.
#[inline]
pub fn lens(light: &Turn, density: f32, light_paths: f32) -> f32 {
    weight(1.0 + density * light.end_back * light.sum / light_paths)
}

/// Weight of next-event estimation that drew a light with `drawn`, which light paths would have left along the
/// same segment with `emitted`: both per étendue, or both per area of the receiver for delta lights, which
/// camera paths cannot meet.
#[inline]
pub fn next_event(camera: &Turn, drawn: f32, emitted: f32, is_delta: bool) -> f32 {
    let met = if is_delta { 0.0 } else { camera.onward };
    weight(1.0 + (met + emitted * camera.end_back * camera.sum) / drawn)
}

/// Weight of a light that a camera path met; densities as in [`next_event`], along the segment's chain.
#[inline]
pub fn meeting(camera: &Turn, chain: &Chain, drawn: f32, emitted: f32) -> f32 {
    let squeeze = 1.0 / (chain.index * chain.index);
    let light = emitted * chain.reverse * squeeze * camera.end_back * camera.sum;
    weight(1.0 + (drawn + light) / (camera.onward * chain.forward))
}

/// Weight of merging sub-paths of these sums, of which each counts the merging itself.
#[inline]
pub fn merging(light: f32, camera: f32, eta: f32) -> f32 {
    weight((light + camera) / eta - 1.0)
}
