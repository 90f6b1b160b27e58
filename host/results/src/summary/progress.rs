//! The record of a run in progress: what a simulation and its case give to `summary.json`.

use crate::ends;
use crate::mesh_error::OfPhase;
use crate::output_request::{self, OutputRequest};
use crate::summary::{
    self, CaseFile, Ending, Expression, Figure, Group, Head, Law, LawCalls, LeftOpen, Measured,
    Mesh, MeshFile, Named, Parameter, Phase, PhaseSeconds, Range, Seconds, ShearZone, Stop,
    Summary, Variable,
};
use indexmap::IndexMap;
use law::{BuiltLaw, UsedParameter};
use mechanics::group::Group as GroupOfModel;
use mechanics::problem::Variation;
use mechanics::simulation::{Increment, Neighbour, PhaseRecord};
use mechanics::{Material, Place, Settings, Simulation};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::sync::Arc;
use std::time::Duration;

/// Name of a group's own law, and phases with the laws that they give it.
pub type LawsOfGroup = (String, Vec<(String, String)>);

/// What the record says of a run next to what the simulation knows.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// Name of the case.
    pub case: String,
    /// Name of the variant, if it is one.
    pub variant: Option<String>,
    /// Title of the case.
    pub title: String,
    /// SHA-256 of the text of its files.
    pub sha256: String,
    /// Those files: path and text, the case itself last.
    pub files: Vec<(String, String)>,
    /// Settings of the command line, `KEY=VALUE`, in the order given.
    pub settings: Vec<String>,
    /// Path and SHA-256 of the file of the mesh, if it has one.
    pub mesh_file: Option<(String, String)>,
    /// For every group the name of its law, and those of the laws that phases give it, by phase.
    pub laws_of_groups: Vec<LawsOfGroup>,
    /// All laws used, by name and hypothesis.
    pub laws: IndexMap<(String, &'static str), Arc<BuiltLaw>>,
    /// Parameters that follow from others: name of the law, parameter, expression.
    pub expressions: Vec<[String; 3]>,
    /// Units of the probes, where factors leave no doubt.
    pub probe_units: Vec<(String, Option<String>)>,
    /// Settings that a study has chosen.
    pub chosen: Option<Value>,
}

/// A run so far.
#[derive(Debug)]
pub(crate) struct Progress {
    head: Head,
    probe_names: Vec<String>,
    /// The error of the mesh is asked for.
    estimates_mesh: bool,
    pub(crate) course: Course,
}

/// The last state of equilibrium of a phase that could not go on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Stopped {
    pub(crate) phase: String,
    pub(crate) load_factor: f64,
    pub(crate) time: f64,
    pub(crate) probes: Vec<Option<f64>>,
}

/// Events so far.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Course {
    /// Phases, with the values of the probes after their last increments.
    pub(crate) phases: Vec<(PhaseRecord, Vec<Option<f64>>)>,
    last: Option<(Place, Vec<Option<f64>>)>,
    /// The phase that found the ground at rest, but for this share of its weight.
    pub(crate) at_rest: Option<(String, f64)>,
    /// Where a phase could not go on.
    pub(crate) stopped: Option<Stopped>,
    /// The error of the mesh at the end of each phase, where it was asked for.
    pub(crate) mesh_errors: Vec<OfPhase>,
    /// How large the quantities of the probes are in the model at the end of any phase, where it is known.
    #[serde(default)]
    pub(crate) sizes: Vec<f64>,
    /// By phase, the first increment with a result that a law calls inaccurate, and why.
    unreliable: Vec<(Place, String)>,
}

impl Progress {
    pub(crate) fn new(about: &About, wanted: &OutputRequest, simulation: &Simulation) -> Self {
        Self {
            head: head(about, wanted, simulation),
            probe_names: wanted.columns().map(str::to_owned).collect(),
            estimates_mesh: wanted.output.mesh_error,
            course: Course::default(),
        }
    }

    /// Data known before the first increment.
    pub(crate) fn head(&self) -> &Head {
        &self.head
    }

