//! Chi-square test of drawn directions against the density they claim to have.
//!
//! The sphere is cut into cells that a pilot run filled equally (a k-d tree over two coordinates), so that
//! narrow peaks and wide tails are tested alike. The expected count of a cell is the density's integral
//! over it. That the density integrates to the share of draws which return something is told apart.

use glam::{DVec2, DVec3};
use segue::math::Frame;
use segue::math::sampler::{hash, hash_unit};
use std::f64::consts::{PI, TAU};

use glam::Vec3;

/// Something that draws directions.
pub trait Draws {
    /// A draw, or nothing. Dirac deltas are not to be returned.
    fn draw(&self, u: Vec3) -> Option<Vec3>;
    /// Density of the drawn direction per solid angle.
    fn density(&self, w: Vec3) -> f64;
    /// Coordinates in which the peaks lie along the axes.
    fn chart(&self) -> Chart {
        Chart::Direction
    }
}

/// Two coordinates of a direction; any choice is right, a good one makes the integration easy.
#[derive(Clone, Copy, Debug)]
pub enum Chart {
    /// Azimuth and polar angle of the direction itself.
    Direction,
    /// Longitude and latitude around the y axis of the half vector with the given direction: for what
    /// is reflected only.
    Half(Vec3),
    /// Azimuth and angle around an axis, one for the directions above and one for those below the surface.
    Peaks(Frame, Frame),
}

impl Chart {
    fn low(self) -> DVec2 {
        match self {
            Self::Direction | Self::Peaks(..) => DVec2::ZERO,
            Self::Half(_) => DVec2::splat(-0.5 * PI),
        }
    }

    fn high(self) -> DVec2 {
        match self {
            Self::Direction => DVec2::new(TAU, PI),
            Self::Half(_) => DVec2::splat(0.5 * PI),
            Self::Peaks(..) => DVec2::splat(TAU),
        }
    }

    fn coordinates(self, w: Vec3) -> DVec2 {
        match self {
            Self::Direction => polar(w.as_dvec3()),
            Self::Half(o) => {
                let h = (o + w).as_dvec3().normalize() * f64::from(1f32.copysign(o.z));
                DVec2::new(h.x.atan2(h.z), h.y.asin())
            }
            Self::Peaks(above, _) if w.z >= 0.0 => polar(local(&above, w)),
            Self::Peaks(_, below) => polar(local(&below, w)) + DVec2::new(0.0, PI),
        }
    }

    /// The direction, and the solid angle per area of the chart; `None` where there is none.
    fn direction(self, c: DVec2) -> Option<(Vec3, f64)> {
        match self {
            Self::Direction => Some((spherical(c).as_vec3(), c.y.sin())),
            Self::Half(o) => {
                let ((sx, cx), (sy, cy)) = (c.x.sin_cos(), c.y.sin_cos());
                let h = DVec3::new(sx * cy, sy, cx * cy) * f64::from(1f32.copysign(o.z));
                let o = o.as_dvec3();
                let cos = o.dot(h);
                (cos > 0.0).then(|| ((2.0 * cos * h - o).as_vec3(), 4.0 * cos * cy))
            }
            Self::Peaks(above, below) => {
                let up = c.y < PI;
                let (frame, y) = if up { (above, c.y) } else { (below, c.y - PI) };
                let v = spherical(DVec2::new(c.x, y));
                let axes = [frame.s, frame.t, frame.n].map(Vec3::as_dvec3);
                let w = (axes[0] * v.x + axes[1] * v.y + axes[2] * v.z).as_vec3();
                ((w.z >= 0.0) == up).then(|| (w, y.sin()))
            }
        }
    }
}

fn local(frame: &Frame, w: Vec3) -> DVec3 {
    let w = w.as_dvec3();
    DVec3::new(w.dot(frame.s.as_dvec3()), w.dot(frame.t.as_dvec3()), w.dot(frame.n.as_dvec3()))
}

