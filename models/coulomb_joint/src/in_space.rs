//! Two tangential directions: the joint in the plane of the normal and of the trial's shear traction.
//!
//! Friction is the same in all directions. So the return follows the trial's direction e, Eq. (7), and
//! in the plane of n and e it is that of the joint in two dimensions.

use crate::{CoulombJoint, State};
use abi::{InterfacePoint, InterfaceResponse, Tangent};

impl CoulombJoint {
    /// Shear traction of the trial if nothing slid, Eq. (1), of what acts on the joint. While it is open
    /// only what comes after closure acts, which has the direction of the whole slip.
    #[inline]
    fn trial(&self, point: &InterfacePoint<State, f64, 3>) -> [f64; 2] {
        let carried = f64::from(u8::from(point.state.gap <= 0.0));
        [1, 2].map(|i| carried * point.traction[i] + self.shear_stiffness * point.jump_increment[i])
    }

    /// Size and direction of the trial; any direction where it is nil.
    #[inline]
    fn direction(&self, point: &InterfacePoint<State, f64, 3>) -> (f64, [f64; 2]) {
        let [t, s] = self.trial(point);
        let size = t.hypot(s);
        if size > 0.0 {
            (size, [t / size, s / size])
        } else {
            (0.0, [1.0, 0.0])
        }
    }

    /// The point in the plane of the normal and of the trial's direction.
    #[inline]
    pub(crate) fn along(&self, point: &InterfacePoint<State, f64, 3>) -> InterfacePoint<State> {
        let (_, e) = self.direction(point);
        let in_plane = |[n, t, s]: [f64; 3]| [n, t * e[0] + s * e[1]];
        InterfacePoint {
            jump: in_plane(point.jump),
            jump_increment: in_plane(point.jump_increment),
            traction: in_plane(point.traction),
            state: point.state,
            time: point.time,
            time_increment: point.time_increment,
            step_time: point.step_time,
        }
    }

    /// What the joint in that plane makes of the point, in three dimensions: Eqs. (7) and (8).
    #[inline]
    pub(crate) fn slide_in_space(
        &self,
        point: &InterfacePoint<State, f64, 3>,
        plane: InterfaceResponse<State>,
        tangent: Tangent,
    ) -> InterfaceResponse<State, 3> {
        let (size, e) = self.direction(point);
        let [normal, shear] = plane.traction;
        let [[nn, nt], [tn, tt]] = plane.tangent;
        // Across e only the direction of the traction changes.
        let across = if tangent == Tangent::Elastic {
            self.shear_stiffness
        } else if size > 0.0 {
            self.shear_stiffness * shear / size
        } else {
            tt
        };
        let entry = |i: usize, j: usize| {
            let own = if i == j { across } else { 0.0 };
            own + (tt - across) * e[i] * e[j]
        };
        InterfaceResponse {
            traction: [normal, shear * e[0], shear * e[1]],
            state: plane.state,
            tangent: [
                [nn, nt * e[0], nt * e[1]],
                [tn * e[0], entry(0, 0), entry(0, 1)],
                [tn * e[1], entry(1, 0), entry(1, 1)],
            ],
            unreliable: plane.unreliable,
        }
    }
}
