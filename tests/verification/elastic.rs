//! Elastic ground: cylinders, spheres, plates, loads on half spaces, piles, moduli that vary.

use crate::setup::{Elastic, number, run};
use std::f64::consts::PI;
use tests::tolerance::{EQUILIBRIUM, ROUND_OFF, near};

#[test]
fn thick_cylinder() {
    let (a, b, p) = (1.0_f64, 2.0_f64, 100.0);
    let c = p * a * a / (b * b - a * a);
    let quads = run("thick_cylinder");
    let triangles = run("thick_cylinder/triangles.toml");
    for (results, of, variant, nu, bounds) in [
        // Nodes of the reduced quads are exact here; with ν = 0.4999 round-off is 1/(1 − 2ν) times as large.
        (&quads, "quads", "nu_0.3_n2", 0.3, [1e-11, 0.05]),
        (&quads, "quads", "nu_0.3_n4", 0.3, [1e-11, 0.02]),
        (&quads, "quads", "nu_0.3_n8", 0.3, [1e-11, 0.005]),
        (&quads, "quads", "nu_0.4999_n2", 0.4999, [1e-5, 0.05]),
        (&quads, "quads", "nu_0.4999_n4", 0.4999, [1e-5, 0.02]),
        (&quads, "quads", "nu_0.4999_n8", 0.4999, [1e-5, 0.005]),
        (&triangles, "triangles", "nu_0.3", 0.3, [1e-4, 0.05]),
        (&triangles, "triangles", "nu_0.4999", 0.4999, [1e-3, 0.5]),
    ] {
        let ground = Elastic {
            young: 3e4,
            poisson: nu,
        };
        let u = |r: f64| c * (1.0 + nu) / ground.young * ((1.0 - 2.0 * nu) * r + b * b / r);
        for (wall, r) in [("inner", a), ("outer", b)] {
            results.ends_at(variant, wall, u(r), bounds[0]);
        }
        let rows = results.rows(variant, "points.csv");
        let errors = rows.iter().map(|row| {
            let ratio = (b / number(row, "x")).powi(2);
            let radial = number(row, "stress_11") - c * (1.0 - ratio);
            let hoop = number(row, "stress_33") - c * (1.0 + ratio);
            radial.abs().max(hoop.abs()) / p
        });
        results.within(
            &format!("{of}, {variant}, stress"),
            errors.fold(0.0, f64::max),
            0.0,
            bounds[1],
        );
    }
}

#[test]
fn thick_sphere() {
    let results = run("thick_sphere");
    let (a, b, p, young) = (1.0_f64, 2.0_f64, 100.0, 3e4);
    for (mesh, bound) in [
        ("quads_2", 0.003),
        ("quads_4", 2e-4),
        ("quads_8", 2e-5),
        ("triangles_4", 0.015),
        ("triangles_8", 0.005),
    ] {
        for nu in [0.3, 0.4999] {
            let scale = p * a.powi(3) / (young * (b.powi(3) - a.powi(3)));
            let u =
                |r: f64| scale * ((1.0 - 2.0 * nu) * r + (1.0 + nu) * b.powi(3) / (2.0 * r * r));
            let variant = format!("{mesh}_nu_{nu}");
            for (wall, r) in [("inner", a), ("outer", b)] {
                let value = results.last(&variant, wall);
                results.of(&variant).near(wall, value, u(r), u(r), bound);
            }
        }
    }
}

#[test]
fn circular_plate() {
    let results = run("circular_plate");
    let plate = Elastic {
        young: 2e8,
        poisson: 0.3,
    };
    let (a, h, q) = (1.0_f64, 0.02_f64, 10.0);
    let stiffness = plate.young * h.powi(3) / (12.0 * (1.0 - plate.poisson.powi(2)));
    // Kirchhoff; the plate's shear adds q a²/(4 κ G h), κ = 5/6: 0.2 %.
    let exact =
        q * a.powi(4) / (64.0 * stiffness) + q * a * a / (4.0 * 5.0 / 6.0 * plate.shear() * h);
    for (variant, bound) in [
        ("n4", 3e-3),
        ("n8", 2e-3),
        ("n16", 2e-3),
        ("n8_full", 1.2e-2),
    ] {
        results.ends_at(variant, "deflection", exact, bound);
    }
}

#[test]
fn rigid_disc() {
    let results = run("rigid_disc");
    let (radius, w) = (1.0, 0.01);
    // The ground ends at 200 radii: it is stiffer by about R/200; the stress at the edge is singular.
    for (variant, young, nu, bound) in [
        ("coarse", 2.6e4, 0.3, 0.012),
        ("fine", 2.6e4, 0.3, 0.008),
        ("nearly_incompressible", 2.9998e4, 0.4999, 0.012),
    ] {
        let of = results.of(variant);
        let ground = Elastic { young, poisson: nu };
        let exact = 4.0 * ground.shear() * radius * w / (1.0 - nu);
        results.within(variant, of.last("force") / exact - 1.0, 0.0, bound);
    }
    // Bonded to the ground (Spence 1968): Q = 4 G R w ln(3 − 4ν)/(1 − 2ν).
    let (ground, nu) = (
        Elastic {
            young: 2.6e4,
            poisson: 0.3,
        },
        0.3_f64,
    );
    let force = 4.0 * ground.shear() * radius * w / (1.0 - nu);
    let settlement =
        force / (4.0 * ground.shear() * radius) * (1.0 - 2.0 * nu) / (3.0 - 4.0 * nu).ln();
    results.ends_at("bonded", "force", force, EQUILIBRIUM);
    results.ends_at("bonded", "w", settlement, 0.01);
}

