//! Bonds that break at the first tension.
//!
//! Goal        an equilibrium that one increment cannot reach: taken as bonded a point opens, taken as broken it
//!             closes.
//! Geometry    a stiff block of height h on a bonded joint of length 1. Its points at both ends and in the middle
//!             weigh 1/6, 1/6 and 2/3 of the joint (Simpson).
//!
//! ```text
//!      p ↓ ↓ ↓ ↓
//!     ┌─────────┐ → u
//!     │ block   │ height h
//!   A ╞════B════╡ C   joint
//!     │ base    │ fixed
//!     └─────────┘
//! ```
//!
//! Boundary    a pressure p first, which stays; then u along the top.
//! Law         `coulomb_joint` with cohesion and without tensile strength.
//! Asserts     statics of a rigid block on two points, once A has opened. With the shear force H the normal forces
//!             are C = 2 h H and B = p − C, their tractions 6 C and 3/2 B. A carries nothing, so the others carry
//!             6/5 H in shear and stay below their strength: they are elastic, however A broke. Then u = 2 h (6 C −
//!             3/2 B) / `k_n` + 6/5 H / `k_t`.

use crate::setup::{Failed, Results, assert_close, elastic, fail, run};
use tests::case::run_text;
use tests::words::has;

const K_N: f64 = 1e6;
const K_T: f64 = 773_530.0;
const PRESSURE: f64 = 100.0;
const HEIGHT: f64 = 0.5;
const U: f64 = 2.5e-4;
/// What the blocks (1e11 kPa) yield.
const RIGID: f64 = 1e-4;

/// A block pushed in this many increments, with this cohesion; `more` goes before the laws.
fn pushed(increments: usize, joint: &str, top: &str, more: &str) -> String {
    format!(
        r#"
analysis = "plane_strain"
supports = [{{ line = "bottom", fixed = ["x", "y"] }}]
{more}
[mesh]
columns = [{{ n = 1, to = 1.0 }}]
rows = [{{ n = 1, to = 0.5 }}, {{ n = 1, to = 1.0 }}]
lines = {{ bottom = {{ y = 0.0 }}, joint = {{ y = 0.5 }}, top = {{ y = 1.0 }} }}
region = [{{ group = "blocks" }}]
[laws]
{}
[laws.joint]
law = "coulomb_joint"
parameters = {{ normal_stiffness = {K_N:?}, shear_stiffness = {K_T:?}, {joint}, friction_angle = 25.37, dilatancy_angle = 0.0 }}
[groups]
blocks = {{ formulation = "solid", integration = "full", law = "block" }}
joint = {{ formulation = "zero_thickness", line = "joint", law = "joint" }}
[[phase]]
name = "weight"
increments = 1
pressure = [{{ line = "top", value = {PRESSURE:?} }}]
[[phase]]
name = "push"
increments = {increments}
{top}
[probes]
shear = {{ group = "joint", quantity = "force_x", line = "joint" }}
"#,
        elastic("block", 1e11, 0.2)
    )
}

fn along() -> String {
    format!("displacement = [{{ line = \"top\", x = {U:?} }}]")
}

/// H where A is open.
fn shear_force() -> f64 {
    // u = 2 h (12 h H − 3/2 (p − 2 h H)) / k_n + 6/5 H / k_t.
    let per_force = 2.0 * HEIGHT * (12.0 + 3.0) * HEIGHT / K_N + 1.2 / K_T;
    (U + 3.0 * HEIGHT * PRESSURE / K_N) / per_force
}

#[test]
fn a_block_whose_edge_is_torn_off_comes_to_the_equilibrium_of_statics() {
    for increments in [5, 10, 20] {
        for control in ["auto", "viscous"] {
            let settings = format!("solver.control = \"{control}\"");
            let text = pushed(increments, "cohesion = 18.17", &along(), &settings);
            let folder = tempfile::tempdir().unwrap();
            let what = format!("{increments} increments, {control}");
            if let Err(error) = run_text(&text, folder.path()) {
                panic!("{what}: {error}");
            }
            let shear = tests::case::column(&folder.path().join("history.csv"), "shear");
            let last = shear.last().unwrap().abs();
            assert_close(&what, last, shear_force(), RIGID, shear_force());
        }
    }
}

