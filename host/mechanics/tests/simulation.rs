//! Simulations posed in memory: states that are gone on from twice, simulations next to each other, and
//! meshes that no grid has.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::float_cmp,
    reason = "tests panic to fail; equal bits are meant"
)]

mod common;

use common::{cut, held, insert_joints, joint, material, name, name_sides, pressed};
use law::Hypothesis;
use mechanics::problem::{
    Analysis, Axis, Displacement, ElementGroup, Formulation, InitialStress, Phase,
};
use mechanics::{Error, Material, Mesh, Problem, Simulation};

const E: f64 = 1e4;
const NU: f64 = 0.25;

fn elastic(hypothesis: Hypothesis) -> Material {
    common::elastic(hypothesis, E, NU)
}

/// Quads of a grid, each cut into two triangles along one diagonal or the other.
fn triangles(mut mesh: Mesh) -> Mesh {
    cut(&mut mesh, |number| Some(number % 2 == 0));
    mesh
}

fn moved(line: &str, x: Option<f64>, y: Option<f64>) -> Displacement {
    let line = line.to_owned();
    Displacement { line, x, y }
}

/// A block that slides on another under a pressure: top loaded, then pushed sideways.
fn sliding(mesh: fn(Mesh) -> Mesh, friction_angle: f64) -> Problem {
    let grid = Mesh::grid(&[0.0, 0.5, 1.0], &[0.0, 0.5, 1.0], |_, row| row);
    let mut mesh = mesh(grid);
    name_sides(&mut mesh);
    name(&mut mesh, "joint", 1, 0.5);
    insert_joints(&mut mesh, &[("joint", 2)]);
    let mut problem = Problem::new(Analysis::PlaneStrain, mesh);
    let solid =
        |name: &str| ElementGroup::new(name, Formulation::Solid, elastic(Hypothesis::PlaneStrain));
    problem.groups = vec![
        solid("lower"),
        solid("upper"),
        ElementGroup::new(
            "joint",
            Formulation::ZeroThickness,
            joint([1e7, 1e6], 0.0, friction_angle),
        ),
    ];
    problem.supports = vec![held("bottom", &[Axis::X, Axis::Y])];
    let mut press = Phase::new("press", 2);
    press.pressure = pressed("top", 100.0);
    press.displacement = vec![moved("top", Some(0.0), None)];
    let mut push = Phase::new("push", 8);
    push.displacement = vec![moved("top", Some(0.1), None)];
    problem.phases = vec![press, push];
    problem
}

/// Reactions of the top, increment by increment.
fn curve(simulation: &mut Simulation) -> Vec<f64> {
    let mut curve = Vec::new();
    while simulation.step().unwrap().is_some() {
        curve.push(simulation.reaction_of("top").unwrap()[0]);
    }
    curve
}

/// Sliding takes N tan φ, N = 100 kPa over 1 m, whatever the elements are.
#[test]
fn a_block_slides_at_its_friction() {
    for mesh in [|mesh| mesh, triangles as fn(Mesh) -> Mesh] {
        let mut simulation = Simulation::new(sliding(mesh, 30.0)).unwrap();
        let last = *curve(&mut simulation).last().unwrap();
        let expected = 100.0 * 30f64.to_radians().tan();
        assert!((last - expected).abs() < 1e-6 * expected, "{last}");
    }
}

/// From one state twice, and from a copy of it in another simulation: the same bits.
#[test]
fn a_state_is_gone_on_from_twice() {
    let problem = sliding(|mesh| mesh, 30.0);
    let mut simulation = Simulation::new(problem.clone()).unwrap();
    assert!(simulation.state().is_none());
    for _ in 0..5 {
        simulation.step().unwrap();
    }
    let state = simulation.state().unwrap();
    let there = simulation.snapshot().displacement.to_vec();
    let first = curve(&mut simulation);
    assert_eq!(first.len(), 5);
    simulation.go_to(state.clone()).unwrap();
    assert_eq!(simulation.snapshot().displacement, there);
    assert_eq!(curve(&mut simulation), first);
    let mut other = Simulation::new(problem).unwrap();
    other.go_to(state.clone()).unwrap();
    assert_eq!(curve(&mut other), first);
    // A state of another mesh is no state of this one.
    let mut finer = Simulation::new(sliding(triangles, 30.0)).unwrap();
    assert!(matches!(finer.go_to(state), Err(Error::OtherState(_))));
}

