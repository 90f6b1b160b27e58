//! Checks of a problem without its laws: references, counts, bounds, active groups of each phase.

use super::{
    Cause, Drainage, ElementGroup, Formulation, InitialStress, Item, JointFault, Key, Phase,
    Problem, Ratio, Refusal, constraints,
};
use crate::element::Axes;
use crate::ground::beside_joints;
use crate::mesh::{Mesh, Solid};
use crate::settings::Control;
use std::collections::{HashMap, HashSet};

/// Most increments of a phase.
const MOST_INCREMENTS: usize = 10_000_000;
/// The two faces of a zero-thickness element are at the same places within this part of its length.
const APART: f64 = 1e-6;
/// A node lies beyond the axis if its radius is less than this fraction of the mesh's longer side below 0.
const BEYOND_AXIS: f64 = 1e-9;

/// Refuses dangling references, invalid numbers, and changes of inactive parts.
///
/// # Errors
/// The first part that does not fit.
pub(crate) fn problem(problem: &Problem) -> Result<(), Refusal> {
    if let Some((name, value, bounds)) = problem.settings.outside() {
        let cause = Cause::Setting(name, value, bounds);
        return Err(Refusal::new(Item::Problem, cause));
    }
    mesh(problem)?;
    let mut names = HashSet::new();
    for (number, group) in problem.groups.iter().enumerate() {
        if !names.insert(group.name.as_str()) {
            let cause = Cause::TwoGroups(group.name.clone());
            return Err(Refusal::new(Item::Group(number), cause));
        }
    }
    let faces = joints(problem)?;
    for (number, group) in problem.groups.iter().enumerate() {
        let in_phases = problem.phases.iter().flat_map(|phase| &phase.drainage);
        let is_undrained = group.drainage == Drainage::Undrained
            || in_phases
                .into_iter()
                .any(|said| *said == (number, Drainage::Undrained));
        check_group(number, group, is_undrained)?;
    }
    if let Some(water) = &problem.water
        && !(water.unit_weight.is_finite() && water.unit_weight > 0.0)
    {
        let what = "the water's `unit_weight`";
        let cause = Cause::OutOfBounds(what, water.unit_weight, "a positive number");
        return Err(Refusal::new(Item::Water(None), cause));
    }
    phases(problem, &faces)?;
    super::loads_on_interfaces::check(problem)
}

/// A face of a zero-thickness element: its group, the adjacent solid, its middle.
struct Face {
    interface: usize,
    solid: usize,
    middle: usize,
}

