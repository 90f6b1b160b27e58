//! Checks of a response without its equations: jumps, convergence in smaller increments, validity
//! of the elastic operator.

use super::coverage::beyond_elastic;
use super::draw::Draw;
use super::loading_path::{Step, flux_scale, some, starts};
use super::mathematics::{NEEDS, counts};
use super::points::{
    ELASTIC, ITERATED, ROUND_OFF, UPDATE, apart, carry_on, increment, is_finite, is_success,
    largest, moved_by,
};
use super::random::Random;
use super::specimen::{INSTANT, Specimen};
use super::{Check, Found, Subject, Verdict, counted, margins};
use abi::raw;
use law::Tangent;
use law::probe::{PointEnd, PointStart};
use nalgebra::DMatrix;

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "elastic-operator-is-plausible",
        description: "The elastic operator is symmetric, has no negative stiffness, and is the \
                      consistent tangent of some very small increments, if need be in no time or \
                      in very long times (warning).",
        needs: NEEDS,
        run: elastic_operator_is_plausible,
    },
    Check {
        id: "response-is-continuous",
        description: "Along an increment the flux does not jump. Exempt are jumps to or from \
                      zero flux, with a switch of a variable of unit - by a half or more, and up \
                      to 10⁻³ of substeps within plastic flow, which are reported (warning, \
                      since more may break).",
        needs: NEEDS,
        run: response_is_continuous,
    },
    Check {
        id: "states-are-carried-on",
        description: "No internal variable is halved when an increment is divided in two, and \
                      again in four, as if not added to its initial value; counters and times \
                      are exempt (warning, since a law may keep the last increment's).",
        needs: NEEDS,
        run: states_are_carried_on,
    },
    Check {
        id: "plastic-variables-rest",
        description: "An internal variable called plastic by its id or sentence does not change \
                      in an elastic increment; laws that depend on time are exempt (warning).",
        needs: NEEDS,
        run: plastic_variables_rest,
    },
];

/// How near a tangent is to the elastic operator, relative to its largest entry.
const NEAR: f64 = 1e-4;
/// Length of very small increments, relative to those that change the flux by as much unchanged.
const SMALL: f64 = 1e-6;

/// Very small increments from the ends of steps, on the way back or anywhere.
fn small_increments(specimen: &Specimen, steps: &[Step], random: &mut Random) -> Vec<PointStart> {
    let mut points = Vec::new();
    for step in some(steps, 200) {
        let length = SMALL * flux_scale(step) / step.stiffness;
        let last = increment(&step.start);
        let size = largest(&last);
        let back: Vec<f64> = last.iter().map(|c| -c / size * length).collect();
        for by in [back, specimen.direction(length, random)] {
            let (gradient, end) = (&step.start.gradient1, &step.end);
            points.push(moved_by(gradient, &by, &end.flux, &end.state));
        }
    }
    points
}

fn elastic_operator_is_plausible(subject: &Subject) -> Found {
    let n = subject.each(Draw::DefaultChoices, "elastic", 3, |specimen, random| {
        let steps = specimen.paths(24, random)?.steps;
        let points = small_increments(specimen, &steps, random);
        let elastic = specimen.call(&points, ELASTIC)?.points;
        let consistent = specimen.call(&points, UPDATE)?.points;
        let (mut n, mut unmet) = (0, None);
        for ((point, elastic), consistent) in points.iter().zip(&elastic).zip(&consistent) {
            if !(is_success(elastic.status) && is_success(consistent.status)) {
                continue;
            }
            n += 1;
            if let Some(why) = implausible(elastic) {
                return Err(specimen.warns_at(point, why));
            }
            if !is_near(elastic, consistent) {
                unmet = unmet.or(Some((point, elastic, consistent)));
            }
        }
        let is_met = |consistent: &[PointEnd]| {
            let mut pairs = elastic.iter().zip(consistent);
            pairs.any(|(elastic, consistent)| is_near(elastic, consistent))
        };
        // What relaxes is elastic in no time, what is held up by viscosity in any.
        let in_time = || -> Result<bool, Verdict> {
            Ok(is_met(&consistent)
                || is_met(&specimen.lasting(INSTANT, &points, UPDATE)?)
                || is_met(&specimen.lasting(1.0 / INSTANT, &points, UPDATE)?))
        };
        if let Some((point, elastic, consistent)) = unmet
            && specimen.formulation.tangent == Tangent::Consistent
            && !in_time()?
        {
            let why = format!(
                "no very small increment, there or back, has the elastic operator for its tangent: \
                 {:?} and {:?}",
                elastic.tangent, consistent.tangent
            );
            return Err(specimen.warns_at(point, why));
        }
        Ok(n)
    })?;
    counted(n, "operators", "no very small increment succeeded")
}

