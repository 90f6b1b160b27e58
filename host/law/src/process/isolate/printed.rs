//! Output of a law in its workers: the first lines go to the error stream under the law's name,
//! the others are counted. Never to the standard output, where tables go.

use std::io::{self, Read, Write};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Lines that are shown of one law.
const SHOWN: u64 = 20;
/// Bytes that are shown of one line.
const LONGEST: usize = 400;
/// How long the last lines are waited for once a worker has ended: only what it has left behind can
/// still hold its output open.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// What all workers of a law print, together.
#[derive(Debug)]
pub(super) struct Printed {
    /// Who prints: law `sand`.
    name: String,
    /// Lines so far, without empty ones.
    lines: Mutex<u64>,
}

/// The output of one worker.
#[derive(Debug)]
pub(super) struct Output {
    last: Arc<Mutex<String>>,
    end: Receiver<()>,
}

impl Printed {
    /// Nothing so far.
    pub(super) fn by(name: String) -> Arc<Self> {
        Arc::new(Self {
            name,
            lines: Mutex::new(0),
        })
    }

    /// Passes on what a worker prints, in its own thread, since a full pipe would stop it.
    pub(super) fn follow(self: &Arc<Self>, source: Option<impl Read + Send + 'static>) -> Output {
        let (sender, end) = channel();
        let last = Arc::new(Mutex::new(String::new()));
        let (printed, spoken) = (Arc::clone(self), Arc::clone(&last));
        std::thread::spawn(move || {
            if let Some(source) = source {
                each_line(source, |line| {
                    printed.pass_on(&line);
                    *spoken.lock().unwrap_or_else(PoisonError::into_inner) = line;
                });
            }
            // Whoever waits for the end may be the last to hold it.
            drop(printed);
            let _ = sender.send(());
        });
        Output { last, end }
    }

    fn pass_on(&self, line: &str) {
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        *lines += 1;
        if *lines <= SHOWN {
            say(&format!("{} prints: {line}", self.name));
        } else if *lines == SHOWN + 1 {
            say(&format!(
                "{} prints more, which is only counted from here on",
                self.name
            ));
        }
    }
}

impl Drop for Printed {
    fn drop(&mut self) {
        let lines = *self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        if lines > SHOWN {
            say(&format!(
                "{} printed {lines} lines, of which the first {SHOWN} are shown",
                self.name
            ));
        }
    }
}

impl Output {
    /// Waits until all is passed on that an ended worker has printed; its last line, if any.
    pub(super) fn last_words(&self) -> Option<String> {
        let _ = self.end.recv_timeout(LAST_WORDS);
        let last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        Some(last.clone()).filter(|line| !line.is_empty())
    }
}

/// A line on the error stream. There is nobody to tell if that is closed.
pub(super) fn say(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// Reads to the end. Empty lines are left out, long ones cut, and what would move a terminal's
/// cursor is replaced.
fn each_line(mut source: impl Read, mut take: impl FnMut(String)) {
    let mut chunk = [0; 4096];
    let mut line = Vec::new();
    let mut is_cut = false;
    let mut end = |line: &mut Vec<u8>, is_cut: &mut bool| {
        let text = String::from_utf8_lossy(line);
        let harmless = |c: char| {
            if c.is_control() && c != '\t' {
                '\u{fffd}'
            } else {
                c
            }
        };
        let mut text: String = text.trim_end().chars().map(harmless).collect();
        if *is_cut {
            text.push('…');
        }
        line.clear();
        *is_cut = false;
        if !text.trim().is_empty() {
            take(text);
        }
    };
    loop {
        let n = match source.read(&mut chunk) {
            Ok(0) => break,
            Ok(n) => n,
            Err(why) if why.kind() == io::ErrorKind::Interrupted => continue,
            Err(_) => break,
        };
        for byte in &chunk[..n] {
            if *byte == b'\n' {
                end(&mut line, &mut is_cut);
            } else if line.len() < LONGEST {
                line.push(*byte);
            } else {
                is_cut = true;
            }
        }
    }
    end(&mut line, &mut is_cut);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &[u8]) -> Vec<String> {
        let mut lines = Vec::new();
        each_line(text, |line| lines.push(line));
        lines
    }

    #[test]
    fn lines_are_whole_and_harmless() {
        let text = b" one \r\n\n   \n\x1b[2Jtwo\nno end";
        assert_eq!(lines(text), [" one", "\u{fffd}[2Jtwo", "no end"]);
    }

    #[test]
    fn a_long_line_is_cut() {
        let mut text = vec![b'x'; 10 * LONGEST];
        text.extend(b"\nnext");
        let long = "x".repeat(LONGEST) + "…";
        assert_eq!(lines(&text), [long, "next".to_owned()]);
    }
}
