//! The handshake and the one rule of compatibility.

use crate::raw::{self, MagicBlock};
use std::ffi::c_char;
use std::fmt;
use std::mem::{offset_of, size_of};

/// Lists offset and size of every public field of one struct.
macro_rules! fields {
    ($type:ident: $($field:ident),+ $(,)?) => {
        &[ $( (
            concat!(stringify!($type), ".", stringify!($field)),
            offset_of!(raw::$type, $field),
            field_size(|s: &raw::$type| &s.$field),
        ) ),+ , (concat!(stringify!($type)), 0, size_of::<raw::$type>()) ]
    };
}

const fn field_size<S, T>(_: fn(&S) -> &T) -> usize {
    size_of::<T>()
}

/// Size of [`raw::Batch`] in version 1.0. This and the following ones never change: they are all a
/// reader may demand of a struct. A field that came later is there only if `struct_size` covers
/// it, so a reader copies what is covered into zeroes rather than refer to the writer's struct.
pub const BATCH_SIZE_1_0: usize = 256;
/// Size of [`Parameter`](raw::Parameter) in version 1.0.
pub const PARAMETER_SIZE_1_0: usize = 88;
/// Size of [`Variable`](raw::Variable) in version 1.0.
pub const VARIABLE_SIZE_1_0: usize = 64;
/// Size of [`Formulation`](raw::Formulation) in version 1.0.
pub const FORMULATION_SIZE_1_0: usize = 48;
/// Size of [`Host`](raw::Host) in version 1.0.
pub const HOST_SIZE_1_0: usize = 32;
/// Size of [`Law`](raw::Law) in version 1.0.
pub const LAW_SIZE_1_0: usize = 120;
/// Size of [`Plugin`](raw::Plugin) in version 1.0.
pub const PLUGIN_SIZE_1_0: usize = 24;
/// Size of [`RustLayout`](raw::RustLayout) in version 1.0.
pub const RUST_LAYOUT_SIZE_1_0: usize = 24;
/// Size of [`Rates`](raw::Rates) in version 1.0.
pub const RATES_SIZE_1_0: usize = 160;

/// Name (`Struct.field`, or `Struct` for the whole), offset and size in bytes.
pub type FieldLayout = (&'static str, usize, usize);

/// Every public field of every struct that crosses the boundary.
pub const LAYOUT: &[&[FieldLayout]] = &[
    fields!(MagicBlock: struct_size, magic, abi_major, abi_minor, pointer_bytes, real_bytes,
        reserved, layout_hash, sdk),
    fields!(Parameter: struct_size, flags, id, symbol, unit, doc, default_value, lower, upper,
        usual_lower, usual_upper, choices),
    fields!(Variable: struct_size, flags, id, symbol, unit, doc, shape, n_components,
        component_names, initial_value),
    fields!(Formulation: struct_size, hypothesis, flags, n_gradients, n_fluxes, n_states, gradient,
        flux, state),
    fields!(View: p, point, component),
    fields!(ViewMut: p, point, component),
    fields!(Batch: struct_size, request, n_points, first_point, time, time_increment, gradient0,
        gradient1, flux0, state0, flux1, state1, tangent, status, step_factor, message,
        message_capacity, step_time, rates),
    fields!(Rates: struct_size, reserved, parameter, gradient0, gradient1, flux0, state0, flux1,
        state1),
    fields!(Host: struct_size, abi_major, abi_minor, name, version, get_extension),
    fields!(Law: struct_size, flags, n_parameters, n_formulations, id, name, version, author,
        licence, doc, references, parameter, formulation, create, init_state, integrate, destroy),
    fields!(Plugin: struct_size, n_laws, law, get_extension),
];

/// FNV-1a over the names, offsets and sizes in [`LAYOUT`]; `PILUM_LAYOUT_HASH` of the C header.
pub const LAYOUT_HASH: u64 = layout_hash();

const fn layout_hash() -> u64 {
    const fn mix(hash: u64, byte: u8) -> u64 {
        (hash ^ byte as u64).wrapping_mul(0x0000_0100_0000_01b3)
    }
    let mut hash = 0xcbf2_9ce4_8422_2325;
    let mut s = 0;
    while s < LAYOUT.len() {
        let mut f = 0;
        while f < LAYOUT[s].len() {
            let (name, offset, size) = LAYOUT[s][f];
            let mut c = 0;
            while c < name.len() {
                hash = mix(hash, name.as_bytes()[c]);
                c += 1;
            }
            hash = mix(mix(hash, offset as u8), (offset >> 8) as u8);
            hash = mix(mix(hash, size as u8), (size >> 8) as u8);
            f += 1;
        }
        s += 1;
    }
    hash
}

/// What a library built with this crate was built with.
pub const SDK: &str = concat!("pilum-rs ", env!("CARGO_PKG_VERSION"));

/// The block that a library or host built with this crate carries.
pub const MAGIC_BLOCK: MagicBlock = MagicBlock {
    struct_size: size_of::<MagicBlock>() as u32,
    magic: raw::PILUM_MAGIC,
    abi_major: raw::PILUM_ABI_MAJOR,
    abi_minor: raw::PILUM_ABI_MINOR,
    pointer_bytes: size_of::<*const u8>() as u8,
    real_bytes: size_of::<f64>() as u8,
    reserved: [0; 2],
    layout_hash: LAYOUT_HASH,
    sdk: padded(SDK),
};

const fn padded(text: &str) -> [c_char; 40] {
    let mut out = [0; 40];
    let mut i = 0;
    while i < text.len() && i < 39 {
        out[i] = text.as_bytes()[i] as c_char;
        i += 1;
    }
    out
}

/// The first field in which a library's block rules it out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mismatch {
    /// Name of the field in [`MagicBlock`].
    pub field: &'static str,
    /// Value here.
    pub expected: u64,
    /// Value in the library.
    pub found: u64,
    /// Hint for the person who has to mend it.
    pub hint: &'static str,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            field,
            expected,
            found,
            hint,
        } = self;
        write!(
            f,
            "`pilum_magic.{field}` is {found:#x}, expected {expected:#x} ({hint})"
        )
    }
}

