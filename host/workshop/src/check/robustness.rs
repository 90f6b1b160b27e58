//! Does a law survive what no law should be given?

use super::random::Random;
use super::specimen::{first_difference, is_finite, is_success};
use super::{Check, Family, Found, Subject, status_name};
use abi::raw;
use abi::status::Outcome;
use law::probe::PointStart;

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "bad-numbers-are-refused",
        family: Family::Robustness,
        description: "NaN or an infinity in any input gives PILUM_E_NUMERIC.",
        needs: &["results-are-finite", "writes-stay-inside"],
        run: bad_numbers_are_refused,
    },
    Check {
        id: "failing-points-stay-alone",
        family: Family::Robustness,
        description: "A failing point changes no bit of the others.",
        needs: &["independent-of-split", "bad-numbers-are-refused"],
        run: failing_points_stay_alone,
    },
    Check {
        id: "huge-steps-end-well",
        family: Family::Robustness,
        description: "Increments up to 10¹² times the elastic limit succeed with finite results, \
                      ask for a smaller step or fail with a message; a step factor is NaN or in \
                      (0, 1).",
        needs: &["results-are-finite", "writes-stay-inside"],
        run: huge_steps_end_well,
    },
];

const UPDATE: u32 = raw::PILUM_REQ_FLUX | raw::PILUM_REQ_TANGENT;

fn bad_numbers_are_refused(subject: &Subject) -> Found {
    type Input = fn(&mut PointStart) -> &mut Vec<f64>;
    let inputs: [(&str, Input); 4] = [
        ("gradient0", |p| &mut p.gradient0),
        ("gradient1", |p| &mut p.gradient1),
        ("flux0", |p| &mut p.flux0),
        ("state0", |p| &mut p.state0),
    ];
    let mut random = Random::new(subject.seed, "bad numbers");
    let mut n = 0;
    for specimen in subject.specimens(1, &mut random)? {
        let points = specimen.points(2, &mut random)?;
        for (input, values) in inputs {
            let length = values(&mut points[0].clone()).len();
            for c in 0..length {
                for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                    let mut broken = points[0].clone();
                    values(&mut broken)[c] = bad;
                    let answer = specimen.call(&[broken], UPDATE)?;
                    if Outcome::from_code(answer.status) != Outcome::Numeric {
                        return Err(specimen.fails(format!(
                            "{bad} as component {c} of `{input}` gave {}",
                            status_name(answer.status)
                        )));
                    }
                    n += 1;
                }
            }
        }
    }
    Ok(format!("{n} numbers"))
}

fn failing_points_stay_alone(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "failing");
    for specimen in subject.specimens(1, &mut random)? {
        let points = specimen.points(9, &mut random)?;
        let expected = specimen.call(&points, UPDATE)?.points;
        for at in 0..points.len() {
            let mut some = points.clone();
            some[at].gradient1[0] = f64::NAN;
            let mut found = specimen.call(&some, UPDATE)?.points;
            if found[at].status != raw::PILUM_E_NUMERIC {
                return Err(specimen.fails(format!(
                    "point {at} is not finite, its outcome is {}",
                    status_name(found[at].status)
                )));
            }
            found[at] = expected[at].clone();
            if let Some(i) = first_difference(&expected, &found) {
                return Err(specimen.fails(format!("where point {at} fails, point {i} differs")));
            }
        }
    }
    Ok(String::new())
}

fn huge_steps_end_well(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "huge");
    let (mut n_successes, mut n) = (0, 0);
    for specimen in subject.specimens(4, &mut random)? {
        for point in specimen.points(48, &mut random)? {
            let factor = random.logarithmic(10.0, 1e12);
            let mut huge = point.clone();
            for c in 0..huge.gradient1.len() {
                let increment = point.gradient1[c] - point.gradient0[c];
                huge.gradient1[c] = point.gradient0[c] + factor * increment;
            }
            let answer = specimen.call(std::slice::from_ref(&huge), UPDATE)?;
            let end = &answer.points[0];
            n += 1;
            let why = match Outcome::from_code(end.status) {
                Outcome::Ok | Outcome::Unreliable if is_finite(end) => {
                    n_successes += usize::from(is_success(end.status));
                    None
                }
                Outcome::Ok | Outcome::Unreliable => Some("results are not finite".to_owned()),
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
            };
            if let Some(why) = why {
                let why = format!("{why}, for {}", specimen.at(&huge));
                return Err(specimen.fails_at(&huge, why));
            }
        }
    }
    Ok(format!("{n_successes} of {n} steps succeeded"))
}
