//! Phases, loads and constraints that contradict each other or do nothing.

use crate::program::{BAD_INPUT, refuses};

#[test]
fn refuses_impossible_phases() {
    refuses(
        BAD_INPUT,
        &[
            (
                "the same name twice",
                &[("\"push\"", "^\"weight\"")],
                &["two phases are called `weight`"],
            ),
            (
                "no name",
                &[("\"push\"", "^\"\"")],
                &["a phase needs a name"],
            ),
            (
                "no increments",
                &[("increments = 2", "increments = ^0")],
                &["`increments` is 0, expected 1 to 10000000"],
            ),
            (
                "increments for a lifetime",
                &[("increments = 2", "increments = ^10000000000")],
                &["`increments` is 10000000000, expected 1 to 10000000"],
            ),
        ],
    );
}

#[test]
fn refuses_pressures_inside_and_twice() {
    const PRESSURE: &str = "{ line = \"top\", value = 10.0 }";
    refuses(
        BAD_INPUT,
        &[
            (
                "inside",
                &[(PRESSURE, "{ line = ^\"middle\", value = 10.0 }")],
                &["a pressure needs a boundary, line `middle` is not"],
            ),
            (
                "on a point",
                &[(PRESSURE, "{ line = ^\"corner\", value = 10.0 }")],
                &["a pressure needs a boundary, line `corner` is not"],
            ),
            (
                "twice",
                &[(
                    PRESSURE,
                    "{ line = \"top\", value = 1.0 }, { line = ^\"top\", value = 2.0 }",
                )],
                &["line `top` has two pressures in this phase"],
            ),
        ],
    );
}

#[test]
fn refuses_constraints_that_contradict_each_other_or_do_nothing() {
    const TOP: &str = "displacement = [{ line = \"top\", x = 1e-5 }]";
    refuses(
        BAD_INPUT,
        &[
            (
                "a displacement at a support",
                &[(TOP, "displacement = [{ line = ^\"bottom\", x = 1e-5 }]")],
                &["the node at (0, 0) of line `bottom` has a support in x"],
            ),
            (
                "a displacement at the end of a support",
                &[(TOP, "displacement = [{ line = ^\"left\", x = 1e-5 }]")],
                &["the node at (0, 0) of line `left` has a support in x"],
            ),
            (
                "two displacements of one node",
                &[(
                    TOP,
                    "displacement = [{ line = \"top\", x = 0.1 }, { line = ^\"top\", x = 0.2 }]",
                )],
                &["the node at (0, 1) of line `top` gets 0.2 m in x, and 0.1 m by line `top`"],
            ),
            (
                "a displacement without a value",
                &[(TOP, "displacement = [{ line = ^\"top\" }]")],
                &[
                    "the displacement of line `top` has no value",
                    "give `x`, `y`, or both",
                ],
            ),
            (
                "what nothing holds set free",
                &[(TOP, "free = [{ line = ^\"top\", components = [\"x\"] }]")],
                &["`free` of line `top`: nothing holds it in x"],
            ),
            (
                "nothing set free",
                &[(TOP, "free = [{ line = ^\"bottom\", components = [] }]")],
                &["`free` of line `bottom`: `components` is empty"],
            ),
            (
                "nothing fixed",
                &[
                    ("line = \"bottom\"", "line = ^\"bottom\""),
                    ("[\"x\", \"y\"]", "[]"),
                ],
                &["`fixed` is empty for line `bottom`"],
            ),
        ],
    );
}

#[test]
fn refuses_models_that_nothing_holds() {
    const SUPPORT: &str = "[[supports]]\nline = \"bottom\"\nfixed = [\"x\", \"y\"]\n";
    refuses(
        BAD_INPUT,
        &[
            (
                "no support",
                &[(SUPPORT, ""), ("\"weight\"", "^\"weight\"")],
                &[
                    "phase `weight`: nothing holds the model in x",
                    "[[supports]]",
                ],
            ),
            (
                "one direction",
                &[("[\"x\", \"y\"]", "[\"x\"]"), ("\"weight\"", "^\"weight\"")],
                &["phase `weight`: nothing holds the model in y"],
            ),
            (
                "support given up",
                &[(
                    "\"push\"",
                    "^\"push\"\nfree = [{ line = \"bottom\", components = [\"y\"] }]",
                )],
                &["phase `push`: nothing holds the model in y"],
            ),
            (
                "along the axis",
                &[
                    ("\"plane_strain\"", "\"axisymmetric\""),
                    (SUPPORT, ""),
                    ("\"weight\"", "^\"weight\""),
                ],
                &["phase `weight`: nothing holds the model in z"],
            ),
        ],
    );
}
