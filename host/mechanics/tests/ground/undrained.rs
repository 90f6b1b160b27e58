//! Undrained ground.

use super::{E, NU, Shape, elastic, grid, oedometric, pressed, roller_box, run, solid};
use mechanics::Problem;
use mechanics::problem::{Analysis, Drainage, Phase};

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
        load.pressure = pressed("top", 50.0);
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
