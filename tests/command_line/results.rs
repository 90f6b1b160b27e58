//! Output of runs that succeed and of others.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::JOINT;
use crate::program::{BAD_INPUT, CASE, DONE, NO_EQUILIBRIUM, Place, edited};
use crate::troubled;
use std::ffi::OsStr;
use std::path::Path;
use tests::case::table;
use tests::or_skip;
use tests::words::words;

/// The upper half slides on the joint: without friction 10 kPa over 2 m resist, and a pressure
/// acts on 0.5 m, so 40 of its 100 kPa can be carried.
pub(crate) fn sliding() -> String {
    let slide: [&str; 5] = [
        "friction_angle = 30.0 => friction_angle = 0.0",
        "dilatancy_angle = 5.0 => dilatancy_angle = 0.0",
        "[mesh.lines] => [mesh.lines]\nside = { x = 2.0, y = [0.5, 1.0] }",
        r#"displacement = [{ line = "top", x = 1e-5 }] => pressure = [{ line = "side", value = 100.0 }]"#,
        r#"name = "push"\nincrements = 2 => name = "push"\nincrements = 20"#,
    ];
    edited(&[JOINT, &slide].concat())
}

#[test]
fn prints_plain_lines_of_progress_and_one_line_of_result() {
    let place = Place::new();
    let outcome = place.done_case(CASE);
    assert_eq!(
        outcome.stdout,
        "results in out\nreport in out/report.html\n"
    );
    assert!(
        !outcome.stderr.contains(['\r', '\u{1b}']),
        "{:?}",
        outcome.stderr
    );
    let lines: Vec<&str> = outcome.stderr.lines().collect();
    let starts = [
        "phase weight: 2 increments",
        "phase weight: increment 1/2, ",
        "phase weight: increment 2/2, ",
        "phase push: 2 increments",
        "phase push: increment 1/2, ",
        "phase push: increment 2/2, ",
    ];
    assert_eq!(lines.len(), starts.len(), "{lines:?}");
    for (line, start) in lines.iter().zip(starts) {
        assert!(line.starts_with(start), "{line:?}, expected {start:?}");
    }
}

#[test]
fn warns_of_unusual_parameters_and_goes_on() {
    let place = Place::new();
    let outcome = place.done_case(CASE.replace("1e4", "2e9"));
    let warning = "law `elastic`: young_modulus = 2000000000 kPa is outside its usual range";
    let said = format!("warning: {warning}");
    outcome.shows(&said);
    assert!(outcome.stdout.starts_with("results in out\n"));
    assert_warns(&place, warning);
}

#[test]
fn warns_of_a_phase_that_starts_out_of_balance() {
    let place = Place::new();
    let outcome = place.done_case(edited(&[
        "law = \"joint\" => law = \"soil\"",
        "integration = \"full\" => integration = \"full\"\ninitial_stress = { stress_22 = -100.0 }",
    ]));
    let warning = "phase `weight` starts out of balance by ";
    outcome.shows(warning);
    assert_warns(&place, warning);
    // What held the middle is given up, as the phase says.
    let outcome = place.done_case(edited(&[
        "[[phase]]\nname = \"push\" => [[phase]]\nname = \"hold\"\nincrements = 1\n\
            displacement = [{ line = \"middle\", x = 1e-6 }]\n\n[[phase]]\n\
            name = \"push\"\nfree = [{ line = \"middle\", components = [\"x\"] }]",
    ]));
    outcome.hides("starts out of balance");
    let share = place.summary()["phases"][2]["out_of_balance"].as_f64();
    assert!(share.unwrap() > 1e-3);
}

#[test]
fn a_run_without_anything_unusual_has_no_warnings() {
    let place = Place::new();
    place.done_case(CASE);
    assert_eq!(place.summary()["warnings"], serde_json::json!([]));
}

/// One of the summary's warnings starts like this, and the report shows it.
fn assert_warns(place: &Place, start: &str) {
    let summary = place.summary();
    let warnings = summary["warnings"].as_array().unwrap();
    let mut warnings = warnings.iter().filter_map(|warning| warning.as_str());
    assert!(warnings.any(|warning| warning.starts_with(start)));
    let report = place.read("out/report.html");
    assert!(report.contains(&format!("<li>{start}")));
}

