//! The weights of all techniques that could have made a path sum to one, with other paths about and without.

use super::*;
use crate::math::{Sampler, warp};
use crate::shading::bsdf::Walk;
use crate::shading::{CameraRay, Piece, Shaded, World};
use crate::transport::Estimator;
use crate::transport::arrival::arrival;
use crate::transport::cluster::Areas;
use crate::transport::store::{Arrival, CameraStore, LightStore, NextEvent, Outgoing, Photon};
use crate::transport::testing::{ON, clustered, room};
use crate::transport::walk::{End, Follow, Nobody};

/// Arrivals of a path; a light stands at the end of the segment that leaves the last.
const ARRIVALS: usize = 3;
/// Density of light paths there, and of next-event estimation.
const LIGHT: f32 = 0.7;
const NEXT_EVENT: f32 = 0.4;

/// A point of a path as both sub-paths store it.
struct Point {
    camera: Arrival,
    outgoing: Outgoing,
    light: Arrival,
    photon: Photon,
}

fn path(world: &World, number: u32) -> Option<Vec<Point>> {
    let mut sampler = Sampler::new(7, 0, number);
    let direction = warp::uniform_sphere(sampler.next_2d());
    let ray = CameraRay { origin: Vec3::new(0.1, 0.2, 0.5), direction, range: [0.0, f32::INFINITY] };
    let mut piece = Piece::from_camera(&ray);
    let follow = Follow { world, walk: Walk::Camera, from_camera: false };
    let mut points: Vec<Point> = Vec::new();
    for k in 0..ARRIVALS {
        let (chain, end) = follow.segment(piece, &mut sampler, &mut Nobody, &mut 0);
        let end = end?;
        let squeeze = chain.squeeze;
        if let Some(before) = points.last_mut() {
            let out = &mut before.outgoing;
            (out.forward, out.reverse, out.throughput) = (chain.forward, chain.reverse, chain.throughput);
            (out.squeeze, out.passages) = (squeeze, chain.passages);
            // the light's walk arrives there by the same segment
            before.photon.rivals = Rivals::Later { light_choices: chain.reverse, squeeze: 1.0 / squeeze };
            before.photon.camera_choices = chain.forward;
        }
        let mut camera = arrival(world, &end, end.sight().as_ref());
        if k < EARLY {
            camera.survival = early_survival(camera.survival);
        }
        camera.goes_on = true;
        let sample = end.vertex.bsdf.sample_continuous(end.wo, Walk::Camera, sampler.next_3d())?;
        let to_light = sample.direction;
        let shaded = world.shade(&end.hit, to_light, Walk::Light, 0.0);
        let Shaded::Scatters { vertex, opacity, .. } = shaded else { return None };
        let back = vertex.bsdf.continuous_pdf(to_light, end.wo).0;
        let light = End { hit: end.hit, vertex, wo: to_light, opacity, end_probability: 1.0 };
        let light = Arrival { goes_on: true, ..arrival(world, &light, light.sight().as_ref()) };
        piece = Piece::leaving(&end.hit, to_light);
        points.push(Point {
            camera,
            outgoing: Outgoing { direction: to_light, pdf: sample.pdf.value(), ..Outgoing::default() },
            light,
            photon: Photon {
                path: number,
                flux: Vec3::ONE,
                bounces: 0,
                rivals: Rivals::First { light_density: LIGHT, next_event_pdf: NEXT_EVENT, is_delta: false },
                camera_choices: 1.0,
                direction: end.wo,
                pdf: back,
            },
        });
    }
    Some(points)
}

fn add_camera(store: &mut CameraStore, points: &[Point]) {
    points.iter().for_each(|p| store.push(p.camera, NextEvent::default(), p.outgoing));
}

fn add_path(store: &mut CameraStore, points: &[Point]) {
    let (last, before) = points.split_last().unwrap();
    add_camera(store, before);
    store.push(last.camera, NextEvent::default(), Outgoing { forward: 0.0, ..last.outgoing });
}

fn add_light(store: &mut LightStore, points: &[Point]) {
    for p in points.iter().rev() {
        store.arrivals.push(p.light);
        store.photons.push(p.photon);
    }
}

#[derive(Clone, Copy, Debug)]
enum Technique {
    Join(usize),
    Hit,
    NextEvent,
}

