//! Messages that list several faults or names.

use super::cursor::Fault;

/// Names that a note lists, and faults of a file that are said.
const MOST_NAMES: usize = 20;
const MOST_FAULTS: usize = 10;

/// `1 node is`, `2 nodes are`.
pub(super) fn counted(n: usize, what: &str, one: &str, many: &str) -> String {
    let verb = if n == 1 { one } else { many };
    format!("{n} {what}{verb}")
}

/// Some names and how many more there are.
pub(super) fn list(names: impl ExactSizeIterator<Item = String>) -> String {
    let more = names.len().saturating_sub(MOST_NAMES);
    let names: Vec<String> = names.take(MOST_NAMES).collect();
    let names = names.join(", ");
    if more == 0 {
        names
    } else {
        format!("{names}, and {more} more")
    }
}

/// What is said of names that curves and points have.
pub(super) fn of_two_kinds<'n>(both: impl Iterator<Item = &'n String>) -> Option<String> {
    let both: Vec<String> = both.map(|name| format!("`{name}`")).collect();
    (!both.is_empty()).then(|| {
        format!(
            "physical curves whose names are also those of points: the curves are taken: {}",
            list(both.into_iter())
        )
    })
}

/// Faults of a file. Several are reported together.
#[derive(Default)]
pub(super) struct Faults(Vec<Fault>);

impl Faults {
    /// Takes note of a fault, if there is one.
    ///
    /// # Errors
    /// As [`Self::refuse`], once there are many.
    pub(super) fn add(&mut self, outcome: Result<(), Fault>) -> Result<(), Fault> {
        self.0.extend(outcome.err());
        if self.0.len() < MOST_FAULTS {
            return Ok(());
        }
        self.0.push(format!("more than {MOST_FAULTS} are not said"));
        self.refuse()
    }

    /// Refuses a file that has faults.
    ///
    /// # Errors
    /// The faults, a line each.
    pub(super) fn refuse(&self) -> Result<(), Fault> {
        if self.0.is_empty() {
            return Ok(());
        }
        Err(self.0.join("\n"))
    }
}
