//! Makes the energy tables of the microfacet lobes, and checks the ones in the source tree.
//!
//! Written apart from the lobes themselves, in double precision and from the papers, so that it also
//! tests them. To make the tables anew:
//! `cargo test --release --test lobes_tables -- --ignored`

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use segue::shading::lobes::energy::{FIXED_ONE, FIXED_ZERO, MAX_INDEX, MIN_RATIO, grid::*};
use std::f64::consts::TAU;

/// Points per incident direction.
const POINTS: usize = 1 << 14;

fn node(k: usize, n: usize) -> f64 {
    k as f64 / (n - 1) as f64
}

/// Inverse of `energy::elevation_coordinate`.
fn elevation(k: usize, n: usize) -> f64 {
    let v = node(k, n);
    let y = v * v / (v * v + (1.0 - v).powi(2));
    (1.0 - y * y) / (1.0 + y * y)
}

fn elevation_coordinate(x: f64) -> f64 {
    let y = ((1.0 - x) / (1.0 + x)).clamp(0.0, 1.0).sqrt();
    y.sqrt() / (y.sqrt() + (1.0 - y).sqrt())
}

/// Alpha at a node of roughness; the first stands for the limit of smoothness.
fn alpha(k: usize, n: usize) -> f64 {
    node(k, n).powi(2).max(1e-5)
}

/// The same by the inverse of `energy::glass_roughness_coordinate`.
fn glass_alpha(k: usize) -> f64 {
    let v = node(k, GLASS_ROUGHNESS);
    (v / (2.0 - v)).powi(2).max(1e-5)
}

/// Squared cosine at a node, by the inverse of `energy::azimuth_coordinate`.
fn azimuth_cos2(k: usize) -> f64 {
    let v = node(k, ANISO_AZIMUTH);
    v * v / (v * v + (1.0 - v).powi(2))
}

/// Inverse of `energy::index_coordinate`; the first node stands for the limit of index one.
fn index(k: usize) -> f64 {
    let top = f64::from(MAX_INDEX);
    let z = node(k, INDEX).powi(2) * (top - 1.0) / (top + 1.0);
    ((1.0 + z) / (1.0 - z)).max(1.0005)
}

/// Inverse of `energy::ratio_coordinate`.
fn ratio(k: usize) -> f64 {
    f64::from(MIN_RATIO).powf(node(k, ANISO_RATIO))
}

/// The GGX distribution.
#[derive(Clone, Copy)]
struct Surface {
    ax: f64,
    ay: f64,
}

impl Surface {
    /// By the cosine and the squared cosine of the azimuth in the stretched space.
    fn direction(self, x: f64, cos2: f64) -> DVec3 {
        let x = x.max(1e-4);
        let r = (1.0 - x * x).sqrt();
        DVec3::new(r * cos2.sqrt() / self.ax, r * (1.0 - cos2).max(0.0).sqrt() / self.ay, x).normalize()
    }

    fn stretch(self, w: DVec3) -> DVec3 {
        DVec3::new(self.ax * w.x, self.ay * w.y, w.z)
    }

    fn cosine(self, w: DVec3) -> f64 {
        w.z.abs() / self.stretch(w).length()
    }

    /// The tables' coordinate of a direction.
    fn elevation(self, w: DVec3) -> f64 {
        elevation_coordinate(self.cosine(w))
    }

    /// The tables' coordinate of an azimuth.
    fn azimuth(self, w: DVec3) -> f64 {
        let v = self.stretch(w);
        v.x.abs() / (v.x.abs() + v.y.abs()).max(1e-150)
    }

    fn lambda(self, w: DVec3) -> f64 {
        0.5 * (1.0 / self.cosine(w) - 1.0)
    }

    /// Heitz 2018: a normal visible from `o`.
    fn visible(self, o: DVec3, u: DVec2) -> DVec3 {
        let v = self.stretch(o).normalize();
        let t1 = if v.z < 0.999_999_9 { DVec3::Z.cross(v).normalize() } else { DVec3::X };
        let t2 = v.cross(t1);
        let (r, phi) = (u.x.sqrt(), TAU * u.y);
        let p1 = r * phi.cos();
        let s = 0.5 * (1.0 + v.z);
        let p2 = (1.0 - s) * (1.0 - p1 * p1).max(0.0).sqrt() + s * r * phi.sin();
        let n = t1 * p1 + t2 * p2 + v * (1.0 - p1 * p1 - p2 * p2).max(0.0).sqrt();
        DVec3::new(self.ax * n.x, self.ay * n.y, n.z.max(1e-12)).normalize()
    }

