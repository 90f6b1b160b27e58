//! The resistance of a pile by its load–settlement curve.

use super::cycles::ROUND_OFF;
use super::{Loads, Pile, State};
use crate::summary;
use serde::{Deserialize, Serialize};

/// Offset of Davisson's line: a length, m, and a share of the diameter.
const OFFSET: [f64; 2] = [0.0038, 1.0 / 120.0];
/// Chin's line is drawn through the points from this share of the largest settlement on, and has to
/// explain this share of their scatter.
const LAST: f64 = 0.5;
const EXPLAINED: f64 = 0.98;
const FEWEST: usize = 4;
/// Elastic slip of joints above this share of the settlement changes the result.
const SLIP: f64 = 0.1;
/// Forces out of balance are reported from this share of the pile's largest load on.
const OUT_OF_BALANCE: f64 = 1e-3;
/// A load that rises by less than this share of its largest value is held.
const HELD: f64 = 0.01;

/// The course of the pile's loads in a phase; loads are net ones.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct OfPhase {
    pub(crate) phase: String,
    /// Settlements are counted from its start.
    pub(crate) resets: bool,
    /// The pile is in place: its interfaces are active and its law is that of the pile.
    pub(crate) is_in_place: bool,
    /// The phase prescribes the settlement of the head.
    moves_head: bool,
    /// E A of the head's section, kN.
    stiffness: Option<f64>,
    weight: f64,
    /// Settlement, and gross loads of head, shaft and base, before its first increment.
    gross_start: Option<[f64; 4]>,
    /// Settlement, head, shaft and base load before its first increment.
    start: [f64; 4],
    /// After each increment.
    pub(crate) points: Vec<[f64; 4]>,
    /// Elastic slip of the shaft's joints after each increment, m.
    slips: Vec<Option<f64>>,
}

impl OfPhase {
    pub(crate) fn start(&self) -> [f64; 4] {
        self.start
    }

    /// The curve from its start, in a direction of the head (1 down, −1 up).
    fn curve(&self, direction: f64) -> Vec<[f64; 4]> {
        let points = std::iter::once(&self.start).chain(&self.points);
        points.map(|point| point.map(|v| direction * v)).collect()
    }

    /// Why a curve of it is no load test: the head moves although no load on it rises, as with ground that settles.
    fn no_test(&self, curve: &[[f64; 4]], direction: f64) -> Option<String> {
        let loads = || curve.iter().map(|point| point[1]);
        let most = loads().fold(0.0, |m: f64, load| m.max(load.abs()));
        let highest = loads().fold(f64::NEG_INFINITY, f64::max);
        let is_test = self.moves_head || highest > curve[0][1] + HELD * most;
        (!is_test).then(|| {
            if direction < 0.0 {
                return "no phase pulls the head up".to_owned();
            }
            format!(
                "the head moves by {:.6} m in phase `{}` under a load that does not rise: no load test",
                largest(curve) - curve[0][0],
                self.phase
            )
        })
    }
}

/// Course of a pile's loads through all phases.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    phases: Vec<OfPhase>,
    /// The gross loads after the last increment.
    last: Option<[f64; 4]>,
}

/// A resistance, or why none exists.
type Found = Result<Criterion, String>;

/// A resistance by a criterion: forces of its direction, kN, net.
#[derive(Clone, Debug, PartialEq)]
pub struct Criterion {
    /// The last phase that reaches it.
    pub phase: String,
    /// Load of the head, kN.
    pub head: f64,
    /// Share of the shaft, kN.
    pub shaft: f64,
    /// Share of the base, kN.
    pub base: f64,
}

/// The resistances of a pile, net loads of its head in kN.
#[derive(Clone, Debug, PartialEq)]
pub struct Resistances {
    /// The last load test that pushes the head down.
    pub phase: Option<String>,
    /// Unit of the loads.
    pub unit: &'static str,
    /// Diameter, m.
    pub diameter: f64,
    /// At a settlement of 10 % of the diameter.
    pub ten_percent: Found,
    /// By Davisson's offset line.
    pub davisson: Found,
    /// By Chin's inverse slope.
    pub chin: Result<f64, String>,
    /// At a heave of 10 % of the diameter.
    pub uplift_ten_percent: Found,
    /// By Davisson's offset line.
    pub uplift_davisson: Found,
    /// Settlement, and gross loads of head, shaft and base, where the phase starts.
    start: Option<[f64; 4]>,
    /// Weight of the pile, kN.
    weight: Option<f64>,
}

