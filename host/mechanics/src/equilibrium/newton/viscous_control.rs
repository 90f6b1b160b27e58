//! Viscous control: from a step that Newton iterations cannot finish to an equilibrium, on the path of a body that
//! comes to rest.
//!
//! As in [viscous relaxation](super::viscous_relaxation) a real body's motion to the next stable equilibrium is followed where
//! no branch of equilibria continues. Relaxation repeats one increment from the last equilibrium; here the motion is a
//! path. The stress of the law gets an additional overstress of Duvaut–Lions type (G. Duvaut, J. L. Lions 1972; J. C.
//! Simo, J. G. Kennedy, S. Govindjee, Int. J. Numer. Meth. Engng 26, 1988),
//!
//!   σ = σ_law + s, ṡ = D_e ε̇ − σ̇_law − s/τ,
//!
//! whose nodal forces are the residual r of σ_law. With α = τ/Δt an implicit step of time Δt from the committed state
//! is
//!
//!   r(Δu) = α (K_e Δu − Δf),    tangent K + α K_e,
//!
//! with the step's change Δf of the forces in the first viscous step and zero afterwards, while the body comes to rest.
//! Every viscous step is solved and **its state committed**: laws see the path of a viscous body to its equilibrium.
//! Let θ be the angle between yield and flow in energy. Above α = (1/cos θ − 1)/2 a step's matrix is positive definite
//! and its solution unique. If a viscous step is linear, nothing yields or unloads any more, and α falls, finally to
//! zero: a Newton correction. The same tolerances decide. The accepted state is an equilibrium of the laws alone,
//! without overstress.
//!
//! If a point loses its traction by breaking, a viscous step may have no solution. Intact, the point opens. Open, the
//! force it no longer carries moves the body so that it closes; its law sees one increment from the start of the
//! viscous step and finds it intact. Iterations alternate between both, with any viscosity and however short the step.
//! A real point stays broken. So as the last resort each viscous step is **one correction**, and its state is committed
//! whatever the residual. Broken points stay broken, the residual drives the next step, and α follows it as in viscous
//! relaxation.

use super::failure::{Iterations, Reason, StepFailure};
use super::outcome::Iteration;
use super::residual::{Balance, Task};
use super::viscous_relaxation::{follows, stands_still};
use super::{Newton, norm};
use crate::assembly::norms;
use crate::settings::{Control, Settings};
use law::Operator;

/// α at first, and where states change. The chambers with Mohr–Coulomb sand and the bored pile settle
/// with it; a quarter of it leads the pile to other equilibria, with more dilation.
const VISCOSITY: f64 = 0.05;
/// Largest α.
const MOST: f64 = 1.0;
/// Factor by which α grows where a viscous step is hard, and where it found no answer.
const HARD: f64 = 2.0;
const FAILED: f64 = 3.0;
/// Corrections of a viscous step that are many, and those that are too many; with less than the first viscosity.
const MANY: usize = 3;
const TOO_MANY: usize = 8;
const FEW: usize = 3;
/// Residual of the equation of a viscous step, relative to the residual of the laws or to the force
/// tolerance.
const INNER: f64 = 0.1;
const NEGLIGIBLE: f64 = 0.3;
/// If one correction was enough, α falls by the factor; if it is then below its first value, a harder viscous step is
/// repeated with a larger one.
const FALLS: f64 = 0.3;
/// α below this counts as none.
const LEAST: f64 = 1e-3;
/// Viscous steps of one motion, and how many without the residual falling to half end it.
const MAX_STEPS: usize = 200;
const IDLE: usize = 40;
/// The same of single corrections: every point that breaks raises the residual.
const IDLE_SINGLY: usize = 120;
/// Lengths of a correction that are tried.
const LENGTHS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];
/// After a motion of more viscous steps, the next step probably needs one too.
const SHORT: usize = 3;

/// Statistics of viscous control in a step.
#[derive(Debug)]
pub(super) struct ViscousControl {
    course: Course,
    /// The last step was a motion: this one begins with it.
    is_expected: bool,
    /// Where the last series of Newton iterations starts.
    first: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Course {
    /// The settings want none.
    Off,
    /// Newton iterations have not come to a standstill yet.
    Ready,
    /// It led to the present state, in this many viscous steps.
    Arrived(usize),
    /// It led nowhere. Newton iterations had to go on alone.
    InVain,
}

/// A motion: where it is, relative to the last viscous step.
#[derive(Debug)]
struct Motion {
    /// Elastic stiffness, in the matrix's pattern; without the domain.
    elastic: Vec<f64>,
    /// K_e of the prescribed displacements less Δf, by equation; nil after the first viscous step.
    given: Vec<f64>,
    /// Displacement increments of the step up to the last viscous step, by place; none in the first
    /// one.
    from: Vec<f64>,
    /// Those reached.
    increment: Vec<f64>,
    viscosity: f64,
}

/// How a viscous step went.
#[derive(Clone, Copy, Debug, Default)]
struct Went {
    corrections: usize,
    /// A correction was shortened.
    is_cut: bool,
    /// It found its answer with another viscosity only.
    is_repeated: bool,
}

impl ViscousControl {
    /// The outcome of a step to a given load factor, after a motion or not.
    pub(super) fn new(settings: &Settings, is_expected: bool) -> Self {
        // Methods that keep their matrix are slow without having come to an end.
        let is_wanted = settings.control == Control::Viscous && settings.method.is_newton();
        Self {
            course: if is_wanted {
                Course::Ready
            } else {
                Course::Off
            },
            is_expected,
            first: 0,
        }
    }

