//! Textures that are made of others: sums of products, and tables.

use super::value::Value;
use super::{Image, SceneError, Texture};
use glam::Vec3;
use serde::Deserialize;

/// Textures and constants that one may look up, itself and all that its own ones look up included.
const MOST_LOOKUPS: usize = 256;

/// What is linear in each of one to three values: a sum over all products of some of them, component by component.
#[derive(Clone, Debug)]
pub struct Multilinear {
    /// The values.
    pub of: Vec<Value>,
    /// For each product its factor: bit `i` of its number tells whether value `i` is in the product.
    pub coefficients: Vec<Vec3>,
}

/// A function of one to three values, component by component, as a table that is interpolated linearly.
#[derive(Clone, Debug)]
pub struct Table {
    /// The values; each but the last runs along a side of the table.
    pub of: Vec<Value>,
    /// For each value, what stands at the first and at the last entry; beyond, these count.
    pub domain: Vec<[f32; 2]>,
    /// Index of the image: the first value runs along rows, the second along columns from the top, the third over squares
    /// of rows, from the top as well.
    pub image: u32,
    /// Entries along each value.
    pub size: Vec<u32>,
}

/// The keys of a [`Multilinear`] texture.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MultilinearJson {
    of: Vec<Value>,
    coefficients: Vec<[f32; 3]>,
}

/// The keys of a [`Table`] texture.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TableJson {
    of: Vec<Value>,
    domain: Vec<[f32; 2]>,
    image: u32,
}

impl Multilinear {
    pub(super) fn new(json: MultilinearJson, name: &str, before: &[Texture]) -> Result<Self, SceneError> {
        let MultilinearJson { of, coefficients } = json;
        check(&of, name, before)?;
        let fail = |problem: String| Err(SceneError::new(format!("texture {name:?}"), problem));
        if coefficients.len() != 1 << of.len() {
            return fail(format!("{} values have {} coefficients", of.len(), 1 << of.len()));
        }
        if coefficients.as_flattened().iter().any(|c| !c.is_finite()) {
            return fail("a coefficient is not finite".into());
        }
        Ok(Self { of, coefficients: coefficients.into_iter().map(Vec3::from).collect() })
    }
}

impl Table {
    pub(super) fn new(
        json: TableJson,
        name: &str,
        images: &[std::sync::Arc<Image>],
        before: &[Texture],
    ) -> Result<Self, SceneError> {
        let TableJson { of, domain, image } = json;
        check(&of, name, before)?;
        let fail = |problem: String| Err(SceneError::new(format!("texture {name:?}"), problem));
        let Some(picture) = images.get(image as usize) else {
            return fail(format!("there is no image {image}"));
        };
        if domain.len() != of.len()
            || domain.iter().any(|[low, high]| !((high - low).is_finite() && high > low))
        {
            return fail("its domain is not one interval for each value".into());
        }
        let (width, height) = (picture.width(), picture.height());
        let size = match of.len() {
            1 => vec![width],
            2 => vec![width, height],
            _ => vec![width, width, height / width],
        };
        if size.len() == 3 && width.checked_mul(width) != Some(height) {
            return fail(format!(
                "a table of three values has as many rows as its width squared, not {height}"
            ));
        }
        Ok(Self { of, domain, image, size })
    }
}

/// How many textures and constants a texture looks up, itself included.
fn lookups(texture: &Texture, all: &[Texture]) -> usize {
    let of_value = |v: &Value| match v {
        Value::Constant(_) => 1,
        Value::Texture { texture, .. } => lookups(&all[*texture as usize], all),
    };
    1 + texture.made_of().iter().map(of_value).sum::<usize>()
}

/// Checks what a texture is made of: all of that was there before it, so that none is made of itself.
pub(super) fn check(of: &[Value], name: &str, before: &[Texture]) -> Result<(), SceneError> {
    let fail = |problem: String| Err(SceneError::new(format!("texture {name:?}"), problem));
    if !(1..=3).contains(&of.len()) {
        return fail(format!("it is made of one to three values, not of {}", of.len()));
    }
    let mut sum = 1;
    for value in of {
        sum += match value {
            Value::Constant(c) if !c.is_finite() => return fail("a value is not finite".into()),
            Value::Constant(_) => 1,
            Value::Texture { texture, .. } => match before.get(*texture as usize) {
                Some(t) => lookups(t, before),
                None => return fail(format!("there is no texture {texture} before it")),
            },
        };
    }
    if sum > MOST_LOOKUPS {
        return fail(format!("it looks up {sum} textures and constants, at most {MOST_LOOKUPS} are allowed"));
    }
    Ok(())
}
