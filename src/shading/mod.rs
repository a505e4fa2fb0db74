//! How surfaces scatter light, and how emitters send it out; the scene made ready for both.

pub mod bsdf;
pub mod emitters;
pub mod lobes;

mod class;
mod composition;
mod displacement;
mod emissive;
mod first_hit;
mod geometry_lookup;
mod image_lookup;
mod interior;
mod layers;
mod light_ray;
mod material;
mod ray;
mod relief;
mod sensor;
mod surface;
mod texture;
mod visibility;
mod world;

pub use class::SurfaceClass;
pub use layers::Layer;
pub use light_ray::{LightRay, SourceDensity};
pub use ray::{LightPoint, LightSample, Piece};
pub use sensor::{CameraRay, Sensor, SensorView};
pub use surface::{Address, SurfacePoint};
pub use world::{BuildCost, Shaded, Vertex, World, WorldError};
