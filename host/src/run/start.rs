//! The start of a phase: laws are swapped, and what they make of the stresses they find is taken
//! over; loads.

use super::{Noting, Observer, Run};
use crate::assembly::fold;
use crate::case::PhaseInput;
use crate::error::{Error, Place};
use crate::group::Group;
use crate::model::{Model, cannot_start};
use crate::output::Results;
use crate::plugin::Moment;
use crate::solver::{Loads, StepFailure};

/// Change of stress, relative to the largest of its group, that is worth a word.
const WORTH_A_WORD: f64 = 1e-6;

impl Run<'_> {
    /// Begins a phase: its laws and its loads.
    pub(super) fn begin(
        &mut self,
        number: usize,
        phase: &PhaseInput,
        results: &Results,
        observer: &mut Noting<'_>,
    ) -> Result<Loads, Error> {
        let mut starts = vec![number == 0; self.groups.len()];
        let moment = Moment {
            step: self.time as u32 + 1,
            increment: 1,
            step_start: self.time,
        };
        for (group, law) in self.model.swaps[number].clone() {
            starts[group] = true;
            self.groups[group].moment = moment;
            self.groups[group]
                .set_law(law)
                .map_err(|failure| cannot_start(&self.case.source, self.file(), &failure))?;
        }
        Model::check_layers(self.case, &self.groups)?;
        for group in (0..self.groups.len()).filter(|&group| starts[group]) {
            self.groups[group].moment = moment;
            self.ask_law(group, phase, results, observer)?;
        }
        // The equations of the phase are set up in the room of trial states.
        self.groups.iter_mut().for_each(Group::forget_trial);
        let mut loads = self.loads(phase);
        fold(&self.model.ties, &mut loads.force_start);
        fold(&self.model.ties, &mut loads.force_end);
        Ok(loads)
    }

    /// Takes over what the law of a group, which starts now, makes of the stresses it finds, and
    /// says how much that is. What it leaves out of balance is carried in the phase's course.
    ///
    /// A law that cannot be led through a nil increment is left as it is: it returns the stresses
    /// at the first increment.
    fn ask_law(
        &mut self,
        group: usize,
        phase: &PhaseInput,
        results: &Results,
        observer: &mut Noting<'_>,
    ) -> Result<(), Error> {
        let name = phase.name.get_ref();
        match self.groups[group].take_over() {
            Ok(None) => Ok(()),
            Ok(Some(change)) => {
                if change.relative > WORTH_A_WORD {
                    observer.warning(&format!(
                        "phase `{name}`: {change}, carried to equilibrium in the phase's course"
                    ));
                }
                Ok(())
            }
            Err(point) => {
                let failure = StepFailure::of_law(point);
                if failure.defect.is_some() {
                    let place = Place {
                        phase: name.clone(),
                        increment: 1,
                    };
                    let n = *phase.increments.get_ref();
                    return Err(self.cannot_go_on(&place, 0.0, n, &failure, results)?);
                }
                observer.warning(&format!(
                    "phase `{name}`: {}\n  over a nil increment, so that what the law makes of the \
                     stresses it finds comes in the first increment, unannounced",
                    failure.reason
                ));
                Ok(())
            }
        }
    }
}
