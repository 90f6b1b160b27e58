//! The course of a problem by increments: prescribed displacements and nodal forces.

use crate::Program;
use crate::model::{Held, Load, Step};
use mechanics::Simulation;
use mechanics::ground::Loading;
use mechanics::problem::{Axis, Phase, Problem};
use std::collections::{BTreeMap, BTreeSet};

/// Shares of the time of a phase at the ends of its increments.
fn shares(phase: &Phase) -> impl Iterator<Item = f64> + use<> {
    let n = phase.increments;
    (1..=n).map(move |k| k as f64 / n as f64)
}

/// Factor on the changes of a phase after a share of its time.
fn factor(phase: &Phase, share: f64) -> f64 {
    let course = &phase.course;
    let after = course.iter().position(|[time, _]| *time >= share);
    match (after, course.last()) {
        (Some(i), _) if i > 0 => {
            let ([t_0, f_0], [t_1, f_1]) = (course[i - 1], course[i]);
            f_0 + (share - t_0) / (t_1 - t_0) * (f_1 - f_0)
        }
        (Some(i), _) => course[i][1],
        (None, Some(last)) => last[1],
        (None, None) => share,
    }
}

pub(crate) fn steps(problem: &Problem) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    let (mut start, mut counted_from) = (0.0, None);
    for phase in &problem.phases {
        if phase.reset_displacements {
            counted_from = steps.len().checked_sub(1);
        }
        for (share, increment) in shares(phase).zip(1..) {
            steps.push(Step {
                phase: phase.name.clone(),
                increment,
                time: start + share * phase.length(),
                counted_from,
            });
        }
        start += phase.length();
    }
    steps
}

/// Values by line and component at the end of every step. Supports come before phases, each with their number.
type Courses<'p> = BTreeMap<(usize, &'p str, usize), Vec<f64>>;

/// Displacements of supports and of all phases. What a phase says counts more than a support.
pub(crate) fn held(problem: &Problem) -> Vec<Held> {
    let mut courses = Courses::new();
    let n = n_steps(problem);
    for (order, support) in problem.supports.iter().enumerate() {
        for axis in &support.fixed {
            let component = usize::from(*axis == Axis::Y);
            courses.insert((order, &support.line, component), vec![0.0; n]);
        }
    }
    add_phases(problem, &mut courses);
    let mut taken = BTreeSet::new();
    let mut all = Vec::new();
    for ((_, line, component), values) in courses.into_iter().rev() {
        let nodes = problem.mesh.lines.get(line).into_iter();
        let nodes = nodes.flat_map(|line| line.nodes.iter().copied());
        let nodes: Vec<usize> = nodes
            .filter(|&node| taken.insert((node, component)))
            .collect();
        if !nodes.is_empty() {
            all.push(Held {
                line: line.to_owned(),
                component,
                nodes,
                values,
            });
        }
    }
    all.reverse();
    all
}

fn n_steps(problem: &Problem) -> usize {
    problem.phases.iter().map(|phase| phase.increments).sum()
}

fn add_phases<'p>(problem: &'p Problem, courses: &mut Courses<'p>) {
    let (order, n) = (problem.supports.len(), n_steps(problem));
    let mut done = 0;
    // Values by line since the start, and where their count starts.
    let mut now: BTreeMap<(&str, usize), [f64; 2]> = BTreeMap::new();
    for phase in &problem.phases {
        if phase.reset_displacements {
            for [value, origin] in now.values_mut() {
                *origin = *value;
            }
        }
        let start = now.clone();
        for given in &phase.displacement {
            for (component, value) in [given.x, given.y].into_iter().enumerate() {
                if let Some(value) = value {
                    let [total, origin] = now.entry((&given.line, component)).or_default();
                    *total = *origin + value;
                }
            }
        }
        for (&(line, component), [end, _]) in &mut now {
            let from = start.get(&(line, component));
            let from = from.map_or(0.0, |[value, _]| *value);
            let key = (order, line, component);
            let values = courses.entry(key).or_insert_with(|| vec![0.0; n]);
            for (value, share) in values[done..].iter_mut().zip(shares(phase)) {
                *value = from + factor(phase, share) * (*end - from);
            }
            // A course may end elsewhere.
            *end = values[done + phase.increments - 1];
        }
        done += phase.increments;
    }
}

/// Nodal forces: those before the first phase, what each phase changes, and what the initial stress lacks to balance
/// them, which the first phase takes away.
pub(crate) fn loads(simulation: &Simulation, held: &[Held], program: Program) -> Vec<Load> {
    let problem = simulation.problem();
    let n = n_steps(problem);
    let internal = internal(simulation);
    let acting = Loading::before(problem).forces(problem, simulation.groups());
    let mut lacking = less(&internal, &acting);
    for held in held {
        for node in &held.nodes {
            lacking[2 * node + held.component] = 0.0;
        }
    }
    let always = vec![1.0; n + 1];
    let mut loads = vec![Load::of(
        "before the first phase",
        true,
        &acting,
        always.clone(),
    )];
    if program.starts_free_of_stress() {
        let against = less(&vec![0.0; internal.len()], &internal);
        loads.push(Load::of("initial stress", true, &against, always));
    }
    if let Some(first) = problem.phases.first() {
        let mut factors = vec![1.0];
        factors.extend(shares(first).map(|share| 1.0 - share));
        factors.resize(n + 1, 0.0);
        loads.push(Load::of(
            "balance of the initial stress",
            false,
            &lacking,
            factors,
        ));
    }
    loads.extend(changes(simulation, acting));
    loads.retain(|load| !load.nodes.is_empty());
    loads
}

/// Changes of nodal forces in each phase, which are `acting` at first.
fn changes(simulation: &Simulation, mut acting: Vec<f64>) -> Vec<Load> {
    let (problem, groups) = (simulation.problem(), simulation.groups());
    let mut loading = Loading::before(problem);
    let (mut done, n) = (0, n_steps(problem));
    let mut loads = Vec::new();
    for phase in &problem.phases {
        let end = loading.changed_by(phase);
        let change = less(&end.forces(problem, groups), &acting);
        let mut factors = vec![0.0; done + 1];
        factors.extend(shares(phase).map(|share| factor(phase, share)));
        let last = factors.last().copied().unwrap_or_default();
        factors.resize(n + 1, last);
        loads.push(Load::of(&phase.name, true, &change, factors));
        loading = loading.towards(&end, last);
        acting = loading.forces(problem, groups);
        done += phase.increments;
    }
    loads
}

/// Nodal forces of the stresses at the start.
fn internal(simulation: &Simulation) -> Vec<f64> {
    let n_dofs = 2 * simulation.problem().mesh.nodes.len();
    let mut internal = vec![0.0; n_dofs];
    for group in simulation.groups() {
        let own = group.forces(n_dofs);
        internal
            .iter_mut()
            .zip(own)
            .for_each(|(sum, own)| *sum += own);
    }
    internal
}

fn less(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

impl Load {
    /// The forces that are not 0, of forces by degree of freedom.
    fn of(name: &str, is_external: bool, forces: &[f64], factors: Vec<f64>) -> Self {
        let pairs = forces.chunks_exact(2).map(|pair| [pair[0], pair[1]]);
        let acts = |(_, force): &(usize, [f64; 2])| force.iter().any(|force| *force != 0.0);
        let (nodes, forces) = pairs.enumerate().filter(acts).unzip();
        Self {
            name: name.to_owned(),
            is_external,
            nodes,
            forces,
            factors,
        }
    }
}
