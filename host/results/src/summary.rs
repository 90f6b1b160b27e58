//! `summary.json`: what was run, with what, at what cost, and how it ended.

use crate::mesh_error::OfPhase;
use crate::output_request::{Figure, Measured, OutputRequest};
use indexmap::IndexMap;
use law::BuiltLaw;
use mechanics::group::Group;
use mechanics::simulation::{Increment, Neighbour, PhaseRecord};
use mechanics::{Place, Settings, Simulation};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
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
    /// Units of the probes, where factors leave no doubt.
    pub probe_units: Vec<(String, Option<String>)>,
    /// Settings that a study has chosen.
    pub chosen: Option<Value>,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ending {
    /// In a word.
    pub status: &'static str,
    /// What went wrong, if something did.
    pub error: Option<String>,
    /// What gave way where no equilibrium was found.
    pub mechanism: Option<Value>,
}

impl Ending {
    /// A run that came to its end.
    pub fn done() -> Self {
        Self {
            status: "done",
            error: None,
            mechanism: None,
        }
    }
}

/// State of a run so far.
#[derive(Debug)]
pub(crate) struct Summary {
    head: Map<String, Value>,
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
    phases: Vec<(PhaseRecord, Vec<Option<f64>>)>,
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

impl Summary {
    pub(crate) fn new(about: &About, wanted: &OutputRequest, simulation: &Simulation) -> Self {
        let laws: Map<String, Value> = about
            .laws
            .iter()
            .map(|((name, hypothesis), built)| {
                let mut entry = law(built);
                let initial = initial(simulation, name, built);
                if !initial.is_empty() {
                    entry["initial"] = initial.into();
                }
                (format!("{name} ({hypothesis})"), entry)
            })
            .collect();
        let of_groups = simulation.groups().iter();
        let elements: Map<String, Value> = of_groups
            .map(|g| (g.name.clone(), g.kinematics.n_elements().into()))
            .collect();
        let problem = simulation.problem();
        let mut head = Map::new();
        let mut say = |key: &str, value: Value| head.insert(key.to_owned(), value);
        say(
            "program",
            json!(format!("pilum {}", env!("CARGO_PKG_VERSION"))),
        );
        say("case", json!(about.case));
        say("variant", json!(about.variant));
        say("title", json!(about.title));
        say("case_sha256", json!(about.sha256));
        let file = |(path, text): &(String, String)| json!({ "path": path, "text": text });
        say("case_files", about.files.iter().map(file).collect());
        say("set", json!(about.settings));
        say("analysis", json!(problem.analysis.name()));
        say("groups", groups(about, simulation));
        say("solver", solver(&problem.settings));
        if let Some(chosen) = &about.chosen {
            say("accuracy", chosen.clone());
        }
        say("figures", figures(&wanted.figures));
        let pictures = wanted.figures.iter();
        let pictures = pictures.map(|figure| format!("{}.svg", figure.name));
        say("pictures", json!(pictures.collect::<Vec<String>>()));
        let units = about.probe_units.iter();
        let mut units: Map<String, Value> = units
            .map(|(name, unit)| (name.clone(), json!(unit)))
            .collect();
        if wanted.pile.is_some() {
            for column in crate::pile::COLUMNS {
                let is_length = column == "pile_settlement";
                let unit = if is_length {
                    "m"
                } else {
                    problem.analysis.force_unit()
                };
                units.insert(column.to_owned(), json!(unit));
            }
        }
        say("probe_units", units.into());
        say("laws", laws.into());
        let mut mesh = json!({
            "nodes": problem.mesh.nodes.len(),
            "elements": problem.mesh.solids.len() + problem.mesh.joints.len(),
            "elements_by_group": elements,
        });
        if let Some((path, sha256)) = &about.mesh_file {
            mesh["file"] = json!({ "path": path, "sha256": sha256 });
        }
        say("mesh", mesh);
        Self {
            head,
            probe_names: wanted.columns().map(str::to_owned).collect(),
            estimates_mesh: wanted.output.mesh_error,
            course: Course::default(),
        }
    }

