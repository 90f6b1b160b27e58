//! What a simulation should tell those who started it.

use super::Neighbour;
use crate::equilibrium::Open;
use crate::error::Place;
use crate::group::{BrokenBond, GroupSplit, LawStart, Notice};
use crate::problem::Until;
use law::TimeDependence;
use std::fmt;

/// Something that should be known of a simulation under way.
#[derive(Clone, Debug, PartialEq)]
pub enum Warning {
    /// Messages of a law besides its results.
    Note(String),
    /// A phase starts out of balance, by this share of the forces in play.
    OutOfBalance(String, f64),
    /// The tangents of a law are differences, since it calls its own approximate.
    Approximate(String),
    /// The tangents of a law are not the derivatives of its stresses.
    NoDerivative {
        /// The group.
        group: String,
        /// The law.
        law: String,
        /// By how much, and what follows.
        notice: Notice,
    },
    /// A law depends on the time, and a phase says none.
    NoTime {
        /// The phase.
        phase: String,
        /// Name of the law in the problem.
        law: String,
        /// Why it does.
        by: TimeDependence,
    },
    /// The quantity that may end a phase has not reached its value, but this.
    NotReached {
        /// The phase.
        phase: String,
        /// What was asked for.
        until: Until,
        /// The last value; NaN where there is none.
        last: f64,
    },
    /// The tolerance of the residual is below round-off.
    RoundOff {
        /// The phase.
        phase: String,
        /// What was asked for.
        asked: f64,
        /// The rest.
        left: f64,
    },
    /// The residual is within its tolerance, and round-off; corrections are above theirs.
    Unsettled {
        /// The phase.
        phase: String,
        /// What was asked for.
        asked: f64,
        /// The largest last correction, relative to its increment.
        left: f64,
    },
    /// Viscous relaxation led to the equilibrium of this increment, the first one of its phase; where another way leads.
    Relaxed(Place, Option<Neighbour>),
    /// The same of regularised corrections.
    Regularised(Place, Option<Neighbour>),
    /// Steps of an increment were cut back; where two halves of a shorter one lead, the first of its phase that lead
    /// elsewhere.
    CutBack(Place, Neighbour),
    /// Viscous control, which the settings ask for, did so.
    Viscous(Place),
    /// Nodes that stand apart move alike, and are prescribed to be at one place.
    LedTogether {
        /// The phase.
        phase: String,
        /// How far they stand apart, m.
        by: f64,
        /// One of them.
        at: [f64; 2],
    },
    /// Motions did so in several steps of a phase.
    RelaxedOften {
        /// The phase.
        phase: String,
        /// Steps with viscous relaxation.
        relaxed: usize,
        /// Steps under viscous control.
        viscous: usize,
        /// Steps with regularised corrections.
        regularised: usize,
    },
    /// Number of steps of a phase with tolerated residuals.
    ToleratedOften {
        /// The phase.
        phase: String,
        /// How many.
        steps: usize,
        /// The largest of them, relative.
        largest: f64,
        /// The same as a force: 2-norm over the nodes of a body.
        force: f64,
    },
    /// Iterations came to a standstill above the tolerance; the residual is tolerated. Said of the first
    /// time in a phase.
    Tolerated {
        /// The increment.
        place: Place,
        /// The relative residual.
        residual: f64,
        /// The same as a force: 2-norm over the nodes of a body.
        force: f64,
        /// The tolerance.
        tolerance: f64,
    },
    /// Number of steps of a phase in which the residual alone decided.
    ByForce {
        /// The phase.
        phase: String,
        /// How many.
        steps: usize,
        /// The most that they left open.
        open: Open,
    },
    /// A law changed the process, which was set right.
    Restored(Place, String),
    /// A law starts in this phase where an interface is open.
    GroupSplit(String, GroupSplit),
    /// What a law, which starts in this phase, makes of the stresses it finds.
    TookOver(String, LawStart),
    /// A law could not be asked that; this is what it says.
    Unasked(String, String),
    /// Steps of the load found no equilibrium: viscous control leads from here on.
    TurnedViscous(Place),
    /// Nothing else found an equilibrium either: viscous control leads by single corrections from here on.
    SingleCorrections(Place),
    /// The path of equilibrium was followed, from one load factor, between two others.
    FollowedPath {
        /// The increment.
        place: Place,
        /// Load factor of the phase from which the load could not simply rise.
        from: f64,
        /// Lowest and highest load factor on the path.
        range: [f64; 2],
    },
    /// A bond that the first tension breaks began without normal stress, and has opened.
    BrokenBond(Place, BrokenBond),
}

