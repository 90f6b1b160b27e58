//! Loads and supports on lines along interfaces: on which face do they act?

use super::{Cause, Item, Refusal, edges_there, opposite_faces};
use crate::problem::{Axis, Phase, Problem};

/// A support, displacement or force on a line.
struct Said<'p> {
    what: &'static str,
    line: &'p str,
    item: Item,
    /// It acts in these directions.
    acts: [bool; 2],
}

/// Refuses forces, displacements and supports on lines along an active interface: they would act on both of its faces.
/// Names the input, or the activation of the interface if the phase brings it.
pub(super) fn check(problem: &Problem) -> Result<(), Refusal> {
    let mesh = &problem.mesh;
    let opposite = opposite_faces(mesh);
    if opposite.is_empty() {
        return Ok(());
    }
    let supports = problem.supports.iter().enumerate();
    let supports = supports.map(|(number, support)| Said {
        what: "support",
        line: &support.line,
        item: Item::Support(number),
        acts: [Axis::X, Axis::Y].map(|axis| support.fixed.contains(&axis)),
    });
    let mut said: Vec<Said<'_>> = supports.collect();
    for (number, phase) in problem.phases.iter().enumerate() {
        take_over(number, phase, &mut said);
        let active = problem.active_after(number + 1);
        let there = edges_there(mesh, &active);
        for said in said.iter().filter(|said| said.acts.contains(&true)) {
            let Some(own) = mesh.lines.get(said.line) else {
                continue;
            };
            let interface = |middle: &usize| {
                let (other, group) = opposite.get(middle)?;
                let both = [middle, other];
                let is_between = active[*group] && both.iter().all(|face| there.contains_key(face));
                // A line of one face has no nodes of the other.
                (is_between && own.nodes.contains(other)).then_some(*group)
            };
            let mut middles = own.edges.iter().map(|&edge| mesh.edge(edge)[2]);
            let Some(group) = middles.find_map(|middle| interface(&middle)) else {
                continue;
            };
            let item = if phase.activate.contains(&group) {
                Item::Activation {
                    phase: number,
                    group,
                    is_activated: true,
                }
            } else {
                said.item.clone()
            };
            let cause = Cause::OnInterface(said.what, said.line.to_owned());
            return Err(Refusal::new(item, cause));
        }
    }
    Ok(())
}

/// Takes over what a phase frees, gives and moves.
fn take_over<'p>(number: usize, phase: &'p Phase, said: &mut Vec<Said<'p>>) {
    for free in &phase.free {
        let holds = |said: &&mut Said<'_>| said.what != "force" && said.line == free.line;
        for said in said.iter_mut().filter(holds) {
            for axis in &free.components {
                said.acts[usize::from(*axis == Axis::Y)] = false;
            }
        }
    }
    let forces = phase.force.iter().enumerate().map(|(place, input)| {
        let acts = [input.x, input.y].map(|force| Some(force? != 0.0));
        ("force", &input.line, Item::Force(number, place), acts)
    });
    let moves = phase.displacement.iter().enumerate();
    let moves = moves.map(|(place, input)| {
        let item = Item::Displacement(number, place);
        let acts = [input.x, input.y].map(|by| by.map(|_| true));
        ("displacement", &input.line, item, acts)
    });
    for (what, line, item, acts) in forces.chain(moves) {
        let same = said
            .iter()
            .position(|other| other.what == what && other.line == line);
        let before = same.map_or([false; 2], |same| said.remove(same).acts);
        said.push(Said {
            what,
            line,
            item,
            acts: [0, 1].map(|c| acts[c].unwrap_or(before[c])),
        });
    }
}
