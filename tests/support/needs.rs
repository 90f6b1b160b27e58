//! Requirements of tests besides cargo: compilers, a browser, programs of others. Without them a test does
//! nothing but print a remark; if `PILUM_REQUIRE_ALL` or `CI` is set, as in `.ci/run`, it fails. The last of all
//! test programs prints in one line what was skipped (`tests/what_was_skipped.rs`).

use std::collections::{BTreeMap, BTreeSet};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::{env, fs, thread};

/// Variables that forbid passing over a test.
pub const STRICT: [&str; 2] = ["PILUM_REQUIRE_ALL", "CI"];

/// Whether nothing may be passed over.
pub fn all() -> bool {
    STRICT.iter().any(|name| std::env::var_os(name).is_some())
}

/// Says that what comes is passed over, and what is missing for it.
///
/// # Panics
/// If nothing may be passed over.
#[track_caller]
pub fn missing(what: &str) {
    assert!(
        !all(),
        "{what} is missing, and {} is set",
        STRICT.join(" or ")
    );
    passed_over(what);
}

/// Says so as well, and never fails: of what no test has to find, since its installation is large.
pub fn passed_over(what: &str) {
    // Past the test harness, which keeps what passing tests print to itself.
    let _ = writeln!(std::io::stderr(), "SKIPPED: {what} is missing");
    let test = thread::current().name().unwrap_or_default().to_owned();
    note(&test, what);
}

/// Folder of notes on skipped tests, in cargo's `target/tmp`, with a file for each process that starts test
/// programs. A test program that a test starts has another file, which nobody reads.
fn notes() -> Option<PathBuf> {
    let program = env::current_exe().ok()?;
    Some(program.ancestors().nth(3)?.join("tmp/skipped"))
}

#[cfg(unix)]
fn starter() -> String {
    std::os::unix::process::parent_id().to_string()
}

#[cfg(not(unix))]
fn starter() -> String {
    "cargo".to_owned()
}

/// A line of the test program, the test and what is missing. `abi/tests/header.rs` writes the same one.
fn note(test: &str, what: &str) {
    let Some(folder) = notes() else { return };
    let _ = fs::create_dir_all(&folder);
    let mut options = fs::OpenOptions::new();
    let file = options.create(true).append(true);
    if let Ok(mut file) = file.open(folder.join(starter())) {
        let program = env::current_exe().unwrap_or_default();
        let line = format!("{} {test}\t{what}\n", program.display());
        let _ = file.write_all(line.as_bytes());
    }
}

/// Reports in one line what was skipped since `cargo test` began. The names of the tests replace the notes, in
/// `target/tmp/skipped/tests`, a line each: `.ci/run` repeats these tests once it has installed what they lack.
///
/// # Panics
/// If a test was skipped in a thread that does not have its name, so that it could not be repeated.
pub fn skipped() -> String {
    let folder = notes().unwrap_or_default();
    let notes = fs::read_to_string(folder.join(starter())).unwrap_or_default();
    let _ = fs::remove_dir_all(&folder);
    let names = names(&notes);
    assert!(
        !names.contains(""),
        "a test was skipped in a thread without its name:\n{notes}"
    );
    let lines: String = names.iter().flat_map(|name| [name, "\n"]).collect();
    let _ = fs::create_dir_all(&folder);
    let _ = fs::write(folder.join("tests"), lines);
    summary(&notes)
}

/// Names of the tests, as `--exact` takes them.
fn names(notes: &str) -> BTreeSet<&str> {
    let tests = notes.lines().filter_map(|line| line.split_once('\t'));
    let names = tests.filter_map(|(test, _)| test.rsplit_once(' '));
    names.map(|(_, name)| name).collect()
}

/// Every test counts once, whatever it lacks.
fn summary(notes: &str) -> String {
    let lines = notes.lines().filter_map(|line| line.split_once('\t'));
    let mut tests = BTreeSet::new();
    let mut lacking: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (test, what) in lines {
        tests.insert(test);
        lacking.entry(what).or_default().insert(test);
    }
    if tests.is_empty() {
        return "SKIPPED: no test".to_owned();
    }
    let named = lacking
        .iter()
        .map(|(what, of)| format!("{what} ({})", of.len()));
    let named: Vec<String> = named.collect();
    format!(
        "SKIPPED, in whole or in part: {} tests, for lack of {}",
        tests.len(),
        named.join(", ")
    )
}

