//! Do the functions answer as the contract says, to the host's mistakes too?

use super::loading_path::Refused;
use super::random::Random;
use super::specimen::{Draw, create_form, draw_all, first_difference, hypotheses};
use super::{Check, Family, Found, Subject, Verdict, author_path, failed, refusal, status_name};
use abi::raw;
use abi::status::{Outcome, most_severe};
use abi::version::BATCH_SIZE_1_0;
use law::LoadedLaw;
use law::probe::{Answer, BATCH_BYTES, CreateForm, Created, Form, NO_OUTCOME, Order};

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "create-works",
        family: Family::Contract,
        description: "`create` accepts ordinary parameters for every hypothesis; `destroy` frees \
                      the instance and accepts null.",
        needs: &["description-is-readable"],
        run: create_works,
    },
    Check {
        id: "wrong-arguments-are-refused",
        family: Family::Contract,
        description: "`create` refuses a wrong number of values, values at null and an unknown \
                      formulation with PILUM_E_ARGUMENT, a message, and no instance.",
        needs: &["create-works"],
        run: wrong_arguments_are_refused,
    },
    Check {
        id: "bounds-are-kept",
        family: Family::Contract,
        description: "`create` refuses values just outside each bound, NaN and infinities with \
                      PILUM_E_PARAMETER and a message that starts with the parameter's id.",
        needs: &["create-works"],
        run: bounds_are_kept,
    },
    Check {
        id: "initial-states-are-written",
        family: Family::Contract,
        description: "If `init_state` succeeds, it has written an outcome and all internal \
                      variables, finite, of every point.",
        needs: &["create-works"],
        run: initial_states_are_written,
    },
    Check {
        id: "integrate-works",
        family: Family::Contract,
        description: "`integrate` and `init_state` return in time, write an outcome for every \
                      point and report no defect; some increments succeed.",
        needs: &["initial-states-are-written"],
        run: integrate_works,
    },
    Check {
        id: "unknown-requests-are-refused",
        family: Family::Contract,
        description: "An unknown request, or one of rates to a law without them, is refused with \
                      PILUM_E_UNSUPPORTED, without outcomes.",
        needs: &["integrate-works"],
        run: unknown_requests_are_refused,
    },
    Check {
        id: "missing-tangent-is-refused",
        family: Family::Contract,
        description: "With PILUM_T_NO_TANGENT a request of the consistent tangent gives \
                      PILUM_E_UNSUPPORTED.",
        needs: &["integrate-works"],
        run: missing_tangent_is_refused,
    },
    Check {
        id: "empty-batch-is-accepted",
        family: Family::Contract,
        description: "A batch without points succeeds.",
        needs: &["integrate-works"],
        run: empty_batch_is_accepted,
    },
    Check {
        id: "null-outcomes-are-accepted",
        family: Family::Contract,
        description: "Without `status`, `step_factor` and `message`, results have the same bits.",
        needs: &["repeatable"],
        run: null_outcomes_are_accepted,
    },
    Check {
        id: "messages-fit",
        family: Family::Contract,
        description: "A failure writes a message that ends in NUL within its buffer of 512, 16, \
                      2, 1 or 0 bytes, and has the number of the point.",
        needs: &["integrate-works"],
        run: messages_fit,
    },
    Check {
        id: "longer-structs-are-accepted",
        family: Family::Contract,
        description: "A host of a later minor version, whose batch and description have 64 \
                      unknown bytes at their ends, gets the same bits.",
        needs: &["repeatable"],
        run: longer_structs_are_accepted,
    },
    Check {
        id: "shorter-batch-is-refused",
        family: Family::Contract,
        description: "A batch shorter than in version 1.0 is refused with PILUM_E_ARGUMENT; \
                      forbidden memory follows its last byte.",
        needs: &["integrate-works"],
        run: shorter_batch_is_refused,
    },
];

fn create_works(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "create");
    let specimens = subject.specimens(2, &mut random)?;
    for law in subject.laws()? {
        law.destroy_nothing();
    }
    let sets: Vec<String> = specimens
        .iter()
        .step_by(2)
        .map(super::specimen::Specimen::name)
        .collect();
    Ok(sets.join("; "))
}