impl Warning {
    /// Whether it is enough to say this once, however often it comes.
    pub fn is_said_once(&self) -> bool {
        matches!(self, Self::Approximate(_))
    }
}

const APPROXIMATE: &str =
    "declares its tangents approximate: differences of its stresses replace them";
const NO_DERIVATIVES: &str = "are not the derivatives of its stresses";
const NO_TIME: &str = "depends on time: the phase takes 1 unit of time";
const GRADUALLY: &str = "applied gradually over the phase";
const UNASKED: &str = "when the law is called with zero strain. Whether it changes the stresses it takes over is \
                       unknown; any change comes in the first increment";
const VISCOUS: &str = "Newton iterations stalled; viscous control found the next equilibrium";
const TURNED_VISCOUS: &str = "even short load steps found no equilibrium; the rest of the increment is computed under \
                              viscous control";

/// Single corrections are tried.
const SINGLY: &str = "steps found no equilibrium where bonds may break; viscous control goes on by single corrections, \
                      and bonds that break stay broken. Which bonds break can depend on the step size: compare with a run with more \
                      increments";

/// Advice after viscous control.
const COMPARE: &str =
    "Plastic strains from this path stay in the result: compare with a run with more increments";

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Note(note) => write!(f, "{note}"),
            Self::OutOfBalance(phase, share) => out_of_balance(f, phase, *share),
            Self::BrokenBond(place, torn) => write!(f, "{place}: {torn}"),
            Self::Approximate(law) => write!(f, "law `{law}` {APPROXIMATE}"),
            Self::NoDerivative { group, law, notice } => {
                write!(
                    f,
                    "group `{group}`: the tangents of law `{law}` {NO_DERIVATIVES}, {notice}"
                )
            }
            Self::NoTime { phase, law, by } => {
                write!(
                    f,
                    "phase `{phase}` has no `time`, and law `{law}`{by} {NO_TIME}"
                )
            }
            Self::NotReached { phase, until, last } => not_reached(f, phase, until, *last),
            Self::RoundOff { phase, asked, left } => write!(
                f,
                "phase `{phase}`: `force_tolerance` {asked:.1e} is below round-off: the residual stays at {left:.1e}, the last \
                 bit of the displacements"
            ),
            Self::Relaxed(place, other) => stalled(f, place, "viscous relaxation", *other),
            Self::Regularised(place, other) => stalled(f, place, "regularised corrections", *other),
            Self::CutBack(place, in_halves) => cut_back(f, place, *in_halves),
            Self::Unsettled { phase, asked, left } => unsettled(f, phase, [*asked, *left]),
            Self::Viscous(place) => write!(f, "{place}: {VISCOUS}. {COMPARE}"),
            Self::RelaxedOften {
                phase,
                relaxed,
                viscous,
                regularised,
            } => motions(f, phase, [*relaxed, *viscous, *regularised]),
            Self::ToleratedOften {
                phase,
                steps,
                largest,
                force,
            } => write!(
                f,
                "phase `{phase}`: {steps} steps have a tolerated residual, at most {force:.1e} kN ({largest:.1e})"
            ),
            Self::Tolerated {
                place,
                residual,
                force,
                tolerance,
            } => tolerated(f, place, [*residual, *force, *tolerance]),
            Self::ByForce { phase, steps, open } => by_force(f, phase, *steps, open),
            Self::LedTogether { phase, by, at } => led_together(f, phase, *by, *at),
            Self::Restored(place, change) => write!(f, "{place}: {change}"),
            Self::GroupSplit(phase, parted) => write!(f, "phase `{phase}`: {parted}"),
            Self::TookOver(phase, change) => write!(f, "phase `{phase}`: {change}, {GRADUALLY}"),
            Self::Unasked(phase, reason) => write!(f, "phase `{phase}`: {reason}\n  {UNASKED}"),
            Self::TurnedViscous(place) => write!(f, "{place}: {TURNED_VISCOUS}. {COMPARE}"),
            Self::SingleCorrections(place) => write!(f, "{place}: {SINGLY}"),
            Self::FollowedPath { place, from, range } => followed(f, place, *from, *range),
        }
    }
}

