//! `pilum trade-off`, and `accuracy` in a case file.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

mod accuracy;

use crate::program::{BAD_INPUT, DONE, JOINT, Outcome, Place, edited};
use std::collections::BTreeMap;
use tests::case::table;
use tests::words::words;

/// Sheared at constant normal stiffness: the law is integrated implicitly, first order.
const DRIVER: &str = r#"title = "A joint at constant normal stiffness"
law = "mepi"
hypothesis = "interface_2d"

[parameters]
k_n = 0.86e5
k_t = 0.37e5
n = 0.55
mu_0 = 0.0
mu_p = 0.78
mu_c0 = 0.67
a = 0.00045
c_0 = 0.05
t = 0.002

[initial]
traction = { n = -100.0 }

[[segment]]
increments = 20
control = { t = { jump = 5.0e-3 }, n = { stiffness = 1.0e5 } }
"#;

/// Edits that make the layer of the case harden, sheared far enough, in more increments.
pub(crate) const HARDENING: &[&str] = &[
    r#"law = "coulomb_joint" => law = "mepi""#,
    "normal_stiffness = 1e6\nshear_stiffness = 4e5\ncohesion = 10.0\n\
            friction_angle = 30.0\ndilatancy_angle = 5.0\n => k_n = 1e6\nk_t = 4e5\n\
            n = 0.0\nmu_0 = 0.1\nmu_p = 0.7\nmu_c0 = 0.4\na = 0.008\nc_0 = 1.0\n\
            t = 0.01\nsigma_ni = 5.0\np_0 = 5.0\n",
    r#"formulation = "thin_layer"\n => formulation = "thin_layer"\nintegration = "mean"\ninitial_stress = { 11 = -5.0, 22 = -5.0, 33 = -5.0 }\n"#,
    r#"name = "push"\nincrements = 2 => name = "push"\nincrements = 8"#,
    "x = 1e-5 => x = 2e-3",
];

type Row = BTreeMap<String, String>;

fn study(place: &Place, file: &str, text: &str, more: &[&str]) -> Outcome {
    place.write(file, text);
    place.run(&[&["trade-off", file, "--out", "out"], more].concat())
}

fn rows(place: &Place) -> Vec<Row> {
    table(&place.path("out/trade_off.csv"))
}

fn number(row: &Row, column: &str) -> f64 {
    row[column].parse().unwrap()
}

/// Rows of the scheme `implicit`, or of a law without schemes, by increments.
fn implicit(rows: &[Row]) -> Vec<&Row> {
    let is_implicit = |row: &&Row| ["implicit", "increments"].contains(&row["family"].as_str());
    rows.iter().filter(is_implicit).collect()
}

#[test]
fn the_error_of_a_driver_falls_with_its_increments_at_first_order() {
    let place = Place::new();
    study(&place, "joint.toml", DRIVER, &["--max-increments", "500"]).ended(DONE);
    let rows = rows(&place);
    let implicit = implicit(&rows);
    let error = |n: usize| {
        let of = |row: &&&Row| row["increments"] == n.to_string();
        number(implicit.iter().find(of).unwrap(), "error")
    };
    for [n, finer] in [[50, 100], [100, 200]] {
        let ratio = error(n) / error(finer);
        assert!((1.7..2.3).contains(&ratio), "{n} to {finer}: {ratio}");
    }
    // Counts are those of the path, and more increments never take fewer calls.
    let calls: Vec<f64> = implicit.iter().map(|r| number(r, "law_calls")).collect();
    assert!(calls.is_sorted(), "{calls:?}");
    let default: Vec<&Row> = rows.iter().filter(|r| r["default"] == "true").collect();
    assert_eq!(default.len(), 1);
    assert_eq!(default[0]["increments"], "20");
}

#[test]
fn the_reference_says_how_far_it_is_converged_and_errors_below_are_marked() {
    let place = Place::new();
    let outcome = study(&place, "joint.toml", DRIVER, &["--max-increments", "10"]);
    let said = &outcome.stdout;
    let (_, after) = said.split_once("reference converged to ").unwrap();
    let uncertainty: f64 = after.lines().next().unwrap().parse().unwrap();
    assert!(uncertainty > 0.0 && uncertainty < 0.1, "{said}");
    assert!(said.contains("differs by "), "{said}");
    assert!(
        said.lines().any(|line| line.starts_with("default (")),
        "{said}"
    );
    for row in rows(&place) {
        let error = number(&row, "error");
        // The statement has one digit.
        if (error / uncertainty - 1.0).abs() > 0.5 {
            let is_below = error < uncertainty;
            assert_eq!(row["below_uncertainty"], is_below.to_string(), "{row:?}");
        }
    }
}

