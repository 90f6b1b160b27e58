//! Rows of `pile.csv`: the ends and middles of the shaft's elements, from the head down.

use super::geometry::{Facet, SAME};
use mechanics::Problem;
use mechanics::mesh::Mesh;
use std::collections::BTreeSet;

/// The shaft between two heights next to each other at which an element of it ends.
#[derive(Debug)]
pub(super) struct Span {
    /// Upper and lower end, m.
    pub(super) z: [f64; 2],
    /// Numbers of the elements there, on all sides of the pile; none where the pile has no shaft.
    pub(super) facets: Vec<usize>,
    /// Their area between the two ends, m².
    pub(super) area: f64,
    /// Its laws are those of the shaft above it, in every phase.
    pub(super) goes_on: bool,
}

/// A row.
#[derive(Debug)]
pub(super) struct Row {
    pub(super) z: f64,
    /// The spans that it belongs to, by number, and where in them: the top (0), the middle (1), the bottom (2).
    pub(super) at: Vec<(usize, usize)>,
    /// The pile's nodes whose settlement it has.
    pub(super) nodes: Vec<usize>,
}

impl Span {
    /// From the head down.
    pub(super) fn all([top, bottom]: [f64; 2], shaft: &[Facet], problem: &Problem) -> Vec<Self> {
        let close = SAME * (top - bottom);
        let mut heights = vec![top];
        let mut between: Vec<f64> = shaft.iter().flat_map(|facet| facet.z).collect();
        between.sort_unstable_by(|a, b| b.total_cmp(a));
        for z in between {
            let last = heights.last().copied().unwrap_or(top);
            if z < last - close && z > bottom + close {
                heights.push(z);
            }
        }
        heights.push(bottom);
        let mut above = BTreeSet::new();
        let span = |ends: &[f64]| {
            let [high, low] = [ends[0], ends[1]];
            let is_there = |facet: &&Facet| {
                facet.z[1] - facet.z[0] > close
                    && facet.z[0] <= low + close
                    && facet.z[1] >= high - close
            };
            let there = || shaft.iter().filter(is_there);
            let area = |facet: &Facet| facet.area * (high - low) / (facet.z[1] - facet.z[0]);
            let laws: BTreeSet<Vec<&str>> =
                there().map(|facet| laws(problem, facet.group)).collect();
            let goes_on = laws == above;
            above = laws;
            Self {
                z: [high, low],
                facets: there().map(|facet| facet.number).collect(),
                area: there().map(area).sum(),
                goes_on,
            }
        };
        heights.windows(2).map(span).collect()
    }

    /// Whether the pile has no shaft there.
    pub(super) fn is_gap(&self) -> bool {
        self.facets.is_empty()
    }
}

/// The laws of a group in the course of the phases.
fn laws(problem: &Problem, group: usize) -> Vec<&str> {
    let swapped = problem.phases.iter().flat_map(|phase| &phase.materials);
    let swapped = swapped.filter(|(of, _)| *of == group);
    let first = std::iter::once(&problem.groups[group].material);
    first
        .chain(swapped.map(|(_, law)| law))
        .map(|law| law.name.as_str())
        .collect()
}

/// The rows of a pile with these spans, and with these nodes at its head and base.
pub(super) fn rows(
    mesh: &Mesh,
    spans: &[Span],
    shaft: &[Facet],
    [head, base]: [&Vec<usize>; 2],
) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    for (number, span) in spans.iter().enumerate() {
        let is_joined = number > 0 && (span.goes_on || span.is_gap() || spans[number - 1].is_gap());
        let [high, low] = span.z;
        let parts = [(high, 0), (f64::midpoint(high, low), 1), (low, 2)];
        for (z, part) in parts {
            if let Some(last) = rows.last_mut().filter(|_| part == 0 && is_joined) {
                last.at.push((number, part));
            } else if part != 1 || !span.is_gap() {
                rows.push(Row {
                    z,
                    at: vec![(number, part)],
                    nodes: Vec::new(),
                });
            }
        }
    }
    let close = SAME * (spans[0].z[0] - spans[spans.len() - 1].z[1]);
    let of_shaft = || shaft.iter().flat_map(|facet| facet.nodes);
    let last = rows.len() - 1;
    for (number, row) in rows.iter_mut().enumerate() {
        if number == 0 {
            row.nodes.clone_from(head);
        } else if number == last {
            row.nodes.clone_from(base);
        } else {
            let near = |within: f64| -> Vec<usize> {
                let is_near = |node: &usize| (mesh.nodes[*node][1] - row.z).abs() <= within;
                let nodes: BTreeSet<usize> = of_shaft().filter(is_near).collect();
                nodes.into_iter().collect()
            };
            row.nodes = near(close);
            if row.nodes.is_empty() {
                // The middle of a curved side, or of the elements of one side of a pile alone.
                let nearest = of_shaft().map(|node| (mesh.nodes[node][1] - row.z).abs());
                row.nodes = near(nearest.fold(f64::INFINITY, f64::min));
            }
        }
    }
    rows
}