/// Whether a tangent is the elastic operator.
fn is_near(elastic: &PointEnd, consistent: &PointEnd) -> bool {
    is_success(elastic.status)
        && is_success(consistent.status)
        && apart(&elastic.tangent, &consistent.tangent) <= NEAR * largest(&elastic.tangent)
}

/// What cannot be of an elastic operator.
fn implausible(end: &PointEnd) -> Option<String> {
    let n = end.flux.len();
    let operator = DMatrix::from_row_slice(n, n, &end.tangent);
    let bound = ROUND_OFF * largest(&end.tangent);
    if (&operator - operator.transpose()).amax() > bound {
        return Some(format!(
            "the elastic operator is not symmetric, so that a cycle gives or takes work: {:?}",
            end.tangent
        ));
    }
    let least = operator.symmetric_eigenvalues().min();
    (least < -bound).then(|| {
        format!(
            "the elastic operator has the negative stiffness {least:.6e}: {:?}",
            end.tangent
        )
    })
}

/// Pieces of an increment that are looked at first, and how often the suspicious ones are halved.
const PIECES: usize = 32;
const HALVINGS: usize = 30;
/// Pieces of each increment that are halved.
const SUSPICIOUS: usize = 2;
/// Least jump, relative to the fluxes in play.
const JUMP: f64 = 1e-7;
/// How much an internal variable without a unit changes where it switches.
const SWITCH: f64 = 0.5;
/// A jump within plastic flow as substeps make it, whose number follows from a tolerance, and how alike
/// the tangents of its sides are.
const SUBSTEPS: f64 = 1e-3;
const ALIKE: f64 = 0.05;

/// A piece of an increment, from one part of it to another.
struct Piece<'a> {
    step: &'a Step,
    ends: [(f64, PointEnd); 2],
}

/// The start of a part of an increment.
fn part(step: &Step, fraction: f64) -> PointStart {
    let mut start = step.start.clone();
    for (end, begin) in start.gradient1.iter_mut().zip(&step.start.gradient0) {
        *end = begin + fraction * (*end - begin);
    }
    start
}

