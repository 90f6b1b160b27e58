//! Whether supports and prescribed displacements fit together, phase by phase.

use super::held::{Motion, Part, loose, parts};
use super::unit_pressure;
use crate::assembly::Tie;
use crate::case::{Analysis, Axis, CaseFile, DisplacementInput, FreeInput, PhaseInput};
use crate::case::{GroupInput, PressureInput};
use crate::error::{Error, Source};
use crate::input::Named;
use crate::mesh::Mesh;
use std::collections::{HashMap, HashSet};
use toml::Spanned;

/// A node is on the axis of symmetry within this fraction of the largest radius.
const ON_AXIS: f64 = 1e-9;
/// A part of a load that is smaller than this fraction of it is round-off.
const NOTHING: f64 = 1e-9;

/// Follows the constraints through the phases. Refuses what contradicts itself or has no effect,
/// and phases in which a part of the model is not held. Returns what is plausible but seldom meant.
///
/// # Errors
/// [`Error::Input`] at the line or the phase.
pub(super) fn check(
    source: &Source,
    file: &CaseFile,
    mesh: &Mesh,
    ties: &[Tie],
) -> Result<Vec<String>, Error> {
    let mut constraints = Constraints {
        source,
        mesh,
        parts: parts(mesh),
        groups: &file.groups,
        axisymmetric: file.analysis == Analysis::Axisymmetric,
        held: HashMap::new(),
    };
    for support in &file.supports {
        if support.fixed.is_empty() {
            let message = format!("`fixed` is empty for line `{}`", support.line.get_ref());
            return Err(source.error(support.line.span(), message).into());
        }
        for axis in &support.fixed {
            for dof in constraints.dofs(&support.line, *axis)? {
                constraints.held.insert(dof, Holder::Support);
            }
        }
    }
    let mut warnings = Vec::new();
    // What is held in each phase.
    let mut held: Vec<HashSet<usize>> = Vec::new();
    for phase in &file.phases {
        let mut released = Vec::new();
        for free in &phase.free {
            constraints.release(free, &mut released)?;
        }
        let mut values = HashMap::new();
        for displacement in &phase.displacement {
            constraints.prescribe(displacement, &mut values)?;
        }
        constraints.refuse_free_for_nothing(&released, &values)?;
        constraints.refuse_loose(phase)?;
        constraints.refuse_tied(phase, ties, &values)?;
        if warnings.is_empty() {
            warnings.extend(constraints.free_axis(phase));
        }
        held.push(constraints.held.keys().copied().collect());
    }
    for (number, phase) in file.phases.iter().enumerate() {
        for pressure in &phase.pressure {
            let again = file.phases[number + 1..].iter().position(|later| {
                let mut lines = later.pressure.iter().map(|p| p.line.get_ref());
                lines.any(|line| line == pressure.line.get_ref())
            });
            let end = again.map_or(held.len(), |later| number + 1 + later);
            let while_it_lasts = &held[number..end];
            let warning =
                constraints.lost_pressure(file.analysis, phase, pressure, while_it_lasts)?;
            warnings.extend(warning);
        }
    }
    Ok(warnings)
}

/// What holds a degree of freedom.
#[derive(Clone, Copy, PartialEq)]
enum Holder {
    Support,
    Prescribed,
}

/// A component of a line that a phase frees, though an earlier phase prescribed it.
struct Released<'p> {
    line: &'p Spanned<String>,
    axis: Axis,
    dofs: Vec<usize>,
}

struct Constraints<'a> {
    source: &'a Source,
    mesh: &'a Mesh,
    parts: Vec<Part>,
    groups: &'a Named<GroupInput>,
    axisymmetric: bool,
    held: HashMap<usize, Holder>,
}

