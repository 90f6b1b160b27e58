//! The resistance of a pile by its load–settlement curve.

use super::{Loads, Pile};
use crate::summary;
use serde::{Deserialize, Serialize};

/// Offset of Davisson's line: a length, m, and a share of the diameter.
const OFFSET: [f64; 2] = [0.0038, 1.0 / 120.0];
/// Chin's line is drawn through the points from this share of the largest settlement on, and has to
/// explain this share of their scatter.
const LAST: f64 = 0.5;
const EXPLAINED: f64 = 0.98;
const FEWEST: usize = 4;

/// The course of the pile's loads in a phase.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct OfPhase {
    phase: String,
    /// Settlements are counted from its start.
    resets: bool,
    /// The pile is in place: its interfaces are active and its law is that of the pile.
    is_in_place: bool,
    /// E A of the head's section, kN.
    stiffness: Option<f64>,
    weight: f64,
    /// Settlement, head, shaft and base load.
    points: Vec<[f64; 4]>,
}

/// Course of a pile's loads through all phases.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Curve(Vec<OfPhase>);

/// A resistance, or why none exists.
type Found = Result<f64, String>;

/// The resistances of a pile, loads of its head in kN.
#[derive(Clone, Debug, PartialEq)]
pub struct Resistances {
    /// The phase whose curve it is.
    pub phase: Option<String>,
    /// Unit of the loads.
    pub unit: &'static str,
    /// Diameter, m.
    pub diameter: f64,
    /// At a settlement of 10 % of the diameter: head, shaft, base.
    pub ten_percent: Result<[f64; 3], String>,
    /// By Davisson's offset line.
    pub davisson: Found,
    /// By Chin's inverse slope.
    pub chin: Found,
    /// Settlement, head, shaft and base load where the phase starts.
    start: Option<[f64; 4]>,
    /// Weight of the pile, kN.
    weight: Option<f64>,
}

/// The last phase in which the head moves down.
struct Push<'c> {
    phase: &'c OfPhase,
    /// The state that it starts from.
    start: [f64; 4],
    /// The curve to its end, from where settlements are counted.
    points: Vec<[f64; 4]>,
}

impl Curve {
    /// Whether the next increment is the first of its phase.
    pub(crate) fn begins(&self, phase: &str) -> bool {
        self.0.last().is_none_or(|last| last.phase != phase)
    }

    pub(crate) fn phase(
        &mut self,
        phase: &str,
        [resets, is_in_place]: [bool; 2],
        stiffness: Option<f64>,
    ) {
        self.0.push(OfPhase {
            phase: phase.to_owned(),
            resets,
            is_in_place,
            stiffness,
            ..OfPhase::default()
        });
    }

    pub(crate) fn add(&mut self, loads: &Loads) {
        if let Some(last) = self.0.last_mut() {
            let [head, shaft, base, settlement] = loads.values();
            last.weight = loads.weight;
            last.points.push([settlement, head, shaft, base]);
        }
    }

