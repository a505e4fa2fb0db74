//! Plain data of what is rendered, and its validation. A [`Scene`] that exists is valid: everything
//! wrong with the input was said while it was built.

pub mod builder;
pub mod camera;
pub mod composition;
pub mod error;
pub mod image;
pub mod instance;
pub mod light;
pub mod material;
pub mod mesh;
pub mod needs;
pub mod picture;
pub mod relief;
pub mod texture;
mod triangulate;
pub mod value;

pub use builder::{Scene, SceneBuilder};
pub use camera::Camera;
pub use error::{SceneError, Warnings};
pub use image::Image;
pub use instance::{Instance, InstanceGroup};
pub use light::{Light, LightKind, LightSpec, SeenBy};
pub use material::Material;
pub use mesh::Mesh;
pub use needs::Needs;
pub use texture::Texture;
