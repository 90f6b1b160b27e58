//! Why a step failed.

use crate::frame::Frame;
use crate::state::Vector;
use law::BatchFailure;

/// The controlled component that missed its goal by most, in the best attempt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Miss {
    pub(crate) component: usize,
    pub(crate) flux: f64,
    pub(crate) goal: f64,
    pub(crate) residual: f64,
    pub(crate) tolerance: f64,
}

/// Why a step failed: what is known for the next try and for whoever asked for it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Obstacle {
    /// The smallest step factor a law asked for.
    pub(crate) factor: Option<f64>,
    /// The law's last refusal of an update.
    pub(crate) refusal: Option<Box<BatchFailure>>,
    /// How near the best attempt came.
    pub(crate) miss: Option<Miss>,
    /// The kind of its components.
    pub(crate) frame: Frame,
    /// Its components are restrictions.
    pub(crate) is_restricted: bool,
    /// Their stiffness control.
    pub(super) stiffness: Vector,
    /// Norm of the residual of the best attempt.
    pub(super) norm: f64,
}

impl Obstacle {
    /// The law refused an update.
    pub(super) fn refused(&mut self, failure: BatchFailure) {
        let smallest = self.factor.unwrap_or(1.0);
        self.factor = failure.factor.map(|f| f.min(smallest)).or(self.factor);
        self.refusal = Some(Box::new(failure));
    }

    /// Whether the stiffness of a component is controlled, not its flux.
    pub(crate) fn is_sprung(&self, component: usize) -> bool {
        self.stiffness[component] > 0.0
    }
}
