//! What is asked of a render.

use crate::film::{Filter, FilterKind, Pass, PassSet, Rect};
use crate::transport::bridge::Choice;
use crate::transport::kernel::{DEFAULT_ALPHA, Kernel, Shrinking};
use crate::transport::{Estimator, Techniques};
use serde::{Deserialize, Serialize};

/// The integrators there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Segment-based light transport.
    #[default]
    Segment,
    /// The same with bridge segments.
    SegmentBridge,
    /// Its camera segments alone: multi-vertex filtering.
    Mvf,
    /// Its light segments, gathered where camera paths first arrive.
    PhotonFilter,
    /// Its paths formed one by one and weighed as a whole, as a check.
    SegmentPath,
    /// Unidirectional path tracing with next-event estimation.
    Path,
    /// Light tracing.
    Light,
    /// Bidirectional path tracing.
    Bdpt,
    /// Progressive photon mapping.
    Ppm,
    /// Bidirectional photon mapping.
    Bpm,
    /// Vertex connection and merging.
    Vcm,
}

impl Method {
    fn needs_light_paths(self) -> bool {
        !matches!(self, Self::Segment | Self::Mvf | Self::SegmentPath | Self::Path)
    }
}

/// How the kernel of the methods that have one changes.
#[derive(Clone, Copy, Debug, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
enum KernelName {
    Fixed,
    Progressive,
    #[default]
    Adaptive,
}

/// How the light segments of the segment method are used.
#[derive(Clone, Copy, Debug, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
enum EstimatorName {
    #[default]
    LeaveOneOut,
    Literal,
}

/// How bridge segments choose the light segments that they join.
#[derive(Clone, Copy, Debug, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
enum BridgeName {
    #[default]
    Uniform,
    Power,
}

/// Validated settings of a render.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The JSON they were read from.
    pub source: String,
    /// How light transport is computed.
    pub method: Method,
    /// What the segment method samples; kernel and light paths are those of the others, too.
    pub techniques: Techniques,
    /// Width and height of the full film.
    pub resolution: [u32; 2],
    /// The part of the film that is rendered.
    pub crop: Rect,
    /// When to stop.
    pub limits: Limits,
    /// Bounces; `None` is unlimited.
    pub max_depth: Option<u32>,
    /// Threads; 0 is all.
    pub threads: usize,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Pixel filter.
    pub filter: Filter,
    /// Whether what lies behind everything is transparent.
    pub transparent_background: bool,
    /// Passes to keep.
    pub passes: PassSet,
    /// Leave nothing out.
    pub keep_all: bool,
    /// Sweeps by which the statistics examine the transfer operator; 0: not at all.
    pub operator_sweeps: u32,
}

/// When a render stops: at whichever limit comes first. At least one is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Samples a pixel.
    pub samples: Option<u32>,
    /// Seconds of rendering.
    pub seconds: Option<f64>,
    /// Estimated relative mean squared error.
    pub error: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Json {
    integrator: Method,
    estimator: EstimatorName,
    bridges: BridgeName,
    kernel: KernelName,
    kernel_size: f32,
    kernel_alpha: f32,
    light_paths: f32,
    next_event: bool,
    emission_guiding: bool,
    memory_budget: u32,
    camera_paths: bool,
    resolution: [u32; 2],
    crop: Option<[u32; 4]>,
    samples: u32,
    time: f64,
    noise_threshold: f64,
    max_depth: i64,
    threads: usize,
    seed: u32,
    filter: FilterKind,
    filter_width: f32,
    transparent_background: bool,
    passes: Vec<String>,
    keep_all: bool,
    operator_sweeps: u32,
}

