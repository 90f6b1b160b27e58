//! A model before its first phase, for the report of a dry run: lines, supports, what every phase changes,
//! and which groups are there when.

use crate::ends;
use crate::summary::About;
use mechanics::Simulation;
use mechanics::ground::Loading;
use mechanics::problem::{Analysis, Axis, Drainage, Formulation, Phase, Problem};
use serde::Serialize;

/// What the page draws over the mesh, and shows in tables.
#[derive(Debug, Serialize)]
pub(super) struct Model {
    lines: Vec<NamedLine>,
    /// Names of the groups, and of the phases from the state before the first one.
    groups: Vec<String>,
    stages: Vec<Stage>,
    /// Names of the axes.
    axes: [&'static str; 2],
}

/// A line of the mesh.
#[derive(Debug, Serialize)]
struct NamedLine {
    name: String,
    /// Ends and middle of every edge; once where two bodies meet.
    edges: Vec<[usize; 3]>,
    nodes: Vec<usize>,
    /// Length, m.
    length: f64,
    /// Supported in x and in y.
    fixed: [bool; 2],
    /// The same in words.
    support: String,
}

/// What holds from a phase on.
#[derive(Debug, Serialize)]
struct Stage {
    name: String,
    increments: Option<usize>,
    loads: Vec<Load>,
    /// Water table from left to right, x z x z …; empty without water.
    water: Vec<[f64; 2]>,
    /// The same in words.
    water_text: String,
    /// For every group what it is, in words; nothing if it is absent.
    groups: Vec<String>,
}

/// What a phase asks of a line.
#[derive(Debug, Serialize)]
struct Load {
    line: String,
    /// `pressure`, `force`, `displacement`, `free` or `rigid`.
    kind: &'static str,
    /// In words, with its unit.
    text: String,
    /// Direction of a force or displacement; nothing of the others.
    towards: Option<[f64; 2]>,
    /// Sign of a pressure.
    sign: f64,
}

impl Model {
    pub(super) fn of(simulation: &Simulation, about: &About) -> Self {
        let problem = simulation.problem();
        let lines = problem.mesh.lines.keys();
        let mut now = Loading::before(problem);
        let mut drainage: Vec<Drainage> = problem.groups.iter().map(|g| g.drainage).collect();
        let mut stages = vec![Stage {
            name: "before".to_owned(),
            increments: None,
            loads: Vec::new(),
            groups: groups(problem, &now, &drainage, about, 0),
            ..water(problem, &now)
        }];
        for (number, phase) in problem.phases.iter().enumerate() {
            now = now.changed_by(phase);
            for &(group, given) in &phase.drainage {
                drainage[group] = given;
            }
            stages.push(Stage {
                name: phase.name.clone(),
                increments: Some(phase.increments),
                loads: loads(problem.analysis, phase),
                groups: groups(problem, &now, &drainage, about, number + 1),
                ..water(problem, &now)
            });
        }
        Self {
            lines: lines.map(|name| line(problem, name)).collect(),
            groups: problem
                .groups
                .iter()
                .map(|group| group.name.clone())
                .collect(),
            stages,
            axes: [Axis::X, Axis::Y].map(|axis| axis.name(problem.analysis)),
        }
    }
}

fn line(problem: &Problem, name: &str) -> NamedLine {
    let mesh = &problem.mesh;
    let (mut edges, mut nodes) = (Vec::new(), Vec::new());
    if let Some(line) = mesh.lines.get(name) {
        edges = mesh.edges_once(line);
        nodes.clone_from(&line.nodes);
    }
    let held = |axis: Axis| {
        let mut supports = problem.supports.iter();
        supports.any(|support| support.line == name && support.fixed.contains(&axis))
    };
    let fixed = [held(Axis::X), held(Axis::Y)];
    let axes = [Axis::X, Axis::Y].into_iter().zip(fixed);
    let held: Vec<&str> = axes
        .filter(|(_, is_fixed)| *is_fixed)
        .map(|(axis, _)| axis.name(problem.analysis))
        .collect();
    NamedLine {
        name: name.to_owned(),
        length: edges.iter().map(|edge| mesh.length(*edge)).sum(),
        edges,
        nodes,
        fixed,
        support: held.join(", "),
    }
}

/// A stage of which only the water is known.
fn water(problem: &Problem, now: &Loading) -> Stage {
    let (mut water, mut water_text) = (Vec::new(), "none".to_owned());
    if let Some(level) = &now.water_level {
        let [left, right] = ends(problem.mesh.nodes.iter().map(|node| node[0]));
        let inner = level.points().iter().map(|point| point[0]);
        let inner = inner.filter(|x| *x > left && *x < right);
        let all = [left].into_iter().chain(inner).chain([right]);
        water = all.map(|x| [x, level.at(x)]).collect();
        let [low, high] = ends(level.values());
        water_text = if level.is_constant() {
            format!("{low} m")
        } else {
            format!("{low} to {high} m")
        };
    }
    Stage {
        name: String::new(),
        increments: None,
        loads: Vec::new(),
        water,
        water_text,
        groups: Vec::new(),
    }
}

/// State of every group from a stage on.
fn groups(
    problem: &Problem,
    now: &Loading,
    drainage: &[Drainage],
    about: &About,
    stage: usize,
) -> Vec<String> {
    let all = problem.groups.iter().enumerate();
    let describe = |(number, group): (usize, &mechanics::problem::ElementGroup)| {
        if !now.active[number] {
            return String::new();
        }
        let mut words = Vec::new();
        if let Some((own, swaps)) = about.laws_of_groups.get(number) {
            let phases = problem.phases.iter().take(stage).rev();
            let mut swapped = phases.filter_map(|phase| {
                let (_, law) = swaps.iter().find(|(of, _)| *of == phase.name)?;
                Some(law.as_str())
            });
            words.push(swapped.next().unwrap_or(own).to_owned());
        }
        let [dry, saturated] = now.unit_weight[number];
        if dry > 0.0 || saturated > 0.0 {
            let is_one = dry.to_bits() == saturated.to_bits();
            words.push(if is_one {
                format!("{dry} kN/m³")
            } else {
                format!("{dry} / {saturated} kN/m³")
            });
        }
        if drainage[number] == Drainage::Undrained
            && group.formulation != Formulation::ZeroThickness
        {
            words.push("undrained".to_owned());
        }
        words.join(", ")
    };
    all.map(describe).collect()
}

fn loads(analysis: Analysis, phase: &Phase) -> Vec<Load> {
    let names = [Axis::X, Axis::Y].map(|axis| axis.name(analysis));
    let load = |line: &str, kind: &'static str, text: String| Load {
        line: line.to_owned(),
        kind,
        text,
        towards: None,
        sign: 1.0,
    };
    let components = |x: Option<f64>, y: Option<f64>, unit: &str| {
        let given = [x, y].into_iter().zip(names);
        let given = given.filter_map(|(value, name)| Some(format!("{name} {} {unit}", value?)));
        given.collect::<Vec<_>>().join(", ")
    };
    let mut loads = Vec::new();
    for pressure in &phase.pressure {
        let [low, high] = ends(pressure.value.values());
        let text = if pressure.value.is_constant() {
            format!("{low} kPa")
        } else {
            format!("{low} to {high} kPa over {}", names[1])
        };
        loads.push(Load {
            sign: if low + high < 0.0 { -1.0 } else { 1.0 },
            ..load(&pressure.line, "pressure", text)
        });
    }
    let forces = phase.force.iter();
    let forces = forces.map(|f| ((&f.line, f.x, f.y), "force", analysis.force_unit()));
    let moved = phase.displacement.iter();
    let moved = moved.map(|u| ((&u.line, u.x, u.y), "displacement", "m"));
    for ((line, x, y), kind, unit) in forces.chain(moved) {
        loads.push(Load {
            towards: Some([x.unwrap_or(0.0), y.unwrap_or(0.0)]),
            ..load(line, kind, components(x, y, unit))
        });
    }
    for free in &phase.free {
        let axes = free.components.iter().map(|axis| axis.name(analysis));
        loads.push(load(
            &free.line,
            "free",
            axes.collect::<Vec<_>>().join(", "),
        ));
    }
    for line in &phase.rigid {
        loads.push(load(line, "rigid", "moves as one".to_owned()));
    }
    loads
}
