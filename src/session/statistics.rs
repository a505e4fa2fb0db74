//! Figures of a render, as they go into the log, the file's header and to whoever asks.

use crate::transport::report::Report;
use serde::Serialize;
use std::collections::BTreeMap;

/// Cost of one stage of the render.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Stage {
    /// Seconds on the wall clock.
    pub seconds: f64,
    /// Bytes it keeps.
    pub bytes: u64,
}

/// A point of the curve of error against run time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CurvePoint {
    /// Seconds of rendering.
    pub seconds: f64,
    /// Processor seconds of rendering, all threads.
    pub cpu_seconds: f64,
    /// Samples a pixel, on average.
    pub samples: f64,
    /// Estimated relative mean squared error; absent while there are too few samples to tell.
    pub estimated_error: Option<f64>,
    /// The part of it that is systematic, where the method can tell.
    pub estimated_bias: Option<f64>,
}

/// Why a render came to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// It has not been run, or is running.
    Running,
    /// The number of samples was reached.
    Samples,
    /// The time was used up.
    Time,
    /// The estimated error fell below the threshold.
    Error,
    /// It was cancelled.
    Cancelled,
}

/// Statistics of a render. The names are those of `docs/abi.md`.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs)]
pub struct Statistics {
    pub integrator: String,
    pub seconds: f64,
    pub cpu_seconds: f64,
    pub build_seconds: f64,
    pub samples: f64,
    pub rays: u64,
    pub segments: u64,
    pub bytes_per_segment: f64,
    pub peak_memory_bytes: u64,
    pub non_finite: u64,
    pub dropped: u64,
    pub graph: Option<Report>,
    pub estimated_error: Option<f64>,
    pub estimated_bias: Option<f64>,
    pub threads: usize,
    pub seed: u32,
    pub width: u32,
    pub height: u32,
    pub stop_reason: StopReason,
    pub stages: BTreeMap<String, Stage>,
    pub left_out: Vec<String>,
    pub warnings: Vec<String>,
    pub curve: Vec<CurvePoint>,
}