/// A state contains the largest forces of earlier phases: measured by them the rest after unloading is round-off, also
/// in phases long after a stop.
#[test]
fn the_largest_forces_of_earlier_phases_are_gone_on_with() {
    let mut problem = sliding(|mesh| mesh, 30.0);
    let pressed = |name: &str, value: f64| {
        let mut phase = Phase::new(name, 2);
        phase.pressure = pressed("top", value);
        phase
    };
    let rest = ["rest", "rest on", "rest still"].map(|name| Phase::new(name, 2));
    problem.phases = vec![pressed("press", 1e3), pressed("release", 0.0)];
    problem.phases.extend(rest);
    let kept = |simulation: &mut Simulation| {
        let state = serde_json::to_value(simulation.state().unwrap()).unwrap();
        let loads = &state["course"]["loads"];
        (state["largest_forces"].clone(), loads["largest"].clone())
    };
    let steps = |simulation: &mut Simulation, n: usize| {
        for _ in 0..n {
            simulation.step().unwrap();
        }
    };
    let mut whole = Simulation::new(problem.clone()).unwrap();
    steps(&mut whole, 9);
    let expected = kept(&mut whole);
    assert!(
        expected
            .0
            .as_array()
            .unwrap()
            .iter()
            .any(|force| force.as_f64().unwrap() > 10.0)
    );
    for increments in 1..9 {
        let mut first = Simulation::new(problem.clone()).unwrap();
        steps(&mut first, increments);
        let mut second = Simulation::new(problem.clone()).unwrap();
        second.go_to(first.state().unwrap()).unwrap();
        steps(&mut second, 9 - increments);
        assert_eq!(kept(&mut second), expected, "{increments}");
    }
}

/// A thin layer keeps the elastic stiffnesses of the stress that its law started from, and so does a state of it:
/// those of the stress where it was left would be others.
#[test]
fn a_layer_whose_stiffness_follows_the_stress_is_gone_on_from() {
    let mut mesh = Mesh::grid(&[0.0, 0.5, 1.0], &[0.0, 0.5, 0.51, 1.0], |_, row| {
        usize::from(row == 1)
    });
    name_sides(&mut mesh);
    let mut problem = Problem::new(Analysis::PlaneStrain, mesh);
    let values = [
        ("normal_stiffness", 1e6),
        ("stiffness_number", 2e3),
        ("stiffness_exponent", 0.5),
        ("failure_ratio", 0.9),
        ("adhesion", 1.0),
        ("friction_angle", 30.0),
    ];
    let joint = material("hyperbolic_joint", Hypothesis::Interface2d, &values);
    let mut layer = ElementGroup::new("layer", Formulation::ThinLayer, joint);
    let solid = elastic(Hypothesis::PlaneStrain);
    let mut blocks = ElementGroup::new("blocks", Formulation::Solid, solid);
    for group in [&mut layer, &mut blocks] {
        group.initial_stress = Some(InitialStress::Constant([0.0, -20.0, 0.0, 0.0]));
    }
    problem.groups = vec![blocks, layer];
    problem.supports = vec![held("bottom", &[Axis::X, Axis::Y])];
    let mut press = Phase::new("press", 2);
    press.pressure = pressed("top", 200.0);
    press.displacement = vec![moved("top", Some(0.0), None)];
    let mut push = Phase::new("push", 3);
    push.displacement = vec![moved("top", Some(1e-3), None)];
    problem.phases = vec![press, push];
    let mut whole = Simulation::new(problem.clone()).unwrap();
    let expected = curve(&mut whole);
    for increments in 1..5 {
        let mut first = Simulation::new(problem.clone()).unwrap();
        for _ in 0..increments {
            first.step().unwrap();
        }
        let mut second = Simulation::new(problem.clone()).unwrap();
        second.go_to(first.state().unwrap()).unwrap();
        assert_eq!(curve(&mut second), expected[increments..], "{increments}");
    }
}

