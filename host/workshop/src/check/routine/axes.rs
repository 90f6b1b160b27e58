//! Does a routine give the same in the plane and in space, and in other axes?

use super::messages::Words;
use super::{differ, each};
use crate::check::mathematics::{ITERATED, flux_scale, largest, own_random};
use crate::check::random::Random;
use crate::check::specimen::{Specimen, create_form, enlarged, hypotheses, is_success, longer};
use crate::check::{Found, Subject, Verdict, refusal, skipped};
use abi::Hypothesis;
use abi::raw;
use law::probe::PointStart;

/// The same routine with the same parameters under another hypothesis, if it offers that.
fn under(routine: &Specimen, wanted: Hypothesis) -> Result<Option<Specimen>, Verdict> {
    let mut all = hypotheses(&routine.law).into_iter();
    let Some((formulation, hypothesis)) = all.find(|(_, other)| *other == wanted) else {
        return Ok(None);
    };
    let form = create_form(&formulation, hypothesis, &routine.values);
    let created = routine.law.probe(&form)?;
    Ok(created.probe.map(|probe| {
        let values = routine.values.clone();
        Specimen {
            time_increment: routine.time_increment,
            is_led_near: routine.is_led_near,
            ..Specimen::of(
                routine.law.clone(),
                (formulation, hypothesis),
                values,
                probe,
            )
        }
    }))
}

pub(super) fn routine_agrees_in_the_plane(subject: &Subject) -> Found {
    let n = each(subject, "plane", |routine, steps, _| {
        let wanted = match routine.hypothesis {
            Hypothesis::PlaneStrain | Hypothesis::Axisymmetric => Hypothesis::ThreeD,
            Hypothesis::Interface2d => Hypothesis::Interface3d,
            _ => return Ok(0),
        };
        let Some(larger) = under(routine, wanted)? else {
            return Ok(0);
        };
        let size = larger.probe.n_components();
        let points: Vec<PointStart> = steps
            .iter()
            .map(|step| enlarged(&step.start, size))
            .collect();
        let answer = larger.call(&points, raw::PILUM_REQ_FLUX)?;
        for ((step, point), end) in steps.iter().zip(&points).zip(&answer.points) {
            if !is_success(end.status) {
                let why = refusal(end.status, answer.text().as_deref());
                return Err(larger.fails_at(point, why));
            }
            let expected = longer(&step.end.flux, size);
            if differ(&end.flux, &expected, ITERATED * flux_scale(step)) {
                let why = format!(
                    "{} is {:?}, under {} it is {:?}, at {}",
                    Words::of(routine).stress,
                    step.end.flux,
                    wanted.name(),
                    end.flux,
                    routine.at(&step.start)
                );
                return Err(routine.fails_at(&step.start, why));
            }
        }
        Ok(steps.len())
    })?;
    if n == 0 {
        return Err(skipped(
            "it is written for the plane or for space, not for both",
        ));
    }
    Ok(format!("{n} increments"))
}

pub(super) fn tangential_directions_are_alike(subject: &Subject) -> Found {
    let (mut n, mut random) = (0, Random::new(subject.seed, "turned"));
    for mut routine in subject.specimens_by_default(1, &mut random)? {
        if !routine.hypothesis.is_interface() {
            continue;
        }
        let mut random = own_random(subject, "turned", &mut routine);
        n += turned_alike(&routine, &mut random)?;
    }
    if n == 0 {
        return Err(skipped("it is no routine of interfaces"));
    }
    Ok(format!("{n} increments"))
}

/// Increments that are turned.
const TURNED: usize = 200;

/// Increments at which a traction was compared with that of the turned one.
fn turned_alike(routine: &Specimen, random: &mut Random) -> Result<usize, Verdict> {
    let mut compared = 0;
    for _ in 0..TURNED {
        // Internal variables with a direction would have to turn as well, so every path starts fresh.
        let origin = routine.origin(random)?;
        let size = origin.size * random.logarithmic(0.03, 30.0);
        let mut point = origin.start;
        point.gradient1 = routine.direction(size, random);
        let angle = random.between(0.5, 2.5);
        let turn = |values: &[f64]| match *values {
            [n, t, s] => {
                let (sin, cos) = f64::sin_cos(angle);
                vec![n, cos * t - sin * s, sin * t + cos * s]
            }
            _ => vec![values[0], -values[1]],
        };
        let turned = PointStart {
            gradient0: turn(&point.gradient0),
            gradient1: turn(&point.gradient1),
            flux0: turn(&point.flux0),
            state0: point.state0.clone(),
        };
        let ends = routine.call(&[point.clone(), turned], raw::PILUM_REQ_FLUX)?;
        let [first, second] = ends.points.as_slice() else {
            continue;
        };
        if !(is_success(first.status) && is_success(second.status)) {
            continue;
        }
        let scale = largest(&point.flux0)
            .max(largest(&first.flux))
            .max(origin.stiffness * size);
        let expected = turn(&first.flux);
        if differ(&second.flux, &expected, ITERATED * scale) {
            let why = format!(
                "the traction {:?} becomes {:?} where it should be {expected:?}, at {}",
                first.flux,
                second.flux,
                routine.at(&point)
            );
            return Err(routine.warns_at(&point, why));
        }
        compared += 1;
    }
    Ok(compared)
}
