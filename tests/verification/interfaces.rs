//! Interfaces: joints in blocks and along curves, bars, a slice of a pile, a crack.

use crate::setup::{Elastic, cases, number, pilum, run};
use std::f64::consts::PI;
use tests::case::column;
use tests::tolerance::{EQUILIBRIUM, ROUND_OFF};
use tests::words::has;
use tests::words::words;

#[test]
fn joint_at_30_degrees() {
    let results = run("joint_at_30_degrees");
    // The block and the joint in series: E over 1 m (ν = 0), K_n.
    let stiffness = 1.0 / (1.0 / 3e7 + 1.0 / 1e9);
    let closed = -1.4e-5 * stiffness;
    for variant in ["quads", "triangles", "torn"] {
        let of = results.of(variant);
        let normal = |phase| of.end(phase, "normal");
        let pulled = if variant == "torn" {
            0.0
        } else {
            4e-6 * stiffness
        };
        // Displacements of 1e-5 m are totals of coordinates of 1 m: differences lose no digit in a linear law.
        of.near("close", normal("close"), closed, 406.0, 1e-11);
        of.near("pull", normal("pull"), pulled, 406.0, 1e-11);
        of.near("close again", normal("close_again"), closed, 406.0, 1e-11);
        // The whole joint slides: c A + N tan φ, c lost once it was torn.
        let adhesion = if variant == "torn" { 0.0 } else { 100.0 };
        for (phase, sign) in [("shear", 1.0), ("shear_back", -1.0)] {
            let exact = sign * (adhesion - 0.5 * normal(phase));
            let shear = of.end(phase, "shear");
            of.near(phase, shear, exact, 300.0, EQUILIBRIUM);
            of.near(
                &format!("{phase}, normal"),
                normal(phase),
                closed,
                406.0,
                EQUILIBRIUM,
            );
        }
    }
}

#[test]
fn oblique_interface() {
    let results = run("oblique_interface");
    let block = Elastic {
        young: 1e5,
        poisson: 0.3,
    };
    let (p, q) = (60.0, 40.0);
    // n = (−1, 1)/√2 into the upper block, t = (1, 1)/√2.
    let (normal, shear) = (-(p + q) / 2.0, (q - p) / 2.0);
    for variant in ["quads", "triangles", "stiff", "dilating"] {
        let of = results.of(variant);
        let (k_n, k_t) = if variant == "stiff" {
            (1e9, 1e9)
        } else {
            (2e5, 1e5)
        };
        let jump = [
            (shear / k_t - normal / k_n) / 2.0_f64.sqrt(),
            (shear / k_t + normal / k_n) / 2.0_f64.sqrt(),
        ];
        let exact = [
            0.5 * block.plane_strain(-q, -p) + jump[0],
            3.0 * block.plane_strain(-p, -q) + jump[1],
        ];
        let end = |probe| of.end("press", probe);
        // 1e9 against 1e5: four digits of the displacements are lost to the joint.
        let bound = if variant == "stiff" { 1e-8 } else { 1e-11 };
        of.near("u_x", end("u_x"), exact[0], exact[1].abs(), bound);
        of.near("u_y", end("u_y"), exact[1], exact[1].abs(), bound);
        of.near("traction n", end("traction_n"), normal, 50.0, bound);
        of.near("traction t", end("traction_t").abs(), -shear, 50.0, bound);
        // Sliding: (p − q)/2 = c + (p + q)/2 tan φ, whatever the dilatancy.
        let (c, tan) = (5.0, 20.0_f64.to_radians().tan());
        let limit = (2.0 * c + q * (1.0 + tan)) / (1.0 - tan);
        results.ends_at(variant, "force", limit, EQUILIBRIUM);
    }
}

