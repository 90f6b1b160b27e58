//! Ground at its strength: cylinders, cavities, footings, a pile, a column that is pushed and pulled.

use crate::setup::{Elastic, number, run, run_some};
use std::f64::consts::PI;
use tests::tolerance::EQUILIBRIUM;

#[test]
fn cylinder_mohr_coulomb() {
    let results = run("cylinder_mohr_coulomb");
    let (a, b, young, nu) = (1.0_f64, 2.0_f64, 3e4, 0.3);
    for (variant, phi, bound) in [
        ("associated_n4", 30.0_f64, 2e-3),
        ("associated_n8", 30.0, 5e-4),
        ("associated_n16", 30.0, 2e-4),
        ("not_dilating_n16", 30.0, 2e-4),
        ("tresca_n16", 0.0, 2e-4),
    ] {
        let of = results.of(variant);
        let (sin, cos) = phi.to_radians().sin_cos();
        // σ_1 = n σ_3 + y, compression positive: radial and hoop stress.
        let (n, y) = ((1.0 + sin) / (1.0 - sin), 2.0 * 50.0 * cos / (1.0 - sin));
        // Yielded up to ρ: σ_r at ρ from Lamé outside; inside r σ_r' + σ_r − (σ_r − y)/n = 0.
        let pressure = |rho: f64| {
            let outer = (b / rho).powi(2);
            let at = y * (outer - 1.0) / ((n + 1.0) * outer + n - 1.0);
            if n > 1.0 {
                let shift = y / (n - 1.0);
                (at + shift) * (rho / a).powf(1.0 - 1.0 / n) - shift
            } else {
                at + y * (rho / a).ln()
            }
        };
        // ρ from the outer wall: u_b = 2 D b (1 − ν²)/E, yielding at ρ: D ((n + 1) b²/ρ² + n − 1) = y.
        let radius = |u: f64| {
            let d = u * young / (2.0 * b * (1.0 - nu * nu));
            let outer: f64 = (y / d - (n - 1.0)) / (n + 1.0);
            (b / outer.max(1.0).sqrt()).clamp(a, b)
        };
        let limit = pressure(b);
        let outer = results.history(variant, "outer");
        let pairs = results.history(variant, "pressure").into_iter().zip(outer);
        let partly = pairs.filter(|(_, u)| (a + 1e-9..b - 1e-9).contains(&radius(*u)));
        let worst = partly
            .map(|(p, u)| (p - pressure(radius(u))).abs() / limit)
            .fold(0.0, f64::max);
        // The front of yielding lies inside an element.
        of.within("course", worst, 0.0, 10.0 * bound);
        results.ends_at(variant, "pressure", limit, bound);
    }
}

#[test]
fn cavity_expansion() {
    let results = run("cavity_expansion");
    let (g, c, at_rest, b) = (1000.0, 10.0, 50.0, 30.0_f64);
    // Without volume change u r is the same everywhere: γ = 2 u a/r² is c/G at R² = 2 G u a/c.
    let pressure = |u: f64| {
        let square = (2.0 * g * u / c).max(1.0);
        at_rest + c * (1.0 - square / (b * b)) + c * square.ln()
    };
    for (variant, bound) in [
        ("n16", 4e-3),
        ("n32", 2e-3),
        ("n16_b_bar", 4e-3),
        ("n16_reduced", 4e-3),
    ] {
        let displacements = results.history(variant, "inner");
        let pairs = results
            .history(variant, "pressure")
            .into_iter()
            .zip(displacements);
        // From where three radii yield: the front is inside an element.
        let late = pairs.filter(|(_, u)| *u > 0.02);
        let worst = late.map(|(p, u)| (p - pressure(u)).abs() / (pressure(u) - at_rest));
        results.within(variant, worst.fold(0.0, f64::max), 0.0, bound);
    }
    // All Gauss points lock.
    let exact = pressure(0.05) - at_rest;
    let full = results.last("n16_full", "pressure") - at_rest;
    results.within("n16_full", full / exact - 1.0, 0.5, 2.0);
}

fn n_q(phi: f64) -> f64 {
    let phi = phi.to_radians();
    (PI / 4.0 + phi / 2.0).tan().powi(2) * (PI * phi.tan()).exp()
}

fn n_c(phi: f64) -> f64 {
    (n_q(phi) - 1.0) / phi.to_radians().tan()
}

#[test]
fn strip_on_tresca() {
    let variants = ["n4", "n8", "n8_coarse_steps"];
    let results = run_some("strip_on_tresca", &variants);
    // Elements of displacements are stiffer than the ground, at the edge above all.
    for (variant, bound) in variants.into_iter().zip([0.07, 0.02, 0.02]) {
        let of = results.of(variant);
        let error = of.last("pressure") / (2.0 + PI) - 1.0;
        results.within(variant, error, 0.0, bound);
    }
}

