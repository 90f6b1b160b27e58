//! The path: segments, and how each component is led through them.

use crate::error::{Error, Misuse};
use crate::frame::Frame;
use crate::restrictions::Restrictions;
use crate::state::N_MAX;
use abi::Hypothesis;

/// Most increments of all segments together; a slip of the pen beyond.
pub const MAX_INCREMENTS: usize = 100_000_000;
/// Longest time of a segment.
pub(crate) const LONGEST: f64 = 1e20;
/// Number of the component 33.
const OUT_OF_PLANE: usize = 2;

/// How one component is led through a segment. Jumps in m, strains without unit (γ = 2ε), tractions
/// and stresses in kPa; opening and tension are positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Control {
    /// The flux stays what it is at the start of the segment.
    Keep,
    /// Gradient at the end of the segment.
    Gradient(f64),
    /// Flux at the end of the segment.
    Flux(f64),
    /// Interfaces: the flux changes by −stiffness × jump, kPa/m.
    Stiffness(f64),
    /// Change of the gradient over the segment.
    GradientBy(f64),
    /// Change of the flux over the segment.
    FluxBy(f64),
}

impl Control {
    /// Whether a component can be led so.
    ///
    /// # Errors
    /// What speaks against it.
    pub fn check(self, component: usize, hypothesis: Hypothesis) -> Result<(), Misuse> {
        let (Self::Gradient(value)
        | Self::Flux(value)
        | Self::Stiffness(value)
        | Self::GradientBy(value)
        | Self::FluxBy(value)) = self
        else {
            return plane(self, component, hypothesis);
        };
        if !value.is_finite() {
            return Err(Misuse::NotFinite(value));
        }
        if let Self::Stiffness(stiffness) = self {
            if !hypothesis.is_interface() {
                return Err(Misuse::StiffnessOfSolid);
            }
            if stiffness < 0.0 {
                return Err(Misuse::NegativeStiffness(stiffness));
            }
        }
        plane(self, component, hypothesis)
    }
}

/// In plane strain there is no strain out of the plane.
fn plane(control: Control, component: usize, hypothesis: Hypothesis) -> Result<(), Misuse> {
    let is_led = hypothesis == Hypothesis::PlaneStrain && component == OUT_OF_PLANE;
    let is_nil = |value: f64| value == 0.0;
    match control {
        Control::Gradient(value) | Control::GradientBy(value) if is_nil(value) => Ok(()),
        _ if is_led => Err(Misuse::OutOfPlane),
        _ => Ok(()),
    }
}

/// A stretch of the path in equal increments.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Number of increments, at least 1.
    pub increments: usize,
    /// How each component is led; those that the hypothesis does not have are left alone.
    pub control: [Control; N_MAX],
    /// Number of the step that it is part of, from 1, for laws that ask.
    pub step: u32,
    /// Increments of that step before it.
    pub first: usize,
    /// The kind of components; other than Cartesian ones in three dimensions only.
    pub frame: Frame,
    /// How long it takes; by default an increment takes one unit of time.
    pub time: Option<f64>,
    /// What holds in place of the controls, in three dimensions only.
    pub restrictions: Option<Restrictions>,
    /// Every how many increments of its step a row is for the table, 1 if all; the end of the step is in any case.
    pub every: usize,
}

impl Segment {
    /// A separate step with this many increments of one unit of time. Every component keeps its flux
    /// (in plane strain the strain 33 stays 0).
    pub fn new(hypothesis: Hypothesis, step: u32, increments: usize) -> Self {
        let mut control = [Control::Keep; N_MAX];
        if hypothesis == Hypothesis::PlaneStrain {
            control[OUT_OF_PLANE] = Control::Gradient(0.0);
        }
        Self {
            increments,
            control,
            step,
            first: 0,
            frame: Frame::Cartesian,
            time: None,
            restrictions: None,
            every: 1,
        }
    }

    /// How long it takes.
    pub fn length(&self) -> f64 {
        self.time.unwrap_or(self.increments as f64)
    }

    /// Leads a component, counted from 0 in the order of the hypothesis.
    ///
    /// # Panics
    /// There are no more than [`N_MAX`] components.
    #[must_use]
    pub fn lead(mut self, component: usize, control: Control) -> Self {
        self.control[component] = control;
        self
    }

