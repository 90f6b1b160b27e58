//! Does a law leave numbers and the process alone?

use crate::check::draw::Draw;
use crate::check::points::UPDATE;
use crate::check::{Found, Subject, Verdict, failed, warned};
use law::probe::process;
use std::hint::black_box;

/// What a law could change about numbers and the process.
struct Environment {
    /// What to say where it is another one, and what it is.
    settings: Vec<(String, String)>,
    /// Where the system tells.
    threads: Option<usize>,
    files: Option<usize>,
}

impl Environment {
    fn now() -> Self {
        let one = black_box(1.0_f64);
        let little = black_box(0.75 * f64::EPSILON);
        let less = black_box(0.25 * f64::EPSILON);
        // Each direction of rounding gives another four numbers.
        let rounded = [one + little, one + less, -one - little, -one - less].map(f64::to_bits);
        let subnormal = black_box(f64::MIN_POSITIVE) * black_box(0.5);
        // Limits, and of the status what masks signals and files, where the system tells.
        let limits = std::fs::read_to_string("/proc/self/limits").unwrap_or_default();
        let status = std::fs::read_to_string("/proc/thread-self/status").unwrap_or_default();
        let is_mask = |line: &&str| line.starts_with("Umask:") || line.starts_with("SigBlk:");
        let masks: Vec<&str> = status.lines().filter(is_mask).collect();
        let process = (std::process::id(), process::has_had_children());
        let variables: Vec<_> = std::env::vars_os().collect();
        let (locale, folder) = (process::locale(), std::env::current_dir().ok());
        let has_changed = |what: &str, now: String| (format!("{what} changed"), now);
        let mut settings = vec![
            has_changed("the working directory has", format!("{folder:?}")),
            has_changed(
                "the treatment of subnormal numbers has",
                subnormal.to_bits().to_string(),
            ),
            has_changed("the rounding mode has", format!("{rounded:?}")),
            has_changed(
                "what the processor does on exceptions of arithmetic has",
                process::arithmetic().to_string(),
            ),
            (format!("the locale is {locale} now"), locale),
            ("an alarm is set".to_owned(), process::alarm().to_string()),
            has_changed("the limits of the process have", limits),
            has_changed("the mask of signals or of new files has", masks.join("\n")),
            ("a process was started".to_owned(), format!("{process:?}")),
        ];
        let handlers = process::signal_handlers().into_iter().zip(1..);
        settings.extend(handlers.map(|(handler, number)| {
            has_changed(
                &format!("the handler of signal {number} has"),
                handler.to_string(),
            )
        }));
        settings.push(has_changed(
            "the variables of the environment have",
            format!("{variables:?}"),
        ));
        let entries = |folder: &str| Some(std::fs::read_dir(folder).ok()?.count());
        Self {
            settings,
            threads: entries("/proc/self/task"),
            files: entries("/proc/self/fd"),
        }
    }

    /// The change.
    fn changed(&self, after: &Self) -> Option<String> {
        let mut pairs = self.settings.iter().zip(&after.settings);
        if let Some((_, (what, _))) = pairs.find(|(before, after)| before.1 != after.1) {
            return Some(what.clone());
        }
        let more = |what: &str, before: Option<usize>, after: Option<usize>| {
            let more = after?.checked_sub(before?)?;
            (more > 0).then(|| format!("{what}: {more}"))
        };
        more("threads are left behind", self.threads, after.threads)
            .or_else(|| more("open files are left behind", self.files, after.files))
            .or_else(|| {
                let what = "files that it has not opened are closed";
                more(what, after.files, self.files)
            })
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
    subject.each(Draw::Any, "drive", 2, |specimen, random| {
        specimen.paths(20, random)?;
        let mut points = specimen.points(3, random)?;
        points[0].gradient1[0] = f64::NAN;
        specimen.call(&points, UPDATE)?;
        Ok(0)
    })?;
    Ok(())
}
