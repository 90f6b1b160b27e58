//! From a case file to a model that can be run: groups with their elements and laws, loads and
//! constraints by degree of freedom.

mod constraints;
mod held;
mod plausible;
mod tension;

use crate::assembly::Tie;
use crate::case::{
    Analysis, Axis, Case, CaseFile, Formulation, GroupInput, InPlane, Integration, LawInput,
    PhaseInput, StressInput,
};
use crate::element::{Axes, Joint6, Kinematics, Quad8, depth, gauss, line_shape};
use crate::error::{Error, Source, suggestion};
use crate::group::{Group, GroupLaw, PointFailure};
use crate::input::{BuiltLaw, build_law, find_law};
use crate::lock::Pins;
use crate::mesh::{Mesh, Quad};
use crate::plugin::{End, LoadedLaw, Moment, Operator, SearchPath, Start, Strided};
use abi::Hypothesis;
use abi::status::Outcome;
use indexmap::IndexMap;
pub(crate) use plausible::{LARGE, implausible_stiffness};
use std::collections::HashMap;
use std::sync::Arc;
use toml::Spanned;

/// A layer whose one side is so many times the other has no doubt about its normal.
const CLEARLY: f64 = 2.0;

/// A case ready to run.
#[derive(Debug)]
pub struct Model {
    /// The mesh.
    pub mesh: Mesh,
    /// Groups, before the first phase.
    pub groups: Vec<Group>,
    /// Mid-thickness nodes that follow the two faces of a thin layer.
    pub ties: Vec<Tie>,
    /// Of every phase, the groups that take another law.
    pub swaps: Vec<Vec<(usize, GroupLaw)>>,
    /// All laws used, by name and hypothesis.
    pub laws: IndexMap<(String, &'static str), Arc<BuiltLaw>>,
    /// What is plausible but seldom meant, in words.
    pub warnings: Vec<String>,
}

impl Model {
    /// Builds a model and checks everything that can be checked before the first increment.
    ///
    /// # Errors
    /// [`Error::Input`] at the place that does not fit; [`Error::Plugin`].
    pub fn build(case: &Case) -> Result<Self, Error> {
        let Case { source, file, .. } = case;
        let mesh = Mesh::build(source, file)?;
        let pins = file.laws.values().map(Spanned::get_ref);
        let pins = Pins::of(source, pins.map(|law| (&law.law, law.sha256.as_ref())))?;
        let search = SearchPath::new(&case.law_folders()?).pinned(pins);
        let mut library = LawShelf {
            source,
            file,
            search,
            laws: IndexMap::new(),
        };
        check_phases(source, file, &mesh)?;
        // A phase's laws hold from it on; the first phase's replace those of the groups at once,
        // so that a law that is never used is never loaded.
        let mut first_laws = Vec::new();
        let mut swaps = vec![Vec::new(); file.phases.len()];
        for (number, (name, group)) in file.groups.iter().enumerate() {
            let mut current = &group.get_ref().law;
            library.entry(current)?;
            for (phase, input) in file.phases.iter().enumerate() {
                let swap = input
                    .laws
                    .iter()
                    .find(|(key, _)| key.get_ref() == name.get_ref());
                if let Some((_, law)) = swap {
                    current = law;
                }
                if phase == 0 {
                    first_laws.push(library.group_law(name, group.get_ref(), current)?);
                } else if swap.is_some() {
                    let law = library.group_law(name, group.get_ref(), current)?;
                    swaps[phase].push((number, law));
                }
            }
        }
        let mut groups = Vec::new();
        let mut ties = Vec::new();
        for ((number, (name, group)), law) in file.groups.iter().enumerate().zip(first_laws) {
            let builder = GroupBuilder {
                source,
                file,
                mesh: &mesh,
                number,
                name,
                group: group.get_ref(),
            };
            groups.push(builder.build(law, &mut ties)?);
        }
        let mut warnings = constraints::check(source, file, &mesh, &ties)?;
        warnings.extend(plausible::warnings(case, &mesh, &groups, &swaps));
        Ok(Self {
            warnings,
            mesh,
            groups,
            ties,
            swaps,
            laws: library.laws,
        })
    }
}

/// The error of a law that cannot start from the stress it finds, at the law's place in the file.
pub fn cannot_start(source: &Source, file: &CaseFile, failure: &PointFailure) -> Error {
    let entry = file
        .laws
        .iter()
        .find(|(key, _)| key.get_ref() == &failure.law);
    let its_own_reason = matches!(
        failure.failure.outcome,
        Outcome::Domain | Outcome::Parameter
    );
    match entry {
        Some((_, law)) if its_own_reason => {
            let span = law.get_ref().law.span();
            source
                .error(span, format!("cannot start: {failure}"))
                .into()
        }
        _ if failure.failure.outcome == Outcome::CutStep => Error::NoEquilibrium {
            message: format!("cannot start: {failure}"),
            hint: Some("a law must accept a zero increment when its phase begins".to_owned()),
        },
        _ => Error::plugin(format!("cannot start: {failure}")),
    }
}

/// References within phases, and counts.
fn check_phases(source: &Source, file: &CaseFile, mesh: &Mesh) -> Result<(), Error> {
    if file.phases.is_empty() {
        return Err(source.error(0..0, "there is no [[phase]]").into());
    }
    let mut names: Vec<&str> = Vec::new();
    for phase in &file.phases {
        let name = phase.name.get_ref().as_str();
        if name.trim().is_empty() {
            return Err(source
                .error(phase.name.span(), "a phase needs a name")
                .into());
        }
        if names.contains(&name) {
            let message = format!("two phases are called `{name}`");
            return Err(source.error(phase.name.span(), message).into());
        }
        names.push(name);
        let n = *phase.increments.get_ref();
        if n == 0 || n > 10_000_000 {
            let message = format!("`increments` is {n}, expected 1 to 10000000");
            return Err(source.error(phase.increments.span(), message).into());
        }
        for group in phase.laws.keys() {
            if !file
                .groups
                .keys()
                .any(|key| key.get_ref() == group.get_ref())
            {
                let groups: Vec<&str> = file.groups.keys().map(|k| k.get_ref().as_str()).collect();
                return Err(source
                    .error(
                        group.span(),
                        format!("there is no group `{}`", group.get_ref()),
                    )
                    .hint(suggestion(group.get_ref(), groups))
                    .into());
            }
        }
        check_pressures(source, mesh, phase)?;
    }
    Ok(())
}

fn check_pressures(source: &Source, mesh: &Mesh, phase: &PhaseInput) -> Result<(), Error> {
    let mut lines: Vec<&str> = Vec::new();
    for input in &phase.pressure {
        let name = input.line.get_ref().as_str();
        if lines.contains(&name) {
            let message = format!("line `{name}` has two pressures in this phase");
            return Err(source.error(input.line.span(), message).into());
        }
        lines.push(name);
        let line = mesh.line(source, &input.line)?;
        let shared = |edge: (usize, usize)| {
            let middle = mesh.edge(edge)[2];
            mesh.quads
                .iter()
                .filter(|quad| quad.nodes.contains(&middle))
                .count()
                > 1
        };
        if line.edges.is_empty() || line.edges.iter().any(|&edge| shared(edge)) {
            let message = format!("a pressure needs a boundary, line `{name}` is not");
            return Err(source.error(input.line.span(), message).into());
        }
    }
    Ok(())
}

/// Laws built so far; each once for every hypothesis.
struct LawShelf<'a> {
    source: &'a Source,
    file: &'a CaseFile,
    search: SearchPath,
    laws: IndexMap<(String, &'static str), Arc<BuiltLaw>>,
}

impl<'a> LawShelf<'a> {
    /// What the file says under a law's name.
    fn entry(&self, name: &Spanned<String>) -> Result<&'a LawInput, Error> {
        let laws = &self.file.laws;
        let entry = laws.iter().find(|(key, _)| key.get_ref() == name.get_ref());
        entry.map(|(_, entry)| entry.get_ref()).ok_or_else(|| {
            let names: Vec<&str> = laws.keys().map(|k| k.get_ref().as_str()).collect();
            self.source
                .error(
                    name.span(),
                    format!("there is no law `{}` under [laws]", name.get_ref()),
                )
                .hint(suggestion(name.get_ref(), names))
                .into()
        })
    }