/// The answer to parameters that must be refused.
fn must_refuse(
    law: &LoadedLaw,
    what: &str,
    created: &Created,
    expected: raw::Status,
) -> Result<String, Verdict> {
    let id = &law.description().id;
    if created.status != expected {
        return Err(failed(format!(
            "`{id}`: {what}: `create` returned {}, expected {}",
            status_name(created.status),
            status_name(expected)
        )));
    }
    if created.probe.is_some() {
        return Err(failed(format!(
            "`{id}`: {what}: `out` is written all the same"
        )));
    }
    match created.text() {
        Some(text) if !text.is_empty() => Ok(text),
        _ => Err(failed(format!("`{id}`: {what}: there is no message"))),
    }
}

fn wrong_arguments_are_refused(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "arguments");
    for law in subject.laws()? {
        for (formulation, hypothesis) in hypotheses(&law) {
            let values = draw_all(subject, &law, &mut random, Draw::Ordinary);
            let right = create_form(&formulation, hypothesis, &values);
            let more: Vec<f64> = values.iter().copied().chain([1.0]).collect();
            let mut wrong = vec![
                (
                    "formulation 4294967295",
                    CreateForm {
                        formulation: u32::MAX,
                        ..right
                    },
                ),
                (
                    "a value too many",
                    CreateForm {
                        values: Some(&more),
                        n_values: more.len(),
                        ..right
                    },
                ),
            ];
            if let Some((_, fewer)) = values.split_last() {
                wrong.push((
                    "a value too few",
                    CreateForm {
                        values: Some(fewer),
                        n_values: fewer.len(),
                        ..right
                    },
                ));
                wrong.push((
                    "values at null",
                    CreateForm {
                        values: None,
                        ..right
                    },
                ));
            }
            for (what, form) in wrong {
                must_refuse(&law, what, &law.probe(&form)?, raw::PILUM_E_ARGUMENT)?;
                let mute = law.probe(&CreateForm {
                    message: None,
                    ..form
                })?;
                if mute.status != raw::PILUM_E_ARGUMENT {
                    return Err(failed(format!(
                        "`{}`: {what}, without a message: `create` returned {}",
                        law.description().id,
                        status_name(mute.status)
                    )));
                }
            }
        }
    }
    Ok(String::new())
}

fn bounds_are_kept(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "bounds");
    let mut n = 0;
    for specimen in subject.specimens(1, &mut random)? {
        let law = &specimen.law;
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
            let b = p.bounds;
            let mut outside = vec![f64::INFINITY, f64::NEG_INFINITY];
            if !p.optional {
                outside.push(f64::NAN);
            }
            let mut at = Vec::new();
            if b.lower.is_finite() {
                outside.push(if b.open_lower {
                    b.lower
                } else {
                    b.lower.next_down()
                });
                at.push(if b.open_lower {
                    b.lower.next_up()
                } else {
                    b.lower
                });
            }
            if b.upper.is_finite() {
                outside.push(if b.open_upper {
                    b.upper
                } else {
                    b.upper.next_up()
                });
                at.push(if b.open_upper {
                    b.upper.next_down()
                } else {
                    b.upper
                });
            }
            if !p.choices.is_empty() {
                outside.extend([-1.0, 0.5, p.choices.len() as f64]);
            }
            for value in outside {
                let what = format!("{} = {value:e}, bounds {b}", p.id);
                let text = must_refuse(law, &what, &create(value)?, raw::PILUM_E_PARAMETER)?;
                if text.split_once(':').is_none_or(|(id, _)| id.trim() != p.id) {
                    return Err(failed(format!(
                        "`{}`: {what}: the message `{text}` does not start with `{}:`",
                        law.description().id,
                        p.id
                    )));
                }
                n += 1;
            }
            for value in at {
                let created = create(value)?;
                if created.status != raw::PILUM_OK {
                    let what = format!("{} = {value:e}", p.id);
                    must_refuse(law, &what, &created, raw::PILUM_E_PARAMETER)?;
                }
                n += 1;
            }
        }
    }
    Ok(format!("{n} values"))
}

