//! The bytes of a mesh file, number by number, in either encoding, and the place of each.

use std::cell::Cell;

/// The defect of a file, and its place.
pub(super) type Fault = String;

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    /// As text, with blanks between them.
    Text,
    /// As the bytes of a machine: whole numbers of 4 bytes, sizes and reals of 8.
    Binary {
        /// The first byte is the largest part of a number.
        big_endian: bool,
    },
}

/// Reads a file from its start to its end. Whatever a file says, nothing is set aside for more than
/// its bytes can hold.
#[derive(Debug)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    /// How numbers in sections are written; names of sections are text in any case.
    pub(super) encoding: Encoding,
    /// Bytes and lines counted so far, so that counting goes on from there.
    counted: Cell<(usize, usize)>,
    /// Where sections begin, with their names.
    sections: Vec<(usize, String)>,
    /// The bytes were made of arrays: nobody has written them, and rows count from 0.
    pub(super) is_of_arrays: bool,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self {
            bytes,
            at: 0,
            encoding: Encoding::Text,
            counted: Cell::new((0, 1)),
            sections: Vec::new(),
            is_of_arrays: false,
        }
    }

    /// The byte at which the next number begins.
    pub(super) fn at(&self) -> usize {
        let rest = self.rest().iter();
        match self.encoding {
            Encoding::Text => self.at + rest.take_while(|b| b.is_ascii_whitespace()).count(),
            Encoding::Binary { .. } => self.at,
        }
    }

    /// The defect at a byte: with the line, or in a binary file the section and the byte; alone where the bytes
    /// were made of arrays.
    pub(super) fn fault(&self, at: usize, message: &str) -> Fault {
        if self.is_of_arrays {
            return message.to_owned();
        }
        if self.encoding == Encoding::Text {
            let (from, mut line) = match self.counted.get() {
                counted if counted.0 <= at => counted,
                _ => (0, 1),
            };
            let upto = at.min(self.bytes.len());
            line += newlines(&self.bytes[from..upto]);
            self.counted.set((upto, line));
            return format!("line {line}: {message}");
        }
        let section = self.sections.iter().rev().find(|(from, _)| *from <= at);
        match section {
            Some((_, name)) => format!("${name}, byte {at}: {message}"),
            None => format!("byte {at}: {message}"),
        }
    }

    /// Whether the file begins with a text.
    pub(super) fn begins_with(&self, text: &str) -> bool {
        self.bytes.starts_with(text.as_bytes())
    }

    /// Whether this is the next byte that is no blank.
    pub(super) fn is_at(&self, byte: u8) -> bool {
        let mut rest = self.rest().iter();
        rest.find(|b| !b.is_ascii_whitespace()) == Some(&byte)
    }

    fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    fn skip_blanks(&mut self) {
        let blanks = self.rest().iter().take_while(|b| b.is_ascii_whitespace());
        self.at += blanks.count();
    }

    /// The rest of the line, without its end.
    pub(super) fn line(&mut self) -> &'a [u8] {
        let rest = self.rest();
        let n = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.at += (n + 1).min(rest.len());
        rest[..n].trim_ascii()
    }

    /// The name of the next section; `None` at the end of the file. Between sections there may be
    /// empty lines, and remarks that begin with `#`.
    pub(super) fn section(&mut self) -> Result<Option<String>, Fault> {
        loop {
            self.skip_blanks();
            let at = self.at;
            let line = self.line();
            match line {
                [] => return Ok(None),
                [b'#', ..] => {}
                [b'$', name @ ..] if name.iter().all(u8::is_ascii_alphanumeric) => {
                    let name = String::from_utf8_lossy(name).into_owned();
                    self.sections.push((self.at, name.clone()));
                    return Ok(Some(name));
                }
                _ => {
                    let found = shown(line);
                    return Err(self.fault(at, &format!("expected a `$Section`, found `{found}`")));
                }
            }
        }
    }

    /// The end of a section.
    pub(super) fn end(&mut self, name: &str) -> Result<(), Fault> {
        self.skip_blanks();
        let at = self.at;
        let line = self.line();
        if line.strip_prefix(b"$End") == Some(name.as_bytes()) {
            return Ok(());
        }
        let found = if line.is_empty() {
            "the end of the file".to_owned()
        } else {
            format!("`{}`", shown(line))
        };
        Err(self.fault(at, &format!("expected `$End{name}`, found {found}")))
    }

    /// Goes behind the end of a section that is not read.
    pub(super) fn skip_to_end(&mut self, name: &str) -> Result<(), Fault> {
        let from = self.at;
        let end = format!("$End{name}");
        let found = self
            .rest()
            .windows(end.len())
            .position(|window| window == end.as_bytes());
        let Some(found) = found else {
            return Err(self.fault(from, &format!("section `${name}` has no `{end}`")));
        };
        self.at += found;
        self.end(name)
    }

    fn token(&mut self, what: &str) -> Result<(usize, &'a str), Fault> {
        self.skip_blanks();
        let (at, rest) = (self.at, self.rest());
        let n = rest.iter().position(u8::is_ascii_whitespace);
        let token = &rest[..n.unwrap_or(rest.len())];
        let ends = match token {
            [] => Some("the file ends here"),
            [b'$', ..] => Some("the section ends here"),
            _ => None,
        };
        if let Some(ends) = ends {
            return Err(self.fault(at, &format!("{ends}, expected {what}")));
        }
        self.at += token.len();
        match std::str::from_utf8(token) {
            Ok(token) => Ok((at, token)),
            Err(_) => Err(self.not_that(at, token, what)),
        }
    }

    fn not_that(&self, at: usize, token: &[u8], what: &str) -> Fault {
        self.fault(at, &format!("expected {what}, found `{}`", shown(token)))
    }

    fn parsed<T: std::str::FromStr>(&mut self, what: &str) -> Result<T, Fault> {
        let (at, token) = self.token(what)?;
        let parsed = token.parse();
        parsed.map_err(|_| self.not_that(at, token.as_bytes(), what))
    }

    /// The next bytes, the least significant one first.
    fn taken<const N: usize>(&mut self, what: &str) -> Result<[u8; N], Fault> {
        let Some((taken, _)) = self.rest().split_first_chunk::<N>() else {
            let at = self.bytes.len();
            return Err(self.fault(at, &format!("the file ends here, expected {what}")));
        };
        self.at += N;
        let mut taken = *taken;
        if self.encoding == (Encoding::Binary { big_endian: true }) {
            taken.reverse();
        }
        Ok(taken)
    }

    /// A whole number.
    pub(super) fn integer(&mut self, what: &str) -> Result<i64, Fault> {
        match self.encoding {
            Encoding::Text => self.parsed(what),
            Encoding::Binary { .. } => Ok(i32::from_le_bytes(self.taken(what)?).into()),
        }
    }

    /// A number of things, or in format 4.1 one that names a node or an element.
    pub(super) fn size(&mut self, what: &str) -> Result<u64, Fault> {
        match self.encoding {
            Encoding::Text => self.parsed(what),
            Encoding::Binary { .. } => Ok(u64::from_le_bytes(self.taken(what)?)),
        }
    }

    /// A whole number that is not negative.
    pub(super) fn natural(&mut self, what: &str) -> Result<u64, Fault> {
        let at = self.at();
        let number = self.integer(what)?;
        u64::try_from(number)
            .map_err(|_| self.fault(at, &format!("{what} is {number}, expected 0 or more")))
    }

    /// A number of things, of which each takes `numbers` numbers and `bytes` bytes at least.
    pub(super) fn count(
        &mut self,
        what: &str,
        numbers: usize,
        bytes: usize,
    ) -> Result<usize, Fault> {
        let before = self.at();
        let count = self.size(what)?;
        self.check_count(before, count, what, numbers, bytes)
    }

    /// The same, of a number that was read at `before`.
    pub(super) fn check_count(
        &self,
        before: usize,
        count: u64,
        what: &str,
        numbers: usize,
        bytes: usize,
    ) -> Result<usize, Fault> {
        let each = match self.encoding {
            // A digit and a blank.
            Encoding::Text => 2 * numbers,
            Encoding::Binary { .. } => bytes,
        };
        let room = self.rest().len() / each.max(1);
        match usize::try_from(count) {
            Ok(count) if count <= room => Ok(count),
            _ => {
                let message = format!("{what} is {count}, more than the rest of the file can hold");
                Err(self.fault(before, &message))
            }
        }
    }

    /// A number.
    pub(super) fn real(&mut self, what: &str) -> Result<f64, Fault> {
        match self.encoding {
            Encoding::Text => self.parsed(what),
            Encoding::Binary { .. } => Ok(f64::from_le_bytes(self.taken(what)?)),
        }
    }
}

/// Lines that end in these bytes.
fn newlines(bytes: &[u8]) -> usize {
    bytes.split(|&b| b == b'\n').count() - 1
}

/// Content of a file, as far as it can be shown.
fn shown(bytes: &[u8]) -> String {
    const MOST: usize = 40;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(MOST)]);
    let plain = text.chars().map(|c| if c.is_control() { '·' } else { c });
    let rest = if bytes.len() > MOST { "…" } else { "" };
    plain.collect::<String>() + rest
}
