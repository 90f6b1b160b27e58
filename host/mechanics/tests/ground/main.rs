//! Ground at rest, under water, built up and taken away: against what is known by hand.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests panic to fail")]

mod at_rest;
#[path = "../common/mod.rs"]
mod common;
mod interfaces;
mod undrained;

use common::{cut, held, insert_joints, joint, material, name, name_sides, pressed};
use law::Hypothesis;
use mechanics::check::Cause;
use mechanics::problem::{
    Analysis, AtRest, Axis, Displacement, Drainage, ElementGroup, Force, Formulation, Free,
    InitialStress, Phase, Profile, Ratio, Support, Water,
};
use mechanics::{Error, Material, Mesh, Problem, Simulation};

const E: f64 = 2e4;
const NU: f64 = 0.3;

fn elastic(analysis: Analysis, e: f64, nu: f64) -> Material {
    let hypothesis = match analysis {
        Analysis::Axisymmetric => Hypothesis::Axisymmetric,
        Analysis::PlaneStrain => Hypothesis::PlaneStrain,
    };
    common::elastic(hypothesis, e, nu)
}

fn oedometric(e: f64, nu: f64) -> f64 {
    e * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
}

fn k_0(value: f64) -> InitialStress {
    InitialStress::AtRest(AtRest {
        ratio: Ratio::K0(value.into()),
        surcharge: None,
    })
}

/// A mesh of a grid with its sides named; `moved` shifts inner nodes along x by rows, so that quads are
/// no rectangles.
fn grid(x: &[f64], y: &[f64], group: impl Fn(usize, usize) -> usize, shape: Shape) -> Mesh {
    let mut mesh = Mesh::grid(x, y, group);
    if !matches!(shape, Shape::Rectangles | Shape::Cut) {
        let (left, right) = (x[0], x[x.len() - 1]);
        for node in &mut mesh.nodes {
            let t = (node[0] - left) / (right - left);
            node[0] += 0.25 * (right - left) / x.len() as f64
                * t
                * (1.0 - t)
                * 4.0
                * (3.0 * node[1]).sin();
        }
        straighten(&mut mesh);
    }
    cut(&mut mesh, |number| match shape {
        Shape::Triangles | Shape::Cut => Some(true),
        Shape::Mixed if number % 3 == 0 => Some(true),
        _ => None,
    });
    name_sides(&mut mesh);
    mesh
}