fn polar(w: DVec3) -> DVec2 {
    let phi = w.y.atan2(w.x);
    DVec2::new(if phi < 0.0 { phi + TAU } else { phi }, w.truncate().length().atan2(w.z))
}

fn spherical(c: DVec2) -> DVec3 {
    let ((sp, cp), (st, ct)) = (c.x.sin_cos(), c.y.sin_cos());
    DVec3::new(st * cp, st * sp, ct)
}

/// What came out of a test.
pub struct Outcome {
    /// Probability of a statistic at least as large if the density is right.
    pub p: f64,
    /// Integral of the density over the sphere.
    pub mass: f64,
    /// Share of draws that gave a direction.
    pub accepted: f64,
    /// Standard deviation of the difference of these two.
    pub sigma: f64,
    /// Where expectation and count differ most, for the message of a failure.
    pub worst: String,
}

/// A rectangle of a chart.
#[derive(Clone, Copy, Debug)]
struct Cell {
    low: DVec2,
    high: DVec2,
}

/// Depth of the tree of cells.
const LEVELS: usize = 8;
const CELLS: usize = 1 << LEVELS;
const PILOT: u32 = 1 << 16;
/// The integration goes on splitting a cell until this few pilot draws are left in a part.
const PER_LEAF: usize = 16;
/// Standard deviation of a part's integral above which it is split, as a share of all draws.
const FINE: f64 = 1e-5;

pub fn uniform(i: u32, seed: u32) -> Vec3 {
    let word = hash(hash(seed, 77), i);
    Vec3::new(hash_unit(word, 1), hash_unit(word, 2), hash_unit(word, 3))
}

/// Cells of about equal pilot counts: the tree is a perfect binary one, so a cell is an index.
struct Tree {
    /// Splits in breadth-first order: axis and place.
    splits: Vec<(usize, f64)>,
    /// The cells, and the pilot draws in each.
    cells: Vec<(Cell, Vec<DVec2>)>,
}

/// Splits at the median along `axis` (in the middle if there are too few points).
fn split(cell: Cell, mut points: Vec<DVec2>, axis: usize) -> (f64, [(Cell, Vec<DVec2>); 2]) {
    points.sort_by(|a, b| a[axis].total_cmp(&b[axis]));
    let middle = points.len() / 2;
    let at = match middle {
        0 => 0.5 * (cell.low[axis] + cell.high[axis]),
        _ => 0.5 * (points[middle - 1][axis] + points[middle][axis]),
    };
    (at, split_at(cell, points, axis, at))
}

fn split_at(cell: Cell, points: Vec<DVec2>, axis: usize, at: f64) -> [(Cell, Vec<DVec2>); 2] {
    let (mut a, mut b) = (cell, cell);
    a.high[axis] = at;
    b.low[axis] = at;
    let (low, high) = points.into_iter().partition(|p| p[axis] < at);
    [(a, low), (b, high)]
}

impl Tree {
    fn new(chart: Chart, points: Vec<DVec2>) -> Self {
        let root = Cell { low: chart.low(), high: chart.high() };
        // densities jump at the horizon, so no cell may reach across it
        let horizon = 0.5 * (root.low.y + root.high.y);
        let mut splits = vec![(1, horizon)];
        let mut cells: Vec<_> = split_at(root, points, 1, horizon).into();
        for depth in 1..LEVELS {
            let axis = depth % 2;
            let halves = cells.into_iter().map(|(cell, points)| split(cell, points, axis));
            cells = halves
                .flat_map(|(at, halves)| {
                    splits.push((axis, at));
                    halves
                })
                .collect();
        }
        Self { splits, cells }
    }

    fn find(&self, p: DVec2) -> usize {
        let mut node = 0;
        for _ in 0..LEVELS {
            let (axis, at) = self.splits[node];
            node = 2 * node + 1 + usize::from(p[axis] >= at);
        }
        node - self.splits.len()
    }
}

