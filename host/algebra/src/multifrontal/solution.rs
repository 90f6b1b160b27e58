//! Solutions with the factors, one right-hand side at a time.

use super::kernels::{dot, packed};
use super::{Kind, Multifrontal};

impl Multifrontal {
    /// The supernodes that give the values of some equations: theirs, and all above them.
    pub fn fronts_of(&self, wanted: &[bool]) -> Vec<bool> {
        let analysis = &self.analysis;
        let mut fronts: Vec<bool> = Vec::with_capacity(analysis.fronts.len());
        // Children come before their parents.
        for shape in &analysis.fronts {
            let own = &analysis.order[shape.pivots.clone()];
            fronts.push(
                own.iter().any(|&equation| wanted[equation as usize])
                    || shape.children.iter().any(|&child| fronts[child]),
            );
        }
        fronts
    }

    /// Eliminates the right-hand side (by equation): L y = b for the eliminated equations, and
    /// what is left for the kept ones. Where it vanishes outside some supernodes, those and the
    /// ones above them suffice.
    pub fn forward(&self, right: &[f64], fronts: Option<&[bool]>) -> (Vec<f64>, Vec<f64>) {
        let analysis = &self.analysis;
        let n_eliminated = analysis.order.len();
        let all = analysis.order.iter().chain(&analysis.kept);
        let mut y: Vec<f64> = all.map(|&equation| right[equation as usize]).collect();
        let mut own = Vec::new();
        let numbered = analysis.fronts.iter().enumerate();
        for (number, shape) in numbered.filter(|(number, _)| fronts.is_none_or(|f| f[*number])) {
            let front = self.front(number);
            let k = shape.pivots.len();
            let rows = &analysis.rows[shape.rows.clone()];
            let n = k + rows.len();
            own.clear();
            let start = shape.pivots.start;
            match analysis.kind {
                Kind::Symmetric => own.extend_from_slice(&y[shape.pivots.clone()]),
                Kind::Unsymmetric => {
                    let exchanged = front.exchanges.forward.iter();
                    own.extend(exchanged.map(|&from| y[start + from]));
                }
            }
            own.resize(n, 0.0);
            for j in 0..k {
                let start = match analysis.kind {
                    Kind::Symmetric => packed(n, j),
                    Kind::Unsymmetric => j * n + j,
                };
                let column = &front.values[start..start + n - j];
                if analysis.kind == Kind::Symmetric {
                    own[j] /= column[0];
                }
                let x = own[j];
                for (value, l) in own[j + 1..].iter_mut().zip(&column[1..]) {
                    *value -= l * x;
                }
            }
            y[shape.pivots.clone()].copy_from_slice(&own[..k]);
            for (&row, value) in rows.iter().zip(&own[k..]) {
                y[row as usize] += value;
            }
        }
        let kept = y.split_off(n_eliminated);
        (y, kept)
    }

    /// Values of all equations from `y` of [`Self::forward`] and those of the kept ones.
    /// Only those of some supernodes, see [`Self::fronts_of`]; the others mean nothing.
    pub fn backward(&self, y: &[f64], kept: &[f64], fronts: Option<&[bool]>) -> Vec<f64> {
        let analysis = &self.analysis;
        let mut x = [y, kept].concat();
        let mut own = Vec::new();
        let numbered = analysis.fronts.iter().enumerate().rev();
        for (number, shape) in numbered.filter(|(number, _)| fronts.is_none_or(|f| f[*number])) {
            let front = self.front(number);
            let k = shape.pivots.len();
            let rows = &analysis.rows[shape.rows.clone()];
            let n = k + rows.len();
            own.clear();
            own.extend_from_slice(&x[shape.pivots.clone()]);
            match analysis.kind {
                Kind::Symmetric => {
                    let below: Vec<f64> = rows.iter().map(|&row| x[row as usize]).collect();
                    for j in (0..k).rev() {
                        let column = &front.values[packed(n, j)..packed(n, j + 1)];
                        let from_below = dot(&column[k - j..], &below);
                        let from_own = dot(&column[1..k - j], &own[j + 1..]);
                        own[j] = (own[j] - from_below - from_own) / column[0];
                    }
                }
                Kind::Unsymmetric => {
                    let (l, u) = front.values.split_at(n * k);
                    for (column, &row) in u.chunks_exact(k).zip(rows) {
                        let value = x[row as usize];
                        for (own, u) in own.iter_mut().zip(column) {
                            *own -= u * value;
                        }
                    }
                    for j in (0..k).rev() {
                        let column = &l[j * n..j * n + k];
                        own[j] /= column[j];
                        let value = own[j];
                        for (own, u) in own[..j].iter_mut().zip(column) {
                            *own -= u * value;
                        }
                    }
                }
            }
            x[shape.pivots.clone()].copy_from_slice(&own);
        }
        let mut result = vec![0.0; x.len()];
        let all = analysis.order.iter().chain(&analysis.kept);
        for (&equation, value) in all.zip(x) {
            result[equation as usize] = value;
        }
        result
    }
}
