//! Peaks of a course that no row of the results shows.

use crate::problem::{Phase, Problem};

/// So many increments more are tried.
const MORE: usize = 1000;
/// A time so close to the end of an increment, in increments, is that end.
const CLOSE: f64 = 1e-6;

/// Warnings of courses that turn between the ends of increments.
pub(super) fn warnings(problem: &Problem) -> Vec<String> {
    problem.phases.iter().filter_map(of_phase).collect()
}

fn of_phase(phase: &Phase) -> Option<String> {
    let (name, course, n) = (&phase.name, &phase.course, phase.increments);
    let times: Vec<String> = missed(course, n).iter().map(ToString::to_string).collect();
    let (last, others) = times.split_last()?;
    let and = if others.is_empty() { "" } else { " and " };
    let advice = (n + 1..=n + MORE)
        .find(|&n| missed(course, n).is_empty())
        .map_or_else(String::new, |n| format!("; `increments = {n}` meets all"));
    Some(format!(
        "phase `{name}`: `course` turns at {}{and}{last} of its time, between the ends of its {n} increments: no row of the \
         results has what is reached there{advice}",
        others.join(", ")
    ))
}

/// Times at which a course turns, with no end of `n` increments while it stays there.
fn missed(course: &[[f64; 2]], n: usize) -> Vec<f64> {
    let mut missed = Vec::new();
    let mut first = 1;
    while first + 1 < course.len() {
        let [begins, factor] = course[first];
        let stays = course[first..]
            .iter()
            .take_while(|point| point[1].to_bits() == factor.to_bits());
        let last = first + stays.count() - 1;
        let ends = course[last][0];
        if let Some(next) = course.get(last + 1) {
            let turns = (factor - course[first - 1][1]) * (next[1] - factor) < 0.0;
            let is_seen = (ends * n as f64 + CLOSE).floor() >= begins * n as f64 - CLOSE;
            if turns && !is_seen {
                missed.push(begins);
            }
        }
        first = last + 1;
    }
    missed
}
