//! Problems posed in memory that do not fit: each is refused with the part that does not, whatever
//! is in no file.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests panic to fail")]

mod common;

use common::{held, insert_joints, name};
use law::Hypothesis;
use mechanics::check::{Cause, Item, JointFault, Refusal};
use mechanics::mesh::{Along, CannotInsert};
use mechanics::problem::{
    Analysis, Axis, Displacement, Drainage, ElementGroup, Formulation, Integration, Phase, Support,
};
use mechanics::{Error, Material, Mesh, Problem, Simulation};

fn elastic() -> Material {
    common::elastic(Hypothesis::PlaneStrain, 1e4, 0.25)
}

fn joint() -> Material {
    common::joint([1e6; 2], 10.0, 30.0)
}

/// Two blocks, `lower` and `upper`, with `joint` between them, for one phase.
fn blocks() -> Problem {
    let mut mesh = Mesh::grid(&[0.0, 0.5, 1.0], &[0.0, 1.0, 2.0], |_, row| row);
    for (line, height) in [("bottom", 0.0), ("joint", 1.0), ("top", 2.0)] {
        name(&mut mesh, line, 1, height);
    }
    insert_joints(&mut mesh, &[("joint", 2)]);
    let mut problem = Problem::new(Analysis::PlaneStrain, mesh);
    problem.groups = vec![
        ElementGroup::new("lower", Formulation::Solid, elastic()),
        ElementGroup::new("upper", Formulation::Solid, elastic()),
        ElementGroup::new("joint", Formulation::ZeroThickness, joint()),
    ];
    problem.supports = ["bottom", "top"]
        .map(|line| held(line, &[Axis::X, Axis::Y]))
        .to_vec();
    problem.phases = vec![Phase::new("rest", 1)];
    problem
}