/// A pile as criteria see it.
#[derive(Clone, Copy, Debug)]
struct Measures {
    length: f64,
    diameter: f64,
    unit: &'static str,
}

impl Curve {
    /// Whether the next increment is the first of its phase.
    pub(crate) fn begins(&self, phase: &str) -> bool {
        self.phases.last().is_none_or(|last| last.phase != phase)
    }

    pub(crate) fn phases(&self) -> impl Iterator<Item = &OfPhase> + Clone {
        self.phases.iter()
    }

    /// Settlement, and gross loads of head, shaft and base, after the last increment.
    pub(super) fn last(&self) -> Option<[f64; 4]> {
        self.last
    }

    pub(crate) fn phase(
        &mut self,
        phase: &str,
        [resets, is_in_place, moves_head]: [bool; 3],
        stiffness: Option<f64>,
    ) {
        let before = self.phases.last();
        let before = before.map(|last| last.points.last().copied().unwrap_or(last.start));
        let start = before.filter(|_| !resets).unwrap_or_default();
        let mut gross_start = self.last;
        if let Some([settlement, ..]) = gross_start.as_mut().filter(|_| resets) {
            *settlement = 0.0;
        }
        self.phases.push(OfPhase {
            phase: phase.to_owned(),
            resets,
            is_in_place,
            moves_head,
            stiffness,
            gross_start,
            start,
            ..OfPhase::default()
        });
    }

    pub(crate) fn add(&mut self, state: &State, elastic_slip: Option<f64>) {
        let Loads {
            settlement, weight, ..
        } = state.loads;
        let of = |[head, shaft, base]: [f64; 3]| [settlement, head, shaft, base];
        self.last = Some(of(state.loads.of_parts()));
        if let Some(phase) = self.phases.last_mut() {
            phase.weight = weight;
            if let Some(net) = state.net {
                phase.points.push(of(net));
                phase.slips.push(elastic_slip);
            }
        }
    }

    /// The phases with the pile in place, the last first.
    fn in_place(&self) -> impl Iterator<Item = &OfPhase> {
        self.phases.iter().rev().filter(|phase| phase.is_in_place)
    }

    /// The last load test in which the head goes lower than it began.
    fn last_push(&self) -> Option<&OfPhase> {
        let moves = |phase: &&OfPhase| {
            let curve = phase.curve(1.0);
            let most = curve
                .iter()
                .fold(0.0, |m: f64, point| m.max(point[0].abs()));
            largest(&curve) > curve[0][0] + ROUND_OFF * most && phase.no_test(&curve, 1.0).is_none()
        };
        self.in_place().find(moves)
    }

    /// The curve from the last reset to the end of a phase.
    fn since_reset(&self, of: &OfPhase) -> Vec<[f64; 4]> {
        let end = self.phases.iter().position(|phase| phase == of);
        let until = &self.phases[..=end.unwrap_or(0)];
        let first = until.iter().rposition(|phase| phase.resets).unwrap_or(0);
        let points = until[first..].iter().flat_map(|phase| &phase.points);
        std::iter::once(&until[first].start)
            .chain(points)
            .copied()
            .collect()
    }

    /// The last load test whose curve in a direction reaches a criterion: `find` gives its load there, or what is missing.
    /// The reason is that of the phase which moves the head farthest.
    fn last_to_reach(
        &self,
        direction: f64,
        find: impl Fn(&OfPhase, &[[f64; 4]]) -> Result<[f64; 4], String>,
    ) -> Found {
        let mut farthest: Option<(f64, String)> = None;
        for phase in self.in_place() {
            let curve = phase.curve(direction);
            let most = largest(&curve);
            if most <= curve[0][0] {
                continue;
            }
            let found = phase
                .no_test(&curve, direction)
                .map_or_else(|| find(phase, &curve), Err);
            match found {
                Ok([_, head, shaft, base]) => {
                    return Ok(Criterion {
                        phase: phase.phase.clone(),
                        head,
                        shaft,
                        base,
                    });
                }
                Err(why) if farthest.as_ref().is_none_or(|(other, _)| most > *other) => {
                    farthest = Some((most, why));
                }
                Err(_) => {}
            }
        }
        let way = if direction > 0.0 { "down" } else { "up" };
        Err(farthest.map_or_else(
            || format!("the head moves {way} in no phase with the pile in place"),
            |(_, why)| why,
        ))
    }