    /// The last phase in which the head moves down, if there is one.
    fn last_push(&self) -> Option<Push<'_>> {
        let before = |number: usize| -> Option<[f64; 4]> {
            let last = self.0[..number]
                .iter()
                .rev()
                .find_map(|phase| phase.points.last());
            last.copied()
        };
        let start = |number: usize| {
            if self.0[number].resets {
                0.0
            } else {
                before(number).map_or(0.0, |point| point[0])
            }
        };
        let moves = |number: &usize| {
            let OfPhase {
                points,
                is_in_place,
                ..
            } = &self.0[*number];
            *is_in_place && points.last().is_some_and(|end| end[0] > start(*number))
        };
        let number = (0..self.0.len()).rev().find(moves)?;
        let first = (0..=number).rev().find(|&n| self.0[n].resets).unwrap_or(0);
        let mut points =
            vec![before(first).map_or([0.0; 4], |[_, head, shaft, base]| [0.0, head, shaft, base])];
        points.extend(
            self.0[first..=number]
                .iter()
                .flat_map(|phase| &phase.points),
        );
        let own = if first == number {
            points[0]
        } else {
            before(number).unwrap_or(points[0])
        };
        Some(Push {
            phase: &self.0[number],
            start: own,
            points,
        })
    }

    /// How far the last phase pulls the head up, and with which force, if it does.
    fn uplift(&self, unit: &str) -> Option<String> {
        let (last, before) = self.0.split_last()?;
        let start = before.iter().rev().find_map(|phase| phase.points.last());
        let start = start.filter(|_| !last.resets).map_or(0.0, |point| point[0]);
        let end = last.points.last()?[0];
        let force = last
            .points
            .iter()
            .map(|point| -point[1])
            .fold(0.0, f64::max);
        (end < start && force > 0.0).then(|| {
            format!(
                "phase `{}` pulls the head up by {:.4} m, with at most {force:.1} {unit}",
                last.phase,
                start - end
            )
        })
    }

    /// Resistances of a pile with this course.
    pub fn resistances(&self, pile: &Pile) -> Resistances {
        self.of(
            [pile.length(), pile.diameter()],
            pile.geometry.analysis.force_unit(),
        )
    }

    fn of(&self, [length, diameter]: [f64; 2], unit: &'static str) -> Resistances {
        let Some(Push {
            phase,
            start,
            points,
        }) = self.last_push()
        else {
            let why = self.uplift(unit).unwrap_or_else(|| {
                "the head moves down in no phase with the pile in place".to_owned()
            });
            return Resistances {
                phase: None,
                unit,
                diameter,
                ten_percent: Err(why.clone()),
                davisson: Err(why.clone()),
                chin: Err(why),
                start: None,
                weight: self.0.last().map(|last| last.weight),
            };
        };
        Resistances {
            phase: Some(phase.phase.clone()),
            unit,
            diameter,
            ten_percent: ten_percent(&points, diameter).map_err(|why| match self.uplift(unit) {
                Some(uplift) => format!("{why}; {uplift}"),
                None => why,
            }),
            davisson: phase
                .stiffness
                .ok_or_else(|| "the law of the pile's head has no elastic operator".to_owned())
                .and_then(|stiffness| davisson(&points, length / stiffness, diameter)),
            chin: chin(&points),
            start: Some(start),
            weight: Some(phase.weight),
        }
    }
}

impl Resistances {
    /// As in `summary.json`.
    pub(crate) fn summary(&self) -> summary::Resistances {
        let reason = |found: &Found| found.as_ref().err().cloned();
        let load = |found: &Found| found.as_ref().ok().copied();
        let [head, shaft, base] = match self.ten_percent {
            Ok(split) => split.map(Some),
            Err(_) => [None; 3],
        };
        summary::Resistances {
            base_at_10_percent_diameter: base,
            diameter: Some(self.diameter),
            phase: self.phase.clone(),
            resistance_10_percent_diameter: head,
            resistance_10_percent_diameter_reason: self.ten_percent.as_ref().err().cloned(),
            resistance_chin: load(&self.chin),
            resistance_chin_reason: reason(&self.chin),
            resistance_davisson: load(&self.davisson),
            resistance_davisson_reason: reason(&self.davisson),
            shaft_at_10_percent_diameter: shaft,
            start: self.start,
            unit: self.unit.to_owned(),
            weight: self.weight,
        }
    }
}

/// First zero of a curve, between two of its points: values there.
fn crossing(points: &[[f64; 4]], left: impl Fn(&[f64; 4]) -> f64) -> Option<[f64; 4]> {
    let pair = points
        .windows(2)
        .find(|pair| left(&pair[0]) > 0.0 && left(&pair[1]) <= 0.0)?;
    let (a, b) = (left(&pair[0]), left(&pair[1]));
    let t = a / (a - b);
    Some(std::array::from_fn(|i| {
        pair[0][i] + t * (pair[1][i] - pair[0][i])
    }))
}

fn largest(points: &[[f64; 4]]) -> f64 {
    points.iter().map(|point| point[0]).fold(0.0, f64::max)
}

fn ten_percent(points: &[[f64; 4]], diameter: f64) -> Result<[f64; 3], String> {
    let goal = 0.1 * diameter;
    // A settlement that was asked for as such may end a last bit before.
    let reached = goal * (1.0 - 1e-9);
    crossing(points, |[s, ..]| reached - s)
        .map(|[_, head, shaft, base]| [head, shaft, base])
        .ok_or_else(|| {
            format!(
                "the head settles by {:.6} m at most, 10 % of the diameter are {goal:.6} m",
                largest(points)
            )
        })
}

/// `compliance`: shortening of the pile as a bar under a unit load, m/kN.
fn davisson(points: &[[f64; 4]], compliance: f64, diameter: f64) -> Found {
    let start = points[0][1];
    let offset = OFFSET[0] + OFFSET[1] * diameter;
    crossing(points, |[s, head, ..]| {
        (head - start) * compliance + offset - s
    })
    .map(|point| point[1])
    .ok_or_else(|| {
        format!(
            "the curve ends at {:.6} m, before the line that is offset by {offset:.6} m",
            largest(points)
        )
    })
}

