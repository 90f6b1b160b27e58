//! A small case with everything a report shows, run once for all tests.

use input::{Error, Kind};
use results::report;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;
use tests::case::run_text;

/// Two blocks with a layer between them: pressed together, then sheared after a swap of laws.
/// Its title wants to end the script it is put into.
pub(crate) const CASE: &str = r#"title = "A </script><script>alert(1)</script> & \"layer\""
analysis = "plane_strain"
supports = [{ line = "right", fixed = ["x", "y"] }]

[mesh]
columns = [{ n = 1, to = 0.5 }, { n = 1, to = 0.51 }, { n = 1, to = 1.0 }]
rows = [{ n = 4, to = 1.0 }]

[[mesh.region]]
group = "soil"

[[mesh.region]]
group = "layer"
x = [0.5, 0.51]

[mesh.lines]
left = { x = 0.0 }
right = { x = 1.0 }
bottom = { y = 0.0 }

[laws.soil]
law = "elastic"
parameters = { young_modulus = 1e4, poisson_ratio = 0.3 }

[laws.joint]
law = "coulomb_joint"
[laws.joint.parameters]
normal_stiffness = 1e6
shear_stiffness = 4e5
cohesion = 1.0
friction_angle = 5.0
dilatancy_angle = 1.0

[groups.soil]
formulation = "solid"
integration = "full"
law = "soil"

[groups.layer]
formulation = "thin_layer"
law = "soil"


[[phase]]
name = "press"
increments = 1
pressure = [{ line = "left", value = 50.0 }]

[[phase]]
name = "shear <b>"
increments = 4
laws = { layer = "joint" }
displacement = [{ line = "left", y = -6e-3 }]

[probes]
w = { line = "left", quantity = "displacement_y", scale = -1000.0 }
force = { line = "left", quantity = "reaction_y", scale = -1.0 }
tau = { group = "layer", quantity = "traction_t" }
slip = { group = "layer", quantity = "plastic_slip" }
half = { combine = { tau = 0.5 } }

[output]
profile = "increments"
fields = "phases"

[[figure]]
name = "shear"
title = "</script> & \"shear\" <i>"
x = "w"
x_label = "displacement (mm)"
y = ["force", "tau"]

[[figure]]
name = "slip"
x = "w"
y = ["slip"]
phase = "shear <b>"
"#;

/// The case with other words.
pub(crate) fn edited(edits: &[(&str, &str)]) -> String {
    edits.iter().fold(CASE.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "the case has no {from:?}");
        text.replace(from, to)
    })
}

/// Runs a case and writes the report of its folder.
pub(crate) fn reported(text: &str, folder: &Path) -> Result<(), Error> {
    let outcome = run_text(text, folder);
    report::write(&[folder.to_owned()], &folder.join("report.html")).unwrap();
    outcome.map(|_| ())
}

/// Folders with results: of the case; with a zero-thickness joint of another friction; with a load
/// that nothing can carry.
pub(crate) struct Folders {
    _place: TempDir,
    pub(crate) layer: PathBuf,
    pub(crate) joint: PathBuf,
    pub(crate) overloaded: PathBuf,
    pub(crate) comparison: PathBuf,
}

pub(crate) fn folders() -> &'static Folders {
    static FOLDERS: OnceLock<Folders> = OnceLock::new();
    FOLDERS.get_or_init(|| {
        let place = tempfile::tempdir().unwrap();
        let of = |name: &str| place.path().join(name);
        let folders = Folders {
            layer: of("layer & more"),
            joint: of("joint"),
            overloaded: of("overloaded"),
            comparison: of("comparison.html"),
            _place: place,
        };
        reported(CASE, &folders.layer).unwrap();
        let joint = edited(&[
            ("group = \"layer\"\nx = [0.5, 0.51]", "group = \"soil\"\nx = [0.5, 0.51]"),
            ("left = { x = 0.0 }", "left = { x = 0.0 }\nmiddle = { x = 0.5 }"),
            (
                "formulation = \"thin_layer\"\nlaw = \"soil\"",
                "formulation = \"zero_thickness\"\nline = \"middle\"\nlaw = \"joint\"",
            ),
            ("friction_angle = 5.0", "friction_angle = 4.0"),
            ("A </script><script>alert(1)</script> & \\\"layer\\\"", "A joint"),
        ]);
        reported(&joint, &folders.joint).unwrap();
        let overloaded = edited(&[(
            "displacement = [{ line = \"left\", y = -6e-3 }]",
            "displacement = [{ line = \"left\", y = 0.0 }]\npressure = [{ line = \"bottom\", value = 500.0 }]",
        ), ("bottom = { y = 0.0 }", "bottom = { y = 0.0, x = [0.0, 0.5] }"), (
            "displacement = [{ line = \"left\", y = 0.0 }]\n",
            "",
        )]);
        let outcome = reported(&overloaded, &folders.overloaded);
        assert!(
            outcome.as_ref().is_err_and(|error| error.kind() == Kind::NoEquilibrium),
            "{outcome:?}"
        );
        let all = [&folders.layer, &folders.joint, &folders.overloaded].map(Clone::clone);
        report::write(&all, &folders.comparison).unwrap();
        folders
    })
}

/// The text of a folder's report.
pub(crate) fn page_of(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("report.html")).unwrap()
}

/// A study of four runs in a folder, as its files are: one failed before it had results.
pub(crate) fn study(folder: &std::path::Path) {
    use results::study::{Output, ParameterRecord, Record, Row, Standing, State};
    let parameter = |name: &str, key: &str| ParameterRecord {
        name: name.to_owned(),
        keys: vec![key.to_owned()],
        spread: "two values".to_owned(),
    };
    let record = Record {
        program: "pilum".to_owned(),
        title: "A study of <b>".to_owned(),
        design: "grid".to_owned(),
        is_grid: true,
        is_saltelli: false,
        texts: String::new(),
        identity: String::new(),
        files: std::collections::BTreeMap::new(),
        parameters: vec![
            parameter("phi", "laws.a.phi"),
            parameter("law", "laws.a.law"),
        ],
        outputs: vec![Output::last("q"), Output::last("w")],
    };
    let mut rows = Vec::new();
    for (index, (phi, law)) in (1..).zip([(20, "a"), (20, "b<"), (30, "a"), (30, "b<")]) {
        let place = folder.join(format!("{index:05}"));
        std::fs::create_dir_all(&place).unwrap();
        let (state, reason) = if index == 4 {
            ("bad input", "no way <b> further")
        } else {
            let q = f64::from(phi) + f64::from(index);
            let history =
                format!("phase,increment,time,w,q,iterations\na,1,1,0,0,1\nb,1,2,1,{q},1\n");
            std::fs::write(place.join("history.csv"), history).unwrap();
            ("done", "")
        };
        let run = serde_json::json!({ "identity": "", "state": state, "reason": reason });
        std::fs::write(place.join("run.json"), run.to_string()).unwrap();
        rows.push(Row {
            index: index as usize,
            folder: format!("{index:05}"),
            values: vec![phi.to_string(), law.to_owned()],
            standing: Standing::plain(State::Planned),
            numbers: vec![None; 2],
        });
    }
    record.write(folder).unwrap();
    record.write_table(folder, &rows).unwrap();
}
