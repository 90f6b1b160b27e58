//! The points of a study: which values each run has.

use super::sobol;
use crate::Error;
use crate::sampling::stratified;
use input::Study;
use input::study::{MOST_RUNS, Method, Parameter, Spread};
use libm::erfc;
use results::random::Random;
use toml::Value;

/// The values of the parameters, by run and parameter.
///
/// # Errors
/// More runs than a study may have; more parameters than a sequence has dimensions.
pub(super) fn rows(study: &Study) -> Result<Vec<Vec<Value>>, Error> {
    let method = study.file.method;
    let parameters = &study.parameters;
    let runs = study.file.runs.as_ref().map_or(0, |runs| *runs.get_ref());
    let seed = study.file.seed.as_ref().map_or(0, |seed| *seed.get_ref());
    let dimensions = parameters.len() * if method == Method::Saltelli { 2 } else { 1 };
    match method {
        Method::Grid => grid(study),
        Method::List => {
            let columns: Vec<Vec<Value>> = parameters.iter().map(levels).collect();
            let n = columns.first().map_or(0, Vec::len);
            let row = |i: usize| columns.iter().map(|column| column[i].clone()).collect();
            Ok((0..n).map(row).collect())
        }
        Method::Sobol | Method::Saltelli if dimensions > sobol::MOST_DIMENSIONS => {
            let message = format!(
                "{} parameters: `{}` has points for at most {}",
                parameters.len(),
                method.name(),
                sobol::MOST_DIMENSIONS * parameters.len() / dimensions
            );
            Err(study.source.error(0..0, message).into())
        }
        Method::LatinHypercube | Method::Sobol | Method::Saltelli => {
            let columns: Vec<Vec<f64>> = (0..dimensions)
                .map(|dimension| {
                    let mut random = Random::of(seed, dimension);
                    if method == Method::LatinHypercube {
                        stratified(runs, &mut random)
                    } else {
                        sobol::coordinate(dimension, runs, (random.next() >> 32) as u32)
                    }
                })
                .collect();
            if method == Method::Saltelli {
                return Ok(with_one_exchanged(parameters, &columns, runs));
            }
            let with_columns = |i: usize| {
                let with = parameters.iter().zip(&columns);
                with.map(|(parameter, column)| value(parameter, column[i]))
                    .collect()
            };
            Ok((0..runs).map(with_columns).collect())
        }
    }
}

/// The runs of each base point ([`results::study::indices`]): the first half of the columns is the sample A, the second B.
fn with_one_exchanged(parameters: &[Parameter], columns: &[Vec<f64>], n: usize) -> Vec<Vec<Value>> {
    let d = parameters.len();
    // Run 0 of a point has all of A, run d + 1 all of B, run k parameter k of B.
    let run = |point: usize, run: usize| {
        let values = parameters.iter().enumerate().map(|(i, parameter)| {
            let is_of_b = run == d + 1 || run == i + 1;
            let column = if is_of_b { d + i } else { i };
            value(parameter, columns[column][point])
        });
        values.collect()
    };
    let of_point = |point: usize| (0..d + 2).map(move |number| run(point, number));
    (0..n).flat_map(of_point).collect()
}

/// All combinations; the last parameter varies fastest.
fn grid(study: &Study) -> Result<Vec<Vec<Value>>, Error> {
    let columns: Vec<Vec<Value>> = study.parameters.iter().map(levels).collect();
    let n = columns.iter().try_fold(1_usize, |n, column| {
        n.checked_mul(column.len()).filter(|&n| n <= MOST_RUNS)
    });
    let Some(n) = n else {
        let counts: Vec<String> = columns
            .iter()
            .map(|column| column.len().to_string())
            .collect();
        let message = format!(
            "the grid has {} runs, at most {MOST_RUNS} are possible",
            counts.join(" × ")
        );
        return Err(study.source.error(0..0, message).into());
    };
    let row = |mut i: usize| {
        let mut row: Vec<Value> = columns
            .iter()
            .rev()
            .map(|column| {
                let value = column[i % column.len()].clone();
                i /= column.len();
                value
            })
            .collect();
        row.reverse();
        row
    };
    Ok((0..n).map(row).collect())
}

/// The values that a parameter has in a grid or a list.
fn levels(parameter: &Parameter) -> Vec<Value> {
    if let Spread::Values(values) = &parameter.spread {
        return values.clone();
    }
    let n = parameter.levels.unwrap_or(1);
    // One level stands in the middle.
    let share = |i: usize| {
        if n == 1 {
            0.5
        } else {
            i as f64 / (n - 1) as f64
        }
    };
    let mut levels: Vec<Value> = (0..n)
        .map(|i| number(parameter, quantile(&parameter.spread, share(i))))
        .collect();
    levels.dedup();
    levels
}

