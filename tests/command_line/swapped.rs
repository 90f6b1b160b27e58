//! Laws that cannot be led through the nil increment in which a law that starts is asked what it makes of the
//! stresses it finds.

use crate::program::{DONE, Outcome, PLUGIN_TROUBLE};
use crate::troubled;

/// The case, its layer elastic under the weight, then with the law.
fn run(define: &'static str) -> Option<Outcome> {
    let place = troubled::place(define)?;
    let group = "formulation = \"thin_layer\"\nlaw = \"";
    let text = troubled::case("cut")
        .replacen("limit = 1.0e-6", "limit = 1.0", 1)
        .replacen(&format!("{group}joint"), &format!("{group}soil"), 1)
        .replacen(
            "name = \"push\"\n",
            "name = \"push\"\nlaws = { layer = \"joint\" }\n",
            1,
        );
    assert!(text.contains(&format!("{group}soil")) && text.contains("laws = {"));
    place.write("case.toml", text);
    Some(place.run(&["run", "case.toml", "--out", "out"]))
}

#[test]
fn a_law_that_fails_over_a_nil_increment_starts_with_the_first_one() {
    let Some(outcome) = run("NIL_OUTCOME=PILUM_E_DOMAIN") else {
        return;
    };
    assert_eq!(outcome.code, Some(DONE), "{}", outcome.stderr);
    for words in ["no time passes", "over a nil increment", "phase `push`"] {
        assert!(outcome.says(words), "{words}: {}", outcome.stderr);
    }
    // Asked without trouble, it keeps what it finds, and nothing is said.
    let outcome = run("").expect("a compiler");
    assert_eq!(outcome.code, Some(DONE), "{}", outcome.stderr);
    assert!(!outcome.says("nil increment"), "{}", outcome.stderr);
    assert!(!outcome.says("takes over"), "{}", outcome.stderr);
}

#[test]
fn a_law_that_breaks_down_over_a_nil_increment_ends_the_run() {
    let Some(outcome) = run("NIL_OUTCOME=PILUM_E_INTERNAL") else {
        return;
    };
    assert_eq!(outcome.code, Some(PLUGIN_TROUBLE), "{}", outcome.stderr);
    for words in [
        "no time passes",
        "phase `push`, increment 1",
        "group `layer`",
    ] {
        assert!(outcome.says(words), "{words}: {}", outcome.stderr);
    }
}
