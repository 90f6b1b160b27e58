//! The program watches a copy of itself, whoever has started it and with whatever.
#![cfg(target_os = "linux")]

use crate::program::{CASE, DONE, PLUGIN_TROUBLE, Place};
use crate::troubled;
use std::process::Command;
use tests::or_skip;

/// A program that does not care for its children passes that on to them.
#[test]
fn ends_of_children_are_told_whoever_started_the_program() {
    let place = or_skip!(troubled::place(""));
    let careless = "exec env --ignore-signal=CHLD \"$0\" \"$@\"";
    for (how, code) in [("locale", DONE), ("segfault", PLUGIN_TROUBLE)] {
        place.write("case.toml", troubled::case(how));
        place
            .run_limited(careless, &["run", "case.toml", "--out", how])
            .ended(code);
    }
}

/// A copy of a process has one thread, so one with several carries out all itself, and reports it.
#[test]
fn a_program_that_has_threads_already_is_not_watched() {
    const THREAD: &str = "#include <pthread.h>\n#include <unistd.h>\n\
        static void *wait_long(void *x) { pause(); return x; }\n\
        __attribute__((constructor)) static void begin(void) {\n\
        pthread_t thread;\n\
        pthread_create(&thread, 0, wait_long, 0);\n}\n";
    let place = Place::new();
    place.write("case.toml", CASE);
    place.write("thread.c", THREAD);
    let [source, library] = ["thread.c", "thread.so"].map(|name| place.path(name));
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-pthread", "-o"]);
    let output = or_skip!(tests::needs::output(compiler.arg(&library).arg(&source)));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let run = ["run", "case.toml", "--out", "out"];
    let warning = "the program has threads already";
    let preloaded = [("LD_PRELOAD", library.to_str().unwrap())];
    for (variables, is_warned) in [(&[][..], false), (&preloaded[..], true)] {
        let outcome = place.run_with(&run, variables).ended(DONE);
        assert_eq!(outcome.says(warning), is_warned, "{}", outcome.stderr);
    }
}