/// Puts the middles of sides between their ends.
fn straighten(mesh: &mut Mesh) {
    for number in 0..mesh.solids.len() {
        let edges: Vec<[usize; 3]> = mesh.solids[number].edges().collect();
        for [a, b, m] in edges {
            mesh.nodes[m] = [0, 1].map(|c| f64::midpoint(mesh.nodes[a][c], mesh.nodes[b][c]));
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Rectangles,
    Skewed,
    Triangles,
    Mixed,
    /// Rectangles, each cut into two triangles.
    Cut,
}

const SHAPES: [Shape; 4] = [
    Shape::Rectangles,
    Shape::Skewed,
    Shape::Triangles,
    Shape::Mixed,
];

fn roller_box() -> Vec<Support> {
    vec![
        held("left", &[Axis::X]),
        held("right", &[Axis::X]),
        held("bottom", &[Axis::X, Axis::Y]),
    ]
}

fn solid(name: &str, material: Material) -> ElementGroup {
    ElementGroup::new(name, Formulation::Solid, material)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |a: f64, b| a.max(b.abs()))
}

fn run(problem: Problem) -> Simulation {
    let mut simulation = Simulation::new(problem).unwrap();
    simulation.run(&mut ()).unwrap();
    simulation
}

/// With ν_u not above ν of the law the water has no stiffness; earth pressure at rest cannot be tension. Both are
/// refused with their numbers.
#[test]
fn ground_that_cannot_be_is_refused() {
    let analysis = Analysis::PlaneStrain;
    let pose = |change: &dyn Fn(&mut ElementGroup)| {
        let mesh = grid(&[0.0, 1.0], &[0.0, 3.0], |_, _| 0, Shape::Rectangles);
        let mut problem = Problem::new(analysis, mesh);
        let mut clay = solid("clay", elastic(analysis, E, NU));
        change(&mut clay);
        problem.groups = vec![clay];
        problem.supports = roller_box();
        problem.phases = vec![Phase::new("load", 1)];
        match Simulation::new(problem).and_then(|mut s| s.run(&mut ())) {
            Err(Error::Refused(refusal)) => refusal.cause,
            other => panic!("{other:?}"),
        }
    };
    let cause = pose(&|clay| {
        (clay.drainage, clay.undrained_poisson_ratio) = (Drainage::Undrained, 0.2);
    });
    let Cause::NoPoreStiffness {
        undrained, drained, ..
    } = cause
    else {
        panic!("{cause:?}");
    };
    assert!((undrained - 0.2).abs() < 1e-12 && (drained - 0.3).abs() < 1e-12);
    // σ'_h = (1 − sin 40°) 8 σ'_v − 0.45/0.55 · 7 σ'_v = −2.87 σ'_v
    let cause = pose(&|clay| {
        clay.unit_weight = 18.0;
        clay.initial_stress = Some(InitialStress::AtRest(AtRest {
            ratio: Ratio::Overconsolidated {
                friction_angle: 40.0.into(),
                ocr: 8.0.into(),
                pop: 0.0.into(),
                poisson_ratio: 0.45,
            },
            surcharge: None,
        }));
    });
    assert!(matches!(cause, Cause::TensionAtRest { .. }), "{cause:?}");
}

/// A side under water that is no longer held keeps the water's pressure: what holds the other side is
/// ½ γ_w h².
#[test]
fn water_presses_on_a_side_that_is_freed() {
    for freed in [false, true] {
        let analysis = Analysis::PlaneStrain;
        let mesh = grid(
            &[0.0, 1.0, 2.0],
            &[0.0, 2.0, 4.0],
            |_, _| 0,
            Shape::Rectangles,
        );
        let mut problem = Problem::new(analysis, mesh);
        let mut ground = solid("ground", elastic(analysis, E, NU));
        ground.unit_weight = 20.0;
        ground.initial_stress = Some(k_0(0.5));
        problem.groups = vec![ground];
        problem.water = Some(Water {
            level: 4.0.into(),
            unit_weight: 10.0,
        });
        problem.supports = vec![
            held("left", &[Axis::X]),
            held("right", &[Axis::X, Axis::Y]),
            held("bottom", &[Axis::Y]),
        ];
        let mut free = Phase::new("free", 2);
        if freed {
            // What holds it along itself holds it not against the water.
            free.free = vec![Free {
                line: "right".to_owned(),
                components: vec![Axis::X],
            }];
        }
        problem.phases = vec![Phase::new("rest", 1), free];
        let simulation = run(problem);
        let held = simulation.reaction_of("left").unwrap()[0];
        // ½ γ_w h² of the water, and while both sides are held ½ K_0 γ' h² of the ground.
        let expected = if freed { 80.0 } else { 80.0 + 40.0 };
        assert!((held / expected - 1.0).abs() < 1e-9, "{freed}: {held}");
    }
}

/// Ground is taken away from a block, which then slides: there is no equilibrium, and it is reported so.
#[test]
fn no_equilibrium_beside_ground_that_is_gone() {
    let analysis = Analysis::PlaneStrain;
    let mut mesh = grid(
        &[0.0, 1.0],
        &[0.0, 1.0, 2.0, 3.0],
        |_, j| j,
        Shape::Rectangles,
    );
    name(&mut mesh, "foot", 1, 1.0);
    name(&mut mesh, "head", 1, 2.0);
    insert_joints(&mut mesh, &[("foot", 3), ("head", 4)]);
    let mut problem = Problem::new(analysis, mesh);
    for name in ["lower", "middle", "upper"] {
        let mut group = solid(name, elastic(analysis, E, NU));
        group.unit_weight = 20.0;
        group.initial_stress = Some(k_0(0.0));
        problem.groups.push(group);
    }
    for name in ["foot", "head"] {
        let law = joint([1e5; 2], 0.0, 30.0);
        problem
            .groups
            .push(ElementGroup::new(name, Formulation::ZeroThickness, law));
    }
    problem.mesh.name_line("side", |e| {
        e.iter()
            .all(|n| n[0].abs() < 1e-9 && (0.99..=2.01).contains(&n[1]))
    });
    problem.supports = vec![held("bottom", &[Axis::X, Axis::Y])];
    let mut dig = Phase::new("dig", 2);
    dig.deactivate = vec![2, 4];
    dig.force = vec![Force {
        line: "side".to_owned(),
        x: Some(100.0),
        y: None,
    }];
    problem.phases = vec![Phase::new("rest", 1), dig];
    let mut simulation = Simulation::new(problem).unwrap();
    let error = simulation.run(&mut ()).unwrap_err().to_string();
    assert!(error.contains("dig"), "{error}");
}

/// A pressure on the floor of a pit, and on ground upon which more will come.
#[test]
fn a_pressure_acts_on_a_surface_laid_bare() {
    for dug in [true, false] {
        let analysis = Analysis::PlaneStrain;
        let mut mesh = grid(&[0.0, 1.0], &[0.0, 2.0, 3.0], |_, j| j, Shape::Rectangles);
        name(&mut mesh, "floor", 1, 2.0);
        let mut problem = Problem::new(analysis, mesh);
        for name in ["lower", "upper"] {
            let mut group = solid(name, elastic(analysis, E, NU));
            group.unit_weight = 18.0;
            group.initial_stress = Some(k_0(0.5));
            problem.groups.push(group);
        }
        problem.groups[1].is_active = dug;
        problem.supports = roller_box();
        let mut dig = Phase::new("dig", 1);
        if dug {
            dig.deactivate = vec![1];
        }
        let mut load = Phase::new("load", 1);
        load.pressure = pressed("floor", 50.0);
        problem.phases = vec![dig, load];
        let simulation = run(problem);
        let reaction = simulation.reaction_of("bottom").unwrap()[1];
        assert!((reaction - 86.0).abs() < 1e-9, "{dug}: {reaction}");
    }
}

/// A force on a rigid line, up and down again on a course.
#[test]
fn a_force_follows_its_course() {
    let analysis = Analysis::PlaneStrain;
    let mesh = grid(
        &[0.0, 0.5, 1.0],
        &[0.0, 1.0, 2.0],
        |_, _| 0,
        Shape::Rectangles,
    );
    let mut problem = Problem::new(analysis, mesh);
    problem.groups = vec![solid("block", elastic(analysis, E, 0.0))];
    problem.supports = roller_box();
    let mut load = Phase::new("load", 8);
    load.rigid = vec!["top".to_owned()];
    load.force = vec![Force {
        line: "top".to_owned(),
        x: None,
        y: Some(-40.0),
    }];
    load.course = vec![[0.0, 0.0], [0.5, 1.0], [0.55, 1.5], [1.0, 0.25]];
    let mut hold = Phase::new("hold", 1);
    hold.displacement = vec![Displacement {
        line: "top".to_owned(),
        x: None,
        y: Some(0.0),
    }];
    problem.phases = vec![load, hold];
    let mut simulation = Simulation::new(problem).unwrap();
    let mut course = Vec::new();
    for _ in 0..8 {
        let increment = simulation.step().unwrap().unwrap();
        let [_, u] = simulation.displacement_of("top").unwrap();
        course.push((increment.time, -u * E / 2.0 / 40.0));
    }
    let factor = |t: f64| {
        Profile::new(vec![[0.0, 0.0], [0.5, 1.0], [0.55, 1.5], [1.0, 0.25]])
            .unwrap()
            .at(t)
    };
    for (time, share) in course {
        assert!((share - factor(time)).abs() < 1e-9, "{time}: {share}");
    }
    simulation.step().unwrap();
    let reaction = simulation.reaction_of("top").unwrap()[1];
    assert!(
        (reaction - 10.0).abs() < 1e-9,
        "held against what is left: {reaction}"
    );
}
