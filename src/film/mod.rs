//! The film: what integrators write samples to, and what the outside reads pictures from.
//!
//! A [`Film`] is a grid of small tiles, each behind its own lock. Writers take whole tiles
//! ([`Film::par_tiles`], [`Film::add_iteration`]), so they never share a pixel; readers lock one tile at a
//! time and wait at most for the tile that is being worked on. Every method takes `&self`: the film needs no
//! lock around it and can be read from any thread while it is being rendered. Each pixel that is read is the
//! mean of whole samples; different pixels may have seen different numbers of them.
//!
//! A tile sums its samples in the order they are delivered, and one task at a time has it, so a picture does
//! not depend on the number of threads as long as the samples themselves do not.

mod bias;
mod buffer;
mod error;
mod error_estimate;
mod filter;
mod noise;
mod openexr;
mod pass;
mod rect;
mod sample;
mod splat;
mod tile;

pub use bias::Hints;
pub use buffer::{Film, SharedTile, TILE_SIZE};
pub use error::FilmError;
pub use error_estimate::ErrorEstimate;
pub use filter::{Filter, FilterKind};
pub use openexr::{Compression, ExrOptions};
pub use pass::{Pass, PassSet};
pub use rect::Rect;
pub use sample::{FirstHit, Sample};
pub use splat::{Splat, SplatBuffer, Splatted, is_wanted};
pub use tile::{BACKGROUND_DEPTH, Tile};
