//! Laws for joints: alone, and in the joint of `cases/chamber_joint`, swapped in by one line.
//!
//! Goal      each follows its closed form on the path that it is for, and carries the pile to its end.
//! Geometry, boundary: cases/joint_laws/README.md, cases/chamber_joint/README.md.
//! Asserts   closed forms at the turns of each path; balance of the loads on the chamber and on the
//!           pile, what is known of the shaft at the end.

use std::f64::consts::PI;
use std::path::Path;
use tempfile::TempDir;
use tests::case::{column, run_case, run_text};
use tests::tolerance::{EQUILIBRIUM, near};

/// What the driver's tolerance leaves of a stress led by a stress.
const DRIVEN: f64 = 1e-8;

/// Columns of the table of a variant of a driver in `cases/joint_laws`.
fn columns<const N: usize>(driver: &str, variant: &str, names: [&str; N]) -> [Vec<f64>; N] {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/joint_laws");
    let folder = TempDir::new().unwrap();
    let csv = folder.path().join("rows.csv");
    tests::driver::run(&path.join(driver), Some(variant), Some(&csv), |report| {
        assert_eq!(report.warnings, Vec::<String>::new());
    })
    .unwrap();
    names.map(|name| column(&csv, name))
}

fn driven(found: f64, expected: f64) {
    near(found / expected, 1.0, DRIVEN);
}

#[test]
fn hyperbolas_are_left_and_met_again() {
    for (variant, sigma) in [("50_kPa", 50.0), ("100_kPa", 100.0), ("200_kPa", 200.0)] {
        let [slip, tau] = columns("hyperbolic.toml", variant, ["jump_t", "traction_t"]);
        let k_i = 2e4 * 9.81 * f64::powf(sigma / 101.325, 0.7);
        let strength = sigma * 33_f64.to_radians().tan();
        let top = 0.6e-3 / (1.0 / k_i + 0.85 * 0.6e-3 / strength);
        driven(tau[60], top);
        driven(slip[90], 0.6e-3 - top / (2.0 * k_i));
        // The strength takes τ_f/(0.15 K_i), less than 3 mm.
        driven(tau[210], strength);
        // Half-way up again the line is left for the hyperbola at the old slip.
        let beyond = slip.iter().skip(90).position(|&u| u > 0.65e-3).unwrap() + 90;
        let u = slip[beyond];
        driven(
            tau[beyond],
            (u / (1.0 / k_i + 0.85 * u / strength)).min(strength),
        );
    }
}

#[test]
fn cycles_take_friction_and_normal_stress() {
    let ends = [
        ("both", 28.0, 1.2),
        ("friction_only", 28.0, 0.0),
        ("contraction_only", 35.0, 1.2),
    ]
    .map(|(variant, residual, angle)| {
        let names = ["plastic_slip", "traction_n", "traction_t"];
        let [xi, normal, tau] = columns("cyclic.toml", variant, names);
        let [residual, peak, rate] = [residual, 35.0, angle].map(|a: f64| a.to_radians().tan());
        let spring = 4e5 * 1e7 / (4e5 + 1e7);
        for turn in 1..=20 {
            let row = 20 * turn;
            let sigma = 100.0 - spring * 0.008 * rate * (1.0 - (-xi[row] / 0.008).exp());
            driven(-normal[row], sigma);
            let mu = residual + (peak - residual) * (-xi[row] / 0.015).exp();
            let sign = if turn % 2 == 1 { 1.0 } else { -1.0 };
            driven(tau[row], sign * mu * sigma);
        }
        -tau[400]
    });
    assert!(ends[0] < ends[1] && ends[0] < ends[2], "{ends:?}");
}

#[test]
fn load_transfer_curves_have_the_corners_of_the_source() {
    for (variant, k) in [("fine", 40e3), ("granular", 16e3)] {
        let names = ["jump_t", "traction_t"];
        let [z, tau] = columns("load_transfer.toml", variant, names);
        let curve = |z: f64| (k * z).min(40.0 + k / 5.0 * (z - 40.0 / k)).min(80.0);
        for row in 1..=50 {
            driven(tau[row], curve(z[row]));
        }
        // Back by q_s/2 along the first slope.
        let back = z
            .iter()
            .skip(50)
            .position(|z| 5e-3 - z >= 40.0 / k)
            .unwrap()
            + 50;
        driven(tau[back], tau[50] - k * (5e-3 - z[back]));
        driven(tau[240], 80.0);
    }
}

