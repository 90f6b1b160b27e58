//! Places in a case file of the items that errors of its problem name.

use crate::case::{Case, GroupInput, PhaseInput};
use crate::spanned::Given;
use crate::{Error, refusal};
use abi::status::Outcome;
use mechanics::check::{Cause, Item, Key, Refusal};
use mechanics::group::PointFailure;
use std::ops::Range;
use text::Spanned;

impl Case {
    /// An error of the case's problem or simulation, at its place in the file where it has one.
    pub fn place(&self, error: mechanics::Error) -> Error {
        match error {
            mechanics::Error::Refused(refusal) => self.place_refusal(&refusal),
            mechanics::Error::CannotStart(failure) => self.cannot_start(failure),
            other => other.into(),
        }
    }

    fn place_refusal(&self, refusal: &Refusal) -> Error {
        let (message, hint) = refusal::words(&refusal.cause);
        let span = self.span(&refusal.item, &refusal.cause);
        let error = self.source.error(span, message);
        match hint {
            Some(hint) => error.hint(hint).into(),
            None => error.into(),
        }
    }

    /// Place of a part of the problem in the file.
    pub(super) fn span(&self, item: &Item, cause: &Cause) -> Range<usize> {
        let file = &self.file;
        let group = |number: usize| file.groups.get_index(number);
        let phase = |number: usize| file.phases.get(number);
        let found = match item {
            Item::Problem => None,
            Item::Group(number) => group(*number).map(|(name, _)| name.span()),
            Item::GroupKey(number, key) => group(*number).map(|(name, group)| {
                let place = self.place_of_key(name.get_ref(), group.get_ref(), *key);
                place.unwrap_or(name.span())
            }),
            Item::LawOf { group: of, phase } => group(*of).map(|(name, group)| {
                let swap = phase.and_then(|phase| file.phases.get(phase)?.laws.get(name));
                swap.unwrap_or(&group.get_ref().law).span()
            }),
            Item::Material(name) => {
                let mut laws = file.laws.keys();
                laws.find(|key| key.get_ref() == name).map(Spanned::span)
            }
            Item::Support(number) => file.supports.get(*number).map(|s| s.line.span()),
            Item::Water(None) => file.water.as_ref().map(|w| w.get_ref().unit_weight.span()),
            Item::Activation {
                phase: of,
                group: number,
                is_activated,
            } => phase(*of).zip(group(*number)).and_then(|(of, (name, _))| {
                let names = if *is_activated {
                    &of.activate
                } else {
                    &of.deactivate
                };
                let mut same = names.iter().filter(|n| n.get_ref() == name.get_ref());
                same.next_back().map(Spanned::span)
            }),
            Item::Phase(of)
            | Item::Displacement(of, _)
            | Item::Free(of, _)
            | Item::Pressure(of, _)
            | Item::Force(of, _)
            | Item::Rigid(of, _)
            | Item::Time(of)
            | Item::Course(of)
            | Item::Until(of)
            | Item::Strain(of, _)
            | Item::UnitWeight(of, _)
            | Item::DrainageOf(of, _)
            | Item::Water(Some(of)) => phase(*of).and_then(|of| place_in_phase(of, item, cause)),
        };
        found.unwrap_or(0..0)
    }

    /// Place of a key of a group, where it is given.
    fn place_of_key(&self, name: &str, group: &GroupInput, key: Key) -> Option<Range<usize>> {
        match key {
            Key::Integration => group.integration.place(),
            Key::Normal => group.normal.place(),
            Key::InPlane => group.in_plane.place(),
            Key::InitialStress => {
                let path = format!("groups.{name}.initial_stress");
                let setting = self.source.setting_of(&path);
                setting.or_else(|| group.initial_stress.place())
            }
            Key::UnitWeight => group.unit_weight.place(),
            Key::Drainage => group.drainage.place(),
            Key::UndrainedPoissonRatio => group.undrained_poisson_ratio.place(),
        }
    }

    /// The error of a law that cannot start from the stress it finds: at the law's place in the
    /// file, if that is what the law says.
    fn cannot_start(&self, failure: Box<PointFailure>) -> Error {
        let mut laws = self.file.laws.iter();
        let entry = laws.find(|(key, _)| key.get_ref() == &failure.law);
        let (outcome, group) = (failure.failure.outcome, failure.group.clone());
        let error = mechanics::Error::CannotStart(failure);
        match entry {
            Some((name, law)) if matches!(outcome, Outcome::Domain | Outcome::Parameter) => {
                let law = law.get_ref();
                // What the file gives to start from is what the law can refuse first.
                let given = law.initial.values().next().map(Spanned::span);
                let paths = [
                    format!("laws.{}.initial", name.get_ref()),
                    format!("groups.{group}.initial_stress"),
                ];
                let setting = paths.iter().find_map(|path| self.source.setting_of(path));
                let span = setting.or(given).unwrap_or_else(|| law.law.span());
                self.source.error(span, error.to_string()).into()
            }
            _ => error.into(),
        }
    }
}

/// Place of a part of a phase.
fn place_in_phase(phase: &PhaseInput, item: &Item, cause: &Cause) -> Option<Range<usize>> {
    Some(match item {
        Item::Displacement(_, number) => phase.displacement.get(*number)?.line.span(),
        Item::Free(_, number) => phase.free.get(*number)?.line.span(),
        Item::Pressure(_, number) => phase.pressure.get(*number)?.line.span(),
        Item::Force(_, number) => phase.force.get(*number)?.line.span(),
        Item::Rigid(_, number) => phase.rigid.get(*number)?.span(),
        Item::Time(_) => phase.time.place()?,
        Item::Course(_) => phase.course.place()?,
        Item::Until(_) => phase.until.place()?,
        Item::Strain(_, number) => phase.strain.get_index(*number)?.1.span(),
        Item::UnitWeight(_, number) => phase.unit_weight.get_index(*number)?.1.span(),
        Item::DrainageOf(_, number) => phase.drainage.get_index(*number)?.1.span(),
        Item::Water(_) => phase.water.as_ref()?.get_ref().level.span(),
        _ if matches!(cause, Cause::Increments(_)) => phase.increments.span(),
        _ => phase.name.span(),
    })
}
