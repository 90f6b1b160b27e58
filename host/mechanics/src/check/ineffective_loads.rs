//! Loads on held or prescribed degrees of freedom: they change nothing but reactions.

use super::constraints::line;
use super::{Cause, Item, Refusal};
use crate::ground::unit_pressure;
use crate::problem::{Axis, Phase, Problem};
use std::collections::HashMap;

/// A part of a load that is smaller than this fraction of it is round-off.
const NOTHING: f64 = 1e-9;

/// What holds a degree of freedom.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Holder {
    Support,
    Prescribed,
}

/// A pressure, or a component of a force, on a line.
struct Load<'p> {
    item: Item,
    line: &'p str,
    /// Direction of a force; `None` for a pressure.
    axis: Option<Axis>,
}

impl Load<'_> {
    /// The largest value that a phase gives it, if it gives one.
    fn size(&self, phase: &Phase) -> Option<f64> {
        let Some(axis) = self.axis else {
            let mut inputs = phase.pressure.iter();
            let input = inputs.find(|input| input.line == self.line)?;
            return Some(input.value.values().fold(0.0, |a: f64, b| a.max(b.abs())));
        };
        let input = phase.force.iter().find(|input| input.line == self.line)?;
        Some([input.x, input.y][usize::from(axis == Axis::Y)]?.abs())
    }

    /// How much of it is lost, of this size on these edges of all.
    fn part_lost(
        &self,
        problem: &Problem,
        phase: &Phase,
        size: f64,
        [lost, all]: [&[(usize, usize)]; 2],
    ) -> String {
        let mesh = &problem.mesh;
        let analysis = problem.analysis;
        let area = |edges: &[(usize, usize)]| -> f64 {
            let force = unit_pressure(analysis, mesh, edges);
            let node = |f: &[f64]| f[0].hypot(f[1]);
            force.chunks_exact(2).map(node).sum()
        };
        let (lost, all) = (area(lost), area(all));
        let unit = analysis.force_unit();
        let (what, force) = match self.axis {
            None => ("pressure".to_owned(), size * lost),
            Some(axis) => (
                format!("force in {}", axis.name(analysis)),
                size * lost / all,
            ),
        };
        format!(
            "phase `{}`: {:.3} % of the {what} on line `{}` ({force:.4e} {unit}) has no effect but \
             on reactions: it acts where the displacement is held or prescribed",
            phase.name,
            100.0 * lost / all,
            self.line,
        )
    }
}

/// Refuses loads that have no effect as long as they last; returns how much of others is lost. `held`: what is held in
/// each phase, and by what.
pub(super) fn check(
    problem: &Problem,
    held: &[HashMap<usize, Holder>],
) -> Result<Vec<String>, Refusal> {
    let mut warnings = Vec::new();
    for (number, phase) in problem.phases.iter().enumerate() {
        let pressures = phase.pressure.iter().enumerate();
        let pressures = pressures.map(|(place, input)| Load {
            item: Item::Pressure(number, place),
            line: &input.line,
            axis: None,
        });
        let forces = phase.force.iter().enumerate().flat_map(|(place, input)| {
            [Axis::X, Axis::Y].map(|axis| Load {
                item: Item::Force(number, place),
                line: &input.line,
                axis: Some(axis),
            })
        });
        for load in pressures.chain(forces) {
            warnings.extend(lost(problem, number, &load, held)?);
        }
    }
    Ok(warnings)
}

/// Refuses a load that a phase gives and that does nothing as long as it lasts; returns how much of it is lost.
fn lost(
    problem: &Problem,
    number: usize,
    load: &Load<'_>,
    held: &[HashMap<usize, Holder>],
) -> Result<Option<String>, Refusal> {
    let (phases, mesh) = (&problem.phases, &problem.mesh);
    let Some(size) = load.size(&phases[number]) else {
        return Ok(None);
    };
    let later = &phases[number + 1..];
    let again = later.iter().position(|phase| load.size(phase).is_some());
    let end = again.map_or(held.len(), |later| number + 1 + later);
    let mut earlier = phases[..number].iter().rev();
    let stood = earlier.find_map(|phase| load.size(phase));
    let own = line(mesh, load.line, &load.item)?;
    let is_held = |dof: usize| match size {
        // Nothing where there was nothing: where a displacement was prescribed before, that frees nothing.
        0.0 => (number.saturating_sub(1)..end)
            .all(|phase| held[phase].get(&dof) == Some(&Holder::Prescribed)),
        _ => (number..end).all(|phase| held[phase].contains_key(&dof)),
    };
    if size == 0.0 && (number == 0 || stood.is_some_and(|stood| stood > 0.0)) {
        return Ok(None);
    }
    let components = |nodes: &[usize; 3]| match load.axis {
        Some(axis) => vec![usize::from(axis == Axis::Y)],
        None => faced(&nodes.map(|node| mesh.nodes[node])),
    };
    let is_lost = |&edge: &(usize, usize)| {
        let nodes = mesh.edge(edge);
        components(&nodes)
            .into_iter()
            .all(|c| nodes.iter().all(|node| is_held(2 * node + c)))
    };
    let lost: Vec<(usize, usize)> = own.edges.iter().copied().filter(is_lost).collect();
    let point = own.edges.is_empty().then_some(load.axis).flatten();
    let is_all_of_point = point.is_some_and(|axis| {
        let c = usize::from(axis == Axis::Y);
        own.nodes.iter().all(|node| is_held(2 * node + c))
    });
    if is_all_of_point || (!lost.is_empty() && lost.len() == own.edges.len()) {
        let cause = match load.axis {
            None => Cause::LostPressure(load.line.to_owned()),
            Some(axis) => Cause::LostForce(load.line.to_owned(), axis.name(problem.analysis)),
        };
        return Err(Refusal::new(load.item.clone(), cause));
    }
    if lost.is_empty() || size == 0.0 {
        return Ok(None);
    }
    let edges = [&lost[..], &own.edges[..]];
    Ok(Some(load.part_lost(problem, &phases[number], size, edges)))
}
/// The components in which an edge with these ends and middle faces.
fn faced(at: &[[f64; 2]; 3]) -> Vec<usize> {
    // What the edge faces, by component: the other one of its directions.
    let reach = |c: usize| {
        let step = |a: usize, b: usize| (at[b][c] - at[a][c]).abs();
        step(0, 2).max(step(2, 1))
    };
    let across = [reach(1), reach(0)];
    let least = NOTHING * across[0].max(across[1]);
    (0..2).filter(|&c| across[c] > least).collect()
}
