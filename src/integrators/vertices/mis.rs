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

    /// At the first vertex of a light path, made with the density `emitted`, per étendue where the light begins,
    /// while next-event estimation would have `drawn` it; both per area of the vertex for delta lights, which
    /// camera paths cannot meet.
    pub fn from_light(chain: &Chain, emitted: f32, drawn: f32, is_delta: bool, merged: f32) -> Self {
        let made = emitted * chain.forward;
        let slope = if is_delta { 0.0 } else { chain.reverse * chain.squeeze / made };
        Self { fixed: merged + drawn / made, slope }
    }

    /// At the first vertex of a camera path. `seen`: density of camera rays per area there, where light paths may
    /// be connected to the lens.
    pub fn from_lens(chain: &Chain, seen: Option<f32>, light_paths: f32, merged: f32) -> Self {
        let connected = seen.map_or(0.0, |density| light_paths / (density * chain.forward));
        Self { fixed: merged + connected, slope: 0.0 }
    }

    /// After one more segment. `connected`: the density `P G` of its end if a connection along it is a
    /// technique. `merged`: `eta` of its end.
    pub fn after(turn: &Turn, chain: &Chain, connected: Option<f32>, merged: f32) -> Self {
        let made = turn.onward * chain.forward;
        Self {
            fixed: merged + connected.map_or(0.0, f32::recip),
            slope: chain.reverse * turn.end_back * chain.squeeze * turn.sum / made,
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
    let light = emitted * chain.reverse * chain.squeeze * camera.end_back * camera.sum;
    weight(1.0 + (drawn + light) / (camera.onward * chain.forward))
}

/// Weight of merging sub-paths of these sums, of which each counts the merging itself.
#[inline]
pub fn merging(light: f32, camera: f32, eta: f32) -> f32 {
    weight((light + camera) / eta - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::hash_unit;
    use glam::Vec3;

    /// A path with random densities. Segment `k` ends at vertex `k`; element 0 of the segments is unused.
    struct Path {
        /// Last vertex, the lens.
        n: usize,
        light: Vec<Chain>,
        camera: Vec<Chain>,
        /// Geometry terms towards the camera; towards the light they are over the squared ratio of squeezes.
        geometry: Vec<f32>,
        /// Densities with which light and camera paths are scattered on at each vertex.
        onward: [Vec<f32>; 2],
        /// Probabilities with which each kind of path ends its segment there.
        ends: [Vec<f32>; 2],
        eta: Vec<f32>,
        emitted: f32,
        drawn: f32,
        is_delta: bool,
        seen: f32,
        light_paths: f32,
    }

    impl Path {
        fn random(seed: u32) -> Self {
            let mut count = 0;
            let mut random = |low: f32, high: f32| {
                count += 1;
                low * (high / low).powf(hash_unit(seed, count))
            };
            let n = 2 + (seed % 5) as usize;
            let mut numbers = |low, high| (0..=n).map(|_| random(low, high)).collect::<Vec<f32>>();
            let (geometry, eta) = (numbers(0.1, 10.0), numbers(0.01, 10.0));
            let onward = [numbers(0.1, 5.0), numbers(0.1, 5.0)];
            let mut ends = [numbers(0.2, 1.0), numbers(0.2, 1.0)];
            // what is emitted is met before anything is chosen
            ends[1][0] = 1.0;
            let (choices, squeezes, broken) = (numbers(0.2, 1.0), numbers(0.5, 2.0), numbers(0.1, 10.0));
            let reverse_choices = numbers(0.2, 1.0);
            let (mut light, mut camera) = (Vec::new(), Vec::new());
            for k in 0..=n {
                let passages = if broken[k] > 2.0 { 1 } else { 0 };
                let (forward, reverse, squeeze) = match passages {
                    0 => (1.0, 1.0, 1.0),
                    _ => (choices[k], reverse_choices[k], squeezes[k]),
                };
                let one = Chain { throughput: Vec3::ONE, forward, reverse, squeeze, passages };
                light.push(Chain { forward: forward * ends[0][k], ..one });
                let before = k.saturating_sub(1);
                let back = Chain {
                    forward: reverse * ends[1][before],
                    reverse: forward,
                    squeeze: 1.0 / squeeze,
                    ..one
                };
                camera.push(back);
            }
            let [emitted, drawn, seen] = [0; 3].map(|_| random(0.1, 5.0));
            let light_paths = random(1.0, 50.0);
            let is_delta = seed.is_multiple_of(3);
            Self {
                n,
                light,
                camera,
                geometry,
                onward,
                ends,
                eta,
                emitted,
                drawn,
                is_delta,
                seen,
                light_paths,
            }
        }

        fn unbroken(&self, k: usize) -> bool {
            self.light[k].passages == 0
        }

        fn back_geometry(&self, k: usize) -> f32 {
            self.geometry[k] * self.light[k].squeeze
        }

        /// Density of vertices `0..=k` made from the light.
        fn made_from_light(&self, k: usize) -> f32 {
            let first = if self.is_delta { 1.0 } else { self.geometry[1] };
            let start = self.emitted * self.light[1].forward * first;
            (2..=k).map(|i| self.onward[0][i - 1] * self.light[i].forward * self.geometry[i]).product::<f32>()
                * start
        }

        /// Density of vertices `k..=n` made from the camera.
        fn made_from_camera(&self, k: usize) -> f32 {
            let step =
                |i: usize| self.onward[1][i + 1] * self.camera[i + 1].forward * self.back_geometry(i + 1);
            (k..self.n - 1).map(step).product::<f32>() * self.seen * self.camera[self.n].forward
        }

        /// Density of every technique from the definition, beside its weight by the carried sums.
        fn techniques(&self) -> Vec<(f32, f32)> {
            let n = self.n;
            let mut found = Vec::new();
            let mut light = vec![Sum::default(); n];
            let drawn = if self.unbroken(1) { self.drawn } else { 0.0 };
            light[1] = Sum::from_light(&self.light[1], self.emitted, drawn, self.is_delta, self.eta[1]);
            let light_turn = |sums: &[Sum], k: usize| Turn {
                onward: self.onward[0][k],
                end_back: self.ends[1][k],
                sum: sums[k].at(self.onward[1][k]),
            };
            for k in 2..n {
                let turn = light_turn(&light, k - 1);
                let g = self.unbroken(k).then(|| turn.onward * self.light[k].forward * self.geometry[k]);
                light[k] = Sum::after(&turn, &self.light[k], g, self.eta[k]);
            }
            let mut camera = vec![Sum::default(); n];
            let seen = self.unbroken(n).then_some(self.seen);
            camera[n - 1] = Sum::from_lens(&self.camera[n], seen, self.light_paths, self.eta[n - 1]);
            let camera_turn = |sums: &[Sum], k: usize| Turn {
                onward: self.onward[1][k],
                end_back: self.ends[0][k],
                sum: sums[k].at(self.onward[0][k]),
            };
            for k in (1..n - 1).rev() {
                let turn = camera_turn(&camera, k + 1);
                let chain = &self.camera[k + 1];
                let g = self.unbroken(k + 1).then(|| turn.onward * chain.forward * self.back_geometry(k + 1));
                camera[k] = Sum::after(&turn, chain, g, self.eta[k]);
            }

            let first = camera_turn(&camera, 1);
            if !self.is_delta {
                let met = first.onward * self.camera[1].forward * self.back_geometry(1);
                let weight = meeting(&first, &self.camera[1], drawn, self.emitted);
                found.push((met * self.made_from_camera(1), weight));
            }
            if self.unbroken(1) {
                let g = if self.is_delta { 1.0 } else { self.geometry[1] };
                let weight = next_event(&first, self.drawn, self.emitted, self.is_delta);
                found.push((self.drawn * g * self.made_from_camera(1), weight));
            }
            for k in (2..n).filter(|&k| self.unbroken(k)) {
                let weight =
                    connection(&light_turn(&light, k - 1), &camera_turn(&camera, k), self.geometry[k]);
                found.push((self.made_from_light(k - 1) * self.made_from_camera(k), weight));
            }
            if self.unbroken(n) {
                let weight = lens(&light_turn(&light, n - 1), self.seen, self.light_paths);
                found.push((self.light_paths * self.made_from_light(n - 1), weight));
            }
            for k in 1..n {
                let (a, b) = (light[k].at(self.onward[1][k]), camera[k].at(self.onward[0][k]));
                let density = self.eta[k] * self.made_from_light(k) * self.made_from_camera(k);
                found.push((density, merging(a, b, self.eta[k])));
            }
            found
        }
    }

    /// On random paths, through chains or not, from lights of some extent or none: every weight is the
    /// technique's share of the densities, so that they sum to one.
    #[test]
    fn weights_are_shares_of_the_densities() {
        for seed in 0..2000 {
            let path = Path::random(seed);
            let techniques = path.techniques();
            let all: f64 = techniques.iter().map(|t| f64::from(t.0)).sum();
            let mut sum = 0.0;
            for (density, weight) in techniques {
                let share = f64::from(density) / all;
                assert!((share - f64::from(weight)).abs() < 1e-4, "path {seed}: {weight} instead of {share}");
                sum += f64::from(weight);
            }
            assert!((sum - 1.0).abs() < 1e-4, "path {seed}: {sum}");
        }
    }
}