#[test]
fn keeps_what_was_reached_when_there_is_no_equilibrium() {
    let place = Place::new();
    let outcome = place.run_case(sliding()).ended(NO_EQUILIBRIUM);
    assert_eq!(outcome.stdout, "report in out/report.html\n");
    outcome.shows("phase `push`").shows("no equilibrium");
    // 40 of 100 kPa are 8 of 20 increments; the last one of them is the limit itself.
    let rows = table(&place.path("out/history.csv"));
    let pushed = rows.iter().filter(|row| row["phase"] == "push").count();
    assert!((7..=8).contains(&pushed), "{pushed} increments");
    assert_eq!(place.summary()["status"], "no equilibrium");
    let report = place.read("out/report.html");
    assert!(report.contains("<span class=\"status failed\">no equilibrium</span>"));
}

/// A report takes profiles from the memory of the process that wrote them: the page is the one that is made of
/// the files.
#[test]
fn the_report_of_a_run_is_that_of_its_files() {
    let every: &str = r#"profile = "phases" => profile = "increments""#;
    // A layer that is gone in the second phase leaves increments that are no profile of all points.
    let two_layers: [&str; 6] = [
        every,
        "  { n = 1, to = 1.0 },\n =>   { n = 1, to = 0.5 },\n  { n = 1, to = 0.51 },\n  { n = 1, to = 1.0 },\n",
        r#"[mesh.lines] => [[mesh.region]]\ngroup = "seam"\nx = [0.5, 0.51]\n\n[mesh.lines]"#,
        r#"[groups.layer] => [groups.seam]\nformulation = "thin_layer"\nlaw = "joint"\n\n[groups.layer]"#,
        r#"name = "push"\n => name = "push, \"hard\""\ndeactivate = ["seam"]\n"#,
        r#"title = "A block => title = "Two layers, a block"#,
    ];
    let cases = [
        (edited(&[every]), DONE, "increments"),
        (
            edited(&two_layers),
            DONE,
            "profile.csv: 2 of 4 increments are not complete and left out",
        ),
        (
            tests::words::edited(&sliding(), &[every]),
            NO_EQUILIBRIUM,
            "no equilibrium",
        ),
    ];
    for (text, code, shown) in cases {
        let place = Place::new();
        place.run_case(text).ended(code);
        let read = || place.read("out/report.html");
        let of_run = read();
        assert!(of_run.contains(shown), "{shown}");
        assert!(of_run.contains("traction_n"), "no profiles");
        place.done(&["report", "out"]);
        assert!(of_run == read(), "another page is made of the files");
    }
}

/// A study before a run that finds no equilibrium leaves nothing in the folder that would pass for its result.
#[test]
fn a_study_that_fails_leaves_no_results_of_an_earlier_run() {
    let place = Place::new();
    place.run_case(sliding()).ended(NO_EQUILIBRIUM);
    assert!(place.path("out/summary.json").is_file());
    let outcome = place
        .run_case(sliding().replacen("title", "accuracy = 0.1\ntitle", 1))
        .ended(NO_EQUILIBRIUM);
    outcome.shows("the last trial of `accuracy`");
    for gone in words("summary.json history.csv report.html checkpoint.bin") {
        assert!(!place.path("out").join(gone).exists(), "{gone}");
    }
    assert!(place.path("out/accuracy.csv").is_file());
}