#[test]
fn the_pareto_front_falls_and_nothing_lies_below_it() {
    let place = Place::new();
    study(&place, "joint.toml", DRIVER, &["--max-increments", "50"]).ended(DONE);
    let point = |row: &Row| (number(row, "cpu_seconds"), number(row, "error"));
    let rows: Vec<Row> = rows(&place)
        .into_iter()
        .filter(|r| r["failure"].is_empty())
        .collect();
    let on_front = |row: &&Row| row["optimal"] == "true" && row["below_uncertainty"] == "false";
    let mut front: Vec<(f64, f64)> = rows.iter().filter(on_front).map(point).collect();
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert!(!front.is_empty());
    assert!(front.is_sorted_by(|a, b| a.1 > b.1), "{front:?}");
    for (cost, error) in &front {
        let beaten = rows.iter().map(point).any(|(c, e)| c < *cost && e < *error);
        assert!(!beaten, "{cost} s, {error}");
    }
}

#[test]
fn draws_the_diagram_and_the_page() {
    let place = Place::new();
    study(&place, "joint.toml", DRIVER, &["--max-increments", "5"]).ended(DONE);
    let svg = place.read("out/trade_off.svg");
    let page = place.read("out/trade_off.html");
    let n_rows = rows(&place).len();
    // A mark for every setting at least, and the ring around the default.
    assert!(svg.matches("<circle").count() > n_rows, "{n_rows}");
    assert!(page.contains("<svg") && page.matches("<tr>").count() > n_rows);
}

#[test]
#[ignore = "a minute and a half: a study of all settings of a case"]
fn a_case_is_measured_on_its_mesh_and_against_a_finer_one() {
    let place = Place::new();
    // By load alone: viscous control, which `auto` turns to with the fewest increments, comes nearer with these than
    // with more of them.
    let text = edited(HARDENING).replacen("[solver]", "[solver]\ncontrol = \"load\"", 1);
    study(&place, "case.toml", &text, &["--thorough"]).ended(DONE);
    let rows = rows(&place);
    let error = |label: &str| {
        let row = rows.iter().find(|row| row["setting"] == label);
        number(row.unwrap_or_else(|| panic!("{label}")), "error")
    };
    assert!(error("increments × 4") < error("as in the file"));
    assert!(error("as in the file") < error("increments × 0.25"));
    // The solver's way through the equations does not change the answer.
    let sparse = error("equations sparse") - error("as in the file");
    assert!(sparse.abs() < 1e-6, "{sparse}");
    let meshes = rows.iter().filter(|row| row["reference"] == "mesh / 2");
    let families: Vec<&str> = meshes.map(|row| row["family"].as_str()).collect();
    assert_eq!(families, ["mesh", "integration", "integration"]);
    // Trials leave nothing behind.
    let left = std::fs::read_dir(place.path("out")).unwrap().count();
    assert_eq!(left, 3);
}

#[test]
fn proposes_the_stiffness_of_a_joint_from_the_elements_beside_it() {
    let place = Place::new();
    let outcome = study(
        &place,
        "case.toml",
        &edited(JOINT),
        &["--interface-stiffness"],
    )
    .ended(DONE);
    let rows = table(&place.path("out/interface_stiffness.csv"));
    // Soil: E = 1e4 kPa, ν = 0.3, elements 0.5 m high above and below the joint.
    let (young, nu, size) = (1e4, 0.3, 0.5);
    let oedometric = young * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
    let shear = young / (2.0 * (1.0 + nu));
    for row in &rows {
        let factor = number(row, "factor");
        let expected = [factor * oedometric / size, factor * shear / size];
        for (column, expected) in ["k_n", "k_t"].iter().zip(expected) {
            let found = number(row, column);
            assert!((found / expected - 1.0).abs() < 1e-9, "{column} {found}");
        }
    }
    let done: Vec<&Row> = rows.iter().filter(|r| r["failure"].is_empty()).collect();
    assert!(done.len() >= 3, "{rows:?}");
    let penetration: Vec<f64> = done.iter().map(|r| number(r, "penetration")).collect();
    assert!(penetration.is_sorted_by(|a, b| a > b), "{penetration:?}");
    outcome.prints("plateau");
}

#[test]
fn refuses_what_it_cannot_study() {
    let place = Place::new();
    let no_probes = edited(&[
        "settlement = { line = \"top\", quantity = \"displacement_y\", scale = -1000.0 }\n\
            tau = { group = \"layer\", quantity = \"traction_t\" }\nhalf = { combine = { tau = 0.5 } }\n => ",
    ]);
    let slip = DRIVER.replace("mu_p", "mu_q");
    let refused = |file: &str, text: &str, more: &str, says: &str| {
        let outcome = study(&place, file, text, &words(more)).ended(BAD_INPUT);
        outcome.shows(says);
        assert_eq!(outcome.stdout, "");
    };
    refused("joint.toml", DRIVER, "--max-increments 0", "at least 1");
    refused("joint.toml", DRIVER, "--variant rough", "no variant");
    refused(
        "joint.toml",
        DRIVER,
        "--interface-stiffness",
        "needs a case",
    );
    refused("joint.toml", &slip, "", "no parameter `mu_q`");
    refused("case.toml", &no_probes, "", "there are no [probes]");
    refused(
        "case.toml",
        &edited(&[]),
        "--interface-stiffness",
        "zero_thickness",
    );
    place.refused(&["trade-off", "nothing.toml"]);
}