    pub(crate) fn last_increment(&mut self, increment: &Increment, probes: Vec<Option<f64>>) {
        let place = &increment.place;
        self.course.last = Some((place.clone(), probes));
        let is_first = self
            .course
            .unreliable
            .last()
            .is_none_or(|(p, _)| p.phase != place.phase);
        if let Some(why) = increment.unreliable.as_ref().filter(|_| is_first) {
            self.course.unreliable.push((place.clone(), why.clone()));
        }
    }

    /// Warnings about results that laws call inaccurate, one for each phase that has any.
    pub(crate) fn unreliable(&self) -> Vec<String> {
        let phases = self
            .course
            .phases
            .iter()
            .map(|(phase, _)| phase)
            .filter(|phase| phase.unreliable > 0);
        let warning = |phase: &PhaseRecord| {
            let first = self
                .course
                .unreliable
                .iter()
                .find(|(p, _)| p.phase == phase.name);
            let first =
                first.map(|(p, why)| format!("; first in increment {}: {why}", p.increment));
            format!(
                "phase `{}`: {} step{} with results that a law calls inaccurate{}",
                phase.name,
                phase.unreliable,
                if phase.unreliable == 1 { "" } else { "s" },
                first.unwrap_or_default()
            )
        };
        phases.map(warning).collect()
    }

    pub(crate) fn phase(&mut self, record: PhaseRecord) {
        let last = self
            .course
            .last
            .as_ref()
            .filter(|(place, _)| place.phase == record.name);
        let probes = last.map(|(_, probes)| probes.clone()).unwrap_or_default();
        self.course.phases.push((record, probes));
    }

    fn probes(&self, values: impl IntoIterator<Item = Option<f64>>) -> Named<Option<f64>> {
        self.probe_names.iter().cloned().zip(values).collect()
    }

    fn ended_phase(&self, (record, probes): &(PhaseRecord, Vec<Option<f64>>)) -> Phase {
        let at_rest = self.course.at_rest.as_ref();
        let at_rest = at_rest.filter(|(phase, _)| *phase == record.name);
        Phase {
            name: record.name.clone(),
            method: record.method.name().to_owned(),
            equations: Some(record.equations),
            out_of_balance: Some(record.out_of_balance),
            at_rest: at_rest.map(|(_, share)| *share),
            increments: Some(record.increments as u64),
            iterations: Some(record.iterations as u64),
            cut_backs: Some(record.cut_backs as u64),
            cut_back_in_halves: in_halves(record.in_halves),
            unreliable_steps: Some(record.unreliable as u64),
            relaxed_steps: record.relaxed,
            viscous_steps: record.viscous,
            viscous_from: record.viscous_from,
            single_corrections_from: record.singly_from,
            regularised_steps: record.regularised,
            tolerated_steps: record.tolerated,
            tolerated_residual: Some(record.tolerated_residual),
            tolerated_force: Some(record.tolerated_force),
            residual_force: Some(record.residual_force),
            by_force_steps: record.by_force,
            by_force_open: LeftOpen {
                residual: Some(record.open.residual),
                force: Some(record.open.force),
                correction: Some(record.open.correction),
                nodes: record.open.nodes,
            },
            arc_length_steps: record.arc_length,
            factorisations: Some(record.factorisations),
            fallbacks: record.fallbacks,
            evaluations: record.costs.evaluations,
            seconds: PhaseSeconds {
                laws_and_forces: Some(record.costs.laws.as_secs_f64()),
                assembly: Some(record.costs.assembly.as_secs_f64()),
                equations: Some(record.costs.equations.as_secs_f64()),
            },
            probes: self.probes(probes.iter().copied()),
        }
    }

