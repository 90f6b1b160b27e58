//! Committed pictures against those that are drawn.

/// Whether what differs is rewritten: `PILUM_BLESS=1`.
pub fn bless() -> bool {
    std::env::var_os("PILUM_BLESS").is_some_and(|value| value == "1")
}

/// Equal, but for coordinates that another machine rounds to the next whole point.
pub fn alike(a: &str, b: &str) -> bool {
    let words = |text: &str| -> Vec<String> {
        let words = text.split([' ', ',', '"']);
        words.map(str::to_owned).collect()
    };
    let near = |(a, b): (&String, &String)| match (a.parse::<i64>(), b.parse::<i64>()) {
        (Ok(a), Ok(b)) => a.abs_diff(b) <= 1,
        _ => a == b,
    };
    let (a, b) = (words(a), words(b));
    a.len() == b.len() && a.iter().zip(&b).all(near)
}
