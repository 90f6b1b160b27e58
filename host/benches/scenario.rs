//! Laws, parameters, and integration points on which the benches call them.
//!
//! Every point has its own strain or jump increment, drawn at random, and a start that the law
//! itself reached. The steps of `mohr_coulomb` and the elastic steps are those that
//! `peers/mfront.c` gives to MFront's laws, from the same random numbers.

use abi::Hypothesis;
use law::{End, Law, Moment, Operator, SearchPath, Start, Strided};
use std::hint::black_box;

/// Soil of the comparison: E, ν, c in kPa, φ, ψ in degrees.
const SOIL: &[(&str, f64)] = &[
    ("young_modulus", 34e3),
    ("poisson_ratio", 0.3),
    ("cohesion", 1.0),
    ("friction_angle", 36.5),
    ("dilatancy_angle", 12.0),
];
/// Interface of De Gennaro & Frank, Table IV.
const TABLE_4: &[(&str, f64)] = &[
    ("k_n", 0.86e5),
    ("k_t", 0.37e5),
    ("n", 0.55),
    ("mu_0", 0.27),
    ("mu_p", 0.7),
    ("mu_c0", 0.46),
    ("a", 0.008),
    ("c_0", 40.0),
    ("t", 2e-3),
    ("p_0", 100.0),
];
/// Loose Fontainebleau sand, De Gennaro & Frank, Table I.
const FONTAINEBLEAU: &[(&str, f64)] = &[
    ("k_n", 0.86e5),
    ("k_t", 0.37e5),
    ("n", 0.55),
    ("mu_0", 0.0),
    ("mu_p", 0.78),
    ("mu_c0", 0.67),
    ("a", 0.000_45),
    ("c_0", 0.05),
    ("t", 2e-3),
    ("mu_r", 0.7),
    ("a_0", 4.0),
    ("u_tp", 1.4e-3),
];
/// Joint of the paper's Table IV.
const JOINT: &[(&str, f64)] = &[
    ("normal_stiffness", 1e6),
    ("shear_stiffness", 4e5),
    ("cohesion", 0.0),
    ("friction_angle", 35.0),
    ("dilatancy_angle", 5.0),
];

/// A medium dense sand.
const HARDENING: &[(&str, f64)] = &[
    ("e_50_ref", 34e3),
    ("cohesion", 1.0),
    ("friction_angle", 36.5),
    ("dilatancy_angle", 6.0),
];

/// What the first internal variable, an accumulated plastic strain or slip, must do in the step.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Flow {
    Elastic,
    Plastic,
}

/// The gradient reached before a step, and its increment in the step.
type Drawn = ([f64; 6], [f64; 6]);

/// A law and what is done to its points. Gradients have up to six components.
struct Recipe<'a> {
    law: &'a str,
    hypothesis: Hypothesis,
    parameters: &'static [(&'static str, f64)],
    /// Flux of every point before anything has happened, kPa.
    flux: [f64; 6],
    /// For a number of components.
    draw: fn(&mut Random, usize) -> Drawn,
    flow: Flow,
}

const ISOTROPIC: [f64; 6] = [-100.0, -100.0, -100.0, 0.0, 0.0, 0.0];
const PRESSED: [f64; 6] = [-100.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// Names of the scenarios, law first.
pub(crate) const NAMES: &[&str] = &[
    "elastic",
    "elastic_3d",
    "mohr_coulomb/elastic",
    "mohr_coulomb/large",
    "mohr_coulomb/restart",
    "mohr_coulomb/edge",
    "mohr_coulomb_3d/elastic",
    "mohr_coulomb_3d/restart",
    "hardening_soil/both",
    "hardening_soil_3d/both",
    "oriented_mohr_coulomb/elastic",
    "oriented_mohr_coulomb/plastic",
    "coulomb_joint/elastic",
    "coulomb_joint/plastic",
    "mepi/elastic",
    "mepi/plastic",
    "mepi_softening/plastic",
];

fn recipe(name: &str) -> Recipe<'_> {
    use Flow::{Elastic, Plastic};
    let (id, step) = name.split_once('/').unwrap_or((name, "elastic"));
    let (law, spatial) = id
        .strip_suffix("_3d")
        .map_or((id, false), |law| (law, true));
    let flow = if step == "elastic" { Elastic } else { Plastic };
    let interface = match law {
        "coulomb_joint" => Some(JOINT),
        "mepi" => Some(TABLE_4),
        "mepi_softening" => Some(FONTAINEBLEAU),
        _ => None,
    };
    Recipe {
        law,
        hypothesis: match (interface, spatial) {
            (Some(_), _) => Hypothesis::Interface2d,
            (None, false) => Hypothesis::Axisymmetric,
            (None, true) => Hypothesis::ThreeD,
        },
        parameters: interface.unwrap_or(match law {
            "elastic" => &SOIL[..2],
            "hardening_soil" => HARDENING,
            _ => SOIL,
        }),
        flux: if interface.is_some() {
            PRESSED
        } else {
            ISOTROPIC
        },
        draw: match (interface, flow, step) {
            (Some(_), Elastic, _) => stuck,
            (Some(_), Plastic, _) => slipping,
            (None, Elastic, _) => small_strain,
            (None, Plastic, "large") => large_strain,
            (None, Plastic, "edge") => edge,
            (None, Plastic, "both") => pressed,
            (None, Plastic, _) => restart,
        },
        flow,
    }
}

