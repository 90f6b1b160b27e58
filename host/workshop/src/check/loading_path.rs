//! Points on their way: along random straight pieces, there and back as in a laboratory, or as the
//! author's own driver leads them.

use super::points::{ELASTIC, UPDATE, at_rest, increment, is_finite, is_success, largest, sum};
use super::random::Random;
use super::specimen::Specimen;
use super::{Verdict, refusal, skipped};
use abi::raw;
use law::probe::{NO_OUTCOME, PointEnd, PointStart};
use nalgebra::{DMatrix, DVector};

/// Points that walk side by side at random.
const WALKERS: usize = 16;
/// Increments in one direction.
const STRAIGHT: usize = 6;
/// Points that are led there and back, and increments of their way; where tangents do not matter, too.
const LED: (usize, usize) = (8, 90);
const LED_FOR_POINTS: (usize, usize) = (4, 45);
/// By how much each increment of a leg is longer than the one before.
const GROWTH: f64 = 1.5;
/// How far an interface slides or opens (m), and a solid is strained, whatever their stiffness.
const FAR_JUMP: f64 = 0.1;
const FAR_STRAIN: f64 = 0.2;
/// Movement of components that neither lead nor hold a flux, relative to the leading one.
const DRIFT: f64 = 1e-3;
/// Largest flux or internal variable that means something, in any unit.
const LARGEST: f64 = 1e30;
/// How near held fluxes are kept, relative to the largest; they need not be met.
const HELD: f64 = 1e-3;

/// Starts of steps.
pub(super) fn starts(steps: &[Step]) -> Vec<PointStart> {
    steps.iter().map(|step| step.start.clone()).collect()
}

/// At most this many steps, evenly.
pub(super) fn some(steps: &[Step], most: usize) -> Vec<&Step> {
    let every = steps.len().div_ceil(most).max(1);
    steps.iter().step_by(every).collect()
}

/// Fluxes in play in a step.
pub(super) fn flux_scale(step: &Step) -> f64 {
    let moved = step.stiffness * largest(&increment(&step.start));
    largest(&step.end.flux)
        .max(largest(&step.start.flux0))
        .max(moved)
}

/// One increment of a point that ended well.
#[derive(Clone, Debug)]
pub(super) struct Step {
    pub(super) start: PointStart,
    pub(super) end: PointEnd,
    /// Largest entry of the elastic operator at the start of the path.
    pub(super) stiffness: f64,
}

/// An increment of a point that did not end well, and what was said of it or of another one next to it.
#[derive(Clone, Debug)]
pub(super) struct Refused {
    pub(super) status: raw::Status,
    pub(super) text: String,
    pub(super) start: PointStart,
}

/// Steps of a path, and the outcomes that ended parts of it.
#[derive(Debug, Default)]
pub(super) struct Walk {
    pub(super) steps: Vec<Step>,
    pub(super) refusals: Vec<Refused>,
    /// Starts of the points that are reported to have succeeded, finite or not.
    pub(super) successes: Vec<PointStart>,
    /// The first increment whose results are finite and larger than any that mean something.
    pub(super) blown_up: Option<Step>,
}

impl Walk {
    /// Why a part of the path ended first; empty if none did.
    pub(super) fn why(&self) -> String {
        let first = self.refusals.first();
        first.map_or(String::new(), |first| {
            refusal(first.status, Some(&first.text))
        })
    }
}

/// A point before anything has happened.
#[derive(Clone, Debug)]
pub(super) struct Origin {
    pub(super) start: PointStart,
    /// Largest entry of its elastic operator.
    pub(super) stiffness: f64,
    /// The gradient that would double its flux elastically.
    pub(super) size: f64,
}

/// A point that is led there and back.
#[derive(Debug)]
struct Led {
    point: PointStart,
    stiffness: f64,
    size: f64,
    /// The prescribed component, those that keep their flux, and the others.
    driven: usize,
    held: Vec<usize>,
    rest: Vec<usize>,
    goals: Vec<f64>,
    /// What the held ones moved by in the last increment, relative to the driven one.
    ratios: Vec<f64>,
    /// Small motion of the others: without any motion a law has a choice.
    drift: Vec<f64>,
    /// Length of the next increment, with its sign; what is left of this leg.
    increment: f64,
    left: f64,
    /// The farthest from the beginning.
    reach: f64,
    is_first_of_leg: bool,
}