    /// How far the last phase pulls the head up, and with which force, if it does.
    fn uplift(&self, unit: &str) -> Option<String> {
        let last = self.phases.last()?;
        let end = last.points.last()?[0];
        let force = last.points.iter().map(|point| -point[1]);
        let force = force.fold(0.0, f64::max);
        let start = last.start[0];
        let forces = last.points.iter().flat_map(|point| &point[1..]);
        let most = forces.fold(0.0, |m: f64, force| m.max(force.abs()));
        (end < start && force > ROUND_OFF * most).then(|| {
            format!(
                "phase `{}` pulls the head up by {:.4} m, with at most {force:.1} {unit}",
                last.phase,
                start - end
            )
        })
    }

    /// A warning if elastic slip of the shaft's joints is a notable part of the settlement at half of the largest load,
    /// in the last phase where the head moves away from where it was and the load on it changes.
    pub(super) fn soft_shaft(&self) -> Option<String> {
        let loads = self.in_place().flat_map(|phase| &phase.points);
        let most = loads.fold(0.0, |m: f64, p| {
            p[1..].iter().fold(m, |m, load| m.max(load.abs()))
        });
        let phase = self.in_place().find(|phase| {
            let loads = phase.points.iter().map(|point| point[1] - phase.start[1]);
            let away = phase.points.iter().map(|point| point[0] - phase.start[0]);
            away.fold(0.0, |m: f64, v| m.max(v.abs())) > 0.0
                && loads.fold(0.0, |m: f64, v| m.max(v.abs())) > HELD * most
                && phase.slips.iter().any(Option::is_some)
        })?;
        let largest = phase.points.iter().fold(0.0, |m: f64, p| m.max(p[1].abs()));
        let at = phase
            .points
            .iter()
            .position(|point| point[1].abs() >= 0.5 * largest)?;
        let ([settlement, load, ..], slip) = (phase.points[at], phase.slips[at]?);
        let share = slip.abs() / settlement.abs();
        (share > SLIP && settlement != 0.0).then(|| {
            format!(
                "[pile]: in phase `{}` elastic slip of the shaft's joints is {:.2} mm of {:.2} mm, {:.0} % of the settlement at \
                 a head load of {:.1}: raise the `shear_stiffness` of their laws, until this is less than {:.0} %",
                phase.phase,
                1e3 * slip.abs(),
                1e3 * settlement.abs(),
                100.0 * share,
                load,
                100.0 * SLIP
            )
        })
    }

    /// The largest force that a step left out of balance, as a share of the pile's largest load, in words; `residual` gives
    /// that of a phase. `None` if it is very small.
    pub(super) fn out_of_balance(
        &self,
        residual: impl Fn(&str) -> Option<f64>,
        unit: &str,
    ) -> Option<String> {
        let residuals = self
            .in_place()
            .filter_map(|phase| Some((phase, residual(&phase.phase)?)));
        let (phase, residual) = residuals.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let loads = self.in_place().flat_map(|phase| &phase.points);
        let loads = loads.flat_map(|point| &point[1..]);
        let largest = loads.fold(0.0, |m: f64, load| m.max(load.abs()));
        let share = residual / largest;
        (largest > 0.0 && share > OUT_OF_BALANCE).then(|| {
            format!(
                "pile: steps leave up to {residual:.2} {unit} out of balance (phase `{}`), {:.1} % of its largest load, \
                 {largest:.1} {unit}; `force_tolerance` limits it",
                phase.phase,
                100.0 * share,
            )
        })
    }

    /// Resistances of a pile with this course.
    pub fn resistances(&self, pile: &Pile) -> Resistances {
        self.of(Measures {
            length: pile.length(),
            diameter: pile.diameter(),
            unit: pile.geometry.analysis.force_unit(),
        })
    }

