//! Checks of phases: references, counts, bounds, active groups, loads on what is there.

use super::mesh::Face;
use super::{Cause, Item, Key, Refusal, constraints, edges_there, opposite_faces};
use crate::problem::{Formulation, Phase, Problem};
use crate::settings::Control;
use std::collections::{HashMap, HashSet};

/// Most increments of a phase.
const MOST_INCREMENTS: usize = 10_000_000;
/// Largest stress-free strain: small strains are assumed.
const LARGEST_STRAIN: f64 = 0.1;
/// Longest time of a phase.
pub const LONGEST: f64 = 1e20;

/// Refuses phases that cannot be computed, in their order. `sides`: the faces of interfaces.
pub(super) fn check(problem: &Problem, sides: &[Face]) -> Result<(), Refusal> {
    if problem.phases.is_empty() {
        return Err(Refusal::new(Item::Problem, Cause::NoPhase));
    }
    let faces = opposite_faces(&problem.mesh);
    let mut names: Vec<&str> = Vec::new();
    for (number, phase) in problem.phases.iter().enumerate() {
        let refuse = |cause| Err(Refusal::new(Item::Phase(number), cause));
        let name = phase.name.as_str();
        if name.trim().is_empty() {
            return refuse(Cause::PhaseWithoutName);
        }
        if names.contains(&name) {
            return refuse(Cause::TwoPhases(name.to_owned()));
        }
        names.push(name);
        if phase.increments == 0 || phase.increments > MOST_INCREMENTS {
            return refuse(Cause::Increments(phase.increments));
        }
        refuse_no_group(problem, number, phase)?;
        given_twice(problem, number, phase)?;
        activation(problem, number, phase)?;
        let active = problem.active_after(number + 1);
        refuse_gone(problem, number, phase, sides, &active)?;
        ground(problem, number, phase)?;
        time(number, phase)?;
        course(problem, number, phase)?;
        until(number, phase)?;
        strains(problem, number, phase)?;
        let there = edges_there(&problem.mesh, &active);
        pressures(problem, number, phase, &there, &faces)?;
        forces(problem, number, phase, &there)?;
        displacements(problem, number, phase, &there)?;
        rigid_lines(problem, number, phase, &faces)?;
    }
    Ok(())
}

/// Groups that a phase changes must be there.
fn refuse_no_group(problem: &Problem, number: usize, phase: &Phase) -> Result<(), Refusal> {
    let n = problem.groups.len();
    let named = phase.materials.iter().map(|(group, _)| group);
    let named = named.chain(&phase.activate).chain(&phase.deactivate);
    let named = named.chain(phase.unit_weight.iter().map(|(group, _)| group));
    let named = named.chain(phase.drainage.iter().map(|(group, _)| group));
    let mut named = named.chain(phase.strain.iter().map(|(group, _)| group));
    match named.find(|&&group| group >= n) {
        Some(&group) => Err(Refusal::new(Item::Phase(number), Cause::NoGroup(group))),
        None => Ok(()),
    }
}