impl Specimen {
    /// Internal variables of a point with this flux; in words why the law cannot start there. A defect that it reports
    /// of itself, as after a panic in an earlier call, is no such reason.
    pub(super) fn initial_state(&self, flux: &[f64]) -> Result<Result<Vec<f64>, String>, Verdict> {
        let answer = self.probe.init_state(&[flux.to_vec()], &self.form(0))?;
        Ok(match answer {
            None => {
                let variables = self.formulation.internal_variables.iter();
                Ok(variables.map(|v| v.initial_value).collect())
            }
            Some(answer) => {
                let why = refusal(answer.status, answer.text().as_deref());
                if answer.status == raw::PILUM_E_INTERNAL {
                    return Err(self.fails_as_defective(format!("`init_state` gave {why}")));
                }
                let state = answer.points.into_iter().next().map(|point| point.state);
                state
                    .filter(|_| answer.status == raw::PILUM_OK)
                    .ok_or_else(|| format!("`init_state` gave {why}"))
            }
        })
    }

    /// Normal components come first.
    pub(super) fn n_normal(&self) -> usize {
        if self.hypothesis.is_interface() { 1 } else { 3 }
    }

    /// The same pressure on all normal components; tension if it is negative.
    pub(super) fn under_pressure(&self, pressure: f64) -> Vec<f64> {
        let n_normal = self.n_normal();
        let components = 0..self.probe.n_components();
        components
            .map(|c| if c < n_normal { -pressure } else { 0.0 })
            .collect()
    }

    /// A point with this flux before anything has happened; in words why the law cannot start there.
    pub(super) fn started(&self, flux: &[f64]) -> Result<Result<Origin, String>, Verdict> {
        let state0 = match self.initial_state(flux)? {
            Ok(state0) => state0,
            Err(refused) => return Ok(Err(refused)),
        };
        let pressure = largest(flux);
        let start = at_rest(&vec![0.0; flux.len()], flux, &state0);
        let answer = self.call(std::slice::from_ref(&start), ELASTIC)?;
        let stiffness = largest(&answer.points[0].tangent);
        let status = answer.points[0].status;
        Ok(
            if is_success(status) && stiffness > 0.0 && stiffness.is_finite() {
                Ok(Origin {
                    start,
                    stiffness,
                    size: pressure.max(10.0) / stiffness,
                })
            } else if is_success(status) {
                Err(format!(
                    "the largest entry of the elastic operator is {stiffness}"
                ))
            } else {
                // Where a call is refused as a whole, no outcomes are written.
                let status = if status == NO_OUTCOME {
                    answer.status
                } else {
                    status
                };
                let why = refusal(status, answer.text().as_deref());
                if status == raw::PILUM_E_INTERNAL {
                    return Err(self.fails_as_defective(why));
                }
                Err(why)
            },
        )
    }

    /// A compressed or unstressed point before anything has happened; that of the author's path, if
    /// there is one.
    pub(super) fn origin(&self, random: &mut Random) -> Result<Origin, Verdict> {
        let mut why = None;
        for attempt in 0..20 {
            let flux = if let Some(first) = self.course.iter().flatten().next() {
                first.flux0.clone()
            } else if attempt % 4 == 3 {
                self.under_pressure(0.0)
            } else {
                self.under_pressure(random.logarithmic(1.0, 1000.0))
            };
            match self.started(&flux)? {
                Ok(origin) => return Ok(origin),
                // The first reason, since a law that has panicked says no more why.
                Err(refused) => why = why.or(Some(refused)),
            }
        }
        // A law of other signs starts where this one is pulled.
        let hint = match self.started(&self.under_pressure(-100.0))? {
            Ok(_) => "; a tension of 100 kPa is: compression is negative here",
            Err(_) => "",
        };
        Err(skipped(format!(
            "{}: no initial stress was accepted: {}{hint}",
            self.name(),
            why.unwrap_or_default()
        )))
    }

