//! Arrivals as they are kept: 36 bytes each.

use super::Arrival;
use super::list::{List, Pack};
use crate::math::Octahedral;
use crate::shading::{Address, SurfaceClass};
use glam::{DVec2, Vec2, Vec3};

/// Steps of a probability of going on.
const SURVIVAL_STEPS: u16 = 4095;
/// The other bits of the same number: whether the path goes on, whether the reflectance is more than one, the class.
const GOES_ON: u16 = 1 << 12;
const BRIGHT: u16 = 1 << 13;
const CLASS: u32 = 14;
/// Steps of the square root of a reflectance up to one: dark surfaces are as right as bright ones.
const REFLECTANCE_STEPS: f32 = 65_535.0;
/// Largest reflectance of a surface that gives more light than it gets.
const BRIGHTEST: f32 = 16.0;
/// Steps of a barycentric coordinate.
const BARYCENTRIC_STEPS: f64 = 16_777_215.0;

/// The next lower probability of going on that can be kept: one of 4096.
#[inline]
pub fn storable_survival(q: f32) -> f32 {
    let steps = f32::from(SURVIVAL_STEPS);
    (q * steps).floor() / steps
}

/// An arrival. What its scattering depends on differs with the class of its surface.
#[derive(Clone, Copy, Debug)]
pub struct PackedArrival {
    position: Vec3,
    instance: u32,
    triangle: u32,
    normal: Octahedral,
    /// The bits of `back_pdf` if the surface is diffuse, else the code of `wo`.
    view: u32,
    /// The reflectance of a diffuse surface, to within 2e-5 (of 1e-4, 2e-7); of others the barycentrics, 24 bits each.
    look: [u16; 3],
    state: u16,
}

impl Pack for PackedArrival {
    type Item = Arrival;

    fn pack(a: &Arrival) -> Self {
        let is_diffuse = a.class == SurfaceClass::Diffuse;
        let is_bright = is_diffuse && a.reflectance.max_element() > 1.0;
        let survival = (a.survival * f32::from(SURVIVAL_STEPS)).round() as u16;
        let class = match a.class {
            SurfaceClass::Diffuse => 0,
            SurfaceClass::Reflecting => 1,
            SurfaceClass::Transmitting => 2,
        };
        Self {
            position: a.position,
            instance: a.at.instance,
            triangle: a.at.triangle,
            normal: Octahedral::encode(a.normal),
            view: if is_diffuse { a.back_pdf.to_bits() } else { Octahedral::encode(a.wo).to_bits() },
            look: match is_diffuse {
                true => reflectance_code(a.reflectance / reflectance_scale(is_bright)),
                false => barycentric_code(a.at.barycentrics),
            },
            state: survival.min(SURVIVAL_STEPS)
                | if a.goes_on { GOES_ON } else { 0 }
                | if is_bright { BRIGHT } else { 0 }
                | class << CLASS,
        }
    }

    #[inline]
    fn unpack(&self) -> Arrival {
        let normal = self.normal.decode();
        let class = self.class();
        let is_diffuse = class == SurfaceClass::Diffuse;
        let (wo, barycentrics) = match is_diffuse {
            true => (normal, Vec2::ZERO),
            false => (Octahedral::from_bits(self.view).decode(), barycentrics(self.look)),
        };
        Arrival {
            position: self.position,
            normal,
            wo,
            at: Address { instance: self.instance, triangle: self.triangle, barycentrics },
            reflectance: self.reflectance(),
            back_pdf: self.back_pdf(),
            survival: self.survival(),
            class,
            goes_on: self.goes_on(),
        }
    }
}

impl PackedArrival {
    #[inline]
    fn reflectance(&self) -> Vec3 {
        match self.class() {
            SurfaceClass::Diffuse => {
                let root = Vec3::from(self.look.map(f32::from)) / REFLECTANCE_STEPS;
                root * root * reflectance_scale(self.state & BRIGHT != 0)
            }
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => Vec3::ZERO,
        }
    }

    #[inline]
    fn back_pdf(&self) -> f32 {
        match self.class() {
            SurfaceClass::Diffuse => f32::from_bits(self.view),
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => 0.0,
        }
    }

    #[inline]
    fn survival(&self) -> f32 {
        f32::from(self.state & SURVIVAL_STEPS) / f32::from(SURVIVAL_STEPS)
    }

    #[inline]
    fn goes_on(&self) -> bool {
        self.state & GOES_ON != 0
    }

    #[inline]
    fn class(&self) -> SurfaceClass {
        match self.state >> CLASS {
            0 => SurfaceClass::Diffuse,
            1 => SurfaceClass::Reflecting,
            _ => SurfaceClass::Transmitting,
        }
    }
}

/// Reflectance of the largest code.
fn reflectance_scale(is_bright: bool) -> f32 {
    if is_bright { BRIGHTEST } else { 1.0 }
}

/// Conversion takes what is too large to the largest, and what is negative or NaN to zero.
fn reflectance_code(reflectance: Vec3) -> [u16; 3] {
    (reflectance.powf(0.5) * REFLECTANCE_STEPS).round().to_array().map(|c| c as u16)
}

