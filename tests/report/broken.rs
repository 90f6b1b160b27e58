//! Folders in which something is missing or broken: a note in the page or an error, no panic.

use crate::folders::{folders, page_of};
use results::report::write;
use std::path::Path;
use tempfile::TempDir;
use text::Error;

const FILES: [&str; 7] = [
    "history.csv",
    "profile.csv",
    "fields.pvd",
    "fields_00000.vtu",
    "fields_00001.vtu",
    "log.jsonl",
    "summary.json",
];

/// A copy of good results.
fn copy() -> TempDir {
    let place = tempfile::tempdir().unwrap();
    for file in FILES {
        std::fs::copy(folders().layer.join(file), place.path().join(file)).unwrap();
    }
    place
}

fn report(folder: &Path) -> Result<String, Error> {
    write(&[folder.to_owned()], folder)?;
    Ok(page_of(folder))
}

fn edit(folder: &Path, file: &str, edit: impl Fn(&str) -> String) {
    let path = folder.join(file);
    let text = std::fs::read_to_string(&path).unwrap();
    let edited = edit(&text);
    assert_ne!(text, edited, "{file}");
    std::fs::write(path, edited).unwrap();
}

#[test]
fn a_folder_without_a_history_is_no_results_folder() {
    let place = copy();
    std::fs::remove_file(place.path().join("history.csv")).unwrap();
    match report(place.path()) {
        Err(Error::Unreadable { path, .. }) => assert!(path.ends_with("history.csv")),
        outcome => panic!("{outcome:?}"),
    }
}

#[test]
fn another_table_is_no_history() {
    for text in ["", "jump_n,jump_t\n1,2\n", "phase,increment\n", "\u{0}\n"] {
        let place = copy();
        std::fs::write(place.path().join("history.csv"), text).unwrap();
        match report(place.path()) {
            Err(error @ Error::Input(_)) => {
                assert!(error.to_string().contains("time"), "{error}");
            }
            outcome => panic!("{text:?}: {outcome:?}"),
        }
    }
}

#[test]
fn every_other_file_may_be_missing() {
    for file in &FILES[1..] {
        let place = copy();
        std::fs::remove_file(place.path().join(file)).unwrap();
        let page = report(place.path()).unwrap();
        let unfinished = page.contains("class=\"status failed\"");
        assert_eq!(unfinished, *file == "summary.json", "{file}");
    }
    let place = copy();
    for file in &FILES[1..] {
        std::fs::remove_file(place.path().join(file)).unwrap();
    }
    let page = report(place.path()).unwrap();
    assert!(page.contains("there is no summary.json"));
    assert!(page.contains("there is no convergence history"));
}

#[test]
fn a_run_that_was_stopped_is_unfinished() {
    let place = copy();
    edit(place.path(), "log.jsonl", |text| {
        text[..text.len() / 2].to_owned()
    });
    let page = report(place.path()).unwrap();
    assert!(page.contains("log.jsonl has no end"));
    assert!(page.contains("log.jsonl: 1 line is not complete and left out"));
}

#[test]
fn a_run_that_has_not_come_to_its_end_shows_what_its_log_warns_of() {
    let place = copy();
    edit(place.path(), "summary.json", |text| {
        let mut summary: serde_json::Value = serde_json::from_str(text).unwrap();
        summary["status"] = "running".into();
        summary.as_object_mut().unwrap().remove("warnings").unwrap();
        summary.to_string()
    });
    edit(place.path(), "log.jsonl", |text| {
        let event = r#"{"event":"unreliable","phase":"press","increment":1,"reason":"too coarse"}"#;
        format!("{text}{event}\n")
    });
    let page = report(place.path()).unwrap();
    assert!(page.contains("<strong>unfinished.</strong>"));
    assert!(page.contains("stopped from outside or has not ended yet"));
    assert!(page.contains("<li>phase `press`, increment 1: too coarse</li>"));
}

#[test]
fn rows_that_are_not_complete_are_left_out_with_a_note() {
    let place = copy();
    edit(place.path(), "history.csv", |text| {
        text[..text.len() - 20].to_owned()
    });
    edit(place.path(), "profile.csv", |text| {
        text[..text.len() - 20].to_owned()
    });
    let page = report(place.path()).unwrap();
    assert!(page.contains("history.csv: 1 row is not complete and left out, the first in line 6"));
    assert!(page.contains("profile.csv: 1 of 5 increments are not complete and left out"));
    assert!(page.contains("shear &lt;b&gt;, increment 3"));
}

#[test]
fn other_columns_and_numbers_that_are_none_do_no_harm() {
    let place = copy();
    edit(place.path(), "history.csv", |text| {
        let mut lines = text.lines().map(|line| format!("{line},NaN"));
        let header = lines.next().unwrap().replace("NaN", "extra");
        let rest: String = lines.map(|line| line + "\n").collect();
        format!("{header}\n{rest}").replace(",2.0", ",inf2.0")
    });
    let page = report(place.path()).unwrap();
    assert!(page.contains("extra"));
    assert!(!page.contains("NaN,") && !page.contains(":NaN"));
}

#[test]
fn a_history_without_increments_is_said_to_be_one() {
    let place = copy();
    edit(place.path(), "history.csv", |text| {
        text.lines().next().unwrap().to_owned() + "\n"
    });
    let page = report(place.path()).unwrap();
    assert!(page.contains("history.csv has no increment"));
}

#[test]
fn broken_fields_are_left_out_with_the_reason() {
    let place = copy();
    edit(place.path(), "fields_00001.vtu", |text| {
        text.replacen("0e0", "0e", 1)
    });
    let page = report(place.path()).unwrap();
    assert!(page.contains("fields_00001.vtu: `0e` is not a number"));
    assert!(page.contains("id=\"contours\""));
}

#[test]
fn a_summary_of_other_shape_does_no_harm() {
    for text in [
        "null",
        "[]",
        "{\"laws\": 1, \"groups\": {\"a\": 2}, \"phases\": [1, null], \"figures\": \"x\"}",
        "{\"status\": 3, \"figures\": [{\"name\": 1}], \"solver\": []}",
    ] {
        let place = copy();
        std::fs::write(place.path().join("summary.json"), text).unwrap();
        let page = report(place.path()).unwrap();
        assert!(page.contains("class=\"status failed\""), "{text}");
    }
}

#[test]
fn files_cut_anywhere_never_panic() {
    let place = copy();
    for file in FILES {
        let whole = std::fs::read(folders().layer.join(file)).unwrap();
        for part in 0..24 {
            let end = whole.len() * part / 24 + part % 7;
            std::fs::write(place.path().join(file), &whole[..end.min(whole.len())]).unwrap();
            match report(place.path()) {
                Ok(page) => assert!(page.ends_with("</html>\n") || page.ends_with("</html>")),
                Err(error) => assert_eq!(file, "history.csv", "{error}"),
            }
        }
        std::fs::write(place.path().join(file), whole).unwrap();
    }
}
