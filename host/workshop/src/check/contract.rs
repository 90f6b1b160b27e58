//! Do the functions answer as the contract says, to the host's mistakes too?

use super::draw::{Draw, draw_all};
use super::loading_path::Refused;
use super::points::{UPDATE, first_difference};
use super::random::Random;
use super::specimen::{Specimen, create_form, hypotheses};
use super::verdict::Outcome::{Failed, Skipped};
use super::{Check, Found, Subject, Verdict, author_path, failed, refusal, skipped, status_name};
use abi::raw;
use abi::status::{Outcome, most_severe};
use abi::version::BATCH_SIZE_1_0;
use law::probe::{Answer, BATCH_BYTES, CreateForm, Created, Form, NO_OUTCOME, Order, PointStart};
use law::{LoadedLaw, ParameterDescription};

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "create-works",
        description: "`create` accepts ordinary parameters for every hypothesis; `destroy` frees \
                      the instance and accepts null.",
        needs: &["description-is-readable"],
        run: create_works,
    },
    Check {
        id: "wrong-arguments-are-refused",
        description: "`create` refuses a wrong number of values, values at null and an unknown \
                      formulation with PILUM_E_ARGUMENT, a message, and no instance.",
        needs: &["create-works"],
        run: wrong_arguments_are_refused,
    },
    Check {
        id: "bounds-are-kept",
        description: "`create` refuses values just outside each bound, NaN and infinities with \
                      PILUM_E_PARAMETER and a message that starts with the parameter's id.",
        needs: &["create-works"],
        run: bounds_are_kept,
    },
    Check {
        id: "initial-states-are-written",
        description: "If `init_state` succeeds, it has written an outcome and all internal \
                      variables, finite, of every point.",
        needs: &["create-works"],
        run: initial_states_are_written,
    },
    Check {
        id: "integrate-works",
        description: "`integrate` and `init_state` return in time, write an outcome for every \
                      point and report no defect; some increments succeed.",
        needs: &["initial-states-are-written"],
        run: integrate_works,
    },
    Check {
        id: "unknown-requests-are-refused",
        description: "An unknown request, or one of rates to a law without them, is refused with \
                      PILUM_E_UNSUPPORTED, without outcomes.",
        needs: &["integrate-works"],
        run: unknown_requests_are_refused,
    },
    Check {
        id: "missing-tangent-is-refused",
        description: "With PILUM_T_NO_TANGENT a request of the consistent tangent gives \
                      PILUM_E_UNSUPPORTED.",
        needs: &["integrate-works"],
        run: missing_tangent_is_refused,
    },
    Check {
        id: "empty-batch-is-accepted",
        description: "A batch without points succeeds.",
        needs: &["integrate-works"],
        run: empty_batch_is_accepted,
    },
    Check {
        id: "null-outcomes-are-accepted",
        description: "Without `status`, `step_factor` and `message`, results have the same bits.",
        needs: &["repeatable"],
        run: null_outcomes_are_accepted,
    },
    Check {
        id: "messages-fit",
        description: "A failure writes a message that ends in NUL within its buffer of 512, 16, \
                      2, 1 or 0 bytes, and has the number of the point.",
        needs: &["integrate-works"],
        run: messages_fit,
    },
    Check {
        id: "longer-structs-are-accepted",
        description: "A host of a later minor version, whose batch and description have 64 \
                      unknown bytes at their ends, gets the same bits.",
        needs: &["repeatable"],
        run: longer_structs_are_accepted,
    },
    Check {
        id: "shorter-batch-is-refused",
        description: "A batch shorter than in version 1.0 is refused with PILUM_E_ARGUMENT; \
                      forbidden memory follows its last byte.",
        needs: &["integrate-works"],
        run: shorter_batch_is_refused,
    },
];

fn create_works(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "create");
    let specimens = subject.specimens(Draw::Any, 2, &mut random)?;
    for law in subject.laws()? {
        law.destroy_nothing();
    }
    let sets: Vec<String> = specimens.iter().step_by(2).map(Specimen::name).collect();
    Ok(sets.join("; "))
}

