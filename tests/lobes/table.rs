//! The lobes under test: one row per lobe, at its ordinary and its extreme parameters.

use glam::Vec3;
use segue::shading::lobes::*;

/// A lobe at some parameters.
pub struct Row {
    pub name: String,
    pub lobe: Lobe,
    /// Scatters all it gets: the white furnace must give one.
    pub lossless: bool,
    pub reciprocal: bool,
    /// Smallest GGX alpha; 1 if there is none.
    pub width: f32,
}

/// All kinds of lobes. A new variant of [`Lobe`] does not compile without its row here.
pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    let mut kind = Lobe::Lambert(Lambert);
    loop {
        let next = match kind {
            Lobe::Lambert(_) => {
                rows.push(row("lambert", kind, true, true, 1.0));
                Some(Lobe::Reflection(Reflection::new(
                    Ggx::from_roughness(0.5),
                    Fresnel::constant(Vec3::ONE),
                )))
            }
            Lobe::Reflection(_) => {
                rows.extend(reflections());
                Some(Lobe::Dielectric(Dielectric::new(Ggx::from_roughness(0.5), 1.5)))
            }
            Lobe::Dielectric(_) => {
                rows.extend(dielectrics());
                Some(Lobe::Transparent(Transparent))
            }
            Lobe::Transparent(_) => {
                rows.push(row("transparent", kind, true, true, 1.0));
                Some(Lobe::Translucent(Translucent))
            }
            Lobe::Translucent(_) => {
                rows.push(row("translucent", kind, true, true, 1.0));
                Some(Lobe::OrenNayar(OrenNayar::new(Vec3::ONE, 0.5)))
            }
            Lobe::OrenNayar(_) => {
                rows.extend(oren_nayars());
                Some(Lobe::Sheen(Sheen::new(0.5)))
            }
            Lobe::Sheen(_) => {
                rows.extend(sheens());
                rows.extend(scattering_once());
                None
            }
        };
        match next {
            Some(lobe) => kind = lobe,
            None => return rows,
        }
    }
}

fn row(name: &str, lobe: Lobe, lossless: bool, reciprocal: bool, width: f32) -> Row {
    Row { name: name.into(), lobe, lossless, reciprocal, width }
}

fn reflections() -> Vec<Row> {
    let white = Fresnel::constant(Vec3::ONE);
    let alphas = [
        (1e-8, 1e-8),
        (2e-4, 2e-4),
        (1e-3, 1e-3),
        (0.04, 0.04),
        (0.25, 0.25),
        (0.5, 0.5),
        (1.0, 1.0),
        (0.5, 0.05),
        (0.004, 0.3),
        (1.0, 0.1),
        (3.16, 0.316),
    ];
    let mut rows: Vec<Row> = alphas
        .iter()
        .map(|&(x, y)| {
            let lobe = Lobe::Reflection(Reflection::new(Ggx::new(x, y), white));
            row(&format!("reflection {x} {y}"), lobe, true, true, x.min(y))
        })
        .collect();
    let f0 = Vec3::new(0.9, 0.5, 0.1);
    for (name, fresnel) in [
        ("schlick", Fresnel::Schlick { f0, f90: Vec3::ONE }),
        ("f82", Fresnel::f82_tint(f0, Vec3::new(0.3, 0.9, 0.7))),
        ("dielectric", Fresnel::Dielectric { eta: 1.5, f0: Vec3::splat(0.04) }),
    ] {
        let lobe = Lobe::Reflection(Reflection::new(Ggx::from_roughness(0.6), fresnel));
        rows.push(row(&format!("reflection {name}"), lobe, false, true, 0.36));
    }
    rows
}

