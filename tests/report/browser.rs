//! The page in a real browser: headless Chromium opens it with `?selftest`, the page tries itself
//! out and writes the outcome at its end, and the browser prints the document.
//!
//! Without a browser the tests do nothing but print a remark, or fail (`tests::needs`).

use crate::folders::folders;
use serde_json::Value;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tests::or_skip;

const NAMES: [&str; 4] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];
/// It takes a few seconds.
const PATIENCE: Duration = Duration::from_mins(2);

/// The browser; `None`, with a remark, where absent.
fn chromium() -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let found = std::env::split_paths(&path)
        .flat_map(|folder| NAMES.map(|name| folder.join(name)))
        .find(|program| program.is_file());
    if found.is_none() {
        tests::needs::missing(&format!("a browser ({})", NAMES.join(", ")));
    }
    found
}

/// What the page says of itself; `None` without a browser.
pub(crate) fn selftest(page: &Path) -> Option<Value> {
    let document = document(page, "?selftest")?;
    let (_, outcome) = document
        .split_once("<pre id=\"selftest\">")
        .unwrap_or_else(|| panic!("the page did not try itself out"));
    let (outcome, _) = outcome.split_once("</pre>").unwrap();
    let outcome = outcome
        .replace("&lt;", "<")
        .replace("&gt;", ">")
        .replace("&amp;", "&");
    let outcome: Value = serde_json::from_str(&outcome).unwrap();
    assert_eq!(outcome["errors"], serde_json::json!([]), "{outcome:#}");
    assert_eq!(outcome["failed"], Value::Null, "{outcome:#}");
    for drawn in outcome["canvases"].as_array().unwrap() {
        assert_eq!(drawn, true, "{outcome:#}");
    }
    assert_eq!(outcome["chooser_changes"], true);
    assert!(outcome["png_bytes"].as_u64().unwrap() > 2000);
    Some(outcome)
}

/// The page as it is once its script has run, which says nothing on the console; `None` without a browser.
fn document(page: &Path, query: &str) -> Option<String> {
    let program = chromium()?;
    let place = tempfile::tempdir().unwrap();
    let (document, messages) = (place.path().join("document"), place.path().join("messages"));
    let mut profile = OsStr::new("--user-data-dir=").to_owned();
    profile.push(place.path().join("profile"));
    let page = page.display().to_string();
    let address = format!("file://{}{query}", page.replace(' ', "%20"));
    let mut browser = Command::new(program)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"])
        .args(["--enable-logging=stderr", "--virtual-time-budget=20000"])
        .args([profile.as_os_str(), OsStr::new(&address)])
        .stdout(Stdio::from(std::fs::File::create(&document).unwrap()))
        .stderr(Stdio::from(std::fs::File::create(&messages).unwrap()))
        .spawn()
        .unwrap();
    let start = Instant::now();
    while browser.try_wait().unwrap().is_none() {
        if start.elapsed() > PATIENCE {
            let _ = browser.kill();
            panic!("the browser does not end");
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let messages = String::from_utf8_lossy(&std::fs::read(messages).unwrap()).into_owned();
    let console: Vec<&str> = messages
        .lines()
        .filter(|line| line.contains("CONSOLE"))
        .collect();
    assert!(console.is_empty(), "{console:#?}");
    let document = String::from_utf8_lossy(&std::fs::read(document).unwrap()).into_owned();
    Some(document)
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap()
}

#[test]
fn a_report_works() {
    let outcome = or_skip!(selftest(&folders().layer.join("report.html")));
    // Two figures, the chooser, three profiles, the contours, the residuals.
    assert_eq!(outcome["canvases"].as_array().unwrap().len(), 8);
    for figure in outcome["figures"].as_array().unwrap() {
        assert_eq!(figure["svg"], true);
    }
    let hover = text(&outcome["figures"][0]["hover"]);
    assert!(hover.contains("displacement (mm): 6"), "{hover}");
    assert!(hover.contains("shear <b>, increment 4"), "{hover}");

    let profile = &outcome["profile"];
    assert_eq!(text(&profile["first"][0]), "press, increment 1 · w = 0 mm");
    assert_eq!(
        text(&profile["last"][0]),
        "shear <b>, increment 4 · w = 6 mm"
    );
    assert_ne!(profile["first"][1], profile["last"][1]);
    // One curve becomes four: those of the phase.
    assert!(text(&profile["last"][1]).starts_with("1:"));
    assert!(text(&profile["overlaid"]).starts_with("4:"));
    assert_eq!(profile["svg"], true);

    let contour = &outcome["contour"];
    let states: Vec<&str> = contour["states"]
        .as_array()
        .unwrap()
        .iter()
        .map(text)
        .collect();
    assert!(
        states.windows(2).all(|pair| pair[0] != pair[1]),
        "{states:?}"
    );
    assert_eq!(contour["drawn"], true);
    assert_eq!(contour["svg"], true);
    assert!(text(&contour["hover"]).starts_with("soil, element 1\nstress_11: "));
    assert!(text(&outcome["residuals"]["hover"]).contains("iteration"));
}

#[test]
fn a_run_without_equilibrium_has_a_report_that_works() {
    selftest(&folders().overloaded.join("report.html"));
}

#[test]
fn a_comparison_works() {
    let outcome = or_skip!(selftest(&folders().comparison));
    let hover = text(&outcome["figures"][0]["hover"]);
    assert!(hover.starts_with("layer & more: force\n"), "{hover}");
    // At the end two of the runs have a profile, at the start all three.
    assert!(text(&outcome["profile"]["first"][1]).starts_with("3:"));
    assert!(text(&outcome["profile"]["last"][1]).starts_with("2:"));
}

#[test]
fn a_missing_browser_is_named() {
    let what = format!("a browser ({})", NAMES.join(", "));
    tests::needs::assert_named("browser::a_comparison_works", &what);
}

/// The page of a study draws all of its pictures, from whatever its runs came to.
#[test]
fn a_study_is_drawn() {
    let place = tempfile::tempdir().unwrap();
    crate::folders::study(place.path());
    let page = results::report::write(
        &[place.path().to_owned()],
        &place.path().join("report.html"),
    );
    let page = page.unwrap();
    let document = or_skip!(document(&page, ""));
    assert!(document.contains("data-drawn=\"yes\""), "{document}");
    let count = |what: &str| document.matches(what).count();
    // Two outputs by two parameters; a tornado each; the curves and their colours.
    assert_eq!(count("<svg class=\"plot\""), 4 + 2 + 2, "{document}");
    // Three runs have numbers, of four.
    assert_eq!(count("<circle class=\"point\""), 3 * 4);
    assert_eq!(count("<polyline class=\"run\""), 3);
    assert!(document.contains("1 run could not come to the end"));
    assert!(document.contains("no way &lt;b&gt; further"));
}