    /// Data known before the first increment.
    pub(crate) fn running(&self) -> Value {
        let mut summary = self.head.clone();
        summary.insert("status".to_owned(), json!("running"));
        summary.into()
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

    fn probes(&self, values: &[Option<f64>]) -> Value {
        let pairs = self.probe_names.iter().zip(values);
        pairs
            .map(|(name, value)| (name.clone(), json!(value)))
            .collect::<Map<_, _>>()
            .into()
    }

    /// The whole summary. `seconds`: in total, and for output.
    pub(crate) fn finish(
        &self,
        groups: &[Group],
        [total, output]: [Duration; 2],
        warnings: &[String],
        ending: &Ending,
    ) -> Value {
        let mut summary = self.head.clone();
        summary.insert("status".to_owned(), ending.status.into());
        summary.insert("error".to_owned(), json!(ending.error));
        summary.insert("mechanism".to_owned(), json!(ending.mechanism));
        summary.insert("warnings".to_owned(), json!(warnings));
        let at_rest = |phase: &str| {
            let found = self.course.at_rest.as_ref().filter(|(of, _)| of == phase);
            found.map(|(_, share)| share)
        };
        let phases: Vec<Value> = self
            .course
            .phases
            .iter()
            .map(|(p, probes)| {
                json!({
                    "name": p.name,
                    "method": p.method.name(),
                    "equations": p.equations,
                    "out_of_balance": p.out_of_balance,
                    "at_rest": at_rest(&p.name),
                    "increments": p.increments,
                    "iterations": p.iterations,
                    "cut_backs": p.cut_backs,
                    "cut_back_in_halves": in_halves(p.in_halves),
                    "unreliable_steps": p.unreliable,
                    "relaxed_steps": p.relaxed,
                    "viscous_steps": p.viscous,
                    "viscous_from": p.viscous_from,
                    "single_corrections_from": p.singly_from,
                    "tolerated_steps": p.tolerated,
                    "tolerated_residual": p.tolerated_residual,
                    "tolerated_force": p.tolerated_force,
                    "by_force_steps": p.by_force,
                    "by_force_open": {
                        "residual": p.open.residual,
                        "force": p.open.force,
                        "correction": p.open.correction,
                        "nodes": p.open.nodes,
                    },
                    "arc_length_steps": p.arc_length,
                    "factorisations": p.factorisations,
                    "fallbacks": p.fallbacks,
                    "evaluations": p.costs.evaluations,
                    "seconds": {
                        "laws_and_forces": p.costs.laws.as_secs_f64(),
                        "assembly": p.costs.assembly.as_secs_f64(),
                        "equations": p.costs.equations.as_secs_f64(),
                    },
                    "probes": self.probes(probes),
                })
            })
            .collect();
        summary.insert("phases".to_owned(), phases.into());
        let work = |work: fn(&Group) -> Value| -> Value {
            let of_groups = groups.iter().map(|group| (group.name.clone(), work(group)));
            of_groups.collect::<Map<_, _>>().into()
        };
        let points = |group: &Group| group.law_calls.iter().map(|c| c.points).sum::<u64>().into();
        let operators = |group: &Group| {
            let operators = group.law_calls.iter().map(|c| c.operators);
            operators.sum::<u64>().into()
        };
        summary.insert("law_calls".to_owned(), law_calls(groups));
        summary.insert("law_calls_by_group".to_owned(), work(points));
        summary.insert("operators_by_group".to_owned(), work(operators));
        summary.insert("state_bytes".to_owned(), work(|group| json!(group.bytes())));
        let last = self.course.last.as_ref();
        summary.insert(
            "last_equilibrium".to_owned(),
            json!(last.map(|(place, _)| json!({
                "phase": place.phase,
                "increment": place.increment,
            }))),
        );
        let stopped = self.course.stopped.as_ref();
        summary.insert(
            "stopped_at".to_owned(),
            json!(stopped.map(|stopped| json!({
                "phase": stopped.phase,
                "load_factor": stopped.load_factor,
                "time": stopped.time,
                "probes": self.probes(&stopped.probes),
            }))),
        );
        if self.estimates_mesh || !self.course.mesh_errors.is_empty() {
            summary.insert("mesh_error".to_owned(), json!(self.course.mesh_errors));
        }
        let values = last
            .map(|(_, values)| values.as_slice())
            .unwrap_or_default();
        summary.insert("probes".to_owned(), self.probes(values));
        let sizes: Vec<Option<f64>> = self.course.sizes.iter().copied().map(Some).collect();
        summary.insert("probe_magnitudes".to_owned(), self.probes(&sizes));
        summary.insert(
            "seconds".to_owned(),
            json!({ "total": total.as_secs_f64(), "output": output.as_secs_f64() }),
        );
        summary.into()
    }
}

/// Points carried through every law, and how many of them with an operator, by the law's name in the case.
fn law_calls(groups: &[Group]) -> Value {
    let mut totals: BTreeMap<&str, [u64; 2]> = BTreeMap::new();
    for calls in groups.iter().flat_map(|group| &group.law_calls) {
        let [points, operators] = totals.entry(&calls.law).or_default();
        *points += calls.points;
        *operators += calls.operators;
    }
    let of_laws = totals.into_iter();
    of_laws
        .map(|(law, [points, operators])| {
            let calls = json!({ "points": points, "operators": operators });
            (law.to_owned(), calls)
        })
        .collect::<Map<_, _>>()
        .into()
}

/// Groups in the order of the problem, which is that of the numbers in the fields.
fn groups(about: &About, simulation: &Simulation) -> Value {
    let groups = simulation.groups().iter().zip(&about.laws_of_groups);
    let describe = |(group, (law, from_phase)): (&Group, &LawsOfGroup)| {
        let swaps = from_phase.iter();
        let swaps: Map<String, Value> = swaps
            .map(|(phase, law)| (phase.clone(), json!(law)))
            .collect();
        json!({
            "name": group.name,
            "formulation": group.formulation.name(),
            "elements": group.kinematics.n_elements(),
            "points_per_element": points_per_element(group),
            "law": law,
            "laws_from_phase": swaps,
        })
    };
    groups.map(describe).collect()
}

/// Points of an element; in words where there are triangles and quads.
fn points_per_element(group: &Group) -> Value {
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

fn solver(solver: &Settings) -> Value {
    json!({
        "method": solver.method.name(),
        "force_tolerance": solver.force_tolerance,
        "displacement_tolerance": solver.displacement_tolerance,
        "max_iterations": solver.max_iterations(),
        "max_halvings": solver.max_halvings,
        "line_search": solver.line_search,
        "relaxation": solver.relaxation,
        "control": solver.control,
        "convergence": solver.convergence,
        "tolerated_residual": solver.tolerated_residual,
        "tangents": solver.tangents,
        "equations": solver.equations,
    })
}

/// Measured points by coordinate.
fn measured(measured: &Measured) -> Value {
    let (x, y): (Vec<f64>, Vec<f64>) = measured.points.iter().copied().unzip();
    json!({ "label": measured.label, "x": x, "y": y })
}

/// Figures of probes; those of cuts have nothing in `history.csv`.
fn figures(figures: &[Figure]) -> Value {
    let figure = |figure: &Figure| {
        json!({
            "name": figure.name,
            "title": figure.title,
            "x": figure.x,
            "x_label": figure.x_label,
            "y": figure.y,
            "y_label": figure.y_label,
            "phase": figure.phase,
            "measured": figure.measured.iter().map(measured).collect::<Vec<_>>(),
        })
    };
    let of_probes = figures.iter().filter(|f| f.is_of_columns());
    of_probes.map(figure).collect()
}

/// What the case gives a law to start from, by internal variable.
fn initial(simulation: &Simulation, name: &str, built: &BuiltLaw) -> Map<String, Value> {
    let problem = simulation.problem();
    let of_groups = problem.groups.iter().map(|group| &group.material);
    let of_phases = problem.phases.iter().flat_map(|phase| &phase.materials);
    let mut all = of_groups.chain(of_phases.map(|(_, material)| material));
    let same =
        all.find(|material| material.name == name && std::ptr::eq(material.built.as_ref(), built));
    let variables = &built.law.formulation().internal_variables;
    let given = same.into_iter().flat_map(|material| &material.initial);
    given
        .filter_map(|&(number, value)| Some((variables.get(number)?.id.clone(), json!(value))))
        .collect()
}

fn law(built: &BuiltLaw) -> Value {
    let description = built.law.description();
    let library = built.law.library();
    let parameters: Map<String, Value> = built
        .parameters
        .iter()
        .map(|p| {
            (
                p.id.clone(),
                if p.value.is_nan() {
                    Value::Null
                } else {
                    json!(p.value)
                },
            )
        })
        .collect();
    let described: Vec<Value> = description
        .parameters
        .iter()
        .zip(&built.parameters)
        .map(|(declared, used)| {
            json!({
                "id": declared.id,
                "symbol": declared.symbol,
                "unit": declared.unit,
                "value": if used.value.is_nan() { Value::Null } else { json!(used.value) },
                "choice": declared.choices.get(used.value as usize),
                "by_default": used.by_default,
                "bounds": if declared.choices.is_empty() {
                    declared.bounds.to_string()
                } else {
                    declared.choices.join(", ")
                },
                "doc": declared.doc,
            })
        })
        .collect();
    let variables: Vec<Value> = built
        .law
        .formulation()
        .internal_variables
        .iter()
        .map(|v| json!({ "id": v.id, "symbol": v.symbol, "unit": v.unit, "doc": v.doc }))
        .collect();
    let mut entry = json!({
        "law": description.id,
        "name": description.name,
        "doc": description.doc,
        "references": description.references,
        "version": description.version,
        "library": library.path().display().to_string(),
        "sha256": library.sha256(),
        "parameters": parameters,
        "described_parameters": described,
        "internal_variables": variables,
        "warnings": built.warnings,
    });
    if let Some(zone) = built.law.loaded().shear_zone() {
        let (thickness, ratio) = (zone.thickness, zone.lateral_ratio);
        entry["shear_zone"] = json!({ "thickness": thickness, "lateral_ratio": ratio });
    }
    entry
}

/// Where two halves of a step after a cut-back lead.
fn in_halves(neighbour: Option<Neighbour>) -> Value {
    match neighbour {
        Some(Neighbour::Apart {
            displacements,
            forces,
        }) => json!({ "displacements": displacements, "forces": forces }),
        Some(Neighbour::None) => json!("no equilibrium"),
        None => Value::Null,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inaccurate_results_are_one_warning_a_phase() {
        let mut summary = Summary {
            head: Map::new(),
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
