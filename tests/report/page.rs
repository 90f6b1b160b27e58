//! Content of the page.

use crate::folders::{CASE, edited, folders, page_of};
use results::report::{default_path, write};
use serde_json::Value;
use std::path::{Path, PathBuf};
use tests::case::run_text;
use text::Error;

/// The data for the page's script, as text.
fn json(page: &str) -> &str {
    let (_, rest) = page
        .split_once("<script type=\"application/json\" id=\"data\">")
        .unwrap();
    rest.split_once("</script>").unwrap().0
}

/// The data for the page's script.
fn data(page: &str) -> Value {
    serde_json::from_str(json(page)).unwrap()
}

/// Values of an attribute.
fn attributes<'a>(page: &'a str, name: &str) -> Vec<&'a str> {
    page.split(&format!(" {name}=\""))
        .skip(1)
        .filter_map(|rest| rest.split_once('"').map(|(value, _)| value))
        .collect()
}

#[test]
fn needs_no_network() {
    for page in [
        page_of(&folders().layer),
        std::fs::read_to_string(&folders().comparison).unwrap(),
    ] {
        let plain = page
            .replace("http://www.w3.org/2000/svg", "")
            .replace("http%3A%2F%2Fwww.w3.org", "");
        for foreign in ["http:", "https:", "//cdn", "@import", "url(http", "<link"] {
            assert!(!plain.contains(foreign), "{foreign}");
        }
        assert!(page.contains("default-src 'none'"));
    }
}

#[test]
fn texts_of_the_case_stay_texts() {
    let page = page_of(&folders().layer);
    assert_eq!(page.matches("<script").count(), 3);
    assert_eq!(page.matches("</script>").count(), 3);
    assert!(!page.contains("alert(1)</script>"));
    assert!(!page.contains("shear <b>"));
    let drawn = data(&page);
    assert_eq!(drawn[0]["figures"][0]["title"], "</script> & \"shear\" <i>");
    assert_eq!(drawn[0]["history"]["phases"][1], "shear <b>");
}

