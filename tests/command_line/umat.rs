//! Abaqus user subroutines as laws: Fortran sources of `fixtures/umat`, compiled by gfortran.
#![expect(
    clippy::unwrap_used,
    clippy::float_cmp,
    reason = "part of the tests; values that are compared are exact"
)]

mod begins;
mod faulty;
mod files;
mod incremental_driver;
mod mohr_coulomb;
mod planted;
mod recorded;
mod routines;
mod silent;
mod space;
mod tangents;
mod time;
mod tolerance;

use crate::program::{BAD_INPUT, CASE, DONE, PLUGIN_TROUBLE, Place, edited};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Mutex, PoisonError};
use tempfile::TempDir;
use tests::case::table;
use tests::or_skip;
use tests::words;

/// A folder with a routine and its sidecar. `None`, with a remark, where there is no compiler.
pub(crate) fn place(name: &str) -> Option<Place> {
    static COMPILED: Mutex<BTreeMap<String, Vec<u8>>> = Mutex::new(BTreeMap::new());
    let mut compiled = COMPILED.lock().unwrap_or_else(PoisonError::into_inner);
    if !compiled.contains_key(name) {
        let folder = TempDir::new().unwrap();
        let out = folder.path().join("library");
        let endings = ["f", "f90", "c"];
        let sources = endings.map(|ending| source(&format!("{name}.{ending}")));
        // It calls the cone.
        let called = (name == "elastic_tangent").then(|| source("drucker_prager.f"));
        let sources = sources.into_iter().chain(called);
        let sources: Vec<PathBuf> = sources.filter(|path| path.is_file()).collect();
        let in_cpp = source(&format!("{name}.cpp"));
        if in_cpp.is_file() {
            compile("g++", &["-std=c++17", "-shared", "-fPIC"], &[in_cpp], &out)?;
        } else {
            gfortran(&["-shared", "-fPIC"], &sources, &out)?;
        }
        compiled.insert(name.to_owned(), std::fs::read(out).unwrap());
    }
    let place = Place::new();
    place.write(&format!("lib{name}.so"), &compiled[name]);
    let sidecar = format!("{name}.law.toml");
    place.write(&sidecar, std::fs::read(source(&sidecar)).unwrap());
    Some(place)
}

fn source(name: &str) -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.join("fixtures/umat").join(name)
}

fn gfortran(arguments: &[&str], sources: &[PathBuf], out: &Path) -> Option<Output> {
    compile("gfortran", arguments, sources, out)
}

fn compile(compiler: &str, arguments: &[&str], sources: &[PathBuf], out: &Path) -> Option<Output> {
    let mut compiler = Command::new(compiler);
    compiler
        .args(["-O1", "-o"])
        .arg(out)
        .args(arguments)
        .args(sources);
    let output = tests::needs::output(&mut compiler)?;
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    Some(output)
}

/// A driver in plane strain, with further keys and parameters, and 10 increments.
fn driver(name: &str, keys: &str, parameters: &str) -> String {
    format!(
        "law = \"umat_{name}\"\nadapter = \"umat\"\nlibrary = \"lib{name}.so\"\n{keys}\n\
         hypothesis = \"plane_strain\"\n\
         [parameters]\nyoung_modulus = 2e4\npoisson_ratio = 0.3\n{parameters}\n\
         [[segment]]\nincrements = 10\ncontrol = {{ 11 = {{ strain = 1e-3 }}, \
         22 = {{ strain = -2e-3 }}, 12 = {{ strain = 1e-3 }} }}\n"
    )
}

/// Runs a driver; the rows of its table.
fn rows(place: &Place, text: &str) -> Vec<BTreeMap<String, String>> {
    place.write("driver.toml", text);
    place.done(&["point", "driver.toml", "--csv", "out.csv"]);
    table(&place.path("out.csv"))
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap()
}

/// The case with its soil from a UMAT.
fn soil(name: &str, keys: &str) -> String {
    let law =
        format!("law = \"umat_{name}\"\nadapter = \"umat\"\nlibrary = \"lib{name}.so\"\n{keys}");
    CASE.replacen("law = \"elastic\"", &law, 1)
}