#[test]
fn flexible_disc() {
    let results = run("flexible_disc");
    let (q, a, young, nu) = (100.0, 1.0_f64, 2.6e4, 0.3_f64);
    let centre = 2.0 * q * a * (1.0 - nu * nu) / young;
    let edge = centre * 2.0 / PI;
    for (variant, bound, of_stress) in [("coarse", 0.02, 0.15), ("fine", 0.007, 0.01)] {
        let of = results.of(variant);
        // The ground ends at 200 radii: both settle less by about q π a² (1 − ν²)/(π E 200 a), 0.25 % of the centre's.
        results.ends_at(variant, "centre", centre, bound);
        results.ends_at(variant, "edge", edge, bound);
        let difference = of.last("centre") - of.last("edge");
        of.near(
            "difference",
            difference,
            centre - edge,
            centre - edge,
            bound,
        );
        // Below the middle, where what the points are beside the axis counts for little.
        let rows = results.rows(variant, "points.csv");
        let near = rows.iter().filter(|row| {
            variant == "fine" && number(row, "x") < 0.1 && (-6.0..-0.5).contains(&number(row, "y"))
        });
        let errors = near.map(|row| {
            let depth = -number(row, "y");
            let exact = -q * (1.0 - (1.0 + (a / depth).powi(2)).powf(-1.5));
            (number(row, "stress_22") - exact).abs() / q
        });
        of.within("stress", errors.fold(0.0, f64::max), 0.0, of_stress);
    }
}

#[test]
fn pile_in_half_space() {
    let results = run("pile_in_half_space");
    let (r, shear, ratio, force) = (0.5, 1e4, 1000.0, 1000.0);
    // Randolph & Wroth 1978, homogeneous ground.
    let stiffness = |slender: f64, nu: f64| {
        let zeta = (2.5 * (1.0 - nu) * slender).ln();
        let mu = (2.0 / (zeta * ratio)).sqrt() * slender;
        let base = 4.0 / (1.0 - nu);
        let shaft = mu.tanh() / mu * slender;
        (base + 2.0 * PI * shaft / zeta) / (1.0 + base * shaft / (PI * ratio))
    };
    // Figures quoted from the paper by others.
    for (slender, nu, quoted) in [(14.6, 0.5, 36.84), (14.6, 0.3, 32.04), (40.0, 0.3, 50.48)] {
        near(stiffness(slender, nu), quoted, 0.02);
    }
    // The formula is an approximation, within 10 % of elements by its authors.
    for (variant, slender, nu) in [
        ("nu_0.3_short", 14.6, 0.3),
        ("nu_0.3_short_fine", 14.6, 0.3),
        ("nu_0.5_short", 14.6, 0.5),
        ("nu_0.3_long", 40.0, 0.3),
    ] {
        let of = results.of(variant);
        let exact = stiffness(slender, nu);
        let value = force / (of.last("settlement") * shear * r);
        results.near(variant, value, exact, exact, 0.1);
    }
    let [coarse, fine] =
        ["nu_0.3_short", "nu_0.3_short_fine"].map(|v| results.last(v, "settlement"));
    results.near("mesh", coarse, fine, fine, 3e-3);
}

#[test]
fn gibson_column() {
    let results = run("gibson_column");
    let (q, depth, top, growth, nu) = (100.0_f64, 10.0, 1e3_f64, 2e3_f64, 0.25);
    // E_oed = E (1 − ν)/((1 + ν)(1 − 2ν)); ∫ q/E_oed over the depth.
    let oedometric = (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
    let exact = q / (oedometric * growth) * ((top + growth * depth) / top).ln();
    let mut errors = Vec::new();
    // A modulus for each element: of second order in their height.
    for (variant, bound) in [
        ("n10", 0.045),
        ("n20", 0.02),
        ("n40", 0.008),
        ("n80", 0.003),
    ] {
        let of = results.of(variant);
        let error = of.last("settlement") / exact - 1.0;
        results.within(variant, error, -bound, 0.0);
        errors.push(error);
    }
    assert!(errors[2] / errors[3] > 3.3, "{errors:?}");
}

#[test]
fn gibson_strip() {
    let results = run("gibson_strip");
    let exact = 100.0 / (2.0 * 1000.0);
    // The ground ends at 40 half-widths and is not quite incompressible; a modulus for each element.
    for (variant, bound) in [("coarse", 0.13), ("fine", 0.07), ("finer", 0.05)] {
        results.ends_at(variant, "centre", exact, bound);
        results.ends_at(variant, "mean", exact, bound);
    }
}

#[test]
fn rigid_line() {
    let results = run("rigid_line");
    // ν = 0: two columns side by side under one settlement, w = F H/(E₁A₁ + E₂A₂).
    let (height, soft, hard) = (3.0, 1e4 * 1.0, 4e4 * 2.0);
    for (phase, force) in [("push", 300.0), ("pull", -150.0)] {
        let end = |probe| results.end("", phase, probe);
        let w = force * height / (soft + hard);
        results.near(
            &format!("{phase}, settlement"),
            end("settlement"),
            w,
            0.01,
            10.0 * ROUND_OFF,
        );
        for (probe, share) in [("soft", soft), ("hard", hard)] {
            let exact = force * share / (soft + hard);
            results.near(
                &format!("{phase}, {probe}"),
                end(probe),
                exact,
                300.0,
                10.0 * ROUND_OFF,
            );
        }
    }
}