    /// The whole summary. `seconds`: in total, and for output.
    pub(crate) fn finish(
        &self,
        groups: &[GroupOfModel],
        [total, output]: [Duration; 2],
        warnings: &[String],
        ending: &Ending,
    ) -> Summary {
        let course = &self.course;
        let last = course.last.as_ref();
        let stopped = course.stopped.as_ref().map(|stopped| Stop {
            phase: stopped.phase.clone(),
            load_factor: Some(stopped.load_factor),
            time: Some(stopped.time),
            probes: self.probes(stopped.probes.iter().copied()),
        });
        let has_mesh_error = self.estimates_mesh || !course.mesh_errors.is_empty();
        let values = last.map_or(&[][..], |(_, values)| values);
        Summary {
            head: self.head.clone(),
            ending: ending.clone(),
            warnings: Some(warnings.to_vec()),
            phases: course.phases.iter().map(|p| self.ended_phase(p)).collect(),
            law_calls: law_calls(groups),
            law_calls_by_group: by_group(groups, |group| {
                group.law_calls.iter().map(|calls| calls.points).sum()
            }),
            operators_by_group: by_group(groups, |group| {
                group.law_calls.iter().map(|calls| calls.operators).sum()
            }),
            state_bytes: by_group(groups, |group| json!(group.bytes())),
            last_equilibrium: last.map(|(place, _)| summary::Increment {
                phase: place.phase.clone(),
                increment: place.increment,
            }),
            stopped_at: stopped,
            mesh_error: has_mesh_error.then(|| course.mesh_errors.clone()),
            pile: None,
            probes: self.probes(values.iter().copied()),
            probe_magnitudes: self.probes(course.sizes.iter().copied().map(Some)),
            seconds: Seconds {
                total: Some(total.as_secs_f64()),
                output: Some(output.as_secs_f64()),
            },
        }
    }
}

fn by_group<T>(groups: &[GroupOfModel], of: impl Fn(&GroupOfModel) -> T) -> Named<T> {
    let groups = groups.iter();
    groups
        .map(|group| (group.name.clone(), of(group)))
        .collect()
}

/// Calls of every law, by its name in the case.
fn law_calls(groups: &[GroupOfModel]) -> Named<LawCalls> {
    let mut totals: Named<LawCalls> = Named::new();
    for calls in groups.iter().flat_map(|group| &group.law_calls) {
        let total = totals.entry(calls.law.clone()).or_default();
        total.points += calls.points;
        total.operators += calls.operators;
    }
    totals
}

fn head(about: &About, wanted: &OutputRequest, simulation: &Simulation) -> Head {
    let problem = simulation.problem();
    let file = |(path, text): &(String, String)| CaseFile {
        path: path.clone(),
        text: text.clone(),
    };
    let laws = about.laws.iter().map(|((name, hypothesis), built)| {
        let mut law = law(built, initial(simulation, name, built));
        let materials: Vec<&Material> = materials(simulation, name, built).collect();
        let own = about.expressions.iter().filter(|[law, ..]| law == name);
        vary(
            &mut law,
            ranges(&materials, built),
            &own.collect::<Vec<_>>(),
        );
        (format!("{name} ({hypothesis})"), law)
    });
    let pictures = wanted.figures.iter();
    let pictures = pictures.map(|figure| format!("{}.svg", figure.name));
    // Those of cuts have nothing in `history.csv`.
    let of_probes = wanted.figures.iter().filter(|f| f.is_of_columns());
    Head {
        program: format!("pilum {}", env!("CARGO_PKG_VERSION")),
        case: about.case.clone(),
        variant: about.variant.clone(),
        title: about.title.clone(),
        case_sha256: about.sha256.clone(),
        case_files: about.files.iter().map(file).collect(),
        set: about.settings.clone(),
        analysis: problem.analysis.name().to_owned(),
        groups: groups(about, simulation),
        solver: solver(problem.settings),
        accuracy: about.chosen.clone(),
        figures: of_probes.map(figure).collect(),
        pictures: pictures.collect(),
        pile_section: wanted.pile.as_ref().map(|pile| pile.section(simulation)),
        probe_units: probe_units(about, wanted, problem.analysis.force_unit()),
        laws: laws.collect(),
        mesh: Mesh {
            nodes: Some(problem.mesh.nodes.len()),
            elements: Some(problem.mesh.solids.len() + problem.mesh.joints.len()),
            elements_by_group: by_group(simulation.groups(), |g| g.kinematics.n_elements()),
            file: about
                .mesh_file
                .clone()
                .map(|(path, sha256)| MeshFile { path, sha256 }),
        },
    }
}

fn probe_units(about: &About, wanted: &OutputRequest, force_unit: &str) -> Named<Option<String>> {
    let mut units: Named<Option<String>> = about.probe_units.iter().cloned().collect();
    if wanted.pile.is_some() {
        for column in crate::pile::COLUMNS {
            let unit = if crate::pile::is_length(column) {
                "m"
            } else {
                force_unit
            };
            units.insert(column.to_owned(), Some(unit.to_owned()));
        }
    }
    units
}

