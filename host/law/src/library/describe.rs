//! Description of the laws of a library, copied out of its memory: nothing is believed but that structs, tables and texts
//! are as long as they say.

use super::{LawHandle, Laws};
use crate::description::{
    Bounds, FormulationDescription, InternalVariable, LawDescription, ParameterDescription,
    Tangent, is_identifier, words,
};
use abi::Hypothesis;
use abi::raw::{self, Formulation, Law, Parameter, Plugin, Variable};
use abi::version::VARIABLE_SIZE_1_0;
use abi::version::{FORMULATION_SIZE_1_0, LAW_SIZE_1_0, PARAMETER_SIZE_1_0};
use std::cell::Cell;
use std::ffi::c_char;
use std::mem::{MaybeUninit, size_of};

/// Longest text that is copied out of a library, in bytes.
const LONGEST_TEXT: usize = 4096;
/// Most bytes of text in a whole description: entries may share one long text.
const MOST_TEXT: usize = 16 << 20;
/// Most entries of any table that is copied out of a library.
const LONGEST_TABLE: u32 = 256;
/// Largest size of one entry of such a table that is plausible, in bytes.
const LONGEST_ENTRY: usize = 4096;
/// The struct at `p` as far as its writer knew it, see [`known_part`]. `None` if it is shorter than
/// it was in version 1.0.
///
/// # Safety
/// `p` points to a struct of the contract with as many bytes as its `struct_size` says; all-zero is
/// a valid `T`.
pub(super) unsafe fn known<T: Copy>(p: *const T, size_1_0: usize) -> Option<T> {
    // SAFETY: contract, "Growing structs": every struct starts with its size as `u32`.
    let size = unsafe { p.cast::<u32>().read() } as usize;
    // SAFETY: passed on to the caller.
    (size >= size_1_0).then(|| unsafe { known_part(p, size) })
}

/// The first `size` bytes at `p` as a `T`: the rule of growing structs in one place. No reference
/// to the library's struct is made, since one would promise all of today's fields. A field later
/// than version 1.0 reads as zero (null, none) if its writer did not know it, and what a later
/// writer knows beyond `T` is left alone.
///
/// # Safety
/// `p` is valid for `size` bytes, which cover at least version 1.0; all-zero is a valid `T`.
unsafe fn known_part<T: Copy>(p: *const T, size: usize) -> T {
    let mut copy = MaybeUninit::<T>::zeroed();
    // SAFETY: both sides hold that many bytes, see above.
    unsafe {
        p.cast::<u8>()
            .copy_to_nonoverlapping(copy.as_mut_ptr().cast(), size.min(size_of::<T>()));
        copy.assume_init()
    }
}

/// A table of structs that may be longer than ours, or end sooner where ours have grown since
/// version 1.0: the stride is the first entry's own size.
fn table<T: Copy>(first: *const T, n: u32, size_1_0: usize, what: &str) -> Result<Vec<T>, String> {
    if n == 0 {
        return Ok(Vec::new());
    }
    if n > LONGEST_TABLE {
        return Err(format!(
            "{n} {what} are declared, at most {LONGEST_TABLE} are plausible"
        ));
    }
    if first.is_null() {
        return Err(format!("{n} {what} are declared, but the table is null"));
    }
    // SAFETY: contract, "Growing structs": every struct starts with its size as `u32`.
    let stride = unsafe { first.cast::<u32>().read() } as usize;
    if stride < size_1_0 || !stride.is_multiple_of(align_of::<T>()) {
        return Err(format!(
            "the table of {what} has entries of {stride} bytes, expected at least {size_1_0}"
        ));
    }
    if stride > LONGEST_ENTRY {
        return Err(format!(
            "the table of {what} has entries of {stride} bytes, at most {LONGEST_ENTRY} are \
             plausible"
        ));
    }
    let entries = (0..n as usize).map(|i| {
        // SAFETY: contract, "Descriptions": `n` entries, static, of this stride; they are numbers
        // and pointers, of which zero is one.
        unsafe { known_part(first.byte_add(i * stride), stride) }
    });
    Ok(entries.collect())
}