impl Default for Json {
    fn default() -> Self {
        let techniques = Techniques::default();
        Self {
            integrator: Method::default(),
            estimator: EstimatorName::default(),
            bridges: BridgeName::default(),
            kernel: KernelName::default(),
            kernel_size: techniques.kernel.start,
            kernel_alpha: DEFAULT_ALPHA,
            light_paths: techniques.light_paths,
            next_event: techniques.next_event,
            emission_guiding: techniques.emission_guiding,
            memory_budget: (techniques.memory_budget >> 20) as u32,
            camera_paths: techniques.camera_paths,
            resolution: [0, 0],
            crop: None,
            samples: 0,
            time: 0.0,
            noise_threshold: 0.0,
            max_depth: -1,
            threads: 0,
            seed: 0,
            filter: FilterKind::default(),
            filter_width: 0.0,
            transparent_background: false,
            passes: vec!["Combined".into()],
            keep_all: false,
            operator_sweeps: 0,
        }
    }
}

impl Json {
    fn techniques(&self) -> Result<Techniques, String> {
        let within = |what: &str, v: f32, low: f32, high: f32| match v {
            v if (low..=high).contains(&v) => Ok(v),
            v => Err(format!("settings: {what} is {v}, not in [{low}, {high}]")),
        };
        if self.light_paths == 0.0 && self.integrator.needs_light_paths() {
            return Err("settings: light_paths is 0, and this integrator cannot do without".into());
        }
        let has_bridges = self.integrator == Method::SegmentBridge;
        let is_literal = matches!(self.estimator, EstimatorName::Literal);
        if is_literal && (has_bridges || self.integrator == Method::SegmentPath) {
            return Err("settings: this integrator has no literal estimator".into());
        }
        let alpha = within("kernel_alpha", self.kernel_alpha, 0.01, 0.99)?;
        let techniques = Techniques {
            estimator: match self.estimator {
                EstimatorName::LeaveOneOut => Estimator::LeaveOneOut,
                EstimatorName::Literal => Estimator::Literal,
            },
            kernel: Kernel {
                start: within("kernel_size", self.kernel_size, 1e-3, 1e3)?,
                shrinking: match self.kernel {
                    KernelName::Fixed => Shrinking::Fixed,
                    KernelName::Progressive => Shrinking::Progressive { alpha },
                    KernelName::Adaptive => Shrinking::Adaptive { alpha },
                },
            },
            light_paths: within("light_paths", self.light_paths, 0.0, 64.0)?,
            next_event: self.next_event,
            // what bridges bring is not among the lessons
            emission_guiding: self.emission_guiding && !has_bridges,
            memory_budget: u64::from(self.memory_budget.max(1)) << 20,
            camera_paths: self.camera_paths,
            bridges: has_bridges.then_some(match self.bridges {
                BridgeName::Uniform => Choice::Uniform,
                BridgeName::Power => Choice::ByPower,
            }),
        };
        if techniques.light_paths == 0.0 && !techniques.next_event && !techniques.camera_paths {
            return Err(
                "settings: without light_paths, next_event and camera_paths nothing is sampled".into()
            );
        }
        Ok(techniques)
    }
}

/// Most threads a render may ask for.
const MAX_THREADS: usize = 1024;

impl Settings {
    /// Paths that are kept at a time, where they may be of any length.
    pub fn kept_paths(&self) -> Option<f32> {
        use Method::{Mvf, PhotonFilter, Segment, SegmentPath};
        let keeps = matches!(self.method, Segment | SegmentPath | Mvf | PhotonFilter);
        let pixels = self.resolution[0] as f32 * self.resolution[1] as f32;
        (keeps && self.max_depth.is_none()).then_some(pixels * self.techniques.light_paths.max(1.0))
    }