/// Uniform numbers in [0, 1) by Marsaglia's xorshift (13, 7, 17), as in `peers/mfront.c`.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in [−1/2, 1/2).
    fn centred(&mut self) -> f64 {
        self.unit() - 0.5
    }

    fn components(&mut self, n: usize) -> [f64; 6] {
        std::array::from_fn(|c| if c < n { self.centred() } else { 0.0 })
    }
}

/// Each component within 1e-4, from rest.
fn small_strain(random: &mut Random, n: usize) -> Drawn {
    ([0.0; 6], random.components(n).map(|e| 2e-4 * e))
}

/// A direction with little change of volume.
fn mostly_shear(random: &mut Random, n: usize) -> [f64; 6] {
    let mut e = random.components(n);
    let mean = (e[0] + e[1] + e[2]) / 3.0;
    for e in &mut e[..3] {
        *e -= 0.9 * mean;
    }
    scaled(e, 1.0)
}

/// 0.25 % to 0.75 % in one step from rest.
fn large_strain(random: &mut Random, n: usize) -> Drawn {
    let direction = mostly_shear(random, n);
    let size = 5e-3 * (0.5 + random.unit());
    ([0.0; 6], scaled(direction, size))
}

/// 0.5 % to the surface, then 1e-4 further in the same direction.
fn restart(random: &mut Random, n: usize) -> Drawn {
    let direction = mostly_shear(random, n);
    (scaled(direction, 5e-3), scaled(direction, 1e-4))
}

/// 0.2 % of shear with compression, then 1e-4 further in the same direction: a shear surface and a cap harden.
fn pressed(random: &mut Random, n: usize) -> Drawn {
    let mut direction = mostly_shear(random, n);
    for e in &mut direction[..3] {
        *e -= 0.2;
    }
    (scaled(direction, 2e-3), scaled(direction, 1e-4))
}

/// 1.5 % of triaxial compression along 22, then 1e-4 further.
fn edge(random: &mut Random, n: usize) -> Drawn {
    let mut direction = random.components(n).map(|e| 1e-6 * e);
    for (c, e) in [0.35, -1.0, 0.35].into_iter().enumerate() {
        direction[c] += e;
    }
    (scaled(direction, 1.5e-2), scaled(direction, 1e-4))
}

/// Within the first elastic range.
fn stuck(random: &mut Random, _: usize) -> Drawn {
    let mut jump = [0.0; 6];
    (jump[0], jump[1]) = (1e-7 * random.centred(), 1e-7 * random.centred());
    ([0.0; 6], jump)
}

/// Up to 3 mm of slip, then 20 µm further while the faces move by up to 2 µm.
fn slipping(random: &mut Random, _: usize) -> Drawn {
    let (mut before, mut step) = ([0.0; 6], [0.0; 6]);
    before[1] = 3e-3 * random.unit() + 1e-4;
    (step[0], step[1]) = (4e-6 * random.centred(), 2e-5);
    (before, step)
}

fn scaled(mut e: [f64; 6], size: f64) -> [f64; 6] {
    let norm = e.iter().map(|e| e * e).sum::<f64>().sqrt();
    for e in &mut e {
        *e *= size / norm;
    }
    e
}

/// Integration points at the start of a step, and room for its end.
struct Points {
    n_components: usize,
    n_states: usize,
    gradient: Vec<f64>,
    gradient_end: Vec<f64>,
    flux: Vec<f64>,
    state: Vec<f64>,
    flux_end: Vec<f64>,
    state_end: Vec<f64>,
    operators: Vec<f64>,
}

impl Points {
    /// Points that stand as the given one.
    fn all_alike(flux: &[f64], state: &[f64], n_points: usize) -> Self {
        let n = flux.len();
        Self {
            n_components: n,
            n_states: state.len(),
            gradient: vec![0.0; n * n_points],
            gradient_end: vec![0.0; n * n_points],
            flux: flux.repeat(n_points),
            state: state.repeat(n_points),
            flux_end: vec![0.0; n * n_points],
            state_end: vec![0.0; state.len() * n_points],
            operators: vec![0.0; n * n * n_points],
        }
    }

    fn len(&self) -> usize {
        self.gradient.len() / self.n_components
    }