/// Groups in the order of the problem, which is that of the numbers in the fields.
fn groups(about: &About, simulation: &Simulation) -> Vec<Group> {
    let groups = simulation.groups().iter().zip(&about.laws_of_groups);
    let describe = |(group, (law, from_phase)): (&GroupOfModel, &LawsOfGroup)| Group {
        name: group.name.clone(),
        formulation: group.formulation.name().to_owned(),
        elements: Some(group.kinematics.n_elements()),
        points_per_element: points_per_element(group),
        law: law.clone(),
        laws_from_phase: from_phase.iter().cloned().collect(),
    };
    groups.map(describe).collect()
}

/// Points of an element; in words where there are triangles and quads.
fn points_per_element(group: &GroupOfModel) -> Value {
    let elements = 0..group.kinematics.n_elements();
    let mut counts: Vec<usize> = elements
        .map(|element| group.kinematics.points_of(element).len())
        .collect();
    counts.sort_unstable();
    counts.dedup();
    if let [n] = counts[..] {
        return json!(n);
    }
    let counts: Vec<String> = counts.iter().map(usize::to_string).collect();
    json!(counts.join(" or "))
}

/// Settings of the solver by their names in the case.
fn solver(settings: Settings) -> Map<String, Value> {
    let max_iterations = Some(settings.max_iterations());
    let settings = json!(Settings {
        max_iterations,
        ..settings
    });
    match settings {
        Value::Object(settings) => settings,
        _ => Map::new(),
    }
}

fn figure(figure: &output_request::Figure) -> Figure {
    let measured = |measured: &output_request::Measured| {
        let (x, y) = measured.points.iter().copied().unzip();
        let label = measured.label.clone();
        Measured { label, x, y }
    };
    Figure {
        measured: Some(figure.measured.iter().map(measured).collect()),
        name: figure.name.clone(),
        phase: figure.phase.clone(),
        title: figure.title.clone(),
        x: figure.x.clone(),
        x_label: figure.x_label.clone(),
        y: figure.y.clone(),
        y_label: figure.y_label.clone(),
        y_reversed: figure.y_reversed,
    }
}

/// What the case gives a law to start from, by internal variable.
fn initial(simulation: &Simulation, name: &str, built: &BuiltLaw) -> Named<f64> {
    let same = materials(simulation, name, built).next();
    let variables = &built.law.formulation().internal_variables;
    let given = same.into_iter().flat_map(|material| &material.initial);
    given
        .filter_map(|&(number, value)| Some((variables.get(number)?.id.clone(), value)))
        .collect()
}

/// The law of the case, wherever a group takes it.
fn materials<'p>(
    simulation: &'p Simulation,
    name: &str,
    built: &BuiltLaw,
) -> impl Iterator<Item = &'p Material> {
    let problem = simulation.problem();
    let of_phases = problem.phases.iter().flat_map(|phase| &phase.materials);
    let of_groups = problem.groups.iter().map(|group| &group.material);
    of_groups
        .chain(of_phases.map(|(_, material)| material))
        .filter(move |material| {
            material.name == name && std::ptr::eq(material.built.as_ref(), built)
        })
}

/// The range of every parameter of a law in all groups.
fn ranges(materials: &[&Material], built: &BuiltLaw) -> Named<Range> {
    let range = |used: &UsedParameter| {
        let of_material = |material: &&Material| -> Vec<f64> {
            let mut varying = material.varying.iter();
            match varying.find(|(id, _)| *id == used.id) {
                Some((_, Variation::Height(profile))) => profile.values().collect(),
                Some((_, Variation::Elements(values))) => values.clone(),
                None => vec![used.value],
            }
        };
        let unused = materials.is_empty().then_some(used.value);
        let values = materials.iter().flat_map(of_material).chain(unused);
        let [smallest, largest] = ends(values);
        (used.id.clone(), Range { smallest, largest })
    };
    built.parameters.iter().map(range).collect()
}