/// How many bytes of text are still copied out of a library.
#[derive(Debug)]
pub(super) struct Allowance(Cell<usize>);

impl Default for Allowance {
    fn default() -> Self {
        Self(Cell::new(MOST_TEXT))
    }
}

/// Copies a text; null is an empty one.
pub(super) fn text(p: *const c_char, what: &str, allowance: &Allowance) -> Result<String, String> {
    if p.is_null() {
        return Ok(String::new());
    }
    let mut bytes = Vec::new();
    for i in 0..LONGEST_TEXT {
        // SAFETY: contract, "Descriptions": texts end in NUL; reading stops there.
        let byte = unsafe { p.add(i).read() } as u8;
        if byte == 0 {
            let left = allowance.0.get().checked_sub(bytes.len());
            allowance.0.set(left.ok_or_else(|| {
                format!("its texts are longer than {} MB together", MOST_TEXT >> 20)
            })?);
            let text = String::from_utf8(bytes)
                .map_err(|_| format!("the text of `{what}` is not UTF-8"))?;
            return Ok(text.trim().to_owned());
        }
        bytes.push(byte);
    }
    Err(format!(
        "the text of `{what}` is longer than {LONGEST_TEXT} bytes"
    ))
}

fn identifier(p: *const c_char, what: &str, allowance: &Allowance) -> Result<String, String> {
    let id = text(p, what, allowance)?;
    if is_identifier(&id) {
        Ok(id)
    } else {
        Err(format!("the id `{id}` of {what} is malformed"))
    }
}

fn unique<'a>(ids: impl Iterator<Item = &'a str>, what: &str) -> Result<(), String> {
    let mut seen = std::collections::HashSet::new();
    for id in ids {
        if !seen.insert(id) {
            return Err(format!("{what} `{id}` is declared twice"));
        }
    }
    Ok(())
}

/// Copies the description of a library that was never loaded, such as one made of random bytes.
///
/// # Errors
/// The defect, in words.
///
/// # Safety
/// Structs, tables and texts that it points to, directly or not, are as long as they say.
pub unsafe fn describe_memory(plugin: &Plugin) -> Result<Vec<LawDescription>, String> {
    let laws = describe(plugin)?;
    Ok(laws.into_iter().map(|(law, _)| law).collect())
}

pub(super) fn describe(plugin: &Plugin) -> Result<Laws, String> {
    if plugin.n_laws == 0 || plugin.n_laws > LONGEST_TABLE || plugin.law.is_null() {
        return Err(format!("it declares {} laws", plugin.n_laws));
    }
    let allowance = Allowance::default();
    let laws = (0..plugin.n_laws as usize)
        .map(|i| {
            // SAFETY: contract, "Descriptions": `n_laws` pointers to static laws.
            let at = unsafe { plugin.law.add(i).read() };
            if at.is_null() {
                return Err(format!("law {i} is null"));
            }
            // SAFETY: as above.
            let law = unsafe { known(at, LAW_SIZE_1_0) }
                .ok_or_else(|| format!("law {i}: `pilum_law` is truncated"))?;
            let described =
                describe_law(&law, &allowance).map_err(|why| format!("law {i}: {why}"))?;
            Ok((described, LawHandle { at, known: law }))
        })
        .collect::<Result<Vec<_>, String>>()?;
    unique(laws.iter().map(|(law, _)| law.id.as_str()), "law")?;
    Ok(laws)
}

