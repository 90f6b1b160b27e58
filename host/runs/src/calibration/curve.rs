//! A measured curve, and the computed one next to it.

use crate::experiment::Rows;

/// A measured curve.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Computed column along the horizontal axis.
    pub x: String,
    /// Computed column along the vertical axis.
    pub y: String,
    /// Texts of the axes.
    pub labels: [String; 2],
    /// Which stretch of the path; all of it if absent.
    pub(super) stretch: Option<usize>,
    /// The measured points that are compared.
    pub points: Vec<(f64, f64)>,
    /// Standard deviation of each point, as told.
    pub deviations: Vec<f64>,
    /// Whether the file reports it, or these are the usual ones.
    pub is_noise_given: bool,
    /// How often squared residuals count, of the curve and its test.
    pub weight: f64,
    /// Parameters, by number, that say how it was read: offset and scale of x, offset and scale of y.
    pub(super) readings: [Option<usize>; 4],
}

/// Why a curve has no value at a measured point.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Gap {
    /// There is no such column.
    NoColumn(String),
    /// The column along the horizontal axis turns back at this row.
    TurnsBack {
        /// The row, from 0.
        row: usize,
        /// The value where it turns.
        at: f64,
    },
    /// Fewer than two rows, or values that are no numbers.
    NoRows,
    /// A measured point lies outside the computed ones, which have this range.
    Outside([f64; 2]),
}

/// Rows by stretch and place in it, and two columns.
type Places = (Vec<(usize, usize)>, [usize; 2]);

/// Where a measured point lies among the computed ones: between rows `row` and `row + 1`, this part of
/// the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    pub(super) row: usize,
    pub(super) part: f64,
}

impl Curve {
    /// The rows that the computed curve goes through, by stretch and place in it, and its columns.
    ///
    /// # Errors
    /// They cannot be read off.
    pub(super) fn places(&self, rows: &Rows) -> Result<Places, Gap> {
        let column = |name: &str| {
            let place = rows.names.iter().position(|other| other == name);
            place.ok_or_else(|| Gap::NoColumn(name.to_owned()))
        };
        let (x, y) = (column(&self.x)?, column(&self.y)?);
        let stretches = match self.stretch {
            Some(number) => number..number + 1,
            None => 0..rows.stretches.len(),
        };
        let mut places: Vec<(usize, usize)> = Vec::new();
        for stretch in stretches {
            for row in 0..rows.stretches.get(stretch).map_or(0, Vec::len) {
                // A stretch starts with the row that the one before it ends with.
                if row > 0 || places.is_empty() {
                    places.push((stretch, row));
                }
            }
        }
        let at = |&(stretch, row): &(usize, usize)| {
            let values = &rows.stretches[stretch][row];
            (values[x], values[y])
        };
        let is_number = |(x, y): (f64, f64)| x.is_finite() && y.is_finite();
        if places.len() < 2 || !places.iter().map(at).all(is_number) {
            return Err(Gap::NoRows);
        }
        let rises = at(&places[1]).0 > at(&places[0]).0;
        let goes_on = |w: &[(usize, usize)]| {
            let (a, b) = (at(&w[0]).0, at(&w[1]).0);
            if rises { b > a } else { b < a }
        };
        match places.windows(2).position(|w| !goes_on(w)) {
            None => Ok((places, [x, y])),
            Some(row) => Err(Gap::TurnsBack {
                row,
                at: at(&places[row]).0,
            }),
        }
    }

    /// How it is read with these values of all parameters: offset and scale of x, offset and scale of y.
    fn reading(&self, values: &[f64]) -> [f64; 4] {
        let of = |place: usize, none: f64| self.readings[place].map_or(none, |p| values[p]);
        [of(0, 0.0), of(1, 1.0), of(2, 0.0), of(3, 1.0)]
    }

    /// The computed points in order, as they would be measured: times the scale, plus the offset, where these are looked
    /// for.
    ///
    /// # Errors
    /// They cannot be read off.
    pub(super) fn line(&self, rows: &Rows, values: &[f64]) -> Result<Vec<(f64, f64)>, Gap> {
        let (places, [x, y]) = self.places(rows)?;
        let [offset_x, scale_x, offset_y, scale_y] = self.reading(values);
        let is_read = self.readings.iter().any(Option::is_some);
        let at = |&(stretch, row): &(usize, usize)| {
            let computed = &rows.stretches[stretch][row];
            if is_read {
                (
                    offset_x + scale_x * computed[x],
                    offset_y + scale_y * computed[y],
                )
            } else {
                (computed[x], computed[y])
            }
        };
        Ok(places.iter().map(at).collect())
    }