/// Mean normal stress (compression positive) and shear stress of the shaft in every row.
struct Shaft {
    sigma: Vec<f64>,
    tau: Vec<f64>,
}

impl Shaft {
    fn last(&self) -> [f64; 2] {
        [&self.sigma, &self.tau].map(|values| *values.last().unwrap())
    }
}

/// Runs the chamber with this law, parameters as in a case file, and checks its balance.
fn shaft(law: &str, parameters: &str) -> Shaft {
    let base = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/chamber_joint/case.toml");
    let text = format!(
        "base = '{}'\n\
         [laws.other]\nlaw = \"{law}\"\nparameters = {{ {parameters} }}\n\
         [[phase]]\nname = \"interface\"\nlaws = {{ interface = \"other\" }}\n\
         [probes]\n\
         r_top = {{ line = \"sand_top\", quantity = \"reaction_z\" }}\n\
         shear = {{ group = \"interface\", quantity = \"traction_t\", reduce = \"integral\" }}\n",
        base.display()
    );
    let folder = TempDir::new().unwrap();
    let case = folder.path().join("case.toml");
    std::fs::write(&case, text).unwrap();
    run_case(&case, folder.path()).unwrap_or_else(|error| panic!("{law}: {error}"));
    let history = |name| column(&folder.path().join("history.csv"), name);
    let [head, toe, top, shear] = ["q_t", "q_p", "r_top", "shear"].map(history);
    assert_eq!(head.len(), 56);
    // 100 kPa press on the plate from below.
    let pressed = 100.0 * PI * 0.262_f64.powi(2);
    for row in 0..head.len() {
        let chamber = pressed - head[row] + top[row];
        assert!(chamber.abs() < EQUILIBRIUM * pressed, "{law}: {chamber}");
        if (1..5).contains(&row) {
            // What the swap changes comes to equilibrium over the five increments of its phase.
            continue;
        }
        let pile = head[row] - toe[row] - shear[row];
        assert!(pile.abs() < EQUILIBRIUM * pressed, "{law}: {pile}");
    }
    Shaft {
        sigma: history("sigma_n_shaft"),
        tau: history("tau_shaft"),
    }
}

#[test]
fn the_hyperbolic_joint_reaches_its_friction() {
    let [sigma, tau] = shaft(
        "hyperbolic_joint",
        "normal_stiffness = 2.29e7, stiffness_number = 5e4, stiffness_exponent = 0.6, \
         failure_ratio = 0.8, adhesion = 0.0, friction_angle = 35.0",
    )
    .last();
    let ratio = tau / sigma / 35_f64.to_radians().tan();
    assert!((ratio - 1.0).abs() < EQUILIBRIUM, "{ratio}");
}

#[test]
fn the_cyclic_joint_loses_normal_stress_and_ends_between_its_frictions() {
    let stiffness = "normal_stiffness = 2.29e7, shear_stiffness = 6.54e6";
    let law = |residual: f64, angle: f64| {
        shaft(
            "cyclic_joint",
            &format!(
                "{stiffness}, peak_friction_angle = 35.0, residual_friction_angle = {residual}, \
                 friction_slip = 0.002, contraction_angle = {angle}, contraction_slip = 0.002"
            ),
        )
    };
    // Without fading it is the Coulomb joint of the case.
    let coulomb = shaft(
        "coulomb_joint",
        &format!("{stiffness}, cohesion = 0.0, friction_angle = 35.0, dilatancy_angle = 0.0"),
    );
    let constant = law(35.0, 0.0);
    for (ours, theirs) in [
        (&constant.sigma, &coulomb.sigma),
        (&constant.tau, &coulomb.tau),
    ] {
        for (ours, theirs) in ours.iter().zip(theirs) {
            assert!((ours - theirs).abs() < 1e-6 * 150.0, "{ours} {theirs}");
        }
    }
    let [sigma, tau] = law(25.0, 0.3).last();
    let [least, most] = [25_f64, 35.0].map(|angle| angle.to_radians().tan());
    assert!(
        tau > least * sigma && tau < most * sigma,
        "{tau} of {sigma}"
    );
    assert!(sigma < 0.9 * constant.last()[0], "{sigma}");
}