fn describe_law(law: &Law, allowance: &Allowance) -> Result<LawDescription, String> {
    if law.create.is_none() || law.integrate.is_none() || law.destroy.is_none() {
        return Err("`create`, `integrate` or `destroy` is null".to_owned());
    }
    let parameters = table(
        law.parameter,
        law.n_parameters,
        PARAMETER_SIZE_1_0,
        "parameters",
    )?
    .iter()
    .map(|p| describe_parameter(p, allowance))
    .collect::<Result<Vec<_>, _>>()?;
    unique(parameters.iter().map(|p| p.id.as_str()), "parameter")?;
    let mut formulations = Vec::new();
    let declared = table(
        law.formulation,
        law.n_formulations,
        FORMULATION_SIZE_1_0,
        "formulations",
    )?;
    for (index, formulation) in (0..).zip(&declared) {
        // Hypotheses that came later than this host are passed over.
        if let Some(hypothesis) = Hypothesis::from_code(formulation.hypothesis) {
            formulations.push(describe_formulation(
                formulation,
                hypothesis,
                index,
                allowance,
            )?);
        }
    }
    unique(formulations.iter().map(|f| f.hypothesis), "hypothesis")?;
    Ok(LawDescription {
        id: identifier(law.id, "the law", allowance)?,
        name: text(law.name, "name", allowance)?,
        version: text(law.version, "version", allowance)?,
        author: text(law.author, "author", allowance)?,
        licence: text(law.licence, "licence", allowance)?,
        doc: text(law.doc, "doc", allowance)?,
        references: text(law.references, "references", allowance)?,
        parameters,
        formulations,
    })
}

fn describe_parameter(
    p: &Parameter,
    allowance: &Allowance,
) -> Result<ParameterDescription, String> {
    let id = identifier(p.id, "a parameter", allowance)?;
    let mut choices = Vec::new();
    if !p.choices.is_null() {
        for i in 0..LONGEST_TABLE as usize {
            // SAFETY: contract, "Parameters": the list of labels ends with null.
            let label = unsafe { p.choices.add(i).read() };
            if label.is_null() {
                break;
            }
            choices.push(text(label, &id, allowance)?);
        }
    }
    let bounds = Bounds {
        lower: p.lower,
        open_lower: p.flags & raw::PILUM_P_OPEN_LOWER != 0,
        upper: p.upper,
        open_upper: p.flags & raw::PILUM_P_OPEN_UPPER != 0,
    };
    // Comparisons with NaN are false, so a NaN bound fails too.
    if !(p.lower <= p.upper && p.usual_lower <= p.usual_upper) {
        return Err(format!("parameter `{id}`: its bounds are not in order"));
    }
    let default = (!p.default_value.is_nan()).then_some(p.default_value);
    if default.is_some_and(|value| !bounds.contain(value)) {
        return Err(format!(
            "parameter `{id}`: the default is outside its bounds {bounds}"
        ));
    }
    Ok(ParameterDescription {
        symbol: text(p.symbol, &id, allowance)?,
        unit: text(p.unit, &id, allowance)?,
        doc: text(p.doc, &id, allowance)?,
        id,
        default,
        optional: p.flags & raw::PILUM_P_OPTIONAL != 0,
        bounds,
        usual: Bounds::closed(p.usual_lower, p.usual_upper),
        choices,
    })
}

/// Refuses other gradients and fluxes than the pair of the hypothesis.
fn one_pair(
    formulation: &Formulation,
    hypothesis: Hypothesis,
    allowance: &Allowance,
) -> Result<(), String> {
    let name = hypothesis.name();
    let (gradient_id, flux_id) = words(hypothesis);
    let pair = [
        (gradient_id, formulation.gradient, formulation.n_gradients),
        (flux_id, formulation.flux, formulation.n_fluxes),
    ];
    for (expected, variables, n) in pair {
        let found = table(variables, n, VARIABLE_SIZE_1_0, "gradients or fluxes")?;
        let [variable] = found.as_slice() else {
            return Err(format!(
                "{name}: {n} gradients or fluxes, this host uses one pair"
            ));
        };
        let id = identifier(variable.id, "a gradient or flux", allowance)?;
        let components = hypothesis.n_components();
        if id != expected || variable.n_components as usize != components {
            return Err(format!(
                "{name}: found `{id}` with {} components, expected `{expected}` with {components}",
                variable.n_components
            ));
        }
    }
    Ok(())
}

