//! What arrivals of light paths carry, as it is kept: 32 bytes each.

use super::list::{List, Pack};
use super::{Photon, Rivals};
use crate::math::{Octahedral, SharedExponent};
use glam::Vec3;

/// Bits of the number of bounces; the others of the same number say what the rivals are.
const BOUNCES: u16 = (1 << 14) - 1;
const FIRST: u16 = 1 << 14;
const DELTA: u16 = 1 << 15;

/// What an arrival of a light path carries, packed.
#[derive(Clone, Copy, Debug)]
pub struct PackedPhoton {
    path: u32,
    camera_choices: f32,
    /// Of a first segment its density and that of next event, of a later one `c` and `(n_start / n_end)^2`.
    rivals: [f32; 2],
    direction: Octahedral,
    pdf: f32,
    flux: SharedExponent,
    state: u16,
}

impl Pack for PackedPhoton {
    type Item = Photon;

    fn pack(p: &Photon) -> Self {
        let (rivals, kind) = match p.rivals {
            Rivals::First { light_density, next_event_pdf, is_delta } => {
                ([light_density, next_event_pdf], FIRST | if is_delta { DELTA } else { 0 })
            }
            Rivals::Later { light_choices, squeeze } => ([light_choices, squeeze], 0),
        };
        Self {
            path: p.path,
            camera_choices: p.camera_choices,
            rivals,
            direction: Octahedral::encode(p.direction),
            pdf: p.pdf,
            flux: SharedExponent::encode(p.flux),
            state: p.bounces.min(u32::from(BOUNCES)) as u16 | kind,
        }
    }

    #[inline]
    fn unpack(&self) -> Photon {
        let [first, second] = self.rivals;
        let rivals = match self.state & FIRST != 0 {
            true => Rivals::First {
                light_density: first,
                next_event_pdf: second,
                is_delta: self.state & DELTA != 0,
            },
            false => Rivals::Later { light_choices: first, squeeze: second },
        };
        Photon {
            path: self.path,
            flux: self.flux.decode(),
            bounces: u32::from(self.state & BOUNCES),
            rivals,
            camera_choices: self.camera_choices,
            direction: self.direction.decode(),
            pdf: self.pdf,
        }
    }
}

/// What arrivals of light paths carry.
pub type Photons = List<PackedPhoton>;

impl Photons {
    /// See [`Photon::path`].
    #[inline]
    pub fn path(&self, j: usize) -> u32 {
        self.0[j].path
    }

    /// See [`Photon::flux`].
    #[inline]
    pub fn flux(&self, j: usize) -> Vec3 {
        self.0[j].flux.decode()
    }

    /// See [`Photon::bounces`].
    #[inline]
    pub fn bounces(&self, j: usize) -> u32 {
        u32::from(self.0[j].state & BOUNCES)
    }

    /// See [`Photon::direction`].
    #[inline]
    pub fn direction(&self, j: usize) -> Vec3 {
        self.0[j].direction.decode()
    }

    /// See [`Photon::pdf`].
    #[inline]
    pub fn pdf(&self, j: usize) -> f32 {
        self.0[j].pdf
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photons_come_back() {
        assert_eq!(size_of::<PackedPhoton>(), 32);
        let first = Rivals::First { light_density: 3.0, next_event_pdf: 0.5, is_delta: true };
        let later = Rivals::Later { light_choices: 0.25, squeeze: 2.25 };
        let mut kept = Photons::default();
        for (bounces, rivals) in [(0, first), (7, later), (100_000, later)] {
            let (flux, direction) = (Vec3::new(1e-12, 5e-13, 0.0), Vec3::NEG_Z);
            let p = Photon { path: 9, flux, bounces, rivals, camera_choices: 0.75, direction, pdf: 0.1 };
            kept.push(p);
            let back = kept.get(kept.len() - 1);
            assert!((back.flux - flux).abs().max_element() < 2e-16);
            assert_eq!((back.path, back.camera_choices, back.direction, back.pdf), (9, 0.75, direction, 0.1));
            assert_eq!((back.bounces, back.rivals), (bounces.min(16_383), rivals));
        }
    }
}