    /// A direction of random components, those that may move, of this length.
    pub(super) fn direction(&self, length: f64, random: &mut Random) -> Vec<f64> {
        let mut direction = vec![0.0; self.probe.n_components()];
        for c in self.free() {
            direction[c] = length * random.between(-1.0, 1.0);
        }
        direction
    }

    /// The author's path, if there is one; else points along random straight pieces. With tangents.
    pub(super) fn walk(&self, n_increments: usize, random: &mut Random) -> Result<Walk, Verdict> {
        if let Some(course) = &self.course {
            return self.along(course);
        }
        let mut walk = Walk::default();
        let n_walkers = if self.is_led_near { 1 } else { WALKERS };
        let mut walkers = (0..n_walkers)
            .map(|_| self.origin(random))
            .collect::<Result<Vec<_>, _>>()?;
        let mut moves = vec![Vec::new(); n_walkers];
        for increment in 0..n_increments {
            if increment % STRAIGHT == 0 {
                for (one, walker) in moves.iter_mut().zip(&walkers) {
                    let length = walker.size * random.logarithmic(0.03, 10.0);
                    *one = self.direction(length, random);
                }
            }
            for (walker, step) in walkers.iter_mut().zip(&moves) {
                walker.start.gradient1 = sum(&walker.start.gradient0, step);
            }
            let starts: Vec<PointStart> = walkers.iter().map(|w| w.start.clone()).collect();
            let answer = self.call(&starts, UPDATE)?;
            let text = answer.text().unwrap_or_default();
            for (walker, end) in walkers.iter_mut().zip(answer.points) {
                if walk.take(&mut walker.start, walker.stiffness, end, &text) {
                    continue;
                }
                *walker = self.origin(random)?;
            }
        }
        Ok(walk)
    }

    /// The author's path, if there is one; else a walk, and points that are led there and back, far
    /// into what the law does.
    pub(super) fn paths(&self, n_increments: usize, random: &mut Random) -> Result<Walk, Verdict> {
        let mut walk = self.walk(n_increments, random)?;
        if self.course.is_none() && !self.is_led_near {
            self.lead(&mut walk, LED, random)?;
        }
        Ok(walk)
    }

    /// The steps of a path that is given.
    fn along(&self, course: &[PointStart]) -> Result<Walk, Verdict> {
        let mut walk = Walk::default();
        let elastic = self.call(course, ELASTIC)?;
        let answer = self.call(course, UPDATE)?;
        let text = answer.text().unwrap_or_default();
        for ((start, end), elastic) in course.iter().zip(answer.points).zip(elastic.points) {
            walk.take(&mut start.clone(), largest(&elastic.tangent), end, &text);
        }
        Ok(walk)
    }

    /// Leads points there and back. One component advances in increments that grow from a part of
    /// the elastic limit until the law has slid or strained a long way. The others keep their flux,
    /// as in a shear box or a triaxial cell. The path goes beyond some slip, whatever the stiffness,
    /// and each way back begins with small increments to include unloading.
    fn lead(
        &self,
        walk: &mut Walk,
        (n_points, n_increments): (usize, usize),
        random: &mut Random,
    ) -> Result<(), Verdict> {
        let mut all = (0..n_points)
            .map(|_| self.led(random))
            .collect::<Result<Vec<_>, _>>()?;
        for _ in 0..n_increments {
            self.hold(&mut all)?;
            let starts: Vec<PointStart> = all.iter().map(|led| led.point.clone()).collect();
            let answer = self.call(&starts, UPDATE)?;
            let text = answer.text().unwrap_or_default();
            for (led, end) in all.iter_mut().zip(answer.points) {
                let before = led.point.clone();
                if walk.take(&mut led.point, led.stiffness, end, &text) {
                    led.went(&before, random);
                } else if led.is_first_of_leg {
                    *led = self.led(random)?;
                } else {
                    // What the law does not follow is the end of the leg.
                    led.point.gradient1.clone_from(&led.point.gradient0);
                    led.turn(random);
                }
            }
        }
        Ok(())
    }

