//! Ground as a problem: mesh, laws, phases.

use super::{
    BLOCK, Change, Ground, HEIGHT, LAYER, LOWER, PILE, SKIN, UPPER, WATER, WIDTH, is_rigid,
};
use law::{Hypothesis, SearchPath};
use mechanics::mesh::{Along, Solid};
use mechanics::problem::{
    Analysis, AtRest, Axis, Displacement, Drainage, ElementGroup, Force, Formulation,
    InitialStress, Phase, Pressure, Profile, Ratio, Support, Water,
};
use mechanics::{Material, Mesh, Problem};

/// Whether a node lies on a line.
type IsOn = Box<dyn Fn([f64; 2]) -> bool>;

/// How a problem is posed that is the same in nature: unit of stress, and whether in the mirror.
#[derive(Clone, Copy)]
pub(super) struct Posed {
    pub(super) unit: f64,
    pub(super) is_mirrored: bool,
}

fn material(id: &str, hypothesis: Hypothesis, values: &[(&str, f64)]) -> Material {
    let target = std::env::current_exe().unwrap();
    let deps = target.parent().unwrap().to_owned();
    let search = SearchPath::new(&[deps.clone(), deps.parent().unwrap().to_owned()]);
    let values: Vec<_> = values.iter().map(|&(id, v)| (id, v.into())).collect();
    let law = search.law(id).unwrap().with(hypothesis, &values).unwrap();
    Material::new(format!("{id} {}", values.len()), law)
}

impl Ground {
    fn mesh(&self, is_mirrored: bool) -> Mesh {
        let [block, beside, rows] = self.n;
        let part = |from: f64, to: f64, n: usize| {
            (0..n).map(move |i| from + (to - from) * i as f64 / n as f64)
        };
        let x = part(0.0, BLOCK, block).chain(part(BLOCK, WIDTH, beside));
        let x: Vec<f64> = x.chain([WIDTH]).collect();
        let y = part(0.0, LAYER, rows).chain(part(LAYER, HEIGHT, rows));
        let y: Vec<f64> = y.chain([HEIGHT]).collect();
        let group = |column: usize, row: usize| match (column < block, row < rows) {
            (_, true) => LOWER,
            (true, false) => PILE,
            (false, false) => UPPER,
        };
        let mut mesh = Mesh::grid(&x, &y, group);
        if self.is_skewed {
            for node in &mut mesh.nodes {
                let [x, y] = *node;
                // Neither the sides nor the block and the layers move.
                let by = (std::f64::consts::PI * x).sin() * (std::f64::consts::PI * y).sin();
                node[0] += 0.1 * by / self.n[1] as f64;
            }
            for number in 0..mesh.solids.len() {
                let edges: Vec<[usize; 3]> = mesh.solids[number].edges().collect();
                for [a, b, m] in edges {
                    mesh.nodes[m] =
                        [0, 1].map(|c| f64::midpoint(mesh.nodes[a][c], mesh.nodes[b][c]));
                }
            }
        }
        if is_mirrored {
            for node in &mut mesh.nodes {
                node[0] = -node[0];
            }
            for solid in &mut mesh.solids {
                let [a, b, c, d, ab, bc, cd, da] = solid.nodes().try_into().unwrap();
                *solid = Solid::quad([b, a, d, c, ab, da, cd, bc], solid.group);
            }
        }
        if self.are_triangles {
            let quads = std::mem::take(&mut mesh.solids);
            for quad in quads {
                let [a, b, c, d, ab, bc, cd, da] = quad.nodes().try_into().unwrap();
                let middle = mesh.nodes.len();
                let ends = [a, c].map(|node| mesh.nodes[node]);
                mesh.nodes
                    .push([0, 1].map(|i| f64::midpoint(ends[0][i], ends[1][i])));
                let halves = [[a, b, c, ab, bc, middle], [a, c, d, middle, cd, da]];
                let halves = halves.map(|nodes| Solid::triangle(nodes, quad.group));
                mesh.solids.extend(halves);
            }
        }
        let is = |a: f64, b: f64| (a - b).abs() < 1e-9;
        let inside = |x: f64| x < BLOCK + 1e-9;
        let outside = |x: f64| x > BLOCK - 1e-9;
        let above = |y: f64| y > LAYER - 1e-9;
        let lines: [(&str, IsOn); 7] = [
            ("near", Box::new(move |[x, _]| is(x, 0.0))),
            ("far", Box::new(move |[x, _]| is(x, WIDTH))),
            ("bottom", Box::new(move |[_, y]| is(y, 0.0))),
            (
                "surface",
                Box::new(move |[x, y]| is(y, HEIGHT) && outside(x)),
            ),
            ("head", Box::new(move |[x, y]| is(y, HEIGHT) && inside(x))),
            ("shaft", Box::new(move |[x, y]| is(x, BLOCK) && above(y))),
            ("base", Box::new(move |[x, y]| is(y, LAYER) && inside(x))),
        ];
        for (name, is_on) in lines {
            mesh.name_line(name, |edge| edge.iter().all(|&[x, y]| is_on([x.abs(), y])));
        }
        if self.has_skin {
            let along = ["shaft", "base"].map(|line| Along {
                line: line.to_owned(),
                group: SKIN,
                opens_ends: true,
            });
            mesh.insert_joints(&along).unwrap();
            // Lines have the nodes of their own sides.
            let mut lines = std::mem::take(&mut mesh.lines);
            for line in lines.values_mut() {
                let nodes = line.edges.iter().flat_map(|&edge| mesh.edge(edge));
                line.nodes = nodes.collect();
                line.nodes.sort_unstable();
                line.nodes.dedup();
            }
            mesh.lines = lines;
        }
        mesh
    }

