//! Strip footing on weightless ground: the limit load of Prandtl.
//!
//! Goal        bearing capacity N_c c of Tresca and of c–φ ground.
//! Geometry    half of a rigid, rough strip of half-width 1.
//!
//! ```text
//!   ▓▓▓▓ ← w
//!   ┌───┬──────────────┐
//!   │   :              │   finer towards the edge of the strip and the surface
//!   │   :              │
//!   └───┴──────────────┘
//! ```
//!
//! Boundary    u_x = 0 on the axis of symmetry and on the right, u = 0 below; strip pushed down.
//! Law         mohr_coulomb.
//! Asserts     mean pressure under the strip at the end of a long push: N_c = 2 + π, or (N_q − 1) cot φ with N_q =
//!             tan²(45° + φ/2) exp(π tan φ). It comes from above, and closer on the finer mesh.

use crate::setup::{Finished, Results, run};
use std::f64::consts::PI;

/// Ground of cohesion 1 kPa.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footing {
    pub(crate) friction_angle: f64,
    pub(crate) dilatancy_angle: f64,
    pub(crate) width: f64,
    pub(crate) depth: f64,
    /// Elements under half the strip; others in proportion.
    pub(crate) n: usize,
    pub(crate) integration: &'static str,
    pub(crate) settlement: f64,
    pub(crate) increments: usize,
}

pub(crate) fn push(footing: Footing) -> Finished {
    run(&text(footing))
}

pub(crate) fn text(footing: Footing) -> String {
    let Footing {
        friction_angle,
        dilatancy_angle,
        width,
        depth,
        n,
        integration,
        settlement,
        increments,
    } = footing;
    // Elements shrink towards the edge, by 5 under the strip and by more outside.
    let under = 5.0_f64.powf(-1.0 / n as f64);
    let outside = 1.0 / under;
    format!(
        r#"
analysis = "plane_strain"
supports = [
  {{ line = "axis", fixed = ["x"] }},
  {{ line = "right", fixed = ["x"] }},
  {{ line = "bottom", fixed = ["x", "y"] }},
  {{ line = "strip", fixed = ["x"] }},
]
[mesh]
origin = [0.0, {:?}]
columns = [{{ n = {n}, to = 1.0, ratio = {under} }}, {{ n = {}, to = {width:?}, ratio = {} }}]
rows = [{{ n = {}, to = 0.0, ratio = {} }}]
region = [{{ group = "ground" }}]
lines = {{ axis = {{ x = 0.0 }}, right = {{ x = {width:?} }}, bottom = {{ y = {:?} }}, strip = {{ y = 0.0, x = [0.0, 1.0] }} }}
[laws.ground]
law = "mohr_coulomb"
[laws.ground.parameters]
young_modulus = 200.0
poisson_ratio = 0.3
cohesion = 1.0
friction_angle = {friction_angle:?}
dilatancy_angle = {dilatancy_angle:?}
[groups]
ground = {{ formulation = "solid", integration = "{integration}", law = "ground" }}
[[phase]]
name = "push"
increments = {increments}
displacement = [{{ line = "strip", y = -{settlement:?} }}]
[probes]
pressure = {{ line = "strip", quantity = "reaction_y", scale = -1.0 }}
settlement = {{ line = "strip", quantity = "displacement_y", scale = -1.0 }}
"#,
        -depth,
        2 * n,
        outside.sqrt(),
        2 * n,
        under.sqrt(),
        -depth,
    )
}

fn n_c(friction_angle: f64) -> f64 {
    if friction_angle == 0.0 {
        return 2.0 + PI;
    }
    let phi = friction_angle.to_radians();
    let n_q = (PI / 4.0 + phi / 2.0).tan().powi(2) * (PI * phi.tan()).exp();
    (n_q - 1.0) / phi.tan()
}

