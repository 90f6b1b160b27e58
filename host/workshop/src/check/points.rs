//! Points of a law, their results, and how these are compared.

use abi::raw;
use law::probe::{PointEnd, PointStart};

/// Requests: the update with its consistent tangent, and with the elastic operator.
pub(super) const UPDATE: u32 = raw::PILUM_REQ_FLUX | raw::PILUM_REQ_TANGENT;
pub(super) const ELASTIC: u32 = raw::PILUM_REQ_FLUX | raw::PILUM_REQ_ELASTIC;

/// Differences of fluxes between two ways to compute them, relative to the fluxes in play.
/// Return mappings iterate to about 10⁻¹⁰.
pub(super) const ITERATED: f64 = 1e-8;
/// Asymmetry, relative to the largest entry.
pub(super) const ROUND_OFF: f64 = 1e-9;

/// Whether outputs are claimed to be valid.
pub(crate) fn is_success(status: raw::Status) -> bool {
    status == raw::PILUM_OK || status == raw::PILUM_OK_UNRELIABLE
}

fn results(end: &PointEnd) -> impl Iterator<Item = &f64> {
    end.flux.iter().chain(&end.state).chain(&end.tangent)
}

/// Whether all results are finite.
pub(super) fn is_finite(end: &PointEnd) -> bool {
    results(end).all(|value| value.is_finite())
}

/// Whether two results have the same bits.
pub(super) fn is_same(a: &PointEnd, b: &PointEnd) -> bool {
    let bits = |end| results(end).map(|value| value.to_bits());
    a.status == b.status && (!is_success(a.status) || bits(a).eq(bits(b)))
}

/// The first point whose results differ.
pub(crate) fn first_difference(a: &[PointEnd], b: &[PointEnd]) -> Option<usize> {
    (0..a.len().max(b.len())).find(|&i| match (a.get(i), b.get(i)) {
        (Some(a), Some(b)) => !is_same(a, b),
        _ => true,
    })
}

pub(super) fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// The largest absolute value.
pub(super) fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| value.abs().max(most))
}

/// The largest difference of two components.
pub(super) fn apart(a: &[f64], b: &[f64]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.fold(0.0, |most, (a, b)| (a - b).abs().max(most))
}

/// The sum of two vectors.
pub(super) fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

/// Change of the gradient.
pub(super) fn increment(start: &PointStart) -> Vec<f64> {
    let pairs = start.gradient1.iter().zip(&start.gradient0);
    pairs.map(|(end, begin)| end - begin).collect()
}

/// A point that has come to this gradient and moves on by so much.
pub(super) fn moved_by(gradient: &[f64], by: &[f64], flux: &[f64], state: &[f64]) -> PointStart {
    PointStart {
        gradient0: gradient.to_vec(),
        gradient1: sum(gradient, by),
        flux0: flux.to_vec(),
        state0: state.to_vec(),
    }
}

/// A point that has come to this gradient and stays.
pub(super) fn at_rest(gradient: &[f64], flux: &[f64], state: &[f64]) -> PointStart {
    PointStart {
        gradient0: gradient.to_vec(),
        gradient1: gradient.to_vec(),
        flux0: flux.to_vec(),
        state0: state.to_vec(),
    }
}

/// A point that goes on from the end of its increment; it stays there for now.
pub(super) fn carry_on(point: &mut PointStart, end: PointEnd) {
    point.gradient0.clone_from(&point.gradient1);
    point.flux0 = end.flux;
    point.state0 = end.state;
}

/// Fluxes of points.
pub(crate) fn fluxes(starts: &[PointStart]) -> Vec<Vec<f64>> {
    starts.iter().map(|start| start.flux0.clone()).collect()
}

/// Points that have fluxes alone, as `init_state` gets them.
pub(super) fn with_fluxes(fluxes: &[Vec<f64>]) -> Vec<PointStart> {
    let of_flux = |flux: &Vec<f64>| at_rest(&[], flux, &[]);
    fluxes.iter().map(of_flux).collect()
}

/// Components of a smaller hypothesis as those of one with this many: the others are nought.
pub(super) fn longer(values: &[f64], n: usize) -> Vec<f64> {
    let mut longer = values.to_vec();
    longer.resize(n, 0.0);
    longer
}

/// The same start under that hypothesis.
pub(super) fn enlarged(start: &PointStart, n: usize) -> PointStart {
    PointStart {
        gradient0: longer(&start.gradient0, n),
        gradient1: longer(&start.gradient1, n),
        flux0: longer(&start.flux0, n),
        state0: start.state0.clone(),
    }
}
