//! How a run goes, for whoever waits for it.

use crate::output::say;
use indicatif::{ProgressBar, ProgressStyle};
use law::Stop;
use mechanics::Place;
use results::pile::Resistances;
use results::report::Known;
use runs::run::Observer;
use runs::supervision;
use std::io::{IsTerminal, Write as _};
use std::path::{Path, PathBuf};
use text::counted;

/// A bar on a terminal, plain lines elsewhere; both on the error stream.
pub(crate) struct Progress {
    /// Number of the case, from 1, and where its results go.
    place: (usize, PathBuf),
    pub(crate) stop: Stop,
    bar: Option<ProgressBar>,
    cut_backs: usize,
    /// A phase has begun, so there is a folder with results.
    pub(crate) has_begun: bool,
    /// What the report need not read again.
    pub(crate) known: Known,
}

impl Progress {
    pub(crate) fn new(number: usize, folder: &Path, stop: &Stop) -> Self {
        Self {
            place: (number, folder.to_owned()),
            stop: stop.clone(),
            bar: None,
            cut_backs: 0,
            has_begun: false,
            known: Known::default(),
        }
    }

    pub(crate) fn say(&self, line: &str) {
        match &self.bar {
            Some(bar) => bar.println(line),
            None => say!("{line}"),
        }
    }

    pub(crate) fn finish(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish();
        }
    }
}

impl Observer for Progress {
    fn phase(&mut self, name: &str, increments: usize) {
        self.finish();
        self.cut_backs = 0;
        self.has_begun = true;
        supervision::case_begun(self.place.0, &self.place.1);
        if std::io::stderr().is_terminal() {
            let bar = ProgressBar::new(increments as u64);
            let template = "{prefix:16} {bar:32} {pos}/{len}  {msg}  {eta} left";
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style);
            }
            bar.set_prefix(name.to_owned());
            bar.tick();
            self.bar = Some(bar);
        } else {
            say!("phase {name}: {}", counted(increments, "increment"));
        }
    }

    fn increment(&mut self, place: &Place, of: usize, iterations: usize) {
        match &self.bar {
            Some(bar) => {
                bar.set_position(place.increment as u64);
                bar.set_message(format!(
                    "{}, {}",
                    counted(iterations, "iteration"),
                    counted(self.cut_backs, "cut-back")
                ));
            }
            None => say!(
                "phase {}: increment {}/{of}, {}",
                place.phase,
                place.increment,
                counted(iterations, "iteration")
            ),
        }
    }

    fn cut_back(&mut self, place: &Place, reason: &str) {
        self.cut_backs += 1;
        if self.cut_backs == 1 {
            self.say(&format!(
                "{place}: step cut back (all of them: log.jsonl): {reason}"
            ));
        }
    }

    fn warning(&mut self, message: &str) {
        self.say(&format!("warning: {message}"));
    }

    fn note(&mut self, message: &str) {
        self.say(message);
    }

    fn at_rest(&mut self, phase: &str, share: f64) {
        self.say(&format!(
            "phase {phase}: at rest within {share:.1e} of its weight"
        ));
    }

    fn resumed(&mut self, from: Option<&Place>) {
        self.has_begun = true;
        match from {
            Some(place) => self.say(&format!("resumed after {place}")),
            None => self.say("done already"),
        }
    }

    fn written(&mut self, known: Known) {
        self.known = known;
    }

    fn pile(&mut self, resistances: &Resistances) {
        self.finish();
        let unit = resistances.unit;
        // Nothing has no sign.
        let tenths = |force: f64| (10.0 * force).round() / 10.0 + 0.0;
        let line = match &resistances.ten_percent {
            Ok(found) => {
                let [head, shaft, base] = [found.head, found.shaft, found.base].map(tenths);
                format!(
                    "pile: resistance at 10 % of the diameter ({:.4} m) {head:.1} {unit}, of it shaft {shaft:.1} \
                 and base {base:.1}",
                    0.1 * resistances.diameter
                )
            }
            Err(why) => format!("pile: no resistance at 10 % of the diameter: {why}"),
        };
        let _ = writeln!(supervision::stdout(), "{line}");
        if let Ok(found) = &resistances.uplift_ten_percent {
            let head = tenths(found.head);
            let _ = writeln!(
                supervision::stdout(),
                "pile: uplift resistance at 10 % of the diameter {head:.1} {unit}"
            );
        }
    }

    fn stop(&self) -> Stop {
        self.stop.clone()
    }
}