impl<'a> Constraints<'a> {
    fn dofs(
        &self,
        line: &Spanned<String>,
        axis: Axis,
    ) -> Result<impl Iterator<Item = usize> + use<'a>, Error> {
        let component = usize::from(axis == Axis::Y);
        let nodes = &self.mesh.line(self.source, line)?.nodes;
        Ok(nodes.iter().map(move |node| 2 * node + component))
    }

    /// Name of a direction as the analysis calls it.
    fn name(&self, axis: Axis) -> &'static str {
        match (axis, self.axisymmetric) {
            (Axis::X, false) => "x",
            (Axis::X, true) => "r",
            (Axis::Y, false) => "y",
            (Axis::Y, true) => "z",
        }
    }

    fn release<'p>(
        &mut self,
        free: &'p FreeInput,
        released: &mut Vec<Released<'p>>,
    ) -> Result<(), Error> {
        let refuse = |what: &str| {
            let message = format!("`free` of line `{}`: {what}", free.line.get_ref());
            Err(self.source.error(free.line.span(), message).into())
        };
        if free.components.is_empty() {
            return refuse("`components` is empty");
        }
        for &axis in &free.components {
            let dofs: Vec<usize> = self.dofs(&free.line, axis)?.collect();
            if !dofs.iter().any(|dof| self.held.contains_key(dof)) {
                return refuse(&format!("nothing holds it in {}", self.name(axis)));
            }
        }
        for &axis in &free.components {
            let dofs: Vec<usize> = self.dofs(&free.line, axis)?.collect();
            let holders = dofs.iter().filter_map(|dof| self.held.remove(dof));
            let holders: Vec<Holder> = holders.collect();
            // A support that is given up lets its line be moved in the same phase.
            if !holders.contains(&Holder::Support) {
                released.push(Released {
                    line: &free.line,
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
    ) -> Result<(), Error> {
        for Released { line, axis, dofs } in released {
            let by = dofs.iter().map(|dof| values.get(dof).map(|(_, by)| *by));
            let by: Option<Vec<&str>> = by.collect();
            if let Some(by) = by.as_deref().and_then(<[&str]>::first) {
                let name = self.name(*axis);
                let message = format!(
                    "`free` of line `{}` has no effect in {name}: in the same phase \
                     `displacement` of line `{by}` prescribes it",
                    line.get_ref()
                );
                return Err(self
                    .source
                    .error(line.span(), message)
                    .hint("leave one of the two out; a displacement stays until a phase frees it")
                    .into());
            }
        }
        Ok(())
    }

    /// A pressure on nodes that are held against it changes nothing but their reactions. Refuses one
    /// that does nothing else as long as it lasts; returns how much of another is lost so.
    fn lost_pressure(
        &self,
        analysis: Analysis,
        phase: &PhaseInput,
        input: &PressureInput,
        held: &[HashSet<usize>],
    ) -> Result<Option<String>, Error> {
        if input.value == 0.0 {
            return Ok(None);
        }
        let line = self.mesh.line(self.source, &input.line)?;
        let is_lost = |edge: (usize, usize)| {
            let nodes = self.mesh.edge(edge);
            let at = nodes.map(|node| self.mesh.nodes[node]);
            // What the edge faces, by component: the other one of its directions.
            let reach = |c: usize| {
                let step = |a: usize, b: usize| (at[b][c] - at[a][c]).abs();
                step(0, 2).max(step(2, 1))
            };
            let across = [reach(1), reach(0)];
            let least = NOTHING * across[0].max(across[1]);
            (0..2).filter(|&c| across[c] > least).all(|c| {
                let dofs = nodes.map(|node| 2 * node + c);
                let all = |held: &HashSet<usize>| dofs.iter().all(|dof| held.contains(dof));
                held.iter().all(all)
            })
        };
        let lost: Vec<(usize, usize)> =
            line.edges.iter().copied().filter(|&e| is_lost(e)).collect();
        if lost.is_empty() {
            return Ok(None);
        }
        let name = input.line.get_ref();
        if lost.len() == line.edges.len() {
            let message = format!(
                "the pressure on line `{name}` has no effect: its displacement against it is \
                 held or prescribed as long as it lasts"
            );
            return Err(self
                .source
                .error(input.line.span(), message)
                .hint(
                    "leave the pressure or the displacement out; `reaction_…` of the line is what \
                     it takes to hold it",
                )
                .into());
        }
        let size = |edges: &[(usize, usize)]| -> f64 {
            let force = unit_pressure(analysis, self.mesh, edges);
            let node = |f: &[f64]| f[0].hypot(f[1]);
            force.chunks_exact(2).map(node).sum()
        };
        let (lost, all) = (size(&lost), size(&line.edges));
        let unit = match analysis {
            Analysis::Axisymmetric => "kN",
            Analysis::PlaneStrain => "kN/m",
        };
        Ok(Some(format!(
            "phase `{}`: {:.3} % of the pressure on line `{name}` ({:.4e} {unit}) has no effect but \
             on reactions: it acts where the displacement is held or prescribed",
            phase.name.get_ref(),
            100.0 * lost / all,
            (input.value * lost).abs()
        )))
    }

    /// Nodes on the axis of symmetry have nowhere to go.
    fn free_axis(&self, phase: &PhaseInput) -> Option<String> {
        if !self.axisymmetric {
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
             would leave the axis or cross it. A support of a line with `r = 0.0`, `fixed = [\"r\"]`, \
             holds them",
            phase.name.get_ref(),
            free.len(),
            held.len() + free.len(),
            first[1]
        ))
    }

    fn prescribe<'p>(
        &mut self,
        input: &'p DisplacementInput,
        values: &mut HashMap<usize, (f64, &'p str)>,
    ) -> Result<(), Error> {
        let line = input.line.get_ref().as_str();
        let refuse = |message: String| self.source.error(input.line.span(), message);
        if input.x.is_none() && input.y.is_none() {
            let message = format!("the displacement of line `{line}` has no value");
            let (x, y) = (self.name(Axis::X), self.name(Axis::Y));
            return Err(refuse(message)
                .hint(format!("give `{x}`, `{y}`, or both"))
                .into());
        }
        for (axis, value) in [(Axis::X, input.x), (Axis::Y, input.y)] {
            let Some(value) = value else { continue };
            for dof in self.dofs(&input.line, axis)? {
                let [x, y] = self.mesh.nodes[dof / 2];
                let node = format!("the node at ({x}, {y}) of line `{line}`");
                let name = self.name(axis);
                if value.abs() > 0.0 && self.held.get(&dof) == Some(&Holder::Support) {
                    return Err(refuse(format!("{node} has a support in {name}"))
                        .hint("a support holds it at 0 throughout, unless a phase frees it")
                        .into());
                }
                let earlier = values.insert(dof, (value, line));
                if let Some((earlier, other)) = earlier
                    && (value - earlier).abs() > 0.0
                {
                    let message = format!(
                        "{node} gets {value} m in {name}, and {earlier} m by line `{other}`"
                    );
                    return Err(refuse(message).into());
                }
                self.held.entry(dof).or_insert(Holder::Prescribed);
            }
        }
        Ok(())
    }

    /// A mid-thickness node of a layer with mean strain follows the two faces: it can be held only
    /// where they are, and with them.
    fn refuse_tied(
        &self,
        phase: &PhaseInput,
        ties: &[Tie],
        values: &HashMap<usize, (f64, &str)>,
    ) -> Result<(), Error> {
        let value = |dof: usize| values.get(&dof).map_or(0.0, |(value, _)| *value);
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
                let [x, y] = self.mesh.nodes[tie.dof / 2];
                let message = format!(
                    "phase `{}`: the node at ({x}, {y}) in the middle of a layer with \
                     `integration = \"mean\"` follows the layer's faces and cannot be held alone",
                    phase.name.get_ref()
                );
                return Err(self
                    .source
                    .error(phase.name.span(), message)
                    .hint("hold the nodes on both faces too, or leave this one free")
                    .into());
            }
        }
        Ok(())
    }

    /// Without supports the equations are singular. In axisymmetry the hoops hold a part radially.
    fn refuse_loose(&self, phase: &PhaseInput) -> Result<(), Error> {
        for part in &self.parts {
            let is_held = |dof: usize| self.held.contains_key(&dof);
            let Some(motion) = loose(self.mesh, part, self.axisymmetric, is_held) else {
                continue;
            };
            let what = if let [_] = self.parts[..] {
                "the model".to_owned()
            } else {
                let name = |number: &usize| {
                    let group = self.groups.get_index(*number);
                    group.map(|(name, _)| format!("`{}`", name.get_ref()))
                };
                let names: Vec<String> = part.groups.iter().filter_map(name).collect();
                let [x, y] = part.centre;
                let groups = if names.len() == 1 { "group" } else { "groups" };
                format!(
                    "{groups} {} around ({x:.4}, {y:.4}), which touches nothing else,",
                    names.join(", ")
                )
            };
            let motion = match motion {
                Motion::X => format!("in {}", self.name(Axis::X)),
                Motion::Y => format!("in {}", self.name(Axis::Y)),
                Motion::Rotation => "against turning".to_owned(),
            };
            let message = format!(
                "phase `{}`: nothing holds {what} {motion}",
                phase.name.get_ref()
            );
            return Err(self
                .source
                .error(phase.name.span(), message)
                .hint("hold a line with [[supports]], or prescribe its displacement")
                .into());
        }
        Ok(())
    }
}
