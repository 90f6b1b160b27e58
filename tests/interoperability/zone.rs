//! A cohesive zone that somebody else wrote: `zone.cpp`, after the specification of MFront's generic
//! interface and without a line of our export. No such behaviour was to be had in a package.

use crate::mfront::{driver, rows};
use crate::{assert_close, beside, last_line};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::Command;
use std::sync::LazyLock;
use tempfile::TempDir;
use tests::needs::compiler;

/// The library, compiled once.
static ZONE: LazyLock<(TempDir, PathBuf)> = LazyLock::new(|| {
    let folder = TempDir::new().unwrap();
    let library = folder.path().join("libzone.so");
    let mut compiler = Command::new(compiler("CXX", "c++").unwrap());
    compiler.args(["-std=c++17", "-Wall", "-Wextra", "-Werror", "-O1"]);
    compiler.args(["-shared", "-fPIC", "-fvisibility=hidden", "-o"]);
    last_line(compiler.arg(&library).arg(beside("zone.cpp")));
    (folder, library)
});

/// Whether the test can run: without a compiler of C++ it says that it is skipped.
fn is_there() -> bool {
    compiler("CXX", "c++").is_some()
}

/// Stiffnesses, kPa/m, and openings where damage starts and ends, m.
const K_N: f64 = 1e7;
const K_T: f64 = 4e6;
const W_0: f64 = 1e-5;
const W_F: f64 = 1e-4;

fn damage(w: f64) -> f64 {
    W_F * (w - W_0) / (w * (W_F - W_0))
}

fn zone(more: &str, segments: &[(usize, &str)]) -> String {
    let mut text = format!(
        "hypothesis = \"interface_2d\"\n[parameters]\nNormalStiffness = {K_N:?}\n\
         TangentialStiffness = {K_T:?}\n{more}\n"
    );
    for (increments, control) in segments {
        let _ = writeln!(
            text,
            "[[segment]]\nincrements = {increments}\ncontrol = {{ {control} }}"
        );
    }
    driver(&ZONE.1, "BrittleZone", &text)
}

#[test]
fn it_opens_closes_and_shears_as_its_closed_form() {
    if !is_there() {
        return;
    }
    let opened = 5.5e-5;
    let (rows, report) = rows(&zone(
        "",
        &[
            (11, "n = { jump = 5.5e-5 }, t = { jump = 0.0 }"),
            (4, "n = { jump = 1e-5 }, t = { jump = 0.0 }"),
            (4, "n = { jump = -1e-6 }, t = { jump = 2e-5 }"),
        ],
    ));
    assert_eq!(report.hypothesis, "interface_2d");
    // Linear softening from K w₀.
    let peak = K_N * W_0;
    assert_close(rows[2]["traction_n"], peak, 1e-12, "peak");
    let soft = peak * (W_F - opened) / (W_F - W_0);
    assert_close(rows[11]["traction_n"], soft, 1e-12, "softening");
    assert_close(rows[11]["Damage"], damage(opened), 1e-12, "damage");
    assert_close(rows[11]["LargestOpening"], opened, 1e-12, "opening");
    let whole = 1.0 - damage(opened);
    assert_close(
        rows[15]["traction_n"],
        whole * K_N * 1e-5,
        1e-12,
        "unloading",
    );
    assert_close(rows[19]["traction_n"], -K_N * 1e-6, 1e-12, "closed");
    assert_close(rows[19]["traction_t"], whole * K_T * 2e-5, 1e-12, "sheared");
}

#[test]
fn its_tangent_leads_the_iterations() {
    if !is_there() {
        return;
    }
    let path = "n = { traction = 20.0 }, t = { jump = 4e-5 }";
    let (rows, report) = rows(&zone("", &[(2, "n = { traction = 20.0 }"), (20, path)]));
    assert_eq!(report.cut_backs, 0);
    let end = rows.last().unwrap();
    let w = end["jump_n"].hypot(end["jump_t"]);
    assert!(w > 3.0 * W_0);
    let whole = 1.0 - damage(w);
    assert_close(whole * K_N * end["jump_n"], 20.0, 1e-9, "normal traction");
    assert_close(
        end["traction_t"],
        whole * K_T * 4e-5,
        1e-12,
        "shear traction",
    );
    // Without the terms of damage in the tangent the iterations converge linearly.
    assert!(rows.iter().all(|row| row["iterations"] <= 6.0));
}

#[test]
fn its_own_parameters_are_set_and_its_refusals_cut_steps() {
    if !is_there() {
        return;
    }
    let path: &[(usize, &str)] = &[(4, "n = { jump = 4e-5 }, t = { jump = 0.0 }")];
    let (all, _) = rows(&zone("OnsetOpening = 2e-5", path));
    let softened = K_N * 2e-5 * (W_F - 4e-5) / (W_F - 2e-5);
    assert_close(all[4]["traction_n"], softened, 1e-12, "later onset");
    // Another image: nothing is left of that.
    let (whole, _) = rows(&zone("", path));
    let (cut, report) = rows(&zone("LargestDamageIncrement = 0.2", path));
    assert!(report.cut_backs > 0, "{report}");
    assert_close(cut[4]["traction_n"], whole[4]["traction_n"], 1e-12, "cut");
}

