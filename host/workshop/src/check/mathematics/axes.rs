//! Do hypotheses agree, and does the response turn with the axes?

use super::{ELASTIC, ITERATED, ROUND_OFF, UPDATE, flux_scale, largest};
use crate::check::loading_path::{Origin, Step, sum};
use crate::check::margins;
use crate::check::random::Random;
use crate::check::specimen::{Specimen, create_form, enlarged, hypotheses, is_success};
use crate::check::{Found, Subject, Verdict, skipped};
use abi::Hypothesis;
use abi::raw;
use law::probe::{PointEnd, PointStart};
use nalgebra::{DMatrix, DVector};

pub(super) fn hypotheses_agree(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "hypotheses");
    let specimens = subject.specimens_by_default(3, &mut random)?;
    let mut n = 0;
    for specimen in &specimens {
        let offered = hypotheses(&specimen.law);
        let wanted = match specimen.hypothesis {
            Hypothesis::PlaneStrain => [Hypothesis::ThreeD, Hypothesis::Axisymmetric].as_slice(),
            Hypothesis::Axisymmetric => [Hypothesis::ThreeD].as_slice(),
            Hypothesis::Interface2d => [Hypothesis::Interface3d].as_slice(),
            _ => continue,
        };
        let larger = wanted
            .iter()
            .find_map(|h| offered.iter().find(|(_, o)| o == h));
        let Some((formulation, hypothesis)) = larger else {
            continue;
        };
        let ids = |f: &law::FormulationDescription| -> Vec<String> {
            f.internal_variables.iter().map(|v| v.id.clone()).collect()
        };
        if ids(formulation) != ids(&specimen.formulation) {
            continue;
        }
        let form = create_form(formulation, *hypothesis, &specimen.values);
        let Some(probe) = specimen.law.probe(&form)?.probe else {
            return Err(specimen.fails(format!(
                "the same parameters are refused under {}",
                hypothesis.name()
            )));
        };
        let size = hypothesis.n_components();
        let steps = specimen.paths(24, &mut random)?.steps;
        let starts: Vec<PointStart> = steps
            .iter()
            .map(|step| enlarged(&step.start, size))
            .collect();
        let ends = probe.integrate(&starts, &specimen.form(UPDATE))?.points;
        for (step, end) in steps.iter().zip(&ends) {
            if let Some(why) = disagreement(step, end, size) {
                let why = format!(
                    "{} says otherwise: {why}, at {}",
                    hypothesis.name(),
                    specimen.at(&step.start)
                );
                return Err(specimen.fails_at(&step.start, why));
            }
            n += 1;
        }
    }
    if n == 0 {
        return Err(skipped("no law offers two hypotheses of one kind"));
    }
    Ok(format!("{n} points"))
}

/// What differs between a step in the plane and the same in more components.
fn disagreement(step: &Step, end: &PointEnd, size: usize) -> Option<String> {
    if !is_success(end.status) {
        return Some("the update fails".to_owned());
    }
    // Not tangents: at an edge of a yield surface, round-off chooses between those of its sides.
    let bound = ITERATED * flux_scale(step);
    for c in 0..size {
        let expected = step.end.flux.get(c).copied().unwrap_or(0.0);
        if (end.flux[c] - expected).abs() > bound {
            return Some(format!("flux {:?} and {:?}", step.end.flux, end.flux));
        }
    }
    None
}

pub(super) fn tangential_axis_is_arbitrary(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "mirror");
    let mut n = 0;
    for mut specimen in subject.specimens_by_default(4, &mut random)? {
        if !specimen.hypothesis.is_interface() {
            continue;
        }
        let mut random = own_random(subject, "mirror", &mut specimen);
        // The normal direction stays.
        let mut signs = vec![-1.0; specimen.probe.n_components()];
        signs[0] = 1.0;
        let mirror = DMatrix::from_diagonal(&DVector::from_vec(signs));
        for _ in 0..TWINS {
            n += twin(
                &specimen,
                &mirror,
                &mirror,
                ("mirrored", ROUND_OFF),
                &mut random,
            )?
            .map_err(|unlike| {
                margins::note(unlike.part.0, unlike.part.1);
                let why = unlike.words(&specimen);
                specimen.recorded(&unlike.start, Verdict::Warning(why))
            })?;
        }
    }
    if n == 0 {
        return Err(skipped("there is no interface law"));
    }
    Ok(format!("{n} points"))
}

