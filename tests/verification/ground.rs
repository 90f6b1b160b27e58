//! Weight, water, stress at rest, what comes and goes.

use crate::setup::{Elastic, number, run};
use tests::tolerance::ROUND_OFF;

const WATER: f64 = 9.81;

/// A value over the height.
type Of = fn(f64) -> f64;

#[test]
fn layers_with_water() {
    let results = run("layers_with_water");
    // Bottom of each layer with its weights above and below the water, and K_0.
    let layers = [
        ("sand", 0.0, -3.0, 17.0, 20.0, 0.45),
        ("clay", -3.0, -8.0, 16.0, 18.5, 0.6),
        ("gravel", -8.0, -12.0, 19.0, 21.0, 0.4),
    ];
    let level = -2.0_f64;
    let effective = |z: f64| {
        let above = layers.iter().map(|&(_, top, bottom, dry, wet, _)| {
            let dry_part = (top - z.max(bottom).max(level).min(top)).max(0.0);
            let wet_part = (top.min(level) - z.max(bottom)).max(0.0);
            dry * dry_part + wet * wet_part
        });
        above.sum::<f64>() - WATER * (level - z).max(0.0)
    };
    for variant in ["quads", "plane"] {
        let of = results.of(variant);
        // Against the settlement that the weight would cause, some 2 cm.
        of.near("u_y", of.last("u_y"), 0.0, 0.02, ROUND_OFF);
        let rows = results.rows(variant, "points.csv");
        let errors = rows.iter().map(|row| {
            let layer = layers.iter().find(|layer| layer.0 == row["group"]).unwrap();
            let vertical = -effective(number(row, "y"));
            let errors = [("22", 1.0), ("11", layer.5), ("33", layer.5), ("12", 0.0)].map(
                |(component, ratio)| number(row, &format!("stress_{component}")) - ratio * vertical,
            );
            errors.into_iter().map(f64::abs).fold(0.0, f64::max)
        });
        // Of the 140 kPa at the bottom.
        of.within(
            "stress",
            errors.fold(0.0, f64::max) / 140.0,
            0.0,
            10.0 * ROUND_OFF,
        );
    }
    let weight = 6.0 * (-WATER * level.mul_add(-1.0, -12.0) + effective(-12.0));
    results.ends_at("plane", "weight", weight, 10.0 * ROUND_OFF);
}

#[test]
fn earth_pressure_at_rest() {
    let results = run("earth_pressure_at_rest");
    let k_nc = 1.0 - 30.0_f64.to_radians().sin();
    let one: Of = |_| 1.0;
    // OCR over the height, POP, ν of unloading, surcharge.
    let histories: [(&str, Of, f64, f64, f64); 5] = [
        ("normally_consolidated", one, 0.0, 0.0, 0.0),
        ("ocr", |_| 2.5, 0.0, 0.2, 0.0),
        ("ocr_over_depth", |z| 1.0 + 0.3 * (z + 10.0), 0.0, 0.2, 0.0),
        ("pop", one, 50.0, 0.25, 0.0),
        ("surcharge", one, 0.0, 0.0, 40.0),
    ];
    for (variant, ocr, pop, nu, surcharge) in histories {
        let of = results.of(variant);
        of.near("u_y", of.last("u_y"), 0.0, 0.02, ROUND_OFF);
        let rows = results.rows(variant, "points.csv");
        let errors = rows.iter().map(|row| {
            let z = number(row, "y");
            let vertical = 18.0 * -z + surcharge;
            let unloaded = (ocr(z) - 1.0) * vertical + pop;
            let horizontal = k_nc * (ocr(z) * vertical + pop) - nu / (1.0 - nu) * unloaded;
            let errors = [("22", vertical), ("11", horizontal), ("33", horizontal)]
                .map(|(component, exact)| number(row, &format!("stress_{component}")) + exact);
            errors.into_iter().map(f64::abs).fold(0.0, f64::max)
        });
        of.within(
            "stress",
            errors.fold(0.0, f64::max) / 180.0,
            0.0,
            10.0 * ROUND_OFF,
        );
    }
}

#[test]
fn excavation() {
    let results = run("excavation");
    let ground = Elastic {
        young: 2e4,
        poisson: 0.3,
    };
    let heave = 18.0 * 4.0 * 6.0 / ground.oedometric();
    let end = |phase, probe| results.end("", phase, probe);
    results.near("heave", end("dig", "heave"), heave, heave, 10.0 * ROUND_OFF);
    results.near(
        "weight left",
        end("dig", "reaction"),
        2.0 * 18.0 * 6.0,
        216.0,
        10.0 * ROUND_OFF,
    );
    // The weight comes back, and with it the settlement.
    results.near("filled", end("fill", "heave"), 0.0, heave, 10.0 * ROUND_OFF);
    results.near(
        "weight back",
        end("fill", "reaction"),
        360.0,
        360.0,
        10.0 * ROUND_OFF,
    );
}

