//! Ground at rest stays.

use super::{
    E, NU, SHAPES, Shape, elastic, grid, held, k_0, largest, roller_box, run, solid, straighten,
};
use mechanics::problem::{
    Analysis, AtRest, Axis, InitialStress, Integration, Phase, Pressure, Profile, Ratio, Water,
};
use mechanics::{Problem, Simulation};

/// Two layers, with water in the middle of an element or none: nothing moves, stresses are those by hand.
#[test]
fn level_ground_at_rest_stays() {
    for analysis in [Analysis::PlaneStrain, Analysis::Axisymmetric] {
        for shape in SHAPES {
            for integration in [None, Some(Integration::Full), Some(Integration::BBar)] {
                for level in [None, Some(3.0), Some(2.6), Some(7.0)] {
                    let x = [0.0, 0.7, 1.5, 3.0];
                    let mesh = grid(
                        &x,
                        &[0.0, 1.2, 2.0, 3.0, 4.0],
                        |_, row| usize::from(row > 1),
                        shape,
                    );
                    let mut problem = Problem::new(analysis, mesh);
                    let mut lower = solid("lower", elastic(analysis, E, NU));
                    (lower.unit_weight, lower.saturated_unit_weight) = (18.0, Some(18.0));
                    let mut upper = solid("upper", elastic(analysis, 0.3 * E, 0.2));
                    (upper.unit_weight, upper.saturated_unit_weight) = (16.0, Some(20.0));
                    lower.initial_stress = Some(k_0(0.5));
                    upper.initial_stress = Some(k_0(0.9));
                    problem.groups = vec![lower, upper];
                    for group in &mut problem.groups {
                        group.integration = integration;
                    }
                    problem.water = level.map(|level| Water {
                        level: level.into(),
                        unit_weight: 10.0,
                    });
                    problem.supports = roller_box();
                    problem.phases = vec![Phase::new("rest", 1)];
                    let at = format!("{analysis:?} {shape:?} {integration:?} {level:?}");
                    let simulation = run(problem);
                    let moved = largest(simulation.snapshot().displacement);
                    // 80 kPa over 4 m of the stiffness move the top by 12 mm.
                    // Where water stands within skewed elements, K_0 σ'_h bends in them.
                    let is_bent = level == Some(2.6) && shape != Shape::Rectangles;
                    let most = if is_bent { 2e-4 } else { 1e-13 };
                    assert!(moved < most, "{at}: {moved}");
                    let total: f64 = match analysis {
                        Analysis::PlaneStrain => 3.0,
                        Analysis::Axisymmetric => 9.0 * std::f64::consts::PI,
                    };
                    let table = level.unwrap_or(-1.0);
                    let wet = (table - 2.0).clamp(0.0, 2.0);
                    let weight = 36.0 + 16.0 * (2.0 - wet) + 20.0 * wet;
                    // The lake's water stands on the top, which is free.
                    let lake = (table - 4.0).max(0.0) * 10.0;
                    let reaction = simulation.reaction_of("bottom").unwrap()[1];
                    assert!(
                        (reaction / (total * (weight + lake)) - 1.0).abs() < 1e-12,
                        "{at}: {reaction}"
                    );
                    for group in simulation.groups() {
                        let (k_0, is_upper) = if group.name == "upper" {
                            (0.9, true)
                        } else {
                            (0.5, false)
                        };
                        for point in 0..group.kinematics.n_points() {
                            let [_, y] = group.kinematics.position(point);
                            let wet = (table.min(4.0) - y.max(2.0)).clamp(0.0, 2.0);
                            let dry = 4.0 - y.max(2.0) - wet;
                            let below = if is_upper { 0.0 } else { 18.0 * (2.0 - y) };
                            let pore = (table - y).max(0.0) * 10.0;
                            let v = below + 16.0 * dry + 20.0 * wet + lake - pore;
                            let stress = group.global_stress(point).unwrap();
                            let close =
                                |a: f64, b: f64| (a - b).abs() < if is_bent { 2.0 } else { 1e-9 };
                            assert!(
                                close(stress[1], -v) && close(stress[0], -k_0 * v),
                                "{at}: {stress:?} {v}"
                            );
                        }
                    }
                }
            }
        }
    }
}