    /// Whether a measured point lies before the first computed one, where a slack or a wrong zero is looked for: nothing
    /// has moved there yet.
    fn is_before(&self, line: &[(f64, f64)], x: f64) -> bool {
        let rises = line[1].0 > line[0].0;
        self.readings[0].is_some() && if rises { x < line[0].0 } else { x > line[0].0 }
    }

    /// Where a measured point lies among the computed ones.
    pub(super) fn spot(&self, line: &[(f64, f64)], x: f64) -> Option<Spot> {
        let first = self
            .is_before(line, x)
            .then_some(Spot { row: 0, part: 0.0 });
        first.or_else(|| spot(line, x))
    }

    /// Derivatives of the computed values at the measured points where those of the rows are known.
    ///
    /// # Errors
    /// The curve cannot be read off.
    pub(super) fn derivatives(
        &self,
        rows: &Rows,
        of_rows: &[Vec<Vec<f64>>],
        values: &[f64],
    ) -> Result<Vec<f64>, Gap> {
        let (places, [x, y]) = self.places(rows)?;
        let line = self.line(rows, values)?;
        let [_, scale_x, _, scale_y] = self.reading(values);
        let derivative = |(spot, (at, _)): (Spot, &(f64, f64))| {
            let rate = |number: usize, column: usize| {
                let (stretch, row) = places[spot.row + number];
                let scale = if column == x { scale_x } else { scale_y };
                scale * of_rows[stretch][row][column]
            };
            if self.is_before(&line, *at) {
                return rate(0, y);
            }
            let (a, b) = (line[spot.row], line[spot.row + 1]);
            // The measured x stays, the rows beside it move.
            let moved = rate(0, x) + spot.part * (rate(1, x) - rate(0, x));
            let part = -moved / (b.0 - a.0);
            rate(0, y) + spot.part * (rate(1, y) - rate(0, y)) + part * (b.1 - a.1)
        };
        let spots = self.spots(&line)?.into_iter();
        Ok(spots.zip(&self.points).map(derivative).collect())
    }

    /// Where the measured points lie among computed ones.
    ///
    /// # Errors
    /// [`Gap::Outside`].
    pub(super) fn spots(&self, line: &[(f64, f64)]) -> Result<Vec<Spot>, Gap> {
        let all = self.points.iter().map(|(x, _)| self.spot(line, *x));
        let all: Option<Vec<Spot>> = all.collect();
        all.ok_or_else(|| Gap::Outside(extent(line)))
    }

    /// The computed values at the measured points.
    ///
    /// # Errors
    /// [`Gap`] if there are no such values.
    pub(super) fn computed(&self, rows: &Rows, values: &[f64]) -> Result<Vec<f64>, Gap> {
        let line = self.line(rows, values)?;
        let spots = self.spots(&line)?;
        Ok(spots
            .iter()
            .map(|spot| spot.between(|row| line[row].1))
            .collect())
    }

    /// The largest measured value, without its sign.
    pub(super) fn largest(&self) -> f64 {
        let values = self.points.iter().map(|(_, y)| y.abs());
        values.fold(0.0, f64::max)
    }

    /// Differences of computed and measured values over their deviations, squares of which are summed.
    pub(super) fn residuals(&self, computed: &[f64]) -> Vec<f64> {
        let differences = self.points.iter().zip(computed);
        let differences: Vec<f64> = differences.map(|((_, y), computed)| computed - y).collect();
        self.weighed(&differences)
    }

    /// Differences of values as residuals: over their deviations, times the root of the weight.
    pub(super) fn weighed(&self, differences: &[f64]) -> Vec<f64> {
        let factor = self.weight.sqrt();
        let pairs = differences.iter().zip(&self.deviations);
        pairs.map(|(d, deviation)| factor * d / deviation).collect()
    }
}

impl Spot {
    /// A value between those of its two rows.
    pub(super) fn between(self, value: impl Fn(usize) -> f64) -> f64 {
        let (a, b) = (value(self.row), value(self.row + 1));
        a + self.part * (b - a)
    }
}