/// Values among which every value lies that a parameter may have: the smallest and largest number, and
/// whatever is no number.
pub(super) fn extremes(parameter: &Parameter) -> Vec<Value> {
    let Spread::Values(values) = &parameter.spread else {
        let ends = [0.0, 1.0].map(|share| quantile(&parameter.spread, share));
        return ends.into_iter().map(|end| number(parameter, end)).collect();
    };
    let as_number = |value: &Value| match value {
        Value::Float(number) => Some(*number),
        Value::Integer(number) => Some(*number as f64),
        _ => None,
    };
    let by_size = |a: &&Value, b: &&Value| {
        as_number(a)
            .unwrap_or(0.0)
            .total_cmp(&as_number(b).unwrap_or(0.0))
    };
    let numbers = || values.iter().filter(|value| as_number(value).is_some());
    let others = values.iter().filter(|value| as_number(value).is_none());
    let ends = numbers()
        .min_by(by_size)
        .into_iter()
        .chain(numbers().max_by(by_size));
    let mut found: Vec<Value> = Vec::new();
    for value in ends.chain(others) {
        if !found.contains(value) {
            found.push(value.clone());
        }
    }
    found
}

/// The value at this share of the probability, 0 to 1 (1 excluded).
fn value(parameter: &Parameter, share: f64) -> Value {
    match &parameter.spread {
        Spread::Values(values) => {
            let number = (share * values.len() as f64) as usize;
            values[number.min(values.len() - 1)].clone()
        }
        // Every whole number is as probable as the others, those at the ends, too.
        Spread::Uniform([from, to]) if parameter.whole => {
            let [from, to] = [from.ceil(), to.floor()];
            let among = (from + share * (to - from + 1.0)).floor().min(to);
            number(parameter, among)
        }
        spread => number(parameter, quantile(spread, share)),
    }
}

/// A number, of whole ones the nearest between the ends.
fn number(parameter: &Parameter, value: f64) -> Value {
    if !parameter.whole {
        return Value::Float(value);
    }
    let [from, to] = parameter.spread.ends().unwrap_or([f64::MIN, f64::MAX]);
    Value::Integer(value.round().clamp(from.ceil(), to.floor()) as i64)
}

/// The number below which this share of a distribution lies; both ends exactly.
fn quantile(spread: &Spread, share: f64) -> f64 {
    match spread {
        Spread::Values(_) => f64::NAN,
        Spread::Uniform([from, to]) => between(*from, *to, share),
        Spread::LogUniform([from, to]) => {
            let inside = (from.ln() + share * (to / from).ln()).exp();
            match share {
                0.0 => *from,
                1.0 => *to,
                _ => inside.clamp(*from, *to),
            }
        }
        Spread::Normal(normal) => {
            let standard = |x: f64| (x - normal.mean) / normal.deviation;
            let (a, b) = (standard(normal.min), standard(normal.max));
            match share {
                0.0 => normal.min,
                1.0 => normal.max,
                _ => {
                    let z = truncated_normal(a, b, share);
                    (normal.mean + normal.deviation * z).clamp(normal.min, normal.max)
                }
            }
        }
    }
}

fn between(from: f64, to: f64, share: f64) -> f64 {
    (from * (1.0 - share) + to * share).clamp(from, to)
}

/// Probability that a standard normal number lies between two.
fn probability(a: f64, b: f64) -> f64 {
    let root = std::f64::consts::SQRT_2;
    // On the side where both tails are small, so that no digits cancel.
    if a + b < 0.0 {
        0.5 * (erfc(-b / root) - erfc(-a / root))
    } else {
        0.5 * (erfc(a / root) - erfc(b / root))
    }
}