fn led_together(f: &mut fmt::Formatter<'_>, phase: &str, by: f64, [x, y]: [f64; 2]) -> fmt::Result {
    write!(
        f,
        "phase `{phase}`: nodes that are now tied together, one at ({x:.4}, {y:.4}), had displacements {by:.3e} m apart. The \
         prescribed `displacement` removes this difference, which strains the body; `reset_displacements = \
         true` in this phase avoids it"
    )
}

fn followed(
    f: &mut fmt::Formatter<'_>,
    place: &Place,
    from: f64,
    [lowest, highest]: [f64; 2],
) -> fmt::Result {
    write!(
        f,
        "{place}: from {from:.4} of the phase on, no equilibrium is near at a higher load; arc length followed the \
         path between {lowest:.4} and {highest:.4} (path.csv)"
    )
}

fn not_reached(
    f: &mut fmt::Formatter<'_>,
    phase: &str,
    Until { quantity, reaches }: &Until,
    value: f64,
) -> fmt::Result {
    write!(
        f,
        "phase `{phase}`: `{quantity}` has not reached {reaches}, and the phase has come to its end"
    )?;
    if value.is_nan() {
        Ok(())
    } else {
        write!(f, ": it is {value:.6}")
    }
}

fn unsettled(f: &mut fmt::Formatter<'_>, phase: &str, [tolerance, left]: [f64; 2]) -> fmt::Result {
    write!(
        f,
        "phase `{phase}`: `displacement_tolerance` {tolerance:.1e} is below round-off: residuals are within their \
         tolerance, and what is left of them is the last bit of the displacements; last corrections are up to \
         {left:.1e} of the increment"
    )
}

fn tolerated(
    f: &mut fmt::Formatter<'_>,
    place: &Place,
    [residual, force, tolerance]: [f64; 3],
) -> fmt::Result {
    const UNCERTAIN: &str = "Displacements are uncertain by up to a tenth of the increment";
    if residual <= tolerance {
        return write!(
            f,
            "{place}: iterations stalled; the residual, {residual:.1e}, is within its tolerance, but corrections stay above \
             `displacement_tolerance`. {UNCERTAIN}"
        );
    }
    write!(
        f,
        "{place}: iterations stalled at a residual of {residual:.1e} (tolerance {tolerance:.1e}), which `tolerated_residual` \
         accepts: {force:.1e} kN are out of balance (2-norm over the nodes). Compare this force with your loads. {UNCERTAIN}"
    )
}

fn by_force(f: &mut fmt::Formatter<'_>, phase: &str, steps: usize, open: &Open) -> fmt::Result {
    write!(
        f,
        "phase `{phase}`: {steps} steps are in equilibrium by forces alone, with residuals of at most {:.1e} of the forces in \
         play, {:.1e} kN (2-norm over the nodes). Loads are known to that force. Last corrections are at most {:.1e} of the \
         increment; at most {} nodes exceed the tolerance",
        open.residual, open.force, open.correction, open.nodes
    )
}

fn motions(f: &mut fmt::Formatter<'_>, phase: &str, steps_by: [usize; 3]) -> fmt::Result {
    let steps = |n: usize| match n {
        1 => "1 step".to_owned(),
        n => format!("{n} steps"),
    };
    let ways = [
        "viscous relaxation",
        "viscous control",
        "regularised corrections",
    ];
    let told: Vec<String> = (ways.iter().zip(steps_by))
        .filter(|(_, n)| *n > 0)
        .map(|(by, n)| format!("{by} found the equilibrium of {}", steps(n)))
        .collect();
    write!(f, "phase `{phase}`: {}", told.join(", "))
}

fn out_of_balance(f: &mut fmt::Formatter<'_>, phase: &str, share: f64) -> fmt::Result {
    write!(
        f,
        "phase `{phase}` starts out of balance by {} % of the forces in play: stresses at its start do not fit weight and \
         loads, and the ground deforms. Check `surcharge`, `initial_stress` and swapped laws",
        if share < 1e-4 {
            format!("{:.1e}", 100.0 * share)
        } else {
            format!("{:.2}", 100.0 * share)
        }
    )
}

fn cut_back(f: &mut fmt::Formatter<'_>, place: &Place, in_halves: Neighbour) -> fmt::Result {
    write!(
        f,
        "{place}: results depend on the step size. The same step in two halves "
    )?;
    match in_halves {
        Neighbour::Apart { .. } => write!(f, "differs by {}", in_halves.distance())?,
        Neighbour::None => write!(f, "finds no equilibrium")?,
    }
    write!(f, ". Compare with a run with more increments")
}

