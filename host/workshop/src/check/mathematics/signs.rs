//! Are signs, angles and work what they are meant to be?

use super::{ELASTIC, ITERATED, ROUND_OFF, depends_on_time, flux_scale, increment, largest};
use crate::check::loading_path::Origin;
use crate::check::random::Random;
use crate::check::specimen::{Specimen, create_form, is_success};
use crate::check::{Found, Subject, Verdict, skipped};
use abi::raw;
use law::probe::PointStart;
use nalgebra::{DMatrix, DVector};

/// How much stronger in tension than in compression a law is that has signs confused.
const STRONGER: f64 = 1.05;

pub(super) fn compression_is_negative(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "compression");
    let mut n = 0;
    for specimen in subject.specimens_by_default(4, &mut random)? {
        // A replay goes the ways of the whole check, in which nothing is random.
        if specimen.course.is_some() && subject.at.is_none() {
            return Err(skipped("the path is the author's"));
        }
        for pressure in [10.0, 100.0, 1000.0] {
            let origin = |pressure: f64| specimen.started(specimen.under_pressure(pressure));
            let (compressed, pulled) = (origin(pressure)?.ok(), origin(-pressure)?.ok());
            // The same way for both: where dilation is held, shear stresses grow with its length.
            let both = compressed.iter().chain(&pulled);
            let size = both.fold(0.0_f64, |most, origin| most.max(origin.size));
            let sheared = |origin| sheared_far(&specimen, origin, size);
            let compressed = compressed.map(sheared).transpose()?;
            let pulled = pulled.map(sheared).transpose()?;
            let found = match (compressed, pulled) {
                (None, Some(pulled)) => pulled.into_iter().next().map(|(start, _)| {
                    let why = format!(
                        "it starts from a tension of {pressure} kPa, but not from as much compression"
                    );
                    (start, why)
                }),
                (Some(compressed), Some(pulled)) => {
                    let mut pairs = compressed.into_iter().zip(pulled);
                    let stronger = pairs.find(|((_, c), (_, p))| *p > STRONGER * c);
                    stronger.map(|((_, compressed), (start, pulled))| {
                        let why = format!(
                            "under a tension of {pressure} kPa it carries a shear stress of \
                             {pulled:.6e} kPa, under as much compression {compressed:.6e}"
                        );
                        (start, why)
                    })
                }
                _ => None,
            };
            if let Some((start, why)) = found {
                let name = specimen.name();
                let why = format!("{name}: {why}; compression is negative here");
                return Err(specimen.recorded(&start, Verdict::Warning(why)));
            }
            n += 1;
        }
    }
    Ok(format!("{n} pressures"))
}

/// Shears a point, at constant other gradients, far beyond its elastic range, which has this size: every
/// increment, and the largest shear stress up to there.
fn sheared_far(
    specimen: &Specimen,
    origin: Origin,
    size: f64,
) -> Result<Vec<(PointStart, f64)>, Verdict> {
    let mut point = origin.start;
    let shear = specimen.n_normal();
    let mut way: Vec<(PointStart, f64)> = Vec::new();
    let mut length = 0.03 * size;
    while length < 1e3 * size {
        point.gradient1[shear] += length;
        let mut ends = specimen
            .call(std::slice::from_ref(&point), raw::PILUM_REQ_FLUX)?
            .points;
        let Some(end) = ends.pop().filter(|end| is_success(end.status)) else {
            break;
        };
        let before = way.last().map_or(0.0, |(_, most)| *most);
        way.push((point.clone(), before.max(end.flux[shear].abs())));
        point.gradient0.clone_from(&point.gradient1);
        point.flux0 = end.flux;
        point.state0 = end.state;
        length *= 1.5;
    }
    Ok(way)
}

/// Period of sine, cosine and tangent, in degrees that are taken for radians, and in radians
/// that are turned into degrees once more.
const PERIODS: [f64; 2] = [
    std::f64::consts::TAU,
    std::f64::consts::TAU * std::f64::consts::PI / 180.0,
];