impl Piece<'_> {
    /// By how much the flux at its end is off the tangent at its start: all of a jump, and little else
    /// of a short piece.
    fn off(&self) -> f64 {
        let [(from, a), (to, b)] = &self.ends;
        if !(is_success(a.status) && is_success(b.status)) {
            return 0.0;
        }
        let whole = increment(&self.step.start);
        let n = a.flux.len();
        let off = (0..n).map(|row| {
            let rise: f64 = (0..n).map(|c| a.tangent[row * n + c] * whole[c]).sum();
            (b.flux[row] - a.flux[row] - (to - from) * rise).abs()
        });
        off.fold(0.0, f64::max)
    }

    /// By how much the flux jumps in it: that much it has changed, and is off.
    fn jump(&self) -> f64 {
        let [(_, a), (_, b)] = &self.ends;
        self.off().min(apart(&a.flux, &b.flux))
    }

    /// On both sides of a small jump the law flows alike: it takes another number of substeps.
    fn is_between_substeps(&self, specimen: &Specimen) -> Result<bool, Verdict> {
        let jump = self.jump();
        if jump > SUBSTEPS * flux_scale(self.step) {
            return Ok(false);
        }
        let start = &self.step.start;
        let elastic = specimen.call(std::slice::from_ref(start), ELASTIC)?.points;
        let elastic = &elastic[0].tangent;
        let whole = increment(start);
        let n = whole.len();
        // By how much the flux has left what is elastic.
        let flowed = self.ends.iter().all(|(at, end)| {
            let off = (0..n).map(|row| {
                let rise: f64 = (0..n).map(|c| elastic[row * n + c] * whole[c]).sum();
                (end.flux[row] - start.flux0[row] - at * rise).abs()
            });
            off.fold(0.0, f64::max) > 2.0 * jump
        });
        if !flowed {
            return Ok(false);
        }
        let [a, b] = [0, 1].map(|i| &self.ends[i].1.tangent);
        let are_alike = apart(a, b) <= ALIKE * self.step.stiffness.max(largest(a));
        // Routines often have tangents by differences, which such a jump spoils.
        Ok(specimen.adapter().is_some() || are_alike)
    }

    /// The half of it that is farther off the tangent.
    fn worse_half(self, middle: (f64, PointEnd)) -> Self {
        let Self {
            step,
            ends: [start, end],
        } = self;
        let [first, second] =
            [[start, middle.clone()], [middle, end]].map(|ends| Self { step, ends });
        if first.off() > second.off() {
            first
        } else {
            second
        }
    }

    /// The warning of a jump.
    fn jumps(&self, specimen: &Specimen) -> Verdict {
        let [(at, a), (_, b)] = &self.ends;
        let start = part(self.step, 1.0);
        let why = format!(
            "the flux jumps from {:?} to {:?} at the fraction {at:.9} of an increment, \
             internal variables from {:?} to {:?}; substeps by a tolerance make jumps of its size where branches \
             meet. It goes from {}",
            a.flux,
            b.flux,
            a.state,
            b.state,
            specimen.at(&start)
        );
        specimen.warns_for(&start, why)
    }

    /// Something opens or closes in it, or an internal variable switches.
    fn switches(&self, specimen: &Specimen) -> bool {
        let [(_, a), (_, b)] = &self.ends;
        if [a, b].iter().any(|end| largest(&end.flux) == 0.0) {
            return true;
        }
        let variables = specimen.formulation.internal_variables.iter();
        let mut pairs = variables.zip(a.state.iter().zip(&b.state));
        pairs.any(|(v, (a, b))| v.unit == "-" && (a - b).abs() >= SWITCH)
    }
}

/// The pieces of increments whose flux is farthest off the tangent, halved until an end of them is left that is
/// as short as numbers can tell.
fn suspicious<'a>(specimen: &Specimen, steps: &[&'a Step]) -> Result<Vec<Piece<'a>>, Verdict> {
    let whole = |step: &&Step| {
        (0..=PIECES)
            .map(|k| part(step, k as f64 / PIECES as f64))
            .collect::<Vec<_>>()
    };
    let points: Vec<PointStart> = steps.iter().flat_map(whole).collect();
    let ends = specimen.call(&points, UPDATE)?.points;
    let mut pieces = Vec::new();
    for (step, ends) in steps.iter().copied().zip(ends.chunks(PIECES + 1)) {
        let of_step = ends.windows(2).enumerate().map(|(k, pair)| Piece {
            step,
            ends: [0, 1].map(|i| ((k + i) as f64 / PIECES as f64, pair[i].clone())),
        });
        let mut of_step: Vec<Piece<'_>> = of_step.collect();
        of_step.sort_by(|a, b| b.off().total_cmp(&a.off()));
        pieces.extend(of_step.into_iter().take(SUSPICIOUS));
    }
    for _ in 0..HALVINGS {
        let middle = |piece: &Piece<'_>| f64::midpoint(piece.ends[0].0, piece.ends[1].0);
        let points = pieces.iter().map(|piece| part(piece.step, middle(piece)));
        let ends = specimen.call(&points.collect::<Vec<_>>(), UPDATE)?.points;
        let halves = pieces.into_iter().zip(ends).map(|(piece, end)| {
            let at = middle(&piece);
            piece.worse_half((at, end))
        });
        pieces = halves.collect();
    }
    Ok(pieces)
}

