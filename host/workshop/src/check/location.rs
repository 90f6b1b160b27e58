//! Where a law was asked, in words.

use super::specimen::Specimen;
use law::probe::PointStart;
use std::fmt::{Display, Formatter, Result};

/// Maximum number of internal variables in a message; a capsule has them all.
const MOST_TOLD: usize = 12;

/// A point at the start of an increment, and where its gradient goes.
#[derive(Debug)]
pub(super) struct Place<'a> {
    specimen: &'a Specimen,
    start: &'a PointStart,
}

impl Specimen {
    /// Place of a call, for messages.
    pub(super) fn at<'a>(&'a self, start: &'a PointStart) -> Place<'a> {
        Place {
            specimen: self,
            start,
        }
    }
}

impl Display for Place<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let Self { specimen, start } = self;
        let (gradient, flux) = law::words(specimen.hypothesis);
        if !start.gradient1.is_empty() {
            write!(
                f,
                "{gradient} {:?} to {:?}, ",
                start.gradient0, start.gradient1
            )?;
        }
        write!(f, "{flux} {:?}", start.flux0)?;
        let variables = &specimen.formulation.internal_variables;
        for (variable, value) in variables.iter().zip(&start.state0).take(MOST_TOLD) {
            write!(f, ", {} {value:?}", variable.id)?;
        }
        match start.state0.len().saturating_sub(MOST_TOLD) {
            0 => Ok(()),
            more => write!(f, " and {more} more"),
        }
    }
}
