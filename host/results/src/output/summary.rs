//! `summary.json`: what was run, with what, at what cost, and how it ended.

use super::IncrementRecord;
use crate::case::{Analysis, Case, FigureInput, GroupInput, Method, ProbeInput, Reduce};
use crate::error::{Error, Place};
use crate::group::Group;
use crate::input::BuiltLaw;
use crate::model::Model;
use crate::plugin::hexadecimal_sha256;
use crate::probe::Probes;
use crate::solver::Costs;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::time::Duration;
use toml::Spanned;

/// A phase, for the record.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PhaseRecord {
    /// Name.
    pub name: String,
    /// Which matrix the iterations used.
    pub method: Method,
    /// Unknowns.
    pub equations: usize,
    /// Forces out of balance at its start, relative to the forces in play.
    pub out_of_balance: f64,
    /// Increments that reached equilibrium.
    pub increments: usize,
    /// Iterations of these, failed attempts included.
    pub iterations: usize,
    /// Steps repeated with a smaller length.
    pub cut_backs: usize,
    /// Steps with results that a law calls inaccurate.
    pub unreliable: usize,
    /// Steps that viscous relaxation led to equilibrium.
    pub relaxed: usize,
    /// Largest relative residual that was taken for round-off in the steps' iterations.
    pub round_off: f64,
    /// Steps along the path of equilibrium under arc-length control.
    pub arc_length: usize,
    /// Matrices factorised.
    pub factorisations: u64,
    /// How many of them needed full row exchanges.
    pub fallbacks: u64,
    /// Costs by part.
    pub costs: Costs,
    /// Values of the probes after its last increment.
    pub probes: Vec<Option<f64>>,
}

impl PhaseRecord {
    /// A phase that begins.
    pub fn new(name: &str, equations: usize, out_of_balance: f64) -> Self {
        Self {
            name: name.to_owned(),
            method: Method::default(),
            equations,
            out_of_balance,
            increments: 0,
            iterations: 0,
            cut_backs: 0,
            unreliable: 0,
            relaxed: 0,
            round_off: 0.0,
            arc_length: 0,
            factorisations: 0,
            fallbacks: 0,
            costs: Costs::default(),
            probes: Vec::new(),
        }
    }
}

/// What is known of a run so far.
#[derive(Debug)]
pub(super) struct Summary {
    head: Map<String, Value>,
    probe_names: Vec<String>,
    pub(super) course: Course,
}

/// The last state of equilibrium of a phase that could not go on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Stopped {
    pub(super) phase: String,
    pub(super) load_factor: f64,
    pub(super) time: f64,
    pub(super) probes: Vec<Option<f64>>,
}

/// What has happened so far.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Course {
    phases: Vec<PhaseRecord>,
    last: Option<(Place, Vec<Option<f64>>)>,
    /// Where a phase could not go on.
    pub(super) stopped: Option<Stopped>,
    /// By phase, the first increment with a result that a law calls inaccurate, and why.
    unreliable: Vec<(Place, String)>,
}

impl Summary {
    pub(super) fn new(case: &Case, model: &Model, probes: &Probes) -> Self {
        let laws: Map<String, Value> = model
            .laws
            .iter()
            .map(|((name, hypothesis), built)| (format!("{name} ({hypothesis})"), law(built)))
            .collect();
        let elements: Map<String, Value> = model
            .groups
            .iter()
            .map(|g| (g.name.clone(), g.kinematics.n_elements().into()))
            .collect();
        let mut head = Map::new();
        head.insert(
            "program".to_owned(),
            json!(format!("pilum {}", env!("CARGO_PKG_VERSION"))),
        );
        head.insert("case".to_owned(), json!(case.name()));
        head.insert("variant".to_owned(), json!(case.variant));
        head.insert("title".to_owned(), json!(case.file.title));
        head.insert(
            "case_sha256".to_owned(),
            json!(hexadecimal_sha256(case.source.text().as_bytes())),
        );
        head.insert("case_files".to_owned(), case_files(case));
        head.insert("analysis".to_owned(), json!(analysis(case)));
        head.insert("groups".to_owned(), groups(case, model));
        head.insert("solver".to_owned(), solver(case));
        if let Some(chosen) = &case.file.chosen {
            head.insert("accuracy".to_owned(), json!(chosen));
        }
        head.insert("figures".to_owned(), figures(case));
        let pictures = case.file.figures.iter();
        let pictures: Vec<String> = pictures
            .map(|figure| format!("{}.svg", figure.name.get_ref()))
            .collect();
        head.insert("pictures".to_owned(), json!(pictures));
        head.insert("probe_units".to_owned(), probe_units(case, model));
        head.insert("laws".to_owned(), laws.into());
        head.insert(
            "mesh".to_owned(),
            json!({
                "nodes": model.mesh.nodes.len(),
                "elements": model.mesh.quads.len() + model.mesh.joints.len(),
                "elements_by_group": elements,
            }),
        );
        Self {
            head,
            probe_names: probes.names().map(str::to_owned).collect(),
            course: Course::default(),
        }
    }

