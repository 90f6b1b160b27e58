//! Whether supports and prescribed displacements fit together, phase by phase.

use super::ineffective_loads::{self, Holder};
use super::restraint::{Motion, Part, loose, parts};
use super::{Cause, Item, Refusal};
use crate::assembly::Tie;
use crate::mesh::{Line, Mesh};
use crate::problem::tied_dofs::TiedDofs;
use crate::problem::{Analysis, Axis, Displacement, Free, Phase, Problem};
use std::collections::HashMap;

/// A node is on the axis of symmetry within this fraction of the largest radius.
const ON_AXIS: f64 = 1e-9;

/// Follows the constraints through the phases. Refuses what contradicts itself or has no effect,
/// and phases in which a part of the model is not held. Returns what is plausible but seldom meant.
///
/// # Errors
/// The line or the phase.
pub(crate) fn check(problem: &Problem, ties: &[Tie]) -> Result<Vec<String>, Refusal> {
    let parts_after = |phases: usize| {
        let active = problem.active_after(phases);
        parts(&problem.mesh, &|group| active[group])
    };
    let mut constraints = Constraints {
        problem,
        mesh: &problem.mesh,
        parts: parts_after(0),
        held: HashMap::new(),
        values: HashMap::new(),
    };
    constraints.support()?;
    let mut warnings = Vec::new();
    // What is held in each phase.
    let mut held: Vec<HashMap<usize, Holder>> = Vec::new();
    for (number, phase) in problem.phases.iter().enumerate() {
        if !phase.activate.is_empty() || !phase.deactivate.is_empty() {
            constraints.parts = parts_after(number + 1);
        }
        if phase.reset_displacements {
            constraints.values.clear();
        }
        let mut released = Vec::new();
        for (place, free) in phase.free.iter().enumerate() {
            constraints.release(free, Item::Free(number, place), &mut released)?;
        }
        let mut values = HashMap::new();
        for (place, displacement) in phase.displacement.iter().enumerate() {
            let item = Item::Displacement(number, place);
            constraints.prescribe(displacement, &item, &mut values)?;
        }
        constraints.refuse_free_for_nothing(&released, &values)?;
        constraints.refuse_loose(number, phase)?;
        let given = values.iter().map(|(&dof, &(value, _))| (dof, value));
        constraints.values.extend(given);
        constraints.refuse_tied(number, phase, ties)?;
        if warnings.is_empty() {
            warnings.extend(constraints.free_axis(phase));
        }
        held.push(constraints.held_in(number));
    }
    warnings.extend(ineffective_loads::check(problem, &held)?);
    Ok(warnings)
}

/// The line of this name.
pub(crate) fn line<'m>(mesh: &'m Mesh, name: &str, item: &Item) -> Result<&'m Line, Refusal> {
    mesh.lines.get(name).ok_or_else(|| {
        let cause = Cause::NoLine {
            name: name.to_owned(),
            known: mesh.lines.keys().cloned().collect(),
        };
        Refusal::new(item.clone(), cause)
    })
}

/// A component of a line that a phase frees, though an earlier phase prescribed it.
struct Released<'p> {
    line: &'p str,
    item: Item,
    axis: Axis,
    dofs: Vec<usize>,
}

struct Constraints<'a> {
    problem: &'a Problem,
    mesh: &'a Mesh,
    parts: Vec<Part>,
    held: HashMap<usize, Holder>,
    /// The displacement prescribed where a support holds, if it is not zero, m.
    values: HashMap<usize, f64>,
}

impl<'a> Constraints<'a> {
    /// Holds what supports fix.
    fn support(&mut self) -> Result<(), Refusal> {
        for (number, support) in self.problem.supports.iter().enumerate() {
            let item = Item::Support(number);
            if support.fixed.is_empty() {
                let line = support.line.clone();
                let is_free = false;
                return Err(Refusal::new(item, Cause::NoComponents { line, is_free }));
            }
            for axis in &support.fixed {
                let dofs = self.dofs(&support.line, *axis, &item)?;
                self.held.extend(dofs.map(|dof| (dof, Holder::Support)));
            }
        }
        Ok(())
    }