    /// A point at the beginning of its way.
    fn led(&self, random: &mut Random) -> Result<Led, Verdict> {
        let Origin {
            start,
            stiffness,
            size,
        } = self.origin(random)?;
        let n_normal = self.n_normal();
        let free: Vec<usize> = self.free().collect();
        let is_interface = n_normal == 1;
        let driven = if is_interface {
            usize::from(!random.once_in(4))
        } else {
            free[random.below(free.len())]
        };
        let holds = !random.once_in(4) && (driven > 0 || !is_interface);
        let others = free.into_iter().filter(|c| *c != driven);
        let (held, rest): (Vec<_>, Vec<_>) = others.partition(|&c| holds && c < n_normal);
        let far = if is_interface { FAR_JUMP } else { FAR_STRAIN };
        let opens = is_interface && driven == 0;
        let reach = if held.is_empty() && !opens {
            30.0 * size
        } else {
            far.min(1e8 * size).max(1e3 * size)
        };
        let sign = if opens || random.once_in(2) {
            1.0
        } else {
            -1.0
        };
        let mut led = Led {
            drift: vec![0.0; start.flux0.len()],
            rest,
            goals: held.iter().map(|&c| start.flux0[c]).collect(),
            ratios: vec![0.0; held.len()],
            held,
            point: start,
            stiffness,
            size,
            driven,
            increment: -sign,
            left: 0.0,
            reach,
            is_first_of_leg: true,
        };
        led.turn(random);
        Ok(led)
    }

    /// Chooses the ends of increments such that held fluxes stay about the same.
    fn hold(&self, all: &mut [Led]) -> Result<(), Verdict> {
        for led in all.iter_mut() {
            led.point.gradient1.clone_from(&led.point.gradient0);
            led.point.gradient1[led.driven] += led.increment;
            for &c in &led.rest {
                led.point.gradient1[c] += led.drift[c] * led.increment;
            }
            for (&c, ratio) in led.held.iter().zip(&led.ratios) {
                led.point.gradient1[c] += ratio * led.increment;
            }
        }
        for _ in 0..4 {
            let mut points = Vec::new();
            for led in all.iter() {
                points.push(led.point.clone());
                for &c in &led.held {
                    let mut moved = led.point.clone();
                    moved.gradient1[c] += led.aside();
                    points.push(moved);
                }
            }
            let ends = self.call(&points, raw::PILUM_REQ_FLUX)?.points;
            let mut rest = ends.as_slice();
            let mut is_done = true;
            for led in all.iter_mut() {
                let (own, others) = rest.split_at(1 + led.held.len());
                rest = others;
                is_done &= led.correct(own);
            }
            if is_done {
                break;
            }
        }
        Ok(())
    }

    /// Puts increments in the place of every fourth in which one component does not move at all, as it does
    /// in random ones: what a law keeps of the call before counts there.
    fn still_in_one(&self, starts: &mut [PointStart], random: &mut Random) -> Result<(), Verdict> {
        let free: Vec<usize> = self.free().collect();
        let every_fourth: Vec<usize> = (0..starts.len()).skip(3).step_by(4).collect();
        let changed: Vec<PointStart> = every_fourth
            .iter()
            .map(|&i| {
                let mut start = starts[i].clone();
                let size = largest(&increment(&start));
                let still = free[random.below(free.len())];
                for &c in &free {
                    let by = if c == still {
                        0.0
                    } else {
                        size * random.between(-1.0, 1.0)
                    };
                    start.gradient1[c] = start.gradient0[c] + by;
                }
                start
            })
            .collect();
        let ends = self.call(&changed, raw::PILUM_REQ_FLUX)?.points;
        for ((i, start), end) in every_fourth.into_iter().zip(changed).zip(&ends) {
            if is_success(end.status) {
                starts[i] = start;
            }
        }
        Ok(())
    }

    /// Starts of steps that succeed, at most this many: the last of a walk, farthest from its beginning,
    /// and as many of points that are led there and back.
    pub(super) fn points(&self, n: usize, random: &mut Random) -> Result<Vec<PointStart>, Verdict> {
        let walk = self.walk(n.div_ceil(WALKERS) + STRAIGHT, random)?;
        let why = walk.why();
        let mut starts = walk.successes;
        starts.reverse();
        if self.course.is_none() && !self.is_led_near {
            let mut led = Walk::default();
            self.lead(&mut led, LED_FOR_POINTS, random)?;
            let far: Vec<PointStart> = (0..(n / 2).min(led.successes.len()))
                .map(|_| led.successes[random.below(led.successes.len())].clone())
                .collect();
            starts.truncate(n - far.len());
            starts.extend(far);
            self.still_in_one(&mut starts, random)?;
        }
        starts.truncate(n);
        if starts.is_empty() {
            return Err(skipped(format!(
                "{}: no increment succeeded: {why}",
                self.name()
            )));
        }
        Ok(starts)
    }
}