/// Adds to a law the parameters that follow from others, and those that have no one value.
fn vary(law: &mut Law, ranges: Named<Range>, expressions: &[&[String; 3]]) {
    let of_expression = |[_, id, expression]: &&[String; 3]| {
        let Range { smallest, largest } = ranges.get(id).copied().unwrap_or_default();
        let expression = Expression {
            expression: expression.clone(),
            smallest,
            largest,
        };
        (id.clone(), expression)
    };
    law.expressions = expressions.iter().map(of_expression).collect();
    law.varying = ranges;
    law.varying
        .retain(|_, range| range.smallest < range.largest);
    for id in law.varying.keys() {
        law.parameters.insert(id.clone(), None);
    }
    let described = law.described_parameters.iter_mut();
    for parameter in described.filter(|parameter| law.varying.contains_key(&parameter.id)) {
        parameter.value = None;
    }
}

fn law(built: &BuiltLaw, initial: Named<f64>) -> Law {
    let description = built.law.description();
    let library = built.law.library();
    let given = |value: f64| (!value.is_nan()).then_some(value);
    let described = description.parameters.iter().zip(&built.parameters);
    let described = described.map(|(declared, used)| Parameter {
        id: declared.id.clone(),
        symbol: declared.symbol.clone(),
        unit: declared.unit.clone(),
        value: given(used.value),
        choice: declared.choices.get(used.value as usize).cloned(),
        by_default: Some(used.by_default),
        bounds: if declared.choices.is_empty() {
            declared.bounds.to_string()
        } else {
            declared.choices.join(", ")
        },
        doc: declared.doc.clone(),
    });
    let variables = &built.law.formulation().internal_variables;
    let variables = variables.iter().map(|variable| Variable {
        id: variable.id.clone(),
        symbol: variable.symbol.clone(),
        unit: variable.unit.clone(),
        doc: variable.doc.clone(),
    });
    let parameters = built.parameters.iter();
    let shear_zone = built.law.loaded().shear_zone();
    Law {
        law: description.id.clone(),
        name: description.name.clone(),
        doc: description.doc.clone(),
        references: description.references.clone(),
        version: description.version.clone(),
        library: library.path().display().to_string(),
        sha256: library.sha256().to_owned(),
        parameters: parameters.map(|p| (p.id.clone(), given(p.value))).collect(),
        described_parameters: described.collect(),
        internal_variables: variables.collect(),
        warnings: built.warnings.clone(),
        shear_zone: shear_zone.map(|zone| ShearZone {
            thickness: Some(zone.thickness),
            lateral_ratio: Some(zone.lateral_ratio),
        }),
        initial,
        expressions: Named::new(),
        varying: Named::new(),
    }
}

/// Where two halves of a step after a cut-back lead.
fn in_halves(neighbour: Option<Neighbour>) -> Value {
    match neighbour {
        Some(Neighbour::Apart {
            displacements,
            forces,
            largest: [displacement, force],
        }) => json!({
            "displacements": displacements,
            "forces": forces,
            "largest_displacement": displacement,
            "largest_force": force,
        }),
        Some(Neighbour::None) => json!("no equilibrium"),
        None => Value::Null,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inaccurate_results_are_one_warning_a_phase() {
        let mut summary = Progress {
            head: Head::default(),
            probe_names: Vec::new(),
            estimates_mesh: false,
            course: Course::default(),
        };
        for (phase, increment, warning) in [
            ("a", 1, None),
            ("a", 2, Some("slow")),
            ("a", 3, Some("slower")),
            ("b", 1, None),
            ("c", 4, Some("odd")),
        ] {
            let place = Place {
                phase: phase.to_owned(),
                increment,
            };
            let increment = Increment {
                place,
                unreliable: warning.map(str::to_owned),
                ..Increment::default()
            };
            summary.last_increment(&increment, Vec::new());
        }
        for (phase, unreliable) in [("a", 3), ("b", 0), ("c", 1)] {
            summary.phase(PhaseRecord {
                unreliable,
                ..PhaseRecord::new(phase, 0, 0.0)
            });
        }
        let what = "with results that a law calls inaccurate; first in increment";
        assert_eq!(
            summary.unreliable(),
            [
                format!("phase `a`: 3 steps {what} 2: slow"),
                format!("phase `c`: 1 step {what} 4: odd"),
            ]
        );
    }
}
