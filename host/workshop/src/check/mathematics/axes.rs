//! Do hypotheses agree, and does the response turn with the axes?

use crate::check::draw::Draw;
use crate::check::loading_path::{Origin, Step, flux_scale};
use crate::check::points::{
    ELASTIC, ITERATED, ROUND_OFF, apart, carry_on, enlarged, is_success, largest, longer, sum,
};
use crate::check::random::Random;
use crate::check::specimen::{Specimen, create_form, hypotheses};
use crate::check::{Found, Subject, Verdict, counted, margins, refusal};
use abi::Hypothesis;
use abi::raw;
use law::FormulationDescription;
use law::probe::PointStart;
use nalgebra::{DMatrix, DVector};

pub(super) fn hypotheses_agree(subject: &Subject) -> Found {
    let n = subject.each(Draw::DefaultChoices, "hypotheses", 3, |specimen, random| {
        agrees(specimen, || Ok(specimen.paths(24, random)?.steps))
    })?;
    counted(n, "points", "no law offers two hypotheses of one kind")
}

pub(in crate::check) fn routine_agrees_in_the_plane(subject: &Subject) -> Found {
    let n = subject.each_walk("plane", |routine, steps, _| {
        agrees(routine, || Ok(steps.to_vec()))
    })?;
    let none = "it is written for the plane or for space, not for both";
    counted(n, "increments", none)
}

/// The formulation of the law with the same internal variables in more components, if it offers one.
fn larger(specimen: &Specimen) -> Option<(FormulationDescription, Hypothesis)> {
    let wanted = match specimen.hypothesis {
        Hypothesis::PlaneStrain if specimen.adapter().is_some() => &[Hypothesis::ThreeD][..],
        Hypothesis::PlaneStrain => &[Hypothesis::ThreeD, Hypothesis::Axisymmetric],
        Hypothesis::Axisymmetric => &[Hypothesis::ThreeD],
        Hypothesis::Interface2d => &[Hypothesis::Interface3d],
        _ => return None,
    };
    let mut offered = hypotheses(&specimen.law);
    let at = wanted
        .iter()
        .find_map(|h| offered.iter().position(|(_, other)| other == h))?;
    let larger = offered.swap_remove(at);
    let ids = |f: &FormulationDescription| -> Vec<String> {
        f.internal_variables.iter().map(|v| v.id.clone()).collect()
    };
    (ids(&larger.0) == ids(&specimen.formulation)).then_some(larger)
}

/// Compares steps with the same in more components, if the law offers that. How many.
fn agrees(
    specimen: &Specimen,
    steps: impl FnOnce() -> Result<Vec<Step>, Verdict>,
) -> Result<usize, Verdict> {
    let Some((formulation, hypothesis)) = larger(specimen) else {
        return Ok(0);
    };
    let form = create_form(&formulation, hypothesis, &specimen.values);
    let Some(probe) = specimen.law.probe(&form)?.probe else {
        if specimen.adapter().is_some() {
            return Ok(0);
        }
        return Err(specimen.fails(format_args!(
            "the same parameters are refused under {}",
            hypothesis.name()
        )));
    };
    let size = hypothesis.n_components();
    let steps = steps()?;
    let more: Vec<PointStart> = steps.iter().map(|s| enlarged(&s.start, size)).collect();
    let answer = probe.integrate(&more, &specimen.form(raw::PILUM_REQ_FLUX))?;
    for (step, end) in steps.iter().zip(&answer.points) {
        let expected = longer(&step.end.flux, size);
        let then = if !is_success(end.status) {
            refusal(end.status, answer.text().as_deref())
        } else if apart(&end.flux, &expected) > ITERATED * flux_scale(step) {
            // Not tangents: at an edge of a yield surface, round-off chooses between those of its sides.
            format!("it is {:?}", end.flux)
        } else {
            continue;
        };
        let why = format!(
            "{} is {:?}, under {} {then}",
            specimen.words().stress,
            step.end.flux,
            hypothesis.name()
        );
        return Err(specimen.fails_at(&step.start, why));
    }
    Ok(steps.len())
}

/// How stresses and strains turn with the axes.
struct Turn {
    of_fluxes: DMatrix<f64>,
    of_gradients: DMatrix<f64>,
}

impl Turn {
    /// One of an interface, whose normal direction stays.
    fn of_interface(turn: DMatrix<f64>) -> Self {
        Self {
            of_fluxes: turn.clone(),
            of_gradients: turn,
        }
    }

    /// An interface with its tangential directions reversed.
    fn reversed(n_components: usize) -> Self {
        let mut signs = DVector::from_element(n_components, -1.0);
        signs[0] = 1.0;
        Self::of_interface(DMatrix::from_diagonal(&signs))
    }