/// An equilibrium that nothing but single corrections finds is reported, with the increment.
#[test]
fn single_corrections_are_told() {
    let finished = run(&text(&hard(HARD.lines().nth(3).unwrap())));
    let phases = &finished.summary()["phases"];
    assert!(phases[0]["single_corrections_from"].is_null());
    // Without a look at bonds that open: 4 460 iterations, 25 cuts.
    let iterations = phases[1]["iterations"].as_u64().unwrap();
    assert!(iterations < 1500, "{iterations}");
    let from = phases[1]["single_corrections_from"]
        .as_u64()
        .expect("an increment");
    let warnings = &finished.observer.warnings;
    let says = format!("phase `push`, increment {from}: steps found no equilibrium where bonds");
    assert!(warnings.iter().any(|w| w.contains(&says)), "{warnings:?}");
}

/// Pushed by a force above what broken and bonded points can carry, the block topples.
#[test]
fn a_load_that_no_bond_carries_names_what_gives_way() {
    let top = "force = [{ line = \"top\", x = 70.0 }]";
    let failed = fail(&pushed(5, "cohesion = 18.17", top, ""));
    let (how, message) = gives_way(&failed);
    let ways = ["bond_breaks", "opens", "slides"];
    assert!(ways.contains(&how.as_str()), "{message}");
    assert!(message.contains("what gives way: a"), "{message}");
    has(&message, "group `joint`, element 1, point");
}

/// Without dilatancy and cohesion a block slides away.
#[test]
fn a_block_that_slides_away_is_said_to_slide() {
    let text = pushed(
        5,
        "cohesion = 0.0",
        "force = [{ line = \"top\", x = 70.0 }]",
        "",
    );
    // A flat block does not topple.
    let flat = text.replace("to = 1.0 }]\nlines", "to = 0.52 }]\nlines");
    let flat = flat.replace("top = { y = 1.0 }", "top = { y = 0.52 }");
    let failed = fail(&flat);
    let (how, message) = gives_way(&failed);
    assert_eq!(how, "slides", "{message}");
    has(&message, "what gives way: an interface slides");
}

fn gives_way(failed: &Failed) -> (String, String) {
    let mechanism = &failed.summary()["mechanism"];
    let message = failed.error.to_string();
    assert_eq!(mechanism["group"], "joint", "{message}");
    let of = mechanism["points_of"][1].as_u64();
    assert_eq!(of, Some(3), "{message}");
    let how = mechanism["how"].as_str().expect("a mechanism").to_owned();
    (how, message)
}

/// Numbers from 0 to 1, the same on every machine.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// A block on a bonded joint, pushed.
#[derive(Clone, Copy, Debug)]
struct Block {
    columns: usize,
    /// Height of its top above the base, which is 0.5 high.
    top: f64,
    modulus: f64,
    /// `k_n`, `k_t`, c, φ, ψ.
    joint: [f64; 5],
    pressure: f64,
    increments: usize,
    push: f64,
}

/// Blocks that come through by single corrections alone: the fields of [`Block`] in their order.
const HARD: &str = "
1 1.414 4.029e7 7.887e5 5.824e5 37.66 24.86 6.21 152.6 8 5.4951e-4
1 1.426 8.003e6 4.591e6 2.803e6 25.01 34.75 0.0 20.9 20 1.6413e-5
3 1.546 4.205e6 1.307e6 8.736e5 32.1 34.09 0.0 60.7 20 2.3149e-4
1 1.269 1.477e7 2.506e5 1.361e5 150.44 28.01 7.0 115.3 8 1.2180e-3
8 1.820 2.138e7 5.405e5 3.375e5 44.01 33.11 0.0 27.9 8 1.9824e-4
8 1.207 2.390e6 5.713e5 1.910e5 184.37 26.5 0.0 137.0 8 1.1771e-3
1 1.257 1.833e7 1.057e5 3.686e4 68.28 39.79 9.95 110.4 20 4.6536e-3
8 1.339 5.069e7 1.783e6 1.192e6 288.79 23.32 0.0 145.4 20 4.0512e-4
8 1.046 2.277e6 4.934e5 2.577e5 21.74 15.41 0.0 45.0 2 4.2324e-4
";

