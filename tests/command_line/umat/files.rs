//! Sidecars and the files that name them: mistakes, and changes between runs.

use super::{driver, place, soil};
use crate::program::{BAD_INPUT, DONE, PLUGIN_TROUBLE};

#[test]
fn a_changed_sidecar_is_another_run() {
    let Some(place) = place("elastic") else {
        return;
    };
    // ν is left to the default of the sidecar.
    let case = soil("elastic", "").replacen(", poisson_ratio = 0.3 }", " }", 1);
    let sidecar = std::fs::read_to_string(place.path("elastic.law.toml")).unwrap();
    let sidecar = sidecar.replacen("thread_safe", "cmname = \"SAND\"\nthread_safe", 1);
    place.write("elastic.law.toml", &sidecar);
    assert_eq!(place.run_case(case).code, Some(DONE));
    let resumed = || place.run(&["run", "case.toml", "--out", "out", "--resume"]);
    let outcome = resumed();
    assert_eq!(outcome.code, Some(DONE), "{}", outcome.stderr);
    for (from, to) in [
        ("default = 0.3", "default = 0.25"),
        ("cmname = \"SAND\"", "cmname = \"CLAY\""),
        ("ntens = [4, 6]", "ntens = [6]\nexpand = true"),
    ] {
        assert!(sidecar.contains(from), "{from}");
        place.write("elastic.law.toml", sidecar.replacen(from, to, 1));
        let outcome = resumed();
        assert_eq!(outcome.code, Some(BAD_INPUT), "{to}: {}", outcome.stderr);
        for text in ["checkpoint.bin", "other libraries or sidecars"] {
            assert!(outcome.says(text), "{text}\n{}", outcome.stderr);
        }
    }
    place.write("elastic.law.toml", &sidecar);
    assert_eq!(resumed().code, Some(DONE));
}

#[test]
fn mistakes_in_files_are_named() {
    let Some(place) = place("elastic") else {
        return;
    };
    let good = driver("elastic", "", "");
    let mut complaints = Vec::new();
    for (from, to, code, says) in [
        (
            "libelastic.so",
            "libnone.so",
            BAD_INPUT,
            "`library`: there is no file",
        ),
        (
            "adapter = \"umat\"\n",
            "",
            BAD_INPUT,
            "`library` needs an `adapter`",
        ),
        (
            "library = \"libelastic.so\"\n",
            "",
            BAD_INPUT,
            "`adapter` needs the `library`",
        ),
        ("\"umat\"", "\"vumat\"", BAD_INPUT, "umat"),
        (
            "law = \"umat_elastic\"",
            "law = \"other\"",
            PLUGIN_TROUBLE,
            "has no law `other`",
        ),
        (
            "young_modulus",
            "youngs_modulus",
            BAD_INPUT,
            "has no parameter `youngs_modulus`",
        ),
        ("2e4", "-2e4", BAD_INPUT, "is outside (0, ∞)"),
        (
            "library",
            "sidecar = \"none.toml\"\nlibrary",
            BAD_INPUT,
            "`sidecar`: there is no file",
        ),
    ] {
        place.write("driver.toml", good.replacen(from, to, 1));
        let outcome = place.run(&["point", "driver.toml"]);
        if outcome.code != Some(code) || !outcome.says(says) {
            let (code, said) = (outcome.code, outcome.stderr);
            complaints.push(format!("{to}: {says}: {code:?} {said}"));
        }
    }
    let sidecar = std::fs::read_to_string(place.path("elastic.law.toml")).unwrap();
    place.write("driver.toml", &good);
    for (from, to, code, says) in [
        (
            "upper = 0.5",
            "upper = 0.2",
            BAD_INPUT,
            "the default is outside its bounds",
        ),
        (
            "id = \"poisson_ratio\"",
            "id = \"Poisson\"",
            BAD_INPUT,
            "malformed",
        ),
        (
            "\"plane_strain\", \"axisymmetric\", ",
            "",
            BAD_INPUT,
            "is made for 3d, expected plane_strain",
        ),
        (
            "ntens = [4, 6]",
            "ntens = [4]",
            BAD_INPUT,
            "3d has NTENS = 6, which `ntens` lacks",
        ),
        ("thread_safe", "thread_save", BAD_INPUT, "thread_save"),
        (
            "version",
            "symbol = \"other_\"\nversion",
            PLUGIN_TROUBLE,
            "it has no routine other_",
        ),
    ] {
        place.write("elastic.law.toml", sidecar.replacen(from, to, 1));
        let outcome = place.run(&["point", "driver.toml"]);
        if outcome.code != Some(code) || !outcome.says(says) {
            let (code, said) = (outcome.code, outcome.stderr);
            complaints.push(format!("{to}: {says}: {code:?} {said}"));
        }
    }
    std::fs::remove_file(place.path("elastic.law.toml")).unwrap();
    let outcome = place.run(&["point", "driver.toml"]);
    assert!(outcome.says("has no sidecar"), "{}", outcome.stderr);
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

#[test]
fn sidecars_without_sense_are_refused() {
    let Some(place) = place("elastic") else {
        return;
    };
    let sidecar = std::fs::read_to_string(place.path("elastic.law.toml")).unwrap();
    place.write("driver.toml", driver("elastic", "", ""));
    for (from, to, says) in [
        (
            "[\"plane_strain\", \"axisymmetric\", \"3d\"]",
            "[]",
            "elastic.law.toml:4:14",
        ),
        (
            "[\"plane_strain\", \"axisymmetric\", \"3d\"]",
            "[]",
            "name those that the routine is made for: plane_strain",
        ),
        (
            "[[parameter]]",
            "[[internal]]\nid = \"stress_11\"\nunit = \"-\"\ndoc = \"d\"\n[[parameter]]",
            "internal variable `stress_11` has the name of another column",
        ),
        (
            "[[parameter]]",
            "[[internal]]\nid = \"strain\"\ncomponents = 12\nunit = \"-\"\ndoc = \"d\"\n\
             [[parameter]]",
            "internal variable `strain_11` has the name of another column",
        ),
        (
            "[[parameter]]",
            "[[internal]]\nid = \"iterations\"\nunit = \"-\"\ndoc = \"d\"\n[[parameter]]",
            "`iterations` has the name",
        ),
        (
            "[[parameter]]",
            "[[internal]]\nid = \"a\"\ncomponents = 2\nunit = \"-\"\ndoc = \"d\"\n\
             [[internal]]\nid = \"a_2\"\nunit = \"-\"\ndoc = \"d\"\n[[parameter]]",
            "internal variable `a_2` is declared twice",
        ),
    ] {
        assert!(sidecar.contains(from), "{from}");
        place.write("elastic.law.toml", sidecar.replacen(from, to, 1));
        let outcome = place.run(&["point", "driver.toml"]);
        assert_eq!(outcome.code, Some(BAD_INPUT), "{to}: {}", outcome.stderr);
        assert!(outcome.says(says), "{says}\n{}", outcome.stderr);
    }
}
