//! The `pilum` program: arguments to calls of the rooms, and their outcome to messages and exit codes.

mod arguments;
mod commands;
mod output;
mod progress;
mod threads;

use arguments::Arguments;
use clap::Parser;
use input::Error;
use law::{Opener, Trust};
use output::Output;
use results::report;
use runs::supervision;
use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

/// Memory that runs out ends the program with a message.
#[cfg(unix)]
#[global_allocator]
static ALLOCATOR: runs::memory::Allocator = runs::memory::Allocator;

fn main() -> ExitCode {
    #[cfg(unix)]
    {
        runs::memory::keep_freed();
        law::child::ignore_file_limit();
    }
    runs::study::follow();
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            let said = error.print().and_then(|()| std::io::stdout().flush());
            // Help and version are no errors; everything else is bad input.
            if error.use_stderr() {
                return ExitCode::from(1);
            }
            let failure = said.err();
            return ended(Output { failure }.end(Ok(())));
        }
    };
    if let Some(code) = arguments.command.calls_laws().and_then(watched) {
        return code;
    }
    let apart = arguments
        .isolate
        .or_else(|| arguments.command.isolates_anyway());
    // The limits of a check's own process are not a law's doing.
    if arguments.command.calls_laws().is_some() {
        law::process_state::begin();
    }
    supervision::begin_run(apart.is_some());
    let trust = Trust {
        probe: !arguments.no_probe,
        isolate: apart
            .or_else(|| supervision::is_again().then_some(AS_LONG_AS_IT_TAKES))
            .map(Duration::from_secs_f64),
    };
    let opener = Opener::new(trust);
    let run = || {
        if cfg!(not(unix)) && trust.isolate.is_some() {
            let message = "--isolate needs a Unix system";
            return Err(Error::usage(message));
        }
        commands::execute(arguments.command, opener)
    };
    // A panic has printed itself; it is a defect of the program, not of the input.
    let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(run))
        .unwrap_or_else(|_| Err(Error::internal("the program panicked; please report it")));
    ended(outcome)
}

/// Seconds that a call may take where the user has set no limit to it.
const AS_LONG_AS_IT_TAKES: f64 = 1e6;

/// Has a child carry the command out and watches it; the child's exit code. `None`: this process has to carry it out.
fn watched(again: bool) -> Option<ExitCode> {
    if std::env::var_os(supervision::ALONE).is_some() {
        return None;
    }
    // What the child could not write any more.
    let mend = |folder: &Path, error: &Error| {
        let of_study = runs::study::mend(folder, error);
        let mended = results::end_summary(folder, &runs::ending(Some(error)));
        match of_study {
            // Its runs have no reports of their own, or write them the next time.
            Ok(true) => return,
            Ok(false) => {}
            Err(why) => output::error(&why),
        }
        let reported = || {
            let folders = [folder.to_owned()];
            report::write(&folders, &report::default_path(&folders)).map(|_| ())
        };
        if let Err(why) = mended.and_then(|is_there| if is_there { reported() } else { Ok(()) }) {
            output::error(&why.into());
        }
    };
    Some(match supervision::supervise(again, &mend)? {
        Ok(code) => ExitCode::from(code),
        Err(error) => ended(Err(error)),
    })
}

/// The exit code, after the message. The outcome of a command matters more than an incomplete
/// message.
fn ended(outcome: Result<(), Error>) -> ExitCode {
    let outcome = outcome.and(output::what_was_not_said().map_or(Ok(()), Err));
    let code = match outcome.map_err(named_shortage) {
        Ok(()) => 0,
        Err(error) => {
            let code = error.exit_code();
            output::error(&error);
            code
        }
    };
    supervision::end(code);
    ExitCode::from(code)
}

/// A file that the system has no memory for is no trouble with the file.
fn named_shortage(error: Error) -> Error {
    match &error {
        Error::Text(
            text::Error::Unreadable { source, .. } | text::Error::Unwritable { source, .. },
        ) if source.kind() == std::io::ErrorKind::OutOfMemory => {
            commands::cannot_start("the command", &error)
        }
        _ => error,
    }
}
