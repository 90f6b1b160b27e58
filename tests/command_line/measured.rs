//! Measured points of figures.

use crate::program::{BAD_INPUT, CASE, DONE, Outcome, Place};
use serde_json::Value;
use tests::words::rows_of;

fn run(place: &Place, measured: &str) -> Outcome {
    let figure = "[[figure]]\nname = \"push\"\nx = \"settlement\"\ny = [\"tau\"]\n";
    place.run_case(format!("{CASE}\n{figure}measured = {measured}\n"))
}

#[test]
fn measured_points_are_drawn_as_markers() {
    for (file, text) in [
        ("comma.csv", "# a test\nw (mm),load\n1,10\n2, 20\n\n,30\n"),
        ("semicolon.csv", "w (mm);load\n1;10\n# later\n2;20\n"),
        ("tab.txt", "w (mm)\t\"load\"\n1\t10\n2\t20\n"),
    ] {
        let place = Place::new();
        place.write(file, text);
        let one = format!("{{ file = \"{file}\", x = \"w (mm)\", y = \"load\", y_scale = 0.1 }}");
        run(&place, &one).ended(DONE);
        let out = place.path("out");
        let svg = std::fs::read_to_string(out.join("push.svg")).unwrap();
        // Two points, and one in the legend.
        assert_eq!(svg.matches("<circle").count(), 3, "{file}");
        assert!(svg.contains("measured"), "{file}");
        let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
        let summary: Value = serde_json::from_str(&summary).unwrap();
        let measured = &summary["figures"][0]["measured"];
        let points = serde_json::json!([{ "label": "measured", "x": [1.0, 2.0], "y": [1.0, 2.0] }]);
        assert_eq!(*measured, points, "{file}");
        let report = std::fs::read_to_string(out.join("report.html")).unwrap();
        assert!(report.contains(&measured.to_string()), "{file}");
    }
}

#[test]
fn a_list_and_a_cut_take_measured_points() {
    let place = Place::new();
    place.write("test.csv", "z,s,t\n0.1,1,2\n0.5,2,3\n");
    let table =
        |y: &str| format!("{{ file = \"test.csv\", x = \"z\", y = \"{y}\", label = \"{y}\" }}");
    let figure = "[[figure]]\nname = \"cut\"\nx = \"y\"\ny = [\"stress_22\"]\npoints = {}\n";
    let both = format!(
        "{CASE}\n{figure}measured = [{}, {}]\n",
        table("s"),
        table("t")
    );
    place.done_case(both);
    let svg = std::fs::read_to_string(place.path("out").join("cut.svg")).unwrap();
    assert_eq!(svg.matches("<circle").count(), 6);
}

#[test]
fn what_cannot_be_drawn_is_refused_at_its_key() {
    let place = Place::new();
    place.write("test.csv", "# of 1998\nw,load\n1,10\n2,ten\n3,1e400\n");
    place.write("comma.csv", "w;load\n1,5;10\n");
    place.write("empty.csv", "w,load\n,1\n");
    // Blank lines and remarks are lines, before and between the rows.
    place.write(
        "blank.csv",
        "\n# a test\nw,load\n\n1,10\n\r\n\n# later\n2,ten\n",
    );
    for [measured, at, says] in rows_of(
        r#"
{ file = ^"tset.csv", x = "w", y = "load" } | `file`: cannot read tset.csv | tset.csv
{ file = "test.csv", x = "w", y = ^"laod" } | `y`: test.csv has no column `laod` | did you mean `load`? There is: w, load
{ file = "test.csv", x = "w", y = ^"load" } | test.csv, line 4: | `ten` in column `load` is no number
{ file = "blank.csv", x = "w", y = ^"load" } | blank.csv, line 9: | `ten` in column `load` is no number
{ file = "comma.csv", x = ^"w", y = "load" } | comma.csv, line 2: `1,5` in column `w` is no number | is a decimal point meant? `1.5`, not `1,5`
{ file = ^"empty.csv", x = "w", y = "load" } | empty.csv has no row with | `w` and `load`
[{ file = "test.csv", x = "w", y = "w", ^scale = 2 }] | unknown key `scale` | y_scale
^3 | `measured`: found the number 3 | or a list of them
^{ file = "test.csv", x = "w" } | missing key | `y`
"#,
    ) {
        let column = "measured = ".len() + measured.find('^').unwrap() + 1;
        let outcome = run(&place, &measured.replacen('^', "", 1)).ended(BAD_INPUT);
        for text in [at, says, &format!(":{column}|")] {
            outcome.shows(text);
        }
        assert!(!place.path("out").exists(), "{measured}");
    }
}

/// Another zero is added after the factor; a reversed axis turns the curve, and a report for paper has no controls.
#[test]
fn points_are_moved_and_an_axis_is_reversed() {
    let place = Place::new();
    place.write("points.csv", "w,load\n1,10\n2,20\n");
    let figure = "[[figure]]\nname = \"push\"\nx = \"tau\"\ny = [\"settlement\"]\n";
    let table = "measured = { file = \"points.csv\", x = \"load\", y = \"w\", x_scale = 0.1, x_offset = -0.5, y_offset = 3.0 }\n";
    let mut heights = Vec::new();
    for reversed in [false, true] {
        let text = format!("{CASE}\n{figure}{table}y_reversed = {reversed}\n");
        place.done_case(text);
        let summary = place.summary();
        let points = &summary["figures"][0]["measured"][0];
        assert_eq!(points["x"], serde_json::json!([0.5, 1.5]));
        assert_eq!(points["y"], serde_json::json!([4.0, 5.0]));
        let svg = place.read("out/push.svg");
        let circles = svg.split("<circle").skip(1);
        let height = |circle: &str| -> f64 {
            let at = circle.split_once("cy=\"").unwrap().1;
            at.split_once('"').unwrap().0.parse().unwrap()
        };
        let own: Vec<f64> = circles.map(height).collect();
        heights.push(own[1] - own[0]);
    }
    assert!(heights[0] < 0.0 && heights[1] > 0.0, "{heights:?}");
    place.done(&["report", "out", "--print", "--out", "paper.html"]);
    let paper = place.read("paper.html");
    for text in [
        "class=\"paper print\"",
        "title-block",
        "Appendix: all settings",
    ] {
        assert!(paper.contains(text), "{text}");
    }
}
