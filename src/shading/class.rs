//! How a material's surfaces may share light with their neighbours, known without looking at a point.

use crate::scene::material::{Closure, Material};

/// What the continuous lobes of a material may be anywhere on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SurfaceClass {
    /// Lambert's only, about the surface's own normal.
    Diffuse,
    /// Reflecting lobes of any kind.
    Reflecting,
    /// Some continuous lobe scatters to the other side.
    Transmitting,
}

impl SurfaceClass {
    /// The class of a material.
    pub fn of(material: &Material) -> Self {
        let mut class = Self::Diffuse;
        material.surface.for_each(&mut |closure| class = class.max(Self::of_closure(closure)));
        class
    }

    fn of_closure(closure: &Closure) -> Self {
        match closure {
            Closure::Transparent { .. } | Closure::Emission { .. } => Self::Diffuse,
            Closure::Diffuse { roughness, normal: None, .. } if roughness.is(0.0) => Self::Diffuse,
            Closure::Diffuse { .. } | Closure::Glossy { .. } | Closure::Sheen { .. } => Self::Reflecting,
            Closure::Glass { .. } | Closure::Refraction { .. } | Closure::Translucent { .. } => {
                Self::Transmitting
            }
            Closure::Principled(p) if p.transmission.is(0.0) => Self::Reflecting,
            Closure::Principled(_) => Self::Transmitting,
            // their parts are looked at one by one
            Closure::Mix { .. } | Closure::Add { .. } => Self::Diffuse,
        }
    }
}
