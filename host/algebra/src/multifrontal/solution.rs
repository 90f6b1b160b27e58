//! Solutions with the factors, one right-hand side at a time.

use super::analysis::{Analysis, Branch};
use super::substitution::{Down, Up};
use super::{Kind, Multifrontal};
use crate::threads;
use pulp::Arch;
use std::ops::Range;

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
        let is_wanted = |number: usize| fronts.is_none_or(|fronts| fronts[number]);
        let solved = threads::map(&analysis.branches, |branch| {
            self.forward_branch(branch, &y, is_wanted)
        });
        // In one order, whoever computed them.
        for (branch, (values, left)) in analysis.branches.iter().zip(solved) {
            analysis.put(branch, &values, &mut y);
            for (&row, value) in analysis.above(branch).iter().zip(left) {
                y[row as usize] += value;
            }
        }
        let mut own = Vec::new();
        for level in analysis.top.iter().rev() {
            // Small ones are levels each: nothing is allocated for them.
            if let [number] = level[..] {
                if is_wanted(number) {
                    let (pivots, rows) = analysis.shape(number);
                    self.forward_front(number, &y[pivots], rows.len(), &mut own);
                    analysis.leave(number, &own, &mut y);
                }
                continue;
            }
            let wanted = level.iter().filter(|&&number| is_wanted(number));
            let solved = threads::map(wanted, |&number| {
                let (pivots, rows) = analysis.shape(number);
                let mut own = Vec::new();
                self.forward_front(number, &y[pivots], rows.len(), &mut own);
                (number, own)
            });
            for (number, own) in solved {
                analysis.leave(number, &own, &mut y);
            }
        }
        let kept = y.split_off(n_eliminated);
        (y, kept)
    }

    /// Eliminates the pivots of a branch: their values, and what is left to the rows above it.
    fn forward_branch(
        &self,
        branch: &Branch,
        y: &[f64],
        is_wanted: impl Fn(usize) -> bool,
    ) -> (Vec<f64>, Vec<f64>) {
        let analysis = &self.analysis;
        let mut y = analysis.take(branch, y);
        let mut left = vec![0.0; analysis.above(branch).len()];
        let mut own = Vec::new();
        for &number in branch.fronts.iter().filter(|&&number| is_wanted(number)) {
            let (pivots, rows) = analysis.shape(number);
            let (k, at) = (pivots.len(), analysis.in_branch[pivots.start] as usize);
            self.forward_front(number, &y[at..at + k], rows.len(), &mut own);
            y[at..at + k].copy_from_slice(&own[..k]);
            let mut places = Places::new(analysis, branch);
            for (&row, value) in rows.iter().zip(&own[k..]) {
                match places.of(row) {
                    Ok(inside) => y[inside] += value,
                    Err(above) => left[above] += value,
                }
            }
        }
        (y, left)
    }

    /// Eliminates the pivots of a front: their values in `own`, and behind them what is left to its `m` rows.
    fn forward_front(&self, number: usize, pivots: &[f64], m: usize, own: &mut Vec<f64>) {
        let front = self.front(number);
        let k = pivots.len();
        let n = k + m;
        own.clear();
        match self.analysis.kind {
            Kind::Symmetric => own.extend_from_slice(pivots),
            Kind::Unsymmetric => {
                let exchanged = front.exchanges.forward.iter();
                own.extend(exchanged.map(|&from| pivots[from]));
            }
        }
        own.resize(n, 0.0);
        Arch::new().dispatch(Down {
            kind: self.analysis.kind,
            values: &front.values,
            own: own.as_mut_slice(),
            k,
        });
    }

    /// Values of all equations from `y` of [`Self::forward`] and those of the kept ones.
    /// Only those of some supernodes, see [`Self::fronts_of`]; the others mean nothing.
    pub fn backward(&self, y: &[f64], kept: &[f64], fronts: Option<&[bool]>) -> Vec<f64> {
        let mut x = [y, kept].concat();
        self.substitute(&mut x, fronts);
        let mut result = vec![0.0; x.len()];
        let all = self.analysis.order.iter().chain(&self.analysis.kept);
        for (&equation, value) in all.zip(x) {
            result[equation as usize] = value;
        }
        result
    }

    /// As [`Self::backward`] with a multiple of `y`, for some equations only: those at these
    /// [`places`](Self::places), and in their order.
    pub fn backward_at(
        &self,
        places: &[u32],
        (share, y): (f64, &[f64]),
        kept: &[f64],
        fronts: &[bool],
    ) -> Vec<f64> {
        let mut x = vec![0.0; y.len()];
        for (shape, _) in self
            .analysis
            .fronts
            .iter()
            .zip(fronts)
            .filter(|(_, is)| **is)
        {
            let pivots = shape.pivots.clone();
            for (x, y) in x[pivots.clone()].iter_mut().zip(&y[pivots]) {
                *x = share * y;
            }
        }
        x.extend_from_slice(kept);
        self.substitute(&mut x, Some(fronts));
        places.iter().map(|&place| x[place as usize]).collect()
    }

    /// For every equation, its place in the order of elimination; kept equations follow at the end.
    pub fn places(&self) -> Vec<u32> {
        let all = self.analysis.order.iter().chain(&self.analysis.kept);
        let mut places = vec![0; self.analysis.order.len() + self.analysis.kept.len()];
        for (place, &equation) in all.enumerate() {
            places[equation as usize] = place as u32;
        }
        places
    }

    /// Values of all equations, in the order of elimination, from what [`Self::forward`] left.
    fn substitute(&self, x: &mut [f64], fronts: Option<&[bool]>) {
        let analysis = &self.analysis;
        let is_wanted = |number: usize| fronts.is_none_or(|fronts| fronts[number]);
        let mut below = Vec::new();
        for level in &analysis.top {
            // As in [`Self::forward`].
            if let [number] = level[..] {
                if is_wanted(number) {
                    let (pivots, rows) = analysis.shape(number);
                    below.clear();
                    below.extend(rows.iter().map(|&row| x[row as usize]));
                    self.backward_front(number, &mut x[pivots], &below);
                }
                continue;
            }
            let wanted = level.iter().filter(|&&number| is_wanted(number));
            let solved = threads::map(wanted, |&number| {
                let (pivots, rows) = analysis.shape(number);
                let below: Vec<f64> = rows.iter().map(|&row| x[row as usize]).collect();
                let mut own = x[pivots].to_vec();
                self.backward_front(number, &mut own, &below);
                (number, own)
            });
            for (number, own) in solved {
                x[analysis.shape(number).0].copy_from_slice(&own);
            }
        }
        let has_wanted = |branch: &&Branch| branch.fronts.iter().any(|&number| is_wanted(number));
        let branches: Vec<&Branch> = analysis.branches.iter().filter(has_wanted).collect();
        let solved = threads::map(&branches, |branch| {
            self.backward_branch(branch, x, is_wanted)
        });
        for (branch, values) in branches.into_iter().zip(solved) {
            analysis.put(branch, &values, x);
        }
    }

    /// Values of the pivots of a branch from those of the rows above it.
    fn backward_branch(
        &self,
        branch: &Branch,
        all: &[f64],
        is_wanted: impl Fn(usize) -> bool,
    ) -> Vec<f64> {
        let analysis = &self.analysis;
        let mut x = analysis.take(branch, all);
        let mut below = Vec::new();
        let fronts = branch.fronts.iter().rev();
        for &number in fronts.filter(|&&number| is_wanted(number)) {
            let (pivots, rows) = analysis.shape(number);
            let mut places = Places::new(analysis, branch);
            below.clear();
            below.extend(rows.iter().map(|&row| match places.of(row) {
                Ok(inside) => x[inside],
                Err(_) => all[row as usize],
            }));
            let at = analysis.in_branch[pivots.start] as usize;
            self.backward_front(number, &mut x[at..at + pivots.len()], &below);
        }
        x
    }

    /// Values of the pivots of a front from those of the rows below them.
    fn backward_front(&self, number: usize, own: &mut [f64], below: &[f64]) {
        Arch::new().dispatch(Up {
            kind: self.analysis.kind,
            values: &self.front(number).values,
            own,
            below,
        });
    }
}