/// A line whose ends had sunk by different amounts when it became rigid is led to one total, like one that is not
/// rigid; the straightening is reported if it is large. With reset displacements it keeps its tilt.
#[test]
fn a_tilted_line_that_became_rigid_is_led_to_one_place() {
    struct Heard(Vec<String>);
    impl mechanics::Watch for Heard {
        fn warning(&mut self, warning: &mechanics::simulation::Warning) {
            self.0.push(warning.to_string());
        }
    }
    let push = |kpa: f64, resets: bool, line: &str| {
        let mut mesh = Mesh::grid(&[0.0, 0.5, 1.0], &[0.0, 1.0], |column, _| column);
        name_sides(&mut mesh);
        let ends = mesh.lines["top"].nodes.iter().copied();
        let ends = ends.filter(|&node| (mesh.nodes[node][0] - 0.5).abs() > 0.4);
        let nodes = ends.collect();
        let edges = Vec::new();
        let corners = mechanics::mesh::Line { nodes, edges };
        mesh.lines.insert("corners".to_owned(), corners);
        let mut problem = Problem::new(Analysis::PlaneStrain, mesh);
        let of = |e: f64| {
            let values = [("young_modulus", e), ("poisson_ratio", NU)];
            material("elastic", Hypothesis::PlaneStrain, &values)
        };
        problem.groups = vec![
            ElementGroup::new("soft", Formulation::Solid, of(E)),
            ElementGroup::new("stiff", Formulation::Solid, of(10.0 * E)),
        ];
        problem.supports = vec![held("bottom", &[Axis::X, Axis::Y])];
        let mut press = Phase::new("press", 1);
        press.pressure = pressed("top", kpa);
        let mut rest = Phase::new("rest", 1);
        rest.rigid = vec!["top".to_owned()];
        let mut push = Phase::new("push", 1);
        push.reset_displacements = resets;
        push.displacement = vec![moved(line, None, Some(-0.05))];
        let hold = Phase::new("hold", 1);
        problem.phases = vec![press, rest, push, hold];
        let mut simulation = Simulation::new(problem).unwrap();
        assert_eq!(simulation.warnings(), &[] as &[String]);
        let mut heard = Heard(Vec::new());
        simulation.run(&mut heard).unwrap();
        let nodes = &simulation.problem().mesh.lines["top"].nodes;
        let state = simulation.snapshot();
        for node in nodes {
            assert_eq!(
                state.displacement[2 * node + 1].to_bits(),
                (-0.05_f64).to_bits()
            );
        }
        heard
            .0
            .iter()
            .filter(|said| said.contains("`push`: nodes that are now tied together"))
            .count()
    };
    for line in ["top", "corners"] {
        // 1e-3 kPa tilt it by some 1e-8 m.
        assert_eq!(push(1e-3, false, line), 0);
        assert_eq!(push(100.0, false, line), 1);
        assert_eq!(push(100.0, true, line), 0);
    }
}

/// A line that becomes rigid in the second phase cannot be pushed at one end and held at the other in the third: that
/// is known before the first.
#[test]
fn a_rigid_line_that_is_pulled_apart_later_is_refused_at_once() {
    let with = |resets: bool, back: f64| {
        let mut mesh = Mesh::grid(&[0.0, 0.5, 1.0], &[0.0, 1.0], |_, _| 0);
        name_sides(&mut mesh);
        let mut problem = Problem::new(Analysis::PlaneStrain, mesh);
        problem.groups = vec![ElementGroup::new(
            "block",
            Formulation::Solid,
            elastic(Hypothesis::PlaneStrain),
        )];
        problem.supports = vec![held("left", &[Axis::X, Axis::Y])];
        let mut push = Phase::new("push", 1);
        push.displacement = vec![moved("right", None, Some(-0.01))];
        let mut rest = Phase::new("rest", 1);
        rest.rigid = vec!["top".to_owned()];
        let mut back_again = Phase::new("back", 1);
        back_again.reset_displacements = resets;
        back_again.displacement = vec![moved("right", None, Some(back))];
        problem.phases = vec![push, rest, back_again];
        Simulation::new(problem)
    };
    let refused = with(false, -0.02).unwrap_err();
    let Error::Refused(refusal) = refused else {
        panic!("{refused:?}");
    };
    let mechanics::check::Cause::MovesAlike(_, by) = refusal.cause else {
        panic!("{refusal:?}");
    };
    assert!(
        by[0].abs() < 1e-12 && (by[1] + 0.01).abs() < 1e-12,
        "{by:?}"
    );
    assert!(with(true, -0.01).is_err());
    with(false, -0.01).unwrap().run(&mut ()).unwrap();
    with(true, 0.0).unwrap().run(&mut ()).unwrap();
}

