//! Instances: where meshes stand in the world, and with which materials.

use glam::{Affine3A, DAffine3};

/// What all instances of one call share.
#[derive(Clone, Debug)]
pub struct InstanceGroup {
    /// The name, for messages.
    pub name: String,
    /// Index of the mesh.
    pub mesh: u32,
    /// Material of each slot; a slot past the end uses the last one.
    pub materials: Vec<u32>,
    /// Whether camera rays see it.
    pub camera_visible: bool,
    /// Whether emissive materials emit from the back as well.
    pub two_sided_emission: bool,
    /// Value of the Object Index pass.
    pub object_index: u32,
}

impl InstanceGroup {
    /// Material of a slot.
    #[inline]
    pub fn material(&self, slot: usize) -> u32 {
        self.materials[slot.min(self.materials.len() - 1)]
    }
}

/// One mesh in the world, relative to the scene's origin.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    /// Object to world; never singular.
    pub to_world: Affine3A,
    /// Index of its [`InstanceGroup`].
    pub group: u32,
}

/// Whether a transform can be rendered: finite, and invertible in single precision.
pub fn is_regular(m: &DAffine3) -> bool {
    let size = m.matrix3.x_axis.length() * m.matrix3.y_axis.length() * m.matrix3.z_axis.length();
    m.is_finite() && size > 0.0 && m.matrix3.determinant().abs() > 1e-12 * size && {
        let inverse = m.inverse();
        let fits = |v: f64| (v as f32).is_finite();
        m.to_cols_array().into_iter().chain(inverse.to_cols_array()).all(fits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};

    #[test]
    fn flat_and_broken_transforms_are_not_regular() {
        let scale = |s: DVec3| DAffine3::from_mat3(DMat3::from_diagonal(s));
        assert!(is_regular(&DAffine3::IDENTITY));
        assert!(is_regular(&scale(DVec3::new(-1e-5, 1e5, 3.0))), "mirrors and stretches are fine");
        assert!(!is_regular(&scale(DVec3::new(1.0, 0.0, 1.0))));
        assert!(!is_regular(&scale(DVec3::new(1.0, f64::NAN, 1.0))));
        assert!(!is_regular(&scale(DVec3::splat(1e-60))));
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(1e14, 1.0, 0.0), DVec3::Z);
        assert!(!is_regular(&DAffine3::from_mat3(shear)));
    }
}
