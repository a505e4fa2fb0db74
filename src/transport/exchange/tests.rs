//! The weights of all techniques that could have made a segment sum to one.

use super::*;
use crate::math::sampler::{hash, hash_unit};
use crate::math::{Sampler, warp};
use crate::shading::bsdf::Walk;
use crate::shading::{CameraRay, Piece, World};
use crate::transport::Estimator;
use crate::transport::arrival::arrival;
use crate::transport::cluster::Areas;
use crate::transport::photons::photon_value;
use crate::transport::store::{Arrival, CameraStore, LightStore, NextEvent, Outgoing, Photon, Rivals};
use crate::transport::testing::{ON, clustered, room};
use crate::transport::walk::{Follow, Nobody};

/// Camera segments, and the same segments made by light paths: arrival `2 k` of the light's side stands where segment
/// `k` ends and arrival `2 k + 1` where it begins.
fn both_ways(world: &World, count: u32) -> (CameraStore, LightStore) {
    let (mut camera, mut light) = (CameraStore::default(), LightStore::default());
    let follow = Follow { world, walk: Walk::Camera, from_camera: false };
    let mut push = |a: Arrival, out: Outgoing| {
        camera.push(a, NextEvent::default(), out);
    };
    for k in 0..count {
        let mut sampler = Sampler::new(5, 0, k);
        let direction = warp::uniform_sphere(sampler.next_2d());
        let ray = CameraRay { origin: Vec3::new(0.1, 0.2, 0.5), direction, range: [0.0, f32::INFINITY] };
        let Some(end) = follow.segment(Piece::from_camera(&ray), &mut sampler, &mut Nobody, &mut 0).1 else {
            continue;
        };
        let mut a = arrival(world, &end, end.sight().as_ref());
        let Some(sample) = end.vertex.bsdf.sample_continuous(end.wo, Walk::Camera, sampler.next_3d()) else {
            continue;
        };
        a.goes_on = true;
        let piece = Piece::leaving(&end.hit, sample.direction);
        let (chain, next) = follow.segment(piece, &mut sampler, &mut Nobody, &mut 0);
        let Some(next) = next else { continue };
        let b = arrival(world, &next, next.sight().as_ref());
        let squeeze = chain.squeeze;
        let out = Outgoing {
            direction: sample.direction,
            pdf: sample.pdf.value(),
            throughput: chain.throughput,
            forward: chain.forward,
            reverse: chain.reverse,
            squeeze,
            passages: chain.passages,
        };
        push(a, out);
        push(b, Outgoing::default());
        let rivals = Rivals::First { light_density: 1.0, next_event_pdf: 0.0, is_delta: false };
        let pdf = next.vertex.bsdf.continuous_pdf(b.wo, b.wo).0;
        let photon = Photon {
            path: k,
            flux: Vec3::ONE,
            bounces: 0,
            rivals,
            camera_choices: 1.0,
            direction: b.wo,
            pdf,
        };
        light.arrivals.push(Arrival { goes_on: true, ..b });
        light.photons.push(photon);
        light.arrivals.push(Arrival { wo: sample.direction, goes_on: false, ..a });
        let rivals = Rivals::Later { light_choices: chain.reverse, squeeze: 1.0 / squeeze };
        light.photons.push(Photon { bounces: 1, rivals, camera_choices: chain.forward, pdf: 0.0, ..photon });
    }
    (camera, light)
}