/// Whether a library with this block can be used.
///
/// # Errors
/// The first field that differs, in an order in which a later field is only meaningful if the
/// earlier ones agree.
pub fn check(theirs: &MagicBlock) -> Result<(), Mismatch> {
    let ours = &MAGIC_BLOCK;
    macro_rules! same {
        ($field:ident, $hint:expr) => {
            if theirs.$field != ours.$field {
                return Err(Mismatch {
                    field: stringify!($field),
                    expected: ours.$field.into(),
                    found: theirs.$field.into(),
                    hint: $hint,
                });
            }
        };
    }
    let is_swapped = theirs.magic == ours.magic.swap_bytes();
    same!(
        magic,
        if is_swapped {
            "the library is for the other endianness"
        } else {
            "this is no Pilum law library"
        }
    );
    if theirs.struct_size < ours.struct_size {
        same!(struct_size, "the handshake block is truncated");
    }
    same!(pointer_bytes, "another pointer width");
    same!(real_bytes, "reals must be doubles");
    same!(
        abi_major,
        "rebuild the library against this version of the contract"
    );
    if theirs.abi_minor == ours.abi_minor {
        same!(
            layout_hash,
            "compiler flags or an edited header changed the structs"
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accepts_itself_and_other_minors() {
        assert_eq!(check(&MAGIC_BLOCK), Ok(()));
        let later = MagicBlock {
            abi_minor: 7,
            layout_hash: 1,
            struct_size: 80,
            ..MAGIC_BLOCK
        };
        assert_eq!(check(&later), Ok(()));
    }

    /// Sizes of version 1.0 end where its last field does, now and when more follow.
    #[test]
    fn the_sizes_of_version_1_0_stay() {
        macro_rules! ends {
            ($($type:ident.$field:ident: $size:ident),+ $(,)?) => { $(
                let end = offset_of!(raw::$type, $field)
                    + field_size(|s: &raw::$type| &s.$field);
                assert_eq!(end, $size, "{}", stringify!($type));
                if raw::PILUM_ABI_MINOR == 0 {
                    assert_eq!(size_of::<raw::$type>(), $size, "{}", stringify!($type));
                }
            )+ };
        }
        ends!(
            Batch.rates: BATCH_SIZE_1_0,
            Parameter.choices: PARAMETER_SIZE_1_0,
            Variable.initial_value: VARIABLE_SIZE_1_0,
            Formulation.state: FORMULATION_SIZE_1_0,
            Host.get_extension: HOST_SIZE_1_0,
            Law.destroy: LAW_SIZE_1_0,
            Plugin.get_extension: PLUGIN_SIZE_1_0,
            RustLayout.layout: RUST_LAYOUT_SIZE_1_0,
            Rates.state1: RATES_SIZE_1_0,
        );
    }

    fn block_with(edit: fn(&mut MagicBlock)) -> MagicBlock {
        let mut block = MAGIC_BLOCK;
        edit(&mut block);
        block
    }

    #[test]
    fn names_the_differing_field() {
        let cases = [
            (block_with(|block| block.magic = 1), "magic"),
            (block_with(|block| block.struct_size = 16), "struct_size"),
            (block_with(|block| block.pointer_bytes = 4), "pointer_bytes"),
            (block_with(|block| block.real_bytes = 4), "real_bytes"),
            (block_with(|block| block.abi_major = 2), "abi_major"),
            (block_with(|block| block.layout_hash = 0), "layout_hash"),
        ];
        for (block, field) in cases {
            assert_eq!(check(&block).unwrap_err().field, field);
        }
    }

    #[test]
    fn says_when_only_the_endianness_differs() {
        let swapped = MagicBlock {
            magic: raw::PILUM_MAGIC.swap_bytes(),
            ..MAGIC_BLOCK
        };
        assert!(check(&swapped).unwrap_err().hint.contains("endianness"));
    }
}
