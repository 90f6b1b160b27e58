//! A point, and what a step asks of it.

/// Most components of gradient and flux.
pub const N_MAX: usize = 6;
/// Components of a gradient or flux in the order of [`abi::Hypothesis::components`], padded with zeros.
pub type Vector = [f64; N_MAX];

/// A point that carries its history.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    /// Jumps or strains.
    pub(crate) gradient: Vector,
    /// Tractions or stresses.
    pub(crate) flux: Vector,
    /// Internal variables, in the law's order.
    pub(crate) internal: Vec<f64>,
}

/// The goals of a step: prescribed gradients, and F for prescribed fluxes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Goal {
    pub(crate) gradient: Vector,
    pub(crate) flux: Vector,
}

/// A step: where it starts, where it goes, and its time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step<'a> {
    pub(crate) start: &'a Point,
    pub(crate) goal: &'a Goal,
    pub(crate) time: f64,
    pub(crate) time_increment: f64,
}
