//! Runs that are stopped, killed or run out of disk, and go on; runs that must not differ.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{BAD_INPUT, CASE, DONE, Place, edited};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};
use tests::case::column;
use tests::words::words;

/// Increments of each of the two phases.
const INCREMENTS: usize = 60;

/// The block next to a layer in many increments, the layer's strength reached, the law's
/// parameters swapped between the phases, everything written that can be.
fn long_case(solver: &str) -> String {
    let swapped = "[laws.weak]\nlaw = \"coulomb_joint\"\n[laws.weak.parameters]\n\
                   normal_stiffness = 1e6\nshear_stiffness = 4e5\ncohesion = 1.0\n\
                   friction_angle = 10.0\ndilatancy_angle = 2.0\n\n[groups.soil]";
    let figures = "[[figure]]\nname = \"push\"\nx = \"settlement\"\ny = [\"tau\"]\n\n\
                   [[figure]]\nname = \"cut\"\nx = \"x\"\ny = [\"stress_11\"]\n\
                   points = { group = \"soil\", increments = [3, 50] }\n\n[output]";
    edited(&[
        "increments = 2 => increments = 60",
        r#"increments = 2\ndis => increments = 60\nlaws = { layer = "weak" }\ndis"#,
        "x = 1e-5 => x = 1e-3",
        r#"profile = "phases" => profile = "increments"\npoints = "increments"\nfields = "increments""#,
    ])
    .replacen("[groups.soil]", swapped, 1)
    .replacen("[output]", figures, 1)
    .replacen("[solver]\n", &format!("[solver]\n{solver}\n"), 1)
}

/// All files of a folder but the report and the checkpoint; the summary without its times.
fn results(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        let bytes = std::fs::read(entry.path()).unwrap();
        let bytes = match name.as_str() {
            "report.html" | "checkpoint.bin" => continue,
            "summary.json" => {
                let mut summary = serde_json::from_slice(&bytes).unwrap();
                forget_times(&mut summary);
                serde_json::to_vec(&summary).unwrap()
            }
            _ => bytes,
        };
        files.insert(name, bytes);
    }
    files
}

fn forget_times(summary: &mut serde_json::Value) {
    match summary {
        serde_json::Value::Object(map) => {
            map.remove("seconds");
            map.values_mut().for_each(forget_times);
        }
        serde_json::Value::Array(items) => items.iter_mut().for_each(forget_times),
        _ => {}
    }
}

/// Results that must be those of `expected`, to the bit.
fn assert_same(found: &Path, expected: &BTreeMap<String, Vec<u8>>, what: &str) {
    let found = results(found);
    let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&found), names(expected), "{what}");
    for (name, bytes) in expected {
        let (a, b) = (&found[name], bytes);
        let at = a.iter().zip(b).position(|(a, b)| a != b);
        let near = |text: &[u8]| {
            let at = at.unwrap_or(0);
            let part = &text[at.saturating_sub(80).min(text.len())..(at + 80).min(text.len())];
            String::from_utf8_lossy(part).into_owned()
        };
        assert!(a == b, "{what}: {name} differs:\n{}\n{}", near(a), near(b));
    }
}

/// Rows of `history.csv`, each of which must be whole.
fn whole_rows(place: &Place) -> usize {
    let Ok(text) = std::fs::read_to_string(place.path("out/history.csv")) else {
        return 0;
    };
    let mut rows = text.split_inclusive('\n');
    let Some(head) = rows.next() else { return 0 };
    let cells = head.matches(',').count();
    let whole = |row: &&str| row.ends_with('\n') && row.matches(',').count() == cells;
    let rows: Vec<&str> = rows.collect();
    // The one row that was being written when the process was killed may be cut short.
    assert!(rows.iter().rev().skip(1).all(&whole), "{text}");
    rows.iter().filter(|row| whole(row)).count()
}

/// Results of a run that nothing stops.
fn undisturbed(text: &str, more: &[&str]) -> BTreeMap<String, Vec<u8>> {
    let place = Place::new();
    place.write("block.toml", text);
    place.done(&[&["run", "block.toml", "--out", "out"], more].concat());
    results(&place.path("out"))
}

