//! The message about a pile that finds no further equilibrium.

use super::{Base, Curve, Pile};
use mechanics::equilibrium::Mechanism;
use mechanics::group::FailureMode;
use mechanics::problem::Phase;
use mechanics::{NoEquilibrium, Problem, Simulation};

/// A force above this multiple of the load carried was probably typed in another unit.
const MANY: f64 = 20.0;
/// A part of the pile that takes less than this share of the pile's first stiffness gives way.
const LOST: f64 = 0.05;
/// A base that takes less than this share of the head's load bears nothing.
const BEARS: f64 = 0.01;
const SLIDES: &str = "the shaft slides";

impl Pile {
    /// At which net load of the head a phase of forces found no further equilibrium, what gives way and what to do, in
    /// one sentence. `None` unless the pile is in place and the phase changes a force on its head along a straight ramp.
    pub(super) fn plunge(
        &self,
        simulation: &Simulation,
        none: &NoEquilibrium,
        curve: &Curve,
    ) -> Option<String> {
        let problem = simulation.problem();
        let mut names = problem.phases.iter().map(|phase| &phase.name);
        let number = names.position(|name| *name == none.place.phase)?;
        if self.not_in_place(problem, number).is_some() {
            return None;
        }
        let phase = &problem.phases[number];
        let end = self
            .force_on_head(phase)
            .filter(|_| phase.course.is_empty())?;
        let start = self.force_before(problem, number);
        let carried = start + none.reached / none.of as f64 * (end - start);
        let at_reset = self.force_before(problem, self.counted_from(problem, number));
        let unit = self.geometry.analysis.force_unit();
        let (way, sign) = if end < start {
            ("plunges at a head load", -1.0)
        } else if end > 0.0 {
            ("is pulled out at an uplift", 1.0)
        } else {
            ("has no equilibrium below a head load", -1.0)
        };
        let [carried_net, end_net] = [carried, end].map(|force| sign * (force - at_reset));
        let advice = if (carried - start).abs() < 0.05 * (end - start).abs()
            && end.abs() > MANY * carried.abs()
        {
            format!("forces are in {unit}: was it typed in N?")
        } else {
            "prescribe a `displacement` of the head, or end the phase with `until`".to_owned()
        };
        Some(format!(
            "pile: {way} of {carried_net:.1} {unit} (net), where phase `{}` asks for {end_net:.1}{}; {advice}",
            phase.name,
            self.mechanism(simulation, none, (sign < 0.0).then_some(curve))
        ))
    }

    /// Whether shaft and base of a pile that is pushed have lost their stiffness, by its curve up to the last equilibrium.
    fn lost(&self, simulation: &Simulation, phase: &str, curve: &Curve) -> [bool; 2] {
        let of_phase = curve.phases().find(|of| of.phase == phase);
        let (Some(of_phase), Some(last)) = (of_phase, curve.last()) else {
            return [false; 2];
        };
        let mut points = vec![of_phase.start()];
        points.extend(&of_phase.points);
        let mut steps: Vec<[f64; 4]> = points
            .windows(2)
            .map(|pair| step(pair[0], pair[1]))
            .collect();
        if let Some(state) = self.state(&simulation.snapshot()) {
            let [head, shaft, base] = state.loads.of_parts();
            steps.push(step(last, [state.loads.settlement, head, shaft, base]));
        }
        steps.retain(|step| step[0] > 0.0);
        let [first, .., last] = steps[..] else {
            return [false; 2];
        };
        let is_lost = |part: usize| last[part] / last[0] < LOST * first[1] / first[0];
        let bears = points.iter().any(|point| point[3] > BEARS * point[1].abs());
        [is_lost(2), is_lost(3) && bears]
    }

    /// The vertical force that a phase puts on the head, if it does.
    pub(super) fn force_on_head(&self, phase: &Phase) -> Option<f64> {
        let forces = phase.force.iter();
        let mut own = forces.filter(|force| force.line == self.parts.head);
        own.find_map(|force| force.y)
    }