/// A tangent is one thing: all of the response, near the derivative of the update, or none.
fn tangent(flags: u32, name: &str) -> Result<Tangent, String> {
    let kinds = [
        (raw::PILUM_T_LINEAR, "PILUM_T_LINEAR", Tangent::Consistent),
        (
            raw::PILUM_T_TANGENT_APPROXIMATE,
            "PILUM_T_TANGENT_APPROXIMATE",
            Tangent::Approximate,
        ),
        (raw::PILUM_T_NO_TANGENT, "PILUM_T_NO_TANGENT", Tangent::None),
    ];
    let mut set = kinds.into_iter().filter(|(flag, ..)| flags & flag != 0);
    match (set.next(), set.next()) {
        (Some((_, one, _)), Some((_, other, _))) => {
            Err(format!("{name}: {one} and {other} contradict each other"))
        }
        (one, _) => Ok(one.map_or(Tangent::Consistent, |(.., tangent)| tangent)),
    }
}

fn describe_formulation(
    formulation: &Formulation,
    hypothesis: Hypothesis,
    index: u32,
    allowance: &Allowance,
) -> Result<FormulationDescription, String> {
    let name = hypothesis.name();
    one_pair(formulation, hypothesis, allowance)?;
    let tangent = tangent(formulation.flags, name)?;
    let mut internal_variables = Vec::new();
    for variable in table(
        formulation.state,
        formulation.n_states,
        VARIABLE_SIZE_1_0,
        "internal variables",
    )? {
        internal_variables.extend(describe_variable(&variable, allowance)?);
    }
    unique(
        internal_variables.iter().map(|v| v.id.as_str()),
        "internal variable",
    )?;
    Ok(FormulationDescription {
        hypothesis: name,
        index,
        symmetric: formulation.flags & raw::PILUM_T_SYMMETRIC != 0,
        tangent,
        rates: formulation.flags & raw::PILUM_T_RATES != 0,
        linear: formulation.flags & raw::PILUM_T_LINEAR != 0 && internal_variables.is_empty(),
        time_dependent: false,
        local_axes: formulation.flags & raw::PILUM_T_LOCAL_AXES != 0,
        internal_variables,
    })
}

