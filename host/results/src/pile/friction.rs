//! What holds along the shaft: friction, normal stress and slip at the rows of `pile.csv`.
//!
//! An interface of some stiffness lets its tractions swing from node to node about their mean. So the values at the
//! ends of elements are read from the means of the two elements beside them, and the one in the middle follows
//! from the element's own mean: by Simpson's rule the three give it back, which is the element's force over its area.
//! Where a value would leave the range of the tractions in its element, as at the edge of a part that slides, the
//! tractions at the ends are taken as they are.

use super::geometry::{Facet, Geometry};
use super::rows::Span;
use super::split::{Pressed, Split};
use super::{beside, pressure_beside};
use mechanics::simulation::Snapshot;

/// Friction (kPa, positive where it holds the pile up), effective normal stress (kPa, compression positive) and slip
/// (m, positive where the pile went down).
pub(super) type Skin = [f64; 3];

/// The shaft between two heights: means over all sides of the pile by area.
#[derive(Clone, Copy, Debug, Default)]
struct Average {
    height: f64,
    mean: Skin,
    /// As the interface has them nearest to the upper and lower end.
    ends: [Skin; 2],
    /// Smallest and largest friction at its points.
    range: [f64; 2],
}

/// Values at the top, in the middle and at the bottom of each span; `None` where no shaft is.
pub(super) fn along(
    snapshot: &Snapshot<'_>,
    geometry: &Geometry,
    split: &Split<'_>,
) -> Vec<Option<[Skin; 3]>> {
    let spans = &geometry.spans;
    let mut found = vec![None; spans.len()];
    let mut first = 0;
    while first < spans.len() {
        let mut end = first + 1;
        while end < spans.len() && spans[end].goes_on {
            end += 1;
        }
        if !spans[first].is_gap() {
            let own = spans[first..end].iter();
            let averages: Vec<Average> = own
                .map(|span| average(snapshot, geometry, span, split))
                .collect();
            for (found, values) in found[first..end].iter_mut().zip(smooth(&averages)) {
                *found = Some(values);
            }
        }
        first = end;
    }
    found
}

fn average(
    snapshot: &Snapshot<'_>,
    geometry: &Geometry,
    span: &Span,
    split: &Split<'_>,
) -> Average {
    let mut all = Average {
        height: span.z[0] - span.z[1],
        ..Average::default()
    };
    let mut girths = 0.0;
    for &number in &span.facets {
        let facet = &geometry.shaft[number];
        let own = of_facet(snapshot, facet, split.segments[number], span.z);
        let girth = facet.area / (facet.z[1] - facet.z[0]);
        girths += girth;
        let add = |to: &mut f64, value: f64| *to += girth * value;
        for i in 0..3 {
            add(&mut all.mean[i], own.mean[i]);
            add(&mut all.ends[0][i], own.ends[0][i]);
            add(&mut all.ends[1][i], own.ends[1][i]);
        }
        add(&mut all.range[0], own.range[0]);
        add(&mut all.range[1], own.range[1]);
    }
    let sums = [&mut all.mean].into_iter().chain(&mut all.ends);
    for value in sums.flatten().chain(&mut all.range) {
        *value /= girths;
    }
    all
}

/// An element of the shaft between two heights. `pressed`: the force that it takes of the pile.
fn of_facet(
    snapshot: &Snapshot<'_>,
    facet: &Facet,
    pressed: Pressed,
    heights: [f64; 2],
) -> Average {
    let group = &snapshot.groups[facet.group];
    let kinematics = &group.kinematics;
    let points = kinematics.points_of(facet.element);
    // What equilibrium leaves of the pile's nodes to the element.
    let left = (pressed.force - pressed.own) / facet.area;
    let at = |point: usize| -> Skin {
        if !group.is_active {
            let [normal, _] = beside(snapshot, facet, point);
            let pore = pressure_beside(snapshot, facet, kinematics.position(point));
            return [pressed.force / facet.area, -normal - pore, 0.0];
        }
        let (jump, traction) = group.jump_and_traction(point).unwrap_or_default();
        [facet.sign * traction[1], -traction[0], facet.sign * jump[1]]
    };
    let values: Vec<Skin> = points.clone().map(at).collect();
    let weights: Vec<f64> = points
        .clone()
        .map(|point| kinematics.weight(point))
        .collect();
    let whole: f64 = weights.iter().sum();
    let mean = |i: usize| {
        let weighted = weights.iter().zip(&values);
        weighted
            .map(|(weight, value)| weight * value[i])
            .sum::<f64>()
            / whole
    };
    let mut mean: Skin = std::array::from_fn(mean);
    if group.is_active {
        mean[0] += left;
    }
    let close = 1e-9 * (facet.z[1] - facet.z[0]);
    let nearest = |z: f64| -> Skin {
        let off = |point: usize| (kinematics.position(point)[1] - z).abs();
        let least = points.clone().map(off).fold(f64::INFINITY, f64::min);
        let there: Vec<&Skin> = points
            .clone()
            .zip(&values)
            .filter(|(point, _)| off(*point) <= least + close)
            .map(|(_, value)| value)
            .collect();
        std::array::from_fn(|i| {
            there.iter().map(|value| value[i]).sum::<f64>() / there.len() as f64
        })
    };
    let friction = values.iter().map(|value| value[0]);
    Average {
        height: heights[0] - heights[1],
        mean,
        ends: heights.map(nearest),
        range: friction.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
            [low.min(value), high.max(value)]
        }),
    }
}

/// The end of a span between two others, or of the last: how far it is from the tractions there (0) to what the means
/// give (1).
#[derive(Clone, Copy)]
struct End {
    tractions: Skin,
    by_means: Skin,
    share: f64,
}

