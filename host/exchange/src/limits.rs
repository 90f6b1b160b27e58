//! What cannot be carried to another program: at all, or without the rest losing its meaning.

use crate::model::{Held, Load, Parameter, constant, parameters};
use crate::{Error, Program, dolfinx, kratos, opengeosys};
use input::Case;
use mechanics::problem::{Drainage, ElementGroup, Formulation, Integration, Phase, Problem};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt;
use std::ops::Range;
use text::{InputError, Spanned};

/// A key that is not carried, although the rest is.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct NotCarried {
    /// File and line.
    pub place: String,
    /// Dotted path of the key.
    pub key: String,
    /// Why.
    pub reason: String,
}

impl fmt::Display for NotCarried {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}: {}", self.place, self.key, self.reason)
    }
}

/// Why the radial forces of a program that takes a sector of the whole turn are not those of the whole turn.
pub(crate) const RADIAL: &str =
    "its sector of 2° has forces on its sides, which radial reactions contain";

/// Radial forces on nodes of a sector that can move, which act on its sides along its middle.
pub(crate) fn radial_forces(case: &Case, held: &[Held], loads: &[Load]) -> Option<NotCarried> {
    let held = held.iter().filter(|held| held.component == 0);
    let held: BTreeSet<usize> = held.flat_map(|held| held.nodes.iter().copied()).collect();
    let largest = |component: usize, free: bool| {
        let all = loads
            .iter()
            .flat_map(|load| load.nodes.iter().zip(&load.forces));
        let own = all.filter(|(node, _)| !free || !held.contains(node));
        own.fold(0.0_f64, |most, (_, force)| most.max(force[component].abs()))
    };
    let all = largest(0, false).max(largest(1, false));
    (largest(0, true) > ROUND_OFF * all).then(|| NotCarried {
        place: case.source.place(&case.file.phases.first().map_or(0..0, |p| p.name.span())),
        key: "phase".to_owned(),
        reason: "radial forces act along the middle of its sector of 2°: radial displacements are up to 2e-4 (relative) too small".to_owned(),
    })
}

/// A force beside others that are larger by this factor is round-off.
const ROUND_OFF: f64 = 1e-9;

/// A probe that is not read back.
pub(crate) fn probe(case: &Case, name: &str, reason: &str) -> NotCarried {
    let probes = case.file.probes.keys();
    let span = probes
        .filter(|key| key.get_ref() == name)
        .map(Spanned::span)
        .next();
    NotCarried {
        place: case.source.place(&span.unwrap_or(0..0)),
        key: format!("probes.{name}"),
        reason: reason.to_owned(),
    }
}

/// Keys that are left out.
///
/// # Errors
/// The first key without which the rest has no meaning.
pub(crate) fn check(case: &Case, problem: &Problem, to: Program) -> Result<Vec<NotCarried>, Error> {
    let check = Check { case, to };
    if let Some(water) = &case.file.water {
        return Err(check.refuse(water.span(), "water", "pore water").into());
    }
    for (number, group) in problem.groups.iter().enumerate() {
        check.elements(number, problem)?;
        check.group(number, group)?;
    }
    let mut held = Vec::new();
    for (number, phase) in problem.phases.iter().enumerate() {
        check.phase(number, phase)?;
        check.later(number, phase, &mut held)?;
    }
    Ok(check.left(problem))
}

struct Check<'a> {
    case: &'a Case,
    to: Program,
}