/// Where `x` lies on a line whose x only grows or only falls.
fn spot(line: &[(f64, f64)], x: f64) -> Option<Spot> {
    let rises = line[1].0 > line[0].0;
    let is_before = |point: &(f64, f64)| if rises { point.0 < x } else { point.0 > x };
    let next = line.partition_point(is_before);
    if next == 0 {
        // The first point itself.
        let [low, high] = extent(line);
        let slack = 1e-9 * (high - low);
        return ((line[0].0 - x).abs() <= slack).then_some(Spot { row: 0, part: 0.0 });
    }
    if next == line.len() {
        let [low, high] = extent(line);
        let is_last = (line[next - 1].0 - x).abs() <= 1e-9 * (high - low);
        return is_last.then_some(Spot {
            row: next - 2,
            part: 1.0,
        });
    }
    let (a, b) = (line[next - 1].0, line[next].0);
    Some(Spot {
        row: next - 1,
        part: (x - a) / (b - a),
    })
}

/// Least and greatest x of a line.
pub(super) fn extent(line: &[(f64, f64)]) -> [f64; 2] {
    let (first, last) = (line[0].0, line[line.len() - 1].0);
    [first.min(last), first.max(last)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(points: &[(f64, f64)]) -> Curve {
        Curve {
            x: "u".to_owned(),
            y: "t".to_owned(),
            labels: [String::new(), String::new()],
            stretch: None,
            points: points.to_vec(),
            deviations: vec![0.5; points.len()],
            weight: 4.0,
            is_noise_given: true,
            readings: [None; 4],
        }
    }

    fn rows(stretches: &[&[(f64, f64)]]) -> Rows {
        let row = |(x, y): &(f64, f64)| vec![*x, *y];
        Rows {
            names: vec!["u".to_owned(), "t".to_owned()],
            stretches: stretches
                .iter()
                .map(|s| s.iter().map(row).collect())
                .collect(),
            ..Rows::default()
        }
    }

    #[test]
    fn values_lie_on_the_line_between_rows() {
        let there = rows(&[&[(0.0, 0.0), (1.0, 10.0)], &[(1.0, 10.0), (3.0, 30.0)]]);
        let curve = curve(&[
            (0.0, 0.0),
            (0.25, 2.0),
            (1.0, 9.0),
            (2.0, 21.0),
            (3.0, 30.0),
        ]);
        let computed = curve.computed(&there, &[]).unwrap();
        assert_eq!(computed, [0.0, 2.5, 10.0, 20.0, 30.0]);
        // (computed − measured)/0.5, times the root of the weight.
        assert_eq!(curve.residuals(&computed), [0.0, 2.0, 4.0, -4.0, 0.0]);
        let falling = rows(&[&[(0.0, 0.0), (-2.0, 4.0)]]);
        let falling_curve = super::tests::curve(&[(-0.5, 0.0)]);
        assert_eq!(falling_curve.computed(&falling, &[]).unwrap(), [1.0]);
    }

    #[test]
    fn derivatives_follow_both_columns() {
        // x = p·k, y = q·k² at k = 0, 1, 2, with p = 1, q = 10.
        let of = |p: f64, q: f64| {
            let points: Vec<(f64, f64)> =
                (0..3).map(f64::from).map(|k| (p * k, q * k * k)).collect();
            rows(&[&points])
        };
        let curve = curve(&[(0.5, 0.0), (1.75, 0.0)]);
        let step = 1e-6;
        for (by_p, by_q) in [(1.0, 0.0), (0.0, 1.0)] {
            let of_rows = [(0..3)
                .map(f64::from)
                .map(|k| vec![by_p * k, by_q * k * k])
                .collect()];
            let found = curve.derivatives(&of(1.0, 10.0), &of_rows, &[]).unwrap();
            let found = curve.weighed(&found);
            let side = |sign: f64| {
                let there = of(1.0 + sign * step * by_p, 10.0 + sign * step * by_q);
                curve.residuals(&curve.computed(&there, &[]).unwrap())
            };
            for ((found, above), below) in found.iter().zip(side(1.0)).zip(side(-1.0)) {
                assert!((found - (above - below) / (2.0 * step)).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn a_curve_that_cannot_be_read_off_says_why() {
        let turning = rows(&[&[(0.0, 0.0), (1.0, 1.0)], &[(1.0, 1.0), (0.5, 0.0)]]);
        let mut one = curve(&[(0.5, 0.5)]);
        assert_eq!(
            one.computed(&turning, &[]),
            Err(Gap::TurnsBack { row: 1, at: 1.0 })
        );
        one.stretch = Some(1);
        assert_eq!(one.computed(&turning, &[]).unwrap(), [0.0]);
        one.points[0].0 = 1.5;
        assert_eq!(one.computed(&turning, &[]), Err(Gap::Outside([0.5, 1.0])));
        one.y = "v".to_owned();
        assert_eq!(
            one.computed(&turning, &[]),
            Err(Gap::NoColumn("v".to_owned()))
        );
    }
}
