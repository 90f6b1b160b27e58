//! The matrix: every combination ends as *agrees*, *refused* or *silent*, and the counts are in
//! `tests/README.md`.
//!
//! Silent is a result that the law calls good and that is wrong beyond the tolerance of its family, or
//! not a number. There may be none. Refused is an error with a reason, a request for ever smaller
//! steps included. Families of meaningful combinations may refuse one in a hundred; the family of
//! meaningless input must refuse all.

use crate::{garbage, joint, mepi_paths, mohr_coulomb, oriented, quadrature, thin_layer};
use std::path::Path;

/// How a combination ends.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Verdict {
    /// With the reference's numbers.
    Agrees,
    /// With this reason.
    Refused(String),
    /// With wrong numbers, or none, and no word about it.
    Silent(String),
}

/// Combinations of one kind and how they ended.
#[derive(Debug)]
pub(crate) struct Family {
    pub(crate) name: &'static str,
    pub(crate) reference: &'static str,
    /// Whether an answer can be expected.
    pub(crate) meaningful: bool,
    pub(crate) ends: Vec<(String, Verdict)>,
}

impl Family {
    pub(crate) fn new(name: &'static str, reference: &'static str) -> Self {
        Self {
            name,
            reference,
            meaningful: true,
            ends: vec![],
        }
    }

    pub(crate) fn add(&mut self, combination: String, verdict: Verdict) {
        self.ends.push((combination, verdict));
    }

    fn count(&self, kind: impl Fn(&Verdict) -> bool) -> usize {
        self.ends
            .iter()
            .filter(|(_, verdict)| kind(verdict))
            .count()
    }

    fn counts(&self) -> [usize; 4] {
        [
            self.ends.len(),
            self.count(|v| *v == Verdict::Agrees),
            self.count(|v| matches!(v, Verdict::Refused(_))),
            self.count(|v| matches!(v, Verdict::Silent(_))),
        ]
    }
}

fn table(families: &[Family]) -> String {
    let mut lines = vec![
        "| family | held against | combinations | agree | refused | silent |".to_owned(),
        "|---|---|---|---|---|---|".to_owned(),
    ];
    let mut sum = [0; 4];
    for family in families {
        let counts = family.counts();
        let [all, agree, refused, silent] = counts;
        lines.push(format!(
            "| {} | {} | {all} | {agree} | {refused} | {silent} |",
            family.name, family.reference
        ));
        for (total, count) in sum.iter_mut().zip(counts) {
            *total += count;
        }
    }
    let [all, agree, refused, silent] = sum;
    lines.push(format!(
        "| all | | {all} | {agree} | {refused} | {silent} |\n"
    ));
    lines.join("\n")
}

/// The table between its two marks in `tests/README.md`: written with `PILUM_BLESS=1`, otherwise
/// compared.
fn bless_or_compare(table: &str) {
    const MARKS: [&str; 2] = ["<!-- extremes: begin -->\n", "<!-- extremes: end -->"];
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let begin = page.find(MARKS[0]).unwrap() + MARKS[0].len();
    let end = page.find(MARKS[1]).unwrap();
    if std::env::var_os("PILUM_BLESS").is_some() {
        std::fs::write(&path, format!("{}{table}{}", &page[..begin], &page[end..])).unwrap();
    } else {
        assert_eq!(&page[begin..end], table, "PILUM_BLESS=1 writes the table");
    }
}

#[test]
fn every_combination_agrees_or_is_refused() {
    let families = std::thread::scope(|scope| {
        let parts: [fn() -> Vec<Family>; 4] = [
            mepi_paths::families,
            quadrature::families,
            || {
                let mut all = mohr_coulomb::families();
                all.extend(oriented::families());
                all.extend(joint::families());
                all.extend(thin_layer::families());
                all
            },
            garbage::families,
        ];
        let started = parts.map(|part| scope.spawn(part));
        started
            .into_iter()
            .flat_map(|part| part.join().unwrap())
            .collect::<Vec<_>>()
    });
    let table = table(&families);
    println!("{table}");
    let (mut all, mut agree) = (0, 0);
    let mut wrong = vec![];
    for family in &families {
        let mut reasons = std::collections::BTreeMap::new();
        for (combination, verdict) in &family.ends {
            match verdict {
                Verdict::Agrees => {}
                Verdict::Refused(why) => {
                    reasons.entry(why).or_insert((0, combination)).0 += 1;
                }
                Verdict::Silent(what) => {
                    wrong.push(format!("{}: {combination}: {what}", family.name));
                }
            }
        }
        for (why, (count, combination)) in reasons {
            println!("{}: {count} × {why}, e.g. {combination}", family.name);
        }
        let [n, good, ..] = family.counts();
        if family.meaningful {
            all += n;
            agree += good;
        } else if good > 0 {
            wrong.push(format!("{}: {good} accepted", family.name));
        }
    }
    let shown = wrong.iter().take(60).cloned().collect::<Vec<_>>();
    assert!(wrong.is_empty(), "{}:\n{}", wrong.len(), shown.join("\n"));
    assert!(all >= 2000, "{all} combinations");
    assert!(agree * 100 >= all * 99, "{agree} of {all} agree");
    bless_or_compare(&table);
}