fn chin(points: &[[f64; 4]]) -> Found {
    let most = largest(points);
    // Unloading and reloading are no part of the line.
    let mut deepest = 0.0;
    let first = points.iter().filter(|[s, ..]| {
        let is_first = *s > deepest;
        deepest = f64::max(deepest, *s);
        is_first
    });
    let last = first.filter(|[s, head, ..]| *s >= LAST * most && *head > 0.0);
    let line: Vec<[f64; 2]> = last.map(|[s, head, ..]| [*s, s / head]).collect();
    let n = line.len();
    if n < FEWEST {
        return Err(format!(
            "{n} points from half of the largest settlement on, and a line takes {FEWEST}"
        ));
    }
    let mean = |c: usize| line.iter().map(|point| point[c]).sum::<f64>() / n as f64;
    let [x, y] = [mean(0), mean(1)];
    let sum = |f: fn(f64, f64) -> f64| line.iter().map(|p| f(p[0] - x, p[1] - y)).sum::<f64>();
    let (xx, xy, yy) = (sum(|x, _| x * x), sum(|x, y| x * y), sum(|_, y| y * y));
    if xx <= 0.0 || yy <= 0.0 || xy <= 0.0 || xy * xy < EXPLAINED * xx * yy {
        return Err(
            "s/Q over s is no rising line from half of the largest settlement on".to_owned(),
        );
    }
    // So nearly level a line is that of a load that rises in proportion, and its slope is round-off.
    if xy / xx * most < 1e-6 * y {
        return Err("the load rises in proportion to the settlement".to_owned());
    }
    Ok(xx / xy)
}

/// Young's modulus in the vertical direction of an elastic operator (components 11 22 33 12), kPa.
pub(super) fn modulus(operator: &[f64]) -> Option<f64> {
    // D ε = (0, 1, 0, 0) by elimination with pivots.
    let mut rows: Vec<Vec<f64>> = operator.chunks_exact(4).map(<[f64]>::to_vec).collect();
    for (i, row) in rows.iter_mut().enumerate() {
        row.push(if i == 1 { 1.0 } else { 0.0 });
    }
    for column in 0..4 {
        let pivot =
            (column..4).max_by(|&a, &b| rows[a][column].abs().total_cmp(&rows[b][column].abs()))?;
        rows.swap(column, pivot);
        let lead = rows[column].clone();
        if lead[column] == 0.0 {
            return None;
        }
        for (number, row) in rows.iter_mut().enumerate() {
            if number != column {
                let factor = row[column] / lead[column];
                row.iter_mut()
                    .zip(&lead)
                    .for_each(|(value, lead)| *value -= factor * lead);
            }
        }
    }
    let strain = rows[1][4] / rows[1][1];
    (strain > 0.0).then(|| 1.0 / strain)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chin's own curve: Q = s/(a + b s), whose limit is 1/b, at n settlements up to this many m.
    fn hyperbola(n: u32, most: f64, [a, b]: [f64; 2]) -> Vec<[f64; 4]> {
        let at = |i: u32| {
            let s = most * f64::from(i) / f64::from(n);
            [s, s / (a + b * s), 0.0, 0.0]
        };
        (0..=n).map(at).collect()
    }

    #[test]
    fn chin_finds_the_limit_of_a_hyperbola_at_any_settlement() {
        for most in [0.01, 0.1, 2.0] {
            let found = chin(&hyperbola(20, most, [2e-6, 4e-4])).unwrap_or(f64::NAN);
            assert!((found / 2500.0 - 1.0).abs() < 1e-11, "{most}: {found}");
        }
    }

    #[test]
    fn chin_looks_at_the_second_half_of_the_settlement() {
        // The first half is that of a stiffer pile.
        let mut points = hyperbola(20, 0.1, [2e-6, 4e-4]);
        for point in &mut points[1..10] {
            point[1] *= 1.5;
        }
        let found = chin(&points).unwrap_or(f64::NAN);
        assert!((found / 2500.0 - 1.0).abs() < 1e-11, "{found}");
    }

    #[test]
    fn chin_says_why_there_is_no_limit() {
        let few = chin(&hyperbola(5, 0.1, [2e-6, 4e-4])).unwrap_err();
        assert!(few.starts_with("3 points"), "{few}");
        // An elastic pile.
        let straight = chin(&hyperbola(20, 0.1, [2e-6, 0.0])).unwrap_err();
        assert!(
            straight.contains("line") || straight.contains("proportion"),
            "{straight}"
        );
        // A load that grows faster than the settlement: s/Q falls.
        let stiffening = chin(&hyperbola(20, 0.1, [2e-6, -1e-6])).unwrap_err();
        assert!(stiffening.contains("no rising line"), "{stiffening}");
    }
}