    /// An interface turned about its normal; reversed in the plane.
    fn about_normal(n_components: usize, angle: f64) -> Self {
        if n_components != 3 {
            return Self::reversed(n_components);
        }
        let (sin, cos) = f64::sin_cos(angle);
        let turn = [1.0, 0.0, 0.0, 0.0, cos, -sin, 0.0, sin, cos];
        Self::of_interface(DMatrix::from_row_slice(3, 3, &turn))
    }

    /// A rotation of space, about axis 3 if components are those of a plane: how it turns stresses, and
    /// strains with γ = 2ε.
    fn of_space(n_components: usize, random: &mut Random) -> Self {
        let mut angle = || random.between(0.0, std::f64::consts::TAU);
        let turn = if n_components == 4 {
            nalgebra::Rotation3::from_euler_angles(0.0, 0.0, angle())
        } else {
            nalgebra::Rotation3::from_euler_angles(angle(), angle(), angle())
        };
        let q = turn.matrix();
        // 11, 22, 33, 12, 13, 23.
        let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
        let of_fluxes = DMatrix::from_fn(n_components, n_components, |row, column| {
            let ((i, j), (k, l)) = (pairs[row], pairs[column]);
            let once = q[(i, k)] * q[(j, l)];
            if k == l {
                once
            } else {
                once + q[(i, l)] * q[(j, k)]
            }
        });
        let of_gradients = DMatrix::from_fn(n_components, n_components, |row, column| {
            let double = |c: usize| if c < 3 { 1.0 } else { 2.0 };
            of_fluxes[(row, column)] * double(row) / double(column)
        });
        Self {
            of_fluxes,
            of_gradients,
        }
    }
}

fn turned(by: &DMatrix<f64>, values: &[f64]) -> Vec<f64> {
    (by * DVector::from_row_slice(values)).as_slice().to_vec()
}

/// Numbers that depend on the hypothesis alone, so that a replay of one of its increments finds it again on the way
/// of the whole check: it has no other.
fn own_random(subject: &Subject, name: &str, specimen: &mut Specimen) -> Random {
    if subject.at.is_some() {
        specimen.course = None;
    }
    let name = format!("{name} {}", specimen.hypothesis.name());
    Random::new(subject.seed, &name)
}

/// Pairs of points that are led side by side, and the increments of each.
struct Twins {
    n: usize,
    increments: usize,
    /// Differences of fluxes, relative to the fluxes in play, and the name of this threshold.
    tolerance: f64,
    name: Option<&'static str>,
}

const MIRRORED: Twins = Twins {
    n: 24,
    increments: 8,
    tolerance: ROUND_OFF,
    name: Some("mirrored"),
};
/// Substeps whose number follows from a tolerance need not be the same in other axes.
const ROTATED: Twins = Twins {
    n: 24,
    increments: 8,
    tolerance: 1e-4,
    name: Some("rotated"),
};
const OF_ROUTINES: Twins = Twins {
    n: 200,
    increments: 1,
    tolerance: ITERATED,
    name: None,
};