    /// The law without its parameters.
    fn loaded(&self, entry: &LawInput) -> Result<LoadedLaw, Error> {
        let foreign = entry.foreign(self.source)?;
        find_law(self.source, &self.search, &entry.law, foreign.as_ref())
    }

    /// The law of this name, fit for a group.
    fn group_law(
        &mut self,
        group_name: &Spanned<String>,
        group: &GroupInput,
        name: &Spanned<String>,
    ) -> Result<GroupLaw, Error> {
        let entry = self.entry(name)?;
        let plane = match self.file.analysis {
            Analysis::Axisymmetric => Hypothesis::Axisymmetric,
            Analysis::PlaneStrain => Hypothesis::PlaneStrain,
        };
        let hypothesis = match group.formulation {
            Formulation::Solid => plane,
            Formulation::ZeroThickness => Hypothesis::Interface2d,
            Formulation::ThinLayer => {
                let is_interface_law = self.loaded(entry).is_ok_and(|law| {
                    law.description()
                        .formulation(Hypothesis::Interface2d)
                        .is_some()
                });
                if is_interface_law {
                    Hypothesis::Interface2d
                } else {
                    plane
                }
            }
        };
        let key = (name.get_ref().clone(), hypothesis.name());
        let built = if let Some(built) = self.laws.get(&key) {
            Arc::clone(built)
        } else {
            let (source, parameters) = (self.source, &entry.parameters);
            let loaded = self.loaded(entry)?;
            let built = build_law(source, &loaded, &entry.law, hypothesis, parameters)
                .map_err(|error| self.explain(error, group_name, group, name))?;
            let built = Arc::new(built);
            self.laws.insert(key, Arc::clone(&built));
            built
        };
        let law = &built.law;
        if law.formulation().local_axes && group.formulation == Formulation::Solid {
            return Err(self
                .source
                .error(
                    name.span(),
                    format!(
                        "law `{}` works in axes of a layer, the formulation `solid` of group `{}` \
                         has none",
                        law.description().id,
                        group_name.get_ref()
                    ),
                )
                .hint("use the formulation `thin_layer`")
                .into());
        }
        let mut initial = Vec::new();
        for (variable, value) in &entry.initial {
            let variables = &law.formulation().internal_variables;
            let number = variables.iter().position(|v| v.id == *variable.get_ref());
            match number {
                Some(number) if value.get_ref().is_finite() => {
                    initial.push((number, *value.get_ref()));
                }
                Some(_) => {
                    return Err(self
                        .source
                        .error(value.span(), "expected a finite number")
                        .into());
                }
                None => {
                    let ids: Vec<&str> = variables.iter().map(|v| v.id.as_str()).collect();
                    let message = format!(
                        "law `{}` has no internal variable `{}`",
                        law.description().id,
                        variable.get_ref()
                    );
                    return Err(self
                        .source
                        .error(variable.span(), message)
                        .hint(suggestion(variable.get_ref(), ids))
                        .into());
                }
            }
        }
        let law = GroupLaw {
            name: name.get_ref().clone(),
            built,
            initial,
        };
        self.refuse_impossible_layer(group, &law, name)?;
        Ok(law)
    }

