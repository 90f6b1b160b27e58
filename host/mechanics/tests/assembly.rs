//! Matrices of elements that are kept: added up to the same bits as those that are computed again, in the room that was
//! announced.
#![allow(clippy::unwrap_used, reason = "tests panic to fail")]

mod common;

use common::{held, material};
use law::{Hypothesis, Operator};
use mechanics::assembly::{Elements, System};
use mechanics::problem::{Analysis, Axis, ElementGroup, Formulation, Phase};
use mechanics::{Mesh, Model, Problem};

const COLUMNS: usize = 20;

/// A group of a law of this workspace under 100 kPa.
fn group(id: &str, values: &[(&str, f64)]) -> ElementGroup {
    let material = material(id, Hypothesis::PlaneStrain, values);
    let mut group = ElementGroup::new(id, Formulation::Solid, material);
    group.initial_stress = Some([-100.0, -100.0, -100.0, 0.0].into());
    group
}

/// A square of 20 × 20 quads of Mohr–Coulomb soil, and as many elastic ones to the right of it.
fn soil() -> Problem {
    let stiffness = [("young_modulus", 2e4), ("poisson_ratio", 0.3)];
    let strength = [
        ("cohesion", 1.0),
        ("friction_angle", 30.0),
        ("dilatancy_angle", 5.0),
    ];
    let lines: Vec<f64> = (0..=COLUMNS).map(|i| i as f64 / COLUMNS as f64).collect();
    let twice: Vec<f64> = (0..=2 * COLUMNS)
        .map(|i| i as f64 / COLUMNS as f64)
        .collect();
    let mut mesh = Mesh::grid(&twice, &lines, |column, _| usize::from(column >= COLUMNS));
    mesh.name_line("bottom", |edge| edge.iter().all(|node| node[1] <= 0.0));
    let mut problem = Problem::new(Analysis::PlaneStrain, mesh);
    problem.groups = vec![
        group("mohr_coulomb", &[&stiffness[..], &strength].concat()),
        group("elastic", &stiffness),
    ];
    problem.supports = vec![held("bottom", &[Axis::X, Axis::Y])];
    problem.phases = vec![Phase::new("push", 1)];
    problem
}

#[test]
fn kept_matrices_give_the_bits_of_new_ones() {
    let problem = soil();
    let nodes = &problem.mesh.nodes;
    let mut model = Model::build(&problem).unwrap();
    let mut prescribed = vec![false; 2 * nodes.len()];
    for (node, [_, y]) in nodes.iter().enumerate() {
        prescribed[2 * node] = *y <= 0.0;
        prescribed[2 * node + 1] = *y <= 0.0;
    }
    let system = System::new(&model.groups, |_, _| true, &prescribed, &[], None);
    let mut kept = Elements::default();
    let mut last = Vec::new();
    let mut n_unchanged = 0;
    // Nothing, a shear strain of a part to the left that grows and shrinks, all of it, nothing.
    for (part, strain) in [
        (0.0, 0.0),
        (0.1, 1e-5),
        (0.1, 0.3),
        (0.6, 0.2),
        (0.2, 0.1),
        (1.0, 0.1),
        (0.0, 0.0),
    ] {
        let mut increment = vec![0.0; 2 * nodes.len()];
        for (node, [x, y]) in nodes.iter().enumerate() {
            increment[2 * node] = strain * y * (part - x).max(0.0);
        }
        for group in &mut model.groups {
            group
                .evaluate(&increment, Operator::Consistent, 0.0, 1.0)
                .unwrap();
        }
        let mut anew = Vec::new();
        let before = kept.values().to_vec();
        system.assemble(&model.groups, &mut anew);
        let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        let is_known = system.is_sum_of_tangents(&kept, &model.groups);
        assert_eq!(is_known, bits(&anew) == last);
        system.assemble_after(&mut kept, &model.groups);
        assert!(system.is_sum_of_tangents(&kept, &model.groups));
        let values = kept.values();
        assert_eq!(bits(&anew), bits(values));
        for (column, &largest) in kept.largest().iter().enumerate() {
            let column = &values[system.pattern.places(column)];
            let most = column.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
            assert_eq!(largest.to_bits(), most.to_bits());
        }
        // What is not said to have changed has not.
        let changed = kept.changed();
        for column in (0..changed.len()).filter(|_| !before.is_empty()) {
            for at in system.pattern.places(column) {
                let may_differ = changed[column] && changed[system.pattern.rows[at] as usize];
                assert!(may_differ || before[at].to_bits() == values[at].to_bits());
            }
        }
        n_unchanged += changed.iter().filter(|changed| !**changed).count();
        assert_eq!(kept.bytes(), system.bytes_of_elements(&model.groups));
        // Flow has changed entries, or taken changes back: what is compared is not one matrix.
        let has_yielded = strain > 1e-2;
        assert!(last.is_empty() || !has_yielded || last != bits(values));
        last = bits(values);
    }
    assert!(n_unchanged > 0);
}

/// A matrix that is assembled once reserves no memory for another time.
#[test]
fn a_matrix_that_never_changes_has_nothing_kept() {
    let mut problem = soil();
    let elastic = problem.groups[1].clone();
    problem.groups[0] = ElementGroup {
        name: "left".to_owned(),
        ..elastic
    };
    let model = Model::build(&problem).unwrap();
    let prescribed = vec![false; 2 * problem.mesh.nodes.len()];
    let system = System::new(&model.groups, |_, _| true, &prescribed, &[], None);
    assert!(system.is_constant(&model.groups));
    assert_eq!(system.bytes_of_elements(&model.groups), 0);
}
