//! The pattern of a sparse matrix: its entries that are not zero.

use crate::threads;
use std::ops::Range;

/// Entries from which on products with a vector are shared among threads, and the parts in which they
/// are then added up whatever the number of threads.
const WORTH_SHARING: usize = 50_000;
const PARTS: usize = 4;

/// Numbers by their group, of pairs of both: where each of `n` groups starts, and the end, and the numbers in the
/// order in which they come.
pub(crate) fn grouped(
    n: usize,
    pairs: impl Iterator<Item = (u32, u32)> + Clone,
) -> (Vec<usize>, Vec<u32>) {
    let mut start = vec![0; n + 1];
    for (group, _) in pairs.clone() {
        start[group as usize + 1] += 1;
    }
    for group in 0..n {
        start[group + 1] += start[group];
    }
    let mut next = start.clone();
    let mut numbers = vec![0; start[n]];
    for (group, number) in pairs {
        numbers[next[group as usize]] = number;
        next[group as usize] += 1;
    }
    (start, numbers)
}

/// Compressed columns: row numbers, sorted, of every column.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Pattern {
    /// Start of every column, and the end.
    pub column_start: Vec<u32>,
    /// Row numbers.
    pub rows: Vec<u32>,
}

impl Pattern {
    /// Entries on the diagonal of a matrix of these values; zero if the entry is missing.
    pub fn diagonal(&self, values: &[f64]) -> Vec<f64> {
        let of_column = |column: usize| {
            let own = self.places(column);
            let place = self.rows[own.clone()].binary_search(&(column as u32));
            place.map_or(0.0, |place| values[own.start + place])
        };
        (0..self.n()).map(of_column).collect()
    }