/// Kills the run of a case at this many different moments, resumes it, and compares. `rows`: of its
/// history.
fn killed_and_resumed(text: &str, rows: usize, kills: u32) {
    let started = Instant::now();
    let expected = undisturbed(text, &["--checkpoint", "0"]);
    let mut length = started.elapsed().as_secs_f64();
    let place = Place::new();
    place.write("block.toml", text);
    let run = words("run block.toml --out out --checkpoint 0 --resume");
    let mut on_the_way = 0;
    for kill in 0..kills {
        // A scatter of moments, the same every time.
        let share = f64::from(kill.wrapping_mul(2_654_435_769)) / f64::from(u32::MAX);
        let is_new = !place.path("out").exists();
        let mut child = place.start(&run);
        std::thread::sleep(Duration::from_secs_f64(0.9 * share * length));
        child.kill().unwrap();
        child.wait().unwrap();
        on_the_way += usize::from((1..rows).contains(&whole_rows(&place)));
        if whole_rows(&place) == rows {
            // The run whose time was taken had other tests beside it.
            if is_new {
                length *= 0.9 * share;
            }
            // Resumed often enough to have come to its end: the next run starts anew.
            // The process that did the work may take a moment to follow the one that was killed, and
            // writes until then, by path: a checkpoint would come into the next run's folder. It holds
            // this lock to its end.
            std::fs::File::open(place.path("out/history.csv"))
                .and_then(|history| history.lock())
                .unwrap();
            let since = Instant::now();
            while let Err(why) = std::fs::remove_dir_all(place.path("out")) {
                assert!(since.elapsed() < Duration::from_secs(5), "{why}");
                std::thread::sleep(Duration::from_millis(10));
            }
        }
    }
    assert!(
        on_the_way * 4 > kills as usize,
        "only {on_the_way} kills hit the run on its way"
    );
    place.done(&run);
    assert_same(&place.path("out"), &expected, "killed and resumed");
}

#[test]
fn methods_that_keep_a_matrix_resume_to_the_same_bits() {
    // 20 iterations are too few for the slow ones, and far beyond the layer's strength even 500.
    for method in ["auto", "quasi_newton", "modified_newton", "initial_stress"] {
        let solver = format!("method = \"{method}\"\nforce_tolerance = 1e-6");
        let text = long_case(&solver)
            .replace("max_iterations = 20", "max_iterations = 500")
            .replace("x = 1e-3", "x = 2e-5");
        stopped_and_resumed(&text, &undisturbed(&text, &[]), method);
    }
}

#[test]
fn groups_that_wait_for_a_complete_state_resume_to_the_same_bits() {
    // The sand waits, and the pile but for its head and toe: probes look at these and the interface only. Where
    // rounding of the way since the complete state counts, that is completed in time; where it would be again and again,
    // the pile follows as a whole.
    let chamber = include_str!("../../cases/chamber_mesh1/case.toml");
    let text = chamber.replace("increments = 50", "increments = 150");
    for (control, tolerance) in [
        ("load", 1e-9),
        ("arc_length", 1e-9),
        ("load", 3e-12),
        ("load", 5e-13),
    ] {
        let solver = format!("control = \"{control}\"\nforce_tolerance = {tolerance:e}");
        let text = format!("{text}\n[solver]\n{solver}\n");
        let expected = undisturbed(&text, &[]);
        assert_eq!(expected.contains_key("path.csv"), control == "arc_length");
        stopped_and_resumed(&text, &expected, &solver);
    }
}

#[test]
fn the_table_of_a_pile_goes_on_to_the_same_bits() {
    let text = crate::pile::PILE.replace("increments = 12", "increments = 600");
    let expected = undisturbed(&text, &[]);
    assert!(expected.contains_key("pile.csv"));
    stopped_and_resumed(&text, &expected, "pile");
}

/// A block pulled off another one. No force ever acts: residuals are measured against the largest
/// entry of the last matrix, which may be that of a run before.
const FORCELESS: &str = r#"
analysis = "plane_strain"
supports = [{ line = "bottom", fixed = ["x", "y"] }]
[mesh]
columns = [{ n = 2, to = 1.0 }]
rows = [{ n = 2, to = 1.0 }, { n = 1, to = 1.01 }, { n = 2, to = 2.0 }]
region = [{ group = "soil" }, { group = "layer", y = [1.0, 1.01] }]
lines = { bottom = { y = 0.0 }, top = { y = 2.0 } }
[laws.soil]
law = "elastic"
parameters = { young_modulus = 1e8, poisson_ratio = 0.3 }
[laws.joint]
law = "coulomb_joint"
[laws.joint.parameters]
normal_stiffness = 1e3
shear_stiffness = 1e3
cohesion = 0.0
friction_angle = 30.0
dilatancy_angle = 0.0
[groups.soil]
formulation = "solid"
integration = "full"
law = "soil"
[groups.layer]
formulation = "thin_layer"
in_plane = "none"
integration = "mean"
law = "joint"
[[phase]]
name = "lift"
increments = 1500
displacement = [{ line = "top", y = 0.1, x = 0.3 }]
[probes]
q = { line = "top", quantity = "reaction_x" }
[solver]
equations = "sparse"
"#;

