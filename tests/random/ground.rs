//! Ground posed in memory: layers at rest under water or above it, loaded, dug away and filled again, with
//! an interface or without. At rest nothing moves; whatever happens then, reactions carry what is on
//! them; in another unit of stress, and in the mirror, the same happens.

use crate::seeds::{End, hold};
use law::{Hypothesis, SearchPath};
use mechanics::check::Cause;
use mechanics::mesh::{Along, Solid};
use mechanics::problem::{
    Analysis, AtRest, Axis, Displacement, Drainage, ElementGroup, Force, Formulation,
    InitialStress, Integration, Phase, Pressure, Profile, Ratio, Support, Water,
};
use mechanics::{Error, Material, Mesh, Problem, Simulation};
use proptest::prelude::*;

/// Height of the ground, m; it has two layers, in the upper one stands a block.
const HEIGHT: f64 = 4.0;
const LAYER: f64 = 2.0;
const BLOCK: f64 = 1.0;
const WIDTH: f64 = 4.0;
const WATER: f64 = 9.81;
/// Groups.
const LOWER: usize = 0;
const UPPER: usize = 1;
const PILE: usize = 2;
const SKIN: usize = 3;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Change {
    /// kPa on the surface next to the block.
    Pressure(f64),
    /// kN on the block's head, which is rigid from then on.
    Force(f64),
    /// m of the block's head, which is rigid from then on if there are several increments.
    Push(f64),
    /// The water table, parts of the height.
    Water(f64),
    /// All above the lower layer goes, with the interface; or comes back.
    Dig,
    Fill,
    /// The block becomes another material, and heavier.
    Swap,
    /// The interface comes.
    Skin,
    /// The lower layer drains, or does not.
    Drain(bool),
}

#[expect(clippy::struct_excessive_bools, reason = "each is drawn by itself")]
#[derive(Clone, Debug)]
struct Ground {
    is_axisymmetric: bool,
    are_triangles: bool,
    is_skewed: bool,
    /// Columns of the block and next to it, rows of each layer.
    n: [usize; 3],
    integration: Option<Integration>,
    is_plastic: bool,
    /// Unit weights of the layers above and below the water.
    weights: [[f64; 2]; 2],
    at_rest: [usize; 2],
    /// Water table, parts of the height.
    water: Option<f64>,
    has_skin: bool,
    changes: Vec<(Change, usize)>,
}

/// Whether a node lies on a line.
type IsOn = Box<dyn Fn([f64; 2]) -> bool>;

/// How a problem is posed that is the same in nature: unit of stress, and whether in the mirror.
#[derive(Clone, Copy)]
struct Posed {
    unit: f64,
    is_mirrored: bool,
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
    fn analysis(&self) -> Analysis {
        if self.is_axisymmetric {
            Analysis::Axisymmetric
        } else {
            Analysis::PlaneStrain
        }
    }

