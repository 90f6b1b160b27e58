//! User-defined soil models of PLAXIS as laws: sources of `fixtures/udsm`, compiled by gfortran.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{BAD_INPUT, CASE, NO_EQUILIBRIUM, PLUGIN_TROUBLE, Place, refuses_file};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;
use tests::case::{column, table};
use tests::or_skip;
use tests::tolerance::close;
use tests::tolerance::near;
use tests::words;

/// A folder with `libNAME.so`. `None`, with a remark, where there is no compiler.
fn place(name: &str, sources: &[&str]) -> Option<Place> {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("library");
    let mut compiler = Command::new("gfortran");
    compiler
        .args(["-O1", "-shared", "-fPIC", "-o"])
        .arg(&out)
        .args(sources.iter().map(|source| fixtures.join(source)));
    let output = tests::needs::output(&mut compiler)?;
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let place = Place::new();
    place.write(&format!("lib{name}.so"), std::fs::read(out).unwrap());
    Some(place)
}

/// Linear elasticity and Mohr–Coulomb in Fortran.
fn soils() -> Option<Place> {
    place("soils", &["udsm/soils.f90", "umat/mohr_coulomb.f"])
}

/// A skew elasticity in C, with all that can go wrong.
fn skew() -> Option<Place> {
    place("skew", &["udsm/skew.c"])
}

const ELASTIC: &str =
    "law = \"elastic\"\nparameters = { young_modulus = 1e4, poisson_ratio = 0.3 }\n";
const STRONG: &str = "cohesion = 10.0 => cohesion = 1000.0";
const FAR: &str = "x = 1e-5 } => x = 3e-3 }";
const MOHR_COULOMB: &str =
    "law = \"Mohr_Coulomb\"\nadapter = \"udsm\"\nlibrary = \"libsoils.so\"\n";
const THEIRS: &str = "E = 2e4\nnu = 0.3\nc = 5.0\nphi = 35.0\npsi = 10.0\n";
const OURS: &str = "young_modulus = 2e4\npoisson_ratio = 0.3\ncohesion = 5.0\n\
                    friction_angle = 35.0\ndilatancy_angle = 10.0\n";

/// Rows of a driver that succeeds.
fn rows(place: &Place, text: &str) -> Vec<BTreeMap<String, String>> {
    place.write("driver.toml", text);
    place.done(&["point", "driver.toml", "--csv", "out.csv"]);
    table(&place.path("out.csv"))
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap()
}

#[test]
fn a_mohr_coulomb_udsm_is_the_law() {
    let place = or_skip!(soils());
    let paths = [
        // A face, there and back; the edge of triaxial compression, led by stresses.
        (
            "plane_strain",
            "[[segment]]\nincrements = 20\ncontrol = { 11 = { strain = 4e-3 }, \
             22 = { strain = -1e-2 }, 12 = { strain = 2e-2 } }\n\
             [[segment]]\nincrements = 20\ncontrol = { 11 = { strain = 4e-3 }, \
             22 = { strain = -1e-2 }, 12 = { strain = -2e-2 } }\n",
        ),
        (
            "axisymmetric",
            "[[segment]]\nincrements = 20\ncontrol = { 22 = { strain = -2e-2 } }\n",
        ),
    ];
    for (hypothesis, path) in paths {
        let text = |law: &str, parameters: &str| {
            format!(
                "{law}hypothesis = \"{hypothesis}\"\n[parameters]\n{parameters}\
                 [initial]\nstress = {{ 11 = -100.0, 22 = -100.0, 33 = -100.0 }}\n{path}"
            )
        };
        let ours = rows(&place, &text("law = \"mohr_coulomb\"\n", OURS));
        let theirs = rows(&place, &text(MOHR_COULOMB, THEIRS));
        assert!(number(ours.last().unwrap(), "plastic_strain") > 1e-3);
        assert_eq!(ours.len(), theirs.len());
        for (ours, theirs) in ours.iter().zip(&theirs) {
            for (column, unit) in ["11", "22", "33", "12"]
                .iter()
                .map(|c| (format!("stress_{c}"), 100.0))
                .chain([("strain_11".to_owned(), 1e-2)])
            {
                let (a, b) = (number(ours, &column), number(theirs, &column));
                // The driver leaves stresses within 1e-10 of what is asked for.
                close(format_args!("{hypothesis} {column}"), a, b, 1e-9 * unit);
            }
            let strains = [
                ("plastic_strain", "epsilon_q"),
                ("plastic_dilation", "epsilon_v"),
            ];
            for (a, b) in strains {
                assert!((number(ours, a) - number(theirs, b)).abs() < 1e-11, "{a}");
            }
            // With its own tangent it needs no more calls.
            let iterations = |row| number(row, "iterations");
            assert!(iterations(theirs) <= iterations(ours) + 2.0);
        }
    }
}

