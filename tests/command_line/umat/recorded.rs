//! Calls of routines that are recorded, for a debugger.

use super::{driver, number, place, recorded, rows, soil};
use crate::program::{CASE, PLUGIN_TROUBLE};
use tests::case::table;
use tests::or_skip;
use tests::words::rows_of;

#[test]
fn a_call_can_be_recorded() {
    let place = or_skip!(place("elastic"));
    let rows = rows(&place, &driver("elastic", "record = \"call.toml\"", ""));
    let text = place.read("call.toml");
    let call: toml::Table = toml::from_str(&text).unwrap();
    let argument = |when: &str, name: &str| call[when][name].clone();
    let reals = |when: &str, name: &str| -> Vec<f64> {
        let values = argument(when, name);
        let values = values.as_array().unwrap().iter();
        values.map(|value| value.as_float().unwrap()).collect()
    };
    assert_eq!(reals("before", "STRESS"), [0.0; 4]);
    assert_eq!(
        reals("after", "STRESS")[1].to_bits(),
        number(&rows[1], "stress_22").to_bits()
    );
    assert_eq!(reals("before", "PROPS"), [2e4, 0.3]);
    // Column by column.
    let tangent = reals("after", "DDSDDE");
    assert_eq!(tangent.len(), 16);
    assert!(tangent[4] > 0.0 && tangent[3] == 0.0 && tangent[15] > 0.0);
    let name = argument("before", "CMNAME");
    assert_eq!(name.as_str().unwrap(), format!("{:<80}", "UMAT_ELASTIC"));
    assert_eq!(call["before"].as_table().unwrap().len(), 37);
}

#[test]
fn the_option_records_a_call() {
    let place = or_skip!(place("elastic"));
    place.write("driver.toml", driver("elastic", "", ""));
    // What stood there is not mistaken for a record.
    place.write("call.toml", "an earlier one");
    let arguments = ["point", "driver.toml", "--record", "call.toml"];
    let outcome = place.done(&[&arguments[..], &["--csv", "out.csv"]].concat());
    outcome.shows("all arguments of one call in call.toml");
    assert_eq!(recorded(&place, "call.toml", "before", "STRESS"), [0.0; 4]);
    let rows = table(&place.path("out.csv"));
    assert_eq!(
        recorded(&place, "call.toml", "after", "STRESS")[0].to_bits(),
        number(&rows[1], "stress_11").to_bits()
    );

    place.write("case.toml", soil("elastic", ""));
    place.done(&["run", "case.toml", "--out", "out", "--record", "run.toml"]);
    assert_eq!(recorded(&place, "run.toml", "before", "PROPS"), [1e4, 0.3]);

    // With the native law there is nothing to record, with two it is not plain which.
    place.write("native.toml", CASE);
    let own = driver("elastic", "", "")
        .replacen("umat_elastic", "elastic", 1)
        .replacen("adapter = \"umat\"\nlibrary = \"libelastic.so\"\n", "", 1);
    place.write("own.toml", own);
    let second = soil("elastic", "").replacen(
        "[laws.joint]",
        "[laws.other]\nlaw = \"umat_elastic\"\nadapter = \"umat\"\n\
         library = \"libelastic.so\"\n\n[laws.joint]",
        1,
    );
    place.write("two.toml", second);
    for [command, file, says] in rows_of(
        "
run | native.toml | no law of native.toml is a UMAT
run | two.toml | soil, other are UMATs; give the key `record`
point | own.toml | law `elastic` is no UMAT
",
    ) {
        place.write("none.toml", "an earlier one");
        let outcome = place.refused(&[command, file, "--record", "none.toml"]);
        outcome.shows(says);
    }
    place.refused(&["point", "driver.toml", "--record", "no/where.toml"]);
    // What stood there is not lost to a command that was refused.
    let kept = place.read("none.toml");
    assert_eq!(kept, "an earlier one");
}

#[test]
fn a_call_that_never_returns_is_recorded_too() {
    let place = or_skip!(place("stops"));
    place.write(
        "driver.toml",
        driver("stops", "", "how = 1\nlimit = 1.1e-3"),
    );
    place
        .run(&["point", "driver.toml", "--csv", "out.csv"])
        .ended(PLUGIN_TROUBLE);
    place
        .run(&["replay", "out.failure.toml", "--record", "call.toml"])
        .ended(PLUGIN_TROUBLE);
    let rows = table(&place.path("out.csv"));
    let before = recorded(&place, "call.toml", "before", "STRESS");
    assert_eq!(
        before[1].to_bits(),
        number(rows.last().unwrap(), "stress_22").to_bits()
    );
    let text = place.read("call.toml");
    assert!(
        text.ends_with("# The routine has not returned.\n"),
        "{text}"
    );
}
