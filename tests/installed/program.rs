//! What the archive holds, and the program of it.

use serde_json::Value;
use std::fs;
use std::process::Command;
use tests::case::column;
use tests::place::{Place, built_program, repository};
use tests::words::has;

#[test]
fn the_archive_has_all_its_parts() {
    let place = Place::new();
    let files = place.files();
    for name in [
        "bin/pilum",
        "include/pilum/pilum_law.h",
        "include/pilum/pilum_law.hpp",
        "include/pilum/pilum_point.h",
        "lib/cmake/pilum/pilum-config-version.cmake",
        "lib/cmake/pilum/pilum-config.cmake",
        "lib/pkgconfig/pilum.pc",
        "share/bash-completion/completions/pilum",
        "share/doc/pilum/LICENSE-APACHE",
        "share/doc/pilum/LICENSE-MIT",
        "share/doc/pilum/README.md",
        "share/doc/pilum/host/docs/how-to/install.md",
        "share/doc/pilum/licences.txt",
        "share/doc/pilum/models/mepi/LAW.md",
        "share/fish/vendor_completions.d/pilum.fish",
        "share/man/man1/pilum.1",
        "share/pilum/cases/chamber_mesh1/case.toml",
        "share/pilum/cases/tutorial/my_pile.msh",
        "share/pilum/exports.map",
        "share/pilum/pilum_law.f90",
        "share/zsh/site-functions/_pilum",
    ] {
        assert!(files.contains(name), "{name} is missing: {files:?}");
    }
    // One for every folder of models/ with a manifest, and no other.
    let models = fs::read_dir(repository().join("models")).unwrap();
    let models = models.map(|entry| entry.unwrap().path());
    let models = models
        .filter(|path| path.join("Cargo.toml").is_file())
        .count();
    let laws = files.iter().filter(|name| name.starts_with("lib/pilum/"));
    assert_eq!(laws.count(), models);
    // The program's own texts, at places where shells and `man` look.
    let text = |name: &str| fs::read_to_string(place.prefix.join(name)).unwrap();
    assert!(text("share/man/man1/pilum.1").contains(".TH pilum 1"));
    assert!(text("share/bash-completion/completions/pilum").contains("complete -F _pilum"));
    assert!(text("share/zsh/site-functions/_pilum").starts_with("#compdef pilum"));
    assert!(text("share/fish/vendor_completions.d/pilum.fish").contains("complete -c pilum"));
}

/// `cargo tree` says what is linked; each has its line.
#[test]
fn every_library_in_the_program_has_its_licence() {
    let output = Command::new(env!("CARGO"))
        .args([
            "tree",
            "--locked",
            "--offline",
            "-e",
            "normal,no-proc-macro",
        ])
        .args(["--prefix", "none", "--format", "{p}: {l}", "-p", "pilum"])
        .current_dir(repository())
        .output()
        .unwrap();
    let tree = String::from_utf8(output.stdout).unwrap();
    let place = Place::new();
    let list = place.prefix.join("share/doc/pilum/licences.txt");
    let list = fs::read_to_string(list).unwrap();
    let mut found = 0;
    for line in tree.lines().filter(|line| !line.contains(" (/")) {
        let line = line.replace(" (*)", "").replacen(" v", " ", 1);
        assert!(list.contains(&line), "{line}");
        found += 1;
    }
    assert!(found > 100, "only {found} libraries: {tree}");
    for text in [
        "Permission is hereby granted",
        "TERMS AND CONDITIONS FOR USE",
        "uPlot",
    ] {
        assert!(list.contains(text), "no text of a licence with {text}");
    }
}

#[test]
fn the_main_case_runs_as_it_does_where_it_is_built() {
    let place = Place::new();
    let case = place.prefix.join("share/pilum/cases/chamber_mesh1");
    place.done("", &format!("pilum run '{}'", case.display()));
    let results = place.work().join("results/chamber_mesh1");
    let report = fs::read_to_string(results.join("report.html")).unwrap();
    assert!(report.contains("</html>"));
    let summary = fs::read_to_string(results.join("summary.json")).unwrap();
    let prefix = place.prefix.to_str().unwrap();
    has(&summary, format!("{prefix}/lib/pilum/libmepi.so"));

    let case = repository().join("cases/chamber_mesh1");
    let built = Command::new(built_program())
        .arg("run")
        .arg(case)
        .args(["--out", "built"])
        .current_dir(place.work())
        .output()
        .unwrap();
    assert!(built.status.success());
    let tables = ["history.csv", "profile.csv"];
    for table in tables {
        let read = |folder: &str| fs::read(place.work().join(folder).join(table)).unwrap();
        assert!(read("results/chamber_mesh1") == read("built"), "{table}");
    }
    assert!(column(&results.join("history.csv"), "increment").len() > 10);
}

