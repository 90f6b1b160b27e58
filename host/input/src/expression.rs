//! Expressions of parameters of laws: `= 0.7 * clay.cohesion`.
//!
//! Of rising precedence: sums, products, signs, powers. Powers associate to the right and come before a sign:
//! −a^b = −(a^b). Angles are in degrees, `log` is the natural logarithm.

mod parser;

use self::parser::Parser;
use std::fmt;

/// Longest text of an expression, in bytes: it bounds how deep expressions nest.
const LONGEST: usize = 500;

/// A value of a law that an expression refers to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Reference {
    /// `LAW.PARAMETER`.
    Parameter(String, String),
    /// `shear_modulus(LAW)`.
    ShearModulus(String),
    /// `oedometric_modulus(LAW)`.
    OedometricModulus(String),
}

impl Reference {
    /// The law's name.
    pub(crate) fn law(&self) -> &str {
        match self {
            Self::Parameter(law, _) | Self::ShearModulus(law) | Self::OedometricModulus(law) => law,
        }
    }
}

/// A value that follows from others.
#[derive(Clone, Debug)]
pub(crate) enum Expression {
    Number(f64),
    Reference(Reference),
    Negative(Box<Expression>),
    Operation(char, Box<[Expression; 2]>),
    Call((&'static str, fn(f64) -> f64), Box<Expression>),
    /// The smallest or largest of some.
    Extreme(fn(f64, f64) -> f64, Vec<Expression>),
}

/// Functions with their names.
type Named<F, const N: usize> = [(&'static str, F); N];

/// Functions of one number.
const FUNCTIONS: Named<fn(f64) -> f64, 9> = [
    ("sin", |x| x.to_radians().sin()),
    ("cos", |x| x.to_radians().cos()),
    ("tan", |x| x.to_radians().tan()),
    ("asin", |x| x.asin().to_degrees()),
    ("acos", |x| x.acos().to_degrees()),
    ("atan", |x| x.atan().to_degrees()),
    ("sqrt", f64::sqrt),
    ("exp", f64::exp),
    ("log", f64::ln),
];

/// Those of several.
const EXTREMES: Named<fn(f64, f64) -> f64, 2> = [("min", f64::min), ("max", f64::max)];

/// Functions of a law.
const MODULI: Named<fn(String) -> Reference, 2> = [
    ("shear_modulus", Reference::ShearModulus),
    ("oedometric_modulus", Reference::OedometricModulus),
];

/// Why a text is no expression.
#[derive(Debug)]
pub(crate) enum Wrong {
    /// A name without a law and without arguments.
    NameAlone(String),
    /// Anything else, in words.
    Other(String),
}

impl From<String> for Wrong {
    fn from(words: String) -> Self {
        Self::Other(words)
    }
}

impl fmt::Display for Wrong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NameAlone(name) => write!(
                f,
                "`{name}` is no value, expected a parameter of a law such as `{name}.cohesion`"
            ),
            Self::Other(words) => f.write_str(words),
        }
    }
}

impl Expression {
    /// The text of an expression without its `=`; `None` of another text.
    pub(crate) fn text(label: &str) -> Option<&str> {
        label.trim_start().strip_prefix('=')
    }

    /// Reads such a text.
    ///
    /// # Errors
    /// A sentence about the first part that is not an expression.
    pub(crate) fn parse(text: &str) -> Result<Self, Wrong> {
        if text.len() > LONGEST {
            return Err(format!("the expression is longer than {LONGEST} bytes").into());
        }
        Parser::new(text).whole()
    }

    /// The first function that makes no number of one, with its argument.
    pub(crate) fn undefined<E>(
        &self,
        of: &mut dyn FnMut(&Reference) -> Result<f64, E>,
    ) -> Option<String> {
        match self {
            Self::Number(_) | Self::Reference(_) => None,
            Self::Negative(inner) => inner.undefined(of),
            Self::Operation(_, both) => both.iter().find_map(|one| one.undefined(of)),
            Self::Extreme(_, all) => all.iter().find_map(|one| one.undefined(of)),
            Self::Call((name, function), inner) => inner.undefined(of).or_else(|| {
                let x = inner.value(of).ok()?;
                (x.is_finite() && !function(x).is_finite()).then(|| format!("`{name}({x})`"))
            }),
        }
    }

    /// All that it takes from laws.
    pub(crate) fn references(&self) -> Vec<&Reference> {
        match self {
            Self::Number(_) => Vec::new(),
            Self::Reference(reference) => vec![reference],
            Self::Negative(of) | Self::Call(_, of) => of.references(),
            Self::Operation(_, of) => of.iter().flat_map(Self::references).collect(),
            Self::Extreme(_, of) => of.iter().flat_map(Self::references).collect(),
        }
    }