#[test]
fn a_case_with_a_udsm_is_the_case_with_the_law() {
    let place = or_skip!(soils());
    let with = |law: &str, parameters: &str| {
        let table = format!("{law}[laws.soil.parameters]\n{parameters}");
        let text = words::edited(CASE, &[&format!("{ELASTIC} => {table}")]);
        words::edited(
            &text,
            &[
                STRONG,
                FAR,
                r#"name = "push"\nincrements = 2 => name = "push"\nincrements = 8"#,
            ],
        )
    };
    let ends = |text: String, arguments: &[&str]| {
        place.write("case.toml", text);
        let run = ["run", "case.toml", "--out", "out"];
        place.done(&[&run, arguments].concat());
        let end = |name| *column(&place.path("out/history.csv"), name).last().unwrap();
        ["settlement", "tau"].map(end)
    };
    let ours = ends(with("law = \"mohr_coulomb\"\n", OURS), &[]);
    let elastic = ends(words::edited(CASE, &[STRONG, FAR, "1e4 => 2e4"]), &[]);
    assert!(
        (ours[1] - elastic[1]).abs() > 1e-3 * ours[1].abs(),
        "the soil flows"
    );
    let in_process = format!("{MOHR_COULOMB}in_process = true\n");
    for (keys, arguments) in [
        (MOHR_COULOMB, &[][..]),
        (&in_process, &[]),
        (&in_process, &["--isolate"]),
    ] {
        let theirs = ends(with(keys, THEIRS), arguments);
        for (ours, theirs) in ours.iter().zip(theirs) {
            near(*ours, theirs, 1e-7 * ours.abs());
        }
    }
}

/// A driver of the skew model.
fn skewed(keys: &str, wrong: f64, control: &str) -> String {
    format!(
        "law = \"model_1\"\nadapter = \"udsm\"\nlibrary = \"libskew.so\"\n{keys}\
         hypothesis = \"plane_strain\"\n[parameters]\nyoung_modulus = 2e4\npoisson_ratio = 0.3\n\
         skew = 5e3\nwrong = {wrong:?}\n[initial]\nstress = {{ 11 = -60.0, 22 = -90.0, 33 = -30.0 }}\n\
         [[segment]]\nincrements = 4\n{control}\n"
    )
}

const ROWS: &str = "tangent_order = \"rows\"\n";
const STRAINED: &str = "control = { 11 = { strain = 1e-3 }, 22 = { strain = -2e-3 }, \
                        12 = { strain = 1e-3 } }";

#[test]
fn arguments_are_true() {
    let place = or_skip!(skew());
    let rows = rows(&place, &skewed(ROWS, 0.0, STRAINED));
    // Task 1 sees the stress: twice its mean.
    assert!((number(&rows[0], "state_6") + 120.0).abs() < 1e-12);
    let end = &rows[4];
    for (state, expected) in [(1, 0.0), (2, 4.0), (3, 1.0), (5, 1.0), (6, -120.0)] {
        let found = number(end, &format!("state_{state}"));
        assert!((found - expected).abs() < 1e-12, "{state}: {found}");
    }
    near(number(end, "state_4"), 0.75e-3, 1e-15);
    let (g, lambda) = (2e4 / 2.6, 2e4 * 0.3 / (1.3 * 0.4));
    let expected = -90.0 + (lambda + 2.0 * g) * -2e-3 + lambda * 1e-3 + 5e3 * 1e-3;
    assert!((number(end, "stress_22") - expected).abs() < 1e-10);
    assert!((number(end, "stress_12") - g * 1e-3).abs() < 1e-12);
}

