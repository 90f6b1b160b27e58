//! Are signs, angles and work what they are meant to be?

use crate::check::draw::Draw;
use crate::check::loading_path::{Origin, Step, flux_scale, starts};
use crate::check::points::{
    ELASTIC, ITERATED, ROUND_OFF, apart, carry_on, increment, is_success, largest,
};
use crate::check::specimen::Specimen;
use crate::check::{Found, Subject, Verdict, counted, skipped, warned};
use abi::raw;
use law::probe::PointStart;
use nalgebra::{DMatrix, DVector};

/// How much stronger in tension than in compression a law is that has signs confused.
const STRONGER: f64 = 1.05;

pub(super) fn compression_is_negative(subject: &Subject) -> Found {
    const PRESSURES: [f64; 3] = [10.0, 100.0, 1000.0];
    let n = subject.each(Draw::DefaultChoices, "compression", 4, |specimen, _| {
        // A replay goes the ways of the whole check, in which nothing is random.
        if specimen.course.is_some() && subject.at.is_none() {
            return Err(skipped("the path is the author's"));
        }
        for pressure in PRESSURES {
            if let Some((start, why)) = is_stronger_in_tension(specimen, pressure)? {
                let why = format!("{why}; compression is negative here");
                return Err(specimen.warns_for(&start, why));
            }
        }
        Ok(PRESSURES.len())
    })?;
    Ok(format!("{n} pressures"))
}

/// The increment at which a law carries more in tension than under as much pressure, in words.
fn is_stronger_in_tension(
    specimen: &Specimen,
    pressure: f64,
) -> Result<Option<(PointStart, String)>, Verdict> {
    let origin = |pressure: f64| specimen.started(&specimen.under_pressure(pressure));
    let (compressed, pulled) = (origin(pressure)?.ok(), origin(-pressure)?.ok());
    // The same way for both: where dilation is held, shear stresses grow with its length.
    let both = compressed.iter().chain(&pulled);
    let size = both.fold(0.0_f64, |most, origin| most.max(origin.size));
    let sheared = |origin| sheared_far(specimen, origin, size);
    let compressed = compressed.map(sheared).transpose()?;
    let Some(pulled) = pulled.map(sheared).transpose()? else {
        return Ok(None);
    };
    let Some(compressed) = compressed else {
        let why =
            format!("it starts from a tension of {pressure} kPa, but not from as much compression");
        return Ok(pulled.into_iter().next().map(|(start, _)| (start, why)));
    };
    let mut pairs = compressed.into_iter().zip(pulled);
    let stronger = pairs.find(|((_, c), (_, p))| *p > STRONGER * c);
    Ok(stronger.map(|((_, compressed), (start, pulled))| {
        let why = format!(
            "under a tension of {pressure} kPa it carries a shear stress of \
             {pulled:.6e} kPa, under as much compression {compressed:.6e}"
        );
        (start, why)
    }))
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
        carry_on(&mut point, end);
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
    let n = subject.each(Draw::DefaultChoices, "angles", 3, |specimen, random| {
        let parameters = specimen.law.description().parameters.iter().enumerate();
        let is_angle = |(i, p): &(usize, &law::ParameterDescription)| {
            p.unit == "deg" && specimen.values[*i].is_finite()
        };
        let angles: Vec<_> = parameters.filter(is_angle).collect();
        if angles.is_empty() {
            return Ok(0);
        }
        let steps = specimen.paths(12, random)?.steps;
        let mut n = 0;
        for (i, p) in angles {
            for by in PERIODS.into_iter().flat_map(|period| [period, -period]) {
                // Half a period less a little: neither does the tangent repeat there.
                let (Some(whole), Some(part)) = (
                    effect(specimen, &steps, i, by)?,
                    effect(specimen, &steps, i, 0.4 * by)?,
                ) else {
                    continue;
                };
                n += 1;
                if whole < ITERATED && part > 1e3 * ITERATED {
                    return Err(specimen.fails(format_args!(
                        "`{}` = {} and {} give the same fluxes, others between do not: angles \
                         come in degrees",
                        p.id,
                        specimen.values[i],
                        specimen.values[i] + by
                    )));
                }
            }
        }
        Ok(n)
    })?;
    counted(n, "pairs of angles", "no parameter is an angle")
}

/// The largest difference that another value of a parameter makes; nothing where it is refused.
fn effect(specimen: &Specimen, steps: &[Step], i: usize, by: f64) -> Result<Option<f64>, Verdict> {
    let mut values = specimen.values.clone();
    values[i] += by;
    let bounds = specimen.law.description().parameters[i].bounds;
    if !bounds.contain(values[i]) {
        return Ok(None);
    }
    let Some(probe) = specimen.with_values(&values)? else {
        return Ok(None);
    };
    let ends = probe.integrate(&starts(steps), &specimen.form(raw::PILUM_REQ_FLUX))?;
    let differences = steps.iter().zip(&ends.points).map(|(step, end)| {
        if is_success(end.status) {
            apart(&step.end.flux, &end.flux) / flux_scale(step)
        } else {
            f64::INFINITY
        }
    });
    Ok(Some(differences.fold(0.0, f64::max)))
}

pub(super) fn plastic_work_is_not_negative(subject: &Subject) -> Found {
    let mut least = -1e-6;
    let mut worst = None;
    let n = subject.each(Draw::DefaultChoices, "work", 4, |specimen, random| {
        let steps = specimen.paths(36, random)?.steps;
        let elastic = specimen.call(&starts(&steps), ELASTIC)?.points;
        let Some(first) = elastic.first() else {
            return Ok(0);
        };
        // What creeps back gives work that was stored.
        if specimen.depends_on_time(&steps)? {
            return Ok(0);
        }
        let is_constant = elastic
            .iter()
            .all(|end| apart(&end.tangent, &first.tangent) <= ROUND_OFF * largest(&first.tangent));
        let n = first.flux.len();
        let compliance = DMatrix::from_row_slice(n, n, &first.tangent).try_inverse();
        let Some(compliance) = compliance.filter(|_| is_constant) else {
            return Ok(0);
        };
        for step in &steps {
            let flux = DVector::from_row_slice(&step.end.flux);
            let change = &flux - DVector::from_row_slice(&step.start.flux0);
            let moved = DVector::from_vec(increment(&step.start));
            let work = flux.dot(&(&moved - &compliance * change));
            let relative = work / (flux_scale(step) * largest(moved.as_slice()));
            if relative < least {
                least = relative;
                let why = format!(
                    "the plastic work is negative, {relative:.1e} of the work in play: {}, at {}",
                    specimen.name(),
                    specimen.at(&step.start)
                );
                worst = Some(specimen.recorded(&step.start, warned(why)));
            }
        }
        Ok(steps.len())
    })?;
    let none = "no law that is independent of time has a constant elastic operator";
    let found = counted(n, "steps", none)?;
    worst.map_or(Ok(found), Err)
}