    /// Adds what the group expects to an error about the law's hypothesis.
    fn explain(
        &self,
        error: Error,
        name: &Spanned<String>,
        group: &GroupInput,
        law: &Spanned<String>,
    ) -> Error {
        match error {
            Error::Input(input) if input.to_string().contains("is made for") => {
                let label = format!("taken by group `{}`", name.get_ref());
                let input = self.source.mark(*input, law.span(), label);
                Error::from(input.hint(format!(
                    "group `{}` has the formulation `{}` in the analysis `{}`",
                    name.get_ref(),
                    group.formulation.name(),
                    match self.file.analysis {
                        Analysis::Axisymmetric => "axisymmetric",
                        Analysis::PlaneStrain => "plane_strain",
                    }
                )))
            }
            other => other,
        }
    }

    /// A thin layer with K_n ≤ 4/3 K_t has no elasticity along it. Tried out under 100 kPa; a law
    /// that cannot start from there is asked again when its phase begins.
    fn refuse_impossible_layer(
        &self,
        group: &GroupInput,
        law: &GroupLaw,
        name: &Spanned<String>,
    ) -> Result<(), Error> {
        let elastic = group
            .in_plane
            .as_ref()
            .is_none_or(|p| *p.get_ref() == InPlane::Elastic);
        let law = &law.built.law;
        let applies = group.formulation == Formulation::ThinLayer && elastic;
        if !applies || law.hypothesis() != Hypothesis::Interface2d {
            return Ok(());
        }
        let rows = Strided::rows(2);
        let (zero, traction) = ([0.0; 2], [-100.0, 0.0]);
        let Ok(state) = law.initial_state(1, (&traction, rows)) else {
            return Ok(());
        };
        let (mut flux, mut state_end, mut operator) = ([0.0; 2], state.clone(), [0.0; 4]);
        let start = Start {
            n_points: 1,
            gradient: (&zero, rows),
            gradient_end: (&zero, rows),
            flux: (&traction, rows),
            state: &state,
            time: 0.0,
            time_increment: 0.0,
            moment: Moment::default(),
            sites: &[],
        };
        let end = End {
            flux: (&mut flux, rows),
            state: &mut state_end,
            operator: &mut operator,
        };
        match law.integrate(&start, Operator::Elastic, end) {
            Ok(_) if operator[0] <= 4.0 / 3.0 * operator[3] => Err(impossible_layer(
                self.source,
                name,
                [operator[0], operator[3]],
            )),
            _ => Ok(()),
        }
    }
}

