//! A block that slides on a plane.
//!
//! Goal        friction at constant normal force, opening and re-closure, dilation against a spring; the same for a
//!             zero-thickness joint and for a thin layer.
//! Geometry    an elastic column (the spring) on a rigid plate on the interface.
//!
//! ```text
//!        pressure or u_y
//!     ┌───────────┐
//!  s →│  column   │ height H, M = E, ν = 0: stiffness k = M/H per area
//!     ├───────────┤
//!  s →│  plate    │ rigid
//!     ╞═══════════╡ interface
//!     │  base     │ rigid, fixed
//!     └───────────┘
//! ```
//!
//! Boundary    u_x = s on both sides of column and plate; base fixed; above, a pressure of 100 kPa, which is either
//!             kept or replaced by u_y = 0 (a spring).
//! Law         coulomb_joint and mepi with K_n, K_t.
//! Asserts     traction and jump in every increment against closed forms (coulomb_joint) and quadrature (mepi).

use crate::setup::{Finished, Results, assert_close, elastic, run};
use tests::tolerance::EQUILIBRIUM;

pub(crate) const K_N: f64 = 2e5;
pub(crate) const K_T: f64 = 1e5;
/// Modulus and height of the column.
pub(crate) const MODULUS: f64 = 5e4;
const H: f64 = 0.5;
/// Column and interface in series: normal traction per displacement of the top.
const SERIES: f64 = MODULUS / H * K_N / (MODULUS / H + K_N);
/// Normal stress from the first phase on, compression positive.
const SIGMA: f64 = 100.0;
/// Thickness of the thin layer: a layer in shear also needs shear forces at its ends, which
/// are in the ratio of thickness to length.
const LAYER: f64 = 1e-5;

/// Equilibrium, less what the plate (2e10 kPa) yields under 100 kPa.
const RIGID: f64 = 1e-5;

pub(crate) fn coulomb(friction: f64, dilatancy: f64) -> String {
    format!(
        "law = \"coulomb_joint\"\nparameters = {{ normal_stiffness = {K_N:?}, \
         shear_stiffness = {K_T:?}, cohesion = 0.0, friction_angle = {friction:?}, \
         dilatancy_angle = {dilatancy:?} }}"
    )
}