fn initial_states_are_written(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "initial states");
    let mut n_points = 0;
    for specimen in subject.specimens(2, &mut random)? {
        // One point without any flux, and so many under pressure.
        for n in [0, 1, 2, 5, 16, 33] {
            let pressures = (0..n).map(|_| random.logarithmic(1.0, 1000.0));
            let mut fluxes: Vec<Vec<f64>> = pressures.map(|p| specimen.under_pressure(p)).collect();
            if n == 0 {
                fluxes.push(specimen.under_pressure(0.0));
            }
            let n = fluxes.len();
            for order in [Order::Points, Order::Components, Order::Spread] {
                let form = Form {
                    order,
                    ..Form::of(0)
                };
                let Some(answer) = specimen.probe.init_state(&fluxes, &form)? else {
                    continue;
                };
                for (i, end) in answer.points.iter().enumerate() {
                    let point = format!("`init_state`, point {i} of {n}, flux {:?}", fluxes[i]);
                    if end.status == NO_OUTCOME && answer.status != raw::PILUM_E_ARGUMENT {
                        let why = format!("{point}: there is no outcome");
                        return Err(specimen.fails_to_start(&fluxes, &form, &[], why));
                    }
                    let unwritten = end.state.iter().position(|value| !value.is_finite());
                    if let Some(k) = unwritten
                        && end.status == raw::PILUM_OK
                    {
                        let id = &specimen.formulation.internal_variables[k].id;
                        let why = format!("{point}: `{id}` is not written, or not finite");
                        return Err(specimen.fails_to_start(&fluxes, &form, &[], why));
                    }
                    n_points += 1;
                }
            }
        }
    }
    if n_points == 0 {
        // No reason to skip what builds on this.
        return Ok("no law has `init_state`".to_owned());
    }
    Ok(format!("{n_points} points"))
}

fn integrate_works(subject: &Subject) -> Found {
    author_path::is_followed(subject)?;
    let mut random = Random::new(subject.seed, "integrate");
    let (mut n_successes, mut n) = (0, 0);
    for specimen in subject.specimens(2, &mut random)? {
        let walk = specimen
            .walk(12, &mut random)
            .map_err(|verdict| match verdict {
                // A law that starts nowhere does not work.
                Verdict::Skipped(why) => Verdict::Failed(why),
                other => other,
            })?;
        for Refused { status, text, .. } in &walk.refusals {
            let expected = matches!(
                Outcome::from_code(*status),
                Outcome::CutStep | Outcome::Domain | Outcome::Numeric
            );
            if !expected {
                let why = refusal(*status, Some(text));
                return Err(specimen.fails(format!("a small step gave {why}")));
            }
        }
        if walk.successes.is_empty() {
            return Err(specimen.fails(format!("no step succeeded: {}", walk.why())));
        }
        n_successes += walk.successes.len();
        n += walk.successes.len() + walk.refusals.len();
        // One call that is looked at as a whole.
        let points = specimen.points(7, &mut random)?;
        let answer = specimen.call(&points, raw::PILUM_REQ_FLUX)?;
        let worst = answer
            .points
            .iter()
            .fold(raw::PILUM_OK, |worst, end| most_severe(worst, end.status));
        if worst != answer.status {
            return Err(specimen.fails(format!(
                "the call returned {}, its most severe outcome is {}",
                status_name(answer.status),
                status_name(worst)
            )));
        }
    }
    Ok(format!("{n_successes} of {n} steps succeeded"))
}

fn unknown_requests_are_refused(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "requests");
    for specimen in subject.specimens(1, &mut random)? {
        let points = specimen.points(3, &mut random)?;
        // A law knows of rates, and may refuse them as unknown or as what it does not offer.
        let rates = (!specimen.formulation.rates).then_some(3);
        for bit in rates.into_iter().chain([4, 17, 31]) {
            let answer = specimen.call(&points, raw::PILUM_REQ_FLUX | 1 << bit)?;
            if answer.status != raw::PILUM_E_UNSUPPORTED {
                return Err(specimen.fails(format!(
                    "request bit {bit}: `integrate` returned {}",
                    status_name(answer.status)
                )));
            }
            if answer.points.iter().any(|end| end.status != NO_OUTCOME) {
                return Err(specimen.fails("a call that is refused as a whole wrote outcomes"));
            }
        }
    }
    Ok(String::new())
}

fn missing_tangent_is_refused(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "no tangent");
    let mut n = 0;
    for specimen in subject.specimens(1, &mut random)? {
        if specimen.formulation.tangent != law::Tangent::None {
            continue;
        }
        let points = specimen.points(3, &mut random)?;
        let form = Form {
            verbatim: true,
            ..Form::of(raw::PILUM_REQ_FLUX | raw::PILUM_REQ_TANGENT)
        };
        let answer = specimen.probe.integrate(&points, &form)?;
        if answer.status != raw::PILUM_E_UNSUPPORTED {
            return Err(specimen.fails(format!(
                "it declares no tangent, but asked for one `integrate` returned {}",
                status_name(answer.status)
            )));
        }
        n += 1;
    }
    if n == 0 {
        return Err(super::skipped("all laws have a tangent"));
    }
    Ok(String::new())
}

