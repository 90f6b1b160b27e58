//! Arguments of a routine in one block of words, apart from each other by guard words.
//!
//! After each call, read-only arguments are compared with what was handed over, and guard words with what they
//! held. So damage is found where it is done, and not in the results of another argument.

use super::{Order, Refusal};
use abi::raw;
use std::fmt::Write as _;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Guard words on each side of an argument.
const N_GUARD: usize = 24;
/// Guard words on each side of an array of results. A wrong number of a state variable, or a DDSDDE of six
/// components where there is room for four, ends in them and not in the next array.
const N_WIDE: usize = 256;
/// What guard words hold: a signalling NaN. A read shows in the results. A computed value that is
/// written back shows in the word, since every operation makes it a quiet NaN.
const GUARD: u64 = 0x7ff4_dead_beef_dead;

/// What an argument consists of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Real,
    Integer,
    Text,
}

/// What a routine may do with an argument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Role {
    /// Write it: an array of results, from which a routine may go astray.
    Array,
    /// Write it.
    Output,
    /// Read it. Its program computes it again for every call, as is done here, so that nobody sees what a
    /// routine leaves there; some use it as their own.
    Copy,
    /// Read it: sizes, names and numbers, and the parameters, which all points share.
    Fixed,
}

impl Role {
    fn is_written(self) -> bool {
        matches!(self, Self::Array | Self::Output)
    }
}

/// Stress along the axes that a plane problem lacks, relative to the largest, that is rounding.
const OUT_OF_PLANE: f64 = 1e-9;