/// The answer to parameters that must be refused.
fn must_refuse(
    law: &LoadedLaw,
    what: &str,
    created: &Created,
    expected: raw::Status,
) -> Result<String, Verdict> {
    let fault = |why: &str| failed(format!("`{}`: {what}: {why}", law.description().id));
    if created.status != expected {
        let (found, expected) = (status_name(created.status), status_name(expected));
        let why = format!("`create` returned {found}, expected {expected}");
        return Err(fault(&why));
    }
    if created.probe.is_some() {
        return Err(fault("`out` is written all the same"));
    }
    let text = created.text().filter(|text| !text.is_empty());
    text.ok_or_else(|| fault("there is no message"))
}

/// Whether `create` refuses such arguments, with a message and without room for one.
fn is_refused(law: &LoadedLaw, what: &str, form: &CreateForm<'_>) -> Result<(), Verdict> {
    must_refuse(law, what, &law.probe(form)?, raw::PILUM_E_ARGUMENT)?;
    let mute = law.probe(&CreateForm {
        message: None,
        ..*form
    })?;
    if mute.status == raw::PILUM_E_ARGUMENT {
        return Ok(());
    }
    Err(failed(format!(
        "`{}`: {what}, without a message: `create` returned {}",
        law.description().id,
        status_name(mute.status)
    )))
}

fn wrong_arguments_are_refused(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "arguments");
    for law in subject.laws()? {
        for (formulation, hypothesis) in hypotheses(&law) {
            let values = draw_all(subject, &law, &mut random, Draw::Ordinary);
            let right = create_form(&formulation, hypothesis, &values);
            let more: Vec<f64> = values.iter().copied().chain([1.0]).collect();
            let fewer = values.split_last().map(|(_, fewer)| fewer);
            let wrong = [
                (
                    "formulation 4294967295",
                    Some(CreateForm {
                        formulation: u32::MAX,
                        ..right
                    }),
                ),
                (
                    "a value too many",
                    Some(CreateForm {
                        values: Some(&more),
                        n_values: more.len(),
                        ..right
                    }),
                ),
                (
                    "a value too few",
                    fewer.map(|fewer| CreateForm {
                        values: Some(fewer),
                        n_values: fewer.len(),
                        ..right
                    }),
                ),
                (
                    "values at null",
                    fewer.map(|_| CreateForm {
                        values: None,
                        ..right
                    }),
                ),
            ];
            for (what, form) in wrong {
                let Some(form) = form else { continue };
                is_refused(&law, what, &form)?;
            }
        }
    }
    Ok(String::new())
}

/// Values of a parameter that are just outside its bounds or no numbers, and those at the bounds.
fn around_bounds(p: &ParameterDescription) -> [Vec<f64>; 2] {
    let b = p.bounds;
    let mut outside = vec![f64::INFINITY, f64::NEG_INFINITY];
    if !p.optional {
        outside.push(f64::NAN);
    }
    let mut at = Vec::new();
    for (bound, is_open, beyond, within) in [
        (
            b.lower,
            b.open_lower,
            b.lower.next_down(),
            b.lower.next_up(),
        ),
        (
            b.upper,
            b.open_upper,
            b.upper.next_up(),
            b.upper.next_down(),
        ),
    ] {
        if bound.is_finite() {
            outside.push(if is_open { bound } else { beyond });
            at.push(if is_open { within } else { bound });
        }
    }
    if !p.choices.is_empty() {
        outside.extend([-1.0, 0.5, p.choices.len() as f64]);
    }
    [outside, at]
}

