//! Are rates the derivative of the update?

use super::LENGTHS;
use crate::check::draw::Draw;
use crate::check::loading_path::Step;
use crate::check::points::{increment, is_success, largest};
use crate::check::random::Random;
use crate::check::specimen::Specimen;
use crate::check::{Found, Subject, Verdict, refusal, skipped, warned};
use abi::raw;
use law::probe::{Form, PointRates, PointStart};
use std::slice::from_ref;

/// Error of rates, relative to those of the inputs times what differences show; these are good to
/// about 10⁻⁸.
const RATE: f64 = 1e-6;

pub(super) fn rates_match_differences(subject: &Subject) -> Found {
    let mut n_kinks = 0;
    let n = subject.each(Draw::DefaultChoices, "rates", 4, |specimen, random| {
        // They are asked for over an increment of one unit of time.
        if !specimen.formulation.rates || specimen.time_increment.to_bits() != 1.0_f64.to_bits() {
            return Ok(0);
        }
        let mut n = 0;
        for step in specimen.paths(36, random)?.steps.iter().step_by(5) {
            n += 1;
            n_kinks += usize::from(!one_direction(specimen, step, random)?);
        }
        Ok(n)
    })?;
    let details = format!("{n} directions, {n_kinks} at kinks");
    if n == 0 {
        Err(skipped("no law declares rates"))
    } else if 2 * n_kinks > n {
        Err(warned(format!("too few were compared: {details}")))
    } else {
        Ok(details)
    }
}

/// Direction in which the inputs of an update move.
struct Direction {
    point: PointRates,
    parameter: Vec<f64>,
}

impl Direction {
    /// A random one, for increments and fluxes of this size.
    fn new(
        specimen: &Specimen,
        start: &PointStart,
        [size, flux]: [f64; 2],
        random: &mut Random,
    ) -> Self {
        // Each input moves by a part of its own size; choices, and what is left out, stay.
        let mut part = |scale: f64| scale * random.between(-1.0, 1.0);
        let parameters = specimen.law.description().parameters.iter();
        let parameter: Vec<f64> = parameters
            .zip(&specimen.values)
            .map(|(p, value)| {
                let moves = p.choices.is_empty() && value.is_finite() && *value != 0.0;
                if moves { part(0.1 * value.abs()) } else { 0.0 }
            })
            .collect();
        let point = PointRates {
            gradient0: start.gradient0.iter().map(|_| part(size)).collect(),
            gradient1: start.gradient0.iter().map(|_| part(size)).collect(),
            flux0: start.flux0.iter().map(|_| part(0.1 * flux)).collect(),
            state0: start.state0.iter().map(|s| part(0.1 * s.abs())).collect(),
        };
        Self { point, parameter }
    }
}

/// The largest error of rates against central differences, the largest difference between the two sides, both
/// relative to the scales, and the number of the rate that is off most.
fn compared(
    rates: &[f64],
    scales: &[f64],
    [above, here, below]: [&[f64]; 3],
    length: f64,
) -> (f64, f64, usize) {
    let (mut error, mut disagreement) = (0.0_f64, 0.0_f64);
    let mut worst = 0;
    for k in 0..rates.len() {
        let by_differences = (above[k] - below[k]) / (2.0 * length);
        let sides = (above[k] - 2.0 * here[k] + below[k]) / length;
        let wrong = (by_differences - rates[k]).abs() / scales[k];
        disagreement = disagreement.max(sides.abs() / scales[k]);
        if wrong > error {
            (error, worst) = (wrong, k);
        }
    }
    (error, disagreement, worst)
}

/// Compares the rates of a step in a random direction with differences. `false`: at a kink.
fn one_direction(specimen: &Specimen, step: &Step, random: &mut Random) -> Result<bool, Verdict> {
    let start = &step.start;
    let size = largest(&increment(start));
    let flux = largest(&start.flux0).max(step.stiffness * size);
    let Direction { point, parameter } = Direction::new(specimen, start, [size, flux], random);
    let (starts, directions) = (from_ref(start), from_ref(&point));
    let (answer, rates) = specimen.probe.rates(starts, directions, &parameter)?;
    let ([end], [(flux_rate, state_rate)]) = (answer.points.as_slice(), rates.as_slice()) else {
        return Err(specimen.fails("no rates are written"));
    };
    if !is_success(end.status) {
        return Err(specimen.fails(format_args!(
            "with rates `integrate` returned {}",
            refusal(answer.status, answer.text().as_deref())
        )));
    }
    if end.flux != step.end.flux {
        return Err(specimen.fails("with rates the update gives another flux"));
    }
    let found: Vec<f64> = flux_rate.iter().chain(state_rate).copied().collect();
    let scale = |(k, rate): (usize, &f64)| {
        let is_flux = k < flux_rate.len();
        rate.abs().max(if is_flux { 0.1 * flux } else { size })
    };
    let scales: Vec<f64> = found.iter().enumerate().map(scale).collect();
    let here: Vec<f64> = end.flux.iter().chain(&end.state).copied().collect();
    let mut verdict = Ok(false);
    for length in LENGTHS {
        let moved = |sign: f64| moved_end(specimen, start, &point, &parameter, sign * length);
        let (Some(above), Some(below)) = (moved(1.0)?, moved(-1.0)?) else {
            continue;
        };
        let sides = [&above, &here, &below].map(Vec::as_slice);
        let (error, disagreement, worst) = compared(&found, &scales, sides, length);
        if error <= RATE {
            return Ok(true);
        }
        if disagreement <= 0.1 * error {
            verdict = Err(specimen.fails(format_args!(
                "rate {worst} of flux and internal variables is {:.9e}, differences say otherwise by \
                 {error:.1e} of it, at {} in the direction {point:?}, parameters \
                 {parameter:?}",
                found[worst],
                specimen.at(start)
            )));
        }
    }
    verdict
}

/// Flux and internal variables with all inputs and parameters moved along a direction; `None` where
/// the law does not follow.
fn moved_end(
    specimen: &Specimen,
    start: &PointStart,
    direction: &PointRates,
    parameter: &[f64],
    length: f64,
) -> Result<Option<Vec<f64>>, Verdict> {
    let along = |values: &[f64], rates: &[f64]| -> Vec<f64> {
        let pairs = values.iter().zip(rates);
        pairs.map(|(value, rate)| value + length * rate).collect()
    };
    let values = along(&specimen.values, parameter);
    let Some(probe) = specimen.with_values(&values)? else {
        return Ok(None);
    };
    let point = PointStart {
        gradient0: along(&start.gradient0, &direction.gradient0),
        gradient1: along(&start.gradient1, &direction.gradient1),
        flux0: along(&start.flux0, &direction.flux0),
        state0: along(&start.state0, &direction.state0),
    };
    let mut answer = probe.integrate(&[point], &Form::of(raw::PILUM_REQ_FLUX))?;
    let end = answer.points.remove(0);
    Ok(is_success(end.status).then(|| end.flux.into_iter().chain(end.state).collect()))
}