/// The weight of a path that a technique made beside others.
fn weight(world: &World, others: &[Vec<Point>], points: &[Point], technique: Technique) -> f32 {
    let (mut camera, mut light) = (CameraStore::default(), LightStore::default());
    let half = others.len() / 2;
    others[..half].iter().for_each(|p| add_path(&mut camera, p));
    others[half..].iter().for_each(|p| add_light(&mut light, p));
    let (start, photons) = (camera.arrivals.len(), light.arrivals.len());
    let joined = match technique {
        Technique::Join(m) => m,
        Technique::Hit | Technique::NextEvent => ARRIVALS,
    };
    add_camera(&mut camera, &points[..joined - 1]);
    let last = start + joined - 1;
    let end = &points[joined - 1];
    let (mut arrival, mut next_event) = (end.camera, NextEvent::default());
    arrival.goes_on = matches!(technique, Technique::Hit);
    let Outgoing { direction, pdf, .. } = end.outgoing;
    match technique {
        Technique::Join(m) => add_light(&mut light, &points[m - 1..]),
        Technique::Hit => camera.hits.push(EmissionHit {
            arrival: last as u32,
            light: Vec3::ONE,
            forward: 1.0,
            next_event_pdf: NEXT_EVENT,
            light_density: LIGHT,
            passages: 0,
        }),
        Technique::NextEvent => {
            next_event = NextEvent {
                direction,
                pdf,
                light: Vec3::ONE,
                next_event_pdf: NEXT_EVENT,
                light_density: LIGHT,
                is_delta: false,
            };
        }
    }
    camera.push(arrival, next_event, Outgoing { forward: 0.0, ..end.outgoing });
    // measured areas are a little different with every arrival that comes to a cluster
    let (clusters, mut weights) = (clustered(world, &camera, &light, Areas::None), Weights::default());
    let s = Sampled { world, camera: &camera, light: &light, clusters: &clusters, bridges: None };
    assert!(weights.weigh(s, Estimator::WholePath, &ON));
    let paths = WholePaths { s, w: &weights, rests: rests(s, &weights) };
    let mut at = Prefix { throughput: Vec3::ONE, bounces: 0, is_first: true, back: 0.0 };
    for i in start..last {
        let near = paths.near(i, &at, camera.outgoing.get(i).direction);
        at = paths.beyond(i, &at, near);
    }
    match technique {
        Technique::Join(_) => {
            let j = light.arrivals.len() - 1;
            assert_eq!(clusters.of(last), clusters.of(camera.arrivals.len() + j));
            assert_eq!(j - photons, ARRIVALS - joined);
            paths.join_weight(j, &at, paths.joined_near(last, &at))
        }
        Technique::Hit => {
            paths.hit_weight(&camera.hits.of(last).next().unwrap(), paths.near(last, &at, direction))
        }
        Technique::NextEvent => paths.next_event_weight(last, &next_event, &at),
    }
}

#[test]
fn the_weights_of_all_techniques_sum_to_one() {
    for wall in [
        r#"{"surface":{"type":"diffuse","color":0.6}}"#,
        r#"{"surface":{"type":"glossy","color":0.8,"roughness":0.4}}"#,
    ] {
        let world = room(wall);
        let (mut through_glass, mut least) = (0, [f32::INFINITY; 5]);
        for others in [0, 600] {
            let others: Vec<_> = (1000..1000 + others).filter_map(|k| path(&world, k)).collect();
            for points in (0..60).filter_map(|k| path(&world, k)) {
                let mut techniques: Vec<_> = (1..=ARRIVALS).map(Technique::Join).collect();
                techniques.extend([Technique::Hit, Technique::NextEvent]);
                let parts: Vec<f32> =
                    techniques.into_iter().map(|t| weight(&world, &others, &points, t)).collect();
                let sum: f32 = parts.iter().sum();
                assert!((sum - 1.0).abs() < 2e-4, "{wall}, {} others: {parts:?}, {sum}", others.len());
                least.iter_mut().zip(&parts).for_each(|(l, p)| *l = l.min(*p));
                through_glass += u32::from(points.iter().any(|p| p.outgoing.passages > 0));
            }
        }
        // all of them take part
        assert!(through_glass > 20 && least.iter().all(|&l| l > 0.0), "{through_glass} {least:?}");
    }
}