/// Refuses invalid zero-thickness elements. Returns the faces with an adjacent solid.
fn joints(problem: &Problem) -> Result<Vec<Face>, Refusal> {
    let mesh = &problem.mesh;
    let beside = beside_joints(mesh);
    let mut faces = Vec::new();
    for joint in &mesh.joints {
        let place = |node: usize| mesh.nodes[node];
        let apart = |a: usize, b: usize| {
            let ([x_a, y_a], [x_b, y_b]) = (place(a), place(b));
            (x_b - x_a).hypot(y_b - y_a)
        };
        let [a, b, middle] = joint.minus;
        let refuse = |fault| {
            let group = problem.groups[joint.group].name.clone();
            let at = place(middle);
            let cause = Cause::BadJoint { group, at, fault };
            Err(Refusal::new(Item::Group(joint.group), cause))
        };
        let length = apart(a, b);
        if length <= 0.0 {
            return refuse(JointFault::NoLength);
        }
        let mut pairs = joint.minus.into_iter().zip(joint.plus);
        if pairs.any(|(minus, plus)| apart(minus, plus) > APART * length) {
            return refuse(JointFault::Apart);
        }
        let radii = joint.minus.map(|node| place(node)[0]);
        let on_axis = radii.into_iter().all(|r| r <= BEYOND_AXIS * length);
        if problem.analysis == super::Analysis::Axisymmetric && on_axis {
            return refuse(JointFault::OnAxis);
        }
        let chord = [0, 1].map(|c| place(b)[c] - place(a)[c]);
        let across = Axes::of_facet(chord).across;
        // Close to 45° the last bit of the coordinates says which side is that of the greater ones.
        let is_told = (chord[0].abs() - chord[1].abs()).abs() > APART * length;
        for (middle, side) in [(joint.minus[2], -1.0), (joint.plus[2], 1.0)] {
            let Some(&solid) = beside.get(&middle) else {
                continue;
            };
            // Edges run counter-clockwise: (−dy, dx) points into the solid.
            let edge = mesh.solids[solid].edges().find(|edge| edge[2] == middle);
            let inward = edge.map(|[a, b, _]| {
                let ([x_a, y_a], [x_b, y_b]) = (place(a), place(b));
                [y_a - y_b, x_b - x_a]
            });
            let towards = inward.map_or(0.0, |[x, y]| x * across[0] + y * across[1]);
            if is_told && side * towards < 0.0 {
                return refuse(JointFault::Turned);
            }
            faces.push(Face {
                interface: joint.group,
                solid: mesh.solids[solid].group,
                middle,
            });
        }
    }
    Ok(faces)
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

fn mesh(problem: &Problem) -> Result<(), Refusal> {
    let mesh = &problem.mesh;
    let (n, n_groups) = (mesh.nodes.len(), problem.groups.len());
    let refuse = |cause| Err(Refusal::new(Item::Problem, cause));
    let of_elements = mesh.solids.iter().map(|solid| solid.group);
    let of_joints = mesh.joints.iter().map(|joint| joint.group);
    if let Some(group) = of_elements
        .chain(of_joints)
        .find(|&group| group >= n_groups)
    {
        return refuse(Cause::NoGroup(group));
    }
    let solid_nodes = mesh
        .solids
        .iter()
        .flat_map(|solid| solid.nodes().iter().copied());
    let joint_nodes = mesh
        .joints
        .iter()
        .flat_map(|joint| joint.minus.into_iter().chain(joint.plus));
    if solid_nodes.chain(joint_nodes).any(|node| node >= n) {
        return refuse(Cause::OutOfRange("an element"));
    }
    for line in mesh.lines.values() {
        let has_edge = |&(solid, edge): &(usize, usize)| {
            mesh.solids
                .get(solid)
                .is_some_and(|solid| edge < solid.n_corners())
        };
        if !line.edges.iter().all(has_edge) || line.nodes.iter().any(|&node| node >= n) {
            return refuse(Cause::OutOfRange("a line"));
        }
    }
    if mesh.nodes.iter().flatten().any(|at| !at.is_finite()) {
        return refuse(Cause::NotFinite("a coordinate"));
    }
    let is_joint = |group: usize| problem.groups[group].formulation == Formulation::ZeroThickness;
    let solids = mesh.solids.iter().map(|solid| (solid.group, false));
    let joints = mesh.joints.iter().map(|joint| (joint.group, true));
    if let Some((group, _)) = solids
        .chain(joints)
        .find(|&(group, joint)| is_joint(group) != joint)
    {
        let own = &problem.groups[group];
        let cause = Cause::OtherElements(own.name.clone(), own.formulation);
        return Err(Refusal::new(Item::Group(group), cause));
    }
    if problem.analysis == super::Analysis::Axisymmetric {
        let least = -BEYOND_AXIS * mesh.longer_side();
        let beyond = |solid: &&Solid| {
            solid
                .nodes()
                .iter()
                .any(|&node| mesh.nodes[node][0] < least)
        };
        if let Some(solid) = mesh.solids.iter().find(beyond) {
            let cause = Cause::BadShape(problem.groups[solid.group].name.clone());
            return Err(Refusal::new(Item::Group(solid.group), cause));
        }
    }
    Ok(())
}

/// `is_undrained`: in some phase.
fn check_group(number: usize, group: &ElementGroup, is_undrained: bool) -> Result<(), Refusal> {
    let refuse = |key, cause| Err(Refusal::new(Item::GroupKey(number, key), cause));
    let weights = [Some(group.unit_weight), group.saturated_unit_weight];
    if let Some(weight) = weights
        .into_iter()
        .flatten()
        .find(|w| !(w.is_finite() && *w >= 0.0))
    {
        let cause = Cause::OutOfBounds("the unit weight", weight, "zero or more");
        return refuse(Key::UnitWeight, cause);
    }
    let is_solid = group.formulation == Formulation::Solid;
    if group.formulation == Formulation::ZeroThickness
        && weights.into_iter().flatten().any(|weight| weight > 0.0)
    {
        let cause = Cause::Misplaced(Key::UnitWeight, group.formulation);
        return refuse(Key::UnitWeight, cause);
    }
    if group.drainage == Drainage::Undrained && !is_solid {
        let cause = Cause::Misplaced(Key::Drainage, group.formulation);
        return refuse(Key::Drainage, cause);
    }
    if is_undrained && is_solid {
        if !group.pore_water {
            return refuse(
                Key::Drainage,
                Cause::UndrainedWithoutWater(group.name.clone()),
            );
        }
        let nu = group.undrained_poisson_ratio;
        if !(nu > 0.0 && nu < 0.5) {
            let what = "`undrained_poisson_ratio`";
            let cause = Cause::OutOfBounds(what, nu, "more than 0, less than 0.5");
            return refuse(Key::UndrainedPoissonRatio, cause);
        }
    }
    match &group.initial_stress {
        Some(InitialStress::Constant(stress)) if stress.iter().any(|s| !s.is_finite()) => {
            refuse(Key::InitialStress, Cause::NotFinite("`initial_stress`"))
        }
        Some(InitialStress::AtRest(_)) if !is_solid => {
            let cause = Cause::AtRestInInterface(group.formulation);
            refuse(Key::InitialStress, cause)
        }
        Some(InitialStress::AtRest(at_rest)) => match unlikely(&at_rest.ratio) {
            Some(cause) => refuse(Key::InitialStress, cause),
            None if at_rest.surcharge.is_some_and(|kpa| !kpa.is_finite()) => {
                refuse(Key::InitialStress, Cause::NotFinite("`surcharge`"))
            }
            None => Ok(()),
        },
        _ => Ok(()),
    }
}

/// The value of an earth pressure at rest that is out of bounds.
fn unlikely(ratio: &Ratio) -> Option<Cause> {
    let outside = |what, mut values: Box<dyn Iterator<Item = f64> + '_>, least: f64, bounds| {
        let value = values.find(|value| *value < least);
        value.map(|value| Cause::OutOfBounds(what, value, bounds))
    };
    match ratio {
        Ratio::K0(k_0) => outside("`k_0`", Box::new(k_0.values()), 0.0, "zero or more"),
        Ratio::Overconsolidated {
            friction_angle,
            ocr,
            pop,
            poisson_ratio,
        } => {
            let steep = friction_angle.values().find(|phi| *phi >= 90.0);
            let steep =
                steep.map(|phi| Cause::OutOfBounds("`friction_angle`", phi, "less than 90"));
            let nu = *poisson_ratio;
            let no_ratio = !(0.0..0.5).contains(&nu);
            steep
                .or_else(|| {
                    outside(
                        "`friction_angle`",
                        Box::new(friction_angle.values()),
                        0.0,
                        "zero or more",
                    )
                })
                .or_else(|| outside("`ocr`", Box::new(ocr.values()), 1.0, "1 or more"))
                .or_else(|| outside("`pop`", Box::new(pop.values()), 0.0, "zero or more"))
                .or_else(|| {
                    no_ratio.then_some(Cause::OutOfBounds(
                        "`poisson_ratio`",
                        nu,
                        "0 to less than 0.5",
                    ))
                })
        }
    }
}

