//! Reads expressions, by recursive descent.

use super::{EXTREMES, Expression, FUNCTIONS, MODULI, Reference, Wrong};
use std::iter::Peekable;
use std::str::CharIndices;

/// A text on its way.
pub(super) struct Parser<'t> {
    text: &'t str,
    rest: Peekable<CharIndices<'t>>,
}

impl<'t> Parser<'t> {
    pub(super) fn new(text: &'t str) -> Self {
        let rest = text.char_indices().peekable();
        Self { text, rest }
    }

    pub(super) fn whole(&mut self) -> Result<Expression, Wrong> {
        let whole = self.sum()?;
        match self.next() {
            None => Ok(whole),
            Some(c) => Err(typographic(c)
                .unwrap_or_else(|| format!("`{c}` is not expected there"))
                .into()),
        }
    }

    /// The next character that is no blank, which stays.
    fn peek(&mut self) -> Option<char> {
        while self.rest.next_if(|(_, c)| c.is_whitespace()).is_some() {}
        self.rest.peek().map(|(_, c)| *c)
    }

    fn next(&mut self) -> Option<char> {
        self.peek()?;
        self.rest.next().map(|(_, c)| c)
    }

    /// Takes the next character if it is one of these.
    fn take(&mut self, any: &str) -> Option<char> {
        let next = self.peek().filter(|c| any.contains(*c))?;
        self.next();
        Some(next)
    }

    fn expect(&mut self, wanted: char) -> Result<(), Wrong> {
        match self.next() {
            Some(c) if c == wanted => Ok(()),
            Some(c) => Err(format!("found `{c}`, expected `{wanted}`").into()),
            None => Err(format!("the expression ends, expected `{wanted}`").into()),
        }
    }

    /// Characters from here on for which this holds of the one before and the character.
    fn run(&mut self, goes_on: impl Fn(Option<char>, char) -> bool) -> &'t str {
        let end = self.text.len();
        let start = self.rest.peek().map_or(end, |(at, _)| *at);
        let mut before = None;
        while let Some((_, c)) = self.rest.next_if(|(_, c)| goes_on(before, *c)) {
            before = Some(c);
        }
        &self.text[start..self.rest.peek().map_or(end, |(at, _)| *at)]
    }

    fn sum(&mut self) -> Result<Expression, Wrong> {
        self.chain("+-", Self::product)
    }

    fn product(&mut self) -> Result<Expression, Wrong> {
        self.chain("*/", Self::signed)
    }

    fn chain(
        &mut self,
        signs: &str,
        part: fn(&mut Self) -> Result<Expression, Wrong>,
    ) -> Result<Expression, Wrong> {
        let mut all = part(self)?;
        while let Some(sign) = self.take(signs) {
            all = Expression::Operation(sign, Box::new([all, part(self)?]));
        }
        Ok(all)
    }

    fn signed(&mut self) -> Result<Expression, Wrong> {
        match self.take("+-") {
            Some('-') => Ok(Expression::Negative(Box::new(self.signed()?))),
            Some(_) => self.signed(),
            None => {
                let base = self.single()?;
                if self.take("^").is_none() {
                    return Ok(base);
                }
                Ok(Expression::Operation('^', Box::new([base, self.signed()?])))
            }
        }
    }

    fn single(&mut self) -> Result<Expression, Wrong> {
        match self.peek() {
            Some('(') => {
                self.next();
                let inner = self.sum()?;
                self.expect(')')?;
                Ok(inner)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => {
                let number = self.run(|before, c| {
                    let is_exponent = matches!(before, Some('e' | 'E'));
                    c.is_ascii_digit() || "._eE".contains(c) || is_exponent && "+-".contains(c)
                });
                let value = number.replace('_', "").parse();
                let value = value.map_err(|_| format!("`{number}` is no number"))?;
                Ok(Expression::Number(value))
            }
            Some(c) if is_of_word(c) || "\"'".contains(c) => self.named(),
            Some(c) => Err(typographic(c)
                .unwrap_or_else(|| format!("found `{c}`, expected a number, a name or `(`"))
                .into()),
            None => Err("the expression ends, expected a number, a name or `(`"
                .to_owned()
                .into()),
        }
    }

    /// A function with its arguments, or a parameter of a law.
    fn named(&mut self) -> Result<Expression, Wrong> {
        let name = self.name()?;
        if self.take(".").is_some() {
            let parameter = self.name()?;
            return Ok(Expression::Reference(Reference::Parameter(name, parameter)));
        }
        if self.peek() != Some('(') {
            return Err(Wrong::NameAlone(name));
        }
        self.next();
        let is_it = |id: &str| id == name;
        let call = if let Some((_, of)) = MODULI.iter().find(|(id, _)| is_it(id)) {
            Expression::Reference(of(self.name()?))
        } else if let Some((id, function)) = FUNCTIONS.iter().find(|(id, _)| is_it(id)) {
            Expression::Call((*id, *function), Box::new(self.sum()?))
        } else if let Some((_, choose)) = EXTREMES.iter().find(|(id, _)| is_it(id)) {
            let mut all = vec![self.sum()?];
            while self.take(",").is_some() {
                all.push(self.sum()?);
            }
            Expression::Extreme(*choose, all)
        } else {
            let functions = FUNCTIONS.iter().map(|(id, _)| *id);
            let others = EXTREMES.iter().map(|(id, _)| *id);
            let moduli = MODULI.iter().map(|(id, _)| *id);
            let known = functions.chain(others).chain(moduli);
            let hint = if name == "ln" {
                "did you mean `log`? It is the natural logarithm".to_owned()
            } else {
                text::suggestion(&name, known)
            };
            return Err(format!("there is no function `{name}`, {hint}").into());
        };
        self.expect(')')?;
        Ok(call)
    }

    /// A word, or anything in quotes.
    fn name(&mut self) -> Result<String, Wrong> {
        if let Some(quote) = self.take("\"'") {
            let name = self.run(|_, c| c != quote);
            self.expect(quote)?;
            return Ok(name.to_owned());
        }
        self.peek();
        match self.run(|_, c| is_of_word(c)) {
            "" => Err("a name is missing".to_owned().into()),
            word => Ok(word.to_owned()),
        }
    }
}

/// What to say of a sign that word processors make of a minus.
fn typographic(c: char) -> Option<String> {
    let is_it = matches!(c, '\u{2212}' | '\u{2013}');
    is_it.then(|| format!("`{c}` is a typographic minus: write `-`"))
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}
