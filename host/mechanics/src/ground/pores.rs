//! Hydrostatic pore pressure within a phase.

use crate::problem::{Problem, Water};

/// Hydrostatic pressure in the pores at one time: a part of the way between two water tables, as its
/// forces are.
#[derive(Clone, Debug, Default)]
pub struct Pores {
    /// Of every group, whether water fills its pores.
    fills: Vec<bool>,
    from: Option<Water>,
    to: Option<Water>,
    share: f64,
}

impl Pores {
    /// Before the first phase.
    pub(crate) fn before(problem: &Problem) -> Self {
        Self {
            fills: problem
                .groups
                .iter()
                .map(|group| group.pore_water)
                .collect(),
            from: problem.water.clone(),
            to: problem.water.clone(),
            share: 0.0,
        }
    }

    /// On the way from one water table to another.
    pub(crate) fn are(&mut self, from: Option<Water>, to: Option<Water>, share: f64) {
        (self.from, self.to, self.share) = (from, to, share);
    }

    /// Whether there is water anywhere.
    pub fn has_water(&self) -> bool {
        self.to.is_some()
    }

    /// Pressure in a group at a place, compression positive, kPa.
    pub fn pressure(&self, group: usize, at: [f64; 2]) -> f64 {
        if !self.fills[group] {
            return 0.0;
        }
        let of = |water: &Option<Water>| water.as_ref().map_or(0.0, |water| water.pressure(at));
        let (from, to) = (of(&self.from), of(&self.to));
        from + self.share * (to - from)
    }
}
