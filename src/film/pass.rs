//! Render passes: the pictures a film can hold side by side.

use super::FilmError;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// A picture of the film. The names are those of the ABI, of the EXR files and of Blender's passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Pass {
    /// Radiance and alpha, premultiplied.
    Combined,
    /// Coverage alone.
    Alpha,
    /// Distance to the camera's plane along its view axis, scene units.
    Depth,
    /// World position.
    Position,
    /// World shading normal.
    Normal,
    /// Colour of the surface, in `[0,1]`.
    Albedo,
    /// Texture coordinates `(u, v, 1)`.
    #[serde(rename = "UV")]
    Uv,
    /// The object's pass index.
    ObjectIndex,
    /// The material's pass index.
    MaterialIndex,
    /// Radiance emitted by what the camera sees.
    Emission,
    /// Radiance scattered once on its way from an emitter.
    Direct,
    /// Radiance scattered more than once.
    Indirect,
}

impl Pass {
    /// Every pass, in the order of the enum.
    pub const ALL: [Pass; 12] = [
        Pass::Combined,
        Pass::Alpha,
        Pass::Depth,
        Pass::Position,
        Pass::Normal,
        Pass::Albedo,
        Pass::Uv,
        Pass::ObjectIndex,
        Pass::MaterialIndex,
        Pass::Emission,
        Pass::Direct,
        Pass::Indirect,
    ];

    /// Name of the pass.
    pub const fn name(self) -> &'static str {
        match self {
            Pass::Combined => "Combined",
            Pass::Alpha => "Alpha",
            Pass::Depth => "Depth",
            Pass::Position => "Position",
            Pass::Normal => "Normal",
            Pass::Albedo => "Albedo",
            Pass::Uv => "UV",
            Pass::ObjectIndex => "ObjectIndex",
            Pass::MaterialIndex => "MaterialIndex",
            Pass::Emission => "Emission",
            Pass::Direct => "Direct",
            Pass::Indirect => "Indirect",
        }
    }

    /// One letter per channel, in order: the last part of the channels' names in EXR files, as Blender
    /// writes them.
    pub const fn channel_letters(self) -> &'static str {
        match self {
            Pass::Combined => "RGBA",
            Pass::Alpha => "A",
            Pass::Depth => "Z",
            Pass::Position | Pass::Normal => "XYZ",
            Pass::Albedo | Pass::Emission | Pass::Direct | Pass::Indirect => "RGB",
            Pass::Uv => "UVA",
            Pass::ObjectIndex | Pass::MaterialIndex => "X",
        }
    }

    /// Number of channels: 1, 3 or 4.
    pub const fn channels(self) -> usize {
        self.channel_letters().len()
    }

    /// Whether it shows the first sample of the pixel that hits something (a mean of indices, positions or
    /// texture coordinates of different things means nothing); the other passes are averages.
    pub const fn is_first_hit(self) -> bool {
        matches!(self, Pass::Depth | Pass::Position | Pass::Uv | Pass::ObjectIndex | Pass::MaterialIndex)
    }

    /// Whether a sample's first surface tells it, in the mean or by itself.
    pub const fn is_of_surfaces(self) -> bool {
        self.is_first_hit() || matches!(self, Pass::Normal | Pass::Albedo)
    }
}

impl FromStr for Pass {
    type Err = FilmError;

    fn from_str(name: &str) -> Result<Self, FilmError> {
        Self::ALL
            .into_iter()
            .find(|pass| pass.name() == name)
            .ok_or_else(|| FilmError::UnknownPass(name.to_owned()))
    }
}

/// A set of passes. As JSON, a list of their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Vec<Pass>", into = "Vec<Pass>")]
pub struct PassSet(u16);

impl PassSet {
    /// The set without passes.
    pub const EMPTY: PassSet = PassSet(0);

    /// Whether `pass` is in the set.
    #[inline]
    pub const fn contains(self, pass: Pass) -> bool {
        self.0 & (1 << pass as u16) != 0
    }

    /// The set with `pass` added.
    #[must_use]
    pub const fn with(self, pass: Pass) -> Self {
        Self(self.0 | (1 << pass as u16))
    }

    /// Whether the set has no passes.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Its passes, in the order of [`Pass::ALL`].
    pub fn iter(self) -> impl Iterator<Item = Pass> {
        Pass::ALL.into_iter().filter(move |&pass| self.contains(pass))
    }
}

impl Default for PassSet {
    /// The picture alone: [`Pass::Combined`].
    fn default() -> Self {
        Self::EMPTY.with(Pass::Combined)
    }
}

impl FromIterator<Pass> for PassSet {
    fn from_iter<I: IntoIterator<Item = Pass>>(passes: I) -> Self {
        passes.into_iter().fold(Self::EMPTY, Self::with)
    }
}

impl From<Vec<Pass>> for PassSet {
    fn from(passes: Vec<Pass>) -> Self {
        passes.into_iter().collect()
    }
}

impl From<PassSet> for Vec<Pass> {
    fn from(set: PassSet) -> Self {
        set.iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip_and_unknown_ones_are_named() {
        for pass in Pass::ALL {
            assert_eq!(pass.name().parse::<Pass>().unwrap(), pass);
            assert_eq!(serde_json::to_value(pass).unwrap(), pass.name());
        }
        let error = "combined".parse::<Pass>().unwrap_err().to_string();
        assert!(error.contains("\"combined\"") && error.contains("MaterialIndex"), "{error}");
    }

    #[test]
    fn channel_counts_are_those_of_the_abi() {
        for pass in Pass::ALL {
            let expected = match pass {
                Pass::Combined => 4,
                Pass::Alpha | Pass::Depth | Pass::ObjectIndex | Pass::MaterialIndex => 1,
                _ => 3,
            };
            assert_eq!(pass.channels(), expected, "{pass:?}");
        }
    }

    #[test]
    fn sets_keep_order_and_forget_repetitions() {
        let set: PassSet = serde_json::from_str(r#"["UV", "Combined", "UV"]"#).unwrap();
        assert_eq!(set.iter().collect::<Vec<_>>(), [Pass::Combined, Pass::Uv]);
        assert_eq!(serde_json::to_string(&set).unwrap(), r#"["Combined","UV"]"#);
        assert!(serde_json::from_str::<PassSet>(r#"["Beauty"]"#).is_err());
        assert!(PassSet::EMPTY.is_empty() && !PassSet::default().is_empty());
    }
}