fn stalled(
    f: &mut fmt::Formatter<'_>,
    place: &Place,
    way: &str,
    by_viscous_control: Option<Neighbour>,
) -> fmt::Result {
    let found = format!("Newton iterations stalled; {way} found");
    match by_viscous_control {
        Some(Neighbour::Apart {
            displacements,
            forces,
            ..
        }) if by_viscous_control.is_some_and(Neighbour::is_the_same) => {
            return write!(
                f,
                "{place}: {found} the next equilibrium, which is unique to {:.1e}",
                displacements.max(forces)
            );
        }
        Some(other @ Neighbour::Apart { .. }) => write!(
            f,
            "{place}: {found} an equilibrium; viscous control finds another. They differ by {}",
            other.distance()
        )?,
        Some(Neighbour::None) => write!(
            f,
            "{place}: {found} an equilibrium; viscous control finds none"
        )?,
        None => write!(f, "{place}: {found} an equilibrium; others may be near")?,
    }
    write!(
        f,
        ". Compare with a run with other increments, or with `control = \"load\"` or `\"viscous\"`"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_below_round_off_or_tolerated_is_what_is_above_its_tolerance() {
        let tolerated = |residual| {
            let place = Place {
                phase: "push".to_owned(),
                increment: 1,
            };
            let warning = Warning::Tolerated {
                place,
                residual,
                force: 1.0,
                tolerance: 1e-9,
            };
            warning.to_string()
        };
        assert!(tolerated(1e-5).contains("1.0e0 kN are out of balance"));
        let within = tolerated(9.9e-12);
        assert!(
            within.contains("is within its tolerance, but corrections stay above"),
            "{within}"
        );
        assert!(!within.contains("out of balance"), "{within}");
        let unsettled = Warning::Unsettled {
            phase: "push".to_owned(),
            asked: 1e-7,
            left: 3e-6,
        };
        let said = unsettled.to_string();
        assert!(
            said.contains("`displacement_tolerance` 1.0e-7 is below round-off"),
            "{said}"
        );
        assert!(said.contains("3.0e-6 of the increment"), "{said}");
    }

    #[test]
    fn another_equilibrium_is_spoken_of_where_another_way_leads_to_one() {
        let of =
            |by_viscous_control| Warning::Relaxed(Place::default(), by_viscous_control).to_string();
        let apart = |displacements, forces| {
            of(Some(Neighbour::Apart {
                displacements,
                forces,
                largest: [2e-4, 0.3],
            }))
        };
        let same = apart(3e-13, 2e-8);
        assert!(same.ends_with("which is unique to 2.0e-8"), "{same}");
        for other in [
            apart(3e-13, 2e-5),
            apart(2e-3, 0.0),
            of(Some(Neighbour::None)),
            of(None),
        ] {
            assert!(other.contains("an equilibrium; "), "{other}");
            assert!(other.contains("Compare with a run"), "{other}");
        }
    }

    #[test]
    fn a_cut_back_is_told_with_what_other_steps_lead_to() {
        let of = |in_halves| Warning::CutBack(Place::default(), in_halves).to_string();
        let apart = of(Neighbour::Apart {
            displacements: 2e-3,
            forces: 5e-4,
            largest: [1e-6, 0.7],
        });
        let distance =
            "by at most 1.0e-6 m and 7.0e-1 kN at a node (2.0e-3 and 5.0e-4 of the step)";
        assert!(apart.contains(distance), "{apart}");
        let none = of(Neighbour::None);
        assert!(none.contains("finds no equilibrium"), "{none}");
    }

    #[test]
    fn motions_are_counted_by_what_they_are() {
        let of = |relaxed, viscous, regularised| {
            let phase = "push".to_owned();
            let warning = Warning::RelaxedOften {
                phase,
                relaxed,
                viscous,
                regularised,
            };
            warning.to_string()
        };
        let relaxed = "viscous relaxation found the equilibrium of 3 steps";
        let viscous = "viscous control found the equilibrium of 1 step";
        let regularised = "regularised corrections found the equilibrium of 9 steps";
        assert_eq!(of(3, 0, 0), format!("phase `push`: {relaxed}"));
        assert_eq!(of(0, 1, 0), format!("phase `push`: {viscous}"));
        assert_eq!(of(3, 1, 0), format!("phase `push`: {relaxed}, {viscous}"));
        assert_eq!(
            of(3, 0, 9),
            format!("phase `push`: {relaxed}, {regularised}")
        );
    }
}