#[test]
fn bar_in_hollow_cylinder() {
    let results = run("bar_in_hollow_cylinder");
    let (a, b, length) = (0.05, 0.5_f64, 0.1);
    let ground = Elastic {
        young: 1e4,
        poisson: 0.25,
    };
    let strength = 5.0 + 100.0 * 20.0_f64.to_radians().tan();
    let compliance = 1.0 / 5e4 + a / ground.shear() * (b / a).ln();
    // ln r in quadratic elements; the whole curve, elastic and sliding.
    for (variant, bound) in [("n2", 6e-3), ("n4", 6e-4), ("n8", 6e-5)] {
        let of = results.of(variant);
        let worst = results
            .history(variant, "u")
            .iter()
            .zip(results.history(variant, "force"))
            .map(|(u, force)| force / (2.0 * PI * a * length) - (u / compliance).min(strength))
            .map(|difference| (difference / strength).abs())
            .fold(0.0, f64::max);
        results.within(variant, worst, 0.0, bound);
        let last = of.last("tau").abs();
        of.near("sliding", last, strength, strength, EQUILIBRIUM);
    }
}

#[test]
fn pile_slice() {
    let results = run("pile_slice");
    let (a, b) = (0.25, 2.5);
    let ground = Elastic {
        young: 3e4,
        poisson: 0.3,
    };
    let (shear, lambda) = (ground.shear(), ground.oedometric() - 2.0 * ground.shear());
    let k_n = 2.0 * (lambda + shear + shear * b * b / (a * a)) * a / (b * b - a * a);
    let (joint_n, joint_t, c) = (1e6, 1e5, 5.0);
    let (tan_phi, tan_psi) = (25.0_f64.to_radians().tan(), 5.0_f64.to_radians().tan());
    // Compression σ rises by the opening tan ψ ξ over both springs in series.
    let rise = tan_psi / (1.0 / k_n + 1.0 / joint_n);
    let first = (c + 100.0 * tan_phi) / joint_t;
    for (variant, bound) in [("joint", 1e-3), ("joint_coarse", 1e-3)] {
        let rows = results.rows(variant, "history.csv");
        let worst = rows.iter().map(|row| {
            let slip = number(row, "u").abs();
            let plastic = (slip - first).max(0.0) / (1.0 + rise * tan_phi / joint_t);
            let sigma = 100.0 + rise * plastic;
            let tau = if plastic > 0.0 {
                c + sigma * tan_phi
            } else {
                joint_t * slip
            };
            let errors = [
                number(row, "sigma").abs() / sigma - 1.0,
                (number(row, "tau").abs() - tau) / 67.0,
            ];
            errors[0].abs().max(errors[1].abs())
        });
        // The slice is 10 mm high, held at its faces: at mid-height the ground gives way by τ h/G, 1e-3 of the slip.
        results.within(variant, worst.fold(0.0, f64::max), 0.0, bound);
    }
    // MEPI: the same law at one point, led by the same slips across the same spring.
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("point.csv");
    let driver = cases().join("pile_slice/point.toml");
    let text = std::fs::read_to_string(&driver).unwrap();
    has(&text, format!("stiffness = {k_n:.6}"));
    pilum(&[
        "point",
        driver.to_str().unwrap(),
        "--csv",
        csv.to_str().unwrap(),
    ]);
    for (probe, traction) in [("tau", "traction_t"), ("sigma", "traction_n")] {
        let mut point = column(&csv, traction);
        let slice = results.history("mepi", probe);
        if point.len() == slice.len() + 1 {
            point.remove(0);
        }
        assert_eq!(point.len(), slice.len());
        let worst = point
            .iter()
            .zip(slice)
            .map(|(p, s)| (p.abs() - s.abs()).abs());
        // As above, of the initial stress of 100 kPa.
        results.within(
            &format!("mepi, {probe}"),
            worst.fold(0.0, f64::max) / 100.0,
            0.0,
            2e-3,
        );
    }
}

