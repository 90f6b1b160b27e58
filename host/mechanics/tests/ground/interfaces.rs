//! Interfaces in ground.

use super::{
    E, NU, Shape, elastic, grid, insert_joints, joint, k_0, largest, material, name, pressed,
    roller_box, run, solid,
};
use law::Hypothesis;
use mechanics::Problem;
use mechanics::problem::{Analysis, ElementGroup, Formulation, Integration, Phase, Water};

/// An interface that is there from the start between ground with water in its pores and concrete without
/// carries what of the common total stress its own water leaves.
#[test]
fn an_interface_beside_dry_pores_starts_in_balance() {
    for wet in [[true, false], [false, true]] {
        for joint_is_wet in [true, false] {
            let analysis = Analysis::PlaneStrain;
            let mut mesh = grid(&[0.0, 1.0], &[0.0, 2.0, 4.0], |_, j| j, Shape::Rectangles);
            name(&mut mesh, "cut", 1, 2.0);
            insert_joints(&mut mesh, &[("cut", 2)]);
            let mut problem = Problem::new(analysis, mesh);
            for (name, is_wet) in ["lower", "upper"].into_iter().zip(wet) {
                let mut group = solid(name, elastic(analysis, E, NU));
                group.unit_weight = 18.0;
                group.initial_stress = Some(k_0(0.5));
                group.pore_water = is_wet;
                problem.groups.push(group);
            }
            let mut between = ElementGroup::new(
                "cut",
                Formulation::ZeroThickness,
                joint([1e6; 2], 1e6, 30.0),
            );
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
        insert_joints(&mut mesh, &[("shaft", 1), ("base", 2)]);
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
        load.pressure = pressed("cap", 100.0);
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