    /// Its value, with those of its references.
    ///
    /// # Errors
    /// Those of the references.
    pub(crate) fn value<E>(
        &self,
        of: &mut dyn FnMut(&Reference) -> Result<f64, E>,
    ) -> Result<f64, E> {
        Ok(match self {
            Self::Number(number) => *number,
            Self::Reference(reference) => of(reference)?,
            Self::Negative(inner) => -inner.value(of)?,
            Self::Call((_, function), inner) => function(inner.value(of)?),
            Self::Operation(sign, both) => {
                let (a, b) = (both[0].value(of)?, both[1].value(of)?);
                match sign {
                    '+' => a + b,
                    '-' => a - b,
                    '*' => a * b,
                    '/' => a / b,
                    _ => a.powf(b),
                }
            }
            Self::Extreme(choose, all) => {
                let mut extreme = f64::NAN;
                for one in all {
                    let value = one.value(of)?;
                    if value.is_nan() {
                        return Ok(value);
                    }
                    extreme = choose(extreme, value);
                }
                extreme
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> f64 {
        let mut of = |reference: &Reference| match reference {
            Reference::Parameter(law, parameter) if law == "stiff-clay" => match &**parameter {
                "c" => Ok(5.0),
                _ => Err("no such parameter"),
            },
            Reference::Parameter(law, _) if law == "a" => Ok(3.0),
            Reference::ShearModulus(_) => Ok(1000.0),
            Reference::OedometricModulus(_) => Ok(3500.0),
            Reference::Parameter(..) => Err("no such law"),
        };
        Expression::parse(text).unwrap().value(&mut of).unwrap()
    }

    fn is(text: &str, expected: f64) {
        let found = value(text);
        let near = 1e-14 * expected.abs().max(1.0);
        assert!((found - expected).abs() <= near, "{text}: {found}");
    }

    #[test]
    fn precedence_is_that_of_mathematics() {
        is("1 + 2 * 3", 7.0);
        is("(1 + 2) * 3", 9.0);
        is("8 - 2 - 1", 5.0);
        is("8 / 2 / 2", 2.0);
        is("-2^2", -4.0);
        is("2^3^2", 512.0);
        is("2^-1", 0.5);
        is("2^-2^2", 0.0625);
        is("2 * -3", -6.0);
        is("--2 + +1", 3.0);
        is("-a.b^2", -9.0);
        is("1e-3 + 2.5E+1 + .5 + 1_000", 1025.501);
    }

    #[test]
    fn angles_are_in_degrees() {
        is("sin(30)", 0.5);
        is("cos(60)", 0.5);
        is("tan(45)", 1.0);
        is("asin(0.5)", 30.0);
        is("acos(0.5)", 60.0);
        is(
            "atan(0.7 * tan(23))",
            (0.7 * 23f64.to_radians().tan()).atan().to_degrees(),
        );
        is("exp(log(2)) + sqrt(9)", 5.0);
        is("min(3, 2) + max(1, 5, 4)", 7.0);
        assert!(value("max(1, sqrt(-1))").is_nan());
    }

    #[test]
    fn laws_may_stand_in_quotes() {
        is("\"stiff-clay\".c * 2", 10.0);
        is("'stiff-clay' . 'c'", 5.0);
        is("10 * shear_modulus(clay) / 0.05", 2e5);
        is("oedometric_modulus(\"stiff-clay\")", 3500.0);
        let all = Expression::parse("a.b + min(c.d, -shear_modulus(e))").unwrap();
        let laws: Vec<&str> = all.references().iter().map(|of| of.law()).collect();
        assert_eq!(laws, ["a", "c", "e"]);
    }

    #[test]
    fn what_does_not_fit_is_said() {
        for (text, words) in [
            ("", "ends"),
            ("1 +", "ends"),
            ("(1", "expected `)`"),
            ("1 2", "`2` is not expected"),
            ("clay", "`clay` is no value"),
            ("clay.", "a name is missing"),
            ("sine(3)", "no function `sine`"),
            ("shear_modulus(3 + 1)", "found `+`"),
            ("1.2.3", "`1.2.3` is no number"),
            ("sin(1, 2)", "found `,`"),
            ("'clay.c", "expected `'`"),
            ("2 % 3", "`%`"),
        ] {
            let why = Expression::parse(text).unwrap_err().to_string();
            assert!(why.contains(words), "{text}: {why}");
        }
        assert!(Expression::parse(&"(".repeat(501)).is_err());
        assert!(Expression::parse(&"(".repeat(500)).is_err());
    }
}
