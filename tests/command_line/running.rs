//! The report of a run that is under way.

use crate::program::Place;
use std::time::{Duration, Instant, SystemTime};

/// The chamber in this many increments that it takes some seconds.
fn place() -> Place {
    let place = Place::new();
    let chamber = include_str!("../../cases/chamber_mesh1/case.toml");
    let long = chamber
        .replace("increments = 50", "increments = 40000")
        .replace("profile = \"increments\"", "profile = \"never\"")
        .replace("fields = \"phases\"", "fields = \"never\"");
    place.write("case.toml", long);
    place
}

const MARK: &str = "id=\"running\"";
const ARGUMENTS: [&str; 5] = ["run", "case.toml", "--out", "out", "--resume"];

#[test]
fn a_run_under_way_has_a_report_that_says_so_and_is_always_whole() {
    let place = place();
    let report = place.path("out/report.html");
    let mut child = place.start(&ARGUMENTS);
    let started = Instant::now();
    let mut seen: Vec<SystemTime> = Vec::new();
    // The second one may come late: writing them takes a hundredth of the time.
    while seen.len() < 2 && (seen.is_empty() || started.elapsed() < Duration::from_secs(4)) {
        assert!(started.elapsed() < Duration::from_mins(2), "no report");
        assert!(
            child.try_wait().unwrap().is_none(),
            "the run was too short: {seen:?}"
        );
        std::thread::sleep(Duration::from_millis(3));
        let Ok(text) = std::fs::read_to_string(&report) else {
            continue;
        };
        assert!(started.elapsed() >= Duration::from_secs(1));
        assert!(text.trim_end().ends_with("</html>"), "{} bytes", text.len());
        assert!(text.contains(MARK), "not marked");
        assert!(text.contains("<span class=\"status done\">running</span>"));
        let written = std::fs::metadata(&report)
            .and_then(|found| found.modified())
            .unwrap();
        if seen.last() != Some(&written) {
            seen.push(written);
        }
    }
    for pair in seen.windows(2) {
        let between = pair[1].duration_since(pair[0]).unwrap();
        assert!(between >= Duration::from_millis(990), "{between:?}");
    }
    // Killed, it leaves what it had; the run that goes on ends with a report without the mark.
    child.kill().unwrap();
    child.wait().unwrap();
    let text = std::fs::read_to_string(&report).unwrap();
    assert!(text.contains(MARK) && text.contains("</html>"));
    place.done(&ARGUMENTS);
    let text = std::fs::read_to_string(&report).unwrap();
    assert!(!text.contains(MARK));
    let left = std::fs::read_dir(place.path("out")).unwrap();
    let partial = left.filter(|entry| {
        entry
            .as_ref()
            .unwrap()
            .file_name()
            .to_string_lossy()
            .ends_with(".part")
    });
    assert_eq!(partial.count(), 0);
}