    fn of(&self, pile: Measures) -> Resistances {
        let Measures {
            length,
            diameter,
            unit,
        } = pile;
        let at_ten_percent = |direction: f64| {
            self.last_to_reach(direction, |_, curve| {
                ten_percent(curve, diameter, direction)
            })
        };
        let by_davisson = |direction: f64| {
            self.last_to_reach(direction, |phase, curve| {
                let stiffness = phase
                    .stiffness
                    .ok_or("the law of the pile's head has no elastic operator")?;
                let origin = direction * self.since_reset(phase)[0][1];
                davisson(curve, origin, length / stiffness, diameter)
            })
        };
        let with_uplift = |why: String| match self.uplift(unit) {
            Some(uplift) => format!("{why}; {uplift}"),
            None => why,
        };
        let push = self.last_push();
        Resistances {
            phase: push.map(|phase| phase.phase.clone()),
            unit,
            diameter,
            ten_percent: at_ten_percent(1.0).map_err(with_uplift),
            davisson: by_davisson(1.0),
            chin: push
                .ok_or_else(|| "no phase with the pile in place pushes the head down".to_owned())
                .and_then(|phase| chin(&self.since_reset(phase))),
            uplift_ten_percent: at_ten_percent(-1.0),
            uplift_davisson: by_davisson(-1.0),
            start: push.map(|phase| phase.gross_start.unwrap_or(phase.start)),
            weight: push.or(self.phases.last()).map(|phase| phase.weight),
        }
    }
}

impl Resistances {
    /// As in `summary.json`.
    pub(crate) fn summary(&self) -> summary::Resistances {
        let of = |found: &Found| summary::Criterion {
            load: found.as_ref().ok().map(|of| of.head),
            shaft: found.as_ref().ok().map(|of| of.shaft),
            base: found.as_ref().ok().map(|of| of.base),
            phase: found.as_ref().ok().map(|of| of.phase.clone()),
            reason: found.as_ref().err().cloned(),
        };
        let [ten_percent, davisson] = [&self.ten_percent, &self.davisson].map(of);
        let [uplift_ten_percent, uplift_davisson] =
            [&self.uplift_ten_percent, &self.uplift_davisson].map(of);
        summary::Resistances {
            base_at_10_percent_diameter: ten_percent.base,
            diameter: Some(self.diameter),
            phase: self.phase.clone(),
            resistance_10_percent_diameter: ten_percent.load,
            resistance_10_percent_diameter_base: ten_percent.base,
            resistance_10_percent_diameter_phase: ten_percent.phase,
            resistance_10_percent_diameter_reason: ten_percent.reason,
            resistance_10_percent_diameter_shaft: ten_percent.shaft,
            resistance_chin: self.chin.as_ref().ok().copied(),
            resistance_chin_reason: self.chin.as_ref().err().cloned(),
            resistance_davisson: davisson.load,
            resistance_davisson_base: davisson.base,
            resistance_davisson_phase: davisson.phase,
            resistance_davisson_reason: davisson.reason,
            resistance_davisson_shaft: davisson.shaft,
            shaft_at_10_percent_diameter: ten_percent.shaft,
            start: self.start,
            unit: self.unit.to_owned(),
            uplift_10_percent_diameter: uplift_ten_percent.load,
            uplift_10_percent_diameter_phase: uplift_ten_percent.phase,
            uplift_10_percent_diameter_reason: uplift_ten_percent.reason,
            uplift_davisson: uplift_davisson.load,
            uplift_davisson_phase: uplift_davisson.phase,
            uplift_davisson_reason: uplift_davisson.reason,
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

fn ten_percent(points: &[[f64; 4]], diameter: f64, direction: f64) -> Result<[f64; 4], String> {
    let goal = 0.1 * diameter;
    // A settlement that was asked for as such may end a last bit before.
    let reached = goal * (1.0 - 1e-9);
    crossing(points, |[s, ..]| reached - s).ok_or_else(|| {
        let moves = if direction > 0.0 { "settles" } else { "rises" };
        format!(
            "the head {moves} by {:.6} m at most, 10 % of the diameter are {goal:.6} m",
            largest(points)
        )
    })
}

/// `origin`: load where settlements are counted from; `compliance`: shortening of the pile as a bar under a unit load,
/// m/kN.
fn davisson(
    points: &[[f64; 4]],
    origin: f64,
    compliance: f64,
    diameter: f64,
) -> Result<[f64; 4], String> {
    let offset = OFFSET[0] + OFFSET[1] * diameter;
    crossing(points, |[s, head, ..]| {
        (head - origin) * compliance + offset - s
    })
    .ok_or_else(|| {
        format!(
            "the curve ends at {:.6} m, before the line that is offset by {offset:.6} m",
            largest(points)
        )
    })
}

fn chin(points: &[[f64; 4]]) -> Result<f64, String> {
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
            "only {n} point{} from half of the largest settlement on; {FEWEST} are needed",
            if n == 1 { "" } else { "s" }
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
        assert!(few.starts_with("only 3 points"), "{few}");
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
