//! Meaning of the names of a calibration in the laws of its tests.

use crate::Error;
use crate::calibration::model::Subject;
use input::calibration::{Calibration, FreeInput};
use input::material::ParameterValue;
use law::{LawDescription, ParameterDescription};
use text::{Spanned, suggestion};

/// A law that a test calls.
#[derive(Clone, Debug)]
pub(super) struct Known {
    /// Its table under `[laws]` of a case; none of a driver.
    pub(super) table: Option<String>,
    pub(super) description: LawDescription,
}

impl Known {
    fn parameter(&self, id: &str) -> Option<&ParameterDescription> {
        self.description.parameters.iter().find(|p| p.id == id)
    }

    /// The value that the test's file gives to a parameter, or the law itself.
    pub(super) fn value(&self, subject: &Subject, id: &str) -> Option<f64> {
        let case = match subject {
            Subject::Driver(driver) => return driver.point().parameter(id),
            Subject::Case(case) => case,
        };
        let mut laws = case.file.laws.iter();
        let (_, law) = laws.find(|(key, _)| Some(key.get_ref()) == self.table.as_ref())?;
        let mut given = law.get_ref().parameters.iter();
        let Some((_, value)) = given.find(|(key, _)| key.get_ref() == id) else {
            return self.parameter(id)?.default;
        };
        match value.get_ref() {
            ParameterValue::Number(number) => Some(*number),
            ParameterValue::Integer(number) => Some(*number as f64),
            _ => None,
        }
    }
}

/// Place of a name, with its input.
#[derive(Clone, Copy, Debug)]
pub(super) enum Given<'a> {
    Free(&'a FreeInput),
    Fixed(&'a ParameterValue),
}

/// A name of the calibration for a parameter of laws.
#[derive(Clone, Copy, Debug)]
pub(super) struct Name<'a> {
    pub(super) given: Given<'a>,
    pub(super) written: &'a Spanned<String>,
    id: &'a Spanned<String>,
    laws: &'a [Spanned<String>],
}

/// A parameter of a law in a test, and the name that stands for it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Claim<'a> {
    pub(super) test: usize,
    pub(super) law: &'a Known,
    /// Number in the law.
    number: usize,
    pub(super) name: Name<'a>,
}

impl<'a> Claim<'a> {
    pub(super) fn parameter(&self) -> &'a ParameterDescription {
        &self.law.description.parameters[self.number]
    }

    /// Whether two mean the same value.
    fn is_of(&self, other: &Self) -> bool {
        let place = |claim: &Self| (claim.test, &claim.law.table, claim.number);
        place(self) == place(other)
    }

    /// Whether it goes behind others, which belong to drivers alone.
    fn is_shared(&self) -> bool {
        self.law.table.is_none() && !self.name.laws.is_empty()
    }
}

/// All names, those under `[fixed]` first.
pub(super) fn names(calibration: &Calibration) -> Vec<Name<'_>> {
    let file = &calibration.file;
    let fixed = file.fixed.iter().map(|(name, input)| {
        let input = input.get_ref();
        let given = Given::Fixed(input.value.get_ref());
        (given, name, &input.parameter, &input.laws)
    });
    let free = file.free.iter().map(|(name, input)| {
        let input = input.get_ref();
        (Given::Free(input), name, &input.parameter, &input.laws)
    });
    let all = fixed.chain(free);
    all.map(|(given, written, parameter, laws)| Name {
        given,
        written,
        id: parameter.as_ref().unwrap_or(written),
        laws,
    })
    .collect()
}

/// Parameters that the names stand for. In a driver a name without `laws` takes precedence over those with `laws`.
pub(super) fn claims<'a>(
    calibration: &Calibration,
    names: &[Name<'a>],
    laws: &'a [Vec<Known>],
) -> Result<Vec<Claim<'a>>, Error> {
    let tests = &calibration.file.test;
    check_stands_for(calibration, names)?;
    let mut claims: Vec<Claim<'a>> = Vec::new();
    for &name in names {
        let mut own: Vec<Claim<'a>> = Vec::new();
        for (test, known) in laws.iter().enumerate() {
            for law in name.of(calibration, known, tests[test].stands_for.as_ref())? {
                let mut parameters = law.description.parameters.iter();
                let Some(number) = parameters.position(|p| p.id == *name.id.get_ref()) else {
                    continue;
                };
                let claim = Claim {
                    test,
                    law,
                    number,
                    name,
                };
                // A law that a case calls in several ways has one table.
                if !own.iter().any(|other| other.is_of(&claim)) {
                    own.push(claim);
                }
            }
        }
        if own.is_empty() && matches!(name.given, Given::Fixed(_)) {
            return Err(name.nowhere(calibration, laws));
        }
        claims.extend(own);
    }
    let has_own = |claim: &Claim<'_>| {
        let mut others = claims.iter().filter(|other| other.is_of(claim));
        others.any(|other| !other.is_shared())
    };
    let kept = claims.iter().filter(|c| !c.is_shared() || !has_own(c));
    let kept: Vec<Claim<'a>> = kept.copied().collect();
    for (place, claim) in kept.iter().enumerate() {
        if let Some(first) = kept[..place].iter().find(|first| first.is_of(claim)) {
            let test = tests[claim.test].name.get_ref();
            return Err(twice(calibration, first, claim, test));
        }
    }
    Ok(kept)
}

