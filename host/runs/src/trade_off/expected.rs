//! How long trials probably take, from those that were measured.

use super::settings::Settings;
use crate::experiment::{Timing, repetitions};

/// A mesh of half the size of elements takes this many times as long: four times the elements, with twice the bandwidth.
const OF_A_DIVISION: i32 = 3;

/// What was measured so far.
#[derive(Debug, Default)]
pub(super) struct Expected {
    /// CPU seconds of one run with these settings.
    measured: Vec<(Settings, f64)>,
    /// Time and CPU time of all runs together, s.
    spent: [f64; 2],
}

impl Expected {
    /// A trial took this time and CPU time; one run of it this CPU time, where it came to its end.
    pub(super) fn took(&mut self, settings: &Settings, spent: [f64; 2], once: Option<f64>) {
        for (sum, spent) in self.spent.iter_mut().zip(spent) {
            *sum += spent;
        }
        // One that fails takes what it took.
        self.measured
            .push((settings.clone(), once.unwrap_or(spent[1])));
    }

    /// CPU seconds of one run, in proportion to the most similar one; none before the first.
    pub(super) fn once(&self, settings: &Settings) -> Option<f64> {
        let unlikeness = |other: &Settings| {
            let tolerances = [settings, other].map(|s| s.tolerance.unwrap_or(0.0));
            let differ = |is_other: bool| f64::from(u8::from(is_other));
            [
                settings.division.abs_diff(other.division) as f64,
                differ(settings.law != other.law),
                differ(settings.solver != other.solver),
                differ(tolerances[0].total_cmp(&tolerances[1]).is_ne()),
                (settings.increments / other.increments).ln().abs(),
            ]
        };
        let compare = |(a, _): &&(Settings, f64), (b, _): &&(Settings, f64)| {
            let [a, b] = [unlikeness(a), unlikeness(b)];
            let pairs = a.iter().zip(&b);
            pairs.fold(std::cmp::Ordering::Equal, |order, (a, b)| {
                order.then(a.total_cmp(b))
            })
        };
        let (like, seconds) = self.measured.iter().min_by(compare)?;
        let finer = settings.division as f64 / like.division as f64;
        let more = settings.increments / like.increments;
        Some(seconds * more * finer.powi(OF_A_DIVISION))
    }

    /// CPU seconds of a trial: how often it runs, and how long it may.
    pub(super) fn seconds(&self, settings: &Settings, timing: Timing, bounded: Timing) -> f64 {
        let once = self.once(settings).unwrap_or_default();
        let most = match bounded {
            Timing::Within(most) => return once.min(most.as_secs_f64()),
            _ if timing == Timing::Repeated => repetitions(once),
            _ => 1.0,
        };
        once * most
    }

    /// The time that so much CPU time takes: others may work on the machine.
    pub(super) fn lasts(&self, cpu_seconds: f64) -> f64 {
        let [time, cpu] = self.spent;
        cpu_seconds * f64::max(time / cpu.max(f64::MIN_POSITIVE), 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use std::time::Duration;

    fn settings(increments: f64, tolerance: Option<f64>, division: usize) -> Settings {
        Settings {
            increments,
            tolerance,
            division,
            ..Settings::default()
        }
    }

    #[test]
    fn what_is_alike_is_taken_for_the_measure() {
        let mut expected = Expected::default();
        assert_eq!(expected.once(&Settings::default()), None);
        expected.took(&Settings::default(), [0.6, 0.4], Some(0.1));
        assert_relative_eq!(expected.once(&settings(4.0, None, 1)).unwrap(), 0.4);
        assert_relative_eq!(expected.once(&settings(1.0, None, 2)).unwrap(), 0.8);
        // A tight tolerance that takes forty times as long says nothing of others.
        expected.took(&settings(0.5, Some(1e-10), 1), [2.0, 2.0], Some(2.0));
        let tight = expected.once(&settings(1.0, Some(1e-10), 1)).unwrap();
        assert_relative_eq!(tight, 4.0);
        assert_relative_eq!(expected.once(&settings(2.0, None, 1)).unwrap(), 0.2);
        assert_relative_eq!(expected.once(&settings(1.0, Some(1e-3), 1)).unwrap(), 0.1);
    }

    #[test]
    fn repetitions_and_bounds_count_and_so_do_others_on_the_machine() {
        let mut expected = Expected::default();
        expected.took(&Settings::default(), [1.6, 0.8], Some(0.1));
        let of = |timing, bounded| expected.seconds(&Settings::default(), timing, bounded);
        assert_relative_eq!(of(Timing::Once, Timing::Once), 0.1);
        assert_relative_eq!(of(Timing::Repeated, Timing::Repeated), 0.5);
        let within = Timing::Within(Duration::from_millis(50));
        assert_relative_eq!(of(Timing::Repeated, within), 0.05);
        assert_relative_eq!(expected.lasts(0.5), 1.0);
    }
}
