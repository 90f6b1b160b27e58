//! Which settings nothing else beats.

/// Pairs (cost, error) that no other pair dominates. Among equals the first counts. Settings that
/// failed (`None`) are never among them.
pub(super) fn front(settings: &[Option<(f64, f64)>]) -> Vec<bool> {
    let mut order: Vec<usize> = (0..settings.len()).collect();
    order.retain(|&i| settings[i].is_some());
    let at = |i: usize| settings[i].unwrap_or((f64::INFINITY, f64::INFINITY));
    order.sort_by(|&a, &b| {
        let ((cost_a, error_a), (cost_b, error_b)) = (at(a), at(b));
        cost_a.total_cmp(&cost_b).then(error_a.total_cmp(&error_b))
    });
    let mut is_on = vec![false; settings.len()];
    let mut least = f64::INFINITY;
    for i in order {
        let (_, error) = at(i);
        if error < least {
            least = error;
            is_on[i] = true;
        }
    }
    is_on
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let settings = [
            Some((1.0, 0.5)),
            Some((2.0, 0.5)), // as accurate as the first, dearer
            Some((3.0, 0.1)),
            Some((2.5, 0.2)),
            Some((4.0, 0.3)), // beaten by the third
            None,
            Some((1.0, 0.5)), // equal to the first
        ];
        let expected = [true, false, true, true, false, false, false];
        assert_eq!(front(&settings), expected);
    }
}