/// The message about a thin layer whose stiffnesses no elastic layer can have.
fn impossible_layer(source: &Source, law: &Spanned<String>, [k_n, k_t]: [f64; 2]) -> Error {
    source
        .error(
            law.span(),
            format!(
                "a thin layer needs K_n > 4/3 K_t for its elasticity along the layer \
                 (E* > 0, equation 18): K_n = {k_n:.6e}, K_t = {k_t:.6e} kPa/m"
            ),
        )
        .hint("raise the normal stiffness, or set `in_plane = \"none\"` for the group")
        .into()
}

impl Model {
    /// Refuses thin layers whose stiffnesses, known once a law has started, are impossible.
    ///
    /// # Errors
    /// [`Error::Input`] at the law.
    pub fn check_layers(case: &Case, groups: &[Group]) -> Result<(), Error> {
        for group in groups {
            if let Some(stiffness) = group.impossible_layer() {
                let law = case
                    .file
                    .laws
                    .iter()
                    .find(|(key, _)| key.get_ref() == &group.law.name);
                if let Some((name, _)) = law {
                    return Err(impossible_layer(&case.source, name, stiffness));
                }
            }
        }
        Ok(())
    }
}

/// Which parametric direction of a quad goes across the layer.
#[derive(Clone, Copy, PartialEq)]
enum Across {
    Xi,
    Eta,
}

struct GroupBuilder<'a> {
    source: &'a Source,
    file: &'a CaseFile,
    mesh: &'a Mesh,
    number: usize,
    name: &'a Spanned<String>,
    group: &'a GroupInput,
}

