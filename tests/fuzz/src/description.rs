//! What a library says about its laws: structs in valid memory, with sizes, counts, numbers and
//! texts from the input. The host may believe nothing of it but that it is as long as it says.
#![expect(
    unsafe_code,
    reason = "a description is memory that the host is asked to read"
)]

use crate::ways_in;
use abi::raw::{Law, Parameter, Plugin, Variable};
use abi::version::{FORMULATION_SIZE_1_0, LAW_SIZE_1_0, PARAMETER_SIZE_1_0, VARIABLE_SIZE_1_0};
use std::ffi::c_void;
use std::mem::size_of;
use std::ptr::with_exposed_provenance;

/// Entries of a table that is as long as the host takes.
const LONGEST: usize = 256;
/// Length of a text that is longer than the host takes.
const LONG_TEXT: usize = 5000;

pub(super) fn read(data: &[u8]) {
    let mut memory = Memory {
        input: data,
        words: Vec::new(),
        texts: Vec::new(),
    };
    let laws: Vec<usize> = match memory.count() {
        0 => Vec::new(),
        n => {
            let few: Vec<usize> = (0..n.min(3)).map(|_| memory.law()).collect();
            few.iter().copied().cycle().take(n).collect()
        }
    };
    let n_laws = memory.declared(laws.len());
    let plugin = Plugin {
        struct_size: size_of::<Plugin>() as u32,
        n_laws,
        law: with_exposed_provenance(memory.keep(laws)),
        get_extension: None,
    };
    // SAFETY: `memory` holds every table with as many entries as are declared (a count beyond
    // `LONGEST` is refused before the table is read), every list and text with its end.
    let described = unsafe { ways_in::describe_memory(&plugin) };
    if let Ok(laws) = described {
        assert_eq!(laws.len(), n_laws as usize, "laws are lost");
        let ids = laws.iter().map(|law| &law.id);
        assert!(ids.clone().all(|id| !id.is_empty()), "a law without an id");
    }
    drop(memory);
}

/// Structs as 64-bit words, and texts; addresses are exposed, since they go through integers.
struct Memory<'a> {
    input: &'a [u8],
    words: Vec<Box<[usize]>>,
    texts: Vec<Box<[u8]>>,
}

const _: () = assert!(size_of::<Law>() == 8 * 15 && size_of::<Parameter>() == 8 * 11);
const _: () = assert!(size_of::<Variable>() == 8 * 8 && size_of::<usize>() == 8);

unsafe extern "C" fn nothing() {}

