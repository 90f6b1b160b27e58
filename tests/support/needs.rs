//! What tests need beside cargo: compilers, a browser, programs of others. Without them a test says
//! so and does nothing; where `PILUM_REQUIRE_ALL` or `CI` is set, as in `.ci/run`, it fails.

use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

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
}

/// What a program puts out; `None`, with a remark, if it is [`missing`].
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

/// Runs one test of the present test program where no other program is found: it has to pass with a
/// remark that names what is missing, and to fail with the same name where nothing may be passed over.
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