impl GroupBuilder<'_> {
    fn build(&self, law: GroupLaw, ties: &mut Vec<Tie>) -> Result<Group, Error> {
        let name = self.name.get_ref().clone();
        let formulation = self.group.formulation;
        self.refuse_misplaced_keys()?;
        let mut thickness = None;
        let kinematics: Box<dyn Kinematics> = match formulation {
            Formulation::Solid => self.solid()?,
            Formulation::ThinLayer => {
                let in_plane = self
                    .group
                    .in_plane
                    .as_ref()
                    .map_or(InPlane::Elastic, |p| *p.get_ref());
                let (elements, t) = self.thin_layer(ties)?;
                thickness = Some((t, in_plane));
                elements
            }
            Formulation::ZeroThickness => {
                let joints: Vec<_> = self
                    .mesh
                    .joints
                    .iter()
                    .filter(|j| j.group == self.number)
                    .copied()
                    .collect();
                let rule = self.integration(Integration::Nodes);
                let analysis = self.file.analysis;
                Box::new(Joint6::new(analysis, &self.mesh.nodes, &joints, rule))
            }
        };
        if kinematics.n_elements() == 0 {
            let message = format!("no element belongs to group `{name}`");
            return Err(self.source.error(self.name.span(), message).into());
        }
        self.refuse_turned_signs(&law)?;
        let stress = self.initial_stress(&*kinematics);
        Group::new(name, formulation, kinematics, stress, thickness, law)
            .map_err(|failure| cannot_start(self.source, self.file, &failure))
    }

    fn integration(&self, default: Integration) -> Integration {
        self.group
            .integration
            .as_ref()
            .map_or(default, |i| *i.get_ref())
    }

    /// Keys and values that do not go with the formulation.
    fn refuse_misplaced_keys(&self) -> Result<(), Error> {
        let GroupInput {
            formulation,
            integration,
            normal,
            in_plane,
            ..
        } = self.group;
        let misplaced = |span: std::ops::Range<usize>, what: &str| {
            let message = format!(
                "{what} does not go with the formulation `{}`",
                formulation.name()
            );
            Err(self.source.error(span, message).into())
        };
        if *formulation != Formulation::ThinLayer {
            if let Some(normal) = normal {
                return misplaced(normal.span(), "`normal`");
            }
            if let Some(in_plane) = in_plane {
                return misplaced(in_plane.span(), "`in_plane`");
            }
        }
        if let Some(integration) = integration {
            let fits = match integration.get_ref() {
                Integration::Full | Integration::Reduced => true,
                Integration::Mean => *formulation == Formulation::ThinLayer,
                Integration::Nodes => *formulation == Formulation::ZeroThickness,
            };
            if !fits {
                return misplaced(integration.span(), "this `integration`");
            }
        }
        Ok(())
    }

    fn quads(&self) -> impl Iterator<Item = &Quad> {
        self.mesh
            .quads
            .iter()
            .filter(|quad| quad.group == self.number)
    }

    fn bad_shape(&self) -> Error {
        let message = format!(
            "an element of group `{}` is degenerate or reaches the other side of the axis",
            self.name.get_ref()
        );
        self.source.error(self.name.span(), message).into()
    }

    fn solid(&self) -> Result<Box<dyn Kinematics>, Error> {
        let nodes: Vec<_> = self.quads().map(|quad| quad.nodes).collect();
        let n = if self.integration(Integration::Full) == Integration::Reduced {
            2
        } else {
            3
        };
        let axes = vec![Axes::GLOBAL; nodes.len()];
        let (analysis, coordinates) = (self.file.analysis, &self.mesh.nodes);
        let elements = Quad8::new(analysis, coordinates, nodes, axes, |_| (n, n));
        Ok(Box::new(elements.map_err(|_| self.bad_shape())?))
    }

    /// Elements in axes of the layer, and their thickness.
    fn thin_layer(&self, ties: &mut Vec<Tie>) -> Result<(Box<dyn Kinematics>, Vec<f64>), Error> {
        let (mut nodes, mut axes, mut across, mut thickness) = (vec![], vec![], vec![], vec![]);
        for quad in self.quads() {
            let (direction, t) = self.across(quad)?;
            let at = |i: usize| self.mesh.nodes[quad.nodes[i]];
            // Ends of the mid-surface.
            let (a, b) = match direction {
                Across::Xi => (at(4), at(6)),
                Across::Eta => (at(7), at(5)),
            };
            axes.push(Axes::of_facet([b[0] - a[0], b[1] - a[1]]));
            nodes.push(quad.nodes);
            across.push(direction);
            thickness.push(t);
        }
        self.refuse_normal_along()?;
        let integration = self.integration(Integration::Full);
        if integration == Integration::Mean {
            for (nodes, across) in nodes.iter().zip(&across) {
                tie_middles(nodes, *across, ties);
            }
        }
        let rule = |element: usize| match (integration, across[element]) {
            (Integration::Reduced, _) => (2, 2),
            (Integration::Mean, Across::Xi) => (1, 3),
            (Integration::Mean, Across::Eta) => (3, 1),
            _ => (3, 3),
        };
        let (analysis, coordinates) = (self.file.analysis, &self.mesh.nodes);
        let elements = Quad8::new(analysis, coordinates, nodes, axes, rule);
        Ok((Box::new(elements.map_err(|_| self.bad_shape())?), thickness))
    }

    /// Refuses a `normal` in whose direction the layer is longer than along it: clearly so, since a
    /// square is a layer too, and whatever the shape of its elements.
    fn refuse_normal_along(&self) -> Result<(), Error> {
        let Some(normal) = &self.group.normal else {
            return Ok(());
        };
        for [width, height] in self.extents() {
            let (across, along, other) = match normal.get_ref() {
                Axis::X => (width, height, "y"),
                Axis::Y => (height, width, "x"),
            };
            if across > CLEARLY * along {
                let name = self.name.get_ref();
                let message = format!(
                    "`normal`: group `{name}` is {width:.6} by {height:.6} m, its longer side \
                     would be its thickness"
                );
                return Err(self
                    .source
                    .error(normal.span(), message)
                    .hint(format!(
                        "the normal goes across the layer: `normal = \"{other}\"`, or leave it out"
                    ))
                    .into());
            }
        }
        Ok(())
    }

    /// Width and height of each connected part of the group.
    fn extents(&self) -> Vec<[f64; 2]> {
        let mut of_node: HashMap<usize, usize> = HashMap::new();
        // Lower and upper corner of each part, and the part that it has become one with.
        let mut parts: Vec<([[f64; 2]; 2], usize)> = Vec::new();
        let root = |parts: &[([[f64; 2]; 2], usize)], mut part: usize| {
            while parts[part].1 != part {
                part = parts[part].1;
            }
            part
        };
        for quad in self.quads() {
            let new = parts.len();
            let corners = quad.nodes.map(|node| self.mesh.nodes[node]);
            let end = |c: usize, f: fn(f64, f64) -> f64| {
                corners.iter().map(|at| at[c]).fold(corners[0][c], f)
            };
            let lower = [end(0, f64::min), end(1, f64::min)];
            parts.push(([lower, [end(0, f64::max), end(1, f64::max)]], new));
            for node in quad.nodes {
                let other = *of_node.entry(node).or_insert(new);
                let (a, b) = (root(&parts, other), root(&parts, new));
                if a != b {
                    let [low, high] = parts[b].0;
                    let into = &mut parts[a].0;
                    for c in 0..2 {
                        into[0][c] = into[0][c].min(low[c]);
                        into[1][c] = into[1][c].max(high[c]);
                    }
                    parts[b].1 = a;
                }
            }
        }
        let own = parts.iter().enumerate();
        own.filter(|(number, (_, root))| number == root)
            .map(|(_, ([low, high], _))| [high[0] - low[0], high[1] - low[1]])
            .collect()
    }

    /// Refuses an initial stress that the law cannot stand, though it stands it with compression as
    /// a negative number.
    fn refuse_turned_signs(&self, law: &GroupLaw) -> Result<(), Error> {
        let Some(given) = &self.group.initial_stress else {
            return Ok(());
        };
        let stress = components(Some(*given.get_ref()));
        match tension::turned(&law.built.law, self.group.formulation, stress) {
            None => Ok(()),
            Some(refusal) => {
                let message = format!(
                    "`initial_stress` of group `{}`: law `{}` cannot stand it: {refusal}",
                    self.name.get_ref(),
                    law.name
                );
                Err(self
                    .source
                    .error(given.span(), message)
                    .hint("tension is positive: compression is written as a negative number")
                    .into())
            }
        }
    }

    /// The direction across a layer, and the thickness: the distance between its two faces.
    fn across(&self, quad: &Quad) -> Result<(Across, f64), Error> {
        let at = |i: usize| self.mesh.nodes[quad.nodes[i]];
        let distance = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]).hypot(b[1] - a[1]);
        let (along_xi, along_eta) = (distance(at(7), at(5)), distance(at(4), at(6)));
        match &self.group.normal {
            Some(normal) => {
                let xi_is_x = (at(5)[0] - at(7)[0]).abs() >= (at(5)[1] - at(7)[1]).abs();
                let xi = (*normal.get_ref() == Axis::X) == xi_is_x;
                Ok(if xi {
                    (Across::Xi, along_xi)
                } else {
                    (Across::Eta, along_eta)
                })
            }
            None if along_xi < 0.8 * along_eta => Ok((Across::Xi, along_xi)),
            None if along_eta < 0.8 * along_xi => Ok((Across::Eta, along_eta)),
            None => Err(self
                .source
                .error(
                    self.name.span(),
                    format!(
                        "an element of group `{}` is {along_xi:.6} by {along_eta:.6} m: which way \
                         is across the layer?",
                        self.name.get_ref()
                    ),
                )
                .hint("say `normal = \"x\"` or `normal = \"y\"` for the group")
                .into()),
        }
    }

    /// Initial stress of all points, in axes of the elements. A zero-thickness element without
    /// one of its own starts with that of the ground on its two sides, projected on its facet.
    fn initial_stress(&self, kinematics: &dyn Kinematics) -> Vec<f64> {
        let given = self.group.initial_stress.as_ref().map(|s| *s.get_ref());
        let mut stress = Vec::with_capacity(kinematics.n_components() * kinematics.n_points());
        for point in 0..kinematics.n_points() {
            let element = point / kinematics.points_per_element();
            let axes = kinematics.axes(element);
            if kinematics.n_components() == 4 {
                stress.extend(axes.stress_from_global(components(given)));
            } else {
                let global = match given {
                    Some(_) => components(given),
                    None => self.stress_beside(kinematics.nodes(element)),
                };
                let [_, normal, _, shear] = axes.stress_from_global(global);
                stress.extend([normal, shear]);
            }
        }
        stress
    }

    /// Mean of the initial stresses on the two sides of a zero-thickness element.
    fn stress_beside(&self, nodes: &[usize]) -> [f64; 4] {
        // Mid-side nodes belong to one quad each.
        let beside = [nodes[2], nodes[5]].map(|middle| {
            let quad = self
                .mesh
                .quads
                .iter()
                .find(|quad| quad.nodes.contains(&middle));
            let group = quad.and_then(|quad| self.file.groups.get_index(quad.group));
            let stress = group.and_then(|(_, group)| group.get_ref().initial_stress.as_ref());
            components(stress.map(|stress| *stress.get_ref()))
        });
        std::array::from_fn(|c| f64::midpoint(beside[0][c], beside[1][c]))
    }
}