#[test]
fn a_stiffness_by_rows_is_read_by_rows() {
    let place = or_skip!(skew());
    // Stresses are asked for, so that the tangent is used.
    let control = "control = { 11 = { strain = 1e-3 }, 22 = { stress = -90.0 }, \
                   12 = { stress = 5.0 } }";
    let most = |keys: &str| {
        let rows = rows(&place, &skewed(keys, 0.0, control));
        let end = rows.last().unwrap();
        assert!((number(end, "stress_22") + 90.0).abs() < 1e-7);
        assert!((number(end, "stress_12") - 5.0).abs() < 1e-7);
        let iterations = rows.iter().skip(1).map(|row| number(row, "iterations"));
        iterations.fold(0.0, f64::max)
    };
    assert!(most(ROWS) < most(""), "the tangent is that of the routine");
}

/// `iTimeDep`: the model receives true times, and a segment without a time is reported.
#[test]
fn a_model_that_depends_on_the_time_is_given_it() {
    let place = or_skip!(place("clock", &["udsm/clock.c"]));
    let of_skew = skewed(ROWS, 0.0, STRAINED);
    let text = of_skew.replace("libskew", "libclock");
    let (g, lambda) = (2e4 / 2.6, 2e4 * 0.3 / (1.3 * 0.4));
    let strained = -90.0 + (lambda + 2.0 * g) * -2e-3 + lambda * 1e-3 + 5e3 * 1e-3;
    for (time, passed) in [("time = 30.0\n", 30.0), ("", 4.0)] {
        let text = text.replacen("increments = 4\n", &format!("increments = 4\n{time}"), 1);
        place.write("driver.toml", text);
        let outcome = place.done(&["point", "driver.toml", "--csv", "out.csv"]);
        let found = *column(&place.path("out.csv"), "stress_22").last().unwrap();
        let expected = strained - 2.0 * passed;
        close(passed, found, expected, 1e-9);
        let is_told = outcome.says("depends on the time");
        assert_eq!(is_told, time.is_empty(), "{}", outcome.stderr);
    }
}

#[test]
fn an_undrained_group_says_so() {
    let place = or_skip!(skew());
    let law = "law = \"model_1\"\nadapter = \"udsm\"\nlibrary = \"libskew.so\"\n\
               tangent_order = \"rows\"\n\
               parameters = { young_modulus = 1e4, poisson_ratio = 0.3, skew = 0.0, wrong = 0.0 }\n";
    let edits = [
        &*format!("{ELASTIC} => {law}"),
        r#"integration = "full"\n => integration = "full"\ndrainage = "undrained"\n"#,
        r#"name = "push"\n => name = "push"\ndrainage = { soil = "drained" }\n"#,
        r#"[solver] => flag = { group = "soil", quantity = "state_1" }\n\n[solver]"#,
    ];
    let text = words::edited(CASE, &edits);
    place.done_case(text);
    for row in table(&place.path("out/history.csv")) {
        if number(&row, "increment") > 0.0 {
            let expected = f64::from(u8::from(row["phase"] == "weight"));
            assert!((number(&row, "flag") - expected).abs() < 1e-12, "{row:?}");
        }
    }
}

