//! Weighing where lobes do not factorise: pair by pair.

use super::Estimator;
use super::cluster::Cluster;
use super::returns::leave_out;
use super::store::Arrival;
use super::weigh::{Batch, Places, Sampled, TowardsLight, columns, next_event_value};
use crate::math::SharedExponent;
use crate::math::density::ProjectedPdf;
use crate::shading::bsdf::{Among, Bsdf};
use glam::Vec3;
use std::borrow::Cow;

/// An arrival of a cluster whose lobes are evaluated pair by pair.
struct Member {
    number: usize,
    arrival: Arrival,
    bsdf: Bsdf,
    /// Direction of the segment that leaves it, if there is one.
    leaves: Option<Vec3>,
}

impl Member {
    fn of_camera(s: Sampled, i: usize) -> Self {
        let arrival = s.camera.arrivals.get(i);
        let leaves = arrival.goes_on.then(|| s.camera.outgoing.direction(i));
        Self { number: i, arrival, bsdf: arrival.bsdf(s.world), leaves }
    }

    fn of_light(s: Sampled, j: usize) -> Self {
        let arrival = s.light.arrivals.get(j);
        let leaves = arrival.goes_on.then(|| s.light.photons.direction(j));
        Self { number: j, arrival, bsdf: arrival.bsdf(s.world), leaves }
    }
}

/// Weighs the segments of such a cluster.
pub(super) fn weigh(s: Sampled, c: &Cluster, estimator: Estimator, places: &mut Places, batch: &mut Batch) {
    let cameras: Vec<Member> = s.cameras(c).map(|i| Member::of_camera(s, i)).collect();
    let lights: Vec<Member> = s.lights(c).map(|j| Member::of_light(s, j)).collect();
    let (n, m) = (cameras.len(), lights.len());
    let width = columns(s, c);
    // who gathers, as seen from where, and with which `q`: a light arrival's path is no technique of the camera
    let mut gatherers: Vec<(Cow<Bsdf>, Vec3, f32)> =
        cameras.iter().map(|m| (Cow::Borrowed(&m.bsdf), m.arrival.wo, m.arrival.survival)).collect();
    if estimator == Estimator::Literal {
        gatherers.extend(lights.iter().map(|m| {
            // nobody reads what one gathers whose path ends
            let wo = m.leaves.unwrap_or(m.arrival.wo);
            (Cow::Owned(m.arrival.bsdf_from(s.world, wo)), wo, 0.0)
        }));
    }
    let rows = gatherers.len();
    let owns = batch.owns.len();
    batch.owns.resize(owns + n * m, 0.0);
    let mut values = vec![Vec3::ZERO; rows * width];
    let densities = &mut *places.densities;
    let bridges = cameras.iter().filter_map(|m| Some(&s.bridges?.segments[m.number]));
    let next_events: Vec<_> = cameras.iter().map(|m| s.camera.next_events.get(m.number)).collect();
    let mut bridge_pdfs = vec![0.0; n];
    let mut next_event_pdfs = vec![0.0; n];
    let mut next_event_values = vec![Vec3::ZERO; rows * n];
    let mut leaving_pdfs = vec![0.0; rows * n];
    for (row, (bsdf, wo, q)) in gatherers.iter().enumerate() {
        let sight = bsdf.sight(*wo, Among::Continuous);
        let look = |w: Vec3| {
            let (value, ProjectedPdf(pdf)) =
                sight.as_ref().map_or((Vec3::ZERO, ProjectedPdf(0.0)), |s| s.look(w));
            (q * pdf, value)
        };
        for (column, (member, next_event)) in cameras.iter().zip(&next_events).enumerate() {
            if let Some(direction) = member.leaves {
                let (pdf, value) = look(direction);
                densities[column].camera += pdf;
                leaving_pdfs[row * n + column] = pdf;
                values[row * width + column] = value;
            }
            if let Some(next_event) = next_event {
                let (pdf, value) = look(next_event.direction);
                next_event_pdfs[column] += pdf;
                next_event_values[row * n + column] = value;
            }
        }
        for (column, member) in lights.iter().enumerate() {
            let w = member.arrival.wo;
            let (pdf, value) = look(w);
            densities[n + column].camera += pdf;
            values[row * width + n + column] = value;
        }
        for (column, b) in bridges.clone().enumerate() {
            let (pdf, value) = look(b.direction);
            bridge_pdfs[column] += pdf;
            values[row * width + n + m + column] = value;
        }
    }
    if estimator == Estimator::LeaveOneOut {
        leave_out(s, c, &leaving_pdfs, &mut values, width, densities, &mut places.apart);
    }
    batch.values.extend(values.into_iter().map(SharedExponent::encode));
    if s.bridges.is_some() {
        batch.bridged.extend(bridges.zip(&bridge_pdfs).map(|(b, &p_cam)| b.value(p_cam, c)));
        batch.bridged.extend((0..m).map(|_| Vec3::ZERO));
    }
    for (t, own) in lights.iter().enumerate() {
        let a = &own.arrival;
        let sight = own.bsdf.sight(a.wo, Among::Continuous);
        let pdf = |w: Vec3| sight.as_ref().map_or(0.0, |s| a.survival * s.pdf(w).0);
        for (row, member) in cameras.iter().enumerate() {
            let part = pdf(member.arrival.wo);
            densities[row].light += part;
            batch.owns[owns + row * m + t] = part;
        }
        for (other, member) in lights.iter().enumerate() {
            let is_rival = estimator != Estimator::LeaveOneOut || s.path(member.number) != s.path(own.number);
            if let Some(direction) = member.leaves.filter(|_| is_rival) {
                densities[n + other].light += pdf(direction);
            }
        }
    }
    for row in 0..n {
        s.sum_over_paths(c, &mut batch.owns[owns + row * m..][..m]);
    }
    let mut direct = vec![Vec3::ZERO; rows];
    for (column, next_event) in next_events.iter().enumerate() {
        if let Some(next_event) = next_event {
            let value = next_event_value(next_event, next_event_pdfs[column], c) / c.area;
            for (row, direct) in direct.iter_mut().enumerate() {
                *direct += next_event_values[row * n + column] * value;
            }
        }
    }
    for (stored, direct) in places.direct.iter_mut().zip(direct) {
        *stored = SharedExponent::encode(direct);
    }
    if estimator == Estimator::WholePath {
        let own = |k: usize| TowardsLight { value: next_event_values[k * n + k], camera: next_event_pdfs[k] };
        batch.towards_lights.extend((0..n).map(own));
        batch.towards_lights.extend((0..m).map(|_| TowardsLight::default()));
    }
}