/// Fluxes of a point and of its image that do not belong together.
struct Unlike {
    /// How far, as a part of the threshold of this name.
    part: (Option<&'static str>, f64),
    start: PointStart,
    /// Flux of the point, the same turned, and that of the image.
    fluxes: [Vec<f64>; 3],
}

impl Unlike {
    /// The warning, with a hint.
    fn warns(self, specimen: &Specimen, hint: &str) -> Verdict {
        note(self.part);
        let [flux, expected, image] = &self.fluxes;
        let why = format!(
            "flux {flux:?}, turned {expected:?}, is {image:?} where the increment is turned, at {}{hint}",
            specimen.at(&self.start)
        );
        specimen.warns_for(&self.start, why)
    }
}

fn note((name, part): (Option<&'static str>, f64)) {
    if let Some(name) = name {
        margins::note(name, part);
    }
}

/// An initial flux with a direction, if the law can start there; else the pressure alone.
fn directed(specimen: &Specimen, random: &mut Random) -> Result<Origin, Verdict> {
    let origin = specimen.origin(random)?;
    let pressure = largest(&origin.start.flux0);
    let mut flux = origin.start.flux0.clone();
    for (c, value) in flux.iter_mut().enumerate() {
        let part = if c < specimen.n_normal() { 0.2 } else { 0.1 };
        *value += part * pressure * random.between(-1.0, 1.0);
    }
    Ok(specimen.started(&flux)?.unwrap_or(origin))
}

/// Leads a point along a random path from an initial flux of any direction, and its image under a
/// change of axes along that of the path. Increments at which both were compared.
fn twin(
    specimen: &Specimen,
    Turn {
        of_fluxes,
        of_gradients,
    }: &Turn,
    twins: &Twins,
    random: &mut Random,
) -> Result<Result<usize, Unlike>, Verdict> {
    let Origin {
        start: mut first,
        stiffness,
        size,
    } = directed(specimen, random)?;
    // A law may refuse what a little rounding adds.
    let Ok(image) = specimen.started(&turned(of_fluxes, &first.flux0))? else {
        return Ok(Ok(0));
    };
    let mut second = image.start;
    let mut move_ = Vec::new();
    for n in 0..twins.increments {
        if n % 4 == 0 {
            move_ = specimen.direction(size * random.logarithmic(0.03, 100.0), random);
        }
        first.gradient1 = sum(&first.gradient0, &move_);
        second.gradient1 = sum(&second.gradient0, &turned(of_gradients, &move_));
        let answer = specimen.call(&[first.clone(), second.clone()], ELASTIC)?;
        let follows = answer.points.iter().all(|end| is_success(end.status));
        let (true, Ok([a, b])) = (follows, <[_; 2]>::try_from(answer.points)) else {
            return Ok(Ok(n));
        };
        let expected = turned(of_fluxes, &a.flux);
        let scale = largest(&a.flux)
            .max(largest(&first.flux0))
            .max(stiffness * largest(&move_));
        let (off, allowed) = (apart(&expected, &b.flux), twins.tolerance * scale);
        let part = (twins.name, off / allowed);
        if off > allowed {
            return Ok(Err(Unlike {
                part,
                start: second,
                fluxes: [a.flux, expected, b.flux],
            }));
        }
        note(part);
        carry_on(&mut first, a);
        carry_on(&mut second, b);
    }
    Ok(Ok(twins.increments))
}

/// Compares interfaces with the same in other tangential directions: at how many increments.
fn turned_alike(
    subject: &Subject,
    (name, n_sets): (&str, usize),
    twins: &Twins,
    turn: impl Fn(usize, &mut Random) -> Turn,
) -> Result<usize, Verdict> {
    let mut random = Random::new(subject.seed, name);
    let mut n = 0;
    for mut specimen in subject.specimens(Draw::DefaultChoices, n_sets, &mut random)? {
        if !specimen.hypothesis.is_interface() {
            continue;
        }
        let mut random = own_random(subject, name, &mut specimen);
        for _ in 0..twins.n {
            let turn = turn(specimen.probe.n_components(), &mut random);
            n += twin(&specimen, &turn, twins, &mut random)?
                .map_err(|unlike| unlike.warns(&specimen, ""))?;
        }
    }
    Ok(n)
}

pub(super) fn tangential_axis_is_arbitrary(subject: &Subject) -> Found {
    let n = turned_alike(subject, ("mirror", 4), &MIRRORED, |n, _| Turn::reversed(n))?;
    counted(n, "points", "there is no interface law")
}

pub(in crate::check) fn tangential_directions_are_alike(subject: &Subject) -> Found {
    let turn = |n: usize, random: &mut Random| Turn::about_normal(n, random.between(0.5, 2.5));
    let n = turned_alike(subject, ("turned", 1), &OF_ROUTINES, turn)?;
    counted(n, "increments", "it is no routine of interfaces")
}

pub(super) fn response_is_isotropic(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "isotropy");
    let mut n = 0;
    for mut specimen in subject.specimens(Draw::DefaultChoices, 4, &mut random)? {
        let components = specimen.probe.n_components();
        if components < 4 || specimen.formulation.local_axes {
            continue;
        }
        let mut random = own_random(subject, "isotropy", &mut specimen);
        for _ in 0..ROTATED.n {
            let mut attempt = || {
                let turn = Turn::of_space(components, &mut random);
                twin(&specimen, &turn, &ROTATED, &mut random)
            };
            let mut found = attempt()?;
            // Where a law branches, rounding may take the other branch: a fault shows again and again.
            for _ in 0..2 {
                if found.is_err() {
                    found = attempt()?;
                }
            }
            n += found.map_err(|unlike| {
                let hint = shear_hint(&specimen, &mut random);
                let meant = "a law that is meant to have directions says so in its `doc`";
                unlike.warns(&specimen, &format!("{hint}; {meant}"))
            })?;
        }
    }
    counted(
        n,
        "increments",
        "no law of solids is without axes of its own",
    )
}

/// Hint at a shear modulus that does not fit the normal components; empty if it fits.
fn shear_hint(specimen: &Specimen, random: &mut Random) -> String {
    let Some(factor) = shear_factor(specimen, random) else {
        return String::new();
    };
    let taken = if (factor - 2.0).abs() < 1e-3 || (factor - 0.5).abs() < 1e-3 {
        ": they are handed over as γ, and not as ε"
    } else {
        ""
    };
    format!(
        "; the shear modulus is {factor:.3} times (D11 − D12)/2, where shear strains are γ = 2ε{taken}"
    )
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