#[test]
fn bar_pull_out() {
    let results = run("bar_pull_out");
    let (a, length, young, k, tau) = (0.0125, 1.0, 200e6, 2e5, 500.0);
    let section = PI * a * a * young;
    let beta = (2.0 * PI * a * k / section).sqrt();
    let force = |u: f64| {
        // Plastic length x from u = τ/k (1 + β x tanh β(L − x) + β² x²/2), by bisection.
        let displacement = |x: f64| {
            tau / k * (1.0 + beta * x * (beta * (length - x)).tanh() + (beta * x).powi(2) / 2.0)
        };
        if u <= tau / k {
            return section * beta * u * (beta * length).tanh();
        }
        let (mut low, mut high) = (0.0, length);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if displacement(middle) < u {
                low = middle;
            } else {
                high = middle;
            }
        }
        2.0 * PI * a * tau * (low + (beta * (length - low)).tanh() / beta)
    };
    // The table of the problem's source.
    for (u, source) in [(2.5e-3, 37.3014), (2.648_69e-3, 39.0122), (2.7e-3, 39.2699)] {
        assert!((force(u) - source).abs() < 1e-3, "{}", force(u));
    }
    for (variant, bound) in [("n10", 5e-5), ("n20", 2e-5), ("n40", 1e-5)] {
        let forces = results.history(variant, "force");
        let worst = results.history(variant, "u").into_iter().zip(forces);
        let worst = worst.map(|(u, f)| (f / force(u) - 1.0).abs());
        results.within(variant, worst.fold(0.0, f64::max), 0.0, bound);
    }
}

#[test]
fn curved_interface() {
    let results = run("curved_interface");
    let ring = Elastic {
        young: 3e4,
        poisson: 0.3,
    };
    let (a, m, b, p, k_n) = (1.0, 1.5, 2.0, 100.0, 1e5);
    // Lamé: displacement at r of a ring from a to b under pressures p inside, q outside.
    let displacement = |a: f64, b: f64, p: f64, q: f64, r: f64| {
        let (nu, area) = (ring.poisson, b * b - a * a);
        (1.0 + nu) / ring.young
            * ((1.0 - 2.0 * nu) * (p * a * a - q * b * b) / area * r
                + (p - q) * a * a * b * b / (area * r))
    };
    // Linear in the pressure q between the rings: opening = −q/K_n.
    let gap = |q: f64| displacement(m, b, q, 0.0, m) - displacement(a, m, p, q, m) + q / k_n;
    let q = -gap(0.0) / (gap(1.0) - gap(0.0));
    let (inner, outer) = (displacement(a, m, p, q, a), displacement(m, b, q, 0.0, b));
    // A side of `quads_2` turns by 45°, of `quads_4` by 22.5°.
    for (variant, bound, of_traction) in [
        ("quads_2", 1e-3, 0.005),
        ("quads_4", 1e-4, 5e-4),
        ("quads_2_full", 0.01, 0.01),
        ("quads_4_full", 0.001, 0.001),
        ("triangles_2", 0.08, 0.6),
        ("triangles_4", 0.02, 0.2),
    ] {
        let of = results.of(variant);
        results.ends_at(variant, "inner", inner, bound);
        results.ends_at(variant, "outer", outer, bound);
        for probe in ["sigma_min", "sigma_max"] {
            of.near(probe, -of.last(probe), q, q, of_traction);
        }
        // Axes at the nodes are those of the circle.
        for probe in ["tau_min", "tau_max"] {
            if variant.starts_with("quads") {
                let shear = of.last(probe);
                of.near(probe, shear, 0.0, q, 1e-12);
            }
        }
    }
}

#[test]
fn activated_interface() {
    let results = run("activated_interface");
    for variant in ["quads", "triangles", "wave"] {
        let of = results.of(variant);
        for probe in ["u_x", "u_y"] {
            // Against 1 mm under the pressures.
            of.near(probe, of.last(probe), 0.0, 1e-3, ROUND_OFF);
        }
        let rows = results.rows(variant, "profile.csv");
        let mut points = 0;
        let mut worst = 0.0_f64;
        for row in rows.iter().filter(|row| row["phase"] == "activate") {
            let (n, t) = (number(row, "traction_n"), number(row, "traction_t"));
            // Mohr's circle of 40 and 60 kPa, whatever the direction; at 45° its top.
            worst = worst.max(((n + 50.0).hypot(t) - 10.0).abs() / 50.0);
            if variant != "wave" {
                worst = worst.max((n + 50.0).abs() / 50.0);
            }
            points += 1;
        }
        assert!(points >= 6, "{points} points");
        of.within("traction", worst, 0.0, 1e-11);
    }
}