/// A phase gives a group one material, one weight, one drainage, one strain.
fn given_twice(problem: &Problem, number: usize, phase: &Phase) -> Result<(), Refusal> {
    let second = |groups: Vec<usize>| {
        let mut seen = HashSet::new();
        groups.into_iter().find(|group| !seen.insert(*group))
    };
    let materials = phase.materials.iter().map(|(group, _)| *group);
    let weights = phase.unit_weight.iter().map(|(group, _)| *group);
    let drainage = phase.drainage.iter().map(|(group, _)| *group);
    let strains = phase.strain.iter().map(|(group, _)| *group);
    let lists: [(&'static str, Vec<usize>); 4] = [
        ("a law", materials.collect()),
        ("a unit weight", weights.collect()),
        ("a drainage", drainage.collect()),
        ("a strain", strains.collect()),
    ];
    for (what, groups) in lists {
        if let Some(group) = second(groups) {
            let cause = Cause::GivenTwice(what, problem.groups[group].name.clone());
            return Err(Refusal::new(Item::Phase(number), cause));
        }
    }
    Ok(())
}

/// An interface with an inactive side is not held.
fn refuse_gone(
    problem: &Problem,
    number: usize,
    phase: &Phase,
    faces: &[Face],
    active: &[bool],
) -> Result<(), Refusal> {
    let gone = faces
        .iter()
        .find(|face| active[face.interface] && !active[face.solid]);
    let Some(face) = gone else {
        return Ok(());
    };
    let changed = |group: usize, is_activated: bool| Item::Activation {
        phase: number,
        group,
        is_activated,
    };
    let item = if phase.deactivate.contains(&face.solid) {
        changed(face.solid, false)
    } else if phase.activate.contains(&face.interface) {
        changed(face.interface, true)
    } else {
        Item::Group(face.interface)
    };
    let name = |group: usize| problem.groups[group].name.clone();
    let cause = Cause::FaceGone {
        interface: name(face.interface),
        solid: name(face.solid),
        at: problem.mesh.nodes[face.middle],
    };
    Err(Refusal::new(item, cause))
}

fn activation(problem: &Problem, number: usize, phase: &Phase) -> Result<(), Refusal> {
    let before = problem.active_after(number);
    let changes = phase.activate.iter().map(|&group| (group, true));
    let changes = changes.chain(phase.deactivate.iter().map(|&group| (group, false)));
    let mut changed = HashSet::new();
    for (group, is_activated) in changes {
        let item = Item::Activation {
            phase: number,
            group,
            is_activated,
        };
        let name = problem.groups[group].name.clone();
        if phase.activate.contains(&group) && phase.deactivate.contains(&group) {
            return Err(Refusal::new(item, Cause::BothWays(name)));
        }
        if before[group] == is_activated || !changed.insert(group) {
            let is_active = is_activated;
            return Err(Refusal::new(
                item,
                Cause::AlreadySo {
                    group: name,
                    is_active,
                },
            ));
        }
    }
    if problem.active_after(number + 1).contains(&true) {
        return Ok(());
    }
    // Taken away last, or never there.
    let item = phase.deactivate.last().map_or(Item::Group(0), |&group| {
        let (phase, is_activated) = (number, false);
        Item::Activation {
            phase,
            group,
            is_activated,
        }
    });
    Err(Refusal::new(item, Cause::NothingThere(phase.name.clone())))
}

fn ground(problem: &Problem, number: usize, phase: &Phase) -> Result<(), Refusal> {
    if phase.water_level.is_some() && problem.water.is_none() {
        return Err(Refusal::new(Item::Water(Some(number)), Cause::NoWater));
    }
    for (place, &(group, weight)) in phase.unit_weight.iter().enumerate() {
        let refuse = |cause| Err(Refusal::new(Item::UnitWeight(number, place), cause));
        let formulation = problem.groups[group].formulation;
        if formulation == Formulation::ZeroThickness {
            return refuse(Cause::Misplaced(Key::UnitWeight, formulation));
        }
        if !(weight.is_finite() && weight >= 0.0) {
            let what = "`unit_weight`";
            return refuse(Cause::OutOfBounds(what, weight, "zero or more"));
        }
    }
    for (place, &(group, _)) in phase.drainage.iter().enumerate() {
        let formulation = problem.groups[group].formulation;
        if formulation != Formulation::Solid {
            let cause = Cause::Misplaced(Key::Drainage, formulation);
            return Err(Refusal::new(Item::DrainageOf(number, place), cause));
        }
    }
    Ok(())
}

fn time(number: usize, phase: &Phase) -> Result<(), Refusal> {
    let time = phase.length();
    if time > 0.0 && time <= LONGEST {
        return Ok(());
    }
    Err(Refusal::new(Item::Time(number), Cause::BadTime(time)))
}

fn course(problem: &Problem, number: usize, phase: &Phase) -> Result<(), Refusal> {
    let course = &phase.course;
    let (Some(first), Some(last)) = (course.first(), course.last()) else {
        return Ok(());
    };
    let refuse = |cause| Err(Refusal::new(Item::Course(number), cause));
    let rises = course.windows(2).all(|pair| pair[0][0] < pair[1][0]);
    let is_finite = course.iter().flatten().all(|value| value.is_finite());
    let starts = first.iter().all(|value| *value == 0.0);
    if !starts || last[0].to_bits() != 1.0_f64.to_bits() || !rises || !is_finite {
        return refuse(Cause::BadCourse);
    }
    if problem.settings.control == Control::ArcLength {
        return refuse(Cause::CourseOfArcLength);
    }
    Ok(())
}

/// Refuses `until` in a phase with changes that must be complete at its end, such as activated groups.
fn until(number: usize, phase: &Phase) -> Result<(), Refusal> {
    let Some(until) = &phase.until else {
        return Ok(());
    };
    let refuse = |cause| Err(Refusal::new(Item::Until(number), cause));
    if !until.reaches.is_finite() {
        return refuse(Cause::NotFinite("the value that `until` names"));
    }
    let changes = [
        ("unit_weight", !phase.unit_weight.is_empty()),
        ("water", phase.water_level.is_some()),
        ("laws", !phase.materials.is_empty()),
        ("activate", !phase.activate.is_empty()),
        ("deactivate", !phase.deactivate.is_empty()),
        ("strain", !phase.strain.is_empty()),
    ];
    match changes.into_iter().find(|(_, is_changed)| *is_changed) {
        Some((key, _)) => refuse(Cause::UntilBeside(key)),
        None => Ok(()),
    }
}

fn strains(problem: &Problem, number: usize, phase: &Phase) -> Result<(), Refusal> {
    for (place, &(group, strain)) in phase.strain.iter().enumerate() {
        let refuse = |cause| Err(Refusal::new(Item::Strain(number, place), cause));
        let group = &problem.groups[group];
        if group.formulation == Formulation::ZeroThickness {
            return refuse(Cause::StrainOfInterface(group.name.clone()));
        }
        for value in strain {
            if value.is_nan() || value.abs() > LARGEST_STRAIN {
                return refuse(Cause::OutOfBounds(
                    "a strain",
                    value,
                    "at most 0.1 either way",
                ));
            }
        }
        if problem.settings.control == Control::ArcLength {
            return refuse(Cause::StrainUnderArcLength);
        }
    }
    Ok(())
}

fn pressures(
    problem: &Problem,
    number: usize,
    phase: &Phase,
    there: &HashMap<usize, usize>,
    faces: &HashMap<usize, (usize, usize)>,
) -> Result<(), Refusal> {
    let mesh = &problem.mesh;
    let mut lines: Vec<&str> = Vec::new();
    for (place, input) in phase.pressure.iter().enumerate() {
        let item = Item::Pressure(number, place);
        let name = input.line.as_str();
        let refuse = |cause| Err(Refusal::new(item.clone(), cause));
        if lines.contains(&name) {
            return refuse(Cause::TwoPressures(name.to_owned()));
        }
        lines.push(name);
        if input.value.values().any(|value| !value.is_finite()) {
            return refuse(Cause::NotFinite("the pressure"));
        }
        let line = constraints::line(mesh, name, &item)?;
        let middles = || line.edges.iter().map(|&edge| mesh.edge(edge)[2]);
        let earlier = problem.phases[..number].iter();
        let mut earlier = earlier.flat_map(|phase| &phase.pressure);
        let is_away = || middles().all(|middle| !there.contains_key(&middle));
        if input.is_none() && (earlier.any(|other| other.line == name) || is_away()) {
            continue;
        }
        let opposite = |middle: &usize| {
            faces
                .get(middle)
                .filter(|(face, _)| there.contains_key(face))
        };
        if middles().any(|middle| there.contains_key(&middle) && opposite(&middle).is_some()) {
            return refuse(Cause::OnInterface("pressure", name.to_owned()));
        }
        if line.edges.is_empty()
            || middles().any(|middle| there.get(&middle).is_some_and(|n| *n > 1))
        {
            return refuse(Cause::NoBoundary(name.to_owned()));
        }
        if middles().any(|middle| !there.contains_key(&middle) && opposite(&middle).is_none()) {
            return refuse(Cause::NotThere(name.to_owned()));
        }
    }
    Ok(())
}

fn forces(
    problem: &Problem,
    number: usize,
    phase: &Phase,
    there: &HashMap<usize, usize>,
) -> Result<(), Refusal> {
    let mesh = &problem.mesh;
    let mut lines: Vec<&str> = Vec::new();
    for (place, input) in phase.force.iter().enumerate() {
        let item = Item::Force(number, place);
        let name = input.line.as_str();
        let line = constraints::line(mesh, name, &item)?;
        let refuse = |cause| Err(Refusal::new(item.clone(), cause));
        if lines.contains(&name) {
            return refuse(Cause::TwoForces(name.to_owned()));
        }
        lines.push(name);
        if input.x.is_none() && input.y.is_none() {
            return refuse(Cause::NoValue("force", name.to_owned(), problem.analysis));
        }
        if [input.x, input.y]
            .into_iter()
            .flatten()
            .any(|value| !value.is_finite())
        {
            return refuse(Cause::NotFinite("the force"));
        }
        let mut middles = line.edges.iter().map(|&edge| mesh.edge(edge)[2]);
        if !input.is_none() && middles.any(|middle| !there.contains_key(&middle)) {
            return refuse(Cause::NotThere(name.to_owned()));
        }
    }
    Ok(())
}

fn displacements(
    problem: &Problem,
    number: usize,
    phase: &Phase,
    there: &HashMap<usize, usize>,
) -> Result<(), Refusal> {
    for (place, displacement) in phase.displacement.iter().enumerate() {
        let values = [displacement.x, displacement.y];
        if values.into_iter().flatten().any(|value| !value.is_finite()) {
            let cause = Cause::NotFinite("a displacement");
            return Err(Refusal::new(Item::Phase(number), cause));
        }
        let line = problem.mesh.lines.get(&displacement.line);
        let mut middles = line.iter().flat_map(|line| &line.edges).peekable();
        let is_gone = |&edge: &_| !there.contains_key(&problem.mesh.edge(edge)[2]);
        if middles.peek().is_some() && middles.all(is_gone) {
            let item = Item::Displacement(number, place);
            return Err(Refusal::new(
                item,
                Cause::NotThere(displacement.line.clone()),
            ));
        }
    }
    Ok(())
}

fn rigid_lines(
    problem: &Problem,
    number: usize,
    phase: &Phase,
    faces: &HashMap<usize, (usize, usize)>,
) -> Result<(), Refusal> {
    for (place, line) in phase.rigid.iter().enumerate() {
        let item = Item::Rigid(number, place);
        let edges = &constraints::line(&problem.mesh, line, &item)?.edges;
        let mut middles = edges.iter().map(|&edge| problem.mesh.edge(edge)[2]);
        if middles.any(|middle| faces.contains_key(&middle)) {
            return Err(Refusal::new(item, Cause::RigidInterface(line.clone())));
        }
    }
    Ok(())
}