fn bounds_are_kept(subject: &Subject) -> Found {
    let n = subject.each(Draw::Any, "bounds", 1, |specimen, _| {
        let law = &specimen.law;
        let mut n = 0;
        for (i, p) in law.description().parameters.iter().enumerate() {
            let create = |value: f64| {
                let mut values = specimen.values.clone();
                values[i] = value;
                law.probe(&create_form(
                    &specimen.formulation,
                    specimen.hypothesis,
                    &values,
                ))
            };
            let [outside, at] = around_bounds(p);
            n += outside.len() + at.len();
            for value in outside {
                let what = format!("{} = {value:e}, bounds {}", p.id, p.bounds);
                let text = must_refuse(law, &what, &create(value)?, raw::PILUM_E_PARAMETER)?;
                if text.split_once(':').is_none_or(|(id, _)| id.trim() != p.id) {
                    return Err(failed(format!(
                        "`{}`: {what}: the message `{text}` does not start with `{}:`",
                        law.description().id,
                        p.id
                    )));
                }
            }
            for value in at {
                let created = create(value)?;
                if created.status != raw::PILUM_OK {
                    let what = format!("{} = {value:e}", p.id);
                    must_refuse(law, &what, &created, raw::PILUM_E_PARAMETER)?;
                }
            }
        }
        Ok(n)
    })?;
    Ok(format!("{n} values"))
}

fn initial_states_are_written(subject: &Subject) -> Found {
    let n = subject.each(Draw::Any, "initial states", 2, |specimen, random| {
        let mut n_points = 0;
        // One point without any flux, and so many under pressure.
        for n in [0, 1, 2, 5, 16, 33] {
            let pressures = (0..n).map(|_| random.logarithmic(1.0, 1000.0));
            let mut fluxes: Vec<Vec<f64>> = pressures.map(|p| specimen.under_pressure(p)).collect();
            if n == 0 {
                fluxes.push(specimen.under_pressure(0.0));
            }
            for order in [Order::Points, Order::Components, Order::Spread] {
                let form = Form {
                    order,
                    ..Form::of(0)
                };
                let Some(answer) = specimen.probe.init_state(&fluxes, &form)? else {
                    continue;
                };
                n_points += answer.points.len();
                if let Some((i, what)) = unwritten(specimen, &answer) {
                    let why = format!(
                        "`init_state`, point {i} of {}, flux {:?}: {what}",
                        fluxes.len(),
                        fluxes[i]
                    );
                    return Err(specimen.fails_to_start(&fluxes, &form, &[], why));
                }
            }
        }
        Ok(n_points)
    })?;
    Ok(if n == 0 {
        // No reason to skip what builds on this.
        "no law has `init_state`".to_owned()
    } else {
        format!("{n} points")
    })
}

/// The first point with something that `init_state` has not written, and what that is.
fn unwritten(specimen: &Specimen, answer: &Answer) -> Option<(usize, String)> {
    let mut points = answer.points.iter().enumerate();
    points.find_map(|(i, end)| {
        if end.status == NO_OUTCOME && answer.status != raw::PILUM_E_ARGUMENT {
            return Some((i, "there is no outcome".to_owned()));
        }
        let k = end.state.iter().position(|value| !value.is_finite())?;
        let id = &specimen.formulation.internal_variables[k].id;
        (end.status == raw::PILUM_OK).then(|| (i, format!("`{id}` is not written, or not finite")))
    })
}

fn integrate_works(subject: &Subject) -> Found {
    author_path::is_followed(subject)?;
    let mut n_successes = 0;
    let n = subject.each(Draw::Any, "integrate", 2, |specimen, random| {
        let walk = specimen.walk(12, random).map_err(|mut verdict| {
            // A law that starts nowhere does not work.
            if verdict.outcome == Skipped {
                verdict.outcome = Failed;
            }
            verdict
        })?;
        for Refused { status, text, .. } in &walk.refusals {
            let expected = matches!(
                Outcome::from_code(*status),
                Outcome::CutStep | Outcome::Domain | Outcome::Numeric
            );
            if !expected {
                let why = refusal(*status, Some(text));
                return Err(specimen.fails(format_args!("a small step gave {why}")));
            }
        }
        if walk.successes.is_empty() {
            return Err(specimen.fails(format_args!("no step succeeded: {}", walk.why())));
        }
        n_successes += walk.successes.len();
        // One call that is looked at as a whole.
        let points = specimen.points(7, random)?;
        let answer = specimen.call(&points, raw::PILUM_REQ_FLUX)?;
        let statuses = answer.points.iter().map(|end| end.status);
        let worst = statuses.fold(raw::PILUM_OK, most_severe);
        if worst != answer.status {
            return Err(specimen.fails(format_args!(
                "the call returned {}, its most severe outcome is {}",
                status_name(answer.status),
                status_name(worst)
            )));
        }
        Ok(walk.successes.len() + walk.refusals.len())
    })?;
    Ok(format!("{n_successes} of {n} steps succeeded"))
}