/// Interface of a block.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    /// Zero thickness, with this integration.
    Joint(&'static str),
    /// Thin layer, with this integration.
    Layer(&'static str),
}

/// A case. `laws` are whole tables; the interface starts with `[laws.interface]`.
pub(crate) fn text(kind: Kind, laws: &str, phases: &str) -> String {
    let (group, layer, region) = match kind {
        Kind::Joint(integration) => (
            format!("zero_thickness\"\nline = \"plane\"\nintegration = \"{integration}"),
            String::new(),
            String::new(),
        ),
        Kind::Layer(integration) => (
            format!("thin_layer\"\nintegration = \"{integration}"),
            format!("{{ n = 1, to = {LAYER:e} }}, "),
            format!("[[mesh.region]]\ngroup = \"interface\"\ny = [0.0, {LAYER:e}]"),
        ),
    };
    let bottom = if layer.is_empty() { 0.0 } else { LAYER };
    let (plate, top) = (bottom + 0.1, bottom + 0.1 + H);
    format!(
        r#"
analysis = "plane_strain"
supports = [{{ line = "base", fixed = ["x", "y"] }}, {{ line = "base_left", fixed = ["x", "y"] }}, {{ line = "base_right", fixed = ["x", "y"] }}]
[mesh]
origin = [0.0, -0.1]
columns = [{{ n = 1, to = 1.0 }}]
rows = [{{ n = 1, to = 0.0 }}, {layer}{{ n = 1, to = {plate:?} }}, {{ n = 1, to = {top:?} }}]
[[mesh.region]]
group = "rigid"
[[mesh.region]]
group = "column"
y = [{plate:?}, {top:?}]
{region}
[mesh.lines]
plane = {{ y = 0.0 }}
base = {{ y = -0.1 }}
base_left = {{ x = 0.0, y = [-0.1, 0.0] }}
base_right = {{ x = 1.0, y = [-0.1, 0.0] }}
left = {{ x = 0.0, y = [{bottom:?}, {top:?}] }}
right = {{ x = 1.0, y = [{bottom:?}, {top:?}] }}
top = {{ y = {top:?} }}
[laws]
{}{}
[laws.interface]
{laws}
[groups.rigid]
formulation = "solid"
integration = "full"
law = "rigid"
[groups.column]
formulation = "solid"
integration = "full"
law = "column"
[groups.interface]
formulation = "{group}"
law = "interface"
{phases}
[probes]
sigma = {{ group = "interface", quantity = "traction_n", scale = -1.0 }}
tau = {{ group = "interface", quantity = "traction_t" }}
opening = {{ group = "interface", quantity = "jump_n" }}
slip = {{ group = "interface", quantity = "jump_t" }}
plastic_slip = {{ group = "interface", quantity = "plastic_slip" }}
push = {{ line = "top", quantity = "displacement_y" }}
"#,
        elastic("rigid", 2e10, 0.0),
        elastic("column", MODULUS, 0.0),
    )
}

/// The phase that presses the block down.
pub(crate) const PRESS: &str = r#"[[phase]]
name = "press"
increments = 1
pressure = [{ line = "top", value = 100.0 }]
displacement = [{ line = "left", x = 0.0 }, { line = "right", x = 0.0 }]
"#;

/// A phase that slides the block to s; `top` is the condition on top.
pub(crate) fn slide(name: &str, increments: usize, s: f64, top: &str) -> String {
    format!(
        "[[phase]]\nname = \"{name}\"\nincrements = {increments}\ndisplacement = [\
         {{ line = \"left\", x = {s:e} }}, {{ line = \"right\", x = {s:e} }}, {top}]\n"
    )
}

/// Above, hold u_y where it is.
pub(crate) fn hold_top(phase: &str) -> String {
    phase.replace(
        "displacement =",
        "reset_displacements = true\ndisplacement =",
    )
}

/// If a layer with 2 × 2 or 3 × 3 points slides without hardening, or opens, its mid-thickness nodes have no stiffness;
/// so layers are tested with mean strain only.
const KINDS: [Kind; 4] = [
    Kind::Joint("nodes"),
    Kind::Joint("full"),
    Kind::Joint("reduced"),
    Kind::Layer("mean"),
];

fn rows(finished: &Finished, phase: &str, probes: [&str; 4]) -> Vec<[f64; 4]> {
    let columns = probes.map(|probe| finished.in_phase(phase, probe));
    (0..columns[0].len())
        .map(|i| [0, 1, 2, 3].map(|c| columns[c][i]))
        .collect()
}

#[test]
fn sliding_to_and_fro_at_constant_normal_force() {
    let friction = 30.0_f64;
    let limit = SIGMA * friction.to_radians().tan();
    // Elastic up to τ/K_t = 0.577 mm.
    let phases = PRESS.to_owned() + &slide("to", 8, 2e-3, "") + &slide("fro", 12, -1e-3, "");
    for kind in KINDS {
        let finished = run(&text(kind, &coulomb(friction, 0.0), &phases));
        let mut tau = 0.0_f64;
        let mut before = 0.0;
        let mut sliding = 0;
        for phase in ["to", "fro"] {
            for [sigma, found, slip, _] in rows(&finished, phase, ["sigma", "tau", "slip", "push"])
            {
                tau = (tau + K_T * (slip - before)).clamp(-limit, limit);
                sliding += usize::from(tau.abs() >= limit);
                before = slip;
                assert_close(&format!("{kind:?} τ at {slip}"), found, tau, RIGID, limit);
                assert_close(&format!("{kind:?} σ"), sigma, SIGMA, RIGID, SIGMA);
            }
        }
        assert_eq!(finished.observer.cut_backs, 0, "{kind:?}");
        assert!(sliding >= 8, "{kind:?}: {sliding} increments slide");
        assert_close("s", finished.last("slip"), -1e-3, RIGID, 1e-3);
    }
}

#[test]
fn opening_under_tension_and_closing_again() {
    // The column's top goes up by twice what empties the springs, then down beyond the start.
    let release = SIGMA / SERIES;
    let tops = [2.0 * release, -release];
    let lift = |increments: usize, name: &str, top: f64, reset: bool| {
        format!(
            "[[phase]]\nname = \"{name}\"\nincrements = {increments}\nreset_displacements = {reset}\n\
             displacement = [{{ line = \"top\", y = {top:e} }}]\n"
        )
    };
    // Once step by step, once all in one step.
    for (kind, n) in KINDS.iter().flat_map(|&kind| [(kind, 7), (kind, 1)]) {
        let lifts = lift(n, "lift", tops[0], true) + &lift(n, "drop", tops[1], false);
        let phases = PRESS.to_owned() + &lifts;
        let finished = run(&text(kind, &coulomb(30.0, 0.0), &phases));
        let (mut open, mut closed) = (0, 0);
        for phase in ["lift", "drop"] {
            for [sigma, opening, push, tau] in
                rows(&finished, phase, ["sigma", "opening", "push", "tau"])
            {
                // Contact while the top is lower than the release; then the column is at rest.
                let expected = (SIGMA - SERIES * push).max(0.0);
                let gap = (push - release).max(0.0) - expected / K_N;
                let what = format!("{kind:?}, {phase} at {push:.3e}");
                assert_close(&what, sigma, expected, RIGID, SIGMA);
                assert_close(&what, opening, gap, RIGID, release);
                assert_close(&what, tau, 0.0, EQUILIBRIUM, SIGMA);
                open += usize::from(expected == 0.0);
                closed += usize::from(expected > 0.0);
            }
        }
        assert_eq!(finished.observer.cut_backs, 0, "{kind:?}");
        let expected = if n == 1 { [1, 1] } else { [5, 6] };
        assert!(
            open >= expected[0] && closed >= expected[1],
            "{kind:?}: open {open}, closed {closed}"
        );
        assert_close("end", finished.last("sigma"), 2.0 * SIGMA, RIGID, SIGMA);
    }
}

#[test]
fn dilating_against_a_spring() {
    // Elastic up to ⟦u_t⟧ = σ_0 tan φ/K_t. Then dξ = d⟦u_t⟧ − dτ/K_t, and the interface's
    // opening by ξ tan ψ presses column and interface together: σ = σ_0 + k' tan ψ ξ with the
    // two in series, τ = σ tan φ.
    let (friction, dilatancy) = (30.0_f64, 10.0_f64);
    let (mu, psi) = (friction.to_radians().tan(), dilatancy.to_radians().tan());
    let hardening = SERIES * psi;
    let slide = hold_top(&slide("slide", 10, 5e-3, "{ line = \"top\", y = 0.0 }"));
    for kind in KINDS {
        let finished = run(&text(
            kind,
            &coulomb(friction, dilatancy),
            &(PRESS.to_owned() + &slide),
        ));
        for [sigma, tau, slip, opening] in
            rows(&finished, "slide", ["sigma", "tau", "slip", "opening"])
        {
            let xi = ((slip - SIGMA * mu / K_T) / (1.0 + hardening * mu / K_T)).max(0.0);
            let expected = SIGMA + hardening * xi;
            let what = format!("{kind:?} at {slip:.2e}");
            let shear = (K_T * slip).min(expected * mu);
            assert_close(&what, sigma, expected, RIGID, SIGMA);
            assert_close(&what, tau, shear, RIGID, SIGMA);
            let height = psi * xi - expected / K_N;
            assert_close(&what, opening, height, RIGID, SIGMA / K_N);
        }
        let gain = finished.last("sigma") - SIGMA;
        assert!(
            gain > 0.2 * SIGMA,
            "{kind:?}: dilation adds only {gain} kPa"
        );
    }
}

/// μ_c − μ of the law `mepi`, equations (10), (16), (17), with the parameters below.
fn contraction(xi: f64) -> f64 {
    let mu = friction(xi);
    if mu < 0.46 {
        0.46 - mu
    } else {
        -(mu - 0.46) / (2.0 * xi / 0.002).cosh()
    }
}

/// Equation (10) with A = 0.5, t = 2 mm, σ_ni = p_0.
fn friction(xi: f64) -> f64 {
    0.27 + (0.7 - 0.27) * xi / (0.5 * 0.002 + xi)
}

const MEPI: &str = "law = \"mepi\"\nparameters = { k_n = 2e5, k_t = 1e5, n = 0.0, mu_0 = 0.27, \
                    mu_p = 0.7, mu_c0 = 0.46, a = 0.5, c_0 = 2.0, t = 0.002, p_0 = 100.0, \
                    sigma_ni = 100.0 }";

/// σ(ξ) = σ_0 − k' ∫ (μ_c − μ) dξ by the midpoint rule with far more parts than increments.
fn sigma_by_quadrature(xi: f64) -> f64 {
    let parts = 20_000;
    let h = xi / f64::from(parts);
    let sum: f64 = (0..parts)
        .map(|i| contraction((f64::from(i) + 0.5) * h))
        .sum();
    SIGMA - SERIES * h * sum
}

#[test]
fn mepi_against_a_spring() {
    let mut worst = Vec::new();
    for increments in [200, 400] {
        let slide = hold_top(&slide(
            "slide",
            increments,
            1e-2,
            "{ line = \"top\", y = 0.0 }",
        ));
        for kind in [
            Kind::Joint("nodes"),
            Kind::Layer("mean"),
            Kind::Layer("full"),
        ] {
            let finished = run(&text(kind, MEPI, &(PRESS.to_owned() + &slide)));
            let rows = rows(&finished, "slide", ["sigma", "tau", "slip", "plastic_slip"]);
            let mut error = 0.0_f64;
            for [sigma, tau, slip, xi] in rows {
                if xi > 0.0 {
                    error = error.max((sigma - sigma_by_quadrature(xi)).abs());
                    assert_close("τ", tau, friction(xi) * sigma, RIGID, SIGMA);
                }
                assert_close("slip", slip, xi + tau / K_T, RIGID, 1e-2);
            }
            // Contraction takes normal stress, then dilation gives it back.
            let lowest = finished.history("sigma").into_iter().fold(SIGMA, f64::min);
            assert!(
                lowest < 0.97 * SIGMA && finished.last("sigma") > SIGMA,
                "{kind:?}: {lowest}"
            );
            assert_eq!(finished.observer.cut_backs, 0, "{kind:?}");
            worst.push(error);
        }
    }
    // Backward Euler: first order in the increment.
    for (coarse, fine) in worst[..3].iter().zip(&worst[3..]) {
        assert!(*fine < 0.2, "{fine} kPa");
        assert!(coarse / fine > 1.8, "errors {coarse} and {fine} kPa");
    }
}