#[test]
fn a_run_without_any_force_resumes_to_the_same_bits() {
    for method in ["auto", "newton"] {
        let text = format!("{FORCELESS}method = \"{method}\"\n");
        stopped_and_resumed(&text, &undisturbed(&text, &[]), method);
    }
}

/// One node takes a rigid line with it, and its reaction is that of the whole line.
#[test]
fn a_node_that_leads_a_rigid_line_goes_on_to_the_same_bits() {
    let edits = [
        "top = { => pole = { x = 0.0, y = 2.0 }, top = {",
        r#"increments = 1500 => increments = 1500\nrigid = ["top"]"#,
        r#"line = "top", y = 0.1 => line = "pole", y = -0.1"#,
        r#"line = "top", quantity => line = "pole", quantity"#,
    ];
    let text = tests::words::edited(FORCELESS, &edits);
    for text in [&text, &text.replace("equations = \"sparse\"\n", "")] {
        let undisturbed = Place::new();
        undisturbed.write("block.toml", text);
        undisturbed.done(&["run", "block.toml", "--out", "out"]);
        // Friction of all of the layer, which is pressed together by a tenth of a metre.
        let reaction = *column(&undisturbed.path("out/history.csv"), "q")
            .last()
            .unwrap();
        let expected = 1e3 * 0.1 * f64::to_radians(30.0).tan();
        assert!((reaction - expected).abs() < 1e-4 * expected, "{reaction}");
        stopped_and_resumed(text, &results(&undisturbed.path("out")), "led");
    }
}

/// Interrupts a run as Ctrl-C does, resumes it, and compares.
fn stopped_and_resumed(text: &str, expected: &BTreeMap<String, Vec<u8>>, what: &str) {
    let place = Place::new();
    place.write("block.toml", text);
    let run = ["run", "block.toml", "--out", "out", "--resume"];
    let mut stops = 0;
    loop {
        let rows = whole_rows(&place);
        let mut child = place.start(&run);
        let patience = Instant::now();
        while whole_rows(&place) < rows + 25 && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
            assert!(
                patience.elapsed() < Duration::from_mins(1),
                "{what}: no progress"
            );
        }
        interrupt(child.id());
        match child.wait().unwrap().code() {
            Some(DONE) => break,
            code => assert_eq!(code, Some(130), "{what}"),
        }
        stops += 1;
        let summary = place.read("out/summary.json");
        assert!(summary.contains("\"status\": \"interrupted\""), "{summary}");
        assert!(place.path("out/report.html").is_file());
    }
    assert!(stops > 0, "{what}: the run was never stopped on its way");
    // The log of a run that was stopped says so; all else is the same.
    let mut found = results(&place.path("out"));
    let log = String::from_utf8(found.remove("log.jsonl").unwrap()).unwrap();
    assert!(!log.contains("interrupted"), "{log}");
    found.insert("log.jsonl".to_owned(), log.into_bytes());
    assert_same(&place.path("out"), expected, what);
}

#[cfg(unix)]
fn interrupt(process: u32) {
    // It may have ended by itself.
    tests::needs::signal("INT", &process.to_string());
}

#[test]
fn two_hundred_kills_lose_nothing() {
    killed_and_resumed(&long_case(""), 2 * INCREMENTS, 100);
    killed_and_resumed(&long_case("equations = \"sparse\""), 2 * INCREMENTS, 100);
}