/// In level ground at rest tractions are the projected stress, on sides of any direction, at corners and along an arc,
/// and nothing moves.
#[test]
fn activated_interfaces_of_a_pile() {
    let results = run("activated_interface/pile.toml");
    for variant in words("quads triangles quads_plane triangles_plane water") {
        let of = results.of(variant);
        let phase = &results.summary(variant)["phases"][1];
        let share = phase["out_of_balance"].as_f64().unwrap();
        of.within("out of balance", share, 0.0, 1e-12);
        of.near("head", of.last("head"), 0.0, 1e-3, 1e-8);
        let rows = results.rows(variant, "profile.csv");
        // Upright, inclined, round.
        let (mut points, mut worst) = ([0; 3], [0.0_f64; 3]);
        for row in rows.iter().filter(|row| row["phase"] == "activate") {
            let [x, y, n, t] =
                ["x", "y", "traction_n", "traction_t"].map(|column| number(row, column));
            let of_element = rows.iter().filter(|other| {
                ["phase", "group", "element"]
                    .iter()
                    .all(|key| row[*key] == other[*key])
            });
            let lowest = of_element.map(|row| number(row, "y"));
            let (part, normal) = match &*row["group"] {
                "shaft" if lowest.fold(0.0, f64::min) > -4.1 => (0, [1.0, 0.0]),
                "shaft" => (1, [2.0, -0.1]),
                // The arc's centre is at −5.7 m.
                _ => (2, [x, y + 5.7]),
            };
            let under_water = if variant == "water" {
                (-2.0 - y).max(0.0)
            } else {
                0.0
            };
            let vertical = 18.0 * y - (20.0 - 18.0 - 9.81) * under_water;
            let [c, s] = normal.map(|component| component / normal[0].hypot(normal[1]));
            let exact = [
                vertical * (0.5 * c * c + s * s),
                // The sign follows the axes.
                (0.5 * vertical * c * s).abs(),
            ];
            let error = (n - exact[0]).abs().max((t.abs() - exact[1]).abs());
            points[part] += 1;
            worst[part] = worst[part].max(error / exact[0].abs().max(1.0));
        }
        assert_eq!(points, [12, 6, 9], "{variant}");
        for (part, worst, bound) in [
            ("upright", worst[0], 1e-11),
            ("inclined", worst[1], 1e-11),
            ("round", worst[2], 2e-4),
        ] {
            of.within(part, worst, 0.0, bound);
        }
    }
}

#[test]
fn closed_crack() {
    let results = run("closed_crack");
    let (young, nu, half) = (25e6, 0.2, 1.0_f64);
    let (sin, cos) = 30.0_f64.to_radians().sin_cos();
    let driving = 100.0 * sin * (cos - sin * 20.0_f64.to_radians().tan());
    let most = 4.0 * (1.0 - nu * nu) * driving * half / young;
    // Next to the tips, where the slip grows as a root, and in the middle; the square ends at 40 half-lengths.
    for (variant, bound, of_middle) in [("coarse", 0.1, 0.03), ("fine", 0.06, 0.01)] {
        let of = results.of(variant);
        let rows = results.rows(variant, "profile.csv");
        let middle = rows
            .iter()
            .find(|row| number(row, "x").abs() < 1e-9)
            .unwrap();
        let slip = number(middle, "jump_t").abs();
        of.near("middle", slip, most, most, of_middle);
        let errors = rows.iter().map(|row| {
            let exact = most * (half - number(row, "x").powi(2)).max(0.0).sqrt();
            (number(row, "jump_t").abs() - exact).abs() / most
        });
        results.within(variant, errors.fold(0.0, f64::max), 0.0, bound);
    }
}