fn empty_batch_is_accepted(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "empty");
    for specimen in subject.specimens(1, &mut random)? {
        let answer = specimen.call(&[], raw::PILUM_REQ_FLUX | raw::PILUM_REQ_TANGENT)?;
        let init = specimen.probe.init_state(&[], &Form::of(0))?;
        for (function, answer) in [("integrate", Some(answer)), ("init_state", init)] {
            if let Some(Answer { status, .. }) = answer
                && status != raw::PILUM_OK
            {
                return Err(
                    specimen.fails(format!("`{function}` returned {}", status_name(status)))
                );
            }
        }
    }
    Ok(String::new())
}

fn null_outcomes_are_accepted(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "null");
    for specimen in subject.specimens(2, &mut random)? {
        let points = specimen.points(16, &mut random)?;
        let form = Form::of(raw::PILUM_REQ_FLUX | raw::PILUM_REQ_TANGENT);
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
        if let Some(i) = first_difference(&with.points, &without.points) {
            return Err(specimen.fails(format!("the results of point {i} differ")));
        }
    }
    Ok(String::new())
}

fn messages_fit(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "messages");
    for specimen in subject.specimens(1, &mut random)? {
        let mut points = specimen.points(3, &mut random)?;
        let good = points.clone();
        let last = points.len() - 1;
        points[last].gradient1[0] = f64::NAN;
        for capacity in [512, 16, 2, 1, 0] {
            let form = Form {
                message: Some(capacity),
                first_point: 40,
                ..Form::of(raw::PILUM_REQ_FLUX)
            };
            let answer = specimen.probe.integrate(&points, &form)?;
            let Some(text) = answer.text() else {
                if capacity == 0 {
                    continue;
                }
                return Err(
                    specimen.fails(format!("a message in {capacity} bytes does not end in NUL"))
                );
            };
            if capacity == 512 && text.is_empty() {
                return Err(specimen.fails("a failing point leaves no message"));
            }
            let number = (40 + last).to_string();
            if capacity == 512 && !text.contains(&number) {
                return Err(
                    specimen.fails(format!("the message `{text}` does not name point {number}"))
                );
            }
        }
        let quiet = specimen.call(&good, raw::PILUM_REQ_FLUX)?;
        if quiet.text().is_none() {
            return Err(specimen.fails("a call without failures leaves a message without NUL"));
        }
    }
    Ok(String::new())
}

fn longer_structs_are_accepted(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "longer");
    for specimen in subject.specimens(1, &mut random)? {
        let points = specimen.points(16, &mut random)?;
        let form = Form::of(raw::PILUM_REQ_FLUX | raw::PILUM_REQ_TANGENT);
        let usual = specimen.probe.integrate(&points, &form)?;
        let longer = Form {
            batch_bytes: BATCH_BYTES + 64,
            ..form
        };
        let later_host = CreateForm {
            more_host: 64,
            host_minor: raw::PILUM_ABI_MINOR + 1,
            ..create_form(&specimen.formulation, specimen.hypothesis, &specimen.values)
        };
        let created = specimen.law.probe(&later_host)?;
        let Some(probe) = created.probe else {
            return Err(specimen.fails(format!(
                "`create` returned {} to a host of a later minor version",
                status_name(created.status)
            )));
        };
        let answer = probe.integrate(&points, &longer)?;
        if let Some(i) = first_difference(&usual.points, &answer.points) {
            return Err(specimen.fails(format!("the results of point {i} differ")));
        }
    }
    Ok(String::new())
}

fn shorter_batch_is_refused(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "shorter");
    for specimen in subject.specimens(1, &mut random)? {
        let points = specimen.points(3, &mut random)?;
        for batch_bytes in [BATCH_SIZE_1_0 - 8, 64, 8] {
            let form = Form {
                batch_bytes,
                ..Form::of(raw::PILUM_REQ_FLUX)
            };
            let answer = specimen.probe.integrate(&points, &form)?;
            if answer.status != raw::PILUM_E_ARGUMENT {
                return Err(specimen.fails(format!(
                    "a batch of {batch_bytes} bytes: `integrate` returned {}",
                    status_name(answer.status)
                )));
            }
        }
    }
    Ok(String::new())
}