/// Interfaces that appear, a swap of laws, a load test with what it counts: on a coarse mesh.
#[test]
fn a_pile_that_is_killed_goes_on_to_the_same_tables() {
    let text = include_str!("../../cases/bored_pile/case.toml")
        .replace("{ n = 5, to = 1.5", "{ n = 2, to = 1.5")
        .replace(
            "{ n = 10, to = 25.0, ratio = 1.35 }",
            "{ n = 4, to = 25.0, ratio = 2.0 }",
        )
        .replace("{ n = 8, to = -17.0", "{ n = 3, to = -17.0")
        .replace("{ n = 8, to = -15.0", "{ n = 2, to = -15.0")
        .replace("{ n = 20, to = -5.0", "{ n = 6, to = -5.0")
        .replace("{ n = 8, to = 0.0 }", "{ n = 3, to = 0.0 }");
    killed_and_resumed(&text, 1 + 5 + 30 + 7, 12);
}

#[test]
fn the_same_case_gives_the_same_files() {
    let text = long_case("");
    let [first, again, elsewhere] = [(); 3].map(|()| Place::new());
    for place in [&first, &again, &elsewhere] {
        place.write("block.toml", &text);
    }
    elsewhere.write("below/here", "");
    first.done(&["run", "block.toml", "--out", "out"]);
    let expected = results(&first.path("out"));
    // Both at the same time, one with one thread and one with two.
    let mut children = [(&again, "1"), (&elsewhere, "2")]
        .map(|(place, n)| place.start(&["run", "block.toml", "--out", "out", "--threads", n]));
    for child in &mut children {
        assert_eq!(child.wait().unwrap().code(), Some(DONE));
    }
    assert_same(&again.path("out"), &expected, "one thread");
    assert_same(&elsewhere.path("out"), &expected, "two threads");
}

#[test]
fn a_full_disk_leaves_whole_rows() {
    let place = Place::new();
    place.write("block.toml", long_case(""));
    // 100 blocks of 512 or 1024 bytes for every file; beyond that writing fails, as on a full disk.
    let outcome = place.run_limited(
        "trap '' XFSZ; ulimit -f 100",
        &["run", "block.toml", "--out", "out"],
    );
    let outcome = outcome.ended(BAD_INPUT);
    outcome.shows("cannot write");
    for name in ["history.csv", "profile.csv", "points.csv", "log.jsonl"] {
        let text = std::fs::read_to_string(place.path("out").join(name)).unwrap();
        assert!(text.ends_with('\n'), "{name} ends with a row cut short");
    }
}

#[test]
fn a_checkpoint_of_another_case_or_a_damaged_one_is_refused() {
    let place = Place::new();
    place.write("block.toml", CASE);
    let run = words("run block.toml --out out --checkpoint 0 --resume");
    place.done(&run);
    place.done(&run).shows("done already");
    place.write("block.toml", CASE.replace("1e-5", "2e-5"));
    place.refused(&run).shows("it belongs to another case");
    let path = place.path("out/checkpoint.bin");
    let mut bytes = std::fs::read(&path).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    std::fs::write(&path, bytes).unwrap();
    place.refused(&run).shows("the file is damaged");
}

#[test]
fn files_that_were_changed_since_the_checkpoint_are_named() {
    let place = Place::new();
    place.write("block.toml", long_case(""));
    let run = words("run block.toml --out out --checkpoint 0 --resume");
    place.done(&run);
    for file in ["history.csv", "profile.csv", "points.csv", "log.jsonl"] {
        let path = place.path("out").join(file);
        let good = std::fs::read(&path).unwrap();
        // The last digit, one in the middle, one in the head.
        for at in [good.len() - 2, good.len() / 2, 3] {
            let mut bytes = good.clone();
            bytes[at] ^= 1;
            std::fs::write(&path, bytes).unwrap();
            let outcome = place.run(&run).ended(BAD_INPUT);
            outcome.shows(file).shows("changed or removed");
        }
        std::fs::write(&path, good).unwrap();
    }
    let field = place.path("out/fields_00003.vtu");
    let good = std::fs::read(&field).unwrap();
    std::fs::write(&field, &good[1..]).unwrap();
    assert!(place.run(&run).says("fields_00003.vtu"));
    std::fs::remove_file(&field).unwrap();
    place.refused(&run).shows("fields_00003.vtu");
    std::fs::write(&field, &good).unwrap();
    place.done(&run).shows("done already");
}

#[test]
fn two_runs_do_not_write_into_one_folder() {
    let place = Place::new();
    place.write("block.toml", CASE);
    place.write("out/log.jsonl", "");
    let log = std::fs::File::open(place.path("out/log.jsonl")).unwrap();
    log.lock().unwrap();
    let outcome = place.refused(&["run", "block.toml", "--out", "out"]);
    outcome.shows("another run is writing into this folder");
}
