//! The elastic operator of one point, for whoever wants to know how stiff a body is.

use super::Group;
use law::{End, Operator, Start, Strided, current_call};

impl Group {
    /// The law's elastic operator at a point in the committed state, row by row. `None` if the law has no operator there,
    /// or has other components than the element.
    pub fn elastic_operator(&self, point: usize) -> Option<Vec<f64>> {
        let n = self.kinematics.n_components();
        let pieces = self.pieces(usize::MAX).into_iter();
        let (_, law) = pieces
            .into_iter()
            .find(|(points, _)| points.contains(&point))?;
        if law.n_components() != n {
            return None;
        }
        let n_states = law.n_states();
        let state = self
            .internal
            .committed
            .get(point * n_states..(point + 1) * n_states)?;
        let stress = self.stress.committed.get(point * n..(point + 1) * n)?;
        let rows = Strided::rows(n);
        let zero = vec![0.0; n];
        let (mut flux, mut state_end) = (vec![0.0; n], state.to_vec());
        let mut operator = vec![0.0; n * n];
        let site = law.asks_for_sites().then(|| self.site(point));
        current_call::of_group(self.watched, point, self.kinematics.points_of(0).len());
        let start = Start {
            n_points: 1,
            gradient: (&zero, rows),
            gradient_end: (&zero, rows),
            flux: (stress, rows),
            state,
            time: self.moment.step_start,
            time_increment: 0.0,
            moment: self.moment,
            sites: site.as_slice(),
        };
        let end = End {
            flux: (&mut flux, rows),
            state: &mut state_end,
            operator: &mut operator,
        };
        law.integrate(&start, Operator::Elastic, end).ok()?;
        Some(operator)
    }
}
