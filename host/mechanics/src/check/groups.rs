//! Checks of groups: weights, drainage, stress at rest.

use super::{Cause, Item, Key, Refusal};
use crate::problem::{Drainage, ElementGroup, Formulation, InitialStress, Problem, Profile, Ratio};
use std::collections::HashSet;

/// Refuses two groups of one name.
pub(super) fn refuse_same_names(problem: &Problem) -> Result<(), Refusal> {
    let mut names = HashSet::new();
    for (number, group) in problem.groups.iter().enumerate() {
        if !names.insert(group.name.as_str()) {
            let cause = Cause::TwoGroups(group.name.clone());
            return Err(Refusal::new(Item::Group(number), cause));
        }
    }
    Ok(())
}

/// Refuses invalid numbers, and keys that do not go together.
pub(super) fn check(problem: &Problem) -> Result<(), Refusal> {
    for (number, group) in problem.groups.iter().enumerate() {
        let in_phases = problem.phases.iter().flat_map(|phase| &phase.drainage);
        let is_undrained = group.drainage == Drainage::Undrained
            || in_phases
                .into_iter()
                .any(|said| *said == (number, Drainage::Undrained));
        check_group(number, group, is_undrained)?;
    }
    if let Some(water) = &problem.water
        && !(water.unit_weight.is_finite() && water.unit_weight > 0.0)
    {
        let what = "the water's `unit_weight`";
        let cause = Cause::OutOfBounds(what, water.unit_weight, "a positive number");
        return Err(Refusal::new(Item::Water(None), cause));
    }
    Ok(())
}

/// `is_undrained`: in some phase.
fn check_group(number: usize, group: &ElementGroup, is_undrained: bool) -> Result<(), Refusal> {
    let refuse = |key, cause| Err(Refusal::new(Item::GroupKey(number, key), cause));
    let weights = [Some(group.unit_weight), group.saturated_unit_weight];
    let named = ["`unit_weight`", "`saturated_unit_weight`"].into_iter();
    let mut named = named.zip(weights);
    let negative = |(name, weight): (_, Option<f64>)| {
        let weight = weight.filter(|w| !(w.is_finite() && *w >= 0.0))?;
        Some((name, weight))
    };
    if let Some((name, weight)) = named.find_map(negative) {
        let cause = Cause::OutOfBounds(name, weight, "zero or more");
        return refuse(Key::UnitWeight, cause);
    }
    let is_solid = group.formulation == Formulation::Solid;
    if group.formulation == Formulation::ZeroThickness
        && weights.into_iter().flatten().any(|weight| weight > 0.0)
    {
        let cause = Cause::Misplaced(Key::UnitWeight, group.formulation);
        return refuse(Key::UnitWeight, cause);
    }
    if group.drainage == Drainage::Undrained && !is_solid {
        let cause = Cause::Misplaced(Key::Drainage, group.formulation);
        return refuse(Key::Drainage, cause);
    }
    if is_undrained && is_solid {
        if !group.pore_water {
            return refuse(
                Key::Drainage,
                Cause::UndrainedWithoutWater(group.name.clone()),
            );
        }
        let nu = group.undrained_poisson_ratio;
        if !(nu > 0.0 && nu < 0.5) {
            let what = "`undrained_poisson_ratio`";
            let cause = Cause::OutOfBounds(what, nu, "more than 0, less than 0.5");
            return refuse(Key::UndrainedPoissonRatio, cause);
        }
    }
    check_initial_stress(number, group)
}

fn check_initial_stress(number: usize, group: &ElementGroup) -> Result<(), Refusal> {
    let refuse = |key, cause| Err(Refusal::new(Item::GroupKey(number, key), cause));
    let is_solid = group.formulation == Formulation::Solid;
    match &group.initial_stress {
        Some(InitialStress::Constant(stress)) if stress.iter().any(|s| !s.is_finite()) => {
            refuse(Key::InitialStress, Cause::NotFinite("`initial_stress`"))
        }
        Some(InitialStress::AtRest(_)) if !is_solid => {
            let cause = Cause::AtRestInInterface(group.formulation);
            refuse(Key::InitialStress, cause)
        }
        Some(InitialStress::AtRest(at_rest)) => match unlikely(&at_rest.ratio) {
            Some(cause) => refuse(Key::InitialStress, cause),
            None if at_rest.surcharge.is_some_and(|kpa| !kpa.is_finite()) => {
                refuse(Key::InitialStress, Cause::NotFinite("`surcharge`"))
            }
            None => Ok(()),
        },
        _ => Ok(()),
    }
}

/// The value of an earth pressure at rest that is out of bounds.
fn unlikely(ratio: &Ratio) -> Option<Cause> {
    let below = |what, profile: &Profile, least: f64, bounds| {
        let value = profile.values().find(|value| *value < least);
        value.map(|value| Cause::OutOfBounds(what, value, bounds))
    };
    match ratio {
        Ratio::K0(k_0) => below("`k_0`", k_0, 0.0, "zero or more"),
        Ratio::Overconsolidated {
            friction_angle,
            ocr,
            pop,
            poisson_ratio: nu,
        } => {
            let steep = friction_angle.values().find(|phi| *phi >= 90.0);
            steep
                .map(|phi| Cause::OutOfBounds("`friction_angle`", phi, "less than 90"))
                .or_else(|| below("`friction_angle`", friction_angle, 0.0, "zero or more"))
                .or_else(|| below("`ocr`", ocr, 1.0, "1 or more"))
                .or_else(|| below("`pop`", pop, 0.0, "zero or more"))
                .or_else(|| {
                    let is_ratio = (0.0..0.5).contains(nu);
                    let bounds = "0 to less than 0.5";
                    (!is_ratio).then_some(Cause::OutOfBounds("`poisson_ratio`", *nu, bounds))
                })
        }
    }
}