/// The number below which this share of a standard normal distribution between a and b lies, by bisection.
fn truncated_normal(a: f64, b: f64, share: f64) -> f64 {
    let whole = probability(a, b);
    let (mut low, mut high) = (a, b);
    if whole <= 0.0 {
        // So far out that nothing of it is left in a double: evenly.
        return between(a, b, share);
    }
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if probability(a, middle) < share * whole {
            low = middle;
        } else {
            high = middle;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use input::study::NormalInput;
    use text::Source;

    fn study(text: &str) -> Study {
        Study::of(Source::new(
            "study.toml",
            format!("case = \"case.toml\"\n{text}"),
        ))
        .unwrap()
    }

    fn numbers(rows: &[Vec<Value>], parameter: usize) -> Vec<f64> {
        let number = |row: &Vec<Value>| match &row[parameter] {
            Value::Float(number) => *number,
            Value::Integer(number) => *number as f64,
            other => panic!("{other}"),
        };
        rows.iter().map(number).collect()
    }

    #[test]
    fn a_grid_has_all_combinations() {
        let study = study(
            "method = \"grid\"\n\
             [[parameter]]\nkey = \"a\"\nvalues = [\"x\", \"y\"]\n\
             [[parameter]]\nkey = \"b\"\nuniform = [0.0, 1.0]\nlevels = 3\n\
             [[parameter]]\nkey = \"c\"\nlog_uniform = [1.0, 100.0]\nlevels = 3\nwhole = true\n",
        );
        let rows = rows(&study).unwrap();
        assert_eq!(rows.len(), 18);
        let texts: Vec<&str> = rows.iter().map(|row| row[0].as_str().unwrap()).collect();
        assert_eq!(texts[..9], ["x"; 9]);
        assert_eq!(numbers(&rows, 1)[..4], [0.0, 0.0, 0.0, 0.5]);
        assert_eq!(numbers(&rows, 2)[..4], [1.0, 10.0, 100.0, 1.0]);
    }

    #[test]
    fn a_hypercube_has_one_run_in_each_part_whatever_the_seed() {
        for (n, seed) in [(1, 0), (7, 3), (100, 42), (1000, u64::MAX >> 1)] {
            let text = format!(
                "method = \"latin_hypercube\"\nruns = {n}\nseed = {seed}\n\
                 [[parameter]]\nkey = \"a\"\nuniform = [2.0, 4.0]\n\
                 [[parameter]]\nkey = \"b\"\nnormal = {{ mean = 1.0, deviation = 2.0, min = 0.0, max = 3.0 }}\n"
            );
            let study = study(&text);
            let found = rows(&study).unwrap();
            assert_eq!(found, rows(&study).unwrap());
            for (parameter, share) in [
                (0, (|x| (x - 2.0) / 2.0) as fn(f64) -> f64),
                (1, |x| {
                    probability(-0.5, (x - 1.0) / 2.0) / probability(-0.5, 1.0)
                }),
            ] {
                let mut seen = vec![0; n];
                for x in numbers(&found, parameter) {
                    seen[(share(x) * n as f64).min(n as f64 - 1.0) as usize] += 1;
                }
                assert!(
                    seen.iter().all(|&count| count == 1),
                    "{n} {seed} {parameter}"
                );
            }
        }
    }

    #[test]
    fn seeds_differ_and_parameters_keep_their_numbers() {
        let with = |seed: &str, more: &str, method: &str| {
            let text = format!(
                "method = \"{method}\"\nruns = 16\n{seed}\n\
                 [[parameter]]\nkey = \"a\"\nuniform = [0.0, 1.0]\n{more}"
            );
            numbers(&rows(&study(&text)).unwrap(), 0)
        };
        let more = "[[parameter]]\nkey = \"b\"\nuniform = [0.0, 1.0]\n";
        for method in ["latin_hypercube", "sobol"] {
            assert_eq!(with("seed = 1", "", method), with("seed = 1", more, method));
            assert_ne!(with("seed = 1", "", method), with("seed = 2", "", method));
        }
        // Without a seed it is 0: neither the sequence itself nor other points at every call.
        assert_eq!(with("", "", "sobol"), with("seed = 0", "", "sobol"));
        assert_ne!(with("", "", "sobol")[..4], [0.0, 0.5, 0.75, 0.25]);
    }

    /// Indices of sin x + 7 sin² y + 0.1 z⁴ sin x between ±π (T. Ishigami & T. Homma 1990): variances 7²/8,
    /// (1 + 0.1 π⁴/5)²/2 of x alone, 0.01 π⁸ (1/18 − 1/50) of x with z. With 2¹² base points the largest error is 0.0022.
    /// Intervals of fewer points hold the truth, for points that are even, more often than 95 times in a hundred.
    #[test]
    fn indices_of_the_ishigami_function_are_those_of_the_closed_form() {
        let pi = std::f64::consts::PI;
        let of_x = (1.0 + 0.1 * pi.powi(4) / 5.0).powi(2) / 2.0;
        let (of_y, of_both) = (49.0 / 8.0, 0.01 * pi.powi(8) * (1.0 / 18.0 - 1.0 / 50.0));
        let whole = of_x + of_y + of_both;
        let first = [of_x, of_y, 0.0].map(|part| part / whole);
        let total = [of_x + of_both, of_y, of_both].map(|part| part / whole);
        let of = |runs: usize, seed: u64| {
            let mut text = format!("method = \"saltelli\"\nruns = {runs}\nseed = {seed}\n");
            for name in ["x", "y", "z"] {
                text = format!(
                    "{text}[[parameter]]\nkey = \"{name}\"\nuniform = [{:?}, {pi:?}]\n",
                    -pi
                );
            }
            let rows = rows(&study(&text)).unwrap();
            let [x, y, z] = [0, 1, 2].map(|parameter| numbers(&rows, parameter));
            let f = |i: usize| x[i].sin() * (1.0 + 0.1 * z[i].powi(4)) + 7.0 * y[i].sin().powi(2);
            let values: Vec<Option<f64>> = (0..rows.len()).map(|i| Some(f(i))).collect();
            assert_eq!(values.len(), 5 * runs);
            results::study::indices(&values, 3)
        };
        for (i, found) in of(1 << 12, 0).iter().enumerate() {
            assert!(
                (found.first.value - first[i]).abs() < 0.005,
                "{i}: {found:?}"
            );
            assert!(
                (found.total.value - total[i]).abs() < 0.005,
                "{i}: {found:?}"
            );
        }
        let mut hits = [0; 6];
        for seed in 0..200 {
            for (i, found) in of(64, seed).iter().enumerate() {
                let with_truth = [(found.first, first[i]), (found.total, total[i])];
                for (place, (estimate, truth)) in with_truth.into_iter().enumerate() {
                    let [low, high] = estimate.interval.unwrap();
                    hits[2 * i + place] += usize::from((low..=high).contains(&truth));
                }
            }
        }
        println!("{hits:?} of 200");
        assert!(hits.iter().all(|hits| *hits >= 180), "{hits:?}");
    }

    #[test]
    fn whole_numbers_are_equally_probable() {
        let study = study(
            "method = \"sobol\"\nruns = 256\n[[parameter]]\nkey = \"a\"\nuniform = [3, 6]\nwhole = true\n",
        );
        let found = numbers(&rows(&study).unwrap(), 0);
        for whole in 3..=6 {
            let count = found.iter().filter(|x| **x as i32 == whole).count();
            assert_eq!(count, 64, "{whole}");
        }
    }

    /// Not 0 and 4, which are the nearest ones of the ends.
    #[test]
    fn whole_numbers_lie_between_the_ends() {
        let spreads = [
            "uniform = [0.4, 3.6]",
            "log_uniform = [0.4, 3.6]",
            "normal = { mean = 2.0, deviation = 5.0, min = 0.4, max = 3.6 }",
        ];
        for (method, levels) in [("\"grid\"", "levels = 9"), ("\"sobol\"\nruns = 16", "")] {
            for spread in spreads {
                let text = format!(
                    "method = {method}\n[[parameter]]\nkey = \"a\"\nwhole = true\n{levels}\n{spread}\n"
                );
                let study = study(&text);
                let mut found = numbers(&rows(&study).unwrap(), 0);
                found.extend(numbers(&[extremes(&study.parameters[0])], 0));
                assert!(
                    found.iter().all(|x| (1.0..=3.0).contains(x)),
                    "{text}: {found:?}"
                );
            }
        }
    }

    /// Φ⁻¹ from tables: 0.975 at 1.959963984540054, 0.9999 at 3.719016485455709; the tail beyond 5 has
    /// its median where half of its 2.866515719e-7 lies.
    #[test]
    fn normal_quantiles_are_those_of_tables() {
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12 * b.abs(), "{a} {b}");
        near(truncated_normal(-38.0, 38.0, 0.975), 1.959_963_984_540_054);
        near(truncated_normal(-38.0, 38.0, 0.9999), 3.719_016_485_455_709);
        near(truncated_normal(-38.0, 38.0, 0.025), -1.959_963_984_540_054);
        let median = truncated_normal(5.0, 38.0, 0.5);
        assert!((erfc(median / 2_f64.sqrt()) / erfc(5.0 / 2_f64.sqrt()) - 0.5).abs() < 1e-12);
        let cut = NormalInput {
            mean: 30.0,
            deviation: 2.0,
            min: 25.0,
            max: 35.0,
        };
        let of = |share| quantile(&Spread::Normal(cut), share);
        assert_eq!(
            [of(0.0), of(1.0)].map(f64::to_bits),
            [25.0_f64, 35.0].map(f64::to_bits)
        );
        assert!((of(0.5) - 30.0).abs() < 1e-12);
    }

    #[test]
    fn extremes_hold_all_values() {
        let study = study(
            "method = \"list\"\n[[parameter]]\nkey = \"a\"\nvalues = [3, 1.5, 2, 3]\n\
             [[parameter]]\nkey = \"b\"\nvalues = [\"x\", \"y\", \"x\", \"y\"]\n",
        );
        let of = |parameter: usize| extremes(&study.parameters[parameter]);
        assert_eq!(of(0), [Value::Float(1.5), Value::Integer(3)]);
        assert_eq!(of(1), [Value::from("x"), Value::from("y")]);
    }
}