#[test]
fn what_a_routine_does_wrong_is_named() {
    let place = or_skip!(skew());
    for [wrong, code, message] in words::rows_of(
        "
1 | 2 | the routine ends task 2 with iAbort = 7
2 | 3 | the routine leaves Sig with values that are not finite
3 | 3 | the routine writes beyond the end of Sig, which has 6 entries
4 | 3 | the routine overwrites Props, which is an input
5 | 3 | the law ended its process
6 | 3 | the routine leaves D unwritten in task 6
7 | 3 | the routine returns a stress yz or zx of 1e0
",
    ) {
        let driver = skewed(ROWS, wrong.parse().unwrap(), STRAINED);
        place.write("driver.toml", driver);
        let outcome = place.run(&["point", "driver.toml", "--csv", "out.csv"]);
        assert_eq!(
            outcome.code,
            code.parse().ok(),
            "{wrong}: {}",
            outcome.stderr
        );
        outcome.shows(message);
    }
    // The call is kept, and repeated.
    place.write("driver.toml", skewed(ROWS, 1.0, STRAINED));
    place.run(&["point", "driver.toml", "--csv", "out.csv"]);
    let text = place.read("out.failure.toml");
    let capsule: toml::Table = toml::from_str(&text).unwrap();
    let foreign = &capsule["law"]["foreign"];
    assert_eq!(foreign["adapter"].as_str(), Some("udsm"));
    assert_eq!(foreign["tangent_order"].as_str(), Some("rows"));
    let outcome = place
        .run(&["replay", "out.failure.toml"])
        .ended(NO_EQUILIBRIUM);
    outcome.prints("as recorded: `cut step`");
}

#[test]
fn a_udsm_fills_a_shear_zone() {
    let place = or_skip!(soils());
    let text = "law = \"sand\"\nadapter = \"shear_zone\"\nthickness = 5e-3\n\
                hypothesis = \"interface_2d\"\n\
                [initial]\ntraction = { n = -100.0, t = 0.0 }\n\
                [laws.sand]\nlaw = \"Mohr_Coulomb\"\nadapter = \"udsm\"\n\
                library = \"libsoils.so\"\n[laws.sand.parameters]\nE = 20e3\nnu = 0.3\nc = 0.0\n\
                phi = 35.0\npsi = 0.0\n\
                [[segment]]\nincrements = 50\ncontrol = { t = { jump = 5e-4 } }\n";
    for row in rows(&place, text) {
        let line = 20e3 / 2.6 * number(&row, "jump_t") / 5e-3;
        let expected = line.min(100.0 * 35_f64.to_radians().sin());
        near(number(&row, "traction_t"), expected, 1e-6);
    }
}

#[test]
fn mistakes_are_said_where_they_are_made() {
    let place = or_skip!(soils());
    let text = format!(
        "{MOHR_COULOMB}hypothesis = \"plane_strain\"\n[parameters]\n{THEIRS}[[segment]]\n\
         increments = 1\ncontrol = {{ 11 = {{ strain = 1e-3 }} }}\n"
    );
    let run = ["point", "driver.toml"];
    refuses_file(
        &place,
        ("driver.toml", &text),
        &run,
        PLUGIN_TROUBLE,
        r#"
"Mohr_Coulomb" => "Mohr"
  has no law `Mohr`
  Elastic, Mohr_Coulomb
"#,
    );
    refuses_file(
        &place,
        ("driver.toml", &text),
        &run,
        BAD_INPUT,
        r#"
phi = 35.0\n =>
  needs parameter `phi` [deg]
  driver.toml
hypothesis => sidecar = "libsoils.so"\nhypothesis
  `sidecar` is for `adapter = "umat"`
  driver.toml
hypothesis => record = "call.toml"\nhypothesis
  `record` is for `adapter = "umat"`
  driver.toml
"udsm" => "mfront"\ntangent_order = "rows"
  `tangent_order` is for `adapter = "udsm"`
  driver.toml
"plane_strain" => "interface_2d"
  11 = { strain => t = { jump
  is made for plane_strain, axisymmetric, 3d
  `adapter = "shear_zone"` with a `thickness` makes
"#,
    );
    // Another kind of library; nothing of the routine's runs before it is asked for.
    place.write("libsoils.so", b"no library");
    place.write("driver.toml", text);
    let outcome = place.run(&["point", "driver.toml"]).ended(PLUGIN_TROUBLE);
    outcome.shows("libsoils.so");
}