/// Pressures at the end, on a mesh and on one twice as fine.
fn limits(footing: Footing) -> [f64; 2] {
    [4, 8].map(|n| {
        let finished = push(Footing { n, ..footing });
        let pressures = finished.history("pressure");
        let [.., before, last] = pressures[..] else {
            panic!("too few increments")
        };
        // A limit: the last increment adds next to nothing.
        let growth = (last - before) / last;
        assert!(
            growth < 0.004,
            "{footing:?}, n = {n}: still growing by {growth:.1e}"
        );
        last
    })
}

/// Limits from above: a mesh of displacements is stiffer than the ground. The error is one of
/// the singular edge, in proportion to the size of elements there, so the two meshes give a
/// third value without it.
#[track_caller]
fn assert_limit(footing: Footing, finer: f64, extrapolated: f64) {
    let exact = n_c(footing.friction_angle);
    let [coarse, fine] = limits(footing).map(|limit| limit / exact - 1.0);
    let without = 2.0 * fine - coarse;
    let what = format!("{footing:?}: errors {coarse:.4}, {fine:.4}, extrapolated {without:.4}");
    assert!(0.0 < fine && fine < 0.6 * coarse && fine < finer, "{what}");
    assert!(without.abs() < extrapolated, "{what}");
}

pub(crate) const TRESCA: Footing = Footing {
    friction_angle: 0.0,
    dilatancy_angle: 0.0,
    width: 5.0,
    depth: 3.0,
    n: 0,
    integration: "reduced",
    settlement: 0.2,
    increments: 15,
};

pub(crate) const FRICTION: Footing = Footing {
    friction_angle: 20.0,
    dilatancy_angle: 20.0,
    width: 9.0,
    depth: 5.0,
    settlement: 0.5,
    increments: 12,
    ..TRESCA
};

/// Reduced integration and friction are held against the same numbers in `verification/plastic.rs`.
#[test]
fn tresca_ground_carries_2_plus_pi() {
    let integration = "full";
    assert_limit(
        Footing {
            integration,
            ..TRESCA
        },
        0.055,
        0.005,
    );
}

#[test]
fn ground_of_20_degrees_with_half_the_dilatancy() {
    // No exact limit is known. Associated flow gives an upper bound on the same mesh; Davis
    // (1968) reduces tan φ and c by cos ψ cos φ/(1 − sin ψ sin φ) for an estimate from below.
    let n = 8;
    let last = |dilatancy_angle| {
        push(Footing {
            dilatancy_angle,
            n,
            ..FRICTION
        })
        .last("pressure")
    };
    let (half, associated) = (last(10.0), last(20.0));
    let (phi, psi) = (20.0_f64.to_radians(), 10.0_f64.to_radians());
    let reduction = psi.cos() * phi.cos() / (1.0 - psi.sin() * phi.sin());
    let below = reduction * n_c((reduction * phi.tan()).atan().to_degrees());
    assert!(
        below < half && half < associated,
        "{below} < {half} < {associated}"
    );
}

#[test]
fn a_tolerance_of_the_active_load_does_not_know_the_weight_of_the_ground() {
    // Equal stress in all directions changes nothing for Tresca, so the exact answer is that without weight.
    let pressures = |weight: f64, of: &str, tolerance: f64| {
        let heavy = format!(
            "law = \"ground\", unit_weight = {weight:?}, initial_stress = {{ k_0 = 1.0 }} }}"
        );
        let ground = text(Footing { n: 4, ..TRESCA }).replace("law = \"ground\" }", &heavy);
        let finished = run(&format!(
            "{ground}\n[solver]\nforce_tolerance = {tolerance:?}\ndisplacement_tolerance = 1.0\ntolerance_of = \"{of}\"\n"
        ));
        finished.history("pressure")
    };
    let exact = pressures(1e-3, "active_load", 1e-9);
    let error = |of| {
        let pairs = pressures(1e4, of, 1e-3).into_iter().zip(&exact);
        let errors = pairs.map(|(pressure, exact)| (pressure / exact - 1.0).abs());
        errors.fold(0.0, f64::max)
    };
    let (of_load, of_all) = (error("active_load"), error("forces_in_play"));
    assert!(of_load < 2e-3, "{of_load:.1e}");
    assert!(of_all > 0.01, "{of_all:.1e}");
}