/// Name, kind and role of an argument.
pub(super) type Argument = (&'static str, Kind, Role);

/// The arguments of a call.
#[derive(Clone, Debug)]
pub(super) struct Block<const N: usize> {
    pub(super) words: Vec<u64>,
    /// First word of every argument.
    pub(super) at: [usize; N],
    /// Number of entries of every argument.
    entries: [usize; N],
    arguments: &'static [Argument; N],
    /// Read-only values that were handed over, one after the other.
    given: Vec<u64>,
    /// Guard words do not hold what they should.
    is_damaged: bool,
    /// What some of them hold in place of the usual.
    beside: Option<Beside>,
}

/// Another number in guard words: in front of that argument, after the last one if absent, or everywhere.
#[derive(Clone, Copy, Debug)]
struct Beside {
    gap: Option<usize>,
    word: u64,
}

impl<const N: usize> Block<N> {
    /// Arguments of this many entries, all of them zero.
    pub(super) fn new(arguments: &'static [Argument; N], entries: [usize; N]) -> Self {
        let mut at = [0; N];
        let mut end = gap(None, arguments.first());
        for (i, argument) in arguments.iter().enumerate() {
            at[i] = end;
            end += n_words(argument.1, entries[i]) + gap(Some(argument), arguments.get(i + 1));
        }
        let mut block = Self {
            words: vec![GUARD; end],
            at,
            entries,
            arguments,
            given: Vec::new(),
            is_damaged: false,
            beside: None,
        };
        for i in 0..N {
            let all = block.range(i);
            block.words[all].fill(0);
        }
        block
    }

    fn range(&self, i: usize) -> std::ops::Range<usize> {
        let first = self.at[i];
        first..first + n_words(self.arguments[i].1, self.entries[i])
    }

    /// Takes the arguments of another block of the same sizes.
    pub(super) fn refresh(&mut self, template: &Self) {
        if self.is_damaged {
            self.stand_guard(self.beside);
        }
        for i in 0..N {
            let all = self.range(i);
            self.words[all.clone()].copy_from_slice(&template.words[all]);
        }
    }

    /// Fills the guard words.
    fn stand_guard(&mut self, beside: Option<Beside>) {
        self.beside = beside;
        self.is_damaged = false;
        for gap in 0..=N {
            let (all, word) = (self.gap(gap), self.guard(gap));
            self.words[all].fill(word);
        }
    }

    /// Guard words in front of an argument, or after the last one.
    fn gap(&self, gap: usize) -> std::ops::Range<usize> {
        let from = gap
            .checked_sub(1)
            .map_or(0, |before| self.range(before).end);
        from..self.at.get(gap).copied().unwrap_or(self.words.len())
    }

    /// What they hold.
    fn guard(&self, gap: usize) -> u64 {
        let other = self
            .beside
            .filter(|other| other.gap.is_none_or(|own| own == gap));
        other.map_or(GUARD, |other| other.word)
    }

    /// Their place, in words.
    fn place(&self, gap: usize) -> String {
        let beyond = gap.checked_sub(1).map(|i| {
            let (name, size) = (self.arguments[i].0, self.entries[i]);
            format!("beyond the end of {name}, which has {size} entries")
        });
        let in_front = self.arguments.get(gap);
        let in_front = in_front.map(|argument| format!("in front of {}", argument.0));
        let both: Vec<String> = beyond.into_iter().chain(in_front).collect();
        both.join(", or ")
    }

    /// Writes the first entries of an argument.
    pub(super) fn set(&mut self, argument: impl Into<usize>, values: &[f64]) {
        let all = self.range(argument.into());
        for (word, value) in self.words[all].iter_mut().zip(values) {
            *word = value.to_bits();
        }
    }

    pub(super) fn set_integers(&mut self, argument: impl Into<usize>, values: &[i32]) {
        let all = self.range(argument.into());
        for (word, pair) in self.words[all].iter_mut().zip(values.chunks(2)) {
            let half = |i: usize| pair.get(i).copied().unwrap_or_default().to_ne_bytes();
            let ([a, b, c, d], [e, f, g, h]) = (half(0), half(1));
            *word = u64::from_ne_bytes([a, b, c, d, e, f, g, h]);
        }
    }

    /// Writes as many characters as there are eights of them.
    pub(super) fn set_text(&mut self, argument: impl Into<usize>, text: &str) {
        let all = self.range(argument.into());
        let (characters, _) = text.as_bytes().as_chunks::<8>();
        for (word, eight) in self.words[all].iter_mut().zip(characters) {
            *word = u64::from_ne_bytes(*eight);
        }
    }

    pub(super) fn reals(&self, argument: impl Into<usize>) -> impl Iterator<Item = f64> {
        let words = &self.words[self.range(argument.into())];
        words.iter().map(|word| f64::from_bits(*word))
    }

    pub(super) fn integer(&self, argument: impl Into<usize>) -> i32 {
        let [a, b, c, d, ..] = self.words[self.at[argument.into()]].to_ne_bytes();
        i32::from_ne_bytes([a, b, c, d])
    }

    /// Refuses results that hold a NaN: a smaller increment may mend it, unless there is none at all.
    ///
    /// # Errors
    /// The first of these results that does.
    pub(super) fn finite<A: Into<usize> + Copy>(
        &self,
        results: &[A],
        is_at_rest: bool,
    ) -> Result<(), Refusal> {
        let mut results = results.iter().map(|result| (*result).into());
        let Some(bad) = results.find(|i: &usize| !self.reals(*i).all(f64::is_finite)) else {
            return Ok(());
        };
        let name = self.arguments[bad].0;
        let (status, when) = if is_at_rest {
            (raw::PILUM_E_INTERNAL, ", without any strain")
        } else {
            (raw::PILUM_E_NUMERIC, "")
        };
        let message = format!("the routine leaves {name} with values that are not finite{when}");
        Err(Refusal::error(status, message))
    }

    /// A stress at one of these places that a plane problem lacks, and that is no rounding.
    pub(super) fn out_of_plane(
        &self,
        stress: impl Into<usize> + Copy,
        places: impl Iterator<Item = usize>,
    ) -> Option<f64> {
        let all: Vec<f64> = self.reals(stress).collect();
        let largest = all.iter().fold(0.0_f64, |max, v| max.max(v.abs()));
        let mut values = places.map(|place| all[place]);
        values.find(|v| v.abs() > OUT_OF_PLANE * largest)
    }

    /// Copies rows and columns at these places of a square matrix, row by row.
    pub(super) fn read_matrix(
        &self,
        matrix: impl Into<usize>,
        order: Order,
        places: &[usize],
        to: &mut [f64],
    ) {
        let all: Vec<f64> = self.reals(matrix).collect();
        let size = all.len().isqrt();
        let pairs = places
            .iter()
            .flat_map(|row| places.iter().map(move |column| (row, column)));
        for (to, (row, column)) in to.iter_mut().zip(pairs) {
            *to = match order {
                Order::Columns => all[row + column * size],
                Order::Rows => all[row * size + column],
            };
        }
    }

    /// The words of an argument and the number of its entries.
    pub(super) fn entries(&self, i: usize) -> (&[u64], usize) {
        (&self.words[self.range(i)], self.entries[i])
    }

    /// Keeps what is handed over, to see what becomes of it.
    pub(super) fn hand_over(&mut self) {
        self.given.clear();
        for i in 0..N {
            if !self.arguments[i].2.is_written() {
                let all = self.range(i);
                self.given.extend_from_slice(&self.words[all]);
            }
        }
    }

    /// Copies that a call has written to, by bits.
    ///
    /// # Errors
    /// The first argument that it has written to without right, in words.
    pub(super) fn overwritten(&mut self) -> Result<u64, Refusal> {
        let damage = self.damage();
        self.is_damaged = damage.is_some();
        if let Some(damage) = damage {
            return Err(Refusal::error(raw::PILUM_E_INTERNAL, damage));
        }
        let mut copies = 0;
        let mut given = self.given.as_slice();
        for (i, (name, _, role)) in self.arguments.iter().enumerate() {
            if role.is_written() {
                continue;
            }
            let words = &self.words[self.range(i)];
            let (own, rest) = given.split_at(words.len());
            given = rest;
            if own == words {
                continue;
            }
            if *role == Role::Fixed {
                return Err(Refusal::error(
                    raw::PILUM_E_INTERNAL,
                    format!("the routine overwrites {name}, which is an input"),
                ));
            }
            copies |= 1 << i;
        }
        Ok(copies)
    }

    /// The first guard words that do not hold what they should, in words.
    fn damage(&self) -> Option<String> {
        let is_damaged = |gap: &usize| {
            let (guards, expected) = (&self.words[self.gap(*gap)], self.guard(*gap));
            let off = guards.iter().fold(0, |all, word| all | (word ^ expected));
            off != 0
        };
        (0..=N).find(is_damaged).map(|gap| self.told(gap))
    }

    /// What was written into the guard words in front of this argument: whose it was to be by its distance, its
    /// place, counted from 1 as in Fortran, and its value.
    fn told(&self, after: usize) -> String {
        let (guards, expected) = (&self.words[self.gap(after)], self.guard(after));
        let written: Vec<usize> = (0..guards.len())
            .filter(|&i| guards[i] != expected)
            .collect();
        let (first, last) = (written[0], written[written.len() - 1]);
        let left = guards.len() - 1 - last;
        let beyond = after.checked_sub(1).map(|i| {
            let (name, kind, _) = self.arguments[i];
            let size = self.entries[i];
            let entry = (kind == Kind::Real).then(|| signed(size) + signed(first) + 1);
            let place = format!("beyond the end of {name}, which has {size} entries");
            (first, place, entry, first)
        });
        let in_front = self.arguments.get(after).map(|(name, kind, _)| {
            let entry = (*kind == Kind::Real).then(|| -signed(left));
            (left, format!("in front of {name}"), entry, last)
        });
        let (near, far) = match (beyond, in_front) {
            (Some(a), Some(b)) if b.0 < a.0 => (b, Some(a)),
            (Some(a), b) => (a, b),
            (None, Some(b)) => (b, None),
            (None, None) => return "the routine writes beside its arguments".to_owned(),
        };
        let (distance, place, entry, at) = near;
        let mut told = format!("the routine writes {place}");
        if let Some(entry) = entry {
            let value = f64::from_bits(guards[at]);
            let value = if value.is_normal() || value == 0.0 {
                format!(" becomes {value:e}")
            } else {
                String::new()
            };
            let _ = write!(told, ": entry {entry}{value}");
            if written.len() > 1 {
                let _ = write!(told, ", {} in all", written.len());
            }
        }
        if distance >= N_GUARD / 2
            && let Some((_, other, entry, _)) = far
        {
            let entry = entry.map_or(String::new(), |entry| format!(": entry {entry}"));
            let _ = write!(told, " (or {other}{entry})");
        }
        told
    }
}

/// Data common to all calls of a material, one block for each simultaneous call, and what calls have done to them.
#[derive(Debug)]
pub(super) struct Blocks<const N: usize> {
    template: Block<N>,
    unused: Mutex<Vec<Block<N>>>,
    beside: Mutex<Option<Beside>>,
    /// Whose turn it is, if calls must follow one another.
    turn: Option<Mutex<()>>,
    /// Copies that the routine has overwritten, by bits, and those that have been reported.
    overwritten: AtomicU64,
    told: AtomicU64,
}

impl<const N: usize> Blocks<N> {
    pub(super) fn new(template: Block<N>, is_serial: bool) -> Self {
        Self {
            template,
            unused: Mutex::default(),
            beside: Mutex::default(),
            turn: is_serial.then(Mutex::default),
            overwritten: AtomicU64::new(0),
            told: AtomicU64::new(0),
        }
    }

    /// Takes note of the copies that a call has written to.
    ///
    /// # Errors
    /// The first argument that it has written to without right, in words.
    pub(super) fn returned(&self, block: &mut Block<N>) -> Result<(), Refusal> {
        let overwritten = block.overwritten()?;
        if overwritten != 0 {
            self.overwritten.fetch_or(overwritten, Ordering::Relaxed);
        }
        Ok(())
    }

    /// Names of the copies that were written to, those that were not told before.
    pub(super) fn take_overwritten(&self) -> Vec<String> {
        let overwritten = self.overwritten.load(Ordering::Relaxed);
        let told = self.told.swap(overwritten, Ordering::Relaxed);
        let new = (0..N).filter(|i| (overwritten & !told) >> i & 1 == 1);
        new.map(|i| self.template.arguments[i].0.to_owned())
            .collect()
    }

    pub(super) fn template(&self) -> &Block<N> {
        &self.template
    }

    /// Puts a number into the guard words in front of that argument, or all, of calls from now on; the usual one if
    /// none exists. In words where that is; `None` if there is no such place.
    pub(super) fn put_beside(&self, gap: Option<usize>, value: Option<f64>) -> Option<String> {
        if gap.is_some_and(|gap| gap > N) {
            return None;
        }
        let word = value.map(f64::to_bits);
        let beside = word.map(|word| Beside { gap, word });
        *self.beside.lock().unwrap_or_else(PoisonError::into_inner) = beside;
        let mut unused = self.unused.lock().unwrap_or_else(PoisonError::into_inner);
        unused
            .iter_mut()
            .for_each(|block| block.stand_guard(beside));
        Some(gap.map_or_else(String::new, |gap| self.template.place(gap)))
    }

    /// Makes calls with a block that no other call uses, when it is their turn.
    pub(super) fn with<T>(&self, calls: impl FnOnce(&mut Block<N>) -> T) -> T {
        let turn = self.turn.as_ref();
        let _turn = turn.map(|turn| turn.lock().unwrap_or_else(PoisonError::into_inner));
        let unused = || self.unused.lock().unwrap_or_else(PoisonError::into_inner);
        let one = unused().pop();
        let mut block = one.unwrap_or_else(|| {
            let mut block = self.template.clone();
            block.stand_guard(*self.beside.lock().unwrap_or_else(PoisonError::into_inner));
            block
        });
        let made = calls(&mut block);
        unused().push(block);
        made
    }
}

fn signed(n: usize) -> i64 {
    i64::try_from(n).unwrap_or(i64::MAX)
}

/// Guard words between two arguments.
fn gap(before: Option<&Argument>, after: Option<&Argument>) -> usize {
    let is_wide = |argument: Option<&Argument>| argument.is_some_and(|a| a.2 == Role::Array);
    if is_wide(before) || is_wide(after) {
        N_WIDE
    } else {
        N_GUARD
    }
}

fn n_words(kind: Kind, entries: usize) -> usize {
    match kind {
        Kind::Real => entries,
        Kind::Integer => entries.div_ceil(2),
        Kind::Text => entries.div_ceil(8),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARGUMENTS: [Argument; 4] = [
        ("A", Kind::Real, Role::Array),
        ("B", Kind::Real, Role::Array),
        ("N", Kind::Integer, Role::Fixed),
        ("C", Kind::Real, Role::Copy),
    ];

    fn block() -> Block<4> {
        let mut block = Block::new(&ARGUMENTS, [2, 4, 1, 3]);
        block.hand_over();
        block
    }

    /// The message about a word, counted from the first one of an argument, that becomes 2.5.
    fn said(argument: usize, word: isize) -> Result<u64, String> {
        let mut block = block();
        let at = block.at[argument].checked_add_signed(word).unwrap();
        block.words[at] = 2.5_f64.to_bits();
        block.overwritten().map_err(|refusal| refusal.message)
    }

    #[test]
    fn what_is_written_beside_an_array_is_told_with_its_place() {
        let rows = "
0 2 beyond the end of A, which has 2 entries: entry 3 becomes 2.5e0
0 -1 in front of A: entry 0 becomes 2.5e0
0 41 beyond the end of A, which has 2 entries: entry 42 becomes 2.5e0 (or in front of B: entry -216)
1 -16 in front of B: entry -15 becomes 2.5e0 (or beyond the end of A, which has 2 entries: entry 243)
2 1 beyond the end of N, which has 1 entries
3 3 beyond the end of C, which has 3 entries: entry 4 becomes 2.5e0";
        for row in rows.trim().lines() {
            let [argument, word, expected] = row.splitn(3, ' ').collect::<Vec<_>>()[..] else {
                unreachable!()
            };
            let why = said(argument.parse().unwrap(), word.parse().unwrap()).unwrap_err();
            assert_eq!(why, format!("the routine writes {expected}"));
        }
    }

    #[test]
    fn results_are_written_copies_used_up_and_the_rest_is_left() {
        assert_eq!(said(0, 1), Ok(0));
        assert_eq!(said(3, 1), Ok(1 << 3));
        let why = said(2, 0).unwrap_err();
        assert_eq!(why, "the routine overwrites N, which is an input");
    }

    #[test]
    fn another_number_stands_where_it_is_put_and_is_guarded() {
        let blocks = Blocks::new(block(), true);
        let seen = |at: isize| {
            blocks.with(|block| {
                let word = block.words[block.at[1].checked_add_signed(at).unwrap()];
                assert!(block.overwritten().is_ok());
                word
            })
        };
        assert_eq!(seen(4), GUARD);
        let place = blocks.put_beside(Some(2), Some(1.0)).unwrap();
        assert_eq!(
            place,
            "beyond the end of B, which has 4 entries, or in front of N"
        );
        assert_eq!(seen(4), 1.0_f64.to_bits());
        assert_eq!(seen(-1), GUARD);
        blocks.put_beside(None, Some(-1.0)).unwrap();
        assert_eq!(seen(-1), (-1.0_f64).to_bits());
        blocks.put_beside(None, None).unwrap();
        assert_eq!(seen(-1), GUARD);
        assert_eq!(blocks.put_beside(Some(5), None), None);
    }

    #[test]
    fn a_block_is_whole_again_after_damage() {
        let (mut block, template) = (block(), block());
        for _ in 0..2 {
            let end = block.words.len();
            block.words[3] = 0;
            block.words[end - 1] = 0;
            assert!(block.overwritten().is_err());
            block.refresh(&template);
            assert_eq!(block.words, template.words);
            assert!(block.overwritten().is_ok());
        }
    }
}