/// The same with one more parameter.
fn soil_with(name: &str, parameter: &str) -> String {
    let more = format!("poisson_ratio = 0.3, {parameter} }}");
    soil(name, "").replacen("poisson_ratio = 0.3 }", &more, 1)
}

/// The same with a cone that flows, in a layer that does not slide.
fn flowing(name: &str) -> String {
    let edits = [
        "1e4, poisson_ratio = 0.3 } => 1e4, alpha = 0.3, beta = 0.05, k = 4.0 }",
        r"cohesion = 10.0\n => cohesion = 1000.0\ntensile_strength = 1000.0\n",
        "x = 1e-5 } => x = 3e-3 }",
        r#"name = "push"\nincrements = 2 => name = "push"\nincrements = 10"#,
    ];
    words::edited(&soil(name, ""), &edits)
}

/// The bits of the last values of all probes.
fn last(place: &Place) -> Vec<f64> {
    let rows = table(&place.path("out/history.csv"));
    let row = rows.last().unwrap();
    ["settlement", "tau"].map(|name| number(row, name)).to_vec()
}

#[test]
fn an_elastic_umat_is_the_elastic_law() {
    let place = or_skip!(place("elastic"));
    place.done_case(CASE);
    let ours = last(&place);
    let mut all = Vec::new();
    for keys in ["", "in_process = true"] {
        place.done_case(soil("elastic", keys));
        all.push(last(&place));
    }
    for (umat, ours) in all[0].iter().zip(&ours) {
        assert!((umat - ours).abs() <= 1e-9 * ours.abs(), "{umat} {ours}");
    }
    let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&all[0]), bits(&all[1]), "worker and program");
}

#[test]
fn the_adapter_gives_the_bits_of_a_direct_call() {
    let place = or_skip!(place("drucker_prager"));
    let program = place.path("direct");
    let sources = [source("direct.f"), source("drucker_prager.f")];
    gfortran(&[], &sources, &program).unwrap();
    let direct = Command::new(program).output().unwrap();
    let direct = String::from_utf8(direct.stdout).unwrap();
    let text = driver("drucker_prager", "", "alpha = 0.4\nbeta = 0.1\nk = 10.0");
    let start = text.find("[[segment]]").unwrap();
    let text = text[..start].to_owned()
        + "[[segment]]\nincrements = 40\ncontrol = { 11 = { strain = -1.1e-2 }, \
           22 = { strain = 4e-3 }, 12 = { strain = 7e-3 } }\n";
    let rows = rows(&place, &text);
    assert_eq!(direct.lines().count(), 40);
    for (line, row) in direct.lines().zip(&rows[1..]) {
        let components = ["11", "22", "33", "12"];
        for (value, component) in line.split_whitespace().zip(components) {
            let ours = number(row, &format!("stress_{component}"));
            let value: f64 = value.parse().unwrap();
            assert_eq!(ours.to_bits(), value.to_bits(), "{ours} {value}");
        }
    }
    assert!(
        number(rows.last().unwrap(), "multiplier") > 1e-3,
        "it flows"
    );
}

#[test]
fn a_cone_ends_at_its_strength_in_triaxial_compression() {
    let place = or_skip!(place("drucker_prager"));
    let text = driver("drucker_prager", "", "alpha = 0.4\nbeta = 0.1\nk = 10.0");
    let start = text.find("[[segment]]").unwrap();
    let text = text[..start].replacen("plane_strain", "axisymmetric", 1)
        + "[initial]\nstress = { 11 = -100.0, 22 = -100.0, 33 = -100.0 }\n\
           [[segment]]\nincrements = 20\ncontrol = { 22 = { strain = -5e-2 } }\n";
    let rows = rows(&place, &text);
    let end = rows.last().unwrap();
    // √J₂ = q/√3 and p = −100 − q/3 where 22 is loaded and the others keep −100.
    let q = (10.0 + 40.0) / (1.0 / 3.0_f64.sqrt() - 0.4 / 3.0);
    let found = -100.0 - number(end, "stress_22");
    assert!((found - q).abs() < 1e-8 * q, "{found} {q}");
    // The tangent is consistent: the driver needs few calls.
    assert!(
        rows[1..]
            .iter()
            .all(|row| number(row, "iterations") <= 12.0)
    );
}