/// A surcharge on the top of three layers is carried down, that of a group itself wins, and under the load that it
/// represents nothing moves.
#[test]
fn a_surcharge_is_carried_down_and_at_rest() {
    const KPA: f64 = 50.0;
    let layers = [
        ("lower", 18.0, 0.5),
        ("middle", 20.0, 0.8),
        ("upper", 16.0, 0.6),
    ];
    let at_rest = |k_0: f64, surcharge: Option<f64>| {
        InitialStress::AtRest(AtRest {
            ratio: Ratio::K0(k_0.into()),
            surcharge,
        })
    };
    let problem = |analysis, shape, own: [Option<f64>; 3]| {
        let y = [0.0, 1.0, 2.0, 3.0];
        let mesh = grid(&[0.0, 0.7, 1.5, 3.0], &y, |_, row| row, shape);
        let mut problem = Problem::new(analysis, mesh);
        let both = layers.into_iter().zip(own);
        let groups = both.map(|((name, weight, k_0), surcharge)| {
            let mut group = solid(name, elastic(analysis, E, NU));
            group.unit_weight = weight;
            group.initial_stress = Some(at_rest(k_0, surcharge));
            group
        });
        problem.groups = groups.collect();
        problem.supports = roller_box();
        let mut phase = Phase::new("rest", 1);
        phase.pressure = vec![Pressure {
            line: "top".to_owned(),
            value: KPA.into(),
        }];
        problem.phases = vec![phase];
        problem
    };
    let vertical = |simulation: &Simulation, group: usize| {
        let group = &simulation.groups()[group];
        let points = 0..group.kinematics.n_points();
        let found = points.map(|point| {
            let stress = group.global_stress(point).unwrap();
            [group.kinematics.position(point)[1], stress[0], stress[1]]
        });
        found.collect::<Vec<_>>()
    };
    for analysis in [Analysis::PlaneStrain, Analysis::Axisymmetric] {
        for shape in SHAPES {
            // Said of every layer, as it had to be before, and of the top one alone.
            for own in [
                [None, None, Some(KPA)],
                [Some(KPA); 3],
                [None, Some(KPA), Some(KPA)],
            ] {
                let simulation = run(problem(analysis, shape, own));
                let at = format!("{analysis:?} {shape:?} {own:?}");
                // 50 kPa over 3 m of the stiffness move the top by 6 mm.
                let moved = largest(simulation.snapshot().displacement);
                assert!(moved < 1e-13, "{at}: {moved}");
                for (number, (_, weight, k_0)) in layers.iter().enumerate() {
                    let above: f64 = layers[number + 1..].iter().map(|layer| layer.1).sum();
                    for [y, horizontal, found] in vertical(&simulation, number) {
                        let v = KPA + above + weight * (number as f64 + 1.0 - y);
                        assert!((found + v).abs() < 1e-9, "{at}: {found} {v}");
                        assert!((horizontal + k_0 * v).abs() < 1e-9, "{at}");
                    }
                }
            }
        }
    }
    // A group's own wins, 0 as well, over what is carried to it, and is carried on.
    for (own, expected) in [
        ([None, Some(20.0), Some(KPA)], [20.0, 20.0, KPA]),
        ([Some(20.0), None, Some(KPA)], [20.0, KPA, KPA]),
        ([None, Some(0.0), Some(KPA)], [0.0, 0.0, KPA]),
        ([None, Some(20.0), None], [20.0, 20.0, 0.0]),
    ] {
        let mut problem = problem(Analysis::PlaneStrain, Shape::Rectangles, own);
        problem.phases[0].pressure.clear();
        problem.supports.push(held("top", &[Axis::X, Axis::Y]));
        let mut simulation = Simulation::new(problem).unwrap();
        for (number, (_, weight, _)) in layers.iter().enumerate() {
            let above: f64 = layers[number + 1..].iter().map(|layer| layer.1).sum();
            for [y, _, found] in vertical(&simulation, number) {
                let v = expected[number] + above + weight * (number as f64 + 1.0 - y);
                assert!((found + v).abs() < 1e-9, "{own:?} {number}: {found} {v}");
            }
        }
        simulation.step().unwrap();
    }
}

/// The right half of the ground carries a surcharge: below the left half none exists of it.
#[test]
fn a_surcharge_is_carried_down_its_own_vertical() {
    let analysis = Analysis::PlaneStrain;
    let y = [0.0, 1.0, 2.0];
    let group = |column: usize, row: usize| if row == 0 { 0 } else { 1 + column / 2 };
    let mesh = grid(&[0.0, 1.0, 2.0, 3.0, 4.0], &y, group, Shape::Rectangles);
    let mut problem = Problem::new(analysis, mesh);
    problem.groups = [("lower", None), ("left", None), ("right", Some(30.0))]
        .map(|(name, surcharge)| {
            let mut group = solid(name, elastic(analysis, E, NU));
            group.unit_weight = 20.0;
            group.initial_stress = Some(InitialStress::AtRest(AtRest {
                ratio: Ratio::K0(0.5.into()),
                surcharge,
            }));
            group
        })
        .to_vec();
    problem.supports = roller_box();
    problem.phases = vec![Phase::new("rest", 1)];
    let simulation = Simulation::new(problem).unwrap();
    for group in simulation.groups() {
        for point in 0..group.kinematics.n_points() {
            let [x, y] = group.kinematics.position(point);
            let v = 20.0 * (2.0 - y) + if x > 2.0 { 30.0 } else { 0.0 };
            let found = group.global_stress(point).unwrap()[1];
            assert!((found + v).abs() < 1e-12, "{x} {y}: {found} {v}");
        }
    }
}