    /// Weight of a visible normal once shadowing is added: `G2 / G1`.
    fn weight(self, o: DVec3, i: DVec3) -> f64 {
        let l = self.lambda(o);
        (1.0 + l) / (1.0 + l + self.lambda(i))
    }

    /// Normals visible from `o`, and their weights, which add up to one.
    fn normals(self, o: DVec3) -> impl Iterator<Item = (DVec3, f64)> {
        (0..POINTS).map(move |k| {
            // A golden spiral: no two points share a radius, and most are near the rim. What a nearly smooth surface
            // loses comes from a rim as thin as alpha squared.
            let rest = 1.0 - (k as f64 + 0.5) / POINTS as f64;
            let turns = (k as f64 * 0.5 * (5f64.sqrt() - 1.0)).fract();
            (self.visible(o, DVec2::new(1.0 - rest * rest, turns)), 2.0 * rest / POINTS as f64)
        })
    }
}

fn fresnel(c: f64, eta: f64) -> f64 {
    let t2 = 1.0 - (1.0 - c * c) / (eta * eta);
    if t2 <= 0.0 {
        return 1.0;
    }
    let t = t2.sqrt();
    let (s, p) = ((c - eta * t) / (c + eta * t), (eta * c - t) / (eta * c + t));
    0.5 * (s * s + p * p)
}

/// Adds `w` to the nodes around `v` of [0,1], as linear interpolation between them reads it.
fn spread(row: &mut [f64], v: f64, w: f64) {
    let p = v.clamp(0.0, 1.0) * (row.len() - 1) as f64;
    let i = (p as usize).min(row.len() - 2);
    let f = p - i as f64;
    row[i] += w * (1.0 - f);
    row[i + 1] += w * f;
}

fn read(row: &[f64], v: f64) -> f64 {
    let p = v.clamp(0.0, 1.0) * (row.len() - 1) as f64;
    let i = (p as usize).min(row.len() - 2);
    row[i] + (row[i + 1] - row[i]) * (p - i as f64)
}

/// The `s` with `s_j sum_k m_jk s_k = 1` (Sinkhorn and Knopp 1967, for a symmetric kernel).
fn balance(m: &[Vec<f64>]) -> Vec<f64> {
    let mut s = vec![1.0; m.len()];
    for _ in 0..10_000 {
        let row = |r: &Vec<f64>| r.iter().zip(&s).map(|(a, b)| a * b).sum::<f64>();
        let sums: Vec<f64> = m.iter().map(row).collect();
        let off = s.iter().zip(&sums).map(|(s, sum)| (s * sum - 1.0).abs()).fold(0.0, f64::max);
        if off < 1e-9 {
            return s;
        }
        s.iter_mut().zip(sums).for_each(|(s, sum)| *s = (*s / sum).sqrt());
    }
    panic!("no balance found");
}

/// Cosine-weighted mean over the hemisphere of a function of the stretched elevation.
fn mean(g: Surface, f: impl Fn(f64) -> f64) -> f64 {
    let points = 4000;
    let term = |k: usize| {
        // most points near grazing incidence, where smooth surfaces lose their light
        let t = (k as f64 + 0.5) / points as f64;
        let mu = t * t * t;
        6.0 * t * t * mu * f(g.elevation(DVec3::new((1.0 - mu * mu).sqrt(), 0.0, mu)))
    };
    (0..points).map(term).sum::<f64>() / points as f64
}

/// Scale and single-scattering albedo of white isotropic reflection by elevation, and the albedo's mean.
fn isotropic(a: f64) -> (Vec<f64>, Vec<f64>, f64) {
    let g = Surface { ax: a, ay: a };
    let mut m = vec![vec![0.0; ELEVATION]; ELEVATION];
    for (j, row) in m.iter_mut().enumerate() {
        let o = g.direction(elevation(j, ELEVATION), 1.0);
        for (h, share) in g.normals(o) {
            let i = 2.0 * o.dot(h) * h - o;
            if i.z > 0.0 {
                spread(row, g.elevation(i), g.weight(o, i) * share);
            }
        }
    }
    let e: Vec<f64> = m.iter().map(|row| row.iter().sum()).collect();
    let mean = mean(g, |x| read(&e, x));
    (balance(&m), e, mean)
}

