//! A Mohr–Coulomb routine with its own consistent tangent, `fixtures/umat/mohr_coulomb.f`, against the
//! law `mohr_coulomb`, of which it shares no line.

use super::{last, number, place, rows, soil};
use crate::program::CASE;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use tests::case::table;
use tests::or_skip;
use tests::tolerance::{close, near};
use tests::words::{edited, paths_of, words};

/// Both compute in doubles, in another order; relative to 100 kPa and to a strain of 1 %.
const ROUND_OFF: f64 = 1e-13;
const STRESS: f64 = 100.0;
const STRAIN: f64 = 1e-2;

/// Where a path ends.
#[derive(Debug, PartialEq)]
enum Zone {
    Face,
    /// The two largest principal stresses are equal: triaxial compression.
    CompressionEdge,
    /// The two smallest are: triaxial extension.
    ExtensionEdge,
    Apex,
}

/// By the principal stresses at the end, and whether plastic flow went on in the last increment.
fn zone(rows: &[BTreeMap<String, String>]) -> Zone {
    let [before, end] = rows.last_chunk().unwrap();
    assert!(
        number(end, "plastic_strain") > number(before, "plastic_strain"),
        "it does not flow"
    );
    let [s_11, s_22, s_33, s_12] =
        ["11", "22", "33", "12"].map(|c| number(end, &format!("stress_{c}")));
    let middle = 0.5 * (s_11 + s_22);
    let radius = (0.5 * (s_11 - s_22)).hypot(s_12);
    let mut s = [middle + radius, middle - radius, s_33];
    s.sort_by(|a, b| b.total_cmp(a));
    let equal = |i: usize, j: usize| (s[i] - s[j]).abs() < 1e-9 * STRESS;
    match (equal(0, 1), equal(1, 2)) {
        (false, false) => Zone::Face,
        (true, false) => Zone::CompressionEdge,
        (false, true) => Zone::ExtensionEdge,
        (true, true) => Zone::Apex,
    }
}

/// A driver led by strains from 100 kPa all around, 20 increments to each of the ends 11 22 33 12.
fn driver(law: &str, hypothesis: &str, dilatancy: &str, ends: &[[f64; 4]]) -> String {
    let mut text = format!(
        "{law}\nhypothesis = \"{hypothesis}\"\n[parameters]\nyoung_modulus = 2e4\n\
         poisson_ratio = 0.3\ncohesion = 5.0\nfriction_angle = 35.0\n\
         dilatancy_angle = {dilatancy}\n\
         [initial]\nstress = {{ 11 = -100.0, 22 = -100.0, 33 = -100.0 }}\n"
    );
    for [e_11, e_22, e_33, e_12] in ends {
        let _ = write!(
            text,
            "[[segment]]\nincrements = 20\ncontrol = {{ 11 = {{ strain = {e_11:?} }}, \
             22 = {{ strain = {e_22:?} }}, 33 = {{ strain = {e_33:?} }}, \
             12 = {{ strain = {e_12:?} }} }}\n"
        );
    }
    text
}