fn phases(problem: &Problem, sides: &[Face]) -> Result<(), Refusal> {
    if problem.phases.is_empty() {
        return Err(Refusal::new(Item::Problem, Cause::NoPhase));
    }
    let mut active: Vec<bool> = problem.groups.iter().map(|group| group.is_active).collect();
    let faces = problem.mesh.joints.iter().flat_map(|joint| {
        let (minus, plus) = (joint.minus[2], joint.plus[2]);
        [(minus, plus), (plus, minus)]
    });
    let faces: HashMap<usize, usize> = faces.collect();
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
        let n = problem.groups.len();
        let named = phase.materials.iter().map(|(group, _)| group);
        let named = named.chain(&phase.activate).chain(&phase.deactivate);
        let named = named.chain(phase.unit_weight.iter().map(|(group, _)| group));
        let mut named = named.chain(phase.drainage.iter().map(|(group, _)| group));
        if let Some(group) = named.find(|&&group| group >= n) {
            return refuse(Cause::NoGroup(*group));
        }
        given_twice(problem, number, phase)?;
        activation(problem, number, phase, &mut active)?;
        refuse_gone(problem, number, phase, sides, &active)?;
        ground(problem, number, phase)?;
        time(number, phase)?;
        course(problem, number, phase)?;
        let there: HashMap<usize, usize> = edges_there(&problem.mesh, &active);
        pressures(problem, number, phase, &there, &faces)?;
        forces(problem, number, phase, &there)?;
        for (place, displacement) in phase.displacement.iter().enumerate() {
            let values = [displacement.x, displacement.y];
            if values.into_iter().flatten().any(|value| !value.is_finite()) {
                return refuse(Cause::NotFinite("a displacement"));
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
        for (place, line) in phase.rigid.iter().enumerate() {
            let item = Item::Rigid(number, place);
            let edges = &constraints::line(&problem.mesh, line, &item)?.edges;
            let mut middles = edges.iter().map(|&edge| problem.mesh.edge(edge)[2]);
            if middles.any(|middle| faces.contains_key(&middle)) {
                return Err(Refusal::new(item, Cause::RigidInterface(line.clone())));
            }
        }
    }
    Ok(())
}

/// A phase gives a group one material, one weight, one drainage.
fn given_twice(problem: &Problem, number: usize, phase: &Phase) -> Result<(), Refusal> {
    let second = |groups: Vec<usize>| {
        let mut seen = HashSet::new();
        groups.into_iter().find(|group| !seen.insert(*group))
    };
    let materials = phase.materials.iter().map(|(group, _)| *group);
    let weights = phase.unit_weight.iter().map(|(group, _)| *group);
    let drainage = phase.drainage.iter().map(|(group, _)| *group);
    let lists: [(&'static str, Vec<usize>); 3] = [
        ("a law", materials.collect()),
        ("a unit weight", weights.collect()),
        ("a drainage", drainage.collect()),
    ];
    for (what, groups) in lists {
        if let Some(group) = second(groups) {
            let cause = Cause::GivenTwice(what, problem.groups[group].name.clone());
            return Err(Refusal::new(Item::Phase(number), cause));
        }
    }
    Ok(())
}

/// For every middle node of an edge, the number of active elements with it.
pub(super) fn edges_there(mesh: &Mesh, active: &[bool]) -> HashMap<usize, usize> {
    let mut there = HashMap::new();
    let solids = mesh.solids.iter().filter(|solid| active[solid.group]);
    for edge in solids.flat_map(Solid::edges) {
        *there.entry(edge[2]).or_default() += 1;
    }
    there
}

fn activation(
    problem: &Problem,
    number: usize,
    phase: &Phase,
    active: &mut [bool],
) -> Result<(), Refusal> {
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
        if active[group] == is_activated || !changed.insert(group) {
            let is_active = is_activated;
            return Err(Refusal::new(
                item,
                Cause::AlreadySo {
                    group: name,
                    is_active,
                },
            ));
        }
        active[group] = is_activated;
    }
    if active.contains(&true) {
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
            return refuse(Cause::OutOfBounds(
                "the unit weight",
                weight,
                "zero or more",
            ));
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

/// Longest time of a phase.
pub(super) const LONGEST: f64 = 1e20;

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

fn pressures(
    problem: &Problem,
    number: usize,
    phase: &Phase,
    there: &HashMap<usize, usize>,
    faces: &HashMap<usize, usize>,
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
        let opposite = |middle: &usize| faces.get(middle).filter(|face| there.contains_key(*face));
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
            return refuse(Cause::NoValue(name.to_owned(), problem.analysis));
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
