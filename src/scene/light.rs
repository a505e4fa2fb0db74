//! Lights: their description as the ABI gives it, and their data once placed in the world.

mod description;
mod placement;

pub use description::LightSpec;

use glam::{Mat3, Vec3};

/// How emission falls off with the angle to an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// UsdLux's ShapingAPI.
    Lux {
        /// Angle to the axis beyond which nothing is emitted, radians, in (0, pi].
        cutoff: f32,
        /// Share of `cutoff`, from its end, over which a smoothstep fades emission out.
        softness: f32,
        /// Exponent of the cosine to the axis.
        focus: f32,
        /// Colour towards which the focus fades off the axis.
        focus_tint: Vec3,
    },
    /// Blender's spot: a smoothstep of the cosine.
    Spot {
        /// Half the cone's full angle, radians, in (0, pi].
        half_angle: f32,
        /// Share of `1 - cos(half_angle)` over which the edge is blended.
        blend: f32,
    },
    /// Blender's area light spread: the share of light a grid of slats lets through, scaled so that a
    /// flat light keeps its power.
    Spread {
        /// Half the full angle, radians, in (0, pi/2).
        half_angle: f32,
    },
}

/// A profile and the axis it is measured from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaping {
    /// Unit axis, world space, along the light's -z.
    pub axis: Vec3,
    /// Fall-off around it.
    pub profile: Profile,
}

/// Which rays see a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeenBy {
    /// All.
    All,
    /// All but those from the camera.
    AllButCamera,
    /// Those from the camera alone: a backdrop, which sheds no light on anything.
    CameraAlone,
}

impl SeenBy {
    /// Whether a ray sees it.
    pub fn includes(self, from_camera: bool) -> bool {
        match self {
            Self::All => true,
            Self::AllButCamera => !from_camera,
            Self::CameraAlone => from_camera,
        }
    }
}

/// A light in world space. Radiance is in W/(m^2 sr) per linear Rec.709 channel.
#[derive(Clone, Debug)]
pub struct Light {
    /// The name, for messages.
    pub name: String,
    /// Which rays see it.
    pub seen_by: SeenBy,
    /// What emits.
    pub kind: LightKind,
}

/// What emits, in world space.
#[derive(Clone, Debug)]
pub enum LightKind {
    /// A parallelogram that emits from one side.
    Rect {
        /// Its middle.
        center: Vec3,
        /// The whole edge along the light's +x.
        edge_x: Vec3,
        /// The whole edge along the light's +y.
        edge_y: Vec3,
        /// Unit normal of the side that emits.
        normal: Vec3,
        /// Emitted radiance.
        radiance: Vec3,
        /// Image that multiplies `radiance`: the top left at (+x, +y), as seen upright by who looks at
        /// the emitting side (UsdLux).
        image: Option<u32>,
        /// Directional fall-off.
        shaping: Option<Shaping>,
    },
    /// An ellipse that emits from one side.
    Disk {
        /// Its middle.
        center: Vec3,
        /// Major and minor semi-axes, orthogonal to each other.
        axes: [Vec3; 2],
        /// Unit normal of the side that emits.
        normal: Vec3,
        /// Emitted radiance.
        radiance: Vec3,
        /// Directional fall-off.
        shaping: Option<Shaping>,
    },
    /// A sphere that emits outwards.
    Sphere {
        /// Its middle.
        center: Vec3,
        /// Its radius.
        radius: f32,
        /// Emitted radiance.
        radiance: Vec3,
        /// Directional fall-off.
        shaping: Option<Shaping>,
    },
    /// A cylinder without caps that emits outwards.
    Cylinder {
        /// Its middle.
        center: Vec3,
        /// From one end of its axis to the other.
        axis: Vec3,
        /// Its radius.
        radius: f32,
        /// Emitted radiance.
        radiance: Vec3,
        /// Directional fall-off.
        shaping: Option<Shaping>,
    },
    /// A point without size.
    Point {
        /// Where it is.
        position: Vec3,
        /// Emitted intensity, W/sr.
        intensity: Vec3,
        /// Directional fall-off.
        shaping: Option<Shaping>,
    },
    /// Light from a cone of directions, the same everywhere.
    Distant {
        /// Unit vector along which the light travels.
        direction: Vec3,
        /// Half angle of the cone, radians, in [0, pi]; 0 is a single direction.
        half_angle: f64,
        /// Irradiance of a surface that faces the light.
        irradiance: Vec3,
    },
    /// Light from all around.
    Dome {
        /// Rotation, or rotation and mirror, from the light to the world.
        to_world: Mat3,
        /// Emitted radiance.
        radiance: Vec3,
        /// Lat-long image that multiplies `radiance`.
        image: Option<u32>,
    },
}