fn dielectrics() -> Vec<Row> {
    let mut rows = Vec::new();
    let points: [(f32, &[f32]); 8] = [
        (1.0, &[0.5]),
        (1.0001, &[1e-4, 0.1, 1.0]),
        (1.1, &[1e-4, 0.3, 1.0]),
        (1.33, &[0.1, 0.6]),
        (1.5, &[1e-4, 0.02, 0.1, 0.3, 1.0]),
        (2.4, &[0.02, 0.6]),
        (3.0, &[1e-4, 0.02, 0.3, 1.0]),
        (1.0 / 1.5, &[1e-4, 0.1, 0.45, 1.0]),
    ];
    for (eta, roughnesses) in points {
        for &roughness in roughnesses {
            let lobe = Lobe::Dielectric(Dielectric::new(Ggx::from_roughness(roughness), eta));
            let name = format!("dielectric {eta} {roughness}");
            // what is given back goes by the direction looked from
            rows.push(row(&name, lobe, true, lobe.is_delta(), roughness * roughness));
        }
    }
    let tint = Vec3::new(0.9, 0.5, 0.2);
    let tinted = Dielectric::tinted(Ggx::new(0.2, 0.2), 1.5, tint * 0.04, Vec3::ONE, tint);
    rows.push(row("dielectric tinted", Lobe::Dielectric(tinted), false, false, 0.2));
    for roughness in [1e-4f32, 0.3, 0.8] {
        let lobe = Lobe::Dielectric(Dielectric::refraction_only(Ggx::from_roughness(roughness), 1.45));
        rows.push(row(&format!("refraction {roughness}"), lobe, false, true, roughness * roughness));
    }
    rows
}

fn scattering_once() -> Vec<Row> {
    let rough = Ggx::from_roughness(0.8);
    let reflection = Reflection::new(rough, Fresnel::constant(Vec3::ONE)).with_multiscatter(false);
    let mut rows = vec![row("reflection once", Lobe::Reflection(reflection), false, true, 0.64)];
    for (eta, roughness) in [(1.1, 0.3), (1.5, 0.1), (1.5, 0.8), (2.4, 0.6), (1.0 / 1.5, 0.5)] {
        let ggx = Ggx::from_roughness(roughness);
        let lobe = Lobe::Dielectric(Dielectric::new(ggx, eta).with_multiscatter(false));
        rows.push(row(
            &format!("dielectric once {eta} {roughness}"),
            lobe,
            false,
            true,
            roughness * roughness,
        ));
    }
    rows
}

fn oren_nayars() -> Vec<Row> {
    let mut rows: Vec<Row> = [1e-4, 0.05, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0]
        .into_iter()
        .map(|roughness| {
            let lobe = Lobe::OrenNayar(OrenNayar::new(Vec3::ONE, roughness));
            row(&format!("oren-nayar {roughness}"), lobe, true, true, 1.0)
        })
        .collect();
    let coloured = OrenNayar::new(Vec3::new(0.9, 0.5, 0.1), 0.8);
    rows.push(row("oren-nayar coloured", Lobe::OrenNayar(coloured), false, true, 1.0));
    rows
}

/// The fitted cosine distribution is normalised for the direction looked from, so it is not reciprocal.
fn sheens() -> Vec<Row> {
    [1e-4, 0.07, 0.15, 0.3, 0.5, 0.7, 0.9, 1.0]
        .into_iter()
        .map(|roughness| {
            let lobe = Lobe::Sheen(Sheen::new(roughness));
            row(&format!("sheen {roughness}"), lobe, false, false, 1.0)
        })
        .collect()
}

/// Directions to stand on: both sides, normal incidence to 89.9 degrees.
pub fn directions() -> Vec<Vec3> {
    let mut all = Vec::new();
    for (degrees, azimuth) in [(0.0f32, 0.0f32), (30.0, 0.4), (60.0, 2.0), (85.0, 4.0), (89.9, 5.5)] {
        let (s, c) = degrees.to_radians().sin_cos();
        let w = Vec3::new(s * azimuth.cos(), s * azimuth.sin(), c);
        all.push(w);
        all.push(Vec3::new(w.x, w.y, -w.z));
    }
    all
}
