//! The version and encoding of a file's format, or the kind of another file.

use super::cursor::{Cursor, Encoding, Fault};

/// How sections are laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Version {
    /// 2.0, 2.1 and 2.2.
    Two,
    /// 4.0.
    Four,
    /// 4.1.
    FourOne,
}

/// The command that converts a file of any other version.
const CONVERT: &str = "`gmsh old.msh -save -format msh41 -o new.msh` writes it in version 4.1";

/// Reads until the end of the section that says the format. Remarks may come before it.
///
/// # Errors
/// The kind of another file.
pub(super) fn read(cursor: &mut Cursor<'_>) -> Result<Version, Fault> {
    if cursor.begins_with("version https://git-lfs.github.com/") {
        let message = "the file is a pointer of Git LFS, and the mesh itself is not here: `git lfs pull` \
                       fetches it";
        return Err(cursor.fault(0, message));
    }
    loop {
        let name = cursor.section().ok().flatten().unwrap_or_default();
        match name.as_str() {
            "MeshFormat" => break,
            "Comments" => cursor.skip_to_end(&name)?,
            "NOD" | "NOE" | "ELM" => {
                let message = format!(
                    "the file is a mesh of Gmsh in version 1 of its format, `${name}`, which is not \
                     read: {CONVERT}"
                );
                return Err(cursor.fault(0, &message));
            }
            _ => {
                let message = "a mesh file of Gmsh begins with `$MeshFormat`, this one does not";
                return Err(cursor.fault(0, message));
            }
        }
    }
    let version = version(cursor)?;
    encoding(cursor)?;
    cursor.end("MeshFormat")?;
    Ok(version)
}

fn version(cursor: &mut Cursor<'_>) -> Result<Version, Fault> {
    let at = cursor.at();
    let number = cursor.real("the version of the format")?;
    let known = [
        (2.0, Version::Two),
        (2.1, Version::Two),
        (2.2, Version::Two),
        (4.0, Version::Four),
        (4.1, Version::FourOne),
    ];
    let mut same = known.iter().filter(|(n, _)| (number - n).abs() < 1e-9);
    same.next().map(|(_, version)| *version).ok_or_else(|| {
        let message =
            format!("the format has version {number}; 4.1, 4.0 and 2.0 to 2.2 are read: {CONVERT}");
        cursor.fault(at, &message)
    })
}

fn encoding(cursor: &mut Cursor<'_>) -> Result<(), Fault> {
    let at = cursor.at();
    let kind = cursor.integer("0 for ASCII or 1 for binary")?;
    if !(0..=1).contains(&kind) {
        let message = format!("the file's type is {kind}, expected 0 for ASCII or 1 for binary");
        return Err(cursor.fault(at, &message));
    }
    let at = cursor.at();
    let size = cursor.integer("the size of numbers")?;
    if size != 8 {
        let message = format!("numbers of {size} bytes; those of 8 are read");
        return Err(cursor.fault(at, &message));
    }
    if kind == 1 {
        cursor.line();
        let at = cursor.at();
        cursor.encoding = Encoding::Binary { big_endian: false };
        let one = cursor.integer("the number 1")?;
        let big_endian = one == i64::from(1_i32.swap_bytes());
        if one != 1 && !big_endian {
            let message = "expected the number 1 in 4 bytes, which says their order";
            return Err(cursor.fault(at, message));
        }
        cursor.encoding = Encoding::Binary { big_endian };
    }
    Ok(())
}
