//! Compression typed as a positive number: the law itself is asked.

use crate::problem::Formulation;
use law::{End, Law, Moment, Operator, Start, Strided};

/// A zero increment that changes a stress by more than this fraction of it does not stand it.
const NOTABLE: f64 = 0.01;

/// What the law makes of a stress (11 22 33 12, tension positive) that it cannot stand, if it can
/// stand the same one with all normal components as compression. Else `None`: the law takes it as
/// it is, or signs are not the reason.
pub(crate) fn turned(law: &Law, formulation: Formulation, stress: [f64; 4]) -> Option<String> {
    let normal = &stress[..3];
    if normal.iter().all(|&s| s <= 0.0) {
        return None;
    }
    let compression = [
        -stress[0].abs(),
        -stress[1].abs(),
        -stress[2].abs(),
        stress[3],
    ];
    // An interface sees one normal stress: that of either direction is tried, whatever its facet.
    let seen = |s: [f64; 4]| match (law.n_components(), formulation) {
        (2, _) => vec![vec![s[0], s[3]], vec![s[1], s[3]]],
        (_, _) => vec![s.to_vec()],
    };
    let pairs = seen(stress).into_iter().zip(seen(compression));
    for (given, pressed) in pairs.filter(|(given, pressed)| given != pressed) {
        if let Some(refusal) = refused(law, &given)
            && refused(law, &pressed).is_none()
        {
            return Some(refusal);
        }
    }
    None
}

/// Why a law does not leave a stress as it is over a zero increment.
fn refused(law: &Law, stress: &[f64]) -> Option<String> {
    let n = law.n_components();
    let rows = Strided::rows(n);
    let zero = vec![0.0; n];
    let says = |message: String| {
        if message.is_empty() {
            "no reason given".to_owned()
        } else {
            message
        }
    };
    let state = match law.initial_state(1, (stress, rows)) {
        Ok(state) => state,
        Err(failure) => return Some(says(failure.message)),
    };
    let (mut flux, mut state_end, mut operator) = (vec![0.0; n], state.clone(), vec![0.0; n * n]);
    let start = Start {
        n_points: 1,
        gradient: (&zero, rows),
        gradient_end: (&zero, rows),
        flux: (stress, rows),
        state: &state,
        time: 0.0,
        time_increment: 0.0,
        moment: Moment::default(),
        sites: &[],
    };
    let end = End {
        flux: (&mut flux, rows),
        state: &mut state_end,
        operator: &mut operator,
    };
    if let Err(failure) = law.integrate(&start, Operator::None, end) {
        return Some(says(failure.message));
    }
    let size = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |m: f64, v| m.max(v.abs()));
    let change = size(&mut stress.iter().zip(&flux).map(|(a, b)| b - a));
    let own = size(&mut stress.iter().copied());
    let list = |values: &[f64]| {
        let texts: Vec<String> = values.iter().map(|v| format!("{v:.4}")).collect();
        texts.join(", ")
    };
    (change > NOTABLE * own).then(|| {
        format!(
            "without any strain it turns ({}) kPa into ({})",
            list(stress),
            list(&flux)
        )
    })
}