#[test]
fn circular_footing() {
    let variants = ["smooth_n6", "smooth_n12", "rough_n6", "rough_n12"];
    let results = run_some("circular_footing", &variants);
    // Cox, Eason & Hopkins 1961; Eason & Shield 1960.
    for (variant, exact, bound) in [
        ("smooth_n6", 5.69, 0.11),
        ("smooth_n12", 5.69, 0.03),
        ("rough_n6", 6.05, 0.14),
        ("rough_n12", 6.05, 0.03),
    ] {
        let of = results.of(variant);
        results.within(variant, of.last("pressure") / exact - 1.0, 0.0, bound);
    }
}

#[test]
fn strip_on_friction() {
    let variants = ["n_c_30_n4", "n_c_30", "n_c_20", "n_q_30"];
    let results = run_some("strip_on_friction", &variants);
    for (variant, exact, bound) in [
        ("n_c_30_n4", n_c(30.0), 0.09),
        ("n_c_30", n_c(30.0), 0.03),
        ("n_c_20", n_c(20.0), 0.03),
        ("n_q_30", n_q(30.0), 0.03),
    ] {
        let of = results.of(variant);
        results.within(variant, of.last("pressure") / exact - 1.0, 0.0, bound);
    }
}

#[test]
fn strip_n_gamma() {
    let variants = ["rough_n4", "rough_n8", "smooth_n8"];
    let results = run_some("strip_n_gamma", &variants);
    // Martin 2005, by characteristics. The strength under the edge grows from zero: the slowest to converge.
    for (variant, exact, bound) in [
        ("rough_n4", 14.754, 0.25),
        ("rough_n8", 14.754, 0.08),
        ("smooth_n8", 7.653, 0.05),
    ] {
        let of = results.of(variant);
        results.within(variant, of.last("pressure") / exact - 1.0, 0.0, bound);
    }
}

#[test]
fn pile_in_clay() {
    let results = run("pile_in_clay");
    let end = |probe| results.last("", probe);
    let shaft = 0.8 * 40.0 * PI * 1.0 * 8.0;
    results.near("shaft", end("shaft"), shaft, shaft, EQUILIBRIUM);
    let area = PI * 0.25;
    let weight = 16.0 * 8.0 * area;
    let (head, base) = (end("head"), end("base"));
    // The axis' node has no area, and rows are in equilibrium within the solver's tolerance.
    results.near("balance", head + weight, end("shaft") + base, 1e3, 1e-6);
    // 9 c_u is a convention: Skempton's bounds of N_c at depth are 9 and 9.5 … 10 of rough cylinders.
    let factor = (base - weight) / (area * 40.0);
    results.within("N_c against 9, at 0.3 D", factor / 9.0 - 1.0, -0.02, 0.12);
    let history = results.rows("", "history.csv");
    let early = history
        .iter()
        .find(|row| number(row, "settlement") > 0.0999)
        .unwrap();
    let textbook = shaft + 9.0 * 40.0 * area;
    results.near(
        "head against 1 087 kN, at 0.1 D",
        number(early, "head"),
        textbook,
        textbook,
        0.06,
    );
}

#[test]
fn pile_in_sand() {
    let results = run_some("pile_in_sand", &["first_centimetre"]);
    let end = |probe| results.last("first_centimetre", probe);
    let weight = 18.0 * 8.0 * PI * 0.25;
    results.near(
        "balance",
        end("head") + weight,
        end("shaft") + end("base"),
        1e3,
        1e-6,
    );
    // No more friction than tan 25° of the stress on the shaft, and nearly all of it slides.
    let mobilised = end("shaft") / (end("normal") * 25.0_f64.to_radians().tan());
    results.within("mobilised friction", mobilised - 1.0, -0.1, 1e-9);
}

#[test]
fn course_of_loading() {
    let results = run("course_of_loading");
    let ground = Elastic {
        young: 1e4,
        poisson: 0.3,
    };
    // Free sides, no strain out of the plane, where the stress is the middle one: a spring with a slider at 2c.
    let modulus = ground.young / (1.0 - ground.poisson.powi(2));
    let (limit, height) = (40.0, 2.0);
    let (mut stress, mut before, mut worst) = (0.0_f64, 0.0, 0.0_f64);
    let forces = results.history("", "force");
    let mut course = Vec::new();
    for (w, force) in results.history("", "settlement").into_iter().zip(forces) {
        stress = (stress + modulus * (w - before) / height).clamp(-limit, limit);
        before = w;
        course.push(w);
        worst = worst.max((force - stress).abs() / limit);
    }
    results.within("force", worst, 0.0, EQUILIBRIUM);
    // The course itself: 1 at 0.3, −0.4 at 0.7, 0.9 at the end.
    for (increment, factor) in [(12, 1.0), (28, -0.4), (40, 0.9)] {
        results.near("course", course[increment - 1], 0.02 * factor, 0.02, 1e-12);
    }
}