    fn dofs(
        &self,
        name: &str,
        axis: Axis,
        item: &Item,
    ) -> Result<impl Iterator<Item = usize> + use<'a>, Refusal> {
        let component = usize::from(axis == Axis::Y);
        let nodes = &line(self.mesh, name, item)?.nodes;
        Ok(nodes.iter().map(move |node| 2 * node + component))
    }

    /// Name of a direction as the analysis calls it.
    fn name(&self, axis: Axis) -> &'static str {
        axis.name(self.problem.analysis)
    }

    fn release<'p>(
        &mut self,
        free: &'p Free,
        item: Item,
        released: &mut Vec<Released<'p>>,
    ) -> Result<(), Refusal> {
        if free.components.is_empty() {
            let line = free.line.clone();
            let is_free = true;
            return Err(Refusal::new(item, Cause::NoComponents { line, is_free }));
        }
        for &axis in &free.components {
            let mut dofs = self.dofs(&free.line, axis, &item)?;
            if !dofs.any(|dof| self.held.contains_key(&dof)) {
                let cause = Cause::NothingHolds(free.line.clone(), self.name(axis));
                return Err(Refusal::new(item, cause));
            }
        }
        for &axis in &free.components {
            let dofs: Vec<usize> = self.dofs(&free.line, axis, &item)?.collect();
            let holders = dofs.iter().filter_map(|dof| self.held.remove(dof));
            let holders: Vec<Holder> = holders.collect();
            for dof in &dofs {
                self.values.remove(dof);
            }
            // A support that is given up lets its line be moved in the same phase.
            if !holders.contains(&Holder::Support) {
                released.push(Released {
                    line: &free.line,
                    item: item.clone(),
                    axis,
                    dofs,
                });
            }
        }
        Ok(())
    }

    /// A line whose displacement is given up and prescribed at once stays prescribed.
    fn refuse_free_for_nothing(
        &self,
        released: &[Released<'_>],
        values: &HashMap<usize, (f64, &str)>,
    ) -> Result<(), Refusal> {
        for release in released {
            let by = release.dofs.iter();
            let by = by.map(|dof| values.get(dof).map(|(_, by)| *by));
            let by: Option<Vec<&str>> = by.collect();
            if let Some(by) = by.as_deref().and_then(<[&str]>::first) {
                let cause = Cause::FreeForNothing {
                    line: release.line.to_owned(),
                    axis: self.name(release.axis),
                    by: (*by).to_owned(),
                };
                return Err(Refusal::new(release.item.clone(), cause));
            }
        }
        Ok(())
    }

    /// Degrees of freedom held in a phase; if one of several that move alike is held, all are.
    fn held_in(&self, number: usize) -> HashMap<usize, Holder> {
        let mut held = self.held.clone();
        let alike = TiedDofs::in_phase(self.problem, number);
        for dof in &alike.still {
            held.entry(*dof).or_insert(Holder::Support);
        }
        for members in alike.classes() {
            if let Some(holder) = members.iter().find_map(|dof| held.get(dof).copied()) {
                for dof in members {
                    held.entry(dof).or_insert(holder);
                }
            }
        }
        held
    }

    /// Nodes on the axis of symmetry have nowhere to go.
    fn free_axis(&self, phase: &Phase) -> Option<String> {
        if self.problem.analysis != Analysis::Axisymmetric {
            return None;
        }
        let radius = |node: usize| self.mesh.nodes[node][0];
        let nodes = || self.parts.iter().flat_map(|part| &part.nodes).copied();
        let largest = nodes().map(radius).fold(0.0, f64::max);
        let on_axis = nodes().filter(|&node| radius(node) <= ON_AXIS * largest);
        let (held, free): (Vec<usize>, Vec<usize>) =
            on_axis.partition(|node| self.held.contains_key(&(2 * node)));
        let first = self.mesh.nodes[*free.first()?];
        Some(format!(
            "phase `{}`: {} of {} nodes on the axis r = 0 are free in r, the first at z = {}: they \
             would leave the axis or cross it. A support of the line along the axis with \
             `fixed = [\"r\"]` holds them",
            phase.name,
            free.len(),
            held.len() + free.len(),
            first[1]
        ))
    }

    fn prescribe<'p>(
        &mut self,
        input: &'p Displacement,
        item: &Item,
        values: &mut HashMap<usize, (f64, &'p str)>,
    ) -> Result<(), Refusal> {
        let line = input.line.as_str();
        let refuse = |cause| Err(Refusal::new(item.clone(), cause));
        if input.x.is_none() && input.y.is_none() {
            return refuse(Cause::NoValue(
                "displacement",
                line.to_owned(),
                self.problem.analysis,
            ));
        }
        for (axis, value) in [(Axis::X, input.x), (Axis::Y, input.y)] {
            let Some(value) = value else { continue };
            for dof in self.dofs(line, axis, item)? {
                let at = self.mesh.nodes[dof / 2];
                let name = self.name(axis);
                if value.abs() > 0.0 && self.held.get(&dof) == Some(&Holder::Support) {
                    return refuse(Cause::HasSupport {
                        line: line.to_owned(),
                        at,
                        axis: name,
                    });
                }
                let earlier = values.insert(dof, (value, line));
                if let Some((earlier, other)) = earlier
                    && (value - earlier).abs() > 0.0
                {
                    return refuse(Cause::TwoDisplacements {
                        lines: [line, other].map(str::to_owned),
                        at,
                        axis: name,
                        values: [value, earlier],
                    });
                }
                self.held.entry(dof).or_insert(Holder::Prescribed);
            }
        }
        Ok(())
    }

    /// A mid-thickness node of a layer with mean strain follows the two faces: it can be held only
    /// where they are, and with them.
    fn refuse_tied(&self, number: usize, phase: &Phase, ties: &[Tie]) -> Result<(), Refusal> {
        let value = |dof: usize| self.values.get(&dof).copied().unwrap_or(0.0);
        for tie in ties.iter().filter(|tie| self.held.contains_key(&tie.dof)) {
            let masters = tie.masters;
            let mean: f64 = masters
                .iter()
                .map(|&(dof, weight)| weight * value(dof))
                .sum();
            let wished = value(tie.dof);
            let fits = masters.iter().all(|(dof, _)| self.held.contains_key(dof))
                && (mean - wished).abs() <= 1e-12 * mean.abs().max(wished.abs());
            if !fits {
                let cause = Cause::Tied {
                    phase: phase.name.clone(),
                    at: self.mesh.nodes[tie.dof / 2],
                };
                return Err(Refusal::new(Item::Phase(number), cause));
            }
        }
        Ok(())
    }

    /// Without supports the equations are singular. In axisymmetry the hoops hold a part radially.
    fn refuse_loose(&self, number: usize, phase: &Phase) -> Result<(), Refusal> {
        let axisymmetric = self.problem.analysis == Analysis::Axisymmetric;
        for part in &self.parts {
            let is_held = |dof: usize| self.held.contains_key(&dof);
            let Some(motion) = loose(self.mesh, part, axisymmetric, is_held) else {
                continue;
            };
            let name = |number: &usize| Some(self.problem.groups.get(*number)?.name.clone());
            let names = || part.groups.iter().filter_map(name).collect();
            let cause = Cause::Loose {
                phase: phase.name.clone(),
                part: (self.parts.len() > 1).then(|| (names(), part.centre)),
                axis: match motion {
                    Motion::X => Some(self.name(Axis::X)),
                    Motion::Y => Some(self.name(Axis::Y)),
                    Motion::Rotation => None,
                },
            };
            return Err(Refusal::new(Item::Phase(number), cause));
        }
        Ok(())
    }
}