impl Walk {
    /// Notes what became of an increment, and carries the point on. `false`: it has to begin again.
    fn take(&mut self, point: &mut PointStart, stiffness: f64, end: PointEnd, text: &str) -> bool {
        let success = is_success(end.status);
        let is_sound = success && is_finite(&end);
        if is_sound && end.flux.iter().chain(&end.state).any(|v| v.abs() > LARGEST) {
            self.blown_up.get_or_insert_with(|| Step {
                start: point.clone(),
                end,
                stiffness,
            });
            return false;
        }
        if success {
            self.successes.push(point.clone());
        } else {
            self.refusals.push(Refused {
                status: end.status,
                text: text.to_owned(),
                start: point.clone(),
            });
        }
        if is_sound {
            let next = at_rest(&point.gradient1, &end.flux, &end.state);
            let start = std::mem::replace(point, next);
            self.steps.push(Step {
                start,
                end,
                stiffness,
            });
        }
        is_sound
    }
}

impl Led {
    /// Begins a leg the other way. One whose flux is not held, and an interface that closes, go no
    /// farther back than a little beyond the beginning.
    fn turn(&mut self, random: &mut Random) {
        let sign = -self.increment.signum();
        let gone = self.point.gradient0[self.driven] * -sign;
        let small = self.size * random.logarithmic(0.3, 3.0);
        let is_far = random.once_in(2);
        self.left = if gone <= 0.0 || is_far {
            let leg = random.logarithmic(3.0 * self.size, self.reach);
            let closes = self.held.is_empty() && sign < 0.0 && self.reach > 30.0 * self.size;
            if closes { gone.max(0.0) + small } else { leg }
        } else {
            // Unloading within the elastic range, and beyond.
            small
        };
        self.increment = sign * self.size * random.logarithmic(0.03, 0.3);
        self.ratios.fill(0.0);
        for drift in &mut self.drift {
            *drift = DRIFT * random.between(-1.0, 1.0);
        }
        self.is_first_of_leg = true;
    }

    /// Goes on after an increment that ended well.
    fn went(&mut self, before: &PointStart, random: &mut Random) {
        let moved = self.increment;
        for (ratio, &c) in self.ratios.iter_mut().zip(&self.held) {
            *ratio = (before.gradient1[c] - before.gradient0[c]) / moved;
        }
        self.left -= moved.abs();
        self.is_first_of_leg = false;
        if self.left <= 0.0 {
            self.turn(random);
        } else {
            self.increment = moved.signum() * (GROWTH * moved.abs()).min(self.left);
        }
    }

    /// How far a held component is moved to see what its flux does.
    fn aside(&self) -> f64 {
        1e-4 * self.increment.abs() + 1e-6 * self.size
    }

    /// Moves held components towards their fluxes, by what the point and the points aside have come
    /// to. Whether they are there, or cannot come nearer.
    fn correct(&mut self, ends: &[PointEnd]) -> bool {
        let n = self.held.len();
        if n == 0 || !ends.iter().all(|end| is_success(end.status)) {
            return true;
        }
        let off = DVector::from_fn(n, |i, _| self.goals[i] - ends[0].flux[self.held[i]]);
        let scale = self.stiffness * self.size;
        if !(off.amax() > HELD * scale && off.amax().is_finite()) {
            return true;
        }
        let slopes = DMatrix::from_fn(n, n, |i, j| {
            (ends[1 + j].flux[self.held[i]] - ends[0].flux[self.held[i]]) / self.aside()
        });
        let Some(by) = slopes.lu().solve(&off) else {
            return true;
        };
        let most = 10.0 * (self.increment.abs() + self.size);
        if by.amax().is_nan() || by.amax() > most {
            return true;
        }
        for (i, &c) in self.held.iter().enumerate() {
            self.point.gradient1[c] += by[i];
        }
        false
    }
}
