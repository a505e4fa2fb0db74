use super::*;
use crate::math::sampler::hash_unit;
use crate::shading::bsdf::{Bsdf, Walk};
use crate::shading::lobes::testing::{direction, hemisphere_integral, mean};
use std::f32::consts::FRAC_1_PI;

const FRAME: Frame = Frame { s: Vec3::X, t: Vec3::Y, n: Vec3::Z };

/// Blender's default, white.
fn white() -> Principled {
    Principled {
        base_color: Vec3::ONE,
        diffuse_roughness: 0.0,
        metallic: 0.0,
        roughness: 0.5,
        ior: 1.5,
        specular_level: 0.5,
        specular_tint: Vec3::ONE,
        specular_color: None,
        anisotropy: 0.0,
        rotation: 0.0,
        transmission: 0.0,
        cover: Cover {
            coat: 0.0,
            coat_roughness: 0.03,
            coat_ior: 1.5,
            coat_tint: Vec3::ONE,
            sheen: 0.0,
            sheen_roughness: 0.5,
            sheen_tint: Vec3::ONE,
        },
        metal_f90: MetalF90::White,
        multiscatter: true,
    }
}

fn build(p: &Principled, wo: Vec3) -> Bsdf {
    let mut builder = BsdfBuilder::new(Vec3::Z, wo);
    p.push(&mut builder, Vec3::ONE, FRAME, FRAME);
    assert_eq!(builder.dropped(), 0);
    builder.build()
}

/// Share of a uniform light that comes back, and its standard error.
fn reflected(p: &Principled, wo: Vec3) -> (Vec3, Vec3) {
    let bsdf = build(p, wo);
    mean(4000, |i| {
        let u = Vec3::new(hash_unit(i, 10), hash_unit(i, 11), hash_unit(i, 12));
        bsdf.sample(wo, Walk::Camera, u).map_or(Vec3::ZERO, |s| s.weight())
    })
}

/// What layering by tabulated or estimated albedos may be off by.
const ALBEDO_ERROR: f32 = 0.003;

#[test]
fn never_reflects_more_than_it_receives() {
    type Change = fn(&mut Principled);
    let variants: &[(&str, Change)] = &[
        ("default", |_| ()),
        ("rough diffuse", |p| p.diffuse_roughness = 0.8),
        ("metal", |p| p.metallic = 1.0),
        ("half metal", |p| p.metallic = 0.5),
        ("glass", |p| p.transmission = 1.0),
        ("half glass", |p| p.transmission = 0.5),
        ("coat", |p| p.cover.coat = 1.0),
        ("half rough coat", |p| (p.cover.coat, p.cover.coat_roughness) = (0.5, 0.4)),
        ("sheen", |p| p.cover.sheen = 1.0),
        ("anisotropic", |p| (p.anisotropy, p.rotation) = (0.8, 0.1)),
        ("high index", |p| p.ior = 2.5),
        ("low index", |p| p.ior = 0.7),
        ("specular colour", |p| p.specular_color = Some(Vec3::new(0.9, 0.5, 0.0))),
        ("strong specular", |p| p.specular_level = 1.0),
        ("everything", |p| {
            (p.metallic, p.transmission, p.cover.coat, p.cover.sheen) = (0.3, 0.4, 0.7, 0.6);
            (p.diffuse_roughness, p.anisotropy) = (0.5, -0.5);
        }),
    ];
    for (name, change) in variants {
        for roughness in [0.0, 0.3, 1.0] {
            let mut p = white();
            p.roughness = roughness;
            change(&mut p);
            for cos in [1.0, 0.5, 0.15, -0.6] {
                let (mean, error) = reflected(&p, direction(cos, 0.4));
                let bound = Vec3::splat(1.0 + ALBEDO_ERROR) + 4.0 * error;
                assert!(mean.cmple(bound).all(), "{name}, roughness {roughness}, cos {cos}: {mean} {error}");
                assert!(mean.is_finite() && mean.max_element() > 0.3, "{name} {roughness} {cos}: {mean}");
            }
        }
    }
}