/// Checks that every driver's `stands_for` is a table that some name belongs to.
fn check_stands_for(calibration: &Calibration, names: &[Name<'_>]) -> Result<(), Error> {
    let (free, fixed): (Vec<Name<'_>>, Vec<Name<'_>>) = names
        .iter()
        .partition(|name| matches!(name.given, Given::Free(_)));
    let tables = free.into_iter().chain(fixed).flat_map(|name| name.laws);
    let tables: Vec<&str> = tables.map(|table| table.get_ref().as_str()).collect();
    for test in &calibration.file.test {
        let Some(table) = &test.stands_for else {
            continue;
        };
        let error = |message: String| calibration.error(table.span(), message);
        if test.driver.is_none() {
            let message = "`stands_for` belongs to a driver: laws of a case have their tables";
            return Err(error(message.to_owned()));
        }
        if !tables.contains(&table.get_ref().as_str()) {
            let message = format!("no name belongs to the law `{}`", table.get_ref());
            return Err(error(message).with_hint(&suggestion(table.get_ref(), tables)));
        }
    }
    Ok(())
}

/// The error of two names for one value.
fn twice(calibration: &Calibration, first: &Claim<'_>, second: &Claim<'_>, test: &str) -> Error {
    let table = |claim: &Claim<'_>| match claim.name.given {
        Given::Free(_) => "free",
        Given::Fixed(_) => "fixed",
    };
    let [a, b] = [first, second].map(|claim| (claim.name.written.get_ref(), table(claim)));
    let law = second.law.table.as_ref();
    let of_law = law.map_or_else(String::new, |name| format!(" of law `{name}`"));
    let message = format!(
        "`{}`{of_law} has two names in test `{test}`: `{}` of [{}] and `{}` of [{}]",
        second.parameter().id,
        a.0,
        a.1,
        b.0,
        b.1
    );
    let hint = if second.is_shared() {
        "a name belongs to drivers, too; `stands_for` of the test says of which law its driver is. One without `laws` \
         belongs to drivers alone, and goes before others there"
    } else {
        "a value is looked for or fixed, once"
    };
    let span = second.name.written.span();
    calibration.error(span, message).with_hint(hint)
}

impl Name<'_> {
    /// The laws of a test that it belongs to.
    fn of<'k>(
        self,
        calibration: &Calibration,
        known: &'k [Known],
        stands_for: Option<&Spanned<String>>,
    ) -> Result<Vec<&'k Known>, Error> {
        let id = self.id.get_ref();
        let has = |law: &&Known| law.parameter(id).is_some();
        let belongs_to = |table: &String| self.laws.iter().any(|law| law.get_ref() == table);
        let is_case = known.iter().any(|law| law.table.is_some());
        if !is_case {
            let is_another = !self.laws.is_empty()
                && stands_for.is_some_and(|table| !belongs_to(table.get_ref()));
            let own = known.iter().filter(|_| !is_another);
            return Ok(own.filter(has).collect());
        }
        let named = known
            .iter()
            .filter(|law| law.table.as_ref().is_some_and(belongs_to));
        let named: Vec<&Known> = named.collect();
        if let Some(law) = named.iter().find(|law| !has(law)) {
            let message = format!("law `{}` has no parameter `{id}`", law.description.id);
            let ids = law.description.parameters.iter().map(|p| p.id.as_str());
            let error = calibration.error(self.id.span(), message);
            return Err(error.with_hint(&suggestion(id, ids)));
        }
        Ok(named)
    }

    /// The error of a parameter that no test has.
    pub(super) fn nowhere(self, calibration: &Calibration, laws: &[Vec<Known>]) -> Error {
        let all = || laws.iter().flatten();
        let tables: Vec<&str> = all().filter_map(|law| law.table.as_deref()).collect();
        let mut own = self.laws.iter();
        let unknown = own.find(|name| !tables.contains(&name.get_ref().as_str()));
        if let Some(name) = unknown.filter(|_| !tables.is_empty()) {
            let (span, name) = (name.span(), name.get_ref());
            let message = format!("no case of a test has a law `{name}`, or none uses it");
            let error = calibration.error(span, message);
            return error.with_hint(&suggestion(name, tables));
        }
        let (name, id) = (self.written.get_ref(), self.id.get_ref());
        let of_cases = all().filter(|law| law.parameter(id).is_some());
        let of_cases: Vec<&str> = of_cases.filter_map(|law| law.table.as_deref()).collect();
        if !of_cases.is_empty() {
            let message = format!(
                "`{name}` needs `laws`: the tables under [laws] of the case that it belongs to"
            );
            let hint = format!("these have such a parameter: {}", of_cases.join(", "));
            return calibration
                .error(self.written.span(), message)
                .with_hint(&hint);
        }
        let message = format!("no law of a test has a parameter `{id}`");
        let ids = all().flat_map(|law| &law.description.parameters);
        let mut ids: Vec<&str> = ids.map(|p| p.id.as_str()).collect();
        ids.sort_unstable();
        ids.dedup();
        let error = calibration.error(self.id.span(), message);
        error.with_hint(&suggestion(id, ids))
    }
}