/// An integral estimated by stratified random points, with the variance of the estimate: unlike a
/// quadrature rule it cannot miss a peak or an edge without its variance showing it.
#[derive(Clone, Copy, Default)]
struct Estimate {
    mean: f64,
    variance: f64,
}

impl std::ops::AddAssign for Estimate {
    fn add_assign(&mut self, other: Self) {
        self.mean += other.mean;
        self.variance += other.variance;
    }
}

struct Integrator<'a, L> {
    lobe: &'a L,
    /// Counts the random points used.
    next: u32,
}

impl<L: Draws> Integrator<'_, L> {
    /// Over a cell that is first split until few pilot draws are left in a part.
    fn around(&mut self, cell: Cell, points: Vec<DVec2>, axis: usize) -> Estimate {
        let mut sum = Estimate::default();
        if points.len() > PER_LEAF {
            for (cell, points) in split(cell, points, axis).1 {
                sum += self.around(cell, points, 1 - axis);
            }
            return sum;
        }
        let [xs, ys] =
            [0, 1].map(|axis| steps(cell.low[axis], cell.high[axis], points.iter().map(|p| p[axis])));
        for x in xs.windows(2) {
            for y in ys.windows(2) {
                sum += self.plain(Cell { low: DVec2::new(x[0], y[0]), high: DVec2::new(x[1], y[1]) }, 6);
            }
        }
        sum
    }

    /// Over one part. A first look decides whether its quarters are taken apart, and is then forgotten:
    /// an estimate that took part in the decision would be biased.
    fn plain(&mut self, part: Cell, depth: u32) -> Estimate {
        if depth > 0 && self.look(part, 4).variance > FINE * FINE {
            let half = 0.5 * (part.high - part.low);
            let mut sum = Estimate::default();
            for q in [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE] {
                let low = part.low + half * q;
                sum += self.plain(Cell { low, high: low + half }, depth - 1);
            }
            return sum;
        }
        self.look(part, 3)
    }

    /// The integral over a part from one point in each of `side` by `side` equal pieces. The differences
    /// between the pieces are left in the variance, which makes it an upper bound.
    fn look(&mut self, part: Cell, side: u32) -> Estimate {
        let size = (part.high - part.low) / f64::from(side);
        let n = f64::from(side * side);
        let (mut sum, mut squares) = (0.0, 0.0);
        for k in 0..side * side {
            self.next += 1;
            let corner = DVec2::new(f64::from(k % side), f64::from(k / side));
            let c = part.low + size * (corner + uniform(self.next, 0x1e6).truncate().as_dvec2());
            let f = match self.lobe.chart().direction(c) {
                Some((w, stretch)) => self.lobe.density(w) * stretch * size.x * size.y,
                None => 0.0,
            };
            sum += f;
            squares += f * f;
        }
        Estimate { mean: sum, variance: (n * squares - sum * sum).max(0.0) / (n - 1.0) }
    }
}

/// Places where to cut [low, high] so that the parts grow with the distance from the given points: the
/// density may fall off anywhere beyond them.
fn steps(low: f64, high: f64, points: impl Iterator<Item = f64> + Clone) -> Vec<f64> {
    let first = points.clone().fold(high, f64::min);
    let last = points.fold(low, f64::max);
    let mut steps = vec![low, high];
    if first > last {
        steps.extend((1..8).map(|k| low + (high - low) / 8.0 * f64::from(k)));
    } else {
        let size = if first < last { last - first } else { (high - low) / 16.0 };
        steps.extend((0..24).map(|k| first - 0.3 * size * 2f64.powi(k)).filter(|&x| x > low));
        steps.extend((0..24).map(|k| last + 0.3 * size * 2f64.powi(k)).filter(|&x| x < high));
    }
    steps.sort_by(f64::total_cmp);
    steps
}

