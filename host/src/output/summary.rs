//! `summary.json`: what was run, with what, at what cost, and how it ended.

use crate::case::Case;
use crate::error::{Error, Place};
use crate::group::Group;
use crate::input::BuiltLaw;
use crate::model::Model;
use crate::plugin::hexadecimal_sha256;
use crate::probe::Probes;
use crate::solver::Costs;
use serde_json::{Map, Value, json};
use std::time::Duration;

/// A phase, for the record.
#[derive(Clone, Debug)]
pub struct PhaseRecord {
    /// Name.
    pub name: String,
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
    /// Matrices factorised.
    pub factorisations: u64,
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
            equations,
            out_of_balance,
            increments: 0,
            iterations: 0,
            cut_backs: 0,
            unreliable: 0,
            factorisations: 0,
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
    phases: Vec<PhaseRecord>,
    last: Option<(Place, Vec<Option<f64>>)>,
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
        head.insert("title".to_owned(), json!(case.file.title));
        head.insert(
            "case_sha256".to_owned(),
            json!(hexadecimal_sha256(case.source.text().as_bytes())),
        );
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
            phases: Vec::new(),
            last: None,
        }
    }

    pub(super) fn last_increment(&mut self, place: &Place, probes: &[Option<f64>]) {
        self.last = Some((place.clone(), probes.to_vec()));
    }

    pub(super) fn phase(&mut self, record: PhaseRecord) {
        let last = self
            .last
            .as_ref()
            .filter(|(place, _)| place.phase == record.name);
        let probes = last.map(|(_, probes)| probes.clone()).unwrap_or_default();
        self.phases.push(PhaseRecord { probes, ..record });
    }

    fn probes(&self, values: &[Option<f64>]) -> Value {
        let pairs = self.probe_names.iter().zip(values);
        pairs
            .map(|(name, value)| (name.clone(), json!(value)))
            .collect::<Map<_, _>>()
            .into()
    }

    pub(super) fn finish(
        &self,
        groups: &[Group],
        total: Duration,
        output: Duration,
        error: Option<&Error>,
    ) -> Value {
        let mut summary = self.head.clone();
        summary.insert(
            "status".to_owned(),
            json!(match error {
                None => "done",
                Some(Error::NoEquilibrium { .. }) => "no equilibrium",
                Some(Error::Plugin { .. }) => "plugin trouble",
                Some(_) => "stopped",
            }),
        );
        summary.insert("error".to_owned(), json!(error.map(ToString::to_string)));
        let phases: Vec<Value> = self
            .phases
            .iter()
            .map(|p| {
                json!({
                    "name": p.name,
                    "equations": p.equations,
                    "out_of_balance": p.out_of_balance,
                    "increments": p.increments,
                    "iterations": p.iterations,
                    "cut_backs": p.cut_backs,
                    "unreliable_steps": p.unreliable,
                    "factorisations": p.factorisations,
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
        let mut calls: Map<String, Value> = Map::new();
        for group in groups {
            calls.insert(group.name.clone(), group.law_calls.into());
        }
        summary.insert("law_calls_by_group".to_owned(), calls.into());
        let last = self.last.as_ref();
        summary.insert(
            "last_equilibrium".to_owned(),
            json!(last.map(|(place, _)| json!({
                "phase": place.phase,
                "increment": place.increment,
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
    json!({
        "law": description.id,
        "version": description.version,
        "library": library.path().display().to_string(),
        "sha256": library.sha256(),
        "parameters": parameters,
        "warnings": built.warnings,
    })
}
