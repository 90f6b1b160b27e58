//! `pilum laws`, its JSON, completions and the manual page.

use crate::program::pilum;
use serde_json::Value;
use std::fs;
use tempfile::TempDir;
use tests::outcome::Outcome;
use tests::words::has;
use tests::words::words;

fn run(arguments: &[&str]) -> Outcome {
    let place = TempDir::new().unwrap();
    pilum(place.path(), arguments).ended(0)
}

#[test]
fn a_page_says_all_about_a_law() {
    let page = run(&["laws", "coulomb_joint"]).stdout;
    for text in [
        "coulomb_joint: Coulomb joint",
        "De Gennaro & Frank, Table IV (2)",
        "libcoulomb_joint",
        "interface_2d  jump (m) to traction (kPa), components n t; tangent unsymmetric",
        "friction_angle        φ         deg         required; ≥ 0 and < 90, usually 0 to 50",
        "tensile_strength      R_t       kPa         default 0; ≥ 0, usually 0 to 1000",
        "Dilatancy angle.",
        "plastic_slip          ξ         m           starts at 0",
        "  [laws.NAME]\n  law = \"coulomb_joint\"\n  [laws.NAME.parameters]\n  normal_stiffness = ",
        "  # tensile_strength = 0",
        "Tension and opening are positive",
    ] {
        assert!(page.contains(text), "no {text:?} in\n{page}");
    }
    let widest = page.lines().map(|line| line.chars().count()).max();
    assert!(widest < Some(180), "{page}");
}

#[test]
fn a_page_shows_choices_and_optional_parameters() {
    let page = run(&["laws", "mepi_softening"]).stdout;
    for text in [
        "one of \"continuous\", \"published\"",
        "may be left out",
        "default \"continuous\"",
    ] {
        assert!(page.contains(text), "no {text:?} in\n{page}");
    }
}

/// The block on the page of a law can be put into a file and read, once numbers are filled in.
#[test]
fn the_example_of_a_page_can_be_pasted() {
    let page = run(&["laws", "coulomb_joint"]).stdout;
    let example = page.split("In a case file\n").nth(1).unwrap();
    let example = example.split("\n\n").next().unwrap();
    let filled = example.replace(" =  ", " = 1.0 ");
    let parsed: toml::Value = toml::from_str(&filled).unwrap();
    let parameters = parsed["laws"]["NAME"]["parameters"].as_table().unwrap();
    assert_eq!(parameters.len(), 5, "{filled}");
}

#[test]
fn json_says_the_same() {
    let law: Value =
        serde_json::from_str(&run(&["laws", "mohr_coulomb", "--json"]).stdout).unwrap();
    assert_eq!(law["id"], "mohr_coulomb");
    let library = law["library"].as_str().unwrap();
    assert!(library.contains("mohr_coulomb") && law["sha256"].as_str().unwrap().len() == 64);
    let friction = law["parameters"].as_array().unwrap();
    let friction = friction
        .iter()
        .find(|p| p["id"] == "friction_angle")
        .unwrap();
    assert_eq!(friction["unit"], "deg");
    assert!(friction["usual"]["upper"].is_number() && friction["doc"].is_string());
    let all: Value = serde_json::from_str(&run(&["laws", "--json"]).stdout).unwrap();
    let ids: Vec<&str> = all
        .as_array()
        .unwrap()
        .iter()
        .map(|l| l["id"].as_str().unwrap())
        .collect();
    for id in words(
        "coulomb_joint critical_state_joint cyclic_joint elastic hyperbolic_joint mepi mepi_softening mohr_coulomb qz_curve tz_curve",
    ) {
        assert!(ids.contains(&id), "{ids:?}");
    }
}

/// A library that cannot be used does not hide the others.
#[test]
fn the_list_survives_a_broken_library() {
    let place = TempDir::new().unwrap();
    let laws = pilum(place.path(), &["laws", "coulomb_joint", "--json"]).stdout;
    let laws: Value = serde_json::from_str(&laws).unwrap();
    let mut bytes = fs::read(laws["library"].as_str().unwrap()).unwrap();
    let id = b"coulomb_joint ";
    let mut broken = 0;
    for at in 0..bytes.len() - id.len() {
        if bytes[at..].starts_with(id) {
            bytes[at..at + id.len()].copy_from_slice(b"coulomb_joinX ");
            broken += 1;
        }
    }
    assert!(broken > 0);
    fs::write(place.path().join("libbroken.so"), bytes).unwrap();
    let outcome = pilum(place.path(), &["laws", "--law-path", "."]).ended(0);
    let line = |id: &str| {
        outcome
            .stdout
            .lines()
            .find(|line| line.starts_with(id))
            .unwrap()
    };
    has(line("coulomb_joinX"), "cannot be used");
    assert!(line("mepi ").contains("interface_2d"), "{}", outcome.stdout);
}

#[test]
fn completions_and_the_manual_know_every_command() {
    let help = run(&["--help"]).stdout;
    let commands = help
        .split("Commands:\n")
        .nth(1)
        .unwrap()
        .split("\n\n")
        .next()
        .unwrap();
    let names: Vec<&str> = commands
        .lines()
        .filter_map(|line| line.strip_prefix("  "))
        // Lines that are wrapped go on further to the right.
        .filter(|line| !line.starts_with(' '))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect();
    assert!(
        names.contains(&"new-law") && names.contains(&"run"),
        "{names:?}"
    );
    let manual = run(&["man"]).stdout.replace('\\', "");
    for name in &names {
        has(&manual, format!("pilum-{name}"));
    }
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = run(&["completions", shell]).stdout;
        for name in &names {
            assert!(script.contains(name), "{shell}: {name}");
        }
    }
}