#[test]
fn the_weights_of_all_techniques_sum_to_one() {
    for wall in [
        r#"{"surface":{"type":"diffuse","color":0.6}}"#,
        r#"{"surface":{"type":"glossy","color":0.8,"roughness":0.4}}"#,
    ] {
        let world = room(wall);
        let (camera, light) = both_ways(&world, 4000);
        let (clusters, mut weights) =
            (clustered(&world, &camera, &light, Areas::OfPhotons), Weights::default());
        let s = Sampled { world: &world, camera: &camera, light: &light, clusters: &clusters, bridges: None };
        assert!(weights.weigh(s, Estimator::LeaveOneOut, &ON));
        let constants = Segments::new(s, &weights);
        let (mut checked, mut through_glass, mut shared) = (0, 0, 0);
        for i in (0..camera.arrivals.len()).step_by(2) {
            let n = camera.arrivals.len();
            let (start, end) = (s.cluster_of(i), s.cluster_of(i + 1));
            // parts of pairwise clusters are drawn at random, so the twins may have been parted
            if clusters.of(n + i + 1) != clusters.of(i) || clusters.of(n + i) != clusters.of(i + 1) {
                continue;
            }
            let returns = clusters.of(n + i + 1) == clusters.of(n + i);
            if returns && end.class != SurfaceClass::Diffuse {
                continue;
            }
            let twin = if returns { light.arrivals.get(i + 1).survival } else { 0.0 };
            let own = (light.arrivals.get(i).survival + twin) * light.photons.get(i).pdf / end.area;
            let segment = Densities::of(s, &weights, i);
            let p_light = weights.densities[i + 1].light;
            // the light path itself is left out both ways, all of it
            let camera_weight = segment.camera / (segment.camera + segment.light * (p_light - own).max(0.0));
            let light_weight = photon_value(s, &weights, i + 1).x / start.inverse_area;
            let sum = camera_weight + light_weight;
            assert!((sum - 1.0).abs() < 2e-4, "{wall}, {i}: {camera_weight} + {light_weight}");
            // and with the light path itself among the techniques
            let all = segment.camera + segment.light * p_light;
            let carried = constants.carry(s, i) / camera.outgoing.throughput(i) * all;
            assert!((carried - Vec3::ONE).abs().max_element() < 1e-4, "{carried}");
            checked += 1;
            through_glass += u32::from(camera.outgoing.get(i).passages > 0);
            shared += u32::from(end.lights > 1);
        }
        assert!(checked > 500 && through_glass > 50 && shared > 100, "{checked} {through_glass} {shared}");
    }
}

/// A diffuse cluster of ten million segments, which differ by ten orders of magnitude in what they bring.
#[test]
fn sums_over_ten_million_segments_are_as_good_as_in_double_precision() {
    const COUNT: u32 = 10_000_000;
    let world = room(r#"{"surface":{"type":"diffuse","color":0.6}}"#);
    let (one, light) = (both_ways(&world, 1).0, LightStore::default());
    let of = |k: u32, n: u32| hash_unit(hash(k, n), 3);
    let mut camera = CameraStore::default();
    for k in 0..COUNT {
        let arrival = Arrival { survival: of(k, 1), ..one.arrivals.get(0) };
        let outgoing = Outgoing { pdf: of(k, 2), ..one.outgoing.get(0) };
        camera.push(arrival, NextEvent::default(), outgoing);
    }
    let values: Vec<Vec3> = (0..COUNT).map(|k| Vec3::new(1.0, of(k, 3), 1e10f32.powf(of(k, 4)))).collect();
    let (clusters, mut weights) = (clustered(&world, &camera, &light, Areas::None), Weights::default());
    let s = Sampled { world: &world, camera: &camera, light: &light, clusters: &clusters, bridges: None };
    assert!(weights.weigh(s, Estimator::LeaveOneOut, &ON));
    let cluster = s.cluster_of(0);
    assert_eq!(cluster.cameras, COUNT);

    let arriving = |(i, v): (usize, &Vec3)| v.as_dvec3() * f64::from(camera.outgoing.pdf(i));
    let exact: DVec3 = values.iter().enumerate().map(arriving).sum();
    let expected = camera.arrivals.get(0).reflectance.as_dvec3() * exact / f64::from(cluster.area);
    let got = reflect(s, &weights, |i| offer(s, i, values[i]), |_, light| light, &ON)[0].as_dvec3();
    assert!((got / expected - 1.0).abs().max_element() < 1e-5, "{got}, not {expected}");

    let choices: f64 = camera.arrivals.iter().map(|a| f64::from(a.survival)).sum();
    let expected = choices * f64::from(camera.outgoing.pdf(0)) / f64::from(cluster.area);
    let got = f64::from(weights.densities[0].camera);
    assert!((got / expected - 1.0).abs() < 1e-5, "{got}, not {expected}");
}