#[test]
fn a_soil_that_flows_converges_with_the_tangent_of_its_routine() {
    let place = or_skip!(place("drucker_prager"));
    let probe = r#"[solver] => flow = { group = "soil", quantity = "multiplier" }\n\n[solver]"#;
    let text = words::edited(&flowing("drucker_prager"), &[probe]);
    place.done_case(text);
    let rows = table(&place.path("out/history.csv"));
    assert!(number(rows.last().unwrap(), "flow") > 1e-3);
    let most = rows.iter().map(|row| number(row, "iterations"));
    let most = most.fold(0.0, f64::max);
    assert!(most <= 7.0, "{most} iterations");
}

#[test]
fn arguments_are_true() {
    let place = or_skip!(place("echo"));
    let text = driver("echo", "", "").replacen("plane_strain", "axisymmetric", 1)
        + "[[segment]]\nincrements = 3\ncontrol = { 11 = { strain = 1e-3 }, \
           22 = { strain = -2e-3 }, 33 = { strain = 0.0 }, 12 = { strain = 1e-3 } }\n";
    let text = text.replacen("12 = {", "33 = { strain = 0.0 }, 12 = {", 1);
    let rows = rows(&place, &text);
    let said = |row: usize| -> Vec<f64> {
        let row = &rows[row];
        (1..=21)
            .map(|i| number(row, &format!("said_{i}")))
            .collect()
    };
    let (place_and_length, at_rest) = ([0.0, 0.0, 0.0, 1.0], 10.0);
    let expected = |time: f64, step: f64, increment: f64, strain: f64| {
        let sizes = [3.0, 1.0, 4.0, 21.0, 2.0];
        let start = if step > 1.0 { at_rest } else { 0.0 };
        let mut all = sizes.to_vec();
        all.extend([time - start, time, 1.0]);
        all.extend(place_and_length);
        // NOEL, NPT, JSTEP, KINC; the identities; CMNAME; thermal and energy; LAYER, KSPT; STRAN.
        all.extend([1.0, 1.0, step, increment, 0.0, 4.0, 0.0, 11.0, strain]);
        all
    };
    assert_eq!(
        said(3),
        expected(2.0, 1.0, 3.0, number(&rows[2], "strain_11"))
    );
    assert_eq!(
        said(12),
        expected(11.0, 2.0, 2.0, number(&rows[11], "strain_11"))
    );
}

#[test]
fn elements_say_where_they_are() {
    let place = or_skip!(place("echo"));
    let text = soil("echo", "").replacen("profile = \"phases\"", "points = \"phases\"", 1);
    place.done_case(text);
    let rows = table(&place.path("out/points.csv"));
    let rows = rows.into_iter();
    let rows = rows.filter(|row| row["group"] == "soil" && row["phase"] == "push");
    let rows: Vec<_> = rows.collect();
    assert!(!rows.is_empty());
    for (number_of_row, row) in rows.iter().enumerate() {
        let said = |i: usize| number(row, &format!("said_{i}"));
        assert!((said(9) - number(row, "x")).abs() < 1e-12);
        assert!((said(10) - number(row, "y")).abs() < 1e-12);
        // Two columns of two elements, 1 × 0.5 and 0.99 × 0.5, 9 points each.
        let area: f64 = if said(9) < 1.0 { 0.5 } else { 0.495 };
        assert!((said(12) - area.sqrt()).abs() < 1e-12);
        assert_eq!(
            (said(13), said(14)),
            (
                (number_of_row / 9 + 1) as f64,
                (number_of_row % 9 + 1) as f64
            )
        );
        // Second phase, second increment, whose step starts at 1 and itself at 1.5.
        assert_eq!([said(15), said(16)], [2.0, 2.0]);
        assert_eq!([said(6), said(7), said(8)], [0.5, 1.5, 0.5]);
    }
}