#[test]
fn the_load_transfer_curve_reaches_its_limit() {
    let [_, tau] = shaft(
        "tz_curve",
        "pressuremeter_modulus = 20e3, diameter = 0.02, soil = \"granular\", \
         shaft_friction = 80.0, normal_stiffness = 2.29e7",
    )
    .last();
    assert!((tau / 80.0 - 1.0).abs() < EQUILIBRIUM, "{tau}");
}

/// A rigid pile of 10 m in fixed ground. Going down, the head load is that of the curves of shaft and base
/// at the settlement, πD L τ + πD²/4 q. Coming up, it follows Masing's rule and the first slope.
#[test]
fn a_rigid_pile_carries_what_its_load_transfer_curves_have() {
    let text = r#"
title = "pile on load transfer curves"
analysis = "axisymmetric"
supports = [{ line = "axis", fixed = ["r"] }, { line = "far", fixed = ["r", "z"] }, { line = "bottom", fixed = ["r", "z"] }]
[mesh]
origin = [0.0, -11.0]
columns = [{ n = 1, to = 0.3 }, { n = 1, to = 0.6 }]
rows = [{ n = 1, to = -10.0 }, { n = 10, to = 0.0 }]
region = [{ group = "ground" }, { group = "pile", r = [0.0, 0.3], z = [-10.0, 0.0] }]
[mesh.lines]
axis = { r = 0.0 }
far = { r = 0.6 }
bottom = { z = -11.0 }
head = { r = [0.0, 0.3], z = 0.0 }
shaft = { r = 0.3, z = [-10.0, 0.0] }
base = { r = [0.0, 0.3], z = -10.0 }
[laws]
rigid = { law = "elastic", parameters = { young_modulus = 1e13, poisson_ratio = 0.0 } }
[laws.shaft]
law = "tz_curve"
parameters = { pressuremeter_modulus = 12e3, diameter = 0.6, soil = "fine", shaft_friction = 80.0, normal_stiffness = 1e6 }
[laws.base]
law = "qz_curve"
parameters = { pressuremeter_modulus = 12e3, diameter = 0.6, soil = "fine", base_resistance = 2e3, shear_stiffness = 0.0 }
[groups]
ground = { formulation = "solid", law = "rigid" }
pile = { formulation = "solid", law = "rigid" }
shaft = { formulation = "zero_thickness", line = "shaft", law = "shaft" }
base = { formulation = "zero_thickness", line = "base", law = "base" }
[[phase]]
name = "down"
increments = 25
displacement = [{ line = "head", z = -0.05 }]
[[phase]]
name = "up"
increments = 5
displacement = [{ line = "head", z = -0.045 }]
[probes]
load = { line = "head", quantity = "reaction_z", scale = -1.0 }
settlement = { line = "head", quantity = "displacement_z", scale = -1.0 }
"#;
    let folder = TempDir::new().unwrap();
    run_text(text, folder.path()).unwrap_or_else(|error| panic!("{error}"));
    let history = |name| column(&folder.path().join("history.csv"), name);
    let [load, settlement] = ["load", "settlement"].map(history);
    assert_eq!(load.len(), 30);
    let curve =
        |k: f64, s: f64, z: f64| (k * z).min(s / 2.0 + k / 5.0 * (z - s / (2.0 * k))).min(s);
    for (row, (load, w)) in load.iter().zip(&settlement).enumerate() {
        let (tau, q) = if row < 25 {
            (curve(40e3, 80.0, *w), curve(220e3, 2e3, *w))
        } else {
            let back = 0.05 - w;
            let tau = 80.0 - 2.0 * curve(40e3, 80.0, back / 2.0);
            (tau, 2e3 - 220e3 * back)
        };
        let expected = PI * 0.6 * 10.0 * tau + PI * 0.09 * q;
        // What 10 m of a material of 10¹³ kPa give.
        let off = (load - expected).abs();
        assert!(off < 1e-6 * 2100.0, "{row}: {load} {expected}");
    }
}