    /// What is known before the first increment.
    pub(super) fn running(&self) -> Value {
        let mut summary = self.head.clone();
        summary.insert("status".to_owned(), json!("running"));
        summary.into()
    }

    pub(super) fn last_increment(&mut self, place: &Place, record: &IncrementRecord) {
        self.course.last = Some((place.clone(), record.probes.clone()));
        let is_first = self
            .course
            .unreliable
            .last()
            .is_none_or(|(p, _)| p.phase != place.phase);
        if let Some(why) = record.warning.as_ref().filter(|_| is_first) {
            self.course.unreliable.push((place.clone(), why.clone()));
        }
    }

    /// Warnings about results that laws call inaccurate, one for each phase that has any.
    pub(super) fn unreliable(&self) -> Vec<String> {
        let phases = self
            .course
            .phases
            .iter()
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

    pub(super) fn phase(&mut self, record: PhaseRecord) {
        let last = self
            .course
            .last
            .as_ref()
            .filter(|(place, _)| place.phase == record.name);
        let probes = last.map(|(_, probes)| probes.clone()).unwrap_or_default();
        self.course.phases.push(PhaseRecord { probes, ..record });
    }

    fn probes(&self, values: &[Option<f64>]) -> Value {
        let pairs = self.probe_names.iter().zip(values);
        pairs
            .map(|(name, value)| (name.clone(), json!(value)))
            .collect::<Map<_, _>>()
            .into()
    }

    /// The whole summary. `seconds`: in total, and for output.
    pub(super) fn finish(
        &self,
        groups: &[Group],
        [total, output]: [Duration; 2],
        warnings: &[String],
        error: Option<&Error>,
    ) -> Value {
        let mut summary = self.head.clone();
        summary.insert("status".to_owned(), status(error).into());
        summary.insert("error".to_owned(), json!(error.map(ToString::to_string)));
        summary.insert("warnings".to_owned(), json!(warnings));
        let phases: Vec<Value> = self
            .course
            .phases
            .iter()
            .map(|p| {
                json!({
                    "name": p.name,
                    "method": p.method.name(),
                    "equations": p.equations,
                    "out_of_balance": p.out_of_balance,
                    "increments": p.increments,
                    "iterations": p.iterations,
                    "cut_backs": p.cut_backs,
                    "unreliable_steps": p.unreliable,
                    "relaxed_steps": p.relaxed,
                    "arc_length_steps": p.arc_length,
                    "factorisations": p.factorisations,
                    "fallbacks": p.fallbacks,
                    "evaluations": p.costs.evaluations,
                    "seconds": {
                        "laws_and_forces": p.costs.laws.as_secs_f64(),
                        "assembly": p.costs.assembly.as_secs_f64(),
                        "equations": p.costs.equations.as_secs_f64(),
                    },
                    "probes": self.probes(&p.probes),
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
        let values = last
            .map(|(_, values)| values.as_slice())
            .unwrap_or_default();
        summary.insert("probes".to_owned(), self.probes(values));
        summary.insert(
            "seconds".to_owned(),
            json!({ "total": total.as_secs_f64(), "output": output.as_secs_f64() }),
        );
        summary.into()
    }
}

/// How a run ended, in a word.
pub(super) fn status(error: Option<&Error>) -> &'static str {
    match error {
        None => "done",
        Some(Error::NoEquilibrium { .. }) => "no equilibrium",
        Some(Error::Plugin { .. }) => "plugin trouble",
        Some(error) if error.is_stop() => "interrupted",
        Some(_) => "stopped",
    }
}

/// Points carried through every law, and how many of them with an operator, by the law's id.
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

/// The case file after those it is based on.
fn case_files(case: &Case) -> Value {
    let source = &case.source;
    let files = source.files().map(|range| {
        let text = &source.text()[range.clone()];
        json!({ "path": source.path_at(&range).display().to_string(), "text": text })
    });
    files.collect()
}

fn analysis(case: &Case) -> &'static str {
    match case.file.analysis {
        Analysis::Axisymmetric => "axisymmetric",
        Analysis::PlaneStrain => "plane_strain",
    }
}

/// Groups in the order of the file, which is that of the numbers in the fields.
fn groups(case: &Case, model: &Model) -> Value {
    let groups = case.file.groups.iter().zip(&model.groups);
    let describe = |((name, input), group): (_, &Group)| {
        let (name, input): (&Spanned<String>, &Spanned<GroupInput>) = (name, input);
        let swaps: Map<String, Value> = case
            .file
            .phases
            .iter()
            .filter_map(|phase| {
                let (_, law) = phase.laws.iter().find(|(key, _)| *key == name)?;
                Some((phase.name.get_ref().clone(), json!(law.get_ref())))
            })
            .collect();
        json!({
            "name": name.get_ref(),
            "formulation": input.get_ref().formulation.name(),
            "elements": group.kinematics.n_elements(),
            "points_per_element": group.kinematics.points_per_element(),
            "law": input.get_ref().law.get_ref(),
            "laws_from_phase": swaps,
        })
    };
    groups.map(describe).collect()
}

fn solver(case: &Case) -> Value {
    let solver = &case.file.solver;
    json!({
        "method": solver.method.name(),
        "force_tolerance": solver.force_tolerance,
        "displacement_tolerance": solver.displacement_tolerance,
        "max_iterations": solver.max_iterations(),
        "max_halvings": solver.max_halvings,
        "line_search": solver.line_search,
        "relaxation": solver.relaxation,
        "control": solver.control,
        "equations": solver.equations,
    })
}

/// Figures of probes; those of cuts have nothing in `history.csv`.
fn figures(case: &Case) -> Value {
    let figure = |figure: &FigureInput| {
        let y: Vec<&String> = figure.y.iter().map(Spanned::get_ref).collect();
        json!({
            "name": figure.name.get_ref(),
            "title": figure.title,
            "x": figure.x.get_ref(),
            "x_label": figure.x_label,
            "y": y,
            "y_label": figure.y_label,
            "phase": figure.phase.as_ref().map(Spanned::get_ref),
        })
    };
    let of_probes = case.file.figures.iter().filter(|f| f.points.is_none());
    of_probes.map(figure).collect()
}

/// Units of the probes, where factors leave no doubt.
fn probe_units(case: &Case, model: &Model) -> Value {
    let mut units: Map<String, Value> = Map::new();
    for (name, input) in &case.file.probes {
        let input = input.get_ref();
        let unit = match &input.combine {
            None => measured_unit(case, model, input),
            Some(terms) => {
                let of = |name: &Spanned<String>| units.get(name.get_ref())?.as_str();
                let first = terms.keys().next().and_then(of);
                let alike = terms
                    .iter()
                    .all(|(name, factor)| of(name) == first && is(factor.get_ref().abs(), 1.0));
                first.filter(|_| alike).map(str::to_owned)
            }
        };
        let unit = unit.and_then(|unit| scaled_unit(unit, input.scale.abs()));
        units.insert(name.get_ref().clone(), json!(unit));
    }
    units.into()
}

fn measured_unit(case: &Case, model: &Model, input: &ProbeInput) -> Option<String> {
    let quantity = input.quantity.as_ref()?.get_ref().as_str();
    let kind = quantity.split('_').next().unwrap_or_default();
    let of_points = input.line.is_none();
    if of_points && input.reduce == Some(Reduce::Integral) {
        // Over an interface's area a traction is a force.
        return (kind == "traction").then(|| force_unit(case).to_owned());
    }
    if of_points && input.reduce == Some(Reduce::Sum) {
        return None;
    }
    let mut variables = model
        .laws
        .values()
        .flat_map(|built| &built.law.formulation().internal_variables);
    let variable = variables.find(|variable| of_points && variable.id == quantity);
    let unit = match (kind, variable) {
        (_, Some(variable)) => &variable.unit,
        ("stress" | "traction", None) => "kPa",
        ("strain", None) => "-",
        ("jump" | "displacement", None) => "m",
        ("reaction" | "force", None) => force_unit(case),
        _ => return None,
    };
    Some(unit.to_owned())
}

/// The unit of a force.
fn force_unit(case: &Case) -> &'static str {
    match case.file.analysis {
        Analysis::Axisymmetric => "kN",
        Analysis::PlaneStrain => "kN/m",
    }
}

/// The unit of a quantity times a factor.
fn scaled_unit(unit: String, factor: f64) -> Option<String> {
    if is(factor, 1.0) {
        return Some(unit);
    }
    let scaled = [
        ("m", 1e3, "mm"),
        ("m", 1e2, "cm"),
        ("kPa", 1e-3, "MPa"),
        ("kPa", 1e3, "Pa"),
        ("kN", 1e-3, "MN"),
        ("kN", 1e3, "N"),
        ("-", 1e2, "%"),
    ];
    scaled
        .iter()
        .find(|(of, by, _)| *of == unit && is(factor, *by))
        .map(|(_, _, scaled)| (*scaled).to_owned())
}

/// Equal but for rounding.
fn is(value: f64, expected: f64) -> bool {
    (value - expected).abs() <= 1e-12 * expected
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
    json!({
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
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inaccurate_results_are_one_warning_a_phase() {
        let mut summary = Summary {
            head: Map::new(),
            probe_names: Vec::new(),
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
            let record = IncrementRecord {
                warning: warning.map(str::to_owned),
                ..IncrementRecord::default()
            };
            summary.last_increment(&place, &record);
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