    /// The one there is at the start of a phase.
    fn force_before(&self, problem: &Problem, number: usize) -> f64 {
        let mut before = problem.phases[..number].iter().rev();
        before
            .find_map(|phase| self.force_on_head(phase))
            .unwrap_or(0.0)
    }

    /// The phase at whose start net loads are zero: the last one up to a phase that resets displacements, else the one
    /// that activates the shaft.
    fn counted_from(&self, problem: &Problem, number: usize) -> usize {
        let phases = &problem.phases[..=number];
        let resets = phases.iter().rposition(|phase| phase.reset_displacements);
        let is_shaft = |group: &usize| self.parts.shaft.contains(group);
        let begins = || {
            phases
                .iter()
                .position(|phase| phase.activate.iter().any(is_shaft))
        };
        resets.or_else(begins).unwrap_or(0)
    }

    /// What of the pile gives way in the last attempt at a step, in words after a colon. `pushed`: its curve, if it is
    /// pushed.
    fn mechanism(
        &self,
        simulation: &Simulation,
        none: &NoEquilibrium,
        pushed: Option<&Curve>,
    ) -> String {
        let [shaft_lost, base_lost] = pushed.map_or([false; 2], |curve| {
            self.lost(simulation, &none.place.phase, curve)
        });
        let (groups, time) = (simulation.groups(), simulation.time());
        let worst = none.failure.mechanism.as_ref();
        let is_at =
            |number: usize| worst.is_some_and(|worst| groups[number].name == worst.at.group);
        let gives = |number: usize| {
            let points = 0..groups[number].kinematics.n_points();
            points.filter_map(move |point| groups[number].gives(point, time))
        };
        let shaft = &self.parts.shaft;
        let modes: Vec<FailureMode> = shaft.iter().flat_map(|&number| gives(number)).collect();
        let points = shaft
            .iter()
            .map(|&number| groups[number].kinematics.n_points());
        let worst_of_shaft = worst.filter(|_| shaft.iter().any(|&number| is_at(number)));
        let of_shaft = if shaft_lost {
            Some(SLIDES)
        } else {
            of_shaft(&modes, points.sum(), worst_of_shaft)
        };
        let mut said = Vec::from_iter(of_shaft);
        let bears =
            |mode: FailureMode| !matches!(mode, FailureMode::Opens | FailureMode::BondBreaks);
        let is_below = match &self.parts.base {
            Base::Group(group) if is_at(*group) => worst.is_some_and(|worst| bears(worst.how)),
            Base::Group(group) => gives(*group).any(|mode| mode == FailureMode::Crushes),
            Base::Line(_) => false,
        };
        let in_ground =
            |worst: &Mechanism| matches!(worst.how, FailureMode::Yields | FailureMode::ComesApart);
        if base_lost || is_below || worst.is_some_and(in_ground) {
            let part = if pushed.is_some() {
                "the base yields"
            } else {
                "the ground yields"
            };
            said.push(part);
        }
        if said.is_empty() {
            return worst.map_or_else(String::new, |worst| format!(": {}", worst.how));
        }
        format!(": {}", said.join(" and "))
    }
}

/// Whether the shaft slides or yields, from the failure modes of its points and from the worst mechanism if that is in
/// the shaft.
fn of_shaft(
    modes: &[FailureMode],
    n_points: usize,
    worst: Option<&Mechanism>,
) -> Option<&'static str> {
    let most_give = 2 * modes.len() > n_points;
    let slide = modes.iter().filter(|mode| **mode == FailureMode::Slides);
    let opens = match worst.map(|worst| worst.how) {
        Some(how) if !most_give => matches!(how, FailureMode::Opens | FailureMode::BondBreaks),
        _ => 2 * slide.count() < modes.len(),
    };
    (most_give || worst.is_some()).then_some(if opens { "the shaft opens" } else { SLIDES })
}

/// The change from one point of a curve to another.
fn step(from: [f64; 4], to: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|i| to[i] - from[i])
}