fn describe_variable(v: &Variable, allowance: &Allowance) -> Result<Vec<InternalVariable>, String> {
    let id = identifier(v.id, "an internal variable", allowance)?;
    if v.n_components == 0 || v.n_components > LONGEST_TABLE {
        return Err(format!(
            "internal variable `{id}` has {} components",
            v.n_components
        ));
    }
    (0..v.n_components as usize)
        .map(|c| {
            let id = if v.n_components == 1 {
                id.clone()
            } else if v.component_names.is_null() {
                format!("{id}_{}", c + 1)
            } else {
                // SAFETY: contract, "Variables": `n_components` names where the list is not null.
                let name = unsafe { v.component_names.add(c).read() };
                format!("{id}_{}", text(name, &id, allowance)?)
            };
            Ok(InternalVariable {
                symbol: text(v.symbol, &id, allowance)?,
                unit: text(v.unit, &id, allowance)?,
                doc: text(v.doc, &id, allowance)?,
                id,
                initial_value: v.initial_value,
                output_only: v.flags & raw::PILUM_V_OUTPUT_ONLY != 0,
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A struct that is 16 bytes long in version 1.0.
    #[repr(C)]
    #[derive(Clone, Copy, Debug, PartialEq)]
    struct First {
        struct_size: u32,
        flags: u32,
        value: u64,
    }

    /// The same two minors later.
    #[repr(C)]
    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Grown {
        first: First,
        added: u64,
        last: u64,
    }

    fn first(struct_size: u32, value: u64) -> First {
        First {
            struct_size,
            flags: 0,
            value,
        }
    }

    fn grown(struct_size: u32, value: u64) -> Grown {
        Grown {
            first: first(struct_size, value),
            added: 1,
            last: 2,
        }
    }

    #[test]
    fn an_earlier_table_is_read_as_far_as_it_goes() {
        let entries = [first(16, 5), first(16, 6)];
        let read = table(entries.as_ptr().cast::<Grown>(), 2, 16, "entries").unwrap();
        let zeros = |first| Grown {
            first,
            added: 0,
            last: 0,
        };
        assert_eq!(read, entries.map(zeros));
    }

    #[test]
    fn a_later_table_is_walked_with_its_own_stride() {
        let entries = [grown(32, 5), grown(32, 6)];
        let read = table(entries.as_ptr().cast::<First>(), 2, 16, "entries").unwrap();
        assert_eq!(read, entries.map(|entry| entry.first));
    }

    #[test]
    fn a_table_shorter_than_version_1_0_is_refused() {
        for stride in [0, 8, 15, 17] {
            let entries = [first(stride, 5)];
            let why = table(entries.as_ptr(), 1, 16, "entries").unwrap_err();
            assert!(why.contains("expected at least 16"), "{why}");
        }
    }

    /// A text of this many bytes that starts with `start`, and what lies behind it.
    fn long_text(start: &str, length: usize) -> Vec<u8> {
        let mut bytes = format!("{start:x<length$}\0behind").into_bytes();
        bytes.push(0);
        bytes
    }

    fn copied(bytes: &[u8], allowance: &Allowance) -> Result<String, String> {
        text(bytes.as_ptr().cast(), "doc", allowance)
    }

    // Hosts may refuse what no author writes. This one takes a page of memory, 4 KiB with its NUL,
    // for one text, and 16 MiB, a thousandth of a workstation's memory, for all of a library. The
    // numbers stand here once more, so that a slip in the constants is seen.

    #[test]
    fn a_text_is_copied_up_to_a_page() {
        let longest = long_text("doc ", 4095);
        let copy = copied(&longest, &Allowance::default()).unwrap();
        assert_eq!(copy.as_bytes(), &longest[..4095]);
        let why = copied(&long_text("doc ", 4096), &Allowance::default()).unwrap_err();
        assert!(why.contains("longer than 4096 bytes"), "{why}");
    }

    #[test]
    fn texts_are_copied_up_to_a_total() {
        // 16 777 216 = 4097 * 4095 + 1: after so many of the longest texts one byte is left.
        let allowance = Allowance::default();
        for number in 0..4097 {
            let long = long_text(&format!("text {number} "), 4095);
            let copy = copied(&long, &allowance).unwrap();
            assert_eq!(copy.as_bytes(), &long[..4095]);
        }
        let refused = |bytes: &[u8]| {
            let why = copied(bytes, &allowance).unwrap_err();
            assert!(why.contains("longer than 16 MB together"), "{why}");
        };
        // One byte more than there is room for; what is refused takes no room.
        refused(b"ab\0");
        // Just below, then at the limit.
        assert_eq!(copied(b"\0", &allowance).unwrap(), "");
        assert_eq!(copied(b"z\0", &allowance).unwrap(), "z");
        // Above it. A text without bytes needs no room.
        refused(b"z\0");
        refused(b" \0");
        assert_eq!(copied(b"\0", &allowance).unwrap(), "");
    }

    #[test]
    fn a_struct_is_read_as_far_as_it_says() {
        let read = |said| {
            let entry = grown(said, 5);
            // SAFETY: 32 bytes are there, whatever less is said.
            unsafe { known(&raw const entry, 16) }
        };
        assert_eq!(read(15), None);
        assert_eq!(read(16).map(|s| (s.added, s.last)), Some((0, 0)));
        assert_eq!(read(24).map(|s| (s.added, s.last)), Some((1, 0)));
        assert_eq!(read(32).map(|s| (s.added, s.last)), Some((1, 2)));
        let later = grown(32, 5);
        // SAFETY: as above.
        let read = unsafe { known((&raw const later).cast::<First>(), 16) };
        assert_eq!(read, Some(later.first));
    }
}
