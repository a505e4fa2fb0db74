//! An arrival gathers as the formula says, term by term.

use super::*;
use crate::shading::SurfaceClass;
use crate::shading::bsdf::Among;
use crate::transport::Estimator;
use crate::transport::cluster::Areas;
use crate::transport::exchange::{offer, reflect};
use crate::transport::testing::{ON, clustered, room, sampled};
use crate::transport::weigh::Weights;

/// For every camera arrival, the number of its path.
fn paths(camera: &CameraStore) -> Vec<u32> {
    let mut path = 0;
    let number = |i: usize| {
        let this = path;
        path += u32::from(!camera.outgoing.has_end(i));
        this
    };
    (0..camera.outgoing.len()).map(number).collect()
}

#[test]
fn an_arrival_gathers_from_its_own_segment_and_from_other_paths() {
    for wall in [
        r#"{"surface":{"type":"diffuse","color":0.9}}"#,
        r#"{"surface":{"type":"glossy","color":0.9,"roughness":0.4}}"#,
    ] {
        let world = room(wall);
        let (camera, light) = sampled(&world, 23, 240, 0);
        let clusters = clustered(&world, &camera, &light, Areas::None);
        let s = Sampled { world: &world, camera: &camera, light: &light, clusters: &clusters, bridges: None };
        let mut weights = Weights::default();
        assert!(weights.weigh(s, Estimator::LeaveOneOut, &ON));
        let path = paths(&camera);
        let value = |i: usize| match camera.arrivals.get(i).goes_on {
            true => Vec3::new(1.0, (i % 7) as f32, (i % 11) as f32),
            false => Vec3::ZERO,
        };
        let values: Vec<Vec3> = (0..path.len()).map(value).collect();
        let got = reflect(s, &weights, |i| offer(s, i, values[i]), |_, light| light, &ON);
        // value and `q p` of an arrival's lobes
        let look = |i: usize, w: Vec3| {
            let a = camera.arrivals.get(i);
            let bsdf = a.bsdf(&world);
            let (value, pdf) = bsdf.sight(a.wo, Among::Continuous).map_or((Vec3::ZERO, 0.0), |s| {
                let (value, pdf) = s.look(w);
                (value, pdf.0)
            });
            (value, a.survival * pdf)
        };
        let mut returned = 0;
        for i in 0..path.len() {
            let c = s.cluster_of(i);
            assert!(c.cameras <= MOST && c.class != SurfaceClass::Transmitting);
            let counts = |t: &usize| *t == i || path[*t] != path[i];
            returned += u32::from(!s.cameras(c).all(|t| counts(&t)));
            let mut expected = Vec3::ZERO;
            for j in s.cameras(c).filter(counts).filter(|&j| camera.arrivals.get(j).goes_on) {
                let w = camera.outgoing.get(j).direction;
                let all: f32 = s.cameras(c).map(|t| look(t, w).1).sum();
                let rest: f32 = s.cameras(c).filter(counts).map(|t| look(t, w).1).sum();
                expected += look(i, w).0 * values[j] * (all / rest / c.area);
            }
            let error = (got[i] - expected).abs().max_element();
            assert!(error <= 1e-3 * expected.max_element(), "{wall}, {i}: {}, not {expected}", got[i]);
        }
        assert!(returned > 40, "{wall}: {returned} of {}", path.len());
    }
}