impl Check<'_> {
    fn refuse(&self, span: Range<usize>, key: &str, what: &str) -> InputError {
        let message = format!("{key}: {what} cannot be carried to {}", self.to.name());
        self.case.source.error(span, message)
    }

    /// CalculiX has no plane element of nine nodes.
    fn elements(&self, number: usize, problem: &Problem) -> Result<(), InputError> {
        let mut own = problem.mesh.solids.iter().filter(|s| s.group == number);
        let unknown = match self.to {
            Program::Calculix => own
                .any(|solid| solid.nodes().len() == 9)
                .then_some("an element of nine nodes"),
            Program::Dolfinx => dolfinx::unknown(&problem.mesh, number),
            _ => None,
        };
        match (self.case.file.groups.get_index(number), unknown) {
            (Some((name, _)), Some(what)) => {
                let key = format!("groups.{}", name.get_ref());
                Err(self.refuse(name.span(), &key, what))
            }
            _ => Ok(()),
        }
    }

    fn group(&self, number: usize, group: &ElementGroup) -> Result<(), InputError> {
        let Some((name, written)) = self.case.file.groups.get_index(number) else {
            return Ok(());
        };
        let key = |key: &str| format!("groups.{}.{key}", name.get_ref());
        let written = written.get_ref();
        let no = |span: Range<usize>, of: &str, what: &str| Err(self.refuse(span, &key(of), what));
        if group.formulation != Formulation::Solid {
            return no(
                name.span(),
                "formulation",
                "an element of interfaces or thin layers",
            );
        }
        if constant(group.initial_stress.as_ref()).is_none() {
            let span = written
                .initial_stress
                .as_ref()
                .map_or(name.span(), Spanned::span);
            return no(
                span,
                "initial_stress",
                "a stress that varies with the height",
            );
        }
        if group.drainage == Drainage::Undrained {
            return no(name.span(), "drainage", "undrained ground");
        }
        if !group.is_active {
            return no(name.span(), "active", "a group that appears later");
        }
        let material = &group.material;
        let span = written.law.span();
        if !material.varying.is_empty() || !material.initial.is_empty() {
            return no(
                span,
                "law",
                "parameters that vary, or initial internal variables,",
            );
        }
        if material.built.law.library().foreign().is_some() {
            return no(span, "law", "a law by an adapter");
        }
        if let Some(what) = self.law(group) {
            return no(span, "law", &what);
        }
        let stress = constant(group.initial_stress.as_ref()).unwrap_or_default();
        let starts = stress.iter().any(|stress| *stress != 0.0);
        if starts && self.to.starts_free_of_stress() && !is_elastic(group) {
            let span = written
                .initial_stress
                .as_ref()
                .map_or(name.span(), Spanned::span);
            return no(
                span,
                "initial_stress",
                "the stress at the start of a law that is not linear elastic",
            );
        }
        Ok(())
    }

    /// What of a law the program cannot take.
    fn law(&self, group: &ElementGroup) -> Option<String> {
        let law = &group.material.built.law;
        let parameters = parameters(&group.material.built);
        let id = &law.description().id;
        let library = law.library();
        match self.to {
            Program::Ogs => {
                let symbol = format!("{}_mfront_ept", opengeosys::camel(id));
                let set = parameters
                    .iter()
                    .find(|p| p.may_be_left_out && !p.by_default);
                let of_parameter = |set: &Parameter| {
                    let id_of = &set.id;
                    format!("parameter `{id_of}`, which is not required by law `{id}`,")
                };
                if exports(library.path(), &symbol) {
                    set.map(of_parameter)
                } else {
                    Some(format!("law `{id}`, whose library has no `{symbol}`,"))
                }
            }
            Program::Kratos => (!exports(library.path(), kratos::SYMBOL))
                .then(|| format!("law `{id}`, whose library has no `{}`,", kratos::SYMBOL)),
            Program::Calculix => {
                (!is_elastic(group)).then(|| format!("law `{id}`, which is not linear elastic,"))
            }
            Program::Dolfinx => None,
        }
    }

    fn phase(&self, number: usize, phase: &Phase) -> Result<(), InputError> {
        let Some(written) = self.case.file.phases.get(number) else {
            return Ok(());
        };
        let of = |span: &Spanned<String>| span.span();
        let first = |names: &[Spanned<String>]| names.first().map(Spanned::span);
        let found = [
            (
                "laws",
                "a change of law",
                written.laws.keys().next().map(of),
            ),
            ("activate", "a group that appears", first(&written.activate)),
            (
                "deactivate",
                "a group that disappears",
                first(&written.deactivate),
            ),
            (
                "water",
                "pore water",
                written.water.as_ref().map(Spanned::span),
            ),
            (
                "drainage",
                "a change of drainage",
                written.drainage.keys().next().map(of),
            ),
            (
                "rigid",
                "a line whose nodes move alike",
                first(&written.rigid),
            ),
            (
                "until",
                "an end at a value",
                written.until.as_ref().map(Spanned::span),
            ),
            (
                "strain",
                "a stress-free strain",
                written.strain.keys().next().map(of),
            ),
            (
                "free",
                "a displacement that becomes free",
                written.free.first().map(|f| f.line.span()),
            ),
        ];
        for (key, what, span) in found {
            if let Some(span) = span {
                let key = format!("phase.{}.{key}", phase.name);
                return Err(self.refuse(span, &key, what));
            }
        }
        Ok(())
    }

    /// Displacements are prescribed from the first phase on, or not at all: where they end is known then.
    fn later<'p>(
        &self,
        number: usize,
        phase: &'p Phase,
        held: &mut Vec<(&'p str, usize)>,
    ) -> Result<(), InputError> {
        for (place, given) in phase.displacement.iter().enumerate() {
            let components = [given.x, given.y].into_iter().enumerate();
            for (component, _) in components.filter(|(_, value)| value.is_some()) {
                let own = (given.line.as_str(), component);
                if number == 0 {
                    held.push(own);
                } else if !held.contains(&own) {
                    let written = self.case.file.phases[number].displacement.get(place);
                    let span = written.map_or(0..0, |input| input.line.span());
                    let key = format!("phase.{}.displacement", phase.name);
                    return Err(self.refuse(span, &key, "a displacement that was free before"));
                }
            }
        }
        Ok(())
    }

    /// Keys that are left out, without harm to the rest.
    fn left(&self, problem: &Problem) -> Vec<NotCarried> {
        let mut left = Vec::new();
        let file = &self.case.file;
        let mut leave = |span: Range<usize>, key: String, reason: &str| {
            left.push(NotCarried {
                place: self.case.source.place(&span),
                key,
                reason: reason.to_owned(),
            });
        };
        let has_triangles = problem.mesh.solids.iter().any(|s| s.n_corners() == 3);
        let points = |group: &ElementGroup| group.integration == Some(Integration::Reduced);
        for (written, group) in file.groups.iter().zip(&problem.groups) {
            let key = format!("groups.{}.integration", group.name);
            let span = written.1.get_ref().integration.as_ref();
            let span = span.map_or(written.0.span(), Spanned::span);
            let reduced = points(group);
            let is_full = group.integration == Some(Integration::Full);
            if self.to == Program::Kratos && !reduced {
                leave(span, key, "taken as `reduced`: 2 × 2 points");
            } else if self.to == Program::Dolfinx && has_triangles && !reduced {
                leave(
                    span,
                    key,
                    "taken as `reduced`: 3 points, strains as they are",
                );
            } else if !reduced && !is_full {
                leave(
                    span,
                    key,
                    "taken as `full`: 3 × 3 points, strains as they are",
                );
            } else if self.to == Program::Ogs && reduced != points(&problem.groups[0]) {
                leave(span, key, "taken as that of the first group of the file");
            }
        }
        if let Some(pile) = &file.pile {
            leave(
                pile.head.span(),
                "pile".to_owned(),
                "no forces along a pile are read back",
            );
        }
        if !file.solver.span().is_empty() {
            let reason = "the program iterates in its own way, until displacements change by 1e-10";
            leave(file.solver.span(), "solver".to_owned(), reason);
        }
        left
    }
}

/// Whether the law is that of Hooke, by its parameters: it has no others, and no memory.
fn is_elastic(group: &ElementGroup) -> bool {
    let law = &group.material.built.law;
    let ids = law.description().parameters.iter().map(|p| p.id.as_str());
    ids.eq(["young_modulus", "poisson_ratio"]) && law.n_states() == 0
}

/// Whether a library has a symbol, without opening it.
fn exports(library: &std::path::Path, symbol: &str) -> bool {
    let name = [b"\0", symbol.as_bytes(), b"\0"].concat();
    std::fs::read(library).is_ok_and(|bytes| bytes.windows(name.len()).any(|part| part == name))
}
