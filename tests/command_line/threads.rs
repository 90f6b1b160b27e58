//! How many threads a run has, and from when on.
#![cfg(target_os = "linux")]

use crate::program::{BAD_INPUT, CASE, DONE, Place};
use crate::troubled;
use std::collections::BTreeMap;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tests::or_skip;

/// A short run works where no thread can be started; a request for threads then fails with a
/// message.
#[test]
fn a_small_run_needs_no_thread() {
    let place = Place::new();
    place.write("case.toml", CASE);
    place.write("none.c", "int pthread_create(void) { return 11; }\n");
    let [source, library] = ["none.c", "none.so"].map(|name| place.path(name));
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-fno-builtin", "-o"]);
    let output = or_skip!(tests::needs::output(compiler.arg(&library).arg(&source)));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let none = [("LD_PRELOAD", library.to_str().unwrap())];
    // Trying a library that is not known yet takes threads.
    let small = ["run", "case.toml", "--out", "out", "--no-probe"];
    place.run_with(&small, &none).ended(DONE);
    let two = ["run", "case.toml", "--out", "two", "--threads", "2"];
    let outcome = place.run_with(&two, &none).ended(BAD_INPUT);
    let text = "start the threads of the run";
    outcome.shows(text);
}

/// Each of its points takes 20 ms in the second phase.
#[test]
fn a_small_run_that_takes_long_has_all_threads() {
    let place = or_skip!(troubled::place(""));
    place.write("case.toml", troubled::case("sleep"));
    let processors = std::thread::available_parallelism().unwrap().get();
    for (arguments, n) in [(&[][..], processors), (&["--threads", "3"], 3)] {
        let run = [&["run", "case.toml", "--out", "out"], arguments].concat();
        let mut command = place.command(&run);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        let mut watcher = command.spawn().unwrap();
        let most = most_threads_of_child(watcher.id());
        watcher.kill().unwrap();
        watcher.wait().unwrap();
        assert_eq!(most, n, "{arguments:?}");
    }
}

/// Most threads that the watched process has for 25 ms or more in its first second. (The thread that opens a library
/// ends sooner.)
fn most_threads_of_child(watcher: u32) -> usize {
    let begun = Instant::now();
    let mut seen: BTreeMap<usize, usize> = BTreeMap::new();
    while begun.elapsed() < Duration::from_secs(1) {
        let children = format!("/proc/{watcher}/task/{watcher}/children");
        let children = std::fs::read_to_string(children).unwrap_or_default();
        for child in children.split_whitespace() {
            let threads = std::fs::read_dir(format!("/proc/{child}/task"));
            *seen.entry(threads.map_or(0, Iterator::count)).or_default() += 1;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let long = seen.into_iter().rev().find(|(_, samples)| *samples >= 5);
    long.map_or(0, |(threads, _)| threads)
}