#[test]
fn the_commands_of_its_readme_work() {
    let place = Place::new();
    let page = fs::read_to_string(place.prefix.join("share/doc/pilum/README.md")).unwrap();
    assert!(!page.contains('@'), "a mark is left: {page}");
    let block = page.split("```sh\n").nth(1).unwrap();
    let block = block.split("```").next().unwrap();
    assert!(block.contains("pilum run") && block.contains("pilum new-law"));
    let script = format!("set -e\ncd '{}'\n{block}", place.prefix.display());
    place.done("", &script);
    assert!(
        place
            .work()
            .join("../home/piles/results/chamber_mesh1/report.html")
            .is_file()
    );
    assert!(
        place
            .work()
            .join("../home/piles/my_law/README.md")
            .is_file()
    );
}

/// `--where` as JSON.
fn folders(text: &str) -> Vec<Value> {
    let Ok(Value::Array(folders)) = serde_json::from_str(text) else {
        panic!("{text}");
    };
    folders
}

#[test]
fn laws_are_found_with_the_program_wherever_it_lies() {
    let place = Place::new();
    let all = [
        "coulomb_joint",
        "critical_state_joint",
        "cyclic_joint",
        "elastic",
        "hardening_soil",
        "hardening_soil_small",
        "hyperbolic_joint",
        "mepi",
        "mepi_softening",
        "mohr_coulomb",
        "oriented_mohr_coulomb",
        "qz_curve",
        "tz_curve",
    ];
    let installed = place.prefix.join("lib/pilum");
    // A link to the program is the program.
    let link = "ln -s \"$(command -v pilum)\" linked && ./linked";
    for program in ["pilum", link] {
        let told = place.done("", &format!("{program} laws --where --json; rm -f linked"));
        let with_laws: Vec<Value> = folders(&told)
            .into_iter()
            .filter(|folder| {
                folder["laws"]
                    .as_array()
                    .is_some_and(|laws| !laws.is_empty())
            })
            .collect();
        assert_eq!(with_laws.len(), 1, "{told}");
        assert_eq!(with_laws[0]["folder"], installed.to_str().unwrap());
        assert_eq!(with_laws[0]["why"], "installed with the program");
        let mut laws: Vec<&str> = with_laws[0]["laws"]
            .as_array()
            .unwrap()
            .iter()
            .map(|law| law.as_str().unwrap())
            .collect();
        laws.sort_unstable();
        assert_eq!(laws, all);
    }
    let told: Value = serde_json::from_str(&place.done("", "pilum laws --json")).unwrap();
    for law in told.as_array().unwrap() {
        let library = law["library"].as_str().unwrap();
        assert!(
            library.starts_with(installed.to_str().unwrap()),
            "{library}"
        );
    }
}

/// As `cargo install` leaves it: the program, no laws.
#[test]
fn a_program_without_laws_says_where_it_looks() {
    let place = Place::new();
    let bin = place.work().join("alone/bin");
    fs::create_dir_all(&bin).unwrap();
    fs::copy(place.prefix.join("bin/pilum"), bin.join("pilum")).unwrap();
    let case = place.prefix.join("share/pilum/cases/chamber_mesh1");
    let run = format!("alone/bin/pilum run '{}'", case.display());
    let outcome = place.shell("", &run).ended(3);
    let said: String = outcome.stderr.split_whitespace().collect();
    let looked_in = place.work().canonicalize().unwrap().join("alone/lib/pilum");
    for text in [
        "nolibrarywithlaw`elastic`in",
        looked_in.to_str().unwrap(),
        "anarchiveofPilumhastheminlib/pilum",
        "`pilumlaws--where`",
    ] {
        assert!(said.contains(text), "{text}: {}", outcome.stderr);
    }
    let told = place.done("", "alone/bin/pilum laws --where");
    assert!(told.contains(looked_in.to_str().unwrap()), "{told}");
    has(&told, "installed with the program: there is no such folder");

    // With the laws where it says, or named, the case runs.
    let laws = place.prefix.join("lib/pilum");
    place.done("", &format!("PILUM_LAW_PATH='{}' {run}", laws.display()));
    place.done(
        "",
        &format!(
            "mkdir -p alone/lib && cp -r '{}' alone/lib && {run} --out again",
            laws.display()
        ),
    );
}