    /// Calls the law on a batch.
    #[inline]
    fn integrate(&mut self, law: &Law, first: usize, n_points: usize, operator: Operator) {
        let (n, s) = (self.n_components, self.n_states);
        let (components, states) = (
            first * n..(first + n_points) * n,
            first * s..(first + n_points) * s,
        );
        let rows = Strided::rows(n);
        let start = Start {
            n_points,
            gradient: (&self.gradient[components.clone()], rows),
            gradient_end: (&self.gradient_end[components.clone()], rows),
            flux: (&self.flux[components.clone()], rows),
            state: &self.state[states.clone()],
            time: 0.0,
            time_increment: 1.0,
            moment: Moment::default(),
            sites: &[],
        };
        let end = End {
            flux: (&mut self.flux_end[components], rows),
            state: &mut self.state_end[states],
            operator: &mut self.operators[first * n * n..(first + n_points) * n * n],
        };
        let done = law.integrate(&start, operator, end);
        assert!(done.is_ok(), "{done:?}");
    }

    /// What was the end becomes the start.
    fn commit(&mut self) {
        self.gradient.clone_from(&self.gradient_end);
        self.flux.clone_from(&self.flux_end);
        self.state.clone_from(&self.state_end);
    }
}

/// A law and the points it is called on.
pub(crate) struct Scenario {
    law: Law,
    points: Points,
}

impl Scenario {
    /// Builds the law and brings `n_points` points to the start of their step.
    pub(crate) fn new(name: &str, n_points: usize) -> Self {
        let recipe = recipe(name);
        let loaded = SearchPath::new(&[])
            .law(recipe.law)
            .expect("the laws are built: `cargo build --release`");
        let parameters: Vec<f64> = loaded
            .description()
            .parameters
            .iter()
            .map(|p| {
                let given = recipe.parameters.iter().find(|(id, _)| *id == p.id);
                given.map_or(p.default.unwrap_or(f64::NAN), |(_, value)| *value)
            })
            .collect();
        let law = loaded.build(recipe.hypothesis, &parameters).expect(name);
        let n = law.n_components();
        let initial = law
            .initial_state(1, (&recipe.flux[..n], Strided::rows(n)))
            .expect("the start is compressed");
        let mut points = Points::all_alike(&recipe.flux[..n], &initial, n_points);
        let mut random = Random(88_172_645_463_325_252);
        for i in 0..n_points {
            while !reach(&law, &recipe, &mut random, &mut points, i) {}
        }
        Self { law, points }
    }

    /// Carries every point over its step, in batches of this size (the last one may be shorter).
    pub(crate) fn step(&mut self, batch: usize, operator: Operator) {
        let n_points = self.points.len();
        for first in (0..n_points).step_by(batch) {
            let size = batch.min(n_points - first);
            black_box(&mut self.points).integrate(&self.law, first, size, operator);
        }
    }

    /// Copies all values that such a step reads or writes, batch by batch: the floor under it.
    pub(crate) fn copy(&mut self, batch: usize, operator: Operator, copies: &mut Vec<f64>) {
        let p = &mut self.points;
        let (n, s) = (p.n_components, p.n_states);
        let n_operator = if operator == Operator::None { 0 } else { n * n };
        copies.resize(p.operators.len().max(p.gradient.len()), 0.0);
        for first in (0..p.len()).step_by(batch) {
            let size = batch.min(p.len() - first);
            for (values, width) in [
                (&p.gradient, n),
                (&p.gradient_end, n),
                (&p.flux, n),
                (&p.state, s),
                (&p.flux_end, n),
                (&p.state_end, s),
                (&p.operators, n_operator),
            ] {
                let range = first * width..(first + size) * width;
                copies[range.clone()].copy_from_slice(black_box(&values[range]));
            }
            black_box(&mut *copies);
        }
    }
}

/// Draws the step of point `i` and brings the point to its start. Whether the step then does what
/// the recipe asks for.
fn reach(
    law: &Law,
    recipe: &Recipe<'_>,
    random: &mut Random,
    points: &mut Points,
    i: usize,
) -> bool {
    let (n, s) = (points.n_components, points.n_states);
    let (before, step) = (recipe.draw)(random, n);
    let initial = law.initial_state(1, (&recipe.flux[..n], Strided::rows(n)));
    let mut point = Points::all_alike(&recipe.flux[..n], &initial.unwrap_or_default(), 1);
    point.gradient_end.copy_from_slice(&before[..n]);
    point.integrate(law, 0, 1, Operator::None);
    point.commit();
    for c in 0..n {
        point.gradient_end[c] = before[c] + step[c];
    }
    point.integrate(law, 0, 1, Operator::None);
    // Of hardening soil both the cap and the shear surface, which the first two variables are of.
    let surfaces = if recipe.law == "hardening_soil" { 2 } else { 1 };
    let flows = s > 0 && (0..surfaces).all(|i| point.state_end[i] > point.state[i]);
    points.gradient[i * n..(i + 1) * n].copy_from_slice(&point.gradient);
    points.gradient_end[i * n..(i + 1) * n].copy_from_slice(&point.gradient_end);
    points.flux[i * n..(i + 1) * n].copy_from_slice(&point.flux);
    points.state[i * s..(i + 1) * s].copy_from_slice(&point.state);
    flows == (recipe.flow == Flow::Plastic)
}