fn response_is_continuous(subject: &Subject) -> Found {
    let mut rough = 0.0_f64;
    let n = subject.each(Draw::DefaultChoices, "jumps", 4, |specimen, random| {
        let steps = specimen.paths(24, random)?.steps;
        let chosen = some(&steps, 120);
        for piece in &suspicious(specimen, &chosen)? {
            let jump = piece.jump() / flux_scale(piece.step);
            if piece.switches(specimen) {
                continue;
            }
            if jump <= JUMP {
                margins::note("jump", jump / JUMP);
            } else if piece.is_between_substeps(specimen)? {
                margins::note("substeps", jump / SUBSTEPS);
                rough = rough.max(jump);
            } else {
                margins::note("jump", jump / JUMP);
                return Err(piece.jumps(specimen));
            }
        }
        Ok(chosen.len())
    })?;
    let found = counted(n, "increments", "no increment succeeded")?;
    Ok(if rough > 0.0 {
        format!("{found}, with jumps of up to {rough:.0e} of the flux within plastic flow")
    } else {
        found
    })
}

/// How near to a half a half is, and in how many increments it has to be seen.
const HALF: f64 = 0.02;
const SEEN: usize = 3;

fn states_are_carried_on(subject: &Subject) -> Found {
    let n = subject.each(Draw::DefaultChoices, "halves", 3, |specimen, random| {
        let variables = &specimen.formulation.internal_variables;
        if variables.is_empty() {
            return Ok(0);
        }
        let steps = specimen.paths(24, random)?.steps;
        let chosen = some(&steps, 120);
        let [in_two, in_four] = [2, 4].map(|parts| in_parts(specimen, &chosen, parts));
        let (in_two, in_four) = (in_two?, in_four?);
        for (k, variable) in variables.iter().enumerate() {
            let is_duration = ["s", "h", "d"].contains(&variable.unit.as_str());
            if counts(specimen, &steps, k) || is_duration {
                continue;
            }
            // Halved, and changed otherwise.
            let (mut halved, mut other) = (Vec::new(), 0);
            for ((step, two), four) in chosen.iter().zip(&in_two).zip(&in_four) {
                let (Some(two), Some(four)) = (two, four) else {
                    continue;
                };
                let (once, before) = (step.end.state[k], step.start.state0[k]);
                let is_half = |part: f64, whole: f64| (part / whole - 0.5).abs() <= HALF;
                if (once - before).abs() <= ITERATED * once.abs() {
                    continue;
                }
                if is_half(two[k], once) && is_half(four[k], two[k]) {
                    halved.push((step, once, two[k], four[k]));
                } else {
                    other += 1;
                }
            }
            if let Some((step, once, two, four)) = halved.first()
                && halved.len() >= SEEN.max(other / 4)
            {
                let why = format!(
                    "`{}` is {once:e} after an increment, {two:e} if it is done in two, {four:e} in \
                     four: is it added to its value at the start? At {}",
                    variable.id,
                    specimen.at(&step.start)
                );
                return Err(specimen.warns_for(&step.start, why));
            }
        }
        Ok(chosen.len())
    })?;
    counted(n, "increments", "no law has internal variables")
}

/// Names that mark an internal variable as plastic; it does not change in elasticity.
const PLASTIC: [&str; 9] = [
    "slip",
    "opening",
    "jump",
    "strain",
    "strains",
    "shear",
    "volume",
    "dilation",
    "multiplier",
];