    /// Area of a piece of a level, m² (plane strain: by 1 m).
    fn area(&self, from: f64, to: f64) -> f64 {
        if self.is_axisymmetric {
            std::f64::consts::PI * (to * to - from * from)
        } else {
            to - from
        }
    }

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
        let lines: [(&str, IsOn); 7] = [
            ("near", Box::new(move |[x, _]| is(x, 0.0))),
            ("far", Box::new(move |[x, _]| is(x, WIDTH))),
            ("bottom", Box::new(move |[_, y]| is(y, 0.0))),
            (
                "surface",
                Box::new(move |[x, y]| is(y, HEIGHT) && x > BLOCK - 1e-9),
            ),
            (
                "head",
                Box::new(move |[x, y]| is(y, HEIGHT) && x < BLOCK + 1e-9),
            ),
            (
                "shaft",
                Box::new(move |[x, y]| is(x, BLOCK) && y > LAYER - 1e-9),
            ),
            (
                "base",
                Box::new(move |[x, y]| is(y, LAYER) && x < BLOCK + 1e-9),
            ),
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

    #[expect(clippy::too_many_lines, reason = "one list, change by change")]
    fn problem(&self, posed: Posed) -> Problem {
        let Posed { unit, is_mirrored } = posed;
        let mut problem = Problem::new(self.analysis(), self.mesh(is_mirrored));
        let [lower, upper, concrete, skin] = self.laws(unit);
        let at_rest = |way: usize| {
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
        };
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
        let line = |name: &str| name.to_owned();
        for (number, &(change, increments)) in self.changes.iter().enumerate() {
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
                    if earlier.iter().any(comes)
                        && !earlier.iter().skip_while(|c| !comes(c)).any(dug)
                    {
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
            problem.phases.push(phase);
        }
        problem
    }

    /// Load on the bottom at the end of a phase, kN; the first is that of rest. For the pushed head
    /// see the reactions.
    fn on_bottom(&self, phase: usize) -> f64 {
        let (mut pressure, mut force, mut level) = (0.0, 0.0, self.water);
        let (mut is_there, mut pile) = (true, self.weights[1]);
        for (change, _) in &self.changes[..phase] {
            match *change {
                Change::Pressure(value) => pressure = value,
                Change::Force(value) => force = value,
                Change::Water(part) => level = Some(part),
                Change::Dig => is_there = false,
                Change::Fill => is_there = true,
                Change::Swap => pile = [24.0; 2],
                _ => {}
            }
        }
        let table = level.map_or(0.0, |part| part * HEIGHT);
        let weight = |[dry, wet]: [f64; 2], from: f64, to: f64| {
            let under = table.clamp(from, to);
            wet * (under - from) + dry * (to - under)
        };
        let (block, beside) = (self.area(0.0, BLOCK), self.area(BLOCK, WIDTH));
        let top = if is_there { HEIGHT } else { LAYER };
        let lower = weight(self.weights[0], 0.0, LAYER) + WATER * (table - top).max(0.0);
        let mut sum = lower * (block + beside);
        if is_there {
            sum += weight(self.weights[1], LAYER, HEIGHT) * beside;
            sum += weight(pile, LAYER, HEIGHT) * block;
        }
        sum + pressure * beside + force
    }

    /// Whether a water table stands inside elements that are no rectangles, where K_0 σ'_v bends.
    fn bends(&self) -> bool {
        let height = LAYER / self.n[2] as f64;
        let inside = self.water.is_some_and(|part| {
            let rows = part * HEIGHT / height;
            part < 1.0 && (rows - rows.round()).abs() > 1e-9
        });
        inside && (self.is_skewed || self.are_triangles)
    }

    fn check(&self) -> Result<End, String> {
        let plain = Posed {
            unit: 1.0,
            is_mirrored: false,
        };
        let Ok(own) = self.run(plain)? else {
            return Ok(End::Stopped);
        };
        let mut others = vec![Posed {
            unit: 1e-3,
            ..plain
        }];
        // Triangles of the mirror lie along the other diagonal.
        if !self.is_axisymmetric && !self.are_triangles {
            others.push(Posed {
                is_mirrored: true,
                ..plain
            });
        }
        for other in others {
            let found = match self.run(other)? {
                Ok(heads) => heads,
                // What comes to a standstill close to collapse may not in other bits.
                Err(_) if self.is_plastic => continue,
                Err(why) => return Err(format!("in other units or the mirror: {why}")),
            };
            let largest = own.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
            let most = if self.is_plastic { 2e-2 } else { 1e-6 };
            for (a, b) in own.iter().zip(&found) {
                if (a - b).abs() > most * largest + 1e-12 {
                    return Err(format!(
                        "unit {}, mirrored {}: {a:e} becomes {b:e}",
                        other.unit, other.is_mirrored
                    ));
                }
            }
        }
        Ok(End::Done)
    }

    /// Settlements of the head after each phase; or why none exist.
    fn run(&self, posed: Posed) -> Result<Result<Vec<f64>, String>, String> {
        let fails = |error: Error| match &error {
            // Weight tilts a head before it is rigid: that is no reason not to push it.
            Error::Refused(refusal) if matches!(refusal.cause, Cause::MovesAlike(..)) => {
                Err(error.to_string())
            }
            Error::NoEquilibrium(_) | Error::Refused(_) => Ok(Err(error.to_string())),
            _ => Err(format!("{error:?}")),
        };
        let mut simulation = match Simulation::new(self.problem(posed)) {
            Ok(simulation) => simulation,
            Err(error) => return fails(error),
        };
        let mut settlements = Vec::new();
        loop {
            let increment = match simulation.step() {
                Ok(Some(increment)) => increment,
                Ok(None) => return Ok(Ok(settlements)),
                Err(error) => return fails(error),
            };
            let place = format!("{}", increment.place);
            let state = simulation.snapshot();
            let most = state
                .displacement
                .iter()
                .fold(0.0, |m: f64, u| m.max(u.abs()));
            if !most.is_finite() || most > 10.0 * HEIGHT {
                return Err(format!("{place}: {most:e} m"));
            }
            let is_rest = increment.place.phase == "rest";
            // Some millimetres are what the weight would cause.
            if is_rest && !self.bends() && most > 1e-11 {
                return Err(format!("at rest, and moves by {most:e} m"));
            }
            if increment.place.increment < increment.of {
                continue;
            }
            let vertical: f64 = state.reaction.iter().skip(1).step_by(2).sum();
            let carried = posed.unit * self.on_bottom(settlements.len());
            let scale: f64 = state.reaction.iter().map(|force| force.abs()).sum();
            if (vertical - carried).abs() > 1e-5 * scale.max(carried.abs()) {
                return Err(format!("{place}: reactions {vertical:e} carry {carried:e}"));
            }
            let head = simulation.displacement_of("head").map_or(0.0, |u| u[1]);
            let change = settlements.len().checked_sub(1).map(|n| self.changes[n]);
            if let Some((Change::Push(value), n)) = change
                && is_rigid(n)
            {
                let nodes = &simulation.problem().mesh.lines["head"].nodes;
                let is_off = |node: &&usize| {
                    state.displacement[2 * **node + 1].to_bits() != (-value).to_bits()
                };
                if let Some(node) = nodes.iter().find(is_off) {
                    let at = state.displacement[2 * node + 1];
                    return Err(format!(
                        "{place}: the head is pushed by {value:e}, a node is at {at:e}"
                    ));
                }
            }
            settlements.push(head);
        }
    }
}

/// Whether a head that is pushed in this many increments is rigid.
fn is_rigid(increments: usize) -> bool {
    increments > 1
}

/// The changes that can be made in this order: what carries a load is not dug away.
fn possible(
    changes: Vec<(Change, usize)>,
    has_water: bool,
    has_skin: bool,
) -> Vec<(Change, usize)> {
    let (mut is_there, mut is_loaded, mut comes) = (true, false, has_skin);
    let is_possible = |(change, _): &(Change, usize)| {
        let possible = match change {
            Change::Pressure(_) | Change::Force(_) | Change::Push(_) => is_there,
            Change::Water(_) => has_water,
            Change::Dig => is_there && !is_loaded,
            Change::Fill => !is_there,
            Change::Skin => is_there && comes,
            Change::Swap | Change::Drain(_) => true,
        };
        if possible {
            match change {
                Change::Pressure(_) | Change::Force(_) | Change::Push(_) => is_loaded = true,
                Change::Dig => is_there = false,
                Change::Fill => is_there = true,
                Change::Skin => comes = false,
                _ => {}
            }
        }
        possible
    };
    changes.into_iter().filter(is_possible).collect()
}

fn ground() -> impl Strategy<Value = Ground> {
    let change = prop_oneof![
        2 => (5.0..120.0_f64).prop_map(Change::Pressure),
        2 => (10.0..300.0_f64).prop_map(Change::Force),
        2 => (1e-4..2e-2_f64).prop_map(Change::Push),
        2 => prop::sample::select(vec![0.1, 0.5, 0.65, 1.0, 1.4]).prop_map(Change::Water),
        1 => Just(Change::Dig),
        1 => Just(Change::Fill),
        2 => Just(Change::Swap),
        2 => Just(Change::Skin),
        2 => any::<bool>().prop_map(Change::Drain),
    ];
    let weight = prop::sample::select(vec![[18.0, 20.0], [16.0, 16.0], [17.0, 21.0]]);
    let integration = prop::sample::select(vec![
        None,
        None,
        Some(Integration::Full),
        Some(Integration::BBar),
    ]);
    (
        prop::array::uniform5(any::<bool>()),
        (1..3_usize, 1..4_usize, 1..4_usize),
        integration,
        prop::array::uniform2(weight),
        prop::array::uniform2(0..4_usize),
        prop::option::of(prop::sample::select(vec![
            0.25, 0.37, 0.5, 0.6, 0.75, 0.9, 1.0, 1.5,
        ])),
        prop::collection::vec((change, 1..4_usize), 0..4),
    )
        .prop_map(
            |(flags, n, integration, weights, at_rest, water, changes)| {
                let [
                    is_axisymmetric,
                    are_triangles,
                    is_skewed,
                    is_plastic,
                    has_skin,
                ] = flags;
                let changes = possible(changes, water.is_some(), has_skin);
                Ground {
                    is_axisymmetric,
                    are_triangles,
                    is_skewed,
                    n: [n.0, n.1, n.2],
                    integration,
                    is_plastic,
                    weights,
                    at_rest,
                    water,
                    has_skin,
                    changes,
                }
            },
        )
}

#[test]
fn ground_stays_at_rest_and_balances_what_is_done_to_it() {
    hold(
        "ground",
        (200_001, 120),
        &ground(),
        |ground| format!("{ground:#?}"),
        Ground::check,
    );
}
