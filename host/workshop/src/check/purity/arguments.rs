//! Does a result depend on what is asked for next to it, or on when it is?

use super::{Called, compare};
use crate::check::description::SEPARATORS;
use crate::check::draw::Draw;
use crate::check::margins;
use crate::check::points::{ELASTIC, UPDATE, first_difference, increment, is_success, largest};
use crate::check::specimen::{BOTH, name};
use crate::check::{Found, Subject, Verdict};
use abi::raw;
use law::probe::call_log::Function;
use law::probe::{Form, PointEnd, PointStart};

pub(super) fn independent_of_request(subject: &Subject) -> Found {
    let forms = [
        (raw::PILUM_REQ_FLUX, 0),
        (ELASTIC, 0),
        (UPDATE, 1),
        (UPDATE, 1 << 40),
    ];
    let mut rounded: Option<Verdict> = None;
    for (request, first_point) in forms {
        compare(subject, "request", |called, points, _| {
            let specimen = called.specimen;
            let form = Form {
                first_point,
                ..specimen.form(request)
            };
            let expected = called.update(points)?;
            let mut ends = called.ask(points, &form)?;
            let may_be_rounded = called.function == Function::Integrate && first_point == 0;
            for ((end, expected), point) in ends.iter_mut().zip(expected).zip(points) {
                let Some(by) = rounding(point, end, &expected).filter(|_| may_be_rounded) else {
                    end.tangent = expected.tangent;
                    continue;
                };
                if by > 0.0 {
                    rounded.get_or_insert_with(|| {
                        let why = format!(
                            "without the consistent tangent the flux {:?} is {:?}, {by:.0} units of \
                             rounding apart: are there two versions of the update? At {}",
                            expected.flux,
                            end.flux,
                            specimen.at(point)
                        );
                        specimen.warns_for(point, why)
                    });
                }
                *end = expected;
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
    let moved = largest(&increment(start));
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
    let most = largest(&all);
    margins::note("rounding", most / ROUNDINGS);
    (all.iter().all(|by| *by <= ROUNDINGS)).then_some(most)
}

/// Times at which an increment may begin, and lengths of it.
const TIMES: [f64; 2] = [0.125, 1e5];
const LENGTHS: [f64; 3] = [0.0, 1e-3, 1e4];

pub(super) fn independent_of_time(subject: &Subject) -> Found {
    let n = subject.each(Draw::Any, "time", 3, |specimen, random| {
        let points = specimen.points(48, random)?;
        let parameters = specimen.law.description().parameters.iter();
        let variables = specimen.formulation.internal_variables.iter();
        let units = parameters.map(|p| &p.unit);
        let mut units = units.chain(variables.map(|v| &v.unit));
        let may_depend = units.any(|unit| has_time(unit));
        let ordinary = specimen.form(UPDATE);
        let began = TIMES.map(|time| (format!("at time {time}"), Form { time, ..ordinary }));
        let lengths = LENGTHS.map(|time_increment| {
            let form = Form {
                time_increment,
                ..ordinary
            };
            (format!("over a time of {time_increment}"), form)
        });
        let lengths = lengths.into_iter().filter(|_| !may_depend);
        let forms: Vec<(String, Form)> = began.into_iter().chain(lengths).collect();
        let mut n = 0;
        for function in BOTH {
            let called = Called { specimen, function };
            let expected = called.update(&points)?;
            for (when, form) in &forms {
                let found = called.ask(&points, form)?;
                n += found.len();
                let Some(i) = first_difference(&expected, &found) else {
                    continue;
                };
                let why = format!(
                    "`{}` gives flux {:?} and internal variables {:?}, {when} {:?} and {:?}, \
                     at {}; a law that depends on how long an increment takes has a parameter with \
                     a unit of time",
                    name(function),
                    expected[i].flux,
                    expected[i].state,
                    found[i].flux,
                    found[i].state,
                    specimen.at(&points[i])
                );
                return Err(specimen.warns_for(&points[i], why));
            }
        }
        Ok(n)
    })?;
    Ok(format!("{n} points"))
}

/// Whether a unit has one of time in it.
fn has_time(unit: &str) -> bool {
    unit.split(SEPARATORS)
        .filter_map(|factor| factor.split('^').next())
        .any(|name| ["s", "h", "d"].contains(&name))
}