/// Whether an internal variable is plastic by its id, or by its sentence, and nothing next to it.
fn is_called_plastic(id: &str, doc: &str) -> bool {
    let doc = doc.to_lowercase();
    let words: Vec<&str> = doc
        .split(|c: char| !c.is_alphanumeric())
        .filter(|word| !word.is_empty())
        .collect();
    let mut pairs = words.windows(2);
    let is_so = pairs.any(|pair| pair[0] == "plastic" && PLASTIC.contains(&pair[1]));
    let is_more = words.iter().any(|word| ["elastic", "total"].contains(word));
    id.to_lowercase().starts_with("plastic") || is_so && !is_more
}

fn plastic_variables_rest(subject: &Subject) -> Found {
    let n = subject.each(Draw::DefaultChoices, "plastic variables", 3, |specimen, random| {
        let variables = specimen.formulation.internal_variables.iter().enumerate();
        let plastic: Vec<(usize, &str)> = variables
            .filter(|(_, v)| is_called_plastic(&v.id, &v.doc))
            .map(|(k, v)| (k, v.id.as_str()))
            .collect();
        if plastic.is_empty() {
            return Ok(0);
        }
        let steps = specimen.paths(24, random)?.steps;
        if specimen.depends_on_time(&steps)? {
            return Ok(0);
        }
        let elastic = specimen.call(&starts(&steps), ELASTIC)?.points;
        let mut n = 0;
        for (step, elastic) in steps.iter().zip(&elastic) {
            let size = largest(&increment(&step.start));
            let off = beyond_elastic(step, elastic);
            let is_elastic = largest(&off) <= ROUND_OFF * flux_scale(step)
                && is_near(elastic, &step.end)
                && size * largest(&elastic.tangent) > NEAR * flux_scale(step);
            if !is_elastic {
                continue;
            }
            n += 1;
            for &(k, id) in &plastic {
                let (before, after) = (step.start.state0[k], step.end.state[k]);
                if (after - before).abs() > 1e-6 * size {
                    let why = format!(
                        "`{id}` goes from {before:e} to {after:e} in an increment that is elastic"
                    );
                    return Err(specimen.warns_at(&step.start, why));
                }
            }
        }
        Ok(n)
    })?;
    let none = "no internal variable is called plastic where increments are elastic";
    counted(n, "elastic increments", none)
}

/// Internal variables after increments that are done in this many parts; nothing where the law does not
/// follow.
fn in_parts(
    specimen: &Specimen,
    steps: &[&Step],
    parts: usize,
) -> Result<Vec<Option<Vec<f64>>>, Verdict> {
    let mut points: Vec<PointStart> = steps.iter().map(|step| step.start.clone()).collect();
    let mut goes_on = vec![true; steps.len()];
    for k in 1..=parts {
        for (point, step) in points.iter_mut().zip(steps) {
            point.gradient1 = part(step, k as f64 / parts as f64).gradient1;
        }
        // Each takes its part of the time too, so that rates are what they were.
        let ends = specimen.lasting(1.0 / parts as f64, &points, raw::PILUM_REQ_FLUX)?;
        for ((point, end), goes_on) in points.iter_mut().zip(ends).zip(&mut goes_on) {
            if !(is_success(end.status) && is_finite(&end)) {
                *goes_on = false;
            }
            if *goes_on {
                carry_on(point, end);
            }
        }
    }
    let ends = points.into_iter().zip(goes_on);
    Ok(ends
        .map(|(point, goes_on)| goes_on.then_some(point.state0))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::is_called_plastic;

    #[test]
    fn what_is_called_plastic_is_nothing_beside() {
        for (id, doc, is_so) in [
            ("plastic_slip", "Slip beyond friction.", true),
            ("Plastic_strain", "", true),
            ("multiplier", "accumulated plastic multiplier", true),
            ("slip", "Sum of elastic and plastic slip.", false),
            ("slip", "Total plastic slip and what is recovered.", false),
            ("void_ratio", "Void ratio at the plastic limit.", false),
            ("travel", "Sum of all movements.", false),
        ] {
            assert_eq!(is_called_plastic(id, doc), is_so, "{id}: {doc}");
        }
    }
}
