//! Segment-based light transport (Wang, West and Hachisuka 2025), after its Algorithm 1: sample, cluster, weigh,
//! propagate, gather. `docs/method.md` tells the method in one piece.

pub mod adaptation;
pub mod area;
pub mod arrival;
pub mod bridge;
pub mod camera;
pub mod cluster;
pub mod depth;
mod division;
pub mod economy;
mod exchange;
pub mod glances;
pub mod grid;
pub mod guiding;
pub mod kernel;
mod layout;
pub mod light;
mod literal;
pub mod operator;
pub mod outline;
mod own_path;
mod paired;
mod photons;
pub mod propagate;
pub mod report;
mod returns;
pub mod sizes;
pub mod sparse;
pub mod store;
#[cfg(test)]
pub(crate) mod testing;
mod unseen;
pub mod walk;
pub mod weigh;
mod whole_path;

/// Asked now and then whether to stop.
#[derive(Clone, Copy)]
pub struct Cut<'a>(pub &'a (dyn Fn() -> bool + Sync));

impl Cut<'_> {
    /// Whether to stop.
    #[inline]
    pub fn is_raised(&self) -> bool {
        (self.0)()
    }
}

/// How light segments take part in the propagation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// Each carries the flux of its own path, and no photon counts itself: consistent.
    #[default]
    LeaveOneOut,
    /// The paper's recursion as written: what a light segment brings is gathered where it came from.
    Literal,
    /// No recursion: paths of segments are formed one by one and weighed as a whole (S16, S17), as a check.
    WholePath,
}

/// Which segments are sampled, how they are weighed, and how large the kernel is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Techniques {
    /// The estimator.
    pub estimator: Estimator,
    /// The kernel.
    pub kernel: kernel::Kernel,
    /// Most light paths for each camera path; zero: none.
    pub light_paths: f32,
    /// Whether arrivals of camera paths sample next-event segments.
    pub next_event: bool,
    /// Whether camera paths go on after their first arrival.
    pub camera_paths: bool,
    /// Bridge segments, if any, by how their light arrivals are chosen.
    pub bridges: Option<bridge::Choice>,
    /// Whether light paths learn where to begin.
    pub emission_guiding: bool,
    /// What the segments of an iteration may take at a time, about, bytes: larger pictures are made in bands.
    pub memory_budget: u64,
}

impl Techniques {
    /// Whether everything a camera path can see is found without light paths, if less well.
    pub fn can_do_without_light_paths(&self) -> bool {
        self.camera_paths && self.next_event && self.estimator == Estimator::LeaveOneOut
    }

    /// Whether they are not those of `segment` as it is meant, whose pictures may also be made without filtering.
    pub fn is_for_comparison(&self) -> bool {
        !self.kernel.adapts() || self.light_paths == 0.0 || self.bridges.is_some()
    }
}

impl Default for Techniques {
    fn default() -> Self {
        Self {
            estimator: Estimator::default(),
            kernel: kernel::Kernel::default(),
            light_paths: 1.0,
            next_event: true,
            camera_paths: true,
            bridges: None,
            emission_guiding: true,
            memory_budget: 768 << 20,
        }
    }
}
