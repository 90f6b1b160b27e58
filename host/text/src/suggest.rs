//! Names that a user may have meant.

/// The candidate closest to `name`, if any is close enough to be a slip of the pen.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // The distance takes the product of the lengths.
    const LONGEST: usize = 200;
    candidates
        .into_iter()
        .filter(|candidate| candidate.len().max(name.len()) <= LONGEST)
        .map(|candidate| (strsim::levenshtein(name, candidate), candidate))
        .filter(|(distance, candidate)| {
            *distance <= 1 + candidate.len() / 3 && *distance < candidate.len().max(name.len())
        })
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// Former names of keys and values, with those of today.
const FORMER: [(&str, &str); 1] = [("creep", "viscous")];

/// `did you mean …?` and the whole list, for a name that is not among the candidates.
pub fn suggestion<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    let all: Vec<&str> = candidates.into_iter().collect();
    if all.is_empty() {
        return "there is none".to_owned();
    }
    let list = all.join(", ");
    let is_former = |(former, today): &&(&str, &str)| *former == name && all.contains(today);
    if let Some((_, today)) = FORMER.iter().find(is_former) {
        return format!("`{name}` is now called `{today}`. There is: {list}");
    }
    match nearest(name, all) {
        Some(near) => format!("did you mean `{near}`? There is: {list}"),
        None => format!("there is: {list}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggests_the_nearest_name() {
        let names = ["young_modulus", "poisson_ratio"];
        assert_eq!(nearest("youngs_modulus", names), Some("young_modulus"));
        assert_eq!(nearest("cohesion", names), None);
        assert_eq!(nearest("w", ["x", "y"]), None);
        let hint = suggestion("creep", ["auto", "viscous"]);
        assert!(
            hint.starts_with("`creep` is now called `viscous`"),
            "{hint}"
        );
        assert!(suggestion("creep", ["steep"]).starts_with("did you mean"));
    }
}
