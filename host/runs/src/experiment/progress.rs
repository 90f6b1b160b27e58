//! How far a study has come, and how long it will still take.

use std::time::Instant;

/// Work done and to do, in any one unit.
#[derive(Debug)]
pub(crate) struct Pace {
    started: Instant,
    done: f64,
    all: f64,
}

impl Pace {
    /// Nothing done yet.
    pub(crate) fn new(all: f64) -> Self {
        Self {
            started: Instant::now(),
            done: 0.0,
            all,
        }
    }

    /// A piece is done.
    pub(crate) fn did(&mut self, piece: f64) {
        self.done += piece;
    }

    /// The current activity, with the remaining time at this pace.
    pub(crate) fn line(&self, doing: &str) -> String {
        let rest = (self.all - self.done) / self.done;
        if !rest.is_finite() || rest <= 0.0 {
            return doing.to_owned();
        }
        let left = rest * self.started.elapsed().as_secs_f64();
        format!("{doing} (about {} left)", in_words(left))
    }
}

/// A length of time, as well as it is known.
pub(crate) fn in_words(seconds: f64) -> String {
    if seconds < 100.0 {
        format!("{:.0} s", seconds.max(1.0))
    } else if seconds < 6000.0 {
        format!("{:.0} min", seconds / 60.0)
    } else {
        format!("{:.1} h", seconds / 3600.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_is_in_proportion_to_what_is_left() {
        let mut pace = Pace::new(3.0);
        assert_eq!(pace.line("a"), "a");
        pace.started -= std::time::Duration::from_secs(30);
        pace.did(1.0);
        assert_eq!(pace.line("b"), "b (about 60 s left)");
        pace.did(2.0);
        assert_eq!(pace.line("c"), "c");
    }

    #[test]
    fn lengths_of_time_have_fitting_units() {
        assert_eq!(
            [0.2, 59.6, 150.0, 9000.0].map(in_words),
            ["1 s", "60 s", "2 min", "2.5 h"]
        );
    }
}