pub(super) fn angles_are_degrees(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "angles");
    let mut n = 0;
    for specimen in subject.specimens_by_default(3, &mut random)? {
        let angles = specimen.law.description().parameters.iter().enumerate();
        let angles: Vec<usize> = angles
            .filter(|(i, p)| p.unit == "deg" && specimen.values[*i].is_finite())
            .map(|(i, _)| i)
            .collect();
        if angles.is_empty() {
            continue;
        }
        let steps = specimen.paths(12, &mut random)?.steps;
        for i in angles {
            // The largest difference that another value of the angle makes; nothing where it is refused.
            let effect = |by: f64| -> Result<Option<f64>, Verdict> {
                let mut values = specimen.values.clone();
                values[i] += by;
                if !specimen.law.description().parameters[i]
                    .bounds
                    .contain(values[i])
                {
                    return Ok(None);
                }
                let form = create_form(&specimen.formulation, specimen.hypothesis, &values);
                let Some(probe) = specimen.law.probe(&form)?.probe else {
                    return Ok(None);
                };
                let starts: Vec<PointStart> = steps.iter().map(|s| s.start.clone()).collect();
                let ends = probe.integrate(&starts, &specimen.form(raw::PILUM_REQ_FLUX))?;
                let differences = steps.iter().zip(&ends.points).map(|(step, end)| {
                    if !is_success(end.status) {
                        return f64::INFINITY;
                    }
                    let pairs = step.end.flux.iter().zip(&end.flux);
                    let most = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
                    most / flux_scale(step)
                });
                Ok(Some(differences.fold(0.0, f64::max)))
            };
            for period in PERIODS {
                for by in [period, -period] {
                    // Half a period less a little: neither does the tangent repeat there.
                    let (Some(whole), Some(part)) = (effect(by)?, effect(0.4 * by)?) else {
                        continue;
                    };
                    n += 1;
                    if whole < ITERATED && part > 1e3 * ITERATED {
                        let p = &specimen.law.description().parameters[i];
                        return Err(specimen.fails(format!(
                            "`{}` = {} and {} give the same fluxes, others between do not: angles \
                             come in degrees",
                            p.id,
                            specimen.values[i],
                            specimen.values[i] + by
                        )));
                    }
                }
            }
        }
    }
    if n == 0 {
        return Err(skipped("no parameter is an angle"));
    }
    Ok(format!("{n} pairs of angles"))
}

pub(super) fn plastic_work_is_not_negative(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "work");
    let (mut n_steps, mut least) = (0, -1e-6);
    let mut worst = None;
    for specimen in subject.specimens_by_default(4, &mut random)? {
        let steps = specimen.paths(36, &mut random)?.steps;
        let starts: Vec<PointStart> = steps.iter().map(|step| step.start.clone()).collect();
        let elastic = specimen.call(&starts, ELASTIC)?.points;
        let Some(first) = elastic.first() else {
            continue;
        };
        // What creeps back gives work that was stored.
        if depends_on_time(&specimen, &steps)? {
            continue;
        }
        let constant = elastic.iter().all(|end| {
            let pairs = end.tangent.iter().zip(&first.tangent);
            pairs
                .into_iter()
                .all(|(a, b)| (a - b).abs() <= ROUND_OFF * largest(&first.tangent))
        });
        let n = first.flux.len();
        let Some(compliance) = DMatrix::from_row_slice(n, n, &first.tangent).try_inverse() else {
            continue;
        };
        if !constant {
            continue;
        }
        for step in &steps {
            let flux = DVector::from_row_slice(&step.end.flux);
            let change = &flux - DVector::from_row_slice(&step.start.flux0);
            let moved = DVector::from_vec(increment(&step.start));
            let work = flux.dot(&(&moved - &compliance * change));
            let relative = work / (flux_scale(step) * largest(moved.as_slice()));
            if relative < least {
                least = relative;
                let verdict = Verdict::Warning(format!(
                    "the plastic work is negative, {relative:.1e} of the work in play: {}, at {}",
                    specimen.name(),
                    specimen.at(&step.start)
                ));
                worst = Some(specimen.recorded(&step.start, verdict));
            }
            n_steps += 1;
        }
    }
    if n_steps == 0 {
        return Err(skipped(
            "no law that is independent of time has a constant elastic operator",
        ));
    }
    worst.map_or(Ok(format!("{n_steps} steps")), Err)
}