impl End {
    fn value(&self, i: usize) -> f64 {
        self.tractions[i] + self.share * (self.by_means[i] - self.tractions[i])
    }

    /// Moves the friction into a range, if the tractions are in it.
    fn keep_within(&mut self, [low, high]: [f64; 2]) {
        let (from, to) = (self.tractions[0], self.by_means[0]);
        if to < low || to > high {
            let bound = to.clamp(low.min(high), high.max(low));
            let share = (bound - from) / (to - from);
            self.share = if share.is_finite() {
                share.clamp(0.0, 1.0)
            } else {
                0.0
            };
        }
    }
}

/// Top, middle and bottom of spans with the same laws.
fn smooth(spans: &[Average]) -> Vec<[Skin; 3]> {
    let n = spans.len();
    let mut ends: Vec<End> = (0..=n).map(|number| end(spans, number)).collect();
    let middle = |ends: &[End], number: usize, i: usize| {
        let sum = ends[number].value(i) + ends[number + 1].value(i);
        (6.0 * spans[number].mean[i] - sum) / 4.0
    };
    loop {
        let mut is_done = true;
        for (number, span) in spans.iter().enumerate() {
            let [low, high] = span.range;
            let slack = 1e-9 * (low.abs() + high.abs());
            let value = middle(&ends, number, 0);
            let is_smooth = ends[number].share > 0.0 || ends[number + 1].share > 0.0;
            if is_smooth && (value < low - slack || value > high + slack) {
                ends[number].share = 0.0;
                ends[number + 1].share = 0.0;
                is_done = false;
            }
        }
        if is_done {
            break;
        }
    }
    let values = |number: usize| {
        let of = |i: usize| {
            [
                ends[number].value(i),
                middle(&ends, number, i),
                ends[number + 1].value(i),
            ]
        };
        let [friction, normal, slip] = [0, 1, 2].map(of);
        std::array::from_fn(|part| [friction[part], normal[part], slip[part]])
    };
    (0..n).map(values).collect()
}

/// The upper end of a span; of all, the lower end of the last.
fn end(spans: &[Average], number: usize) -> End {
    let n = spans.len();
    let of = |f: &dyn Fn(usize) -> f64| -> Skin { std::array::from_fn(f) };
    if 0 < number && number < n {
        let (a, b) = (&spans[number - 1], &spans[number]);
        let whole = a.height + b.height;
        let mut end = End {
            tractions: of(&|i| f64::midpoint(a.ends[1][i], b.ends[0][i])),
            by_means: of(&|i| (b.height * a.mean[i] + a.height * b.mean[i]) / whole),
            share: 1.0,
        };
        let range = [a.range[0].max(b.range[0]), a.range[1].min(b.range[1])];
        end.keep_within(range);
        return end;
    }
    let (span, next, side) = if number == 0 {
        (&spans[0], spans.get(1), 0)
    } else {
        (&spans[n - 1], n.checked_sub(2).map(|last| &spans[last]), 1)
    };
    let by_means = |i: usize| match next {
        Some(next) => {
            let whole = span.height + next.height;
            span.mean[i] + (span.mean[i] - next.mean[i]) * span.height / whole
        }
        None => span.ends[side][i],
    };
    let mut end = End {
        tractions: span.ends[side],
        by_means: of(&by_means),
        share: 1.0,
    };
    end.keep_within(span.range);
    end
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An element with these values at its ends and in its middle.
    fn span(height: f64, [top, middle, bottom]: [f64; 3]) -> Average {
        let low = top.min(middle).min(bottom);
        Average {
            height,
            mean: [(top + 4.0 * middle + bottom) / 6.0; 3],
            ends: [[top; 3], [bottom; 3]],
            range: [low, top.max(middle).max(bottom)],
        }
    }

    fn friction(spans: &[Average]) -> Vec<[f64; 3]> {
        let values = smooth(spans).into_iter();
        values.map(|span| span.map(|value| value[0])).collect()
    }

    #[test]
    fn what_swings_about_a_line_becomes_the_line() {
        // A swing of which Simpson's rule sees nothing: +d at the ends, −d/2 in the middle.
        let heights = [1.0, 0.5, 0.5, 2.0, 1.0];
        let line = |z: f64| 20.0 + 3.0 * z;
        let d = 4.0;
        let (mut spans, mut z) = (Vec::new(), 0.0);
        for height in heights {
            let [a, m, b] = [0.0, 0.5, 1.0].map(|t| line(z + t * height));
            spans.push(span(height, [a + d, m - d / 2.0, b + d]));
            z += height;
        }
        z = 0.0;
        for (found, height) in friction(&spans).into_iter().zip(heights) {
            let expected = [0.0, 0.5, 1.0].map(|t| line(z + t * height));
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-12, "{found} for {expected}");
            }
            z += height;
        }
    }

    #[test]
    fn simpson_gives_the_force_and_what_slides_keeps_its_limit() {
        let limit = 30.0;
        let spans = [
            span(1.0, [limit; 3]),
            span(1.0, [limit; 3]),
            span(1.0, [limit, 29.0, 20.0]),
            span(1.0, [20.0, 12.0, 7.0]),
            span(1.0, [7.0, 4.0, 3.0]),
        ];
        for (found, span) in friction(&spans).into_iter().zip(&spans) {
            let mean = (found[0] + 4.0 * found[1] + found[2]) / 6.0;
            assert!((mean - span.mean[0]).abs() < 1e-13, "{found:?}");
            assert!(found.iter().all(|&value| value <= limit), "{found:?}");
        }
        assert_eq!(friction(&spans)[1], [limit; 3]);
    }
}