#[test]
fn undrained_column() {
    let results = run("undrained_column");
    let ground = Elastic {
        young: 4e3,
        poisson: 0.3,
    };
    let (q, height, nu_u) = (100.0, 5.0, 0.49);
    let pores = 2.0 * ground.shear() * (1.0 + nu_u) / (3.0 * (1.0 - 2.0 * nu_u)) - ground.bulk();
    let undrained = ground.oedometric() + pores;
    for variant in ["plane", "axisymmetric"] {
        let of = results.of(variant);
        for (phase, modulus) in [("load", undrained), ("drain", ground.oedometric())] {
            let end = |probe| of.end(phase, probe);
            let settlement = q * height / modulus;
            let what = format!("{variant}, {phase}");
            // Poisson's ratio of 0.49 takes one digit more.
            results.near(
                &format!("{what}, settlement"),
                end("settlement"),
                settlement,
                settlement,
                1e-11,
            );
            // The excess pressure is what the skeleton does not carry.
            let effective = -q * ground.oedometric() / modulus;
            for probe in ["effective_min", "effective_max"] {
                results.near(&format!("{what}, {probe}"), end(probe), effective, q, 1e-11);
            }
        }
    }
}

#[test]
fn water_table() {
    let results = run("water_table");
    let ground = Elastic {
        young: 1e4,
        poisson: 0.3,
    };
    // Effective stress: + (γ_w − (γ_sat − γ)) for every metre between the levels.
    let rise = WATER - 3.0;
    let settlement = rise * 3.0 * (1.5 + 6.0) / ground.oedometric();
    // Where a level is inside an element, its load is not integrated exactly.
    for (variant, bound) in [
        ("levels_at_edges", 1e-11),
        ("levels_inside", 0.012),
        ("levels_inside_fine", 1e-3),
    ] {
        let of = results.of(variant);
        let end = |phase, probe| of.end(phase, probe);
        of.near(
            "rest",
            end("rest", "settlement"),
            0.0,
            settlement,
            ROUND_OFF * 10.0,
        );
        of.near(
            "",
            end("draw_down", "settlement"),
            settlement,
            settlement,
            bound,
        );
        let weight = 17.0 * 4.0 + 20.0 * 6.0;
        of.near(
            "weight",
            end("draw_down", "weight"),
            weight,
            weight,
            10.0 * ROUND_OFF,
        );
    }
}

#[test]
fn level_ground() {
    let results = run("level_ground");
    for kind in ["", "_plane"] {
        // Rounding, but for all Gauss points on curved sides: they do not integrate what is weighted with r exactly.
        for (variant, bound) in [
            (format!("straight_quads{kind}"), 1e-13),
            (format!("straight_triangles{kind}"), 1e-13),
            (format!("straight_quads{kind}_b_bar"), 1e-13),
            (format!("straight_triangles{kind}_b_bar"), 1e-13),
            (format!("wave_quads{kind}"), 1e-13),
            (format!("wave_triangles{kind}"), 1e-13),
            (format!("wave_quads{kind}_b_bar"), 1e-4),
            (format!("wave_triangles{kind}_b_bar"), 1e-4),
        ] {
            let summary = results.summary(&variant);
            let out = summary["phases"][0]["out_of_balance"].as_f64().unwrap();
            results.within(&variant, out, 0.0, bound);
        }
    }
}

#[test]
fn lake() {
    let results = run("lake");
    for variant in ["quads", "triangles"] {
        let of = results.of(variant);
        for probe in ["u_x", "u_y"] {
            // Against the millimetre that the slope moved to come to equilibrium.
            of.near(probe, of.last(probe), 0.0, 1e-3, 1e-11);
        }
        let rows = results.rows(variant, "points.csv");
        let points = |phase| rows.iter().filter(move |row| row["phase"] == phase);
        let errors = points("rest")
            .zip(points("rise"))
            .flat_map(|(before, after)| {
                ["stress_11", "stress_22", "stress_33", "stress_12"]
                    .map(|component| (number(before, component) - number(after, component)).abs())
            });
        // Effective stresses stay; of the 50 kPa of water that came.
        of.within("stress", errors.fold(0.0, f64::max) / 50.0, 0.0, 1e-11);
    }
}

#[test]
fn law_swap() {
    let results = run("law_swap");
    let modulus = |young, poisson| Elastic { young, poisson }.oedometric();
    let first = 50.0 * 5.0 / modulus(1e4, 0.3);
    let second = first + 50.0 * 5.0 / modulus(4e4, 0.25);
    // Mohr–Coulomb ground that does not yield.
    let third = second - 30.0 * 5.0 / modulus(2e4, 0.2);
    for (phase, exact) in [
        ("load", first),
        ("swap", first),
        ("load_more", second),
        ("swap_again", second),
        ("unload", third),
    ] {
        results.near(
            phase,
            results.end("", phase, "settlement"),
            exact,
            first,
            10.0 * ROUND_OFF,
        );
    }
}
