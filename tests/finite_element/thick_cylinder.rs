//! Thick cylinder under pressure from inside.
//!
//! Goal        convergence in elasticity; the spread of yielding and the limit pressure of Tresca and Mohr–Coulomb
//!             ground.
//! Geometry    a ring of one row of elements, b = 2 a.
//!
//! ```text
//!   axis     a          b
//!   │        ├──────────┤
//!   │    p → │          │   height 0.4
//!   │        ├──────────┤
//! ```
//!
//! Boundary    u_z = 0 above and below; pressure, or displacement, of the inner wall.
//! Law         elastic; mohr_coulomb with φ = 0 and φ = 30°, ψ = 0 and ψ = φ.
//! Asserts     order of convergence of displacements and stresses. Pressure against the closed form for the same
//!             displacement of the outer wall, increment by increment; limit.

use crate::setup::{Finished, Results, assert_close, elastic, run};
use std::f64::consts::PI;
use tests::tolerance::ROUND_OFF;

const A: f64 = 1.0;
pub(crate) const B: f64 = 2.0;
const HEIGHT: f64 = 0.4;
const YOUNG: f64 = 30e3;
const POISSON: f64 = 0.3;

pub(crate) fn text(law: &str, n: usize, integration: &str, phase: &str, probes: &str) -> String {
    format!(
        r#"
analysis = "axisymmetric"
supports = [{{ line = "top", fixed = ["z"] }}, {{ line = "bottom", fixed = ["z"] }}]
[mesh]
origin = [{A:?}, 0.0]
columns = [{{ n = {n}, to = {B:?} }}]
rows = [{{ n = 1, to = {HEIGHT} }}]
region = [{{ group = "ground" }}]
[mesh.lines]
inner = {{ r = {A:?} }}
outer = {{ r = {B:?} }}
top = {{ z = {HEIGHT} }}
bottom = {{ z = 0.0 }}
[laws]
{law}
[groups]
ground = {{ formulation = "solid", integration = "{integration}", law = "ground" }}
[[phase]]
name = "load"
{phase}
[probes]
inner = {{ line = "inner", quantity = "displacement_r" }}
outer = {{ line = "outer", quantity = "displacement_r" }}
force = {{ line = "inner", quantity = "reaction_r" }}
{probes}
"#
    )
}

/// Largest relative errors of displacements of the walls and of radial and hoop stress at 2 × 2
/// Gauss points.
fn elastic_errors(n: usize, integration: &str) -> (f64, f64) {
    let h = (B - A) / n as f64;
    let gauss: Vec<f64> = (0..n)
        .flat_map(|e| {
            let middle = A + (e as f64 + 0.5) * h;
            let offset = match integration {
                "full" => 0.5 * h * 0.6_f64.sqrt(),
                _ => 0.5 * h / 3.0_f64.sqrt(),
            };
            [middle - offset, middle + offset]
        })
        .collect();
    let probes: String = gauss
        .iter()
        .enumerate()
        .flat_map(|(i, r)| {
            ["11", "33"].map(|c| {
                format!(
                    "s_{c}_{i} = {{ group = \"ground\", quantity = \"stress_{c}\", \
                     r = [{}, {}] }}\n",
                    r - 1e-6,
                    r + 1e-6
                )
            })
        })
        .collect();
    let load = "increments = 1\npressure = [{ line = \"inner\", value = 1.0 }]";
    let law = elastic("ground", YOUNG, POISSON);
    let finished = run(&text(&law, n, integration, load, &probes));
    // σ_r = C (1 − b²/r²), σ_θ = C (1 + b²/r²) with C = a²/(b² − a²);
    // u = C (1 + ν)/E ((1 − 2ν) r + b²/r).
    let c = A * A / (B * B - A * A);
    let u = |r: f64| c * (1.0 + POISSON) / YOUNG * ((1.0 - 2.0 * POISSON) * r + B * B / r);
    let displacement = [("inner", A), ("outer", B)]
        .map(|(wall, r)| (finished.last(wall) / u(r) - 1.0).abs())
        .into_iter()
        .fold(0.0, f64::max);
    let stress = gauss
        .iter()
        .enumerate()
        .flat_map(|(i, r)| {
            [("11", -1.0), ("33", 1.0)].map(|(component, sign)| {
                let exact = c * (1.0 + sign * B * B / (r * r));
                (finished.last(&format!("s_{component}_{i}")) - exact).abs()
            })
        })
        .fold(0.0, f64::max);
    (displacement, stress)
}

#[test]
fn elastic_displacements_and_stresses_converge() {
    for integration in ["full", "reduced"] {
        let errors = [4, 8, 16, 32].map(|n| elastic_errors(n, integration));
        for pair in errors.windows(2) {
            let order = |of: fn(&(f64, f64)) -> f64| (of(&pair[0]) / of(&pair[1])).log2();
            let (displacement, stress) = (order(|e| e.0), order(|e| e.1));
            // Displacements at the walls are energies of the two pressures: order 2 · 2.
            // With 2 × 2 points nodes are exact from the start.
            let exact = pair[0].0 < ROUND_OFF && pair[1].0 < ROUND_OFF;
            assert!(
                exact || displacement >= 3.5,
                "{integration}: displacements of order {displacement:.2}"
            );
            // Quadratic displacements have strains of order 2; the 2 × 2 points are better.
            let least = if integration == "full" { 1.7 } else { 2.6 };
            assert!(
                stress >= least,
                "{integration}: stresses of order {stress:.2}"
            );
        }
        assert!(
            errors[3].0 < 1e-6 && errors[3].1 < 1e-3,
            "{integration}: {errors:?}"
        );
    }
}

