//! The start of a phase: laws are swapped, and what they make of the stresses they find is taken
//! over; loads.

use super::{Simulation, Warning, Watch};
use crate::assembly::fold;
use crate::equilibrium::{Loads, StepFailure};
use crate::error::{Error, Place};
use crate::group::Group;
use crate::model::Model;
use law::Moment;

/// Change of stress, relative to the largest of its group, that is worth a word.
const WORTH_A_WORD: f64 = 1e-6;

impl Simulation {
    /// Starts a phase: its laws and its loads.
    pub(super) fn start(&mut self, number: usize, watch: &mut dyn Watch) -> Result<Loads, Error> {
        let mut starts = vec![number == 0; self.groups.len()];
        let moment = Moment {
            step: self.time as u32 + 1,
            increment: 1,
            step_start: self.time,
        };
        for (group, law) in self.swaps[number].clone() {
            starts[group] = true;
            self.groups[group].moment = moment;
            self.groups[group]
                .set_law(law)
                .map_err(|failure| Error::CannotStart(Box::new(failure)))?;
        }
        Model::check_layers(&self.groups)?;
        for group in (0..self.groups.len()).filter(|&group| starts[group]) {
            self.groups[group].moment = moment;
            self.ask_law(group, number, watch)?;
        }
        // The equations of the phase are set up in the room of trial states.
        self.groups.iter_mut().for_each(Group::forget_trial);
        let mut loads = self.loads(number);
        fold(&self.ties, &mut loads.force_start);
        fold(&self.ties, &mut loads.force_end);
        Ok(loads)
    }

    /// Takes over what the law of a group, which starts now, makes of the stresses it finds, and
    /// says how much that is. What it leaves out of balance is carried in the phase's course.
    ///
    /// A law that cannot be led through a nil increment is left as it is: it returns the stresses
    /// at the first increment.
    fn ask_law(&mut self, group: usize, number: usize, watch: &mut dyn Watch) -> Result<(), Error> {
        let phase = &self.problem.phases[number];
        let (name, n) = (phase.name.clone(), phase.increments);
        match self.groups[group].take_over() {
            Ok(None) => Ok(()),
            Ok(Some(change)) => {
                if change.relative > WORTH_A_WORD {
                    watch.warning(&Warning::TookOver(name, change));
                }
                Ok(())
            }
            Err(point) => {
                let failure = StepFailure::from(point);
                if failure.defect().is_some() {
                    let place = Place {
                        phase: name,
                        increment: 1,
                    };
                    return Err(self.cannot_go_on(&place, 0.0, n, failure));
                }
                watch.warning(&Warning::Unasked(name, failure.reason.to_string()));
                Ok(())
            }
        }
    }
}