/// Iterations with a wrong tangent may not converge. A law of the user's own is named, those that
/// come with the program are not: the checks are among its tests.
#[test]
fn names_the_check_of_a_law_that_may_have_a_wrong_tangent() {
    const CLAUSE: &str = "tells whether a wrong tangent is a cause";
    let place = or_skip!(troubled::place("SHEAR_TANGENT=0.3"));
    let edits = [
        "limit = 1.0e-6 => limit = 1.0",
        // By itself the program would take differences instead.
        r#"max_iterations = 20 => max_iterations = 20\ntangents = "law""#,
    ];
    let case = tests::words::edited(&troubled::case("cut"), &edits);
    let outcome = place.run_case(case).ended(NO_EQUILIBRIUM);
    let check = format!("`pilum check {}` {CLAUSE}", troubled::library());
    outcome.shows(&check);
    // Not what contact does, but what the law says of its own stress.
    let entry = "differs from differences of its own stress by";
    outcome
        .shows(entry)
        .shows("in (t, t)")
        .hides("opens and closes");
    // With the tangent that is right, the law fails of itself.
    let place = troubled::place("").unwrap();
    let outcome = place.run_case(troubled::case("cut")).ended(NO_EQUILIBRIUM);
    outcome.hides(CLAUSE);
    let outcome = Place::new().run_case(sliding()).ended(NO_EQUILIBRIUM);
    outcome.hides(CLAUSE);
}

#[test]
fn leaves_earlier_results_alone_when_the_input_is_bad() {
    let place = Place::new();
    place.done_case(CASE);
    let files = ["history.csv", "summary.json", "report.html"];
    let read = || files.map(|file| std::fs::read(place.path("out").join(file)).unwrap());
    let before = read();
    let outcome = place.refused_case(CASE.replace("\"traction_t\"", "\"traction_s\""));
    assert_eq!(outcome.stdout, "");
    assert!(read() == before);
}

/// A pipe of a table's name would keep the run waiting for a reader.
#[cfg(unix)]
#[test]
fn does_not_write_into_a_pipe() {
    let place = Place::new();
    std::fs::create_dir(place.path("out")).unwrap();
    let made = std::process::Command::new("mkfifo")
        .arg(place.path("out/history.csv"))
        .status();
    assert!(made.unwrap().success());
    let outcome = place.refused_case(CASE);
    assert!(outcome.stderr.contains("history.csv"), "{}", outcome.stderr);
}

/// A link in the results folder is replaced; what it leads to belongs to somebody else.
#[cfg(unix)]
#[test]
fn writes_through_no_link() {
    let files = words(
        "history.csv profile.csv points.csv log.jsonl summary.json summary.json.part checkpoint.bin.part fields.pvd fields_00000.vtu curve.svg report.html",
    );
    let place = Place::new();
    std::fs::create_dir(place.path("out")).unwrap();
    for (number, file) in files.iter().enumerate() {
        place.write(&format!("mine_{number}"), "mine");
        let (mine, name) = (
            place.path(&format!("mine_{number}")),
            place.path("out").join(file),
        );
        if number % 2 == 0 {
            std::os::unix::fs::symlink(mine, name).unwrap();
        } else {
            std::fs::hard_link(mine, name).unwrap();
        }
    }
    std::os::unix::fs::symlink(place.path("nowhere"), place.path("out/fields_00001.vtu")).unwrap();
    place.done_case(with_everything());
    for number in 0..files.len() {
        let mine = place.read(&format!("mine_{number}"));
        assert_eq!(mine, "mine", "{}", files[number]);
    }
    assert!(!place.path("nowhere").exists());
    for file in files
        .iter()
        .filter(|file| Path::new(file).extension() != Some(OsStr::new("part")))
    {
        let found = place.path("out").join(file).symlink_metadata().unwrap();
        assert!(found.is_file() && found.len() > 4, "{file}");
    }
}

/// A name that the user gives is followed, as a shell follows it, but not onto the driver.
#[cfg(unix)]
#[test]
fn a_table_is_not_written_over_its_driver_by_another_name() {
    let place = Place::new();
    let driver = "law = \"elastic\"\nhypothesis = \"3d\"\n\
                  parameters = { young_modulus = 1e4, poisson_ratio = 0.3 }\n\
                  segment = [{ increments = 2, control = { 11 = { strain = 1e-3 } } }]\n";
    place.write("driver.toml", driver);
    std::fs::hard_link(place.path("driver.toml"), place.path("table.csv")).unwrap();
    let outcome = place.refused(&["point", "driver.toml", "--csv", "table.csv"]);
    outcome.shows("would overwrite the driver file");
    std::os::unix::fs::symlink(place.path("there"), place.path("link.csv")).unwrap();
    place.done(&["point", "driver.toml", "--csv", "link.csv"]);
    assert!(place.path("there").is_file());
}