#[test]
fn it_opens_in_space_as_in_the_plane() {
    if !is_there() {
        return;
    }
    let jumps = [("n", 2e-5), ("t", 3e-5), ("s", -4e-5)];
    let control = jumps.map(|(name, jump)| format!("{name} = {{ jump = {jump:?} }}"));
    let text = zone("", &[(8, &control.join(", "))]).replacen("interface_2d", "interface_3d", 1);
    let (rows, report) = rows(&text);
    assert_eq!(report.hypothesis, "interface_3d");
    let end = &rows[8];
    let w = jumps
        .map(|(_, jump)| jump * jump)
        .iter()
        .sum::<f64>()
        .sqrt();
    assert_close(end["Damage"], damage(w), 1e-12, "damage");
    for (name, jump) in jumps {
        let stiffness = if name == "n" { K_N } else { K_T };
        let expected = (1.0 - damage(w)) * stiffness * jump;
        assert_close(
            end[format!("traction_{name}").as_str()],
            expected,
            1e-12,
            name,
        );
    }
}

/// It refuses every growth of damage, and says the time of the increment that it was given.
#[test]
fn it_is_given_the_time_of_its_increments() {
    if !is_there() {
        return;
    }
    let refused = |time: &str| -> f64 {
        let text = zone(
            "LargestDamageIncrement = 0.0",
            &[(4, "n = { jump = 4e-5 }")],
        );
        let text = text.replacen("increments = 4\n", &format!("increments = 4\n{time}"), 1);
        let driver = tests::driver::of_text(&text).unwrap();
        let outcome = runs::point::write_csv(&driver, Vec::new(), std::path::Path::new("table"));
        let message = format!("{}", outcome.unwrap_err())
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        let (_, after) = message.split_once("the damage grows by ").unwrap();
        let (_, time) = after.split_once(" in ").unwrap();
        let number = time
            .split(|c: char| !c.is_ascii_digit() && !".e-".contains(c))
            .next()
            .unwrap();
        number.trim_end_matches('.').parse().unwrap()
    };
    // As many halvings each; an increment of four takes a quarter of the segment, one of which nothing is
    // said takes 1.
    let of_20 = refused("time = 20.0\n");
    assert_close(
        refused("time = 60.0\n") / of_20,
        3.0,
        1e-12,
        "three times the time",
    );
    assert_close(refused("") / of_20, 0.2, 1e-12, "no time");
    let halvings = (5.0 / of_20).log2();
    assert_close(halvings, halvings.round(), 1e-12, "halvings");
}

#[test]
fn its_bounds_are_kept() {
    if !is_there() {
        return;
    }
    let path: &[(usize, &str)] = &[(1, "n = { jump = 1e-6 }")];
    let text = zone("", path).replacen("NormalStiffness = 10000000.0", "NormalStiffness = -1.0", 1);
    let error = tests::driver::of_text(&text).unwrap_err();
    assert!(error.to_string().contains("NormalStiffness"), "{error}");
    let text = zone("", path).replacen("Stiffness = 4000000.0", "Stiffness = 2e9", 1);
    let (_, report) = rows(&text);
    assert!(
        report
            .warnings
            .iter()
            .any(|w| w.contains("TangentialStiffness")),
        "{report}"
    );
}

#[test]
fn it_joins_two_blocks() {
    if !is_there() {
        return;
    }
    let library = toml::Value::from(ZONE.1.to_str().unwrap());
    let case = format!(
        r#"title = "A zone pulled apart"
analysis = "plane_strain"
[mesh]
columns = [{{ n = 1, to = 1.0 }}]
rows = [{{ n = 2, to = 1.0 }}]
[[mesh.region]]
group = "block"
[mesh.lines]
bottom = {{ y = 0.0 }}
top = {{ y = 1.0 }}
middle = {{ y = 0.5 }}
[laws.block]
law = "elastic"
parameters = {{ young_modulus = 1e8, poisson_ratio = 0.0 }}
[laws.zone]
adapter = "mfront"
in_process = true
library = {library}
law = "BrittleZone"
parameters = {{ NormalStiffness = 1e7, TangentialStiffness = 4e6 }}
[groups.block]
formulation = "solid"
integration = "full"
law = "block"
[groups.zone]
formulation = "zero_thickness"
line = "middle"
law = "zone"
[[supports]]
line = "bottom"
fixed = ["x", "y"]
[[phase]]
name = "pull"
increments = 10
displacement = [{{ line = "top", y = 3e-5 }}]
[probes]
traction = {{ group = "zone", quantity = "traction_n" }}
opening = {{ group = "zone", quantity = "jump_n" }}
"#
    );
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("case.toml");
    std::fs::write(&file, case).unwrap();
    let case = &input::Case::load(&file).unwrap()[0];
    runs::run::run(case, folder.path(), &mut tests::case::Silent::default()).unwrap();
    let rows = tests::case::table(&folder.path().join("history.csv"));
    let end = rows.last().unwrap();
    let number = |name: &str| end[name].parse::<f64>().unwrap();
    // t = s (w_f − w) and w + t h/E = u, with h/E = 1e-8 of both blocks together.
    let s = K_N * W_0 / (W_F - W_0);
    let w = (3e-5 - s * W_F * 1e-8) / (1.0 - s * 1e-8);
    assert_close(number("opening"), w, 1e-8, "opening");
    assert_close(number("traction"), s * (W_F - w), 1e-8, "traction");
}
