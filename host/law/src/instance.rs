//! A law as the host sees it, wherever it is called: a [`Source`] makes an [`Instance`] of parameters, and this carries
//! batches of points. They are implemented by laws of the contract ([`crate::library`]), by routines made for other
//! programs ([`crate::foreign`]), by laws in worker processes ([`crate::process`]), and by a zone around a law
//! ([`crate::shear_zone`]).

use crate::call::{Batch, Request};
use crate::description::{FormulationDescription, LawDescription};
use abi::Hypothesis;
use abi::raw::Status;
use std::fmt::Debug;
use std::sync::Arc;

/// The most severe status of a call, and a message.
pub(crate) type Answer = (Status, String);

/// Laws of a library, each with what builds it.
pub(crate) type Described = Vec<(LawDescription, Arc<dyn Source>)>;

/// A law without parameters.
pub(crate) trait Source: Debug + Send + Sync {
    /// Fixes the parameters (in declared order; NaN: left out) under a hypothesis that the law offers by this
    /// formulation.
    ///
    /// # Errors
    /// The law's status and message.
    fn create(
        &self,
        hypothesis: Hypothesis,
        formulation: &FormulationDescription,
        parameters: &[f64],
    ) -> Result<Box<dyn Instance>, Answer>;

    /// Whether calls of one material must follow one another.
    fn is_serial(&self) -> bool {
        false
    }

    /// Whether it is called in this process, and not in workers or by a zone.
    fn is_called_here(&self) -> bool {
        true
    }
}

/// A law with its parameters fixed. Calls of several threads may overlap.
pub(crate) trait Instance: Debug + Send + Sync {
    /// Carries the points over the increment, or changes their internal variables, as described, to those that belong to
    /// their fluxes. `None`: the description says all there is to say of these.
    fn call(&self, request: Request, batch: Batch<'_, '_>) -> Option<Answer>;

    /// Arguments that a routine has overwritten though it is given them to read, those that were not told before.
    fn take_overwritten(&self) -> Vec<String> {
        Vec::new()
    }

    /// Puts a number between the arguments of a routine from now on, in front of that one or everywhere; the usual one if
    /// none exists. In words where that is; `None` if there is no such place.
    fn put_beside(&self, _gap: Option<usize>, _value: Option<f64>) -> Option<String> {
        None
    }
}
