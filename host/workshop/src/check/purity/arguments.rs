//! Does a result depend on what is asked for next to it, or on when it is?

use super::{Called, UPDATE, compare};
use crate::check::margins;
use crate::check::random::Random;
use crate::check::specimen::{Function, first_difference, is_success};
use crate::check::{Found, Subject, Verdict};
use abi::raw;
use law::probe::{Form, PointEnd, PointStart};

pub(super) fn independent_of_request(subject: &Subject) -> Found {
    let forms: [(u32, u64); 4] = [
        (raw::PILUM_REQ_FLUX, 0),
        (raw::PILUM_REQ_FLUX | raw::PILUM_REQ_ELASTIC, 0),
        (UPDATE, 1),
        (UPDATE, 1 << 40),
    ];
    let mut rounded: Option<Verdict> = None;
    for (request, first_point) in forms {
        compare(subject, "request", |called, points, _| {
            let form = Form {
                first_point,
                ..called.specimen.form(request)
            };
            let expected = called.update(points)?;
            let mut ends = called.specimen.ask(called.function, points, &form)?;
            for ((end, expected), point) in ends.iter_mut().zip(expected).zip(points) {
                let last_bits = called.function == Function::Integrate && first_point == 0;
                if let (true, Some(by)) = (last_bits, rounding(point, end, &expected)) {
                    if by > 0.0 {
                        let verdict = Verdict::Warning(format!(
                            "{}: without the consistent tangent the flux {:?} is {:?}, {by:.0} units of \
                             rounding apart: are there two versions of the update? At {}",
                            called.specimen.name(),
                            expected.flux,
                            end.flux,
                            called.specimen.at(point)
                        ));
                        rounded.get_or_insert_with(|| called.specimen.recorded(point, verdict));
                    }
                    *end = expected;
                } else {
                    end.tangent = expected.tangent;
                }
            }
            Ok(ends)
        })?;
    }
    rounded.map_or(Ok(String::new()), Err)
}

/// The most units of rounding, of the terms in play, that two versions of one update may be apart.
const ROUNDINGS: f64 = 16384.0;

/// How many units of rounding two results are apart, if no more than that; none if they succeed not
/// both.
fn rounding(start: &PointStart, a: &PointEnd, b: &PointEnd) -> Option<f64> {
    if !(is_success(a.status) && a.status == b.status) {
        return None;
    }
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    let moved = start.gradient1.iter().zip(&start.gradient0);
    let moved = moved.fold(0.0_f64, |most, (end, begin)| most.max((end - begin).abs()));
    // `b` has the tangent.
    let flux = largest(&start.flux0)
        .max(largest(&b.flux))
        .max(largest(&b.tangent) * moved);
    let apart = |a: f64, b: f64, scale: f64| {
        if a.to_bits() == b.to_bits() {
            0.0
        } else {
            (a - b).abs() / (f64::EPSILON * scale)
        }
    };
    let fluxes = a.flux.iter().zip(&b.flux).map(|(a, b)| apart(*a, *b, flux));
    let states = a.state.iter().zip(&b.state).zip(&start.state0);
    let states = states.map(|((a, b), begin)| {
        let scale = a.abs().max(b.abs()).max(begin.abs()).max(moved);
        apart(*a, *b, scale)
    });
    let all: Vec<f64> = fluxes.chain(states).collect();
    let most = all.iter().copied().fold(0.0, f64::max);
    margins::note("rounding", most / ROUNDINGS);
    (all.iter().all(|by| *by <= ROUNDINGS)).then_some(most)
}

/// Times at which an increment may begin, and lengths of it.
const TIMES: [f64; 2] = [0.125, 1e5];
const LENGTHS: [f64; 3] = [0.0, 1e-3, 1e4];

pub(super) fn independent_of_time(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "time");
    let mut n = 0;
    for specimen in &subject.specimens(3, &mut random)? {
        let points = specimen.points(48, &mut random)?;
        let parameters = specimen.law.description().parameters.iter();
        let variables = specimen.formulation.internal_variables.iter();
        let mut units = parameters
            .map(|p| &p.unit)
            .chain(variables.map(|v| &v.unit));
        let may_depend = units.any(|unit| has_time(unit));
        for function in Function::BOTH {
            let called = Called { specimen, function };
            let ordinary = specimen.form(UPDATE);
            let expected = called.update(&points)?;
            let began = TIMES.map(|time| (format!("at time {time}"), Form { time, ..ordinary }));
            let lengths = LENGTHS.map(|time_increment| {
                let form = Form {
                    time_increment,
                    ..ordinary
                };
                (format!("over a time of {time_increment}"), form)
            });
            let lengths = lengths.into_iter().filter(|_| !may_depend);
            for (when, form) in began.into_iter().chain(lengths) {
                let found = specimen.ask(function, &points, &form)?;
                n += found.len();
                let Some(i) = first_difference(&expected, &found) else {
                    continue;
                };
                let why = format!(
                    "{}: `{}` gives flux {:?} and internal variables {:?}, {when} {:?} and {:?}, \
                     at {}; a law that depends on how long an increment takes has a parameter with \
                     a unit of time",
                    specimen.name(),
                    function.name(),
                    expected[i].flux,
                    expected[i].state,
                    found[i].flux,
                    found[i].state,
                    specimen.at(&points[i])
                );
                return Err(specimen.recorded(&points[i], Verdict::Warning(why)));
            }
        }
    }
    Ok(format!("{n} points"))
}

/// Whether a unit has one of time in it.
fn has_time(unit: &str) -> bool {
    unit.split(['/', '·', '*', ' '])
        .filter_map(|factor| factor.split('^').next())
        .any(|name| ["s", "h", "d"].contains(&name))
}
