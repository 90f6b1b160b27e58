//! Integration error of the tractions that an interface begins with.
//!
//! Laws are evaluated at the nodes, and forces from there do not integrate a stress that grows along a side whose
//! radius or direction changes. The difference is kept next to the law's answer, so that tractions are the stress of
//! the ground and nothing moves.

use crate::element::Axes;
use crate::group::Group;

impl Group {
    /// Exactly integrated tractions of an interface less those at its points; `traction` gives them by element, place
    /// and axes there.
    pub fn lost(
        &self,
        at_points: &[f64],
        traction: impl Fn(usize, [f64; 2], &Axes) -> [f64; 2],
    ) -> Vec<f64> {
        let mut lost = vec![0.0; at_points.len()];
        for element in 0..self.kinematics.n_elements() {
            let of_element = |at: [f64; 2], axes: &Axes| traction(element, at, axes);
            if let Some(exact) = self.kinematics.gathered(element, &of_element) {
                let points = self.kinematics.points_of(element);
                let own = 2 * points.start..2 * points.end;
                let both = exact.as_flattened().iter().zip(&at_points[own.clone()]);
                let all = lost[own].iter_mut().zip(both);
                all.for_each(|(lost, (exact, own))| *lost = exact - own);
            }
        }
        lost
    }

    /// Takes over what [`Self::lost`] gave.
    pub fn correct(&mut self, lost: Vec<f64>) {
        let is_any = lost.iter().any(|lost| *lost != 0.0);
        self.correction = if is_any { lost } else { Vec::new() };
    }
}
