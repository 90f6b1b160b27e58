//! What holds along the shaft: friction, normal stress and slip at the rows of `pile.csv`.
//!
//! Tractions of a stiff interface oscillate from node to node about their mean, so they are smoothed. The value at an
//! element end is interpolated between the means of the two adjacent elements. The value in the middle then follows
//! from the mean of the element, so that Simpson's rule gives the element's force over its area.
//! Smoothing must not exceed the strength of the law. If the middle would leave the range that the tractions of the
//! element span, its ends keep their tractions; this happens at the edge of a part that slides.

use super::geometry::{Facet, Geometry};
use super::rows::Span;
use super::split::{Pressed, Split};
use super::{beside, pressure_beside};
use crate::ends;
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
}

impl Average {
    /// Friction and normal stress at its ends, and in its middle by Simpson's rule.
    fn tractions(&self) -> [[f64; 2]; 3] {
        let [top, bottom] = self.ends;
        let at = |i: usize| {
            [
                top[i],
                (6.0 * self.mean[i] - top[i] - bottom[i]) / 4.0,
                bottom[i],
            ]
        };
        let [friction, normal] = [0, 1].map(at);
        std::array::from_fn(|k| [friction[k], normal[k]])
    }
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
    }
    let sums = [&mut all.mean].into_iter().chain(&mut all.ends);
    for value in sums.flatten() {
        *value /= girths;
    }
    all
}

fn weighted_mean(weights: &[f64], values: &[Skin]) -> Skin {
    let whole: f64 = weights.iter().sum();
    std::array::from_fn(|i| {
        let weighted = weights.iter().zip(values);
        weighted
            .map(|(weight, value)| weight * value[i])
            .sum::<f64>()
            / whole
    })
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
    let weights = points.clone().map(|point| kinematics.weight(point));
    let mut mean = weighted_mean(&weights.collect::<Vec<f64>>(), &values);
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
    Average {
        height: heights[0] - heights[1],
        mean,
        ends: heights.map(nearest),
    }
}

/// The end of a span: the tractions there, or what the means of the spans beside it give.
#[derive(Clone, Copy)]
struct End {
    tractions: Skin,
    by_means: Skin,
    is_smooth: bool,
}

impl End {
    fn value(&self) -> Skin {
        if self.is_smooth {
            self.by_means
        } else {
            self.tractions
        }
    }
}

/// Top, middle and bottom of spans with the same laws.
fn smooth(spans: &[Average]) -> Vec<[Skin; 3]> {
    let n = spans.len();
    let mut ends: Vec<End> = (0..=n).map(|number| end(spans, number)).collect();
    let values = |ends: &[End], number: usize| -> [Skin; 3] {
        let [top, bottom] = [ends[number].value(), ends[number + 1].value()];
        let mean = spans[number].mean;
        let middle = std::array::from_fn(|i| (6.0 * mean[i] - top[i] - bottom[i]) / 4.0);
        [top, middle, bottom]
    };
    loop {
        let is_odd = |number: &usize| {
            let [_, [friction, normal, _], _] = values(&ends, *number);
            (ends[*number].is_smooth || ends[*number + 1].is_smooth)
                && !is_mean(spans[*number].tractions(), [friction, normal])
        };
        let Some(odd) = (0..n).find(is_odd) else {
            break;
        };
        ends[odd].is_smooth = false;
        ends[odd + 1].is_smooth = false;
    }
    (0..n).map(|number| values(&ends, number)).collect()
}

/// Tractions at the upper end of a span; with `number` the number of spans, at the lower end of the last. They are not
/// smoothed where no span follows.
fn end(spans: &[Average], number: usize) -> End {
    let n = spans.len();
    let of = |f: &dyn Fn(usize) -> f64| -> Skin { std::array::from_fn(f) };
    if 0 < number && number < n {
        let (a, b) = (&spans[number - 1], &spans[number]);
        let whole = a.height + b.height;
        return End {
            tractions: of(&|i| f64::midpoint(a.ends[1][i], b.ends[0][i])),
            by_means: of(&|i| (b.height * a.mean[i] + a.height * b.mean[i]) / whole),
            is_smooth: true,
        };
    }
    let tractions = if number == 0 {
        spans[0].ends[0]
    } else {
        spans[n - 1].ends[1]
    };
    End {
        tractions,
        by_means: tractions,
        is_smooth: false,
    }
}

/// Whether a point is a mean of three, with weights that are not negative.
fn is_mean(three: [[f64; 2]; 3], point: [f64; 2]) -> bool {
    let size = three.iter().flatten().fold(0.0, |m: f64, v| m.max(v.abs()));
    let slack = 1e-9 * size;
    let is_between = |c: usize| {
        let [low, high] = ends(three.iter().map(|at| at[c]));
        low - slack <= point[c] && point[c] <= high + slack
    };
    let is_inside = |k: usize| {
        let [a, b, opposite] = [three[k], three[(k + 1) % 3], three[(k + 2) % 3]];
        let along = [b[0] - a[0], b[1] - a[1]];
        let side = |at: [f64; 2]| along[0] * (at[1] - a[1]) - along[1] * (at[0] - a[0]);
        let (whole, part) = (side(opposite), side(point));
        let part = if whole < 0.0 { -part } else { part };
        let slack = slack * along[0].hypot(along[1]);
        -slack <= part && part <= whole.abs() + slack
    };
    is_between(0) && is_between(1) && (0..3).all(is_inside)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An element with these values at its ends and in its middle.
    fn span(height: f64, [top, middle, bottom]: [f64; 3]) -> Average {
        Average {
            height,
            mean: [(top + 4.0 * middle + bottom) / 6.0; 3],
            ends: [[top; 3], [bottom; 3]],
        }
    }

    fn friction(spans: &[Average]) -> Vec<[f64; 3]> {
        let values = smooth(spans).into_iter();
        values.map(|span| span.map(|value| value[0])).collect()
    }

    /// But for the first and the last element.
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
        for (number, (found, height)) in friction(&spans).into_iter().zip(heights).enumerate() {
            let expected = [0.0, 0.5, 1.0].map(|t| line(z + t * height));
            z += height;
            if number == 0 || number == heights.len() - 1 {
                continue;
            }
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-12, "{found} for {expected}");
            }
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
        let in_limit = friction(&spans)[1];
        assert!(
            in_limit
                .iter()
                .all(|value| value.to_bits() == limit.to_bits()),
            "{in_limit:?}"
        );
    }
}