/// Components 11 22 33 12; zero if there is no stress.
fn components(stress: Option<StressInput>) -> [f64; 4] {
    stress.map_or([0.0; 4], |s| [s.s11, s.s22, s.s33, s.s12])
}

/// Ties the two mid-thickness nodes of a quad to the corners on either side.
fn tie_middles(nodes: &[usize; 8], across: Across, ties: &mut Vec<Tie>) {
    let middles = match across {
        Across::Xi => [(4, 0, 1), (6, 3, 2)],
        Across::Eta => [(7, 0, 3), (5, 1, 2)],
    };
    for (middle, a, b) in middles {
        for c in 0..2 {
            let dof = 2 * nodes[middle] + c;
            if ties.iter().all(|tie| tie.dof != dof) {
                let masters = [(2 * nodes[a] + c, 0.5), (2 * nodes[b] + c, 0.5)];
                ties.push(Tie { dof, masters });
            }
        }
    }
}

/// Nodal forces of a unit pressure on a boundary line.
pub fn unit_pressure(analysis: Analysis, mesh: &Mesh, edges: &[(usize, usize)]) -> Vec<f64> {
    let mut force = vec![0.0; 2 * mesh.nodes.len()];
    for &edge in edges {
        let nodes = mesh.edge(edge);
        let (points, weights) = gauss(3);
        for (&xi, weight) in points.iter().zip(weights) {
            let (n, d) = line_shape(xi);
            let sum = |f: &[f64; 3], c: usize| -> f64 {
                (0..3).map(|i| f[i] * mesh.nodes[nodes[i]][c]).sum()
            };
            // Edges run counter-clockwise: (dy, −dx) points outward, the pressure inward.
            let inward = [-sum(&d, 1), sum(&d, 0)];
            let weight = weight * depth(analysis, sum(&n, 0));
            for i in 0..3 {
                for c in 0..2 {
                    force[2 * nodes[i] + c] += weight * n[i] * inward[c];
                }
            }
        }
    }
    force
}