/// Numbers that depend on the hypothesis alone, so that a replay of one of its increments finds it again on the way
/// of the whole check: it has no other.
pub(in crate::check) fn own_random(
    subject: &Subject,
    name: &str,
    specimen: &mut Specimen,
) -> Random {
    if subject.at.is_some() {
        specimen.course = None;
    }
    let name = format!("{name} {}", specimen.hypothesis.name());
    Random::new(subject.seed, &name)
}

/// Pairs of points that are led side by side, and the increments of each.
const TWINS: usize = 24;
const TWIN_INCREMENTS: usize = 8;
/// Differences of fluxes after several increments, relative to the fluxes in play: substeps whose number
/// follows from a tolerance need not be the same in other axes.
const ROTATED: f64 = 1e-4;

/// Fluxes of a point and of its image that do not belong together.
struct Unlike {
    /// How far, as a part of the threshold of this name.
    part: (&'static str, f64),
    start: PointStart,
    flux: Vec<f64>,
    image: Vec<f64>,
    expected: Vec<f64>,
}

impl Unlike {
    fn words(&self, specimen: &Specimen) -> String {
        let Self {
            flux,
            image,
            expected,
            ..
        } = self;
        format!(
            "{}: flux {flux:?}, turned {expected:?}, is {image:?} where the increment is turned, at {}",
            specimen.name(),
            specimen.at(&self.start)
        )
    }
}

/// Leads a point along a random path from an initial flux of any direction, and its image under a
/// change of axes along that of the path. Increments at which both were compared.
fn twin(
    specimen: &Specimen,
    of_fluxes: &DMatrix<f64>,
    of_gradients: &DMatrix<f64>,
    (name, tolerance): (&'static str, f64),
    random: &mut Random,
) -> Result<Result<usize, Unlike>, Verdict> {
    let turned = |by: &DMatrix<f64>, values: &[f64]| -> Vec<f64> {
        (by * DVector::from_row_slice(values)).as_slice().to_vec()
    };
    let origin = specimen.origin(random)?;
    // An initial flux with a direction, if the law can start there; else the pressure alone.
    let pressure = largest(&origin.start.flux0);
    let mut flux = origin.start.flux0.clone();
    for (c, value) in flux.iter_mut().enumerate() {
        let part = if c < specimen.n_normal() { 0.2 } else { 0.1 };
        *value += part * pressure * random.between(-1.0, 1.0);
    }
    let directed = specimen.started(flux)?.unwrap_or(origin);
    let image = specimen.started(turned(of_fluxes, &directed.start.flux0))?;
    // A law may refuse what a little rounding adds.
    let Ok(Origin {
        start: mut second, ..
    }) = image
    else {
        return Ok(Ok(0));
    };
    let Origin {
        start: mut first,
        stiffness,
        size,
    } = directed;
    let mut n = 0;
    let mut move_ = Vec::new();
    for increment in 0..TWIN_INCREMENTS {
        if increment % 4 == 0 {
            move_ = specimen.direction(size * random.logarithmic(0.03, 100.0), random);
        }
        first.gradient1 = sum(&first.gradient0, &move_);
        second.gradient1 = sum(&second.gradient0, &turned(of_gradients, &move_));
        let mut ends = specimen
            .call(
                &[first.clone(), second.clone()],
                raw::PILUM_REQ_FLUX | raw::PILUM_REQ_ELASTIC,
            )?
            .points;
        let (Some(b), Some(a)) = (ends.pop(), ends.pop()) else {
            break;
        };
        if !(is_success(a.status) && is_success(b.status)) {
            break;
        }
        let expected = turned(of_fluxes, &a.flux);
        let scale = largest(&a.flux)
            .max(largest(&first.flux0))
            .max(stiffness * largest(&move_));
        let pairs = expected.iter().zip(&b.flux);
        let off = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        if off > tolerance * scale || off.is_nan() {
            return Ok(Err(Unlike {
                part: (name, off / (tolerance * scale)),
                start: second,
                flux: a.flux,
                image: b.flux,
                expected,
            }));
        }
        margins::note(name, off / (tolerance * scale));
        n += 1;
        for (point, end) in [(&mut first, a), (&mut second, b)] {
            point.gradient0.clone_from(&point.gradient1);
            point.flux0 = end.flux;
            point.state0 = end.state;
        }
    }
    Ok(Ok(n))
}

/// A rotation of space, about axis 3 if components are those of a plane: how it turns stresses, and
/// strains with γ = 2ε.
fn rotation(n_components: usize, random: &mut Random) -> (DMatrix<f64>, DMatrix<f64>) {
    let mut angle = || random.between(0.0, std::f64::consts::TAU);
    let turn = if n_components == 4 {
        nalgebra::Rotation3::from_euler_angles(0.0, 0.0, angle())
    } else {
        nalgebra::Rotation3::from_euler_angles(angle(), angle(), angle())
    };
    let q = turn.matrix();
    // 11, 22, 33, 12, 13, 23.
    let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
    let stress = DMatrix::from_fn(n_components, n_components, |row, column| {
        let ((i, j), (k, l)) = (pairs[row], pairs[column]);
        let once = q[(i, k)] * q[(j, l)];
        if k == l {
            once
        } else {
            once + q[(i, l)] * q[(j, k)]
        }
    });
    let strain = DMatrix::from_fn(n_components, n_components, |row, column| {
        let double = |c: usize| if c < 3 { 1.0 } else { 2.0 };
        stress[(row, column)] * double(row) / double(column)
    });
    (stress, strain)
}

pub(super) fn response_is_isotropic(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "isotropy");
    let mut n = 0;
    for mut specimen in subject.specimens_by_default(4, &mut random)? {
        let components = specimen.probe.n_components();
        if components < 4 || specimen.formulation.local_axes {
            continue;
        }
        let mut random = own_random(subject, "isotropy", &mut specimen);
        for _ in 0..TWINS {
            let (of_fluxes, of_gradients) = rotation(components, &mut random);
            let mut found = twin(
                &specimen,
                &of_fluxes,
                &of_gradients,
                ("rotated", ROTATED),
                &mut random,
            )?;
            // Where a law branches, rounding may take the other branch: a fault shows again and again.
            for _ in 0..2 {
                if found.is_err() {
                    let (of_fluxes, of_gradients) = rotation(components, &mut random);
                    found = twin(
                        &specimen,
                        &of_fluxes,
                        &of_gradients,
                        ("rotated", ROTATED),
                        &mut random,
                    )?;
                }
            }
            n += found.map_err(|unlike| {
                margins::note(unlike.part.0, unlike.part.1);
                let hint = shear_factor(&specimen, &mut random).map_or(String::new(), |factor| {
                    let taken = if (factor - 2.0).abs() < 1e-3 || (factor - 0.5).abs() < 1e-3 {
                        ": they are handed over as γ, and not as ε"
                    } else {
                        ""
                    };
                    format!(
                        "; the shear modulus is {factor:.3} times (D11 − D12)/2, where shear \
                         strains are γ = 2ε{taken}"
                    )
                });
                let verdict = Verdict::Warning(format!(
                    "{}{hint}; a law that is meant to have directions says so in its `doc`",
                    unlike.words(&specimen)
                ));
                specimen.recorded(&unlike.start, verdict)
            })?;
        }
    }
    if n == 0 {
        return Err(skipped("no law of solids is without axes of its own"));
    }
    Ok(format!("{n} increments"))
}

/// Part of the increment that doubles the flux, for differences of fluxes.
const PART: f64 = 1e-4;

/// Ratio of the elastic shear modulus to the one that follows from the normal components, if they differ: by the elastic
/// operator, or by the fluxes that are returned.
fn shear_factor(specimen: &Specimen, random: &mut Random) -> Option<f64> {
    let Origin { start, size, .. } = specimen.origin(random).ok()?;
    let moved = |c: usize| {
        let mut point = start.clone();
        point.gradient1[c] += PART * size;
        point
    };
    let points = [start.clone(), moved(0), moved(3)];
    let ends = specimen.call(&points, ELASTIC).ok()?.points;
    let d = &ends[0].tangent;
    let n = specimen.probe.n_components();
    let of_operator = d[3 * n + 3] / (0.5 * (d[0] - d[1]));
    let [here, normal, shear] = [0, 1, 2].map(|i| &ends[i].flux);
    let by = |end: &[f64], c: usize| end[c] - here[c];
    let of_fluxes = by(shear, 3) / (0.5 * (by(normal, 0) - by(normal, 1)));
    let is_other = |factor: f64, bound: f64| (factor - 1.0).abs() > bound && factor.is_finite();
    if is_other(of_operator, 1e-6) {
        return Some(of_operator);
    }
    is_other(of_fluxes, 1e-2).then_some(of_fluxes)
}