fn barycentric_code(b: Vec2) -> [u16; 3] {
    let [u, v] = (b.as_dvec2() * BARYCENTRIC_STEPS).round().to_array().map(|c| c as u64);
    let bits = u | v << 24;
    [bits as u16, (bits >> 16) as u16, (bits >> 32) as u16]
}

#[inline]
fn barycentrics(code: [u16; 3]) -> Vec2 {
    let [low, middle, high] = code.map(u64::from);
    let bits = low | middle << 16 | high << 32;
    let [u, v] = [bits & 0xff_ffff, bits >> 24].map(|c| c as f64);
    (DVec2::new(u, v) / BARYCENTRIC_STEPS).as_vec2()
}

/// Ends of segments.
pub type Arrivals = List<PackedArrival>;

impl Arrivals {
    /// See [`Arrival::position`].
    #[inline]
    pub fn position(&self, i: usize) -> Vec3 {
        self.0[i].position
    }

    /// See [`Arrival::position`] and [`Arrival::normal`].
    #[inline]
    pub fn place(&self, i: usize) -> (Vec3, Vec3) {
        (self.0[i].position, self.0[i].normal.decode())
    }

    /// See [`Arrival::reflectance`].
    #[inline]
    pub fn reflectance(&self, i: usize) -> Vec3 {
        self.0[i].reflectance()
    }

    /// See [`Arrival::back_pdf`].
    #[inline]
    pub fn back_pdf(&self, i: usize) -> f32 {
        self.0[i].back_pdf()
    }

    /// See [`Arrival::survival`].
    #[inline]
    pub fn survival(&self, i: usize) -> f32 {
        self.0[i].survival()
    }

    /// See [`Arrival::class`].
    #[inline]
    pub fn class(&self, i: usize) -> SurfaceClass {
        self.0[i].class()
    }

    /// See [`Arrival::goes_on`].
    #[inline]
    pub fn goes_on(&self, i: usize) -> bool {
        self.0[i].goes_on()
    }

    /// Instance of arrival `i`, and triangle of its mesh.
    #[inline]
    pub fn triangle(&self, i: usize) -> (u32, u32) {
        (self.0[i].instance, self.0[i].triangle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::hash_unit;
    use crate::math::warp;

    fn arrival(k: u32, class: SurfaceClass) -> Arrival {
        let u = |n| hash_unit(n, k);
        let is_diffuse = class == SurfaceClass::Diffuse;
        Arrival {
            position: Vec3::new(u(0), u(1), u(2)) * 1e4,
            normal: warp::uniform_sphere(Vec2::new(u(3), u(4))),
            wo: warp::uniform_sphere(Vec2::new(u(5), u(6))),
            at: Address { instance: k, triangle: !k, barycentrics: Vec2::new(u(7), u(8)) },
            reflectance: if is_diffuse { Vec3::new(u(9), 1.0, 0.0) } else { Vec3::ZERO },
            back_pdf: if is_diffuse { u(10) } else { 0.0 },
            survival: storable_survival(u(11)),
            class,
            goes_on: k.is_multiple_of(2),
        }
    }

    #[test]
    fn arrivals_come_back_as_far_as_they_are_needed() {
        assert_eq!(size_of::<PackedArrival>(), 36);
        for class in [SurfaceClass::Diffuse, SurfaceClass::Reflecting, SurfaceClass::Transmitting] {
            let arrivals: Vec<Arrival> = (0..1000).map(|k| arrival(k, class)).collect();
            let kept: Arrivals = arrivals.iter().copied().collect();
            for (a, b) in arrivals.iter().zip(kept.iter()) {
                assert_eq!((a.position, a.survival, a.class), (b.position, b.survival, b.class));
                assert_eq!((a.at.instance, a.at.triangle), (b.at.instance, b.at.triangle));
                assert_eq!((a.goes_on, a.back_pdf), (b.goes_on, b.back_pdf));
                assert!(a.normal.distance(b.normal) < 7e-5);
                let bound = 1.6e-5 * a.reflectance.powf(0.5) + 1e-9;
                assert!((a.reflectance - b.reflectance).abs().cmple(bound).all());
                if class != SurfaceClass::Diffuse {
                    assert!(a.wo.distance(b.wo) < 7e-5);
                    assert!((a.at.barycentrics - b.at.barycentrics).abs().max_element() < 1e-7);
                }
            }
        }
    }

    #[test]
    fn surfaces_may_give_more_light_than_they_get() {
        let bright = Arrival { reflectance: Vec3::new(3.0, 0.5, 0.0), ..arrival(1, SurfaceClass::Diffuse) };
        let back = [bright].into_iter().collect::<Arrivals>().get(0).reflectance;
        assert!((back - bright.reflectance).abs().max_element() < 2e-4, "{back}");
    }

    #[test]
    fn probabilities_of_going_on_are_kept_as_they_were_decided_by() {
        for k in 0..=1000 {
            let q = k as f32 * 1e-3;
            let kept = storable_survival(q);
            assert!(kept <= q && kept > q - 2.5e-4);
            let a = Arrival { survival: kept, ..arrival(1, SurfaceClass::Diffuse) };
            assert_eq!([a].into_iter().collect::<Arrivals>().get(0).survival, kept);
        }
    }
}