#[test]
fn a_routine_that_asks_for_smaller_steps_gets_them() {
    let place = or_skip!(place("smaller"));
    let text = driver("smaller", "", "largest = 3e-5");
    place.write("driver.toml", &text);
    let outcome = place.done(&["point", "driver.toml", "--csv", "out.csv"]);
    outcome.hides(" 0 cut-backs");
    let rows = table(&place.path("out.csv"));
    let end = rows.last().unwrap();
    // σ₁₁ = (λ + 2G) ε₁₁ + λ ε₂₂.
    let (g, lambda) = (2e4 / 2.6, 2e4 * 0.3 / (1.3 * 0.4));
    let stress = (lambda + 2.0 * g) * 1e-3 - lambda * 2e-3;
    assert!((number(end, "stress_11") - stress).abs() < 1e-10 * stress.abs());

    // In a run the message names the point.
    let case = soil_with("smaller", "largest = 1e-9");
    let outcome = place.run_case(case);
    outcome.shows("group `soil`, element").shows("PNEWDT = 0.5");
}

#[test]
fn each_material_has_variables_of_its_own() {
    // In SAVE and COMMON, and in variables that C++ has once in a process.
    for name in ["saves", "unique"] {
        has_variables_of_its_own(name);
    }
}

fn has_variables_of_its_own(name: &str) {
    let place = or_skip!(place(name));
    let edits: &[&str] = &[
        "[groups.soil] => [laws.hard]\nlaw = \"umat_saves\"\nadapter = \"umat\"\n\
            library = \"libsaves.so\"\nKEYS\nparameters = { young_modulus = 3e4, \
            poisson_ratio = 0.3 }\n\n[groups.soil]",
        r#"[groups.layer]\nformulation = "thin_layer"\nlaw = "joint" => [groups.layer]\nformulation = "solid"\nintegration = "full"\nlaw = "hard""#,
        "tau = { group = \"layer\", quantity = \"traction_t\" } => tau = { group = \"soil\", \
            quantity = \"modulus\" }\nhard = { group = \"layer\", quantity = \"modulus\" }",
        r#"profile = "phases" => profile = "never""#,
    ];
    let text = edited(edits).replacen(
        "law = \"elastic\"",
        "law = \"umat_saves\"\nadapter = \"umat\"\nlibrary = \"libsaves.so\"\nKEYS",
        1,
    );
    let text = text.replace("saves", name);
    for keys in ["", "in_process = true"] {
        place.done_case(text.replace("KEYS", keys));
        let rows = table(&place.path("out/history.csv"));
        let row = rows.last().unwrap();
        assert_eq!(number(row, "tau"), 1e4, "{keys}");
        assert_eq!(number(row, "hard"), 3e4, "{keys}");
    }
}

#[test]
fn a_zone_has_no_two_variables_of_one_name() {
    let place = or_skip!(place("elastic"));
    let sidecar = place.read("elastic.law.toml");
    let variable = "[[internal]]\nid = \"zone_stress_11\"\nunit = \"kPa\"\ndoc = \"a stress\"\n";
    place.write("elastic.law.toml", format!("{sidecar}\n{variable}"));
    let zone = "law = \"soil\"\nadapter = \"shear_zone\"\nthickness = 0.01\nhypothesis = \"interface_2d\"\n\
                segment = [{ increments = 4, control = { t = { jump = 1e-3 } } }]\n[laws.soil]\nlaw = \"umat_elastic\"\n\
                adapter = \"umat\"\nlibrary = \"libelastic.so\"\nparameters = { young_modulus = 2e4 }\n";
    place.write("zone.toml", zone);
    let outcome = place
        .run(&["point", "zone.toml", "--csv", "out.csv"])
        .ended(1);
    outcome.shows("internal variable `zone_stress_11`, as the zone calls one of its own stresses");
}