/// Scale of white anisotropic reflection by azimuth and elevation.
fn anisotropic(a: f64, ratio: f64) -> Vec<f64> {
    let g = Surface { ax: a / ratio.sqrt(), ay: a * ratio.sqrt() };
    let size = ANISO_AZIMUTH * ANISO_ELEVATION;
    let mut m = vec![vec![0.0; size]; size];
    for (j, row) in m.iter_mut().enumerate() {
        let x = elevation(j % ANISO_ELEVATION, ANISO_ELEVATION);
        let o = g.direction(x, azimuth_cos2(j / ANISO_ELEVATION));
        for (h, share) in g.normals(o) {
            let i = 2.0 * o.dot(h) * h - o;
            if i.z <= 0.0 {
                continue;
            }
            let mut azimuth = [0.0; ANISO_AZIMUTH];
            spread(&mut azimuth, g.azimuth(i), g.weight(o, i) * share);
            for (c, w) in azimuth.into_iter().enumerate() {
                if w > 0.0 {
                    spread(&mut row[c * ANISO_ELEVATION..][..ANISO_ELEVATION], g.elevation(i), w);
                }
            }
        }
    }
    balance(&m)
}

/// Fourth root of what single scattering loses at a refracting interface, by elevation, and of its mean.
/// `eta`: index beyond over index before.
fn glass(a: f64, eta: f64) -> (Vec<f64>, f64) {
    let g = Surface { ax: a, ay: a };
    let loss = |o: DVec3| {
        let mut sum = 0.0;
        for (h, share) in g.normals(o) {
            let c = o.dot(h);
            let f = fresnel(c, eta);
            let i = 2.0 * c * h - o;
            if i.z > 0.0 {
                sum += share * f * g.weight(o, i);
            }
            if f < 1.0 {
                let t = (1.0 - (1.0 - c * c) / (eta * eta)).sqrt();
                let i = (h * (c / eta - t) - o / eta).normalize();
                if i.z < 0.0 {
                    sum += share * (1.0 - f) * g.weight(o, i);
                }
            }
        }
        (1.0 - sum).max(0.0)
    };
    let at = |k| loss(g.direction(elevation(k, GLASS_ELEVATION), 1.0)).powf(0.25);
    let row: Vec<f64> = (0..GLASS_ELEVATION).map(at).collect();
    let mean = mean(g, |x| read(&row, x).powi(4));
    (row, mean.powf(0.25))
}

/// Averages of the stretched dielectric reflectance over the lobe, by cosine: of what is scattered once,
/// and of what the scale adds.
fn layer(a: f64, eta: f64, scale: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let g = Surface { ax: a, ay: a };
    let f0 = fresnel(1.0, eta);
    let averages = (0..COSINE).map(|k| {
        let mu = node(k, COSINE).powi(2).max(1e-5);
        let o = DVec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
        let so = read(scale, g.elevation(o));
        let (mut once, mut more, mut f_once, mut f_more) = (0.0, 0.0, 0.0, 0.0);
        for (h, share) in g.normals(o) {
            let c = o.dot(h);
            let i = 2.0 * c * h - o;
            if i.z > 0.0 {
                let w = share * g.weight(o, i);
                let f = (fresnel(c, eta) - f0) / (1.0 - f0);
                // never zero, so that the average has its limit where there is nothing to add
                let added = w * ((so * read(scale, g.elevation(i)) - 1.0).max(0.0) + 1e-9);
                once += w;
                more += added;
                f_once += w * f;
                f_more += added * f;
            }
        }
        (f_once / once, f_more / more)
    });
    averages.unzip()
}

fn fixed(v: f64) -> u16 {
    let n = (v * f64::from(FIXED_ONE) + f64::from(FIXED_ZERO)).round();
    assert!((0.0..=65535.0).contains(&n), "{v} does not fit");
    n as u16
}

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/src/shading/lobes/energy.bin");