/// Tests `draws` draws of `lobe` against its density.
pub fn test(lobe: &impl Draws, seed: u32, draws: u32) -> Outcome {
    let chart = lobe.chart();
    let pilot = (0..PILOT)
        .filter_map(|i| lobe.draw(uniform(i, seed ^ 0x5a5a)))
        .map(|w| chart.coordinates(w))
        .collect();

    let tree = Tree::new(chart, pilot);
    let mut counts = vec![0u32; CELLS + 1];
    for i in 0..draws {
        counts[lobe.draw(uniform(i, seed)).map_or(CELLS, |w| tree.find(chart.coordinates(w)))] += 1;
    }
    let names: Vec<_> = tree.cells.iter().map(|(c, _)| format!("{:?}", c.low)).collect();
    let mut integrator = Integrator { lobe, next: 0 };
    let masses: Vec<Estimate> =
        tree.cells.into_iter().map(|(c, points)| integrator.around(c, points, LEVELS % 2)).collect();
    let mut mass = Estimate::default();
    masses.iter().for_each(|&m| mass += m);

    let n = f64::from(draws);
    let (mut statistic, mut freedom) = (0.0, 0.0);
    let mut pooled = (Estimate::default(), 0.0);
    let mut worst = (0.0, String::new());
    let mut add = |mass: Estimate, count: f64, name: &str| {
        // the counts scatter by their expectation, and the expectation by its own variance
        let expected = n * mass.mean;
        let term = (count - expected).powi(2) / (expected + n * n * mass.variance);
        statistic += term;
        freedom += 1.0;
        if term > worst.0 {
            worst = (term, format!("{name}: expected {expected:.1}, counted {count}"));
        }
    };
    for (k, (&m, &c)) in masses.iter().zip(&counts).enumerate() {
        if n * m.mean < 8.0 {
            pooled.0 += m;
            pooled.1 += f64::from(c);
        } else {
            add(m, f64::from(c), &names[k]);
        }
    }
    if n * pooled.0.mean >= 4.0 {
        add(pooled.0, pooled.1, "pooled");
    } else if pooled.1 > n * pooled.0.mean + 30.0 {
        // too few were expected for the statistic's approximation, yet far too many must not pass
        add(Estimate { mean: 1.0 / n, variance: 0.0 }, pooled.1, "pooled");
    }
    let accepted = 1.0 - f64::from(counts[CELLS]) / n;
    let sigma = (accepted * (1.0 - accepted) / n + mass.variance).sqrt();
    let p = survival(statistic, freedom);
    Outcome { p, mass: mass.mean, accepted, sigma, worst: worst.1 }
}

/// Probability that a chi-square variable of `k` degrees of freedom exceeds `x` (Wilson and Hilferty 1931).
fn survival(x: f64, k: f64) -> f64 {
    if k < 1.0 {
        return 1.0;
    }
    let v = 2.0 / (9.0 * k);
    normal_tail(((x / k).cbrt() - (1.0 - v)) / v.sqrt())
}

/// Upper tail of the standard normal distribution (Abramowitz and Stegun 26.2.17 below 3, the continued
/// fraction 26.2.14 above).
pub fn normal_tail(z: f64) -> f64 {
    if z < 0.0 {
        return 1.0 - normal_tail(-z);
    }
    let density = (-0.5 * z * z).exp() / TAU.sqrt();
    if z > 3.0 {
        return density / (z + 1.0 / (z + 2.0 / (z + 3.0 / (z + 4.0 / (z + 5.0)))));
    }
    let t = 1.0 / (1.0 + 0.231_641_9 * z);
    density
        * t
        * (0.319_381_530
            + t * (-0.356_563_782 + t * (1.781_477_937 + t * (-1.821_255_978 + t * 1.330_274_429))))
}

/// Smallest acceptable p of a single run so that all `runs` together fail by chance once in a thousand
/// (Šidák 1967).
pub fn sidak(runs: usize) -> f64 {
    1.0 - (1.0f64 - 1e-3).powf(1.0 / runs as f64)
}
