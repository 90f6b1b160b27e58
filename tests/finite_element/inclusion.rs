//! Confinement of a pile's cross-section: the coefficient K_l.
//!
//! Goal        contact pressure on a stiff cylinder in elastic ground under confinement.
//! Geometry    a disc of a long cylinder around the axis, one row of elements.
//!
//! ```text
//!   axis                                    b
//!   │ core │layer│      ground              │ ← 1 kPa
//!   ┴──────┴─────┴──────────────────────────┴ → r
//!   0      a    a+t
//! ```
//!
//! Boundary    u_z = 0 above and below, pressure outside.
//! Law         elastic; coulomb_joint in a thin layer and in a zero-thickness joint.
//! Asserts     K_l against the closed form of the layered cylinder, and against 2 (1 − ν) for a rigid core in
//!             infinite ground.

use crate::cylinder::{Ring, stresses_at_faces};
use crate::setup::{Lame, Results, assert_close, elastic, run};
use std::f64::consts::PI;

const STEEL: (f64, f64) = (210e6, 0.28);
const SAND: (f64, f64) = (34e3, 0.3);
const A: f64 = 0.010;
const T: f64 = 0.002;
const HEIGHT: f64 = 0.05;

/// What lies between core and ground.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Interface {
    /// 2 mm of ground.
    Ground,
    /// A thin layer with an interface law.
    Layer {
        k_n: f64,
        k_t: f64,
        integration: &'static str,
    },
    /// A joint of no thickness at r = a.
    Joint {
        k_n: f64,
        k_t: f64,
        integration: &'static str,
    },
}

fn joint_law(k_n: f64, k_t: f64) -> String {
    format!(
        "interface = {{ law = \"coulomb_joint\", parameters = {{ normal_stiffness = {k_n}, \
         shear_stiffness = {k_t}, cohesion = 0.0, friction_angle = 30.0, \
         dilatancy_angle = 0.0 }} }}\n"
    )
}

/// Contact pressure at r = a under a unit pressure at r = b.
fn k_l(core: (f64, f64), b: f64, n: usize, interface: Interface) -> f64 {
    let (law, group, region) = match interface {
        Interface::Ground => (String::new(), String::new(), String::new()),
        Interface::Layer {
            k_n,
            k_t,
            integration,
        } => (
            joint_law(k_n, k_t),
            format!(
                "interface = {{ formulation = \"thin_layer\", normal = \"r\", \
                 integration = \"{integration}\", law = \"interface\" }}"
            ),
            format!(
                "[[mesh.region]]\ngroup = \"interface\"\nr = [{A}, {}]\n",
                A + T
            ),
        ),
        Interface::Joint {
            k_n,
            k_t,
            integration,
        } => (
            joint_law(k_n, k_t),
            format!(
                "interface = {{ formulation = \"zero_thickness\", line = \"shaft\", \
                 integration = \"{integration}\", law = \"interface\" }}"
            ),
            String::new(),
        ),
    };
    // Sizes in proportion to the radius.
    let ratio = (b / (A + T)).powf(1.0 / n as f64);
    let across = if matches!(interface, Interface::Layer { .. }) {
        1
    } else {
        n / 8
    };
    let text = format!(
        r#"
analysis = "axisymmetric"
supports = [{{ line = "top", fixed = ["z"] }}, {{ line = "bottom", fixed = ["z"] }}, {{ line = "axis", fixed = ["r"] }}]
[mesh]
columns = [{{ n = 1, to = {A} }}, {{ n = {across}, to = {} }}, {{ n = {n}, to = {b}, ratio = {ratio} }}]
rows = [{{ n = 1, to = {HEIGHT} }}]
[[mesh.region]]
group = "ground"
[[mesh.region]]
group = "core"
r = [0.0, {A}]
{region}
[mesh.lines]
shaft = {{ r = {A} }}
wall = {{ r = {b} }}
axis = {{ r = 0.0 }}
top = {{ z = {HEIGHT} }}
bottom = {{ z = 0.0 }}
[laws]
{}{}{law}
[groups]
core = {{ formulation = "solid", integration = "full", law = "core" }}
ground = {{ formulation = "solid", integration = "full", law = "ground" }}
{group}
[[phase]]
name = "confinement"
increments = 1
pressure = [{{ line = "wall", value = 1.0 }}]
[probes]
force = {{ line = "shaft", group = "core", quantity = "force_r" }}
"#,
        A + T,
        elastic("core", core.0, core.1),
        elastic("ground", SAND.0, SAND.1),
    );
    -run(&text).last("force") / (2.0 * PI * A * HEIGHT)
}