    fn laws(&self, unit: f64) -> [Material; 4] {
        let hypothesis = match self.analysis() {
            Analysis::Axisymmetric => Hypothesis::Axisymmetric,
            Analysis::PlaneStrain => Hypothesis::PlaneStrain,
        };
        let elastic = |young: f64| [("young_modulus", young * unit), ("poisson_ratio", 0.3)];
        let ground = |young: f64| {
            if self.is_plastic {
                let strength = [
                    ("cohesion", 8.0 * unit),
                    ("friction_angle", 32.0),
                    ("dilatancy_angle", 4.0),
                ];
                let values: Vec<_> = elastic(young).into_iter().chain(strength).collect();
                material("mohr_coulomb", hypothesis, &values)
            } else {
                material("elastic", hypothesis, &elastic(young))
            }
        };
        let skin = [
            ("normal_stiffness", 1e6 * unit),
            ("shear_stiffness", 4e5 * unit),
            ("cohesion", 3.0 * unit),
            ("friction_angle", 25.0),
            ("dilatancy_angle", 0.0),
        ];
        let mut concrete = material("elastic", hypothesis, &elastic(3e6));
        "concrete".clone_into(&mut concrete.name);
        [
            ground(2e4),
            ground(1e4),
            concrete,
            material("coulomb_joint", Hypothesis::Interface2d, &skin),
        ]
    }

    pub(super) fn problem(&self, posed: Posed) -> Problem {
        let Posed { unit, is_mirrored } = posed;
        let mut problem = Problem::new(self.analysis(), self.mesh(is_mirrored));
        let [lower, upper, concrete, skin] = self.laws(unit);
        let group = |name: &str, material: &Material, layer: usize| {
            let mut group = ElementGroup::new(name, Formulation::Solid, material.clone());
            let [dry, wet] = self.weights[layer];
            (group.unit_weight, group.saturated_unit_weight) = (unit * dry, Some(unit * wet));
            group.initial_stress = Some(at_rest(self.at_rest[layer]));
            group.integration = self.integration;
            group
        };
        problem.groups = vec![
            group("lower", &lower, 0),
            group("upper", &upper, 1),
            group("pile", &upper, 1),
        ];
        if self.has_skin {
            let mut group = ElementGroup::new("skin", Formulation::ZeroThickness, skin);
            group.is_active = false;
            problem.groups.push(group);
        }
        problem.water = self.water.map(|part| Water {
            level: (part * HEIGHT).into(),
            unit_weight: unit * WATER,
        });
        problem.supports = [
            ("near", vec![Axis::X]),
            ("far", vec![Axis::X]),
            ("bottom", vec![Axis::X, Axis::Y]),
        ]
        .map(|(line, fixed)| Support {
            line: line.to_owned(),
            fixed,
        })
        .to_vec();
        problem.settings.tolerated_residual = 0.0;
        problem.phases = vec![Phase::new("rest", 1)];
        for number in 0..self.changes.len() {
            problem.phases.push(self.phase(number, unit, &concrete));
        }
        problem
    }

    /// The phase of a change.
    fn phase(&self, number: usize, unit: f64, concrete: &Material) -> Phase {
        let line = |name: &str| name.to_owned();
        let (change, increments) = self.changes[number];
        let mut phase = Phase::new(format!("p{number}"), increments);
        match change {
            Change::Pressure(value) => {
                phase.pressure = vec![Pressure {
                    line: line("surface"),
                    value: (unit * value).into(),
                }];
            }
            Change::Force(value) => {
                phase.rigid = vec![line("head")];
                phase.force = vec![Force {
                    line: line("head"),
                    x: None,
                    y: Some(-unit * value),
                }];
            }
            Change::Push(value) => {
                if is_rigid(increments) {
                    phase.rigid = vec![line("head")];
                }
                phase.displacement = vec![Displacement {
                    line: line("head"),
                    x: None,
                    y: Some(-value),
                }];
            }
            Change::Water(part) => phase.water_level = Some((part * HEIGHT).into()),
            Change::Dig => {
                phase.deactivate = vec![UPPER, PILE];
                let comes = |(change, _): &(Change, usize)| *change == Change::Skin;
                let dug = |(change, _): &(Change, usize)| *change == Change::Dig;
                let earlier = &self.changes[..number];
                // The interface went with the ground that was dug away first.
                if earlier.iter().any(comes) && !earlier.iter().skip_while(|c| !comes(c)).any(dug) {
                    phase.deactivate.push(SKIN);
                }
            }
            Change::Fill => phase.activate = vec![UPPER, PILE],
            Change::Swap => {
                phase.materials = vec![(PILE, concrete.clone())];
                phase.unit_weight = vec![(PILE, unit * 24.0)];
            }
            Change::Skin => phase.activate = vec![SKIN],
            Change::Drain(drains) => {
                let drainage = if drains {
                    Drainage::Drained
                } else {
                    Drainage::Undrained
                };
                phase.drainage = vec![(LOWER, drainage)];
            }
        }
        phase
    }
}

/// A way for ground to be at rest.
fn at_rest(way: usize) -> InitialStress {
    let constant = |value: f64| Profile::from(value);
    let ratio = match way {
        0 => Ratio::K0(constant(0.5)),
        1 => Ratio::K0(constant(0.8)),
        2 => Ratio::Overconsolidated {
            friction_angle: constant(30.0),
            ocr: constant(1.0),
            pop: constant(0.0),
            poisson_ratio: 0.2,
        },
        _ => Ratio::Overconsolidated {
            friction_angle: constant(30.0),
            ocr: constant(1.6),
            pop: constant(0.0),
            poisson_ratio: 0.2,
        },
    };
    InitialStress::AtRest(AtRest {
        ratio,
        surcharge: None,
    })
}