    /// The last series of Newton iterations, with the state that it started from.
    pub(super) fn series<'i>(&self, iterations: &'i [Iteration]) -> &'i [Iteration] {
        iterations.get(self.first..).unwrap_or_default()
    }

    /// Newton iterations start from this one: those before it had another matrix.
    pub(super) fn starts_at(&mut self, iteration: usize) {
        self.first = iteration;
    }

    /// Whether it may be asked for.
    pub(super) fn is_wanted(&self) -> bool {
        self.course != Course::Off
    }

    /// Whether it led to the present state, which is an equilibrium.
    pub(super) fn has_arrived(&self) -> bool {
        matches!(self.course, Course::Arrived(_))
    }

    /// Whether the next step should begin with it.
    pub(super) fn lets_expect_another(&self) -> bool {
        matches!(self.course, Course::Arrived(steps) if steps > SHORT)
    }

    /// Whether it was tried and led nowhere.
    pub(super) fn was_in_vain(&self) -> bool {
        self.course == Course::InVain
    }

    /// Whether it may lead away from a state that no correction can be computed for.
    pub(super) fn is_at_hand(&self) -> bool {
        self.course == Course::Ready
    }

    /// Whether Newton iterations have come to a standstill, or to a state that no correction can be computed for
    /// (`is_singular`), and where they led a motion is still to be tried.
    pub(super) fn is_due(&self, iterations: &[Iteration], is_singular: bool) -> bool {
        let series = self.series(iterations);
        let is_expected = self.is_expected && series.len() == 1;
        self.is_at_hand() && (is_singular || is_expected || stands_still(series))
    }

    /// The equilibrium that a motion leads to; `None` if it leads to none: then the state is that at the
    /// start of the step again, and the remaining Newton iterations may go on.
    ///
    /// # Errors
    /// The step is stopped.
    pub(super) fn relieve(
        &mut self,
        newton: &mut Newton<'_>,
        task: &Task,
        first: Option<&[f64]>,
        iterations: &mut Vec<Iteration>,
    ) -> Result<Option<(Vec<f64>, Balance)>, StepFailure> {
        let so_many = iterations.len();
        let committed = newton.committed();
        if let Ok((steps, increment, balance)) =
            newton.follow_viscous_motion(task, first, iterations)
        {
            self.course = Course::Arrived(steps);
            return Ok(Some((increment, balance)));
        }
        newton.restore(committed);
        newton.may_go_on()?;
        self.course = Course::InVain;
        self.first = iterations.len() - so_many;
        Ok(None)
    }
}

