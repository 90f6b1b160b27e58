//! What the driver refuses.
//!
//! Goal        every slip in a driver file gives one message at its place and exit code 1.
//! Set-up      a driver with one fault each.
//! Law         elastic, coulomb_joint, mepi.
//! Asserts     exit code, key facts of the message, the underlined text.

use crate::driver::{MEPI, attempt};
use input::Error;

const SOLID: &str = "law = 'elastic'\nhypothesis = 'plane_strain'\n[parameters]\n\
    young_modulus = 1e5\npoisson_ratio = 0.25\n";
const JOINT: &str = "law = 'coulomb_joint'\nhypothesis = 'interface_2d'\n[parameters]\n\
    normal_stiffness = 1e6\nshear_stiffness = 4e5\ncohesion = 5\nfriction_angle = 35\n\
    dilatancy_angle = 13.5\n";
const SEGMENT: &str = "[[segment]]\nincrements = 1\ncontrol = {}\n";

/// The driver is refused; its message and hint hold these parts.
fn refuses(text: &str, parts: &[&str]) {
    let error = tests::driver::of_text(text).unwrap_err();
    assert_eq!(error.exit_code(), 1, "{error}\n{text}");
    assert!(
        matches!(error, Error::Text(text::Error::Input(_))),
        "{error:?}"
    );
    let all = format!("{error} {error:?}");
    for part in parts {
        assert!(all.contains(part), "`{part}` is not in {error:?}");
    }
}

fn solid(control: &str) -> String {
    format!("{SOLID}[[segment]]\nincrements = 1\ncontrol = {{ {control} }}")
}

fn joint(control: &str) -> String {
    format!("{JOINT}[[segment]]\nincrements = 1\ncontrol = {{ {control} }}")
}

#[test]
fn unknown_keys() {
    refuses(
        &format!("laws_path = 'x'\n{SOLID}{SEGMENT}"),
        &["laws_path", "law_path"],
    );
    refuses(&format!("{SOLID}[initials]\n{SEGMENT}"), &["initials"]);
    refuses(
        &format!("{SOLID}[initial]\nstrain = {{}}\n{SEGMENT}"),
        &["strain", "stress"],
    );
    refuses(
        &format!("{SOLID}[[segment]]\nincrement = 1\ncontrol = {{}}"),
        &["increment"],
    );
    refuses(&solid("22 = { displacement = 1 }"), &["displacement"]);
}

#[test]
fn missing_keys() {
    refuses("hypothesis = '3d'", &["law"]);
    refuses("law = 'elastic'", &["hypothesis"]);
    refuses(SOLID, &["no [[segment]]"]);
    refuses(
        &format!("{SOLID}[[segment]]\ncontrol = {{}}"),
        &["increments"],
    );
    refuses(&format!("{SOLID}[[segment]]\nincrements = 1"), &["control"]);
}

#[test]
fn hypotheses() {
    let text = format!("{SOLID}{SEGMENT}");
    refuses(
        &text.replace("plane_strain", "plain_strain"),
        &["plain_strain", "did you mean `plane_strain`"],
    );
    refuses(
        &text.replace("plane_strain", "interface_2d"),
        &["elastic", "interface_2d"],
    );
}

#[test]
fn components() {
    refuses(
        &solid("n = { strain = 1 }"),
        &["component `n`", "11, 22, 33, 12"],
    );
    refuses(
        &solid("13 = { strain = 1 }"),
        &["component `13` under plane_strain"],
    );
    refuses(&joint("22 = { jump = 1 }"), &["component `22`", "n, t"]);
    refuses(
        &format!("{SOLID}[initial]\nstress = {{ 21 = 1 }}\n{SEGMENT}"),
        &["component `21`"],
    );
}

#[test]
fn kinds_of_control() {
    refuses(
        &solid("22 = { jump = 1 }"),
        &["`22`", "`jump`", "strain, stress"],
    );
    refuses(
        &solid("22 = { traction = 1 }"),
        &["`traction`", "strain, stress"],
    );
    refuses(
        &solid("22 = { stiffness = 1 }"),
        &["`stiffness`", "strain, stress"],
    );
    refuses(
        &joint("n = { strain = 1 }"),
        &["`strain`", "jump, traction, stiffness"],
    );
    refuses(
        &joint("n = { stress = 1 }"),
        &["`stress`", "jump, traction, stiffness"],
    );
    refuses(&joint("n = {}"), &["`n`", "exactly one"]);
    refuses(
        &joint("n = { jump = 1, traction = 2 }"),
        &["`n`", "exactly one"],
    );
    refuses(
        &joint("n = { stiffness = -2.5 }"),
        &["stiffness", "-2.5", "[0, ∞)"],
    );
}