/// Sides that are curved: the stress at rest is linear in the coordinates there as well.
#[test]
fn level_ground_of_curved_elements_stays() {
    for analysis in [Analysis::PlaneStrain, Analysis::Axisymmetric] {
        for shape in [Shape::Curved, Shape::CurvedTriangles] {
            for level in [None, Some(2.0), Some(6.0)] {
                let x = [0.0, 1.0, 2.0, 3.0];
                let mesh = grid(&x, &[0.0, 1.0, 2.0, 3.0], |_, _| 0, shape);
                let mut problem = Problem::new(analysis, mesh);
                let mut ground = solid("ground", elastic(analysis, E, NU));
                (ground.unit_weight, ground.saturated_unit_weight) = (18.0, Some(20.0));
                ground.initial_stress = Some(k_0(0.5));
                problem.groups = vec![ground];
                problem.water = level.map(|level| Water {
                    level: level.into(),
                    unit_weight: 10.0,
                });
                problem.supports = roller_box();
                problem.phases = vec![Phase::new("rest", 1)];
                let moved = largest(run(problem).snapshot().displacement);
                // 60 kPa over 3 m of the stiffness move the top by 7 mm.
                assert!(moved < 1e-13, "{analysis:?} {shape:?} {level:?}: {moved}");
            }
        }
    }
}

/// A changed water table inside elements is not computed exactly, and is reported.
#[test]
fn a_water_table_inside_elements_is_announced_where_it_changes() {
    let warnings = |from: f64, to: Option<f64>| {
        let analysis = Analysis::PlaneStrain;
        let mesh = grid(
            &[0.0, 1.0],
            &[0.0, 1.0, 2.0, 3.0],
            |_, _| 0,
            Shape::Rectangles,
        );
        let mut problem = Problem::new(analysis, mesh);
        problem.groups = vec![solid("ground", elastic(analysis, E, NU))];
        problem.water = Some(Water {
            level: from.into(),
            unit_weight: 10.0,
        });
        problem.supports = roller_box();
        let mut change = Phase::new("pump", 1);
        change.water_level = to.map(Profile::from);
        problem.phases = vec![Phase::new("rest", 1), change];
        let simulation = Simulation::new(problem).unwrap();
        let warnings = simulation.warnings().iter();
        warnings
            .filter(|text| text.contains("water table"))
            .cloned()
            .collect::<Vec<_>>()
    };
    assert_eq!(warnings(2.5, None), Vec::<String>::new());
    assert_eq!(warnings(2.0, Some(1.0)), Vec::<String>::new());
    let [one, two] = ["1 element before", "2 elements before"];
    for (from, to, n) in [(2.5, 1.0, one), (2.5, 0.5, two), (2.0, 0.3, one)] {
        let found = warnings(from, Some(to));
        let expected = format!("phase `pump` changes a water table that stands inside {n}");
        assert!(found[0].starts_with(&expected), "{found:?}");
    }
}

/// Inclined layers under K_0 = 0 are at rest, too.
#[test]
fn sloping_layers_without_horizontal_stress_stay() {
    for shape in SHAPES {
        let mut mesh = grid(
            &[0.0, 1.0, 2.0, 3.0],
            &[0.0, 1.0, 2.0, 3.0],
            |_, row| row / 2,
            shape,
        );
        for node in &mut mesh.nodes {
            node[1] *= 1.0 + 0.1 * node[0];
        }
        straighten(&mut mesh);
        let analysis = Analysis::PlaneStrain;
        let mut problem = Problem::new(analysis, mesh);
        problem.groups = vec![
            solid("lower", elastic(analysis, E, 0.0)),
            solid("upper", elastic(analysis, E, 0.0)),
        ];
        for (group, weight) in problem.groups.iter_mut().zip([20.0, 17.0]) {
            group.unit_weight = weight;
            group.initial_stress = Some(k_0(0.0));
        }
        problem.supports = roller_box();
        problem.phases = vec![Phase::new("rest", 1)];
        let moved = largest(run(problem).snapshot().displacement);
        assert!(moved < 1e-13, "{shape:?}: {moved}");
    }
}