    /// Whether a point can be led so.
    ///
    /// # Errors
    /// What speaks against it.
    pub fn check(&self, hypothesis: Hypothesis) -> Result<(), Misuse> {
        if self.increments == 0 {
            return Err(Misuse::Increments(0));
        }
        if let Some(time) = self.time.filter(|time| !(*time > 0.0 && *time <= LONGEST)) {
            return Err(Misuse::Time(time));
        }
        let is_plain = self.frame == Frame::Cartesian && self.restrictions.is_none();
        if !is_plain && hypothesis != Hypothesis::ThreeD {
            return Err(Misuse::ThreeDimensional);
        }
        if let Some(restrictions) = &self.restrictions {
            return check_restrictions(restrictions);
        }
        let controls = self.control.iter().take(hypothesis.n_components());
        controls
            .enumerate()
            .try_for_each(|(component, control)| control.check(component, hypothesis))
    }
}

fn check_restrictions(restrictions: &Restrictions) -> Result<(), Misuse> {
    let rows = restrictions.stress.iter().zip(&restrictions.strain);
    for (i, ((stress, strain), change)) in rows.zip(&restrictions.change).enumerate() {
        let mut values = stress.iter().chain(strain).chain([change]);
        if let Some(value) = values.find(|value| !value.is_finite()) {
            return Err(Misuse::NotFinite(*value));
        }
        if stress.iter().chain(strain).all(|factor| *factor == 0.0) {
            return Err(Misuse::NoRestriction(i + 1));
        }
    }
    Ok(())
}

/// Whether a point can be led along this path.
pub(crate) fn check(segments: &[Segment], hypothesis: Hypothesis) -> Result<(), Error> {
    if segments.is_empty() {
        return Err(Misuse::NoSegment.into());
    }
    let mut total = 0_usize;
    for (segment, number) in segments.iter().zip(1..) {
        total = total.saturating_add(segment.increments);
        let checked = if total > MAX_INCREMENTS {
            Err(Misuse::Increments(segment.increments))
        } else {
            segment.check(hypothesis)
        };
        checked.map_err(|misuse| Error::Misuse {
            segment: Some(number),
            misuse,
        })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(segments: &[Segment], hypothesis: Hypothesis) -> (Option<usize>, Misuse) {
        match check(segments, hypothesis) {
            Err(Error::Misuse { segment, misuse }) => (segment, misuse),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn paths_that_can_be_followed_are_taken() {
        for hypothesis in Hypothesis::ALL {
            let lead = Segment::new(hypothesis, 1, 10).lead(0, Control::Gradient(-0.01));
            let back = Segment::new(hypothesis, 2, 5).lead(0, Control::FluxBy(7.0));
            assert!(check(&[lead, back], hypothesis).is_ok());
        }
    }

    #[test]
    fn every_fault_is_said_with_its_segment() {
        let joint = Hypothesis::Interface2d;
        let (solid, plane) = (Hypothesis::ThreeD, Hypothesis::PlaneStrain);
        let new = |hypothesis| Segment::new(hypothesis, 1, 1);
        let led = |hypothesis, component, control| new(hypothesis).lead(component, control);
        assert_eq!(refused(&[], solid), (None, Misuse::NoSegment));
        let [mut roscoe, mut at_once, mut unrestricted] = [plane, solid, solid].map(new);
        roscoe.frame = Frame::Roscoe;
        at_once.time = Some(0.0);
        unrestricted.restrictions = Some(Restrictions::default());
        let cases = [
            (joint, Segment::new(joint, 1, 0), Misuse::Increments(0)),
            (joint, Segment::new(joint, 1, MAX_INCREMENTS), {
                Misuse::Increments(MAX_INCREMENTS)
            }),
            (joint, led(joint, 0, Control::Stiffness(-2.5)), {
                Misuse::NegativeStiffness(-2.5)
            }),
            (solid, led(solid, 0, Control::Stiffness(1.0)), {
                Misuse::StiffnessOfSolid
            }),
            (solid, led(solid, 5, Control::FluxBy(f64::INFINITY)), {
                Misuse::NotFinite(f64::INFINITY)
            }),
            (plane, led(plane, 2, Control::Gradient(1e-9)), {
                Misuse::OutOfPlane
            }),
            (plane, led(plane, 2, Control::Keep), Misuse::OutOfPlane),
            (plane, roscoe, Misuse::ThreeDimensional),
            (solid, at_once, Misuse::Time(0.0)),
            (solid, unrestricted, Misuse::NoRestriction(1)),
        ];
        for (hypothesis, segment, misuse) in cases {
            let found = refused(&[new(hypothesis), segment], hypothesis);
            assert_eq!(found, (Some(2), misuse));
        }
    }
}