#[test]
fn initial_states_of_the_wrong_kind() {
    refuses(
        &format!("{SOLID}[initial]\ntraction = {{ n = 1 }}\n{SEGMENT}"),
        &["plane_strain", "stress"],
    );
    refuses(
        &format!("{JOINT}[initial]\nstress = {{ 11 = 1 }}\n{SEGMENT}"),
        &["interface_2d", "traction"],
    );
}

#[test]
fn the_strain_out_of_plane() {
    for control in ["33 = { strain = 1e-9 }", "33 = { stress = 0 }"] {
        refuses(&solid(control), &["33", "plane strain"]);
    }
}

#[test]
fn counts_of_increments() {
    for count in ["0", "-3", "100000001", "9223372036854775807"] {
        refuses(
            &format!("{SOLID}[[segment]]\nincrements = {count}\ncontrol = {{}}"),
            &["increments", count],
        );
    }
    refuses(
        &format!("{SOLID}[[segment]]\nincrements = 2.5\ncontrol = {{}}"),
        &["2.5"],
    );
    let many = "[[segment]]\nincrements = 60000000\ncontrol = {}\n";
    refuses(&format!("{SOLID}{many}{many}"), &["increments", "60000000"]);
}

#[test]
fn numbers_that_are_not_finite() {
    for number in ["nan", "inf", "-inf"] {
        refuses(
            &solid(&format!("22 = {{ strain = {number} }}")),
            &["strain"],
        );
        refuses(
            &joint(&format!("n = {{ stiffness = {number} }}")),
            &["stiffness"],
        );
        refuses(
            &format!("{SOLID}[initial]\nstress = {{ 11 = {number} }}\n{SEGMENT}"),
            &["11"],
        );
        let internal = format!("{JOINT}[initial]\ninternal = {{ gap = {number} }}\n{SEGMENT}");
        refuses(&internal, &["gap"]);
    }
    refuses(&solid("22 = { strain = 1e999 }"), &["overflow"]);
    refuses(&solid("22 = { strain = 'much' }"), &["number"]);
}

#[test]
fn parameters() {
    let text = format!("{SOLID}{SEGMENT}");
    refuses(
        &text.replace("young_modulus", "youngs_modulus"),
        &["youngs_modulus", "did you mean `young_modulus`"],
    );
    refuses(&text.replace("0.25", "0.5"), &["poisson_ratio", "0.5"]);
    refuses(
        &text.replace("poisson_ratio = 0.25\n", ""),
        &["needs parameter `poisson_ratio`"],
    );
}

#[test]
fn internal_variables() {
    refuses(
        &format!("{JOINT}[initial]\ninternal = {{ plastic_slipp = 1 }}\n{SEGMENT}"),
        &["plastic_slipp", "did you mean `plastic_slip`"],
    );
}

#[test]
fn initial_states_that_the_law_refuses() {
    let mepi = |traction: &str| {
        format!("law = 'mepi'\nhypothesis = 'interface_2d'\n{MEPI}[initial]\n{traction}\n{SEGMENT}")
    };
    refuses(
        &mepi("traction = { n = 100 }"),
        &["mepi", "initial", "compressive", "tension is positive"],
    );
    refuses(&mepi(""), &["mepi", "compressive"]);
    let halved = mepi("traction = { n = -100 }").replacen(
        "t = 0.002",
        "t = 0.002\nscheme = 'explicit'\nsubsteps = 2.5",
        1,
    );
    refuses(&halved, &["substeps", "2.5"]);
    // The law refuses this one in its first update.
    let run = attempt(&mepi(
        "traction = { n = -100 }\ninternal = { plastic_slip = -1 }",
    ));
    assert_eq!(run.error().exit_code(), 1);
    assert!(
        run.error().to_string().contains("plastic_slip"),
        "{}",
        run.error()
    );
}

#[test]
fn laws_that_are_not_there() {
    let text = format!("{SOLID}{SEGMENT}").replace("'elastic'", "'elastik'");
    let error = tests::driver::of_text(&text).unwrap_err();
    assert_eq!(error.exit_code(), 3);
    let all = format!("{error:?}");
    assert!(
        all.contains("elastik") && all.contains("driver.toml:1:7"),
        "{all}"
    );
}

#[test]
fn messages_point_to_the_place() {
    let text = solid("22 = { jump = 77 }");
    let Error::Text(text::Error::Input(error)) = tests::driver::of_text(&text).unwrap_err() else {
        panic!("an input error");
    };
    assert_eq!(error.span().start, text.find("77").unwrap());
    assert_eq!(error.line().text, "control = { 22 = { jump = 77 } }");
}
