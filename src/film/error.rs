//! What can go wrong with a film.

use super::{Pass, Rect};
use std::path::PathBuf;

/// Why a film could not be made, read or written.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// A film has at least one pixel and no side longer than the limit.
    #[error("a film of {width} x {height} pixels cannot be made: each side is from 1 to {max} pixels")]
    Size {
        /// Width asked for, pixels.
        width: u32,
        /// Height asked for, pixels.
        height: u32,
        /// Longest side, pixels.
        max: u32,
    },
    /// The system has not got the memory.
    #[error(
        "a film of {width} x {height} pixels with these passes needs {bytes} bytes of memory, more than there are"
    )]
    Memory {
        /// Width asked for, pixels.
        width: u32,
        /// Height asked for, pixels.
        height: u32,
        /// What the film would occupy.
        bytes: u64,
    },
    /// Nothing to render.
    #[error("no passes: a film has at least one")]
    NoPasses,
    /// No pass has this name.
    #[error("unknown pass \"{0}\" (known: {known})", known = Pass::ALL.map(Pass::name).join(", "))]
    UnknownPass(String),
    /// The pass exists, but this film was made without it.
    #[error("the pass {} was not asked for when the render was created", .0.name())]
    MissingPass(Pass),
    /// A rectangle that is empty or sticks out of the film.
    #[error("{rect} is not inside the film of {width} x {height} pixels, or is empty")]
    Rect {
        /// What was asked for.
        rect: Rect,
        /// Width of the film, pixels.
        width: u32,
        /// Height of the film, pixels.
        height: u32,
    },
    /// The buffer to read into has the wrong length.
    #[error("the pixels take {needed} floats, the buffer has {given}")]
    BufferLength {
        /// Floats the pixels take.
        needed: usize,
        /// Floats of the buffer.
        given: usize,
    },
    /// The filter's width makes no sense.
    #[error("the filter's width is {0}; it is a positive number of pixels, or 0 for the default")]
    FilterWidth(f32),
    /// A name or text that an OpenEXR file cannot hold.
    #[error("OpenEXR {what} {text:?}: {reason}")]
    ExrText {
        /// Which kind of text.
        what: &'static str,
        /// The text.
        text: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// The crop does not lie in the full picture, or that is larger than OpenEXR's coordinates reach.
    #[error("{data} is not inside the full picture of {width} x {height} pixels, or that is too large")]
    Window {
        /// The film's place in the full picture.
        data: Rect,
        /// Width of the full picture, pixels.
        width: u32,
        /// Height of the full picture, pixels.
        height: u32,
    },
    /// The encoder refused the picture.
    #[error("OpenEXR: {0}")]
    Encode(String),
    /// The file system refused.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The file that was to be written.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}
