//! Sidecars and the files that name them: mistakes, and changes between runs.

use super::{driver, place, soil};
use crate::program::{BAD_INPUT, DONE, PLUGIN_TROUBLE, refuses_file};
use tests::or_skip;

#[test]
fn a_changed_sidecar_is_another_run() {
    let place = or_skip!(place("elastic"));
    // ν is left to the default of the sidecar.
    let case = soil("elastic", "").replacen(", poisson_ratio = 0.3 }", " }", 1);
    let sidecar = place.read("elastic.law.toml");
    let sidecar = sidecar.replacen("thread_safe", "cmname = \"SAND\"\nthread_safe", 1);
    place.write("elastic.law.toml", &sidecar);
    place.done_case(case);
    let resumed = || place.run(&["run", "case.toml", "--out", "out", "--resume"]);
    resumed().ended(DONE);
    for (from, to) in [
        ("default = 0.3", "default = 0.25"),
        ("cmname = \"SAND\"", "cmname = \"CLAY\""),
        ("ntens = [4, 6]", "ntens = [6]\nexpand = true"),
    ] {
        assert!(sidecar.contains(from), "{from}");
        place.write("elastic.law.toml", sidecar.replacen(from, to, 1));
        let outcome = resumed().ended(BAD_INPUT);
        outcome
            .shows("checkpoint.bin")
            .shows("other libraries or sidecars");
    }
    place.write("elastic.law.toml", &sidecar);
    resumed().ended(DONE);
}

#[test]
fn mistakes_in_files_are_named() {
    let place = or_skip!(place("elastic"));
    let (run, good) = (["point", "driver.toml"], driver("elastic", "", ""));
    let refuses = |file: (&str, &str), code: i32, mistakes: &str| {
        refuses_file(&place, file, &run, code, mistakes);
        place.write(file.0, file.1);
    };
    refuses(
        ("driver.toml", &good),
        BAD_INPUT,
        r#"
libelastic.so => libnone.so
  `library`: there is no file
adapter = "umat"\n =>
  `library` needs an `adapter`
library = "libelastic.so"\n =>
  `adapter` needs the `library`
"umat" => "vumat"
  umat
young_modulus => youngs_modulus
  has no parameter `youngs_modulus`
2e4 => -2e4
  is outside (0, ∞)
library => sidecar = "none.toml"\nlibrary
  `sidecar`: there is no file
"#,
    );
    refuses(
        ("driver.toml", &good),
        PLUGIN_TROUBLE,
        r#"
law = "umat_elastic" => law = "other"
  has no law `other`
"#,
    );
    let sidecar = place.read("elastic.law.toml");
    refuses(
        ("elastic.law.toml", &sidecar),
        BAD_INPUT,
        r#"
upper = 0.5 => upper = 0.2
  the default is outside its bounds
id = "poisson_ratio" => id = "Poisson"
  malformed
"plane_strain", "axisymmetric",  =>
  is made for 3d, expected plane_strain
ntens = [4, 6] => ntens = [4]
  3d has NTENS = 6, which `ntens` lacks
thread_safe => thread_save
  thread_save
"#,
    );
    refuses(
        ("elastic.law.toml", &sidecar),
        PLUGIN_TROUBLE,
        r#"
version => symbol = "other_"\nversion
  it has no routine other_
"#,
    );
    std::fs::remove_file(place.path("elastic.law.toml")).unwrap();
    let outcome = place.run(&["point", "driver.toml"]);
    outcome.shows("has no sidecar");
}

#[test]
fn sidecars_without_sense_are_refused() {
    let place = or_skip!(place("elastic"));
    let sidecar = place.read("elastic.law.toml");
    place.write("driver.toml", driver("elastic", "", ""));
    let run = ["point", "driver.toml"];
    refuses_file(
        &place,
        ("elastic.law.toml", &sidecar),
        &run,
        BAD_INPUT,
        r#"
["plane_strain", "axisymmetric", "3d"] => []
  elastic.law.toml:4:14
["plane_strain", "axisymmetric", "3d"] => []
  name those that the routine is made for: plane_strain
[[parameter]] => [[internal]]\nid = "stress_11"\nunit = "-"\ndoc = "d"\n[[parameter]]
  internal variable `stress_11` has the name of another column
[[parameter]] => [[internal]]\nid = "strain"\ncomponents = 12\nunit = "-"\ndoc = "d"\n[[parameter]]
  internal variable `strain_11` has the name of another column
[[parameter]] => [[internal]]\nid = "iterations"\nunit = "-"\ndoc = "d"\n[[parameter]]
  `iterations` has the name
[[parameter]] => [[internal]]\nid = "a"\ncomponents = 2\nunit = "-"\ndoc = "d"\n[[internal]]\nid = "a_2"\nunit = "-"\ndoc = "d"\n[[parameter]]
  internal variable `a_2` is declared twice
"#,
    );
}