/// A prescribed node of a rigid line holds the whole line: its reaction is that of the line, and all reactions balance.
#[test]
fn a_node_that_leads_a_rigid_line_has_its_reaction() {
    let mut mesh = Mesh::grid(&[0.0, 0.5, 1.0], &[0.0, 1.0], |_, _| 0);
    name_sides(&mut mesh);
    let corner = mesh.nodes.iter().position(|at| *at == [1.0, 1.0]).unwrap();
    let point = mechanics::mesh::Line {
        nodes: vec![corner],
        edges: Vec::new(),
    };
    mesh.lines.insert("corner".to_owned(), point);
    let mut problem = Problem::new(Analysis::PlaneStrain, mesh);
    problem.groups = vec![ElementGroup::new(
        "block",
        Formulation::Solid,
        elastic(Hypothesis::PlaneStrain),
    )];
    problem.supports = vec![held("bottom", &[Axis::Y]), held("left", &[Axis::X])];
    let mut push = Phase::new("push", 1);
    push.rigid = vec!["top".to_owned()];
    push.displacement = vec![moved("corner", None, Some(-0.01))];
    problem.phases = vec![push];
    let mut simulation = Simulation::new(problem).unwrap();
    simulation.run(&mut ()).unwrap();
    let [of_left, of_bottom, of_top, of_corner] =
        ["left", "bottom", "top", "corner"].map(|line| simulation.reaction_of(line).unwrap());
    let load = of_bottom[1];
    assert!(load > 1.0);
    assert!((of_corner[1] + load).abs() < 1e-9 * load, "{of_corner:?}");
    assert!((of_top[1] + load).abs() < 1e-9 * load, "{of_top:?}");
    // The top is held in x where it meets the left side.
    assert!(of_left[0].abs() < 1e-9 * load, "{of_left:?}");
}

/// Simulations in threads of one process give what each gives alone.
#[test]
fn simulations_do_not_see_each_other() {
    let angles = [20.0, 35.0, 20.0, 35.0];
    let alone = angles.map(|angle| {
        let mut simulation = Simulation::new(sliding(|mesh| mesh, angle)).unwrap();
        curve(&mut simulation)
    });
    let together = std::thread::scope(|scope| {
        let threads = angles.map(|angle| {
            scope.spawn(move || {
                let mut simulation = Simulation::new(sliding(|mesh| mesh, angle)).unwrap();
                curve(&mut simulation)
            })
        });
        threads.map(|thread| thread.join().unwrap())
    });
    assert_eq!(alone, together);
    assert_eq!(together[0], together[2]);
    assert!(together[0] != together[1]);
}

/// Refusals name the faulty part as data, not in a sentence.
#[test]
fn a_problem_that_cannot_be_is_refused_by_its_part() {
    use mechanics::check::{Cause, Item};
    let refused = |change: &dyn Fn(&mut Problem)| {
        let mut problem = sliding(|mesh| mesh, 30.0);
        change(&mut problem);
        match Simulation::new(problem) {
            Err(Error::Refused(refusal)) => *refusal,
            other => panic!("{other:?}"),
        }
    };
    let loose = refused(&|problem| {
        problem.supports.clear();
        problem.phases[0].displacement.clear();
    });
    assert_eq!(loose.item, Item::Phase(0));
    assert!(matches!(loose.cause, Cause::Loose { part: None, .. }));
    let missing = refused(&|problem| problem.phases[1].displacement[0].line = "lid".to_owned());
    assert_eq!(missing.item, Item::Displacement(1, 0));
    assert!(matches!(missing.cause, Cause::NoLine { .. }));
    let none = refused(&|problem| problem.phases.clear());
    assert_eq!((none.item, none.cause), (Item::Problem, Cause::NoPhase));
}
