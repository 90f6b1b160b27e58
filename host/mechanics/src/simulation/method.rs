//! Which method `auto` stands for in a phase: it follows from what its laws say of their tangents.

use super::Warning;
use crate::group::Group;
use crate::settings::Method;
use law::Tangent;

/// The method that iterates: what was asked for, or the one that suits the laws.
pub(super) fn resolved(asked: Method, groups: &[Group]) -> Method {
    if asked == Method::Auto && groups.iter().any(is_approximate) {
        Method::QuasiNewton
    } else {
        asked
    }
}

/// What is to be said of it, if it is another one than was asked for.
pub(super) fn other(asked: Method, groups: &[Group]) -> Option<Warning> {
    let method = resolved(asked, groups);
    let group = groups.iter().find(|group| is_approximate(group));
    let group = group.filter(|_| method != asked)?;
    let law = group.law.built.law.description().id.clone();
    Some(Warning::OtherMethod { law, method, asked })
}

/// Whether Newton's method would iterate on tangents that are none.
fn is_approximate(group: &Group) -> bool {
    group.law.built.law.formulation().tangent != Tangent::Consistent
}