/// The closed form of the same.
fn exact(core: (f64, f64), b: f64, interface: Interface) -> f64 {
    let core = Lame::new(core.0, core.1);
    let sand = Lame::new(SAND.0, SAND.1);
    let rings = match interface {
        Interface::Ground => vec![Ring::glued(A, core), Ring::glued(b, sand)],
        Interface::Layer { k_n, k_t, .. } => {
            let layer = Lame {
                lambda: (k_n - 2.0 * k_t) * T,
                shear: k_t * T,
                oedometric: k_n * T,
            };
            vec![
                Ring::glued(A, core),
                Ring::glued(A + T, layer),
                Ring::glued(b, sand),
            ]
        }
        Interface::Joint { k_n, .. } => {
            vec![
                Ring {
                    joint: k_n,
                    ..Ring::glued(A, core)
                },
                Ring::glued(b, sand),
            ]
        }
    };
    -stresses_at_faces(&rings)[0]
}

#[test]
fn k_l_of_a_steel_pile_in_a_chamber() {
    let k_l = [8, 16].map(|n| k_l(STEEL, 0.262, n, Interface::Ground));
    let exact = exact(STEEL, 0.262, Interface::Ground);
    // Forces on a whole line are energies: order 2 · 2, so the error falls by 16.
    assert_close("K_l, 8 elements", k_l[0], exact, 3e-4, exact);
    assert_close("K_l, 16 elements", k_l[1], exact, 2e-5, exact);
    let gain = (k_l[0] - exact) / (k_l[1] - exact);
    assert!(
        gain > 11.0,
        "error falls by {gain:.1} per halving, expected about 16"
    );
    // A rigid core in a chamber this wide: 2 (1 − ν)/(1 + (1 − 2 ν) a²/b²) = 1.3992.
    let poisson = SAND.1;
    let finite = 1.0 + (1.0 - 2.0 * poisson) * (A / 0.262_f64).powi(2);
    assert_close(
        "rigid core",
        k_l[1],
        2.0 * (1.0 - poisson) / finite,
        2e-4,
        1.0,
    );
}

#[test]
fn k_l_of_a_rigid_inclusion_without_end() {
    // b = 200 a leaves (1 − 2 ν) a²/b² = 1e-5 of the outer radius; the core is 1e8 times stiffer.
    let k_l = k_l((SAND.0 * 1e8, 0.0), 200.0 * A, 24, Interface::Ground);
    assert_close("2 (1 − ν)", k_l, 2.0 * (1.0 - SAND.1), 3e-5, 1.4);
}

#[test]
fn k_l_behind_a_thin_layer_with_an_interface_law() {
    for integration in ["full", "reduced", "mean"] {
        for (k_n, k_t) in [(0.86e6, 0.37e6), (0.86e5, 0.37e5), (2e4, 0.5e4)] {
            let layer = Interface::Layer {
                k_n,
                k_t,
                integration,
            };
            let found = k_l(STEEL, 0.262, 16, layer);
            let exact = exact(STEEL, 0.262, layer);
            let tolerance = 1e-4;
            assert_close(&format!("{layer:?}"), found, exact, tolerance, exact);
        }
    }
}

#[test]
fn k_l_behind_a_joint_of_no_thickness() {
    for integration in ["nodes", "full", "reduced"] {
        for k_n in [1e9, 0.86e6, 2e4] {
            let joint = Interface::Joint {
                k_n,
                k_t: 1e5,
                integration,
            };
            let found = k_l(STEEL, 0.262, 16, joint);
            let exact = exact(STEEL, 0.262, joint);
            assert_close(&format!("{joint:?}"), found, exact, 5e-5, exact);
        }
    }
}