/// Ground of cohesion c and friction φ, in σ_1 = N σ_3 + Y (compression positive).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strength {
    n: f64,
    y: f64,
}

impl Strength {
    pub(crate) fn new(cohesion: f64, friction_angle: f64) -> Self {
        let (sin, cos) = friction_angle.to_radians().sin_cos();
        Self {
            n: (1.0 + sin) / (1.0 - sin),
            y: 2.0 * cohesion * cos / (1.0 - sin),
        }
    }

    /// Pressure at the inner wall when the ground has yielded up to ρ.
    ///
    /// Outside, σ_r = D (b²/r² − 1), σ_θ = −D (b²/r² + 1), and D follows from yielding at ρ.
    /// Inside, equilibrium r σ_r' + σ_r − σ_θ = 0 with σ_θ = (σ_r − Y)/N gives
    /// σ_r + Y/(N − 1) ∝ r^(1/N − 1); for N = 1, σ_r falls by Y ln r.
    pub(crate) fn pressure(self, radius: f64) -> f64 {
        let Self { n, y } = self;
        let outer = (B / radius).powi(2);
        let at_radius = y * (outer - 1.0) / ((n + 1.0) * outer + n - 1.0);
        if n > 1.0 {
            let shift = y / (n - 1.0);
            (at_radius + shift) * (radius / A).powf(1.0 - 1.0 / n) - shift
        } else {
            at_radius + y * (radius / A).ln()
        }
    }

    /// The radius up to which the ground has yielded, from the displacement of the outer wall:
    /// u_b = 2 D b (1 − ν²)/E. At least a, at most b.
    pub(crate) fn radius(self, outer_displacement: f64) -> f64 {
        let Self { n, y } = self;
        let d = outer_displacement * YOUNG / (2.0 * B * (1.0 - POISSON * POISSON));
        let outer = (y / d - (n - 1.0)) / (n + 1.0);
        (B / outer.sqrt()).clamp(A, B)
    }
}

/// The case of a cylinder that is pressed from inside.
pub(crate) fn pressing(cohesion: f64, angles: [f64; 2], n: usize, integration: &str) -> String {
    let law = format!(
        "ground = {{ law = \"mohr_coulomb\", parameters = {{ young_modulus = {YOUNG:?}, \
         poisson_ratio = {POISSON}, cohesion = {cohesion:?}, friction_angle = {:?}, \
         dilatancy_angle = {:?} }} }}",
        angles[0], angles[1]
    );
    let load = "increments = 40\ndisplacement = [{ line = \"inner\", r = 0.02 }]";
    text(&law, n, integration, load, "")
}

fn pressed(cohesion: f64, angles: [f64; 2], n: usize, integration: &str) -> Finished {
    run(&pressing(cohesion, angles, n, integration))
}

fn assert_pressures(cohesion: f64, angles: [f64; 2], tolerance: f64) {
    let strength = Strength::new(cohesion, angles[0]);
    for integration in ["full", "reduced"] {
        let finished = pressed(cohesion, angles, 8, integration);
        let pressures = finished
            .history("force")
            .iter()
            .map(|f| f / (2.0 * PI * A * HEIGHT))
            .collect::<Vec<_>>();
        let limit = strength.pressure(B);
        let what = format!("φ, ψ = {angles:?}, {integration}");
        let mut partly = 0;
        let mut worst = 0.0_f64;
        for (pressure, outer) in pressures.iter().zip(finished.history("outer")) {
            let radius = strength.radius(outer);
            if radius > A && radius < B {
                partly += 1;
                worst = worst.max((pressure - strength.pressure(radius)).abs() / limit);
                assert_close(
                    &what,
                    *pressure,
                    strength.pressure(radius),
                    tolerance,
                    limit,
                );
            }
        }
        assert!(
            partly >= 4,
            "{what}: only {partly} increments between first and full yield"
        );
        let last = pressures[pressures.len() - 1];
        assert_close(&format!("{what}: limit"), last, limit, tolerance, limit);
    }
}

#[test]
fn tresca_cylinder_reaches_2_c_ln_b_over_a() {
    // Y = 2 c, so the closed form's limit is the textbook's.
    let strength = Strength::new(50.0, 0.0);
    assert_close(
        "2 c ln(b/a)",
        strength.pressure(B),
        100.0 * 2.0_f64.ln(),
        1e-15,
        100.0,
    );
    assert_pressures(50.0, [0.0, 0.0], 0.002);
}

#[test]
fn mohr_coulomb_cylinder_reaches_its_limit_pressure() {
    assert_pressures(50.0, [30.0, 0.0], 0.002);
    assert_pressures(50.0, [30.0, 30.0], 0.002);
}
