//! Ground at rest, under water, built up and taken away: against what is known by hand.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests panic to fail")]

use law::{Hypothesis, SearchPath};
use mechanics::check::Cause;
use mechanics::mesh::{Along, Solid};
use mechanics::problem::{
    Analysis, AtRest, Axis, Displacement, Drainage, ElementGroup, Force, Formulation, Free,
    InitialStress, Integration, Phase, Pressure, Profile, Ratio, Support, Variation, Water,
};
use mechanics::{Error, Material, Mesh, Problem, Simulation};

fn material(id: &str, hypothesis: Hypothesis, values: &[(&str, f64)]) -> Material {
    let target = std::env::current_exe().unwrap();
    let deps = target.parent().unwrap().to_owned();
    let search = SearchPath::new(&[deps.clone(), deps.parent().unwrap().to_owned()]);
    let values: Vec<_> = values.iter().map(|&(id, v)| (id, v.into())).collect();
    let law = search.law(id).unwrap().with(hypothesis, &values).unwrap();
    Material::new(id, law)
}

const E: f64 = 2e4;
const NU: f64 = 0.3;

fn elastic(analysis: Analysis, e: f64, nu: f64) -> Material {
    let hypothesis = match analysis {
        Analysis::Axisymmetric => Hypothesis::Axisymmetric,
        Analysis::PlaneStrain => Hypothesis::PlaneStrain,
    };
    material(
        "elastic",
        hypothesis,
        &[("young_modulus", e), ("poisson_ratio", nu)],
    )
}

fn joint(k: f64) -> Material {
    let values = [
        ("normal_stiffness", k),
        ("shear_stiffness", k),
        ("cohesion", 1e6),
        ("friction_angle", 30.0),
        ("dilatancy_angle", 0.0),
    ];
    material("coulomb_joint", Hypothesis::Interface2d, &values)
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
    if shape != Shape::Rectangles && shape != Shape::Cut {
        let (left, right) = (x[0], x[x.len() - 1]);
        for node in &mut mesh.nodes {
            let t = (node[0] - left) / (right - left);
            node[0] += 0.25 * (right - left) / x.len() as f64
                * t
                * (1.0 - t)
                * 4.0
                * (3.0 * node[1]).sin();
        }
        if !matches!(shape, Shape::Curved | Shape::CurvedTriangles) {
            straighten(&mut mesh);
        }
    }
    if matches!(
        shape,
        Shape::Triangles | Shape::Cut | Shape::CurvedTriangles
    ) {
        triangles(&mut mesh, |_| true);
    } else if shape == Shape::Mixed {
        triangles(&mut mesh, |number| number % 3 == 0);
    }
    let extent = |c: usize| {
        let at = mesh.nodes.iter().map(|node| node[c]);
        [
            at.clone().fold(f64::INFINITY, f64::min),
            at.fold(f64::NEG_INFINITY, f64::max),
        ]
    };
    let ([left, right], [low, high]) = (extent(0), extent(1));
    let sides = [
        ("left", 0, left),
        ("right", 0, right),
        ("bottom", 1, low),
        ("top", 1, high),
    ];
    for (name, c, at) in sides {
        mesh.name_line(name, |edge| {
            edge.iter().all(|node| (node[c] - at).abs() < 1e-9)
        });
    }
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
    /// Sides along waves.
    Curved,
    CurvedTriangles,
}

const SHAPES: [Shape; 4] = [
    Shape::Rectangles,
    Shape::Skewed,
    Shape::Triangles,
    Shape::Mixed,
];

fn triangles(mesh: &mut Mesh, is_cut: impl Fn(usize) -> bool) {
    let quads = std::mem::take(&mut mesh.solids);
    for (number, quad) in quads.into_iter().enumerate() {
        if !is_cut(number) {
            mesh.solids.push(quad);
            continue;
        }
        let [a, b, c, d, ab, bc, cd, da] = quad.nodes().try_into().unwrap();
        let middle = mesh.nodes.len();
        let ends = [a, c].map(|node| mesh.nodes[node]);
        mesh.nodes
            .push([0, 1].map(|i| f64::midpoint(ends[0][i], ends[1][i])));
        let halves = [[a, b, c, ab, bc, middle], [a, c, d, middle, cd, da]];
        mesh.solids
            .extend(halves.map(|nodes| Solid::triangle(nodes, quad.group)));
    }
}