#[test]
fn the_data_are_short_and_finite() {
    let page = page_of(&folders().layer);
    let drawn = data(&page);
    let mut count = 0;
    for word in json(&page).split([',', ':', '[', ']', '{', '}']) {
        let Ok(number) = word.parse::<f64>() else {
            continue;
        };
        count += 1;
        assert!(number.is_finite(), "{word}");
        let mantissa = word.split('e').next().unwrap_or_default();
        let digits: String = mantissa.chars().filter(char::is_ascii_digit).collect();
        assert!(digits.trim_matches('0').len() <= 7, "{word}");
    }
    assert!(count > 1000, "{count}");
    assert!(page.len() < 250_000, "{}", page.len());
    let history = &drawn[0]["history"];
    assert_eq!(history["increment"].as_array().unwrap().len(), 5);
    let names: Vec<&str> = history["names"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(Value::as_str)
        .collect();
    assert_eq!(
        names,
        ["time", "w", "force", "tau", "slip", "half", "iterations"]
    );
    // The law with this internal variable comes with the second phase.
    assert_eq!(history["values"][4][0], Value::Null);
    assert!(history["values"][4][4].as_f64().unwrap() > 0.0);
    let units = &drawn[0]["units"];
    assert_eq!(units["w"], "mm");
    assert_eq!(units["force"], "kN/m");
    assert_eq!(units["tau"], "kPa");
    assert_eq!(units["plastic_slip"], "m");
    assert_eq!(units["half"], Value::Null);
}

#[test]
fn profiles_and_fields_are_all_there() {
    let drawn = data(&page_of(&folders().layer));
    let profile = &drawn[0]["profile"];
    assert_eq!(profile["increments"].as_array().unwrap().len(), 5);
    assert_eq!(profile["increments"][4]["time"], 2);
    let group = &profile["groups"][0];
    assert_eq!(group["name"], "layer");
    assert_eq!(group["vertical"], true);
    assert_eq!(group["rows"], 3);
    // Three stations in each of four elements, in order along the interface.
    let s: Vec<f64> = group["s"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(Value::as_f64)
        .collect();
    assert_eq!(s.len(), 12);
    assert!(s.windows(2).all(|pair| pair[0] < pair[1]));
    let fields = &drawn[0]["fields"];
    assert_eq!(fields["groups"], serde_json::json!(["soil", "layer"]));
    assert_eq!(fields["times"][1]["label"], "shear <b>, increment 4");
    let slip = fields["names"]
        .as_array()
        .unwrap()
        .iter()
        .position(|name| name == "plastic_slip")
        .unwrap();
    // The fields of the first time are written before there is such a law.
    assert_eq!(fields["times"][0]["values"][slip], serde_json::json!([]));
    let last = fields["times"][1]["values"][slip].as_array().unwrap();
    assert_eq!(last.len(), 12);
    assert!(last[11].as_f64().unwrap().abs() > 0.0);
}

#[test]
fn says_what_was_run() {
    let page = page_of(&folders().layer);
    for expected in [
        "<td>kPa</td>",
        "plane strain",
        "joint from phase shear",
        "Friction angle",
        "[0, 90)",
        "plastic_slip",
        "force tolerance",
        "case.toml</summary>",
        "friction_angle = 5.0",
        "factorisations",
    ] {
        assert!(page.contains(expected), "{expected}");
    }
    assert!(page.contains("class=\"status done\""));
    assert!(!page.contains("role=\"alert\""));
}

#[test]
fn a_run_without_equilibrium_says_so_at_the_top() {
    let page = page_of(&folders().overloaded);
    let (head, _) = page.split_once("<main>").unwrap();
    assert!(head.contains("role=\"alert\""));
    assert!(head.contains("no equilibrium beyond"));
    assert!(head.contains("What is shown ends with the last state of equilibrium"));
    assert!(page.contains("cut-backs</summary>"));
}

#[test]
fn links_lead_to_the_files() {
    let folders = folders();
    let folder = folders.comparison.parent().unwrap();
    let page = std::fs::read_to_string(&folders.comparison).unwrap();
    let links: Vec<&str> = attributes(&page, "href")
        .into_iter()
        .filter(|link| !link.starts_with('#'))
        .collect();
    assert_eq!(links.len(), 15, "{links:?}");
    for link in links {
        let path = link
            .replace("&#x2f;", "/")
            .replace("%20", " ")
            .replace("%26", "&");
        assert!(folder.join(&path).is_file(), "{path}");
    }
}

#[test]
fn compares_values_and_settings() {
    let page = std::fs::read_to_string(&folders().comparison).unwrap();
    assert!(page.contains("<title>Comparison: layer &amp; more, joint, overloaded</title>"));
    let row = |section: &str, name: &str| {
        let cell = format!("<td>{section}</td><th scope=\"row\">{name}</th>");
        let (before, after) = page.split_once(&cell).unwrap();
        let (cells, _) = after.split_once("</tr>").unwrap();
        let differs = before.ends_with("<tr class=\"different\">");
        (cells.to_owned(), differs)
    };
    let (cells, differs) = row("law joint (interface_2d)", "friction_angle");
    assert!(differs);
    assert_eq!(
        cells,
        "<td>5 deg</td><td class=\"other\">4 deg</td><td>5 deg</td>"
    );
    let (_, differs) = row("law joint (interface_2d)", "cohesion");
    assert!(!differs);
    let (cells, _) = row("group layer", "formulation");
    assert!(cells.contains("thin layer") || cells.contains("thin_layer"));
    assert!(page.contains("to layer &amp; more</th>"));
    assert_eq!(data(&page).as_array().unwrap().len(), 3);
}

#[test]
fn folders_of_one_name_are_told_apart() {
    let place = tempfile::tempdir().unwrap();
    let folders = ["a", "b"].map(|name| place.path().join(name).join("run"));
    for folder in &folders {
        run_text(CASE, folder).unwrap();
    }
    let out = write(&folders, &default_path(&folders)).unwrap();
    assert_eq!(out, place.path().join("a").join("report.html"));
    let page = std::fs::read_to_string(out).unwrap();
    assert!(page.contains("Comparison: a&#x2f;run, b&#x2f;run"));
    assert!(page.contains("No setting differs."));
}

#[test]
fn a_case_without_probes_profile_and_fields_has_a_report() {
    let place = tempfile::tempdir().unwrap();
    let (start, rest) = CASE.split_once("[probes]").unwrap();
    assert!(rest.contains("[output]"));
    run_text(start, place.path()).unwrap();
    write(&[place.path().to_owned()], place.path()).unwrap();
    let page = page_of(place.path());
    assert!(page.contains("The case has no probes."));
    assert!(!page.contains("id=\"profiles\""));
    assert!(!page.contains("id=\"contours\""));
}

#[test]
fn says_where_it_cannot_write() {
    let folder = folders().layer.clone();
    let under_a_file = folder.join("history.csv").join("report.html");
    let outcome = write(&[folder], &under_a_file);
    assert!(
        matches!(outcome, Err(Error::Unwritable { .. })),
        "{outcome:?}"
    );
    assert!(matches!(
        write(&[], Path::new("report.html")),
        Err(Error::Usage(_))
    ));
}

#[test]
fn default_places() {
    let path = |text: &str| PathBuf::from(text);
    assert_eq!(
        default_path(&[path("results/a")]),
        path("results/a/report.html")
    );
    let several = default_path(&[path("results/a"), path("results/b")]);
    assert!(several.ends_with("results/report.html"));
}

#[test]
fn warnings_are_repeated() {
    let place = tempfile::tempdir().unwrap();
    let unusual = edited(&[
        ("young_modulus = 1e4", "young_modulus = 2e9"),
        ("y = -6e-3", "y = -1e-9"),
    ]);
    let warnings = run_text(&unusual, place.path()).unwrap().warnings;
    assert!(!warnings.is_empty());
    write(&[place.path().to_owned()], place.path()).unwrap();
    let page = page_of(place.path());
    assert!(page.contains("outside its usual range"), "{warnings:?}");
}
