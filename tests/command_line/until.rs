//! Phases that end where a quantity reaches a value.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{Outcome, Place, edited, refuses};

/// Settlement of the block under the whole pressure, in the unit of its probe: it is linear but for the joint.
fn run(edits: &[&str]) -> (Outcome, Vec<Vec<String>>) {
    let place = Place::new();
    place.write("case.toml", edited(edits));
    let outcome = place.done(&["run", "case.toml", "--out", "out"]);
    let history = place.read("out/history.csv");
    let rows = history.lines().skip(1);
    let rows = rows.map(|row| row.split(',').map(str::to_owned).collect());
    (outcome, rows.collect())
}

const PROBES: &str =
    r#"[probes]\n => [probes]\nbelow = { line = "bottom", quantity = "reaction_y" }\n"#;

fn of_phase(rows: &[Vec<String>], phase: &str) -> Vec<[f64; 3]> {
    let own = rows.iter().filter(|row| row[0] == phase);
    // Time, reaction below, settlement.
    own.map(|row| [2, 3, 4].map(|column| row[column].parse().unwrap()))
        .collect()
}

#[test]
fn a_phase_ends_where_its_quantity_reaches_the_value() {
    let (_, whole) = run(&[PROBES]);
    let full = of_phase(&whole, "weight")[1];
    let target = 0.3 * full[2];
    let until = format!(
        "value = 10.0 }}] => value = 10.0 }}]\nuntil = {{ quantity = \"settlement\", reaches = {target} }}"
    );
    let (outcome, rows) = run(&[PROBES, &until]);
    outcome.shows("`settlement` has reached");
    let ended = of_phase(&rows, "weight");
    let [time, below, settlement] = *ended.last().unwrap();
    assert!(
        settlement >= target * (1.0 - 1e-9) && settlement <= 1.01 * target,
        "{settlement}"
    );
    // Linear: what the phase changed stays where it is, also in the next phase.
    assert!((time / (settlement / full[2]) - 1.0).abs() < 1e-6, "{time}");
    assert!((below / full[1] - time).abs() < 1e-9, "{below}");
    for [later, below, _] in of_phase(&rows, "push") {
        assert!((below / full[1] - time).abs() < 1e-9, "{below}");
        assert!(later > time && later <= time + 1.0 + 1e-12, "{later}");
    }
}

#[test]
fn what_is_reached_already_takes_no_increment() {
    let (outcome, rows) = run(&[
        PROBES,
        r#"displacement = [{ line = "top", x = 1e-5 }] => pressure = [{ line = "top", value = 20.0 }]\nuntil = { quantity = "settlement", reaches = 0.01 }"#,
    ]);
    assert_eq!(
        of_phase(&rows, "push"),
        Vec::<[f64; 3]>::new(),
        "{}",
        outcome.stderr
    );
    outcome
        .shows("phase push: no increment: `settlement` is ")
        .shows("at its start, already beyond 0.01");
}

/// Half of the excess pressure is left where the phase that drains ends; it stays, and the ground settles no more.
#[test]
fn excess_pressure_that_is_left_stays() {
    let excess = r#"[probes]\n => [probes]\nexcess = { group = "soil", quantity = "excess_pore_pressure" }\n"#;
    let drain = |until: &str| {
        let (_, rows) = run(&[
            excess,
            r#"law = "soil" => law = "soil"\ndrainage = "undrained""#,
            &format!("displacement = [{{ line = \"top\", x = 1e-5 }}] => {until}"),
        ]);
        let [weight, push, after] = ["weight", "push", "after"].map(|name| of_phase(&rows, name));
        [weight[1], push[push.len() - 1], after[after.len() - 1]]
    };
    let after = "drainage = { soil = \"drained\" }\nuntil = { quantity = \"excess\", reaches = 2.0 }\n\
         [[phase]]\nname = \"after\"\nincrements = 2";
    let [[_, before, _], [_, ended, settled], [_, left, later]] = drain(after);
    assert!(before > 3.0 && ended < 2.01, "{before} {ended}");
    assert!((left / ended - 1.0).abs() < 1e-12, "{left} {ended}");
    assert!((later / settled - 1.0).abs() < 1e-6, "{later} {settled}");
    let again = "drainage = { soil = \"drained\" }\nuntil = { quantity = \"excess\", reaches = 2.0 }\n\
         [[phase]]\nname = \"after\"\nincrements = 2\ndrainage = { soil = \"drained\" }";
    let [.., [_, left, later]] = drain(again);
    assert!(left.abs() < 1e-9 && later > settled, "{left}");
}

#[test]
fn what_is_not_reached_is_said() {
    let (outcome, rows) = run(&[
        PROBES,
        r#"x = 1e-5 }] => x = 1e-5 }]\nuntil = { quantity = "settlement", reaches = 1e3 }"#,
    ]);
    assert_eq!(of_phase(&rows, "push").len(), 2);
    outcome.shows("`settlement` has not reached 1000");
}

#[test]
fn refuses_what_would_be_left_half_done() {
    refuses(
        r#"
no such quantity
  name = "push" => name = "push"\nuntil = { quantity = ^"setlement", reaches = 1.0 }
  `setlement`
  did you mean `settlement`?
a change of laws
  name = "push" => name = "push"\nlaws = { layer = "joint" }\nuntil = ^{ quantity = "settlement", reaches = 1.0 }
  `until` may end this phase before its time
  `laws`
a strain
  name = "push" => name = "push"\nstrain = { soil = 1e-5 }\nuntil = ^{ quantity = "settlement", reaches = 1.0 }
  `strain` would be left half done
"#,
    );
}