/// Everything a run can write, with a figure called `curve`.
fn with_everything() -> String {
    let figure = "[[figure]]\nname = \"curve\"\nx = \"settlement\"\ny = [\"tau\"]\n";
    let output =
        r#"profile = "phases"\n => profile = "phases"\npoints = "phases"\nfields = "increments"\n"#;
    edited(&[output]) + figure
}

#[test]
fn removes_what_an_earlier_run_left_and_nothing_else() {
    let place = Place::new();
    place.done_case(with_everything());
    let left = words(
        "curve.svg fields.pvd fields_00000.vtu fields_00003.vtu points.csv profile.csv report.html",
    );
    let foreign = words(
        "drawing.svg fields_mine.vtu fields_1.vtu notes.txt report.htm fields_00009.vtu/inside",
    );
    let is_there = |file: &str| place.path("out").join(file).is_file();
    for file in &left {
        assert!(is_there(file), "{file} was not written");
    }
    for file in &foreign {
        place.write(&format!("out/{file}"), "mine");
    }
    // The next run writes none of them but the report, after which nobody asks here.
    let quiet = sliding().replace("profile = \"phases\"", "profile = \"never\"");
    place.run_case(quiet).ended(NO_EQUILIBRIUM);
    for file in left.iter().filter(|file| **file != "report.html") {
        assert!(!is_there(file), "{file} is still there");
    }
    for file in &foreign {
        let text = std::fs::read_to_string(place.path("out").join(file)).unwrap();
        assert_eq!(text, "mine", "{file}");
    }
    let report = place.read("out/report.html");
    assert!(report.contains("no equilibrium") && !report.contains("id=\"contours\""));
}