    /// Pattern of `n` equations. Each element couples all its degrees of freedom, which `elements` lists; `equation` is
    /// that of a degree of freedom, if it has one.
    pub fn new<'a>(
        n: usize,
        equation: &[Option<usize>],
        elements: impl Iterator<Item = &'a [usize]>,
    ) -> Self {
        // Elements by equation, then the rows of every column, sorted and each once.
        let elements: Vec<Vec<u32>> = elements
            .map(|dofs| {
                let equations = dofs.iter().filter_map(|&dof| equation[dof]);
                equations.map(|equation| equation as u32).collect()
            })
            .collect();
        let numbered = (0..).zip(&elements);
        let pairs =
            numbered.flat_map(|(number, columns)| columns.iter().map(move |&c| (c, number)));
        let (start, of_column) = grouped(n, pairs);
        let mut pattern = Self {
            column_start: vec![0],
            rows: Vec::new(),
        };
        let mut met_in = vec![u32::MAX; n];
        for column in 0..n {
            let first = pattern.rows.len();
            let own = &of_column[start[column]..start[column + 1]];
            // The second unknown of a node has the rows of the first.
            let before = column.saturating_sub(1);
            if column > 0 && *own == of_column[start[before]..start[column]] {
                pattern.rows.extend_from_within(pattern.places(before));
                pattern.column_start.push(pattern.rows.len() as u32);
                continue;
            }
            for &element in own {
                for &row in &elements[element as usize] {
                    if met_in[row as usize] != column as u32 {
                        met_in[row as usize] = column as u32;
                        pattern.rows.push(row);
                    }
                }
            }
            pattern.rows[first..].sort_unstable();
            pattern.column_start.push(pattern.rows.len() as u32);
        }
        pattern
    }

    /// The pattern restricted to some of the equations, ascending.
    pub(crate) fn among(&self, equations: &[u32]) -> Self {
        let mut number = vec![u32::MAX; self.n()];
        for (new, &equation) in (0..).zip(equations) {
            number[equation as usize] = new;
        }
        let mut column_start = Vec::with_capacity(equations.len() + 1);
        column_start.push(0);
        let mut rows = Vec::with_capacity(self.rows.len());
        for &equation in equations {
            let column = self.column(equation as usize).iter();
            let own = column.map(|&row| number[row as usize]);
            rows.extend(own.filter(|&row| row != u32::MAX));
            column_start.push(rows.len() as u32);
        }
        Self { column_start, rows }
    }

    /// Number of rows and columns.
    pub fn n(&self) -> usize {
        self.column_start.len() - 1
    }

    /// Positions of the entries of a column.
    pub fn places(&self, column: usize) -> Range<usize> {
        self.column_start[column] as usize..self.column_start[column + 1] as usize
    }

    /// Rows of a column.
    pub fn column(&self, column: usize) -> &[u32] {
        &self.rows[self.places(column)]
    }

    /// The product of a matrix with these values and a vector.
    pub fn multiply(&self, values: &[f64], x: &[f64]) -> Vec<f64> {
        let [product] = self.add_up(values, |value, column| [value * x[column]]);
        product
    }

    /// Sums by row of terms that follow from a value and its column.
    pub(crate) fn add_up<const N: usize>(
        &self,
        values: &[f64],
        term: impl Fn(f64, usize) -> [f64; N] + Sync,
    ) -> [Vec<f64>; N] {
        let n = self.n();
        let of_columns = |columns: Range<usize>| {
            let mut sums = [(); N].map(|()| vec![0.0; n]);
            for column in columns {
                let places = self.places(column);
                for (&row, &value) in self.rows[places.clone()].iter().zip(&values[places]) {
                    for (sum, term) in sums.iter_mut().zip(term(value, column)) {
                        sum[row as usize] += term;
                    }
                }
            }
            sums
        };
        if self.rows.len() < WORTH_SHARING {
            return of_columns(0..n);
        }
        let part = |part: usize| of_columns(part * n / PARTS..(part + 1) * n / PARTS);
        let parts = threads::map(0..PARTS, part);
        let mut sums = [(); N].map(|()| vec![0.0; n]);
        for of_part in parts {
            for (sum, of_part) in sums.iter_mut().zip(of_part) {
                sum.iter_mut().zip(of_part).for_each(|(sum, of)| *sum += of);
            }
        }
        sums
    }

    /// For every entry the place of the one across the diagonal, in a symmetric pattern.
    pub fn transposed_places(&self) -> Vec<u32> {
        // Columns are visited in ascending order, so entry after entry of a row is met.
        let mut next = self.column_start.clone();
        let mut across = vec![0; self.rows.len()];
        for column in 0..self.n() {
            for at in self.places(column) {
                let next = &mut next[self.rows[at] as usize];
                across[at] = *next;
                *next += 1;
            }
        }
        across
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns of `n` equations that reach ten rows each way.
    fn band(n: usize) -> Pattern {
        let mut pattern = Pattern {
            column_start: vec![0],
            rows: Vec::new(),
        };
        for column in 0..n {
            let rows = column.saturating_sub(10)..(column + 11).min(n);
            pattern.rows.extend(rows.map(|row| row as u32));
            pattern.column_start.push(pattern.rows.len() as u32);
        }
        pattern
    }

    #[test]
    fn couples_all_unknowns_of_every_element() {
        // Nodes of two unknowns each; of the third the first one, of the fifth both are given.
        let given = [4, 8, 9];
        let mut equation = vec![None; 12];
        let free = (0..12).filter(|dof| !given.contains(dof));
        let free: Vec<usize> = free.collect();
        for (number, &dof) in free.iter().enumerate() {
            equation[dof] = Some(number);
        }
        let elements: [&[usize]; 3] = [
            &[0, 1, 6, 7, 4, 5],
            &[4, 5, 2, 3, 8, 9],
            &[10, 11, 8, 9, 0, 1],
        ];
        let pattern = Pattern::new(free.len(), &equation, elements.into_iter());
        for (column, a) in free.iter().enumerate() {
            let near = |b: &usize| {
                let mut elements = elements.iter();
                elements.any(|dofs| dofs.contains(a) && dofs.contains(b))
            };
            let rows = (0..free.len()).filter(|&row| near(&free[row]));
            let rows: Vec<u32> = rows.map(|row| row as u32).collect();
            assert_eq!(pattern.column(column), rows, "{column}");
        }
    }

    #[test]
    fn multiplies_alike_in_parts_and_with_any_number_of_threads() {
        for n in [40, 5_001] {
            let pattern = band(n);
            assert_eq!(pattern.rows.len() >= WORTH_SHARING, n > 1_000);
            let values: Vec<f64> = (0..pattern.rows.len()).map(|i| (i as f64).sin()).collect();
            let x: Vec<f64> = (0..n).map(|i| (3.0 * i as f64).cos()).collect();
            let mut by_column = vec![0.0; n];
            for column in 0..n {
                for at in pattern.places(column) {
                    by_column[pattern.rows[at] as usize] += values[at] * x[column];
                }
            }
            let product = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
                let pool = pool.build().unwrap();
                pool.install(|| pattern.multiply(&values, &x))
            };
            let one = product(1);
            assert_eq!(one, product(3));
            for (own, expected) in one.iter().zip(by_column) {
                assert!((own - expected).abs() < 1e-13, "{own} {expected}");
            }
        }
    }
}
