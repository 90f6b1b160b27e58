//! Interfaces in ground.

use super::{E, NU, Shape, elastic, grid, joint, k_0, largest, material, roller_box, run, solid};
use law::Hypothesis;
use mechanics::mesh::Along;
use mechanics::problem::{
    Analysis, ElementGroup, Formulation, Integration, Phase, Pressure, Water,
};
use mechanics::{Problem, Simulation};

/// An interface that is there from the start between ground with water in its pores and concrete without
/// carries what of the common total stress its own water leaves.
#[test]
fn an_interface_beside_dry_pores_starts_in_balance() {
    for wet in [[true, false], [false, true]] {
        for joint_is_wet in [true, false] {
            let analysis = Analysis::PlaneStrain;
            let mut mesh = grid(&[0.0, 1.0], &[0.0, 2.0, 4.0], |_, j| j, Shape::Rectangles);
            mesh.name_line("cut", |e| e.iter().all(|n| (n[1] - 2.0).abs() < 1e-9));
            let cut = Along {
                line: "cut".to_owned(),
                group: 2,
                opens_ends: true,
            };
            mesh.insert_joints(&[cut]).unwrap();
            let mut problem = Problem::new(analysis, mesh);
            for (name, is_wet) in ["lower", "upper"].into_iter().zip(wet) {
                let mut group = solid(name, elastic(analysis, E, NU));
                group.unit_weight = 18.0;
                group.initial_stress = Some(k_0(0.5));
                group.pore_water = is_wet;
                problem.groups.push(group);
            }
            let mut between = ElementGroup::new("cut", Formulation::ZeroThickness, joint(1e6));
            between.pore_water = joint_is_wet;
            problem.groups.push(between);
            problem.water = Some(Water {
                level: 3.5.into(),
                unit_weight: 10.0,
            });
            problem.supports = roller_box();
            problem.phases = vec![Phase::new("rest", 1)];
            let simulation = run(problem);
            let (_, [normal, _]) = simulation.groups()[2].jump_and_traction(0).unwrap();
            let expected = if joint_is_wet { -36.0 + 15.0 } else { -36.0 };
            assert!((normal - expected).abs() < 1e-9, "{wet:?}: {normal}");
            let moved = largest(simulation.snapshot().displacement);
            assert!(moved < 1e-12, "{wet:?} {joint_is_wet}: {moved}");
        }
    }
}

/// Blocks with an interface that is absent move as one; activated, nothing moves, and its traction is
/// the stress next to it. No node is out of balance in the course of that phase, in which water between the faces has
/// its whole pressure.
#[test]
fn an_interface_appears_with_the_stress_beside_it() {
    let all = [(Shape::Rectangles, true), (Shape::Cut, true)];
    for (shape, is_wet) in all.into_iter().chain([(Shape::Rectangles, false)]) {
        let analysis = Analysis::Axisymmetric;
        let mut mesh = grid(&[0.0, 0.5, 1.0, 2.0], &[0.0, 1.0, 2.0], |_, _| 0, shape);
        mesh.name_line("shaft", |e| {
            e.iter()
                .all(|n| (n[0] - 0.5).abs() < 1e-9 && n[1] >= 1.0 - 1e-9)
        });
        mesh.name_line("base", |e| {
            e.iter()
                .all(|n| (n[1] - 1.0).abs() < 1e-9 && n[0] <= 0.5 + 1e-9)
        });
        let along = |line: &str, group| Along {
            line: line.to_owned(),
            group,
            opens_ends: true,
        };
        mesh.insert_joints(&[along("shaft", 1), along("base", 2)])
            .unwrap();
        let mut problem = Problem::new(analysis, mesh);
        let mut ground = solid("ground", elastic(analysis, E, NU));
        ground.unit_weight = 20.0;
        ground.initial_stress = Some(k_0(0.4));
        problem.groups = vec![ground];
        for name in ["shaft", "base"] {
            let mut group = ElementGroup::new(name, Formulation::ZeroThickness, joint(1e6));
            group.is_active = false;
            problem.groups.push(group);
        }
        problem.water = is_wet.then(|| Water {
            level: 2.0.into(),
            unit_weight: 10.0,
        });
        problem.supports = roller_box();
        let mut appear = Phase::new("appear", 2);
        appear.activate = vec![1, 2];
        problem.phases = vec![Phase::new("rest", 1), appear];
        let mut simulation = Simulation::new(problem).unwrap();
        for _ in 0..2 {
            simulation.step().unwrap().unwrap();
        }
        let state = simulation.snapshot();
        let inside = state.mesh.nodes.iter().enumerate();
        let inside = inside.filter(|(_, [x, y])| *x > 0.0 && *x < 2.0 && *y > 0.0);
        for (node, at) in inside {
            let left = largest(&state.reaction[2 * node..2 * node + 2]);
            assert!(left < 1e-9, "{shape:?}: {left} at {at:?}");
        }
        let between = state.acting.pore_pressure(2, state.problem, [0.3, 1.0]);
        let expected = if is_wet { 10.0 } else { 0.0 };
        assert!((between - expected).abs() < 1e-12, "{shape:?}: {between}");
        simulation.run(&mut ()).unwrap();
        let moved = largest(simulation.snapshot().displacement);
        assert!(moved < 1e-12, "{shape:?}: {moved}");
        for (number, k) in [(1, 0.4), (2, 1.0)] {
            let group = &simulation.groups()[number];
            for point in 0..group.kinematics.n_points() {
                let [_, y] = group.kinematics.position(point);
                let effective = if is_wet { 10.0 } else { 20.0 } * (2.0 - y);
                let (_, [normal, shear]) = group.jump_and_traction(point).unwrap();
                assert!(
                    (normal + k * effective).abs() < 1e-9,
                    "{normal} {effective}"
                );
                // At the surface, too: some laws start from compression only.
                assert!(normal < 0.0, "{shape:?}: {normal} at {y}");
                assert!(shear.abs() < 1e-9);
            }
        }
    }
}

