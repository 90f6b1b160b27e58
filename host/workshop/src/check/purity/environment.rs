//! Does a law leave numbers and the process alone?

use crate::check::points::UPDATE;
use crate::check::{Found, Subject, Verdict, failed, warned};
use law::probe::process;
use std::ffi::OsString;
use std::hint::black_box;
use std::path::PathBuf;

/// What a law could change about numbers and the process.
#[derive(PartialEq, Debug)]
struct Environment {
    rounded: [u64; 4],
    subnormal: u64,
    folder: Option<PathBuf>,
    signals: Vec<usize>,
    arithmetic: u32,
    locale: String,
    has_alarm: bool,
    /// Limits, and of the status what masks signals and files, where the system tells.
    limits: Option<String>,
    masks: Vec<String>,
    variables: Vec<(OsString, OsString)>,
    process: u32,
    had_children: bool,
    /// Where the system tells.
    threads: Option<usize>,
    files: Option<usize>,
}

impl Environment {
    fn now() -> Self {
        let one = black_box(1.0_f64);
        let little = black_box(0.75 * f64::EPSILON);
        let less = black_box(0.25 * f64::EPSILON);
        let entries = |folder: &str| Some(std::fs::read_dir(folder).ok()?.count());
        Self {
            // Each direction of rounding gives another four numbers.
            rounded: [one + little, one + less, -one - little, -one - less].map(f64::to_bits),
            subnormal: (black_box(f64::MIN_POSITIVE) * black_box(0.5)).to_bits(),
            folder: std::env::current_dir().ok(),
            signals: process::signal_handlers(),
            arithmetic: process::arithmetic(),
            locale: process::locale(),
            has_alarm: process::alarm(),
            limits: std::fs::read_to_string("/proc/self/limits").ok(),
            masks: std::fs::read_to_string("/proc/thread-self/status")
                .unwrap_or_default()
                .lines()
                .filter(|line| line.starts_with("Umask:") || line.starts_with("SigBlk:"))
                .map(str::to_owned)
                .collect(),
            variables: std::env::vars_os().collect(),
            process: std::process::id(),
            had_children: process::has_had_children(),
            threads: entries("/proc/self/task"),
            files: entries("/proc/self/fd"),
        }
    }

    /// The change.
    fn changed(&self, after: &Self) -> Option<String> {
        let more = |before: Option<usize>, after: Option<usize>| {
            let more = after?.checked_sub(before?)?;
            (more > 0).then_some(more)
        };
        let what = if self.folder != after.folder {
            "the working directory has changed"
        } else if self.subnormal != after.subnormal {
            "the treatment of subnormal numbers has changed"
        } else if self.rounded != after.rounded {
            "the rounding mode has changed"
        } else if self.arithmetic != after.arithmetic {
            "what the processor does on exceptions of arithmetic has changed"
        } else if self.locale != after.locale {
            return Some(format!("the locale is {} now", after.locale));
        } else if self.has_alarm != after.has_alarm {
            "an alarm is set"
        } else if self.limits != after.limits {
            "the limits of the process have changed"
        } else if self.masks != after.masks {
            "the mask of signals or of new files has changed"
        } else if self.process != after.process || self.had_children != after.had_children {
            "a process was started"
        } else if let Some(number) = (1..)
            .zip(self.signals.iter().zip(&after.signals))
            .find_map(|(number, (before, after))| (before != after).then_some(number))
        {
            return Some(format!("the handler of signal {number} has changed"));
        } else if self.variables != after.variables {
            "the variables of the environment have changed"
        } else if let Some(n) = more(self.threads, after.threads) {
            return Some(format!("threads are left behind: {n}"));
        } else if let Some(n) = more(self.files, after.files) {
            return Some(format!("open files are left behind: {n}"));
        } else if let Some(n) = more(after.files, self.files) {
            return Some(format!("files that it has not opened are closed: {n}"));
        } else {
            return None;
        };
        Some(what.to_owned())
    }
}

pub(super) fn environment_is_left_alone(subject: &Subject) -> Found {
    let mut before = Environment::now();
    // The program itself may keep the file of a library that it has opened.
    subject.laws()?;
    before.files = Environment::now().files;
    drive(subject)?;
    if let Some(what) = before.changed(&Environment::now()) {
        return Err(failed(what));
    }
    match law::process_state::remarks().pop() {
        None => Ok(String::new()),
        Some(remark) => Err(warned(remark)),
    }
}

/// Uses all functions, with failures too.
pub(super) fn drive(subject: &Subject) -> Result<(), Verdict> {
    subject.each("drive", 2, |specimen, random| {
        specimen.paths(20, random)?;
        let mut points = specimen.points(3, random)?;
        points[0].gradient1[0] = f64::NAN;
        specimen.call(&points, UPDATE)?;
        Ok(0)
    })?;
    Ok(())
}