impl Newton<'_> {
    /// The motion from the state at the start of the step to an equilibrium under its end's loads:
    /// how many viscous steps it took, and where it leads. The first one is answered starting from
    /// `guess`, or from elasticity. The states of all but the last one are committed.
    ///
    /// # Errors
    /// The residual did not fall, or a law or the equations failed.
    fn follow_viscous_motion(
        &mut self,
        task: &Task,
        guess: Option<&[f64]>,
        iterations: &mut Vec<Iteration>,
    ) -> Result<(usize, Vec<f64>, Balance), StepFailure> {
        let mut motion = self.start_viscous_motion(task, guess)?;
        let mut balance = self.evaluate(&motion.increment, task, Operator::Consistent)?;
        let mut residuals: Vec<f64> = Vec::new();
        for step in 1..=MAX_STEPS {
            let before = balance.relative;
            let went = if self.takes_single_corrections {
                self.single_correction(&mut motion, &mut balance, task, iterations)?;
                None
            } else {
                Some(self.viscous_step(&mut motion, &mut balance, task, iterations)?)
            };
            residuals.push(balance.relative);
            let ratio = if step == 1 {
                1.0
            } else {
                balance.relative / before
            };
            if self.has_come_to_rest(&motion, &balance, ratio) {
                // Nothing of K + α K_e is left to the steps that follow.
                self.matrix.held = false;
                return Ok((step, motion.increment, balance));
            }
            let idle = if self.takes_single_corrections {
                IDLE_SINGLY
            } else {
                IDLE
            };
            let idle = residuals.len().checked_sub(idle + 1);
            if idle.is_some_and(|idle| balance.relative > 0.5 * residuals[idle]) {
                break;
            }
            if step < MAX_STEPS {
                // The first viscous step takes the time of the step.
                let (start, length) = task.period;
                self.commit(&motion.increment, (start + length, 0.0));
                motion.from.clone_from(&motion.increment);
                motion.given.fill(0.0);
                match went {
                    Some(went) => motion.go_on(&went),
                    None => motion.follow(balance.relative / before),
                }
            }
        }
        let correction = iterations.last().and_then(|last| last.correction);
        let unmet = self.unmet(&balance, correction);
        Err(Reason::Unmet(Iterations::Relaxation(residuals.len()), unmet).into())
    }

    /// The motion before its first viscous step.
    ///
    /// # Errors
    /// A law has no elastic operator, or elasticity alone leaves the equations singular.
    fn start_viscous_motion(
        &mut self,
        task: &Task,
        guess: Option<&[f64]>,
    ) -> Result<Motion, StepFailure> {
        let still = vec![0.0; task.external.len()];
        let before = self.evaluate(&still, task, Operator::Elastic)?;
        let elastic = self.stiffness().to_vec();
        let coupling = self.coupling(&task.prescribed);
        let pairs = coupling.iter().zip(&before.residual);
        let given = pairs.map(|(coupling, change)| coupling - change).collect();
        let increment = if let Some(guess) = guess {
            guess.to_vec()
        } else {
            self.factorise(elastic.clone())?;
            self.answer_to(&before.residual, task)?
        };
        Ok(Motion {
            elastic,
            given,
            from: still,
            increment,
            viscosity: VISCOSITY,
        })
    }

    /// One correction of a viscous step, whatever it leaves.
    ///
    /// # Errors
    /// A law or the equations failed.
    fn single_correction(
        &mut self,
        motion: &mut Motion,
        balance: &mut Balance,
        task: &Task,
        iterations: &mut Vec<Iteration>,
    ) -> Result<(), StepFailure> {
        self.may_go_on()?;
        let residual = self.viscous_residual(motion, &motion.increment, balance);
        let correction = self.viscous_correction(&residual, (motion.viscosity, &motion.elastic))?;
        motion.increment = moved(&motion.increment, 1.0, &correction);
        *balance = self.evaluate(&motion.increment, task, Operator::Consistent)?;
        let taken = self.took_to(balance, &correction, &motion.increment, 1.0);
        iterations.push(Iteration {
            viscosity: motion.viscosity,
            ..taken
        });
        Ok(())
    }

    /// Solves one viscous step, with a larger viscosity where that of the motion leads to no answer.
    ///
    /// # Errors
    /// None does, or a law or the equations failed.
    fn viscous_step(
        &mut self,
        motion: &mut Motion,
        balance: &mut Balance,
        task: &Task,
        iterations: &mut Vec<Iteration>,
    ) -> Result<Went, StepFailure> {
        let start = motion.increment.clone();
        let mut is_repeated = false;
        loop {
            let went = self.try_viscous_step(motion, balance, task, iterations);
            match went {
                Ok(Some(went)) => {
                    return Ok(Went {
                        is_repeated,
                        ..went
                    });
                }
                Err(failure) if failure.is_stop() || motion.viscosity >= MOST => {
                    return Err(failure);
                }
                Ok(None) if motion.viscosity >= MOST => {
                    let unmet = self.unmet(balance, None);
                    return Err(Reason::Unmet(Iterations::Relaxation(TOO_MANY), unmet).into());
                }
                _ => {
                    is_repeated = true;
                    motion.viscosity = (FAILED * motion.viscosity).clamp(LEAST, MOST);
                    motion.increment.clone_from(&start);
                    *balance = self.evaluate(&start, task, Operator::Consistent)?;
                }
            }
        }
    }

    /// The same with this viscosity; `None` if it leads to no answer.
    fn try_viscous_step(
        &mut self,
        motion: &mut Motion,
        balance: &mut Balance,
        task: &Task,
        iterations: &mut Vec<Iteration>,
    ) -> Result<Option<Went>, StepFailure> {
        let mut went = Went::default();
        let most = if motion.viscosity < VISCOSITY {
            FEW
        } else {
            TOO_MANY
        };
        let mut residual = self.viscous_residual(motion, &motion.increment, balance);
        while went.corrections < most {
            self.may_go_on()?;
            went.corrections += 1;
            let correction =
                self.viscous_correction(&residual, (motion.viscosity, &motion.elastic))?;
            let size = norm(&residual);
            for length in LENGTHS {
                let next = moved(&motion.increment, length, &correction);
                let at = self.evaluate(&next, task, Operator::Consistent)?;
                residual = self.viscous_residual(motion, &next, &at);
                // The shortest is taken whatever it leaves.
                if norm(&residual) < size || length <= LENGTHS[LENGTHS.len() - 1] {
                    went.is_cut |= length < 1.0;
                    if went.is_cut && motion.viscosity < VISCOSITY {
                        return Ok(None);
                    }
                    let taken = self.took_to(&at, &correction, &next, length);
                    iterations.push(Iteration {
                        viscosity: motion.viscosity,
                        ..taken
                    });
                    motion.increment = next;
                    *balance = at;
                    break;
                }
            }
            let is_negligible = || {
                let share = self.relative(&residual, &balance.scales);
                share <= NEGLIGIBLE * self.settings.force_tolerance
            };
            if norm(&residual) <= INNER * norm(&balance.residual) || is_negligible() {
                return Ok(Some(went));
            }
        }
        Ok(None)
    }

    /// r − α (K_e Δu − Δf), by equation.
    fn viscous_residual(&self, motion: &Motion, increment: &[f64], balance: &Balance) -> Vec<f64> {
        let moved: Vec<f64> = increment
            .iter()
            .zip(&motion.from)
            .map(|(u, u_0)| u - u_0)
            .collect();
        let forces = self.elastic_forces(&motion.elastic, &moved);
        let sums = forces.iter().zip(&motion.given);
        let pairs = balance.residual.iter().zip(sums);
        pairs
            .map(|(r, (force, given))| r - motion.viscosity * (force + given))
            .collect()
    }

    /// K_e of displacements of the free places, by equation; with the domain.
    fn elastic_forces(&self, elastic: &[f64], moved: &[f64]) -> Vec<f64> {
        let pattern = &self.system.pattern;
        let mut by_place = vec![0.0; moved.len()];
        if let Some(domain) = self.domain {
            let boundary = &self.places.boundary;
            let moved: Vec<f64> = boundary.iter().map(|&place| moved[place]).collect();
            let mut forces = vec![0.0; boundary.len()];
            domain.add_product(&moved, &mut forces);
            for (&place, force) in boundary.iter().zip(forces) {
                by_place[place] = force;
            }
        }
        let free = &self.places.free;
        let moved: Vec<f64> = free.iter().map(|&place| moved[place]).collect();
        let mut forces = pattern.multiply(elastic, &moved);
        for (force, &place) in forces.iter_mut().zip(free) {
            *force += by_place[place];
        }
        forces
    }

    /// Whether a viscous step ends in equilibrium: by the residual, and by what is left of the way if
    /// residuals go on falling in this ratio.
    fn has_come_to_rest(&self, motion: &Motion, balance: &Balance, ratio: f64) -> bool {
        let moved = moved(&motion.increment, -1.0, &motion.from);
        let left = if motion.viscosity > 0.0 {
            ratio / (1.0 - ratio).max(f64::MIN_POSITIVE)
        } else {
            1.0
        };
        let way = left * norm(&moved);
        balance.relative <= self.settings.force_tolerance
            && !balance.away.contains(&true)
            && (self.settings.displacement_tolerance.is_infinite()
                || way <= self.settings.displacement_tolerance * norm(&motion.increment))
    }

    /// A residual by equation relative to these forces by body.
    fn relative(&self, residual: &[f64], scales: &[f64]) -> f64 {
        let bodies = &self.places.bodies;
        let sizes = norms(&bodies.of_equation, bodies.n, residual);
        let pairs = sizes.iter().zip(scales);
        pairs.fold(0.0, |largest, (size, &scale)| {
            if scale > 0.0 {
                largest.max(size / scale)
            } else {
                largest
            }
        })
    }
}

impl Motion {
    /// The viscosity of the next single correction, after one that changed the residual in this ratio: at least a
    /// little where it grew.
    fn follow(&mut self, ratio: f64) {
        let now = if ratio > 1.0 {
            self.viscosity.max(LEAST)
        } else {
            self.viscosity
        };
        let next = follows(ratio) * now;
        self.viscosity = if next < LEAST { 0.0 } else { next.min(MOST) };
    }

    /// The viscosity of the next viscous step, after one that went like this.
    fn go_on(&mut self, went: &Went) {
        self.viscosity = if went.is_cut || went.corrections > MANY {
            (HARD * self.viscosity).clamp(VISCOSITY, MOST)
        } else if went.corrections == 1 && !went.is_repeated {
            let less = FALLS * self.viscosity;
            if less < LEAST { 0.0 } else { less }
        } else if self.viscosity < VISCOSITY {
            self.viscosity
        } else {
            (self.viscosity / HARD).max(VISCOSITY)
        };
    }
}

/// u + length d.
fn moved(u: &[f64], length: f64, d: &[f64]) -> Vec<f64> {
    u.iter().zip(d).map(|(u, d)| u + length * d).collect()
}
