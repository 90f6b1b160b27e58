//! Derivatives of a driver's rows by parameters, from the rates that a law gives (contract, "Rates").
//!
//! The end of one increment starts the next: with the rates of its start an increment has those of its
//! end, but for the gradient that the point was searched for. If a flux is prescribed, its rate is
//! known instead, so that the gradient's follows from a small linear system of the law's own
//! derivatives.

use abi::raw;
use input::Driver;
use law::probe::{CreateForm, PointRates, PointStart, Probe};
use nalgebra::{DMatrix, DVector};
use point::{Control, Frame, Segment};
use results::point_figure::{drawable, drawn};

/// Rows of a driver by segment, as [`super::curve::Rows`] has them, and their derivatives by each
/// parameter.
#[derive(Clone, Debug)]
pub(super) struct Followed {
    pub(super) stretches: Vec<Vec<Vec<f64>>>,
    /// By parameter, segment, row and column.
    pub(super) derivatives: Vec<Vec<Vec<Vec<f64>>>>,
}

/// A state that the driver has passed.
#[derive(Clone, Debug)]
struct State {
    gradient: Vec<f64>,
    flux: Vec<f64>,
    internal: Vec<f64>,
    time: f64,
}

/// A call that repeats an increment of the driver may differ from it by this, relative to the largest
/// value: more than that took several steps.
const SAME: f64 = 1e-9;

/// Whether a law gives rates, and a driver leads it so that they can be followed.
pub(super) fn are_given(driver: &Driver) -> bool {
    let formulation = driver.point().law().formulation();
    let is_plain =
        |segment: &Segment| segment.restrictions.is_none() && segment.frame == Frame::Cartesian;
    formulation.rates
        && driver.point().law().time_dependence().is_none()
        && driver.point().segments().iter().all(is_plain)
}

/// Follows a driver, and derivatives by the parameters of these numbers with it; `None` where an
/// increment took several steps, or the law gives no rates after all.
///
/// # Errors
/// As [`Driver::run`].
pub(super) fn follow(
    driver: &Driver,
    parameters: &[usize],
) -> Result<Option<Followed>, input::Error> {
    let mut states = Vec::new();
    driver.run(|row| {
        states.push(State {
            gradient: row.gradient.to_vec(),
            flux: row.flux.to_vec(),
            internal: row.internal.to_vec(),
            time: row.time,
        });
    })?;
    Ok(followed(driver, &states, parameters))
}

fn followed(driver: &Driver, states: &[State], parameters: &[usize]) -> Option<Followed> {
    let law = driver.point().law();
    let form = CreateForm {
        formulation: law.formulation().index,
        values: Some(law.parameters()),
        n_values: law.parameters().len(),
        message: Some(200),
        more_host: 0,
        host_minor: raw::PILUM_ABI_MINOR,
        hypothesis: law.hypothesis(),
        n_states: law.n_states(),
        lacks_tangent: false,
    };
    let probe = law.loaded().probe(&form).ok()?.probe?;
    let rows = |of: &dyn Fn(usize) -> Vec<f64>| {
        let mut first = 0;
        let mut stretches = Vec::new();
        for increments in driver.point().segment_increments() {
            stretches.push((first..=first + increments).map(of).collect::<Vec<_>>());
            first += increments;
        }
        stretches
    };
    let values = |k: usize| values(driver, &states[k]);
    let mut derivatives = Vec::new();
    for &parameter in parameters {
        let mut direction = vec![0.0; law.parameters().len()];
        direction[parameter] = 1.0;
        let rates = along(&probe, driver, states, &direction)?;
        derivatives.push(rows(&|k| rates_of_values(driver, &states[k], &rates[k])));
    }
    Some(Followed {
        stretches: rows(&values),
        derivatives,
    })
}

/// The columns that curves may show.
fn values(driver: &Driver, state: &State) -> Vec<f64> {
    let row = point::Row {
        increment: 0,
        time: state.time,
        gradient: &state.gradient,
        flux: &state.flux,
        internal: &state.internal,
        iterations: 0,
        is_written: true,
    };
    let all = drawn(driver.point(), &row).into_iter();
    all.map(|value| value.unwrap_or(f64::NAN)).collect()
}