/// Looks at every law under every hypothesis with ordinary parameters, and at some points that it follows.
fn each_with_points(
    subject: &Subject,
    name: &str,
    n_points: usize,
    mut look: impl FnMut(&Specimen, Vec<PointStart>) -> Result<(), Verdict>,
) -> Found {
    subject.each(Draw::Any, name, 1, |specimen, random| {
        look(specimen, specimen.points(n_points, random)?)?;
        Ok(0)
    })?;
    Ok(String::new())
}

fn unknown_requests_are_refused(subject: &Subject) -> Found {
    each_with_points(subject, "requests", 3, |specimen, points| {
        // A law knows of rates, and may refuse them as unknown or as what it does not offer.
        let rates = (!specimen.formulation.rates).then_some(3);
        for bit in rates.into_iter().chain([4, 17, 31]) {
            let answer = specimen.call(&points, raw::PILUM_REQ_FLUX | 1 << bit)?;
            if answer.status != raw::PILUM_E_UNSUPPORTED {
                return Err(specimen.fails(format_args!(
                    "request bit {bit}: `integrate` returned {}",
                    status_name(answer.status)
                )));
            }
            if answer.points.iter().any(|end| end.status != NO_OUTCOME) {
                return Err(specimen.fails("a call that is refused as a whole wrote outcomes"));
            }
        }
        Ok(())
    })
}

fn missing_tangent_is_refused(subject: &Subject) -> Found {
    let n = subject.each(Draw::Any, "no tangent", 1, |specimen, random| {
        if specimen.formulation.tangent != law::Tangent::None {
            return Ok(0);
        }
        let form = Form {
            verbatim: true,
            ..Form::of(UPDATE)
        };
        let points = specimen.points(3, random)?;
        let answer = specimen.probe.integrate(&points, &form)?;
        if answer.status != raw::PILUM_E_UNSUPPORTED {
            return Err(specimen.fails(format_args!(
                "it declares no tangent, but asked for one `integrate` returned {}",
                status_name(answer.status)
            )));
        }
        Ok(1)
    })?;
    if n == 0 {
        return Err(skipped("all laws have a tangent"));
    }
    Ok(String::new())
}

fn empty_batch_is_accepted(subject: &Subject) -> Found {
    subject.each(Draw::Any, "empty", 1, |specimen, _| {
        let answer = specimen.call(&[], UPDATE)?;
        let init = specimen.probe.init_state(&[], &Form::of(0))?;
        for (function, answer) in [("integrate", Some(answer)), ("init_state", init)] {
            if let Some(Answer { status, .. }) = answer
                && status != raw::PILUM_OK
            {
                let status = status_name(status);
                return Err(specimen.fails(format_args!("`{function}` returned {status}")));
            }
        }
        Ok(0)
    })?;
    Ok(String::new())
}

fn null_outcomes_are_accepted(subject: &Subject) -> Found {
    subject.each(Draw::Any, "null", 2, |specimen, random| {
        let points = specimen.points(16, random)?;
        let form = Form::of(UPDATE);
        let with = specimen.probe.integrate(&points, &form)?;
        let mute = Form {
            outcomes: false,
            message: None,
            ..form
        };
        let mut without = specimen.probe.integrate(&points, &mute)?;
        if without.points.iter().any(|end| end.status != NO_OUTCOME) {
            return Err(specimen.fails("an outcome was written, but not where the host said"));
        }
        for (end, told) in without.points.iter_mut().zip(&with.points) {
            end.status = told.status;
        }
        match first_difference(&with.points, &without.points) {
            Some(i) => Err(specimen.fails(format_args!("the results of point {i} differ"))),
            None => Ok(0),
        }
    })?;
    Ok(String::new())
}