fn held(line: &str, fixed: &[Axis]) -> Support {
    Support {
        line: line.to_owned(),
        fixed: fixed.to_vec(),
    }
}

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
    for (from, to, n) in [(2.5, 1.0, 1), (2.5, 0.5, 2), (2.0, 0.3, 1)] {
        let found = warnings(from, Some(to));
        let expected =
            format!("phase `pump` changes a water table that stands inside {n} elements");
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

/// Excavation over a column: heave γ h H/E_oed; put back without stress: the same down again.
#[test]
fn an_excavation_heaves_by_what_it_weighed() {
    for analysis in [Analysis::PlaneStrain, Analysis::Axisymmetric] {
        for shape in SHAPES {
            let mesh = grid(
                &[0.0, 0.5, 1.0],
                &[0.0, 2.0, 4.0, 5.0, 6.0],
                |_, row| usize::from(row > 1),
                shape,
            );
            let mut problem = Problem::new(analysis, mesh);
            let mut groups = vec![
                solid("below", elastic(analysis, E, NU)),
                solid("dug", elastic(analysis, E, NU)),
            ];
            for group in &mut groups {
                group.unit_weight = 20.0;
                group.initial_stress = Some(k_0(0.5));
            }
            problem.groups = groups;
            problem.mesh.name_line("floor", |edge| {
                edge.iter().all(|node| (node[1] - 4.0).abs() < 1e-9)
            });
            problem.supports = roller_box();
            let mut dig = Phase::new("dig", 2);
            dig.deactivate = vec![1];
            let mut fill = Phase::new("fill", 2);
            fill.activate = vec![1];
            problem.phases = vec![Phase::new("rest", 1), dig, fill];
            let mut simulation = Simulation::new(problem).unwrap();
            for _ in 0..3 {
                simulation.step().unwrap();
            }
            let heave = 20.0 * 2.0 * 4.0 / oedometric(E, NU);
            let up = simulation.displacement_of("floor").unwrap()[1];
            assert!(
                (up / heave - 1.0).abs() < 1e-9,
                "{analysis:?} {shape:?}: {up} {heave}"
            );
            simulation.run(&mut ()).unwrap();
            let back = simulation.displacement_of("floor").unwrap()[1];
            // Mean strains weighted with the radius are not quite those at the points.
            let has_mean = analysis == Analysis::Axisymmetric && shape != Shape::Rectangles;
            let least = if has_mean { 2e-4 } else { 1e-9 };
            assert!(
                back.abs() < least * heave,
                "{analysis:?} {shape:?}: {back} of {heave}"
            );
            let fill = &simulation.groups()[1];
            let lowest = (0..fill.kinematics.n_points()).map(|p| fill.global_stress(p).unwrap()[1]);
            assert!(lowest.fold(0.0, f64::min) < -30.0);
        }
    }
}

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
    for (name, y) in [("foot", 1.0), ("head", 2.0)] {
        mesh.name_line(name, |e| e.iter().all(|n| (n[1] - y).abs() < 1e-9));
    }
    let along = |line: &str, group| Along {
        line: line.to_owned(),
        group,
        opens_ends: true,
    };
    mesh.insert_joints(&[along("foot", 3), along("head", 4)])
        .unwrap();
    let mut problem = Problem::new(analysis, mesh);
    for name in ["lower", "middle", "upper"] {
        let mut group = solid(name, elastic(analysis, E, NU));
        group.unit_weight = 20.0;
        group.initial_stress = Some(k_0(0.0));
        problem.groups.push(group);
    }
    let values = [
        ("normal_stiffness", 1e5),
        ("shear_stiffness", 1e5),
        ("cohesion", 0.0),
        ("friction_angle", 30.0),
        ("dilatancy_angle", 0.0),
    ];
    for name in ["foot", "head"] {
        let law = material("coulomb_joint", Hypothesis::Interface2d, &values);
        problem
            .groups
            .push(ElementGroup::new(name, Formulation::ZeroThickness, law));
    }
    mesh_side(&mut problem);
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

/// Names the left side of the middle block.
fn mesh_side(problem: &mut Problem) {
    problem.mesh.name_line("side", |e| {
        e.iter()
            .all(|n| n[0].abs() < 1e-9 && (0.99..=2.01).contains(&n[1]))
    });
}

/// A pressure on the floor of a pit, and on ground upon which more will come.
#[test]
fn a_pressure_acts_on_a_surface_laid_bare() {
    for dug in [true, false] {
        let analysis = Analysis::PlaneStrain;
        let mut mesh = grid(&[0.0, 1.0], &[0.0, 2.0, 3.0], |_, j| j, Shape::Rectangles);
        mesh.name_line("floor", |e| e.iter().all(|n| (n[1] - 2.0).abs() < 1e-9));
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
        load.pressure = vec![Pressure {
            line: "floor".to_owned(),
            value: 50.0.into(),
        }];
        problem.phases = vec![dig, load];
        let simulation = run(problem);
        let reaction = simulation.reaction_of("bottom").unwrap()[1];
        assert!((reaction - 86.0).abs() < 1e-9, "{dug}: {reaction}");
    }
}

/// A stiffness that grows with depth: ∫ q/E_oed dz, element by element.
#[test]
fn a_stiffness_that_grows_with_depth_is_that_of_each_element() {
    for shape in SHAPES {
        let analysis = Analysis::PlaneStrain;
        let y: Vec<f64> = (0..=8).map(|i| f64::from(i) * 0.5).collect();
        let mesh = grid(&[0.0, 1.0], &y, |_, _| 0, shape);
        let mut problem = Problem::new(analysis, mesh);
        let mut ground = elastic(analysis, E, 0.0);
        let profile = Profile::new(vec![[0.0, 3e4], [4.0, 1e4]]).unwrap();
        ground.varying = vec![(
            "young_modulus".to_owned(),
            Variation::Height(profile.clone()),
        )];
        problem.groups = vec![solid("ground", ground)];
        problem.supports = roller_box();
        let mut load = Phase::new("load", 1);
        load.pressure = vec![Pressure {
            line: "top".to_owned(),
            value: 100.0.into(),
        }];
        problem.phases = vec![load];
        let top = -run(problem).displacement_of("top").unwrap()[1];
        let sum: f64 = y
            .windows(2)
            .map(|r| 50.0 / profile.at(f64::midpoint(r[0], r[1])))
            .sum();
        // Triangles of one row take their own centres' stiffness.
        let tolerance = if shape == Shape::Triangles || shape == Shape::Mixed {
            0.02
        } else {
            1e-9
        };
        assert!(
            (top / sum - 1.0).abs() < tolerance,
            "{shape:?}: {top} {sum}"
        );
    }
}

/// Blocks with an interface that is absent move as one; activated, nothing moves, and its traction is
/// the stress next to it. Without water no node is out of balance in the course of that phase.
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
        // The water between the faces comes in the course of the phase.
        let inside = inside.filter(|_| !is_wet);
        for (node, at) in inside {
            let left = largest(&state.reaction[2 * node..2 * node + 2]);
            assert!(left < 1e-9, "{shape:?}: {left} at {at:?}");
        }
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