/// Their rates. All of them are linear in a state but for the mobilised friction.
fn rates_of_values(driver: &Driver, state: &State, rate: &State) -> Vec<f64> {
    let mut rates = values(driver, rate);
    let names = drawable(driver.point());
    if let Some(place) = names.iter().position(|name| name == "mu")
        && place >= state.gradient.len() + state.flux.len() + state.internal.len()
    {
        let (normal, normal_rate) = (state.flux[0], rate.flux[0]);
        let shear = state.flux[1..].iter().map(|t| t * t).sum::<f64>().sqrt();
        let pairs = state.flux[1..].iter().zip(&rate.flux[1..]);
        // In the plane friction has a sign.
        let (shear, shear_rate) = if state.flux.len() == 2 {
            (state.flux[1], rate.flux[1])
        } else {
            (shear, pairs.map(|(t, rate)| t * rate).sum::<f64>() / shear)
        };
        // μ = τ/(−t_n).
        rates[place] = -shear_rate / normal + shear * normal_rate / (normal * normal);
    }
    rates
}

/// Rates at the end of an increment, from those at its start.
fn over_increment(
    probe: &Probe,
    [before, after]: [&State; 2],
    rates: &State,
    goals: &[Goal],
    direction: &[f64],
) -> Option<State> {
    let n = goals.len();
    let start = PointStart {
        gradient0: before.gradient.clone(),
        gradient1: after.gradient.clone(),
        flux0: before.flux.clone(),
        state0: before.internal.clone(),
    };
    let given = PointRates {
        gradient0: rates.gradient.clone(),
        gradient1: vec![0.0; n],
        flux0: rates.flux.clone(),
        state0: rates.internal.clone(),
    };
    let (answer, own) = probe
        .rates(std::slice::from_ref(&start), &[given], direction)
        .ok()?;
    let points = answer.points.first();
    let end = points.filter(|end| end.status == raw::PILUM_OK)?;
    if !is_same(&end.flux, &after.flux) || !is_same(&end.state, &after.internal) {
        return None;
    }
    let (mut flux, mut internal) = own.into_iter().next()?;
    let by_gradient = by_gradient(probe, &start, n, &vec![0.0; direction.len()])?;
    let gradient = gradient_rate(goals, &flux, &by_gradient)?;
    for (rate, (by_flux, by_internal)) in gradient.iter().zip(&by_gradient) {
        let fluxes = flux.iter_mut().zip(by_flux);
        let internals = internal.iter_mut().zip(by_internal);
        fluxes
            .chain(internals)
            .for_each(|(sum, by)| *sum += rate * by);
    }
    Some(State {
        gradient,
        flux,
        internal,
        time: 0.0,
    })
}

/// Rates of all states for a direction of the parameters.
fn along(
    probe: &Probe,
    driver: &Driver,
    states: &[State],
    direction: &[f64],
) -> Option<Vec<State>> {
    let n = driver.point().law().n_components();
    let mut rates = vec![start(probe, driver, &states[0], direction)?];
    let mut held = vec![0.0; n];
    let mut k = 0;
    for segment in driver.point().segments() {
        let (first_gradient, first_flux) = (rates[k].gradient.clone(), held.clone());
        for increment in 1..=segment.increments {
            let part = increment as f64 / segment.increments as f64;
            let goals = (0..n).map(|i| goal(segment, i, part, first_gradient[i], first_flux[i]));
            let goals: Vec<Goal> = goals.collect();
            let ends = [&states[k], &states[k + 1]];
            rates.push(over_increment(probe, ends, &rates[k], &goals, direction)?);
            k += 1;
        }
        for (i, held) in held.iter_mut().enumerate() {
            *held = match segment.control[i] {
                Control::Flux(_) => 0.0,
                Control::Keep | Control::FluxBy(_) => *held,
                _ => rates[k].flux[i],
            };
        }
    }
    Some(rates)
}