fn refused(problem: Problem) -> Refusal {
    match Simulation::new(problem) {
        Err(Error::Refused(refusal)) => *refusal,
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_is_refused_below_is_changed_from_what_runs() {
    Simulation::new(blocks()).unwrap().run(&mut ()).unwrap();
}

/// It ended in singular equations.
#[test]
fn an_interface_does_not_outlive_the_ground_beside_it() {
    let gone = |item: Item, change: fn(&mut Problem)| {
        let mut problem = blocks();
        change(&mut problem);
        let refusal = refused(problem);
        assert_eq!(refusal.item, item);
        let Cause::FaceGone {
            interface, solid, ..
        } = &refusal.cause
        else {
            panic!("{refusal:?}");
        };
        assert_eq!((interface.as_str(), solid.as_str()), ("joint", "upper"));
    };
    let changed = |phase, group, is_activated| Item::Activation {
        phase,
        group,
        is_activated,
    };
    gone(changed(1, 1, false), |problem| {
        let mut dig = Phase::new("dig", 1);
        dig.deactivate = vec![1];
        problem.phases.push(dig);
    });
    gone(changed(0, 2, true), |problem| {
        problem.groups[1].is_active = false;
        problem.groups[2].is_active = false;
        problem.phases[0].activate = vec![2];
    });
    gone(Item::Group(2), |problem| {
        problem.groups[1].is_active = false;
    });
    // Both go together.
    let mut problem = blocks();
    let mut dig = Phase::new("dig", 1);
    dig.deactivate = vec![1, 2];
    problem.phases.push(dig);
    Simulation::new(problem).unwrap().run(&mut ()).unwrap();
}

#[test]
fn settings_are_checked_without_a_file() {
    let outside = |change: fn(&mut Problem)| {
        let mut problem = blocks();
        change(&mut problem);
        match refused(problem).cause {
            Cause::Setting(name, ..) => name,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(
        outside(|p| p.settings.force_tolerance = 0.0),
        "force_tolerance"
    );
    assert_eq!(
        outside(|p| p.settings.displacement_tolerance = f64::NAN),
        "displacement_tolerance"
    );
    assert_eq!(
        outside(|p| p.settings.tolerated_residual = 0.2),
        "tolerated_residual"
    );
    assert_eq!(
        outside(|p| p.settings.max_iterations = Some(0)),
        "max_iterations"
    );
    assert_eq!(outside(|p| p.settings.max_halvings = 41), "max_halvings");
}

#[test]
fn zero_thickness_elements_have_two_faces_and_a_length() {
    let fault = |change: fn(&mut Problem)| {
        let mut problem = blocks();
        change(&mut problem);
        let refusal = refused(problem);
        assert_eq!(refusal.item, Item::Group(2));
        match refusal.cause {
            Cause::BadJoint { fault, .. } => fault,
            other => panic!("{other:?}"),
        }
    };
    let turned = fault(|problem| {
        for joint in &mut problem.mesh.joints {
            std::mem::swap(&mut joint.minus, &mut joint.plus);
        }
    });
    assert_eq!(turned, JointFault::Turned);
    let without_length = fault(|problem| {
        let joint = &mut problem.mesh.joints[0];
        (joint.minus[1], joint.plus[1]) = (joint.minus[0], joint.plus[0]);
    });
    assert_eq!(without_length, JointFault::NoLength);
    let apart = fault(|problem| problem.mesh.joints[0].plus.swap(0, 1));
    assert_eq!(apart, JointFault::Apart);
}

#[test]
fn names_and_changes_of_groups_are_given_once() {
    let mut problem = blocks();
    problem.groups[1].name = "lower".to_owned();
    let twice = Cause::TwoGroups("lower".to_owned());
    assert_eq!(refused(problem).cause, twice);
    let given = |change: fn(&mut Phase)| {
        let mut problem = blocks();
        change(&mut problem.phases[0]);
        match refused(problem).cause {
            Cause::GivenTwice(what, group) => {
                assert_eq!(group, "upper");
                what
            }
            other => panic!("{other:?}"),
        }
    };
    let laws = given(|phase| phase.materials = vec![(1, elastic()), (1, elastic())]);
    assert_eq!(laws, "a law");
    let weights = given(|phase| phase.unit_weight = vec![(1, 18.0), (1, 19.0)]);
    assert_eq!(weights, "a unit weight");
    let drainage = given(|phase| {
        phase.drainage = vec![(1, Drainage::Drained), (1, Drainage::Undrained)];
    });
    assert_eq!(drainage, "a drainage");
}

#[test]
fn a_mesh_of_nothing_is_refused_like_any_other() {
    for (x, y) in [(vec![], vec![0.0, 1.0]), (vec![0.0, 1.0], vec![0.0])] {
        let mesh = Mesh::grid(&x, &y, |_, _| 0);
        assert_eq!(mesh, Mesh::default());
        assert!(mesh.longer_side().abs() <= 0.0);
        let mut problem = Problem::new(Analysis::Axisymmetric, mesh);
        problem.groups = vec![ElementGroup::new("none", Formulation::Solid, elastic())];
        problem.phases = vec![Phase::new("rest", 1)];
        problem.analysis = Analysis::PlaneStrain;
        let cause = refused(problem).cause;
        assert_eq!(cause, Cause::NoElements("none".to_owned()));
    }
}

#[test]
fn what_cannot_be_inserted_is_an_error_in_words() {
    let along = |line: &str| {
        [Along {
            line: line.to_owned(),
            group: 0,
            opens_ends: true,
        }]
    };
    let mut mesh = Mesh::grid(&[0.0, 1.0], &[0.0, 1.0], |_, _| 0);
    mesh.name_line("top", |edge| edge.iter().all(|node| node[1] >= 1.0));
    let words = |found: Result<(), CannotInsert>| {
        let error: Box<dyn std::error::Error> = Box::new(found.unwrap_err());
        error.to_string()
    };
    assert_eq!(
        words(mesh.insert_joints(&along("top"))),
        "line 1: it lies on the boundary: nothing to split, at (0.5, 1)"
    );
    assert_eq!(
        words(mesh.insert_joints(&along("none"))),
        "line 1: there is no such line, or it is a point"
    );
}

/// The middle of a layer with mean strain is held with its faces, by this phase or an earlier one.
#[test]
fn middles_of_layers_are_held_with_their_faces_over_phases() {
    let push = |lines: &[(&str, f64)]| {
        lines
            .iter()
            .map(|&(line, y)| Displacement {
                line: line.to_owned(),
                x: None,
                y: Some(y),
            })
            .collect::<Vec<_>>()
    };
    let problem = |second: &[(&str, f64)]| {
        let mut mesh = Mesh::grid(&[0.0, 0.1], &[0.0, 1.0], |_, _| 0);
        // The middle of the upper end, and its corners.
        mesh.name_line("end", |edge| edge.iter().all(|node| node[1] >= 1.0));
        mesh.name_line("bottom", |edge| edge.iter().all(|node| node[1] <= 0.0));
        let all = mesh.lines["end"].nodes.clone();
        let is_middle = |node: &usize| (mesh.nodes[*node][0] - 0.05).abs() < 1e-9;
        for (name, middle) in [("middle", true), ("corners", false)] {
            let nodes = all.iter().copied().filter(|node| is_middle(node) == middle);
            let line = mechanics::mesh::Line {
                nodes: nodes.collect(),
                edges: Vec::new(),
            };
            mesh.lines.insert(name.to_owned(), line);
        }
        let mut problem = Problem::new(Analysis::PlaneStrain, mesh);
        let mut layer = ElementGroup::new("layer", Formulation::ThinLayer, elastic());
        layer.integration = Some(Integration::Mean);
        problem.groups = vec![layer];
        problem.supports = vec![Support {
            line: "bottom".to_owned(),
            fixed: vec![Axis::X, Axis::Y],
        }];
        let mut first = Phase::new("first", 1);
        first.displacement = push(&[("middle", -0.01), ("corners", -0.01)]);
        let mut then = Phase::new("then", 1);
        then.displacement = push(second);
        problem.phases = vec![first, then];
        problem
    };
    // The middle stays at −1 cm, where the first phase put it: its faces do not.
    let refusal = refused(problem(&[("corners", 0.0)]));
    assert_eq!(refusal.item, Item::Phase(1));
    assert!(matches!(refusal.cause, Cause::Tied { .. }), "{refusal:?}");
    // The faces stay at −1 cm, and so does the middle, which is said again.
    Simulation::new(problem(&[("middle", -0.01)]))
        .unwrap()
        .run(&mut ())
        .unwrap();
}
