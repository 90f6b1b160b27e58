//! Undrained ground.

use super::{E, NU, SHAPES, Shape, elastic, grid, oedometric, roller_box, run, solid};
use mechanics::problem::{Analysis, Drainage, Phase, Pressure};
use mechanics::{Problem, Simulation};

/// Undrained under q: Δu = K_w/n Δε_v; drained: q H/E_oed.
#[test]
fn an_undrained_column_carries_by_its_water_and_then_settles() {
    for shape in SHAPES {
        let analysis = Analysis::Axisymmetric;
        let mesh = grid(&[0.0, 0.5, 1.0], &[0.0, 1.0, 3.0], |_, _| 0, shape);
        let mut problem = Problem::new(analysis, mesh);
        let mut clay = solid("clay", elastic(analysis, E, NU));
        (clay.drainage, clay.undrained_poisson_ratio) = (Drainage::Undrained, 0.495);
        problem.groups = vec![clay];
        problem.supports = roller_box();
        let mut load = Phase::new("load", 1);
        load.pressure = vec![Pressure {
            line: "top".to_owned(),
            value: 50.0.into(),
        }];
        let mut drain = Phase::new("drain", 4);
        drain.drainage = vec![(0, Drainage::Drained)];
        problem.phases = vec![load, drain];
        let mut simulation = Simulation::new(problem).unwrap();
        simulation.step().unwrap();
        let (g, k) = (E / (2.0 * (1.0 + NU)), E / (3.0 * (1.0 - 2.0 * NU)));
        let k_w = 2.0 * g * 1.495 / (3.0 * 0.01) - k;
        let strain = 50.0 / (oedometric(E, NU) + k_w);
        let top = |s: &Simulation| -s.displacement_of("top").unwrap()[1];
        assert!((top(&simulation) / (3.0 * strain) - 1.0).abs() < 1e-9);
        let u = simulation.groups()[0].excess_pore_pressure(0);
        assert!((u / (k_w * strain) - 1.0).abs() < 1e-9, "{u}");
        simulation.step().unwrap();
        let u_1 = simulation.groups()[0].excess_pore_pressure(0);
        assert!((u_1 / u - 0.75).abs() < 1e-9, "a quarter has gone: {u_1}");
        simulation.run(&mut ()).unwrap();
        assert!((top(&simulation) / (150.0 / oedometric(E, NU)) - 1.0).abs() < 1e-9);
        assert!(simulation.groups()[0].excess_pore_pressure(0).abs() < 1e-9);
    }
}

/// Undrained ground that a phase brings is undrained, whenever that was said of it.
#[test]
fn ground_that_appears_undrained_is_undrained() {
    for said_by_phase in [false, true] {
        let analysis = Analysis::PlaneStrain;
        let mesh = grid(&[0.0, 1.0], &[0.0, 1.0, 3.0], |_, j| j, Shape::Rectangles);
        let mut problem = Problem::new(analysis, mesh);
        let mut fill = solid("fill", elastic(analysis, E, NU));
        fill.is_active = false;
        if !said_by_phase {
            fill.drainage = Drainage::Undrained;
        }
        fill.undrained_poisson_ratio = 0.495;
        problem.groups = vec![solid("ground", elastic(analysis, E, NU)), fill];
        problem.supports = roller_box();
        let mut before = Phase::new("before", 1);
        if said_by_phase {
            before.drainage = vec![(1, Drainage::Undrained)];
        }
        let mut appear = Phase::new("appear", 1);
        appear.activate = vec![1];
        let mut load = Phase::new("load", 1);
        load.pressure = vec![Pressure {
            line: "top".to_owned(),
            value: 50.0.into(),
        }];
        problem.phases = vec![before, appear, load];
        let simulation = run(problem);
        let (g, k) = (E / (2.0 * (1.0 + NU)), E / (3.0 * (1.0 - 2.0 * NU)));
        let k_w = 2.0 * g * 1.495 / (3.0 * 0.01) - k;
        let strain = 50.0 / (oedometric(E, NU) + k_w);
        let u = simulation.groups()[1].excess_pore_pressure(0);
        assert!((u / (k_w * strain) - 1.0).abs() < 1e-9, "{u}");
        let top = -simulation.displacement_of("top").unwrap()[1];
        let expected = 2.0 * strain + 50.0 / oedometric(E, NU);
        assert!((top / expected - 1.0).abs() < 1e-9, "{top} {expected}");
    }
}