/// The rate of the initial state: of the internal variables that the law gives it.
fn start(probe: &Probe, driver: &Driver, state: &State, direction: &[f64]) -> Option<State> {
    let n = state.flux.len();
    let mut internal = vec![0.0; state.internal.len()];
    let start = PointStart {
        gradient0: Vec::new(),
        gradient1: Vec::new(),
        flux0: state.flux.clone(),
        state0: Vec::new(),
    };
    let given = PointRates {
        gradient0: vec![0.0; n],
        gradient1: vec![0.0; n],
        flux0: vec![0.0; n],
        state0: internal.clone(),
    };
    let answer = probe
        .initial_rates(std::slice::from_ref(&start), &[given], direction)
        .ok()?;
    if let Some((answer, mut rates)) = answer {
        let end = answer
            .points
            .first()
            .filter(|end| end.status == raw::PILUM_OK)?;
        let rates = rates.pop()?.1;
        let given = driver.point().internal();
        for (i, rate) in rates.into_iter().enumerate() {
            // One that the file gives does not change with the law's.
            if (end.state[i] - given[i]).abs() <= SAME * given[i].abs() {
                internal[i] = rate;
            }
        }
    }
    Some(State {
        gradient: vec![0.0; n],
        flux: vec![0.0; n],
        internal,
        time: 0.0,
    })
}

/// Derivatives of flux and internal variables by each component of the gradient at the end.
fn by_gradient(
    probe: &Probe,
    start: &PointStart,
    n: usize,
    nothing: &[f64],
) -> Option<Vec<(Vec<f64>, Vec<f64>)>> {
    let unit = |j: usize| PointRates {
        gradient0: vec![0.0; n],
        gradient1: (0..n).map(|i| f64::from(u8::from(i == j))).collect(),
        flux0: vec![0.0; n],
        state0: vec![0.0; start.state0.len()],
    };
    let starts: Vec<PointStart> = (0..n).map(|_| start.clone()).collect();
    let units: Vec<PointRates> = (0..n).map(unit).collect();
    let (_, rates) = probe.rates(&starts, &units, nothing).ok()?;
    (rates.len() == n).then_some(rates)
}

/// Known rates of a component at the end of an increment.
#[derive(Clone, Copy, Debug)]
enum Goal {
    /// That of the gradient.
    Gradient(f64),
    /// That of the flux plus stiffness times gradient.
    Flux { rate: f64, stiffness: f64 },
}

/// From the segment's control, at this part of it; `gradient` and `flux` are rates where it starts.
fn goal(segment: &Segment, component: usize, part: f64, gradient: f64, flux: f64) -> Goal {
    let led = |rate| Goal::Flux {
        rate,
        stiffness: 0.0,
    };
    match segment.control[component] {
        Control::Gradient(_) => Goal::Gradient(gradient * (1.0 - part)),
        Control::GradientBy(_) => Goal::Gradient(gradient),
        Control::Keep | Control::FluxBy(_) => led(flux),
        Control::Flux(_) => led(flux * (1.0 - part)),
        Control::Stiffness(stiffness) => Goal::Flux {
            rate: flux + stiffness * gradient,
            stiffness,
        },
    }
}

/// Rates of the gradient that lead to the goals: `flux` is what the flux does without them.
fn gradient_rate(
    goals: &[Goal],
    flux: &[f64],
    by_gradient: &[(Vec<f64>, Vec<f64>)],
) -> Option<Vec<f64>> {
    let n = goals.len();
    let matrix = DMatrix::from_fn(n, n, |i, j| {
        let unit = f64::from(u8::from(i == j));
        match goals[i] {
            Goal::Gradient(_) => unit,
            Goal::Flux { stiffness, .. } => by_gradient[j].0[i] + stiffness * unit,
        }
    });
    let right = DVector::from_fn(n, |i, _| match goals[i] {
        Goal::Gradient(rate) => rate,
        Goal::Flux { rate, .. } => rate - flux[i],
    });
    let solved = matrix.lu().solve(&right)?;
    solved
        .iter()
        .all(|v| v.is_finite())
        .then(|| solved.iter().copied().collect())
}

fn is_same(a: &[f64], b: &[f64]) -> bool {
    let scale = b.iter().fold(0.0_f64, |scale, v| scale.max(v.abs()));
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME * scale)
}
