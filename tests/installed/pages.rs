//! The pages of the archive: every link leads to a file of it, and every command works where its cases were copied to.
//! The sessions of tutorials and how-to pages are followed by `tests/authors/pages.rs`, in an unpacked archive as well.

use std::fs;
use std::path::{Path, PathBuf};
use tests::needs::compiler;
use tests::outcome::Outcome;
use tests::place::Place;

/// A command that takes longer than this is stopped as by Ctrl-C: it has read its files and opened its laws by then.
const LONG_ENOUGH: f64 = 1.0;

/// Files and names that the reader brings.
const OF_THE_READER: [&str; 3] = ["mysand.f", "driver.toml", "<id>"];

/// Programs of others that commands start. Their examples have their own tests, where there is a repository.
const OF_OTHERS: [&str; 7] = [
    "python3",
    "sbatch",
    "snakemake",
    "srun",
    "target/dolfinx/bin/mpiexec",
    "cases/study_parallel/run.sh",
    "cases/distributed/install.sh",
];

#[test]
fn every_link_leads_to_a_file_of_the_archive() {
    let place = Place::new();
    let (links, broken) = tests::links::followed(&place.prefix);
    assert!(links > 500, "{links} links");
    assert!(broken.is_empty(), "{broken:#?}");
    // Those between pages and cases, which lie apart, among them.
    let guide = place
        .prefix
        .join("share/doc/pilum/host/docs/how-to/study.md");
    let guide = fs::read_to_string(guide).unwrap();
    let example = "](../../../../../pilum/cases/study_slurm/README.md)";
    assert!(guide.contains(example), "{guide}");
}

/// Lines of the `sh` blocks of all pages, with the page.
fn commands(place: &Place) -> Vec<(PathBuf, String)> {
    let mut pages = Vec::new();
    tests::links::pages(&place.prefix, &mut pages);
    pages.sort();
    let own = place.prefix.join("share/doc/pilum/README.md");
    let mut commands = Vec::new();
    // Those of its own README go on from one to the next: `program.rs`.
    for page in pages.into_iter().filter(|page| *page != own) {
        let text = fs::read_to_string(&page).unwrap();
        for block in text.split("```sh\n").skip(1) {
            let lines = block.split("```").next().unwrap().lines();
            let lines = lines.filter(|line| !line.starts_with('#'));
            commands.extend(lines.map(|line| (page.clone(), line.to_owned())));
        }
    }
    commands
}

/// Runs a command for a while.
fn tried(place: &Place, line: &str) -> Outcome {
    let limited = format!("timeout --foreground --preserve-status -s INT {LONG_ENOUGH} {line}");
    place.shell("", &limited)
}

/// Runs a command of `pilum`, which has to come to its end, or as far as it gets in time.
fn succeeds(place: &Place, page: &Path, line: &str) {
    let outcome = tried(place, line);
    let expected = line.split_once("exit code ").map_or(0, |(_, rest)| {
        let code = rest.split(|c: char| !c.is_ascii_digit()).next();
        code.unwrap().parse().unwrap()
    });
    let is_right = [Some(expected), Some(130)].contains(&outcome.code);
    let said = &outcome.stderr;
    assert!(
        is_right,
        "{}: {line}\n{:?} {said}",
        page.display(),
        outcome.code
    );
}

#[test]
fn every_command_of_its_pages_works() {
    let place = Place::new();
    place.done(
        "",
        &format!("cp -r '{}/share/pilum/cases' .", place.prefix.display()),
    );
    let has_fortran = compiler("FC", "gfortran").is_some();
    let (mut run, mut unknown) = (0, Vec::new());
    for (page, line) in commands(&place) {
        let mut words = line
            .split_whitespace()
            .filter(|word| !word.starts_with('#'));
        let files = words.clone().filter(|word| word.starts_with("cases/"));
        for file in files.filter(|file| !file.contains(".so")) {
            let is_there = place.work().join(file).exists();
            assert!(is_there, "{}: {file}: {line}", page.display());
        }
        let is_elsewhere = line.contains("# in the repository");
        let is_of_reader = OF_THE_READER.iter().any(|file| line.contains(file));
        match words.next().unwrap_or_default() {
            _ if is_elsewhere || is_of_reader => {}
            "" | "export" => {}
            "gfortran" if !has_fortran => {}
            "pilum" if !has_fortran && line.contains("hypoplastic") => {}
            "gfortran" => {
                place.done("", &line);
            }
            "pilum" => {
                succeeds(&place, &page, &line);
                run += 1;
            }
            program if OF_OTHERS.contains(&program) => {}
            _ => unknown.push(line),
        }
    }
    assert!(run > 30, "{run} commands");
    assert!(unknown.is_empty(), "{unknown:#?}");
}

/// A command that does not work is found: a file that is missing, a word that the program does not know.
#[test]
fn mistakes_of_a_page_are_found() {
    let place = Place::new();
    for line in [
        "pilum run cases/chamber_mesh1",
        "pilum laws --nowhere",
        "plum laws",
    ] {
        let outcome = tried(&place, line);
        assert!(![Some(0), Some(130)].contains(&outcome.code), "{line}");
    }
}

/// `man` finds a page for the program and for each of its commands.
#[test]
fn every_command_has_its_manual_page() {
    let place = Place::new();
    let help = place.done("", "pilum help");
    let (_, listed) = help.split_once("Commands:\n").unwrap();
    let listed = listed.lines().take_while(|line| !line.is_empty());
    let names = listed.filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    let names: Vec<&str> = names
        .filter(|name| !name.is_empty() && *name != "help")
        .collect();
    assert!(
        names.contains(&"run") && names.contains(&"new-law"),
        "{names:?}"
    );
    let manual = place.prefix.join("share/man/man1");
    for name in &names {
        let page = fs::read_to_string(manual.join(format!("pilum-{name}.1"))).unwrap();
        let page = page.replace('\\', "");
        assert!(page.contains(&format!("pilum {name}")), "{name}: {page}");
        assert!(
            page.contains(".SH OPTIONS") && page.contains("no-probe"),
            "{name}"
        );
    }
    assert_eq!(fs::read_dir(manual).unwrap().count(), names.len() + 1);
}