impl Analysis {
    /// Pivots of a front, and the rows below them.
    fn shape(&self, front: usize) -> (Range<usize>, &[u32]) {
        let shape = &self.fronts[front];
        (shape.pivots.clone(), &self.rows[shape.rows.clone()])
    }

    /// Puts the values of the pivots of a front among all, and adds what it leaves to its rows.
    fn leave(&self, front: usize, own: &[f64], all: &mut [f64]) {
        let (pivots, rows) = self.shape(front);
        let (of_pivots, left) = own.split_at(pivots.len());
        all[pivots].copy_from_slice(of_pivots);
        for (&row, value) in rows.iter().zip(left) {
            all[row as usize] += value;
        }
    }

    /// Rows above a branch that it touches: those of its last front.
    fn above(&self, branch: &Branch) -> &[u32] {
        branch.fronts.last().map_or(&[], |&last| self.shape(last).1)
    }

    /// Values of the pivots of a branch, from those of all positions.
    fn take(&self, branch: &Branch, values: &[f64]) -> Vec<f64> {
        let mut taken = Vec::with_capacity(branch.n_pivots);
        for &front in &branch.fronts {
            taken.extend_from_slice(&values[self.fronts[front].pivots.clone()]);
        }
        taken
    }

    /// Puts them back.
    fn put(&self, branch: &Branch, taken: &[f64], values: &mut [f64]) {
        for &front in &branch.fronts {
            let pivots = self.fronts[front].pivots.clone();
            let at = self.in_branch[pivots.start] as usize;
            values[pivots.clone()].copy_from_slice(&taken[at..at + pivots.len()]);
        }
    }
}

/// Positions of ascending rows of a front: among the pivots of its branch, or the rows above it.
struct Places<'b> {
    in_branch: &'b [u32],
    /// Position of the first pivot above the branch.
    end: usize,
    above: &'b [u32],
    next: usize,
}

impl<'b> Places<'b> {
    fn new(analysis: &'b Analysis, branch: &'b Branch) -> Self {
        let last = branch.fronts.last();
        Self {
            in_branch: &analysis.in_branch,
            end: last.map_or(0, |&last| analysis.fronts[last].pivots.end),
            above: analysis.above(branch),
            next: 0,
        }
    }

    fn of(&mut self, row: u32) -> Result<usize, usize> {
        if (row as usize) < self.end {
            return Ok(self.in_branch[row as usize] as usize);
        }
        while self.above[self.next] < row {
            self.next += 1;
        }
        Err(self.next)
    }
}