    /// Reads and checks the JSON of `docs/abi.md`; the error says what is wrong with which key.
    pub fn from_json(json: &str) -> Result<Self, String> {
        let j: Json = serde_json::from_str(json).map_err(|e| format!("settings: {e}"))?;
        let [w, h] = j.resolution;
        if w == 0 || h == 0 {
            return Err(format!("settings: resolution is {w} x {h}"));
        }
        let [x0, y0, x1, y1] = j.crop.unwrap_or([0, 0, w, h]);
        if x0 >= x1 || y0 >= y1 || x1 > w || y1 > h {
            return Err(format!(
                "settings: crop [{x0}, {y0}, {x1}, {y1}] is not a rectangle of {w} x {h} pixels"
            ));
        }
        let limit = |what: &str, v: f64| match v {
            0.0 => Ok(None),
            v if v > 0.0 && v.is_finite() => Ok(Some(v)),
            v => Err(format!("settings: {what} is {v}")),
        };
        let limits = Limits {
            samples: (j.samples > 0).then_some(j.samples),
            seconds: limit("time", j.time)?,
            error: limit("noise_threshold", j.noise_threshold)?,
        };
        if limits == (Limits { samples: None, seconds: None, error: None }) {
            return Err("settings: one of samples, time and noise_threshold must be set".into());
        }
        if j.threads > MAX_THREADS {
            return Err(format!("settings: {} threads, allowed are {MAX_THREADS}", j.threads));
        }
        // the picture itself is always kept
        let mut passes = PassSet::default();
        for name in &j.passes {
            let pass: Pass = name.parse().map_err(|e| format!("settings: {e}"))?;
            passes = passes.with(pass);
        }
        Ok(Self {
            source: json.into(),
            method: j.integrator,
            techniques: j.techniques()?,
            resolution: j.resolution,
            crop: Rect::new(x0, y0, x1 - x0, y1 - y0),
            limits,
            max_depth: match j.max_depth {
                -1 => None,
                d => Some(u32::try_from(d).map_err(|_| format!("settings: max_depth is {d}"))?),
            },
            threads: j.threads,
            seed: j.seed,
            filter: Filter::new(j.filter, j.filter_width).map_err(|e| format!("settings: {e}"))?,
            transparent_background: j.transparent_background,
            passes,
            keep_all: j.keep_all,
            operator_sweeps: j.operator_sweeps,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_settings_are_refused_with_their_key() {
        for (json, what) in [
            (r#"{"samples":1}"#, "resolution"),
            (r#"{"resolution":[4,4]}"#, "noise_threshold"),
            (r#"{"resolution":[4,4],"time":-1}"#, "time"),
            (r#"{"resolution":[4,4],"samples":1,"crop":[0,0,5,4]}"#, "crop"),
            (r#"{"resolution":[4,4],"samples":1,"passes":["Colour"]}"#, "Colour"),
            (r#"{"resolution":[4,4],"samples":1,"max_depth":-2}"#, "max_depth"),
            (r#"{"resolution":[4,4],"samples":1,"integrator":"magic"}"#, "magic"),
            (r#"{"resolution":[4,4],"samples":1,"spp":1}"#, "spp"),
            (r#"{"resolution":[4,4],"samples":1,"kernel_size":0}"#, "kernel_size"),
            (r#"{"resolution":[4,4],"samples":1,"light_paths":-1}"#, "light_paths"),
            (r#"{"resolution":[4,4],"samples":1,"light_paths":0,"integrator":"vcm"}"#, "light_paths"),
            (
                r#"{"resolution":[4,4],"samples":1,"integrator":"segment-bridge","estimator":"literal"}"#,
                "no literal estimator",
            ),
            (
                r#"{"resolution":[4,4],"samples":1,"light_paths":0,"next_event":false,"camera_paths":false}"#,
                "nothing is sampled",
            ),
        ] {
            let e = Settings::from_json(json).unwrap_err();
            assert!(e.contains(what), "{json}: {e}");
        }
    }

    #[test]
    fn defaults_are_those_of_the_document() {
        let s = Settings::from_json(r#"{"resolution":[40,30],"samples":8}"#).unwrap();
        assert_eq!((s.method, s.max_depth, s.crop), (Method::Segment, None, Rect::new(0, 0, 40, 30)));
        assert_eq!(s.limits, Limits { samples: Some(8), seconds: None, error: None });
    }
}
