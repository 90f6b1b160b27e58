//! What a law makes of the stress it starts from.
//!
//! The stress that a law finds may lie outside what it can carry. Led through a nil increment, it
//! returns another stress at the same strain. That one is the state the group starts from; what it
//! leaves out of balance is the phase's to carry.

use super::PointFailure;
use crate::group::{Field, Group};
use law::Operator;

/// Change of stress, relative to the largest stress found, up to which a law is taken to have
/// returned what it found.
const ROUND_OFF: f64 = 1e-12;

/// Stresses that a law returned at the strain at which it found others.
#[derive(Clone, Debug, PartialEq)]
pub struct LawStart {
    /// Name of the group.
    pub group: String,
    /// Name of the law in the case file.
    pub law: String,
    /// Largest change of a stress (2-norm of its components).
    pub change: f64,
    /// The same, relative to the largest stress that the law found in the group; infinite where it found
    /// none.
    pub relative: f64,
    /// Points with another stress, and all of the group.
    pub points: [usize; 2],
    /// Element, from 1, and integration point within it, from 1, where the change is largest.
    pub place: [usize; 2],
    /// Coordinates of that point.
    pub position: [f64; 2],
    /// Normal and shear stress there, found and returned; `None` for solids.
    pub traction: Option<[[f64; 2]; 2]>,
    /// Stresses 11 and 22 there, in axes of the element, found and returned; of interfaces the traction.
    pub stress: [[f64; 2]; 2],
}

impl std::fmt::Display for LawStart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            group,
            law,
            change,
            relative,
            points: [points, all],
            place: [element, point],
            position: [x, y],
            traction,
            ..
        } = self;
        write!(f, "law `{law}` takes over group `{group}` with stresses ")?;
        if relative.is_finite() {
            let percent = 100.0 * relative;
            write!(f, "up to {percent:.3} % different from those it found")?;
        } else {
            write!(f, "where it found none")?;
        }
        write!(
            f,
            " ({change:.4} kPa at element {element}, point {point} at ({x:.4}, {y:.4})"
        )?;
        if let Some([[n_0, t_0], [n, t]]) = traction {
            write!(f, ": normal {n_0:.4} to {n:.4}, shear {t_0:.4} to {t:.4}")?;
        }
        write!(f, "; {points} of {all} points differ)")
    }
}

impl Group {
    /// Asks a law that starts what it makes of the stresses it finds, at the same strain and time,
    /// and makes that the committed state. `None`, and not a bit changed: they stay the same.
    ///
    /// Laws whose stress is linear in the strain are not asked, nor are points without stress unless the
    /// case gives internal variables to start from.
    ///
    /// # Errors
    /// The law fails over a nil increment. The committed state is untouched.
    pub fn take_over(&mut self) -> Result<Option<LawStart>, PointFailure> {
        let answered = std::mem::take(&mut self.is_asked);
        let has_stress = self.stress.committed.iter().any(|&stress| stress != 0.0);
        let is_told = has_stress || !self.law.initial.is_empty();
        let answer = if self.tangents.are_constant || !is_told {
            Ok(None)
        } else if answered {
            Ok(self.taken_over())
        } else {
            self.ask().map(|()| self.taken_over())
        };
        self.forget_trial();
        answer
    }

    /// Carries all points through a nil increment.
    fn ask(&mut self) -> Result<(), PointFailure> {
        let n = self.law.built.law.n_components();
        let room = self.kinematics.n_points() * n * n;
        let time = self.moment.step_start;
        let mut tangent = std::mem::take(&mut self.tangents.values);
        let result = self.run_law(Operator::None, (time, 0.0), &mut tangent[..room]);
        self.tangents.values = tangent;
        result.map(|_| ()).map_err(|failure| self.locate(&failure))
    }

    /// Makes stresses and internal variables of the trial state the committed ones if they differ
    /// by more than round-off.
    fn taken_over(&mut self) -> Option<LawStart> {
        if let Some(layer) = self.layer.as_ref().filter(|_| self.uses_layer()) {
            self.strain.trial.clone_from(&self.strain.committed);
            layer.stresses_along(&self.strain, &mut self.stress);
        }
        let n = self.kinematics.n_components();
        let Field { committed, trial } = &self.stress;
        let size = |stress: &[f64]| stress.iter().map(|s| s * s).sum::<f64>().sqrt();
        let largest = committed.chunks_exact(n).map(size).fold(0.0, f64::max);
        let changes = committed.chunks_exact(n).zip(trial.chunks_exact(n));
        let changes = changes.map(|(found, returned)| {
            let change = found.iter().zip(returned).map(|(a, b)| (b - a).powi(2));
            change.sum::<f64>().sqrt()
        });
        let changes: Vec<f64> = changes.collect();
        let is_other = |change: f64| change > ROUND_OFF * largest;
        let differ = changes.iter().filter(|&&change| is_other(change)).count();
        let most = (0..changes.len()).max_by(|&a, &b| changes[a].total_cmp(&changes[b]))?;
        if differ == 0 {
            return None;
        }
        let [_, normal, _, shear] = [0, 1, 2, 3].map(|c| if n == 2 { c / 2 } else { c });
        let pair = |field: &[f64]| [field[n * most + normal], field[n * most + shear]];
        let first = |field: &[f64]| [field[n * most], field[n * most + 1]];
        let stress = [first(committed), first(trial)];
        let has_facet = n == 2 || self.layer.is_some();
        let traction = has_facet.then(|| [pair(committed), pair(trial)]);
        let (element, within) = self.kinematics.place_of(most);
        let report = LawStart {
            group: self.name.clone(),
            law: self.law.name.clone(),
            change: changes[most],
            relative: changes[most] / largest,
            points: [differ, changes.len()],
            place: [element + 1, within + 1],
            position: self.kinematics.position(most),
            traction,
            stress,
        };
        self.stress.commit();
        self.internal.commit();
        Some(report)
    }
}
