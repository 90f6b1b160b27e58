//! Which method `auto` stands for in a phase: it follows from what its laws say of their tangents.

use crate::case::Method;
use crate::group::Group;
use crate::plugin::Tangent;

/// The method that iterates: what was asked for, or the one that suits the laws.
pub(super) fn resolved(asked: Method, groups: &[Group]) -> Method {
    if asked == Method::Auto && groups.iter().any(is_approximate) {
        Method::QuasiNewton
    } else {
        asked
    }
}

/// Why it is another one than was asked for.
pub(super) fn reason(asked: Method, groups: &[Group]) -> Option<String> {
    let method = resolved(asked, groups);
    let group = groups.iter().find(|group| is_approximate(group));
    let group = group.filter(|_| method != asked)?;
    Some(format!(
        "the tangents of law `{}` are approximate: method `{}` stands for `{}`",
        group.law.built.law.description().id,
        method.name(),
        asked.name()
    ))
}

/// Whether Newton's method would iterate on tangents that are none.
fn is_approximate(group: &Group) -> bool {
    group.law.built.law.formulation().tangent == Tangent::Approximate
}
