//! Compression typed as a positive number: the law itself is asked.

use crate::problem::Formulation;
use law::{Law, Operator};

/// A law rejects a stress that it changes by more than this fraction over a zero increment.
const NOTABLE: f64 = 0.01;

/// Why the law rejects a stress (11 22 33 12, tension positive), if it accepts the same one with all normal components
/// as compression. `None`: the law accepts it, or signs are not the reason.
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
    let flux = match law.at_rest(stress, &[], Operator::None) {
        Ok((flux, _)) => flux,
        Err(failure) if failure.message.is_empty() => return Some("no reason given".to_owned()),
        Err(failure) => return Some(failure.message),
    };
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