#[test]
#[ignore = "writes the tables into the source tree; takes minutes"]
fn make() {
    let mut out = vec![0.0; TOTAL];
    let mut put = |at: usize, values: &[f64]| out[at..][..values.len()].copy_from_slice(values);
    let log = |s: &[f64]| s.iter().map(|v| v.ln()).collect::<Vec<_>>();
    let iso: Vec<_> = (0..ROUGHNESS).into_par_iter().map(|r| isotropic(alpha(r, ROUGHNESS))).collect();
    for (r, (s, e, mean)) in iso.iter().enumerate() {
        put(SCALE_AT + r * ELEVATION, &log(s));
        put(ALBEDO_AT + r * ELEVATION, e);
        put(MEAN_AT + r, &[*mean]);
    }
    let size = ANISO_AZIMUTH * ANISO_ELEVATION;
    let aniso: Vec<_> = (0..ANISO / size)
        .into_par_iter()
        .map(|k| anisotropic(alpha(k % ANISO_ROUGHNESS, ANISO_ROUGHNESS), ratio(k / ANISO_ROUGHNESS)))
        .collect();
    aniso.iter().enumerate().for_each(|(k, s)| put(ANISO_AT + k * size, &log(s)));
    let scales: Vec<_> = (0..GLASS_ROUGHNESS).into_par_iter().map(|r| isotropic(glass_alpha(r)).0).collect();
    let both: Vec<_> = (0..INDEX * GLASS_ROUGHNESS)
        .into_par_iter()
        .map(|k| {
            let (a, eta) = (glass_alpha(k % GLASS_ROUGHNESS), index(k / GLASS_ROUGHNESS));
            ([glass(a, eta), glass(a, 1.0 / eta)], layer(a, eta, &scales[k % GLASS_ROUGHNESS]))
        })
        .collect();
    for (k, (sides, (once, more))) in both.iter().enumerate() {
        for (side, (row, mean)) in sides.iter().enumerate() {
            put(GLASS_AT + (2 * k + side) * GLASS_ELEVATION, row);
            put(GLASS_MEAN_AT + 2 * k + side, &[*mean]);
        }
        put(ONCE_AT + k * COSINE, once);
        put(MORE_AT + k * COSINE, more);
    }
    let bytes: Vec<u8> = out.iter().flat_map(|&v| fixed(v).to_le_bytes()).collect();
    std::fs::write(FILE, bytes).unwrap();
}

/// Some rows of the tables, computed anew.
#[test]
fn tables_are_what_they_claim() {
    let bytes = std::fs::read(FILE).unwrap();
    let table: Vec<u16> = bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
    assert_eq!(table.len(), TOTAL);
    let check = |what: &str, at: usize, values: &[f64]| {
        for (k, &v) in values.iter().enumerate() {
            // half a step from rounding, half from the order of sums
            assert!(fixed(v).abs_diff(table[at + k]) <= 1, "{what}, node {k}: {v} against {}", table[at + k]);
        }
    };
    let log = |s: &[f64]| s.iter().map(|v| v.ln()).collect::<Vec<_>>();
    for r in [1, ROUGHNESS / 2, ROUGHNESS - 1] {
        let (s, e, mean) = isotropic(alpha(r, ROUGHNESS));
        check("scale", SCALE_AT + r * ELEVATION, &log(&s));
        check("albedo", ALBEDO_AT + r * ELEVATION, &e);
        check("mean", MEAN_AT + r, &[mean]);
    }
    let (q, r) = (ANISO_RATIO / 2, ANISO_ROUGHNESS / 2);
    let at = ANISO_AT + (q * ANISO_ROUGHNESS + r) * ANISO_AZIMUTH * ANISO_ELEVATION;
    check("anisotropic", at, &log(&anisotropic(alpha(r, ANISO_ROUGHNESS), ratio(q))));
    for (i, r) in [(INDEX / 2, GLASS_ROUGHNESS / 2), (INDEX - 1, GLASS_ROUGHNESS - 1)] {
        let (a, eta, k) = (glass_alpha(r), index(i), i * GLASS_ROUGHNESS + r);
        for (side, eta) in [eta, 1.0 / eta].into_iter().enumerate() {
            let (row, mean) = glass(a, eta);
            check("glass", GLASS_AT + (2 * k + side) * GLASS_ELEVATION, &row);
            check("glass mean", GLASS_MEAN_AT + 2 * k + side, &[mean]);
        }
        let (once, more) = layer(a, eta, &isotropic(a).0);
        check("layer once", ONCE_AT + k * COSINE, &once);
        check("layer more", MORE_AT + k * COSINE, &more);
    }
}
