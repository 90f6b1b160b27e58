//! What the program says, on the error stream and on the standard output.

use input::Error;
use runs::supervision;
use std::io::Write as _;
use std::sync::{Mutex, PoisonError};

/// A line on the error stream, written at once: that stream has no buffer. That it cannot be written does not
/// end a run, but is reported of it in the end.
macro_rules! say {
    ($($text:tt)*) => {
        $crate::output::line(format!($($text)*))
    };
}

/// See [`say!`].
pub(crate) fn line(mut text: String) {
    text.push('\n');
    unsaid(std::io::stderr().write_all(text.as_bytes()));
}

/// Why the error stream took no more.
static UNSAID: Mutex<Option<std::io::Error>> = Mutex::new(None);

/// Keeps why a line could not be written. A closed pipe does not count: its reader may have read
/// enough.
fn unsaid(written: std::io::Result<()>) {
    if let Err(why) = written
        && why.kind() != std::io::ErrorKind::BrokenPipe
    {
        let mut unsaid = UNSAID.lock().unwrap_or_else(PoisonError::into_inner);
        unsaid.get_or_insert(why);
    }
}
pub(crate) use say;

/// Why the error stream took no more, if it did not.
pub(crate) fn what_was_not_said() -> Option<Error> {
    let unsaid = UNSAID.lock().unwrap_or_else(PoisonError::into_inner).take();
    unsaid.map(|why| Error::usage(format!("cannot write to the standard error: {why}")))
}

/// Says an error, with its place and what could be done.
pub(crate) fn error(error: &Error) {
    say!("{}", error.shown(console::colors_enabled_stderr()));
}

/// What a command says on the standard output.
#[derive(Debug, Default)]
pub(crate) struct Output {
    /// Why it can say no more.
    pub(crate) failure: Option<std::io::Error>,
}

impl Output {
    pub(crate) fn text(&mut self, text: &str) {
        if self.failure.is_none() {
            let mut out = supervision::stdout();
            let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
            self.failure = written.err();
        }
    }

    pub(crate) fn line(&mut self, text: &str) {
        self.text(&format!("{text}\n"));
    }

    /// How the command ends: its outcome matters more than lines that could not be written. A
    /// closed pipe does not count: its reader may have read enough.
    pub(crate) fn end(self, outcome: Result<(), Error>) -> Result<(), Error> {
        let is_read = |why: &std::io::Error| why.kind() == std::io::ErrorKind::BrokenPipe;
        outcome.and(match self.failure.filter(|why| !is_read(why)) {
            None => Ok(()),
            Some(why) => Err(Error::usage(format!(
                "cannot write to the standard output: {why}"
            ))),
        })
    }
}

/// Does what says something on the standard output.
pub(crate) fn printing(work: impl FnOnce(&mut Output) -> Result<(), Error>) -> Result<(), Error> {
    let mut out = Output::default();
    let done = work(&mut out);
    out.end(done)
}

pub(crate) fn print(text: &str) -> Result<(), Error> {
    printing(|out| {
        out.text(text);
        Ok(())
    })
}
