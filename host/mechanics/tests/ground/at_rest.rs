//! Ground at rest stays.

use super::{
    E, NU, SHAPES, Shape, elastic, grid, held, k_0, largest, pressed, roller_box, run, solid,
    straighten,
};
use mechanics::problem::{Analysis, AtRest, Axis, InitialStress, Phase, Profile, Ratio, Water};
use mechanics::{Problem, Simulation};

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
        phase.pressure = pressed("top", KPA);
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