#[test]
fn six_components_stand_for_four_only_where_that_is_declared() {
    let place = or_skip!(place("six"));
    let stress = |rows: &[BTreeMap<String, String>]| {
        ["11", "22", "33", "12"].map(|c| number(rows.last().unwrap(), &format!("stress_{c}")))
    };
    let six = stress(&rows(&place, &driver("six", "", "")));
    let own = driver("elastic", "", "")
        .replacen("umat_elastic", "elastic", 1)
        .replacen("adapter = \"umat\"\nlibrary = \"libelastic.so\"\n", "", 1);
    for (six, own) in six.into_iter().zip(stress(&rows(&place, &own))) {
        assert!((six - own).abs() <= 1e-12 * own.abs(), "{six} {own}");
    }

    let sidecar = place.read("six.law.toml");
    place.write("driver.toml", driver("six", "", ""));
    place.write("six.law.toml", sidecar.replacen("expand = true", "", 1));
    let outcome = place.refused(&["point", "driver.toml"]);
    outcome
        .shows("six.law.toml:2")
        .shows("plane_strain has NTENS = 4, which `ntens` lacks")
        .shows("expand = true");
    // A sidecar that is wrong about the routine is found out.
    place.write(
        "six.law.toml",
        sidecar.replacen("ntens = [6]", "ntens = [4, 6]", 1),
    );
    let outcome = place.run(&["point", "driver.toml"]).ended(PLUGIN_TROUBLE);
    outcome.shows("writes beyond the end of");
}

#[test]
fn an_interface_with_two_components() {
    let place = or_skip!(place("joint"));
    let case = edited(&[
        "law = \"coulomb_joint\"\n[laws.joint.parameters]\nnormal_stiffness = 1e6\n\
            shear_stiffness = 4e5\ncohesion = 10.0\nfriction_angle = 30.0\n\
            dilatancy_angle = 5.0 => law = \"umat_joint\"\nadapter = \"umat\"\n\
            library = \"libjoint.so\"\n[laws.joint.parameters]\nnormal_stiffness = 1e6\n\
            shear_stiffness = 4e5\nfriction = 0.5",
    ]);
    place.done_case(case);

    let driver = "law = \"umat_joint\"\nadapter = \"umat\"\nlibrary = \"libjoint.so\"\n\
        hypothesis = \"interface_2d\"\n\
        [parameters]\nnormal_stiffness = 1e6\nshear_stiffness = 4e5\nfriction = 0.5\n\
        [initial]\ntraction = { n = -100.0 }\n\
        [[segment]]\nincrements = 10\n\
        control = { t = { jump = 1e-3 }, n = { traction = -80.0 } }\n";
    let rows = rows(&place, driver);
    let end = rows.last().unwrap();
    assert!((number(end, "traction_t") - 40.0).abs() < 1e-9);
    // What slips is the whole jump but its elastic part.
    assert!((number(end, "plastic_slip") - (1e-3 - 40.0 / 4e5)).abs() < 3e-5);
}

#[test]
fn utility_routines_are_there() {
    let place = or_skip!(place("utilities"));
    for keys in ["", "in_process = true"] {
        let rows = rows(&place, &driver("utilities", keys, ""));
        let end = rows.last().unwrap();
        let [s_11, s_22, s_33, s_12] =
            ["11", "22", "33", "12"].map(|c| number(end, &format!("stress_{c}")));
        let said = |i: usize| number(end, &format!("said_{i}"));
        let mean = (s_11 + s_22 + s_33) / 3.0;
        let squares = (s_11 - mean).powi(2) + (s_22 - mean).powi(2) + (s_33 - mean).powi(2);
        let mises = (1.5 * (squares + 2.0 * s_12 * s_12)).sqrt();
        let middle = 0.5 * (s_11 + s_22);
        let radius = (0.25 * (s_11 - s_22).powi(2) + s_12 * s_12).sqrt();
        let least = (middle - radius).min(s_33);
        let most = (middle + radius).max(s_33);
        let expected = [mean, mises, least, most, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        for (i, expected) in expected.into_iter().enumerate() {
            let found = said(i + 1);
            assert!(
                (found - expected).abs() < 1e-10,
                "said_{}: {found} {expected}",
                i + 1
            );
        }
    }
}

/// The value of an argument in a record.
fn recorded(place: &Place, file: &str, when: &str, name: &str) -> Vec<f64> {
    let text = place.read(file);
    let call: toml::Table = toml::from_str(&text).unwrap();
    let values = call[when][name].as_array().unwrap().iter();
    values.map(|value| value.as_float().unwrap()).collect()
}
