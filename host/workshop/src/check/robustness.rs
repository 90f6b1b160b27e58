//! Does a law survive what no law should be given?

use super::draw::Draw;
use super::points::{UPDATE, first_difference, increment, is_finite, is_success};
use super::{Check, Found, Subject, status_name};
use abi::raw;
use abi::status::Outcome;
use law::probe::{Answer, PointStart};

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "bad-numbers-are-refused",
        description: "NaN or an infinity in any input gives PILUM_E_NUMERIC.",
        needs: &["results-are-finite", "writes-stay-inside"],
        run: bad_numbers_are_refused,
    },
    Check {
        id: "failing-points-stay-alone",
        description: "A failing point changes no bit of the others.",
        needs: &["independent-of-split", "bad-numbers-are-refused"],
        run: failing_points_stay_alone,
    },
    Check {
        id: "huge-steps-end-well",
        description: "Increments up to 10¹² times the elastic limit succeed with finite results, \
                      ask for a smaller step or fail with a message; a step factor is NaN or in \
                      (0, 1).",
        needs: &["results-are-finite", "writes-stay-inside"],
        run: huge_steps_end_well,
    },
];

fn bad_numbers_are_refused(subject: &Subject) -> Found {
    type Input = fn(&mut PointStart) -> &mut Vec<f64>;
    let inputs: [(&str, Input); 4] = [
        ("gradient0", |p| &mut p.gradient0),
        ("gradient1", |p| &mut p.gradient1),
        ("flux0", |p| &mut p.flux0),
        ("state0", |p| &mut p.state0),
    ];
    let n = subject.each(Draw::Any, "bad numbers", 1, |specimen, random| {
        let points = specimen.points(2, random)?;
        let mut n = 0;
        for (input, values) in inputs {
            for c in 0..values(&mut points[0].clone()).len() {
                for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                    let mut broken = points[0].clone();
                    values(&mut broken)[c] = bad;
                    let answer = specimen.call(&[broken], UPDATE)?;
                    if Outcome::from_code(answer.status) != Outcome::Numeric {
                        return Err(specimen.fails(format_args!(
                            "{bad} as component {c} of `{input}` gave {}",
                            status_name(answer.status)
                        )));
                    }
                    n += 1;
                }
            }
        }
        Ok(n)
    })?;
    Ok(format!("{n} numbers"))
}

fn failing_points_stay_alone(subject: &Subject) -> Found {
    subject.each(Draw::Any, "failing", 1, |specimen, random| {
        let points = specimen.points(9, random)?;
        let expected = specimen.call(&points, UPDATE)?.points;
        for at in 0..points.len() {
            let mut some = points.clone();
            some[at].gradient1[0] = f64::NAN;
            let mut found = specimen.call(&some, UPDATE)?.points;
            if found[at].status != raw::PILUM_E_NUMERIC {
                return Err(specimen.fails(format_args!(
                    "point {at} is not finite, its outcome is {}",
                    status_name(found[at].status)
                )));
            }
            found[at] = expected[at].clone();
            if let Some(i) = first_difference(&expected, &found) {
                let why = format!("where point {at} fails, point {i} differs");
                return Err(specimen.fails(why));
            }
        }
        Ok(0)
    })?;
    Ok(String::new())
}

fn huge_steps_end_well(subject: &Subject) -> Found {
    let mut n_successes = 0;
    let n = subject.each(Draw::Any, "huge", 4, |specimen, random| {
        let points = specimen.points(48, random)?;
        for point in &points {
            let factor = random.logarithmic(10.0, 1e12);
            let mut huge = point.clone();
            for (c, moved) in increment(point).iter().enumerate() {
                huge.gradient1[c] = point.gradient0[c] + factor * moved;
            }
            let answer = specimen.call(std::slice::from_ref(&huge), UPDATE)?;
            if let Some(why) = ends_badly(&answer) {
                let why = format!("{why}, for {}", specimen.at(&huge));
                return Err(specimen.fails_for(&huge, why));
            }
            n_successes += usize::from(is_success(answer.points[0].status));
        }
        Ok(points.len())
    })?;
    Ok(format!("{n_successes} of {n} steps succeeded"))
}

/// Fault of the answer to a call for one point, if it has one.
fn ends_badly(answer: &Answer) -> Option<String> {
    let end = &answer.points[0];
    match Outcome::from_code(end.status) {
        Outcome::Ok | Outcome::Unreliable => {
            (!is_finite(end)).then(|| "results are not finite".to_owned())
        }
        Outcome::CutStep | Outcome::Domain | Outcome::Numeric
            if answer.text().is_none_or(|text| text.is_empty()) =>
        {
            Some("it fails without a message".to_owned())
        }
        Outcome::CutStep if end.step_factor <= 0.0 || end.step_factor >= 1.0 => {
            Some(format!("the step factor is {}", end.step_factor))
        }
        Outcome::CutStep | Outcome::Domain | Outcome::Numeric => None,
        _ => Some(format!("the outcome is {}", status_name(end.status))),
    }
}