/// The block of a row of [`HARD`].
fn hard(row: &str) -> Block {
    let n: Vec<f64> = row.split(' ').map(|n| n.parse().unwrap()).collect();
    Block {
        columns: n[0] as usize,
        top: n[1],
        modulus: n[2],
        joint: std::array::from_fn(|i| n[3 + i]),
        pressure: n[8],
        increments: n[9] as usize,
        push: n[10],
    }
}

/// One of random stiffness, strength, pressure and size, pushed until its edge opens and beyond.
fn random(seed: u64) -> Block {
    let mut random = Random(seed);
    random.next();
    let mut draw = |low, high| random.between(low, high);
    let friction = draw(15.0, 40.0);
    let is_dilatant = draw(0.0, 1.0) < 0.3;
    let dilatancy = if is_dilatant { friction / 4.0 } else { 0.0 };
    let normal = 10_f64.powf(draw(5.0, 7.0));
    let shear = normal * draw(0.3, 1.0);
    let cohesion = 10_f64.powf(draw(0.0, 2.5));
    let pressure = draw(20.0, 200.0);
    Block {
        columns: 1 + draw(0.0, 4.0) as usize,
        top: 0.5 + draw(0.5, 1.5),
        modulus: 10_f64.powf(draw(6.0, 8.0)),
        joint: [normal, shear, cohesion, friction, dilatancy],
        pressure,
        increments: 2 + draw(0.0, 8.0) as usize,
        push: pressure / normal * draw(1.0, 5.0),
    }
}

fn text(block: &Block) -> String {
    let Block {
        columns,
        top,
        modulus,
        joint: [normal, shear, cohesion, friction, dilatancy],
        pressure,
        increments,
        push,
    } = block;
    format!(
        r#"
analysis = "plane_strain"
supports = [{{ line = "bottom", fixed = ["x", "y"] }}]
[mesh]
columns = [{{ n = {columns}, to = 1.0 }}]
rows = [{{ n = 1, to = 0.5 }}, {{ n = 1, to = {top:?} }}]
lines = {{ bottom = {{ y = 0.0 }}, joint = {{ y = 0.5 }}, top = {{ y = {top:?} }} }}
region = [{{ group = "blocks" }}]
[laws]
{}
[laws.joint]
law = "coulomb_joint"
parameters = {{ normal_stiffness = {normal:?}, shear_stiffness = {shear:?}, cohesion = {cohesion:?}, friction_angle = {friction:?}, dilatancy_angle = {dilatancy:?} }}
[groups]
blocks = {{ formulation = "solid", integration = "full", law = "block" }}
joint = {{ formulation = "zero_thickness", line = "joint", law = "joint" }}
[[phase]]
name = "weight"
increments = 1
pressure = [{{ line = "top", value = {pressure:?} }}]
[[phase]]
name = "push"
increments = {increments}
displacement = [{{ line = "top", x = {push:?} }}]
"#,
        elastic("block", *modulus, 0.2)
    )
}

#[test]
fn blocks_that_find_an_equilibrium_no_other_way_go_through() {
    for block in HARD.lines().skip(1).map(hard) {
        run(&text(&block));
    }
}

/// So many random blocks go through, whatever breaks first.
const SEEDS: u64 = 100;

#[test]
fn random_blocks_on_bonded_joints_go_through() {
    for seed in 0..SEEDS {
        run(&text(&random(seed)));
    }
}