/// The summary of a run that is killed in the middle.
#[test]
fn a_run_that_was_interrupted_says_running() {
    let place = Place::new();
    let long = CASE.replace(
        "name = \"push\"\nincrements = 2",
        "name = \"push\"\nincrements = 1000000",
    );
    place.write("case.toml", long);
    let mut child = place.start(&["run", "case.toml", "--out", "out"]);
    let begun = || {
        let history = std::fs::read_to_string(place.path("out/history.csv"));
        history.is_ok_and(|text| text.lines().any(|row| row.starts_with("push,")))
    };
    let start = std::time::Instant::now();
    while !begun() {
        assert!(start.elapsed() < std::time::Duration::from_mins(1));
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(place.summary()["status"], "running");
    assert!(!place.path("out/summary.json.part").exists());
    place.done(&["report", "out"]);
    let report = place.read("out/report.html");
    assert!(report.contains("stopped from outside or has not ended yet"));
    // A run that ends says so, and nothing of the interrupted one is left.
    place.done_case(CASE);
    assert_eq!(place.summary()["status"], "done");
}

#[test]
fn a_report_that_cannot_be_written_does_not_hide_the_run() {
    for (case, code) in [(CASE.to_owned(), BAD_INPUT), (sliding(), NO_EQUILIBRIUM)] {
        let place = Place::new();
        place.write("out/report.html/report.html/in_the_way", "");
        let outcome = place.run_case(&case).ended(code);
        outcome.shows("cannot write out/report.html");
        let failed = code == NO_EQUILIBRIUM;
        assert_eq!(outcome.says("no equilibrium beyond"), failed);
        assert_eq!(outcome.stdout.contains("results in out"), !failed);
    }
}

/// Two variants that run, and one that finds no equilibrium.
fn variants() -> String {
    let figure = "[[figure]]\nname = \"curve\"\nx = \"settlement\"\ny = [\"tau\"]\n";
    let variants = "
[[variant]]
name = \"rough\"

[[variant]]
name = \"overloaded\"
phase = [{ name = \"push\", pressure = [{ line = \"side\", value = 1000.0 }] }]

[[variant]]
name = \"rougher\"
laws.joint.parameters.cohesion = 20.0
";
    let side = "pressure = [{ line = \"side\", value = 100.0 }]";
    assert!(sliding().contains(side));
    sliding().replace(side, "pressure = [{ line = \"side\", value = 1.0 }]") + figure + variants
}

#[test]
fn compares_all_variants_that_have_results() {
    let place = Place::new();
    // Left by an earlier run of all variants, and by somebody else.
    place.write("out/curve.svg", "old");
    place.write("out/drawing.svg", "mine");
    let outcome = place.run_case(variants()).ended(NO_EQUILIBRIUM);
    assert_eq!(
        outcome.stdout,
        "results in out/rough\n\
         report in out/rough/report.html\n\
         report in out/overloaded/report.html\n\
         results in out/rougher\n\
         report in out/rougher/report.html\n\
         report in out/report.html\n"
    );
    // The error comes last, after the variants that went on.
    outcome.shows("this is variant `overloaded`");
    let report = place.read("out/report.html");
    assert!(report.contains("<title>Comparison: rough, overloaded, rougher</title>"));
    let read = |file: &str| place.read(file);
    assert!(read("out/curve.svg").starts_with("<svg"));
    assert_eq!(read("out/drawing.svg"), "mine");
}

#[test]
fn one_variant_alone_is_not_compared() {
    let place = Place::new();
    place.write("case.toml", variants());
    let arguments = ["run", "case.toml", "--variant", "rough", "--out", "out"];
    let outcome = place.done(&arguments);
    assert_eq!(
        outcome.stdout,
        "results in out\nreport in out/report.html\n"
    );
    let report = place.read("out/report.html");
    assert!(!report.contains("<title>Comparison"));
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    // Large enough to be shared: 2016 elements of Mohr–Coulomb soil.
    let case =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/bonded_pile/case.toml");
    let text = format!(
        "base = {case:?}\n[output]\npoints = \"phases\"\n[[phase]]\nname = \"push\"\nincrements = 3\n\
         displacement = [{{ line = \"pile_head\", z = -0.00015 }}]\n"
    );
    let place = Place::new();
    place.write("case.toml", &text);
    let results = ["1", "2", "3"].map(|threads| {
        place.done(&[
            "run",
            "case.toml",
            "--variant",
            "m2k",
            "--threads",
            threads,
            "--out",
            threads,
        ]);
        ["history.csv", "points.csv"]
            .map(|name| std::fs::read(place.path(threads).join(name)).unwrap())
    });
    assert!(results[0][1].len() > 1_000_000);
    assert!(results.iter().all(|files| *files == results[0]));
    let outcome = place.refused(&["run", "case.toml", "--threads", "0"]);
    outcome.shows("--threads");
}

#[test]
fn the_error_of_the_mesh_is_said_and_shown_where_it_is_asked_for() {
    let place = Place::new();
    let more = r#"profile = "phases" => profile = "phases"\nfields = "phases"\nmesh_error = true"#;
    let text = edited(&[more]);
    let outcome = place.done_case(text);
    // The layer has none: it is no solid. Soil and layer are linear here or not; the soil is.
    let said = "error of the mesh in the strains, estimated at the end of phase `push`: ";
    let line = outcome
        .stderr
        .lines()
        .find(|line| line.starts_with(said))
        .unwrap();
    assert!(line.contains("(soil ") && !line.contains("layer"), "{line}");
    assert!(!line.contains("yield"), "{line}");
    let read = |name: &str| place.read(name);
    let report = read("out/report.html");
    let shown = report.matches("error of the mesh in the strains").count();
    assert!(shown >= 2, "a line for each phase: {shown}");
    let summary: serde_json::Value = serde_json::from_str(&read("out/summary.json")).unwrap();
    let of_phases = summary["mesh_error"].as_array().unwrap();
    assert_eq!(of_phases.len(), 2);
    assert!(of_phases[1]["groups"][1]["strains"].is_null());
    assert!(read("out/fields_00001.vtu").contains("Name=\"mesh_error\""));

    let text = edited(&[r#"profile = "phases" => mesh_error = "yes""#]);
    place.refused_case(text).shows("mesh_error");
}