fn messages_fit(subject: &Subject) -> Found {
    each_with_points(subject, "messages", 3, |specimen, good| {
        let mut points = good.clone();
        let last = points.len() - 1;
        points[last].gradient1[0] = f64::NAN;
        let number = (40 + last).to_string();
        for capacity in [512, 16, 2, 1, 0] {
            let form = Form {
                message: Some(capacity),
                first_point: 40,
                ..Form::of(raw::PILUM_REQ_FLUX)
            };
            let why = match specimen.probe.integrate(&points, &form)?.text() {
                None if capacity == 0 => continue,
                None => format!("a message in {capacity} bytes does not end in NUL"),
                Some(text) if capacity == 512 && text.is_empty() => {
                    "a failing point leaves no message".to_owned()
                }
                Some(text) if capacity == 512 && !text.contains(&number) => {
                    format!("the message `{text}` does not name point {number}")
                }
                Some(_) => continue,
            };
            return Err(specimen.fails(why));
        }
        let quiet = specimen.call(&good, raw::PILUM_REQ_FLUX)?;
        if quiet.text().is_none() {
            return Err(specimen.fails("a call without failures leaves a message without NUL"));
        }
        Ok(())
    })
}

/// Whether a law gives the same to a host with other structs: its name, and the forms of `create` and the batch.
fn serves(
    specimen: &Specimen,
    points: &[PointStart],
    host: &str,
    (host_form, batch_bytes): (CreateForm<'_>, usize),
) -> Result<(), Verdict> {
    let form = Form::of(UPDATE);
    let usual = specimen.probe.integrate(points, &form)?;
    let created = specimen.law.probe(&host_form)?;
    let Some(probe) = created.probe else {
        let status = status_name(created.status);
        return Err(specimen.fails(format_args!("`create` returned {status} to {host}")));
    };
    let other = Form {
        batch_bytes,
        ..form
    };
    let answer = probe.integrate(points, &other)?;
    if batch_bytes < BATCH_BYTES && answer.status != usual.status {
        return Err(specimen.fails(format_args!(
            "a batch of {batch_bytes} bytes, as version 1.0 has it: `integrate` returned {}",
            status_name(answer.status)
        )));
    }
    let Some(i) = first_difference(&usual.points, &answer.points) else {
        return Ok(());
    };
    let whose = if batch_bytes < BATCH_BYTES {
        format!("to {host} the")
    } else {
        "the".to_owned()
    };
    Err(specimen.fails(format_args!("{whose} results of point {i} differ")))
}

fn longer_structs_are_accepted(subject: &Subject) -> Found {
    each_with_points(subject, "longer", 16, |specimen, points| {
        let host = CreateForm {
            more_host: 64,
            host_minor: raw::PILUM_ABI_MINOR + 1,
            ..specimen.create_form()
        };
        let what = "a host of a later minor version";
        serves(specimen, &points, what, (host, BATCH_BYTES + 64))
    })
}

fn shorter_batch_is_refused(subject: &Subject) -> Found {
    each_with_points(subject, "shorter", 3, |specimen, points| {
        for batch_bytes in [BATCH_SIZE_1_0 - 8, 64, 8] {
            let form = Form {
                batch_bytes,
                ..Form::of(raw::PILUM_REQ_FLUX)
            };
            let answer = specimen.probe.integrate(&points, &form)?;
            if answer.status != raw::PILUM_E_ARGUMENT {
                return Err(specimen.fails(format_args!(
                    "a batch of {batch_bytes} bytes: `integrate` returned {}",
                    status_name(answer.status)
                )));
            }
        }
        Ok(())
    })
}