#[test]
fn is_exactly_lambert_without_a_specular_lobe() {
    let color = Vec3::new(0.8, 0.4, 0.1);
    let cases: [fn(&mut Principled); 3] = [
        |p| (p.specular_color, p.ior) = (Some(Vec3::ZERO), 1.0),
        |p| p.ior = 1.0,
        |p| p.specular_level = 0.0,
    ];
    let (wo, wi) = (direction(0.4, 0.0), direction(0.7, 2.0));
    for change in cases {
        let mut p = white();
        p.base_color = color;
        change(&mut p);
        let bsdf = build(&p, wo);
        assert_eq!(bsdf.eval(wo, wi), color * FRAC_1_PI);
        assert_eq!(bsdf.albedo(wo), color);
    }
}

#[test]
fn the_density_integrates_to_the_share_of_draws_that_succeed() {
    let mut p = white();
    (p.metallic, p.cover.coat, p.cover.coat_roughness, p.cover.sheen) = (0.3, 0.7, 0.4, 0.6);
    (p.diffuse_roughness, p.anisotropy) = (0.5, 0.5);
    let wo = direction(0.6, 0.4);
    let bsdf = build(&p, wo);
    let integral = hemisphere_integral(1.0, |wi| Vec3::splat(bsdf.pdf(wo, wi).0)).x;
    let (share, error) = mean(20_000, |i| {
        let u = Vec3::new(hash_unit(i, 20), hash_unit(i, 21), hash_unit(i, 22));
        Vec3::splat(f32::from(u8::from(bsdf.sample(wo, Walk::Camera, u).is_some())))
    });
    assert!((integral - share.x).abs() < 4.0 * error.x + 2e-3, "{integral} {share} {error}");
    assert!(integral > 0.9 && integral < 1.0 + 2e-3);
}

#[test]
fn each_layer_hides_what_is_below() {
    let wo = direction(0.5, 0.0);
    let wi = direction(0.9, 2.5);
    let mut p = white();
    p.ior = 1.0;
    let bare = build(&p, wo).eval(wo, wi);
    (p.cover.coat, p.cover.coat_roughness) = (1.0, 0.0);
    let coated = build(&p, wo).eval(wo, wi);
    // the mirror of the coat does not show; what it reflects is missing below
    let f = crate::shading::lobes::fresnel::dielectric(0.5, 1.5).0;
    assert!(coated.abs_diff_eq(bare * (1.0 - f), 2e-3), "{coated} {bare}");
    p.cover.coat_tint = Vec3::new(0.5, 1.0, 0.0);
    let tinted = build(&p, wo).eval(wo, wi) / coated;
    let cos_t = (1.0 - 0.75 / 2.25f32).sqrt();
    assert!(tinted.abs_diff_eq(Vec3::new(0.5f32.powf(1.0 / cos_t), 1.0, 0.0), 1e-5), "{tinted}");
}

#[test]
fn index_and_normal_reflectance_are_inverses() {
    for eta in [1.0, 1.2, 1.5, 2.4] {
        approx::assert_abs_diff_eq!(ior_from_f0(f0_from_ior(eta)), eta, epsilon = 1e-5);
    }
    assert!(ior_from_f0(5.0).is_finite());
}

/// What shines from below sheen and coat comes through as what is reflected there.
#[test]
fn layers_let_light_out_as_they_let_it_in() {
    let (wi, color) = (Vec3::new(0.3, 0.1, 0.9).normalize(), Vec3::new(0.4, 0.5, 0.6));
    let bare = Principled { specular_level: 0.0, base_color: color, ..white() };
    let mut covered = bare;
    (covered.cover.coat, covered.cover.coat_roughness) = (0.8, 0.0);
    (covered.cover.coat_tint, covered.cover.sheen) = (Vec3::new(0.9, 0.5, 0.1), 0.7);
    let mut sheen = covered;
    sheen.cover.coat = 0.0;
    for cos in [0.02, 0.3, 0.8, 1.0_f32] {
        let wo = Vec3::new(0.0, (1.0 - cos * cos).sqrt(), cos);
        // the mirror of the coat does not show; the sheen itself does
        let fibres = build(&sheen, wo).eval(wo, wi) - color * FRAC_1_PI * sheen.cover.transmittance(cos);
        let left = (build(&covered, wo).eval(wo, wi) - fibres) / (color * FRAC_1_PI);
        let told = covered.cover.transmittance(cos);
        assert!(left.abs_diff_eq(told, 1e-4), "{cos}: {left} {told}");
    }
}