/// Output of cargo, which may lack crates that nothing has fetched yet: it runs without a network first, then with
/// one. `None`, with a remark, if they are [`missing`].
///
/// # Panics
/// If it cannot be started, or crates are missing where nothing may be passed over.
#[track_caller]
#[expect(clippy::expect_used, reason = "part of the tests")]
pub fn of_cargo(repository: &Path, arguments: &[&str], crates: &str) -> Option<String> {
    let ask = |more: &[&str]| {
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(arguments).args(more).current_dir(repository);
        let output = cargo.output().expect("cargo starts");
        output.status.success().then_some(output.stdout)
    };
    let printed = ask(&["--locked", "--offline"]).or_else(|| ask(&["--locked"]));
    if printed.is_none() {
        missing(&format!("{crates} (`cargo fetch --locked`)"));
    }
    String::from_utf8(printed?).ok()
}

/// Sends a signal, `INT` say, to a process, or with `-` before its number to its group, by the shell's own `kill`: the
/// program is not on every system. Whether there was one to send it to.
pub fn signal(signal: &str, to: &str) -> bool {
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("kill -{signal} {to}")]);
    shell.output().is_ok_and(|output| output.status.success())
}

/// Output of a program; `None`, with a remark, if it is [`missing`].
///
/// # Panics
/// If it cannot be started for another reason, or is missing where nothing may be passed over.
#[track_caller]
#[expect(clippy::panic, reason = "part of the tests")]
pub fn output(command: &mut Command) -> Option<Output> {
    match command.output() {
        Ok(output) => Some(output),
        Err(why) if why.kind() == ErrorKind::NotFound => {
            missing(&format!("`{}`", command.get_program().display()));
            None
        }
        Err(why) => panic!("{command:?}: {why}"),
    }
}

/// The program that a variable names, or else `default`; `None`, with a remark, if it is [`missing`].
///
/// # Panics
/// As [`output`].
#[track_caller]
pub fn compiler(variable: &str, default: &str) -> Option<String> {
    let name = std::env::var(variable).unwrap_or_else(|_| default.to_owned());
    output(Command::new(&name).arg("--version"))?;
    Some(name)
}

/// A file of a program that `tests/interoperability/install.sh` installs.
pub fn installed(name: &str) -> PathBuf {
    let folder = std::env::var_os("PILUM_INTEROPERABILITY").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/interoperability"),
        PathBuf::from,
    );
    folder.join(name)
}

/// Whether such a program is there; if not it is [`missing`].
///
/// # Panics
/// If nothing may be passed over.
#[track_caller]
pub fn is_there(program: &str) -> bool {
    let there = installed(program).is_file();
    if !there {
        let name = program.split('/').next().unwrap_or(program);
        missing(&format!("{name} (tests/interoperability/install.sh)"));
    }
    there
}

/// Runs one test of the present test program where no other program is found. It has to pass with a
/// remark that names what is missing, and to fail with the same name where nothing may be skipped.
///
/// # Panics
/// If it does not.
#[expect(clippy::expect_used, reason = "part of the tests")]
pub fn assert_named(test: &str, what: &str) {
    for strict in [None, Some(STRICT[0])] {
        let program = std::env::current_exe().expect("this program has a name");
        let mut command = Command::new(program);
        command.args(["--exact", test, "--nocapture"]);
        command.env("PATH", "").env("PILUM_INTEROPERABILITY", "");
        for name in STRICT.into_iter().chain(["CC", "CXX", "FC"]) {
            command.env_remove(name);
        }
        let output = command.envs(strict.map(|name| (name, "1"))).output();
        let output = output.expect("this program runs");
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        let (passes, remark) = match strict {
            None => (true, format!("SKIPPED: {what} is missing")),
            Some(name) => (false, format!("{what} is missing, and {name}")),
        };
        assert_eq!(output.status.success(), passes, "{strict:?}\n{said}");
        assert!(said.contains("running 1 test"), "{said}");
        assert!(said.contains(&remark), "{remark}, {strict:?}\n{said}");
    }
}

/// The value of an `Option`. A test without it ends here: it was passed over.
#[macro_export]
macro_rules! or_skip {
    ($found:expr) => {
        match $found {
            Some(found) => found,
            None => return,
        }
    };
}

#[cfg(test)]
mod tests {
    use super::{names, summary};

    #[test]
    fn tests_are_counted_once_and_what_they_lack_is_named() {
        let notes = "a x\t`cc`\na y\t`cc`\na x\t`cmake`\na x\t`cc`\nb x\t`cc`\n";
        let line = "SKIPPED, in whole or in part: 3 tests, for lack of `cc` (3), `cmake` (1)";
        assert_eq!(summary(notes), line);
        assert_eq!(summary(""), "SKIPPED: no test");
        let names: Vec<&str> = names(notes).into_iter().collect();
        assert_eq!(names, ["x", "y"]);
    }
}