/// A pile in ground that a load on half of its surface bends. When its interfaces appear, whatever their points,
/// nothing moves: their tractions are what the faces passed on to each other.
#[test]
fn an_interface_appears_in_loaded_ground() {
    let points = [Integration::Nodes, Integration::Full];
    for (analysis, integration) in [Analysis::Axisymmetric, Analysis::PlaneStrain]
        .into_iter()
        .flat_map(|analysis| points.map(|points| (analysis, points)))
    {
        let x = [0.0, 0.5, 1.0, 2.0, 4.0];
        let mut mesh = grid(&x, &[0.0, 1.0, 2.0, 3.0], |_, _| 0, Shape::Cut);
        mesh.name_line("shaft", |e| {
            e.iter()
                .all(|n| (n[0] - 0.5).abs() < 1e-9 && n[1] >= 1.0 - 1e-9)
        });
        mesh.name_line("base", |e| {
            e.iter()
                .all(|n| (n[1] - 1.0).abs() < 1e-9 && n[0] <= 0.5 + 1e-9)
        });
        mesh.name_line("cap", |e| {
            e.iter()
                .all(|n| (n[1] - 3.0).abs() < 1e-9 && n[0] <= 1.0 + 1e-9)
        });
        let along = |line: &str, group| Along {
            line: line.to_owned(),
            group,
            opens_ends: true,
        };
        mesh.insert_joints(&[along("shaft", 1), along("base", 2)])
            .unwrap();
        let mut problem = Problem::new(analysis, mesh);
        problem.groups = vec![solid("ground", elastic(analysis, E, NU))];
        let bond = [
            ("normal_stiffness", 1e4),
            ("shear_stiffness", 1e4),
            ("cohesion", 1e6),
            ("friction_angle", 30.0),
            ("dilatancy_angle", 0.0),
            ("tensile_strength", 1e5),
        ];
        for name in ["shaft", "base"] {
            let law = material("coulomb_joint", Hypothesis::Interface2d, &bond);
            let mut group = ElementGroup::new(name, Formulation::ZeroThickness, law);
            group.integration = Some(integration);
            group.is_active = false;
            problem.groups.push(group);
        }
        problem.supports = roller_box();
        let mut load = Phase::new("load", 1);
        load.pressure = vec![Pressure {
            line: "cap".to_owned(),
            value: 100.0.into(),
        }];
        let mut appear = Phase::new("appear", 2);
        appear.activate = vec![1, 2];
        appear.reset_displacements = true;
        problem.phases = vec![load, appear];
        let simulation = run(problem);
        // 100 kPa on 3 m of ground would settle by 11 mm.
        let moved = largest(simulation.snapshot().displacement);
        assert!(moved < 1e-12, "{analysis:?}, {integration:?}: {moved}");
    }
}