impl Memory<'_> {
    fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.input.split_first() else {
            return 0;
        };
        self.input = rest;
        *first
    }

    fn take<const N: usize>(&mut self) -> [u8; N] {
        std::array::from_fn(|_| self.byte())
    }

    fn real(&mut self) -> usize {
        let value = match self.byte() {
            0 => 0.0,
            1 => 1.0,
            2 => -1.0,
            3 => f64::NAN,
            4 => f64::INFINITY,
            5 => f64::NEG_INFINITY,
            6 => 1e300,
            _ => f64::from_bits(u64::from_le_bytes(self.take())),
        };
        value.to_bits() as usize
    }

    /// Entries of a table: few, or as many as can be.
    fn count(&mut self) -> usize {
        match self.byte() {
            n @ 0..=7 => usize::from(n),
            255 => LONGEST,
            n => usize::from(n % 4),
        }
    }

    /// The count that is reported of a table: true, or beyond what is read.
    fn declared(&mut self, n: usize) -> u32 {
        match self.byte() {
            250..=255 => u32::from_le_bytes(self.take()).max(LONGEST as u32 + 1),
            _ => n as u32,
        }
    }

    fn keep(&mut self, words: Vec<usize>) -> usize {
        let words = words.into_boxed_slice();
        let at = words.as_ptr().expose_provenance();
        self.words.push(words);
        at
    }

    /// Null, a text from the input, an identifier, a long one, or an earlier one.
    fn text(&mut self) -> usize {
        let mut text: Vec<u8> = match self.byte() {
            0 => return 0,
            length @ 1..=40 => (0..length).map(|_| self.byte()).collect(),
            41..=80 => vec![b'a' + self.byte() % 26],
            81..=90 => vec![b'x'; LONG_TEXT],
            91..=110 => vec![b'y'; LONG_TEXT - 1000],
            111..=115 => b"jump".to_vec(),
            116..=120 => b"traction".to_vec(),
            121..=125 => b"strain".to_vec(),
            126..=130 => b"stress".to_vec(),
            _ => {
                let n = self.texts.len();
                let number = usize::from(self.byte()).checked_rem(n).unwrap_or(0);
                return match self.texts.get(number) {
                    Some(text) => text.as_ptr().expose_provenance(),
                    None => 0,
                };
            }
        };
        text.push(0);
        let text = text.into_boxed_slice();
        let at = text.as_ptr().expose_provenance();
        self.texts.push(text);
        at
    }

    /// A list of texts, of at least `least` entries, with null after them.
    fn texts(&mut self, least: usize) -> usize {
        if self.byte() == 0 {
            return 0;
        }
        let n = self.count();
        let few: Vec<usize> = (0..n.clamp(1, 3)).map(|_| self.text()).collect();
        let mut list: Vec<usize> = few.iter().copied().cycle().take(n.max(least)).collect();
        list.push(0);
        self.keep(list)
    }

    /// Address and count of a table. Entries are of `size_1_0` bytes, or as the input says.
    fn table(&mut self, size_1_0: usize, one: fn(&mut Self, u32) -> Vec<usize>) -> (usize, u32) {
        let n = self.count();
        let said = match self.byte() {
            250 => u32::from(self.byte()),
            251 => u32::from_le_bytes(self.take()),
            252 => (size_1_0 + 8 * usize::from(self.byte())) as u32,
            _ => size_1_0 as u32,
        };
        // Sizes that are refused need no memory but the first entry's.
        let stride = if (size_1_0..=4096).contains(&(said as usize)) {
            said as usize / 8
        } else {
            size_1_0 / 8
        };
        let few: Vec<Vec<usize>> = (0..n.min(4)).map(|_| one(self, said)).collect();
        let mut words = Vec::new();
        for entry in few.iter().cycle().take(n) {
            words.extend_from_slice(entry);
            words.resize(words.len() + stride - entry.len(), 0);
        }
        let declared = self.declared(n);
        if n == 0 && declared != 0 && self.byte().is_multiple_of(2) {
            return (0, declared);
        }
        // A table that is declared without being there is refused for its length or its null.
        let declared = if n == 0 { 0 } else { declared };
        (self.keep(words), declared)
    }

    fn flags(&mut self) -> usize {
        usize::from(self.byte())
    }

    fn parameter(&mut self, size: u32) -> Vec<usize> {
        vec![
            size as usize | self.flags() << 32,
            self.text(),
            self.text(),
            self.text(),
            self.text(),
            self.real(),
            self.real(),
            self.real(),
            self.real(),
            self.real(),
            self.texts(0),
        ]
    }

    fn variable(&mut self, size: u32) -> Vec<usize> {
        let n = match self.byte() {
            n @ 0..=7 => usize::from(n),
            255 => u32::from_le_bytes(self.take()) as usize,
            254 => LONGEST,
            n => usize::from(n % 3 + 1),
        };
        let names = if n > LONGEST { 0 } else { self.texts(n) };
        vec![
            size as usize | self.flags() << 32,
            self.text(),
            self.text(),
            self.text(),
            self.text(),
            self.flags() | n << 32,
            names,
            self.real(),
        ]
    }

    fn formulation(&mut self, size: u32) -> Vec<usize> {
        let hypothesis = self.flags() % 6;
        let flags = self.flags();
        let (gradient, n_gradients) = self.table(VARIABLE_SIZE_1_0, Self::variable);
        let (flux, n_fluxes) = self.table(VARIABLE_SIZE_1_0, Self::variable);
        let (state, n_states) = self.table(VARIABLE_SIZE_1_0, Self::variable);
        vec![
            size as usize | hypothesis << 32,
            flags | (n_gradients as usize) << 32,
            n_fluxes as usize | (n_states as usize) << 32,
            gradient,
            flux,
            state,
        ]
    }

    fn law(&mut self) -> usize {
        let function = |missing: bool| {
            if missing {
                return 0;
            }
            (nothing as *const c_void).expose_provenance()
        };
        let size = match self.byte() {
            255 => u32::from(self.byte()),
            254 => return 0,
            _ => LAW_SIZE_1_0 as u32,
        }
        .min(LAW_SIZE_1_0 as u32);
        let (parameter, n_parameters) = self.table(PARAMETER_SIZE_1_0, Self::parameter);
        let (formulation, n_formulations) = self.table(FORMULATION_SIZE_1_0, Self::formulation);
        let texts: [usize; 7] = std::array::from_fn(|_| self.text());
        let missing = self.byte();
        let mut words = vec![
            size as usize | self.flags() << 32,
            n_parameters as usize | (n_formulations as usize) << 32,
        ];
        words.extend(texts);
        words.extend([
            parameter,
            formulation,
            function(missing == 1),
            function(missing == 2),
            function(missing == 3),
            function(missing == 4),
        ]);
        self.keep(words)
    }
}
