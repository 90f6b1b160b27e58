//! Whether supports and prescribed displacements fit together, phase by phase.

use crate::assembly::Tie;
use crate::case::{Analysis, Axis, CaseFile, DisplacementInput, FreeInput, PhaseInput};
use crate::error::{Error, Source};
use crate::mesh::Mesh;
use std::collections::HashMap;
use toml::Spanned;

/// Follows the constraints through the phases. Refuses what contradicts itself or has no effect,
/// and phases in which nothing holds the model.
///
/// # Errors
/// [`Error::Input`] at the line or the phase.
pub(super) fn check(
    source: &Source,
    file: &CaseFile,
    mesh: &Mesh,
    ties: &[Tie],
) -> Result<(), Error> {
    let mut constraints = Constraints {
        source,
        mesh,
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
    for phase in &file.phases {
        for free in &phase.free {
            constraints.release(free)?;
        }
        let mut values = HashMap::new();
        for displacement in &phase.displacement {
            constraints.prescribe(displacement, &mut values)?;
        }
        constraints.refuse_loose(phase)?;
        constraints.refuse_tied(phase, ties, &values)?;
    }
    Ok(())
}

/// What holds a degree of freedom.
#[derive(Clone, Copy, PartialEq)]
enum Holder {
    Support,
    Prescribed,
}

struct Constraints<'a> {
    source: &'a Source,
    mesh: &'a Mesh,
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

    fn release(&mut self, free: &FreeInput) -> Result<(), Error> {
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
            for dof in self.dofs(&free.line, axis)? {
                self.held.remove(&dof);
            }
        }
        Ok(())
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

    /// Without a support the equations are singular. In axisymmetry the hoops hold it radially.
    fn refuse_loose(&self, phase: &PhaseInput) -> Result<(), Error> {
        for (component, axis) in [Axis::X, Axis::Y].into_iter().enumerate() {
            let holds_itself = self.axisymmetric && axis == Axis::X;
            if !holds_itself && !self.held.keys().any(|dof| dof % 2 == component) {
                let (phase, name) = (&phase.name, self.name(axis));
                let message = format!(
                    "phase `{}`: nothing holds the model in {name}",
                    phase.get_ref()
                );
                return Err(self
                    .source
                    .error(phase.span(), message)
                    .hint("hold a line with [[supports]], or prescribe its displacement")
                    .into());
            }
        }
        Ok(())
    }
}