#[test]
fn on_faces_edges_and_apex_it_is_the_law() {
    let place = or_skip!(place("mohr_coulomb"));
    let theirs = "law = \"umat_mohr_coulomb\"\nadapter = \"umat\"\n\
                  library = \"libmohr_coulomb.so\"\nin_process = true";
    // Zone, hypothesis, dilatancy. On faces about the axis the hoop stress is the largest, then the smallest; the axes turn
    // while it equals the larger one in the plane.
    let paths = paths_of(
        "
Face plane_strain 10 | 4e-3 -1e-2 0 6e-3; 4e-3 -1e-2 0 -9e-3
Face plane_strain 0 | 8e-3 -1.4e-2 0 6e-3
Face axisymmetric 10 | -1e-2 -2e-3 8e-3 3e-3
Face axisymmetric 10 | 8e-3 -2e-3 -1e-2 3e-3
CompressionEdge axisymmetric 10 | 4e-3 -1e-2 4e-3 0
CompressionEdge axisymmetric 10 | 4e-3 -1e-2 4e-3 0; 9e-3 -1.6e-2 9.2e-3 1e-3
ExtensionEdge axisymmetric 10 | -4e-3 1e-2 -4e-3 0
ExtensionEdge axisymmetric 0 | -4e-3 1e-2 -4e-3 0; -4.2e-3 1.2e-2 -3.9e-3 5e-4
Apex axisymmetric 10 | 1e-2 8e-3 9e-3 2e-3
Apex axisymmetric 0 | 1e-2 8e-3 9e-3 2e-3
Apex plane_strain 10 | 1e-2 8e-3 0 2e-3
",
    );
    for (what, ends) in paths {
        let [expected, hypothesis, dilatancy] = words(what)[..] else {
            panic!("{what}")
        };
        let rows_of = |law: &str| rows(&place, &driver(law, hypothesis, dilatancy, &ends));
        let (ours, theirs) = (rows_of("law = \"mohr_coulomb\""), rows_of(theirs));
        assert_eq!(format!("{:?}", zone(&ours)), expected, "{ends:?}");
        assert_eq!(ours.len(), 1 + 20 * ends.len());
        assert_eq!(ours.len(), theirs.len());
        for (ours, theirs) in ours.iter().zip(&theirs) {
            for column in ours.keys() {
                let scale = match column.as_str() {
                    "increment" | "iterations" => continue,
                    name if name.starts_with("stress") => STRESS,
                    _ => STRAIN,
                };
                let (ours, theirs) = (number(ours, column), number(theirs, column));
                close(
                    format_args!("{what} {column}"),
                    theirs,
                    ours,
                    ROUND_OFF * scale,
                );
            }
        }
    }
}

#[test]
fn its_own_tangent_converges_quadratically() {
    let place = or_skip!(place("mohr_coulomb"));
    let pushed = |text: String| {
        let text = edited(
            &text,
            &[
                "poisson_ratio = 0.3 } => poisson_ratio = 0.3, cohesion = 4.0, friction_angle = 30.0, dilatancy_angle = 5.0 }",
                r"cohesion = 10.0\n => cohesion = 1000.0\ntensile_strength = 1000.0\n",
                "x = 1e-5 } => x = 3e-3 }",
                r#"name = "push"\nincrements = 2 => name = "push"\nincrements = 10"#,
                r#"[solver] => flow = { group = "soil", quantity = "plastic_strain" }\n\n[solver]\nmethod = "newton""#,
            ],
        );
        place.done_case(text);
        let iterations = table(&place.path("out/history.csv"));
        let iterations = iterations.iter().map(|row| number(row, "iterations"));
        (last(&place), iterations.collect::<Vec<_>>())
    };
    let (ours, our_iterations) =
        pushed(CASE.replacen("law = \"elastic\"", "law = \"mohr_coulomb\"", 1));
    let (theirs, their_iterations) = pushed(soil("mohr_coulomb", ""));
    assert_eq!(their_iterations, our_iterations);
    for (theirs, ours) in theirs.iter().zip(&ours) {
        // The tolerance of the iterations, 1e-8, squared by the last of them.
        near(*theirs, *ours, 1e-11 * ours.abs());
    }
    let rows = table(&place.path("out/history.csv"));
    assert!(number(rows.last().unwrap(), "flow") > 1e-4);

    // r_(k+1) ≤ C r_k² below r = 1/(3 C), to the round-off of forces.
    let (c, floor) = (100.0, 1e-11);
    let log = place.read("out/log.jsonl");
    let events = log.lines().map(|line| {
        let event: serde_json::Value = serde_json::from_str(line).unwrap();
        event
    });
    let events: Vec<_> = events.filter(|e| e["event"] == "iteration").collect();
    let mut telling = 0;
    for pair in events.windows(2) {
        let [before, after] = [&pair[0], &pair[1]].map(|e| e["residual"].as_f64().unwrap());
        let same = pair[0]["increment"] == pair[1]["increment"];
        if same && c * before < 1.0 / 3.0 {
            assert!(
                after <= (c * before * before).max(floor),
                "{before:e} {after:e}"
            );
            telling += usize::from(before > 1e3 * floor);
        }
    }
    assert!(telling >= 10, "{telling} pairs tell something");
}
