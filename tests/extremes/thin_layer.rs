//! One thin-layer element from L/t = 1 to 10⁶, from K_n/K_t just above 4/3 to 10⁸.
//!
//! ```text
//!        p
//!   ┌─────────┐
//!  ▹│  t, L   │q
//!   └─────────┘
//!    ▵ ▵ ▵ ▵ ▵
//! ```
//!
//! Law         coulomb_joint, far from its strength: the layer is elastic, M = K_n t, G = K_t t
//! Agrees      stresses −p, −q, and displacements of the closed form, to 10⁻⁷

use crate::joint::near;
use crate::matrix::{Family, Verdict};
use tests::case::{column, run_text};

pub(crate) fn families() -> Vec<Family> {
    let mut family = Family::new("thin layer, one element", "closed form of an elastic layer");
    for decade in 0..=6 {
        for ratio in [4.0 / 3.0 + 1e-6, 1.5, 2.0, 10.0, 1e4, 1e8] {
            let verdict = squeeze(0.1_f64.powi(decade), ratio);
            family.add(format!("L/t = 1e{decade}, K_n/K_t = {ratio}"), verdict);
        }
    }
    vec![family]
}

fn squeeze(t: f64, ratio: f64) -> Verdict {
    // G = 3 MPa.
    let g = 3e3;
    let (k_n, k_t) = (ratio * g / t, g / t);
    let (p, q) = (50.0, 30.0);
    let text = format!(
        r#"
analysis = "plane_strain"
supports = [{{ line = "left", fixed = ["x"] }}, {{ line = "bottom", fixed = ["y"] }}]
[mesh]
columns = [{{ n = 1, to = 1.0 }}]
rows = [{{ n = 1, to = {t:?} }}]
region = [{{ group = "layer" }}]
lines = {{ left = {{ x = 0.0 }}, right = {{ x = 1.0 }}, bottom = {{ y = 0.0 }}, top = {{ y = {t:?} }} }}
[laws.interface]
law = "coulomb_joint"
parameters = {{ normal_stiffness = {k_n:?}, shear_stiffness = {k_t:?}, cohesion = 1e3, friction_angle = 30.0, dilatancy_angle = 0.0 }}
[groups.layer]
formulation = "thin_layer"
law = "interface"
normal = "y"
[[phase]]
name = "squeeze"
increments = 1
pressure = [{{ line = "top", value = {p} }}, {{ line = "right", value = {q} }}]
[probes]
s_11 = {{ group = "layer", quantity = "stress_11", reduce = "max" }}
s_22 = {{ group = "layer", quantity = "stress_22", reduce = "max" }}
right = {{ line = "right", quantity = "displacement_x" }}
top = {{ line = "top", quantity = "displacement_y" }}
"#
    );
    let folder = tempfile::TempDir::new().unwrap();
    if let Err(why) = run_text(&text, folder.path()) {
        return Verdict::Refused(why.to_string());
    }
    let value = |name: &str| {
        *column(&folder.path().join("history.csv"), name)
            .last()
            .unwrap()
    };
    // Plane strain: (σ_11, σ_22) = (M, λ; λ, M) (ε_11, ε_22), M = K_n t, λ = M − 2G.
    let (m, lambda) = (ratio * g, (ratio - 2.0) * g);
    let det = (m - lambda) * (m + lambda);
    let strain = [(-m * q + lambda * p) / det, (-m * p + lambda * q) / det];
    let compare = || {
        near("σ_11", value("s_11"), -q, TOLERANCE * p)?;
        near("σ_22", value("s_22"), -p, TOLERANCE * p)?;
        let size = strain[0].abs().max(strain[1].abs());
        near("u_x", value("right"), strain[0], TOLERANCE * size)?;
        near("u_y", value("top"), strain[1] * t, TOLERANCE * size * t)
    };
    compare().map_or_else(Verdict::Silent, |()| Verdict::Agrees)
}

/// Errors of the stress and the strain.
const TOLERANCE: f64 = 1e-7;