/// Probes of a history by name, with the part of the phase they belong to.
fn history(place: &Place, folder: &str, increments: usize) -> Vec<Row> {
    let rows = table(&place.path(&format!("{folder}/history.csv")));
    let rows: Vec<Row> = rows.into_iter().filter(|r| r["phase"] == "push").collect();
    assert_eq!(rows.len(), increments);
    rows
}

/// The file after its study, with its summary.
fn studied(place: &Place, text: String) -> (Outcome, serde_json::Value) {
    let outcome = place.done_case(text);
    let summary = place.summary();
    (outcome, summary["accuracy"].clone())
}

/// A column that shortens under a pressure, free to its sides: its reaction aside and the stress across are zero.
const COLUMN: &str = r#"
analysis = "plane_strain"
accuracy = 0.01
[mesh]
columns = [{ n = 2, to = 1.0 }]
rows = [{ n = 3, to = 1.0 }]
region = [{ group = "soil" }]
[mesh.lines]
bottom = { y = 0.0 }
top = { y = 1.0 }
left = { x = 0.0 }
[laws]
soil = { law = "elastic", parameters = { young_modulus = 1e4, poisson_ratio = 0.3 } }
[groups]
soil = { formulation = "solid", law = "soil" }
[[supports]]
line = "bottom"
fixed = ["y"]
[[supports]]
line = "left"
fixed = ["x"]
[[phase]]
name = "press"
increments = 7
pressure = [{ line = "top", value = 77.7 }]
[probes]
aside = { line = "left", quantity = "reaction_x" }
across = { group = "soil", quantity = "stress_11", reduce = "max" }
settlement = { line = "top", quantity = "displacement_y" }
"#;

#[test]
fn probes_that_are_round_off_do_not_count_and_are_named() {
    let place = Place::new();
    let (outcome, chosen) = studied(&place, COLUMN.to_owned());
    assert_eq!(chosen["verdict"], "reached", "{}", outcome.stderr);
    assert_eq!(chosen["zero"], serde_json::json!(["aside", "across"]));
    assert_eq!(chosen["increments"][0][1], 2, "{chosen}");
    outcome.shows("`aside`, `across` are zero within round-off and do not count");
    // They are what rounding leaves, or the test shows nothing.
    let rows = table(&place.path("out/history.csv"));
    let most = |probe: &str| {
        rows.iter()
            .map(|r| number(r, probe).abs())
            .fold(0.0, f64::max)
    };
    assert!(most("aside").max(most("across")) > 0.0);
    assert!(most("aside") < 1e-10 && most("across") < 1e-10);

    // Alone there is nothing else to tell by: the model does.
    let alone = COLUMN.replace("settlement = {", "# settlement = {");
    let (_, chosen) = studied(&place, alone);
    assert_eq!(chosen["zero"], serde_json::json!(["aside", "across"]));

    let without = COLUMN.replace("accuracy = 0.01\n", "");
    let outcome = study(&place, "column.toml", &without, &[]).ended(DONE);
    let said = outcome
        .stdout
        .contains("`aside`, `across` are zero within round-off");
    assert!(said, "{}", outcome.stdout);
}

/// Ground in equilibrium with its loads from the start moves by what rounding leaves, in all of its nodes. Condensed
/// ground takes that for nothing.
#[test]
fn where_nothing_moves_displacements_do_not_count() {
    let place = Place::new();
    let text = COLUMN
        .replace("left = { x = 0.0 }", "left = { x = 0.0 }\nright = { x = 1.0 }")
        .replace(
            "law = \"soil\" }\n[[supports]]",
            "law = \"soil\", initial_stress = { 11 = -77.7, 22 = -77.7, 33 = -77.7 } }\n[[supports]]",
        )
        .replace(
            "pressure = [",
            "pressure = [{ line = \"right\", value = 77.7 }, ",
        )
        + "\n[solver]\nequations = \"sparse\"\n";
    let (outcome, chosen) = studied(&place, text);
    let moved = table(&place.path("out/history.csv"))
        .iter()
        .map(|row| number(row, "settlement").abs())
        .fold(0.0, f64::max);
    assert!(moved > 0.0 && moved < 1e-15, "{moved:e}");
    assert_eq!(chosen["verdict"], "reached", "{}", outcome.stderr);
    assert!(
        chosen["zero"]
            .as_array()
            .unwrap()
            .contains(&"settlement".into()),
        "{chosen}"
    );
}
