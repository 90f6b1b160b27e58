//! Files of unstructured grids of VTK: written as text, read with arrays in base64, as OpenGeoSys writes them.

use std::fmt::Write;

/// VTK's number of a point as a cell.
pub(crate) const VERTEX: u8 = 1;

/// An array of points or cells.
#[derive(Clone)]
pub(crate) struct Data {
    name: String,
    kind: &'static str,
    values: String,
}

impl Data {
    pub(crate) fn counts(name: &str, kind: &'static str, values: &[usize]) -> Self {
        Self {
            name: name.to_owned(),
            kind,
            values: joined(values.iter().map(ToString::to_string)),
        }
    }

    pub(crate) fn reals(name: &str, values: &[f64]) -> Self {
        Self {
            name: name.to_owned(),
            kind: "Float64",
            values: joined(values.iter().map(|value| format!("{value:?}"))),
        }
    }

    fn text(&self, components: usize) -> String {
        format!(
            "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{components}\" format=\"ascii\">{}</DataArray>\n",
            self.kind, self.name, self.values
        )
    }
}

fn joined(values: impl Iterator<Item = String>) -> String {
    values.collect::<Vec<_>>().join(" ")
}

/// A file. Cells have VTK's number of their kind, and their nodes.
pub(crate) fn grid(
    nodes: &[[f64; 2]],
    cells: &[(u8, &[usize])],
    of_points: &[Data],
    of_cells: &[Data],
) -> String {
    let places: Vec<f64> = nodes.iter().flat_map(|[x, y]| [*x, *y, 0.0]).collect();
    let connectivity: Vec<usize> = cells
        .iter()
        .flat_map(|(_, nodes)| nodes.iter().copied())
        .collect();
    let mut end = 0;
    let offsets: Vec<usize> = cells
        .iter()
        .map(|(_, nodes)| {
            end += nodes.len();
            end
        })
        .collect();
    let kinds: Vec<usize> = cells.iter().map(|(kind, _)| usize::from(*kind)).collect();
    let all = |data: &[Data]| data.iter().map(|data| data.text(1)).collect::<String>();
    let mut text = String::new();
    let _ = write!(
        text,
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
         <UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n\
         <PointData>{}</PointData>\n<CellData>{}</CellData>\n<Points>{}</Points>\n<Cells>{}{}{}</Cells>\n\
         </Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
        nodes.len(),
        cells.len(),
        all(of_points),
        all(of_cells),
        Data::reals("Points", &places).text(3),
        Data::counts("connectivity", "Int64", &connectivity).text(1),
        Data::counts("offsets", "Int64", &offsets).text(1),
        Data::counts("types", "UInt8", &kinds).text(1),
    );
    text
}

/// An array of Float64 with inline base64 and no compression; `None` if it is not there, or not so.
pub(crate) fn array(text: &str, name: &str) -> Option<Vec<f64>> {
    let named = text.find(&format!("Name=\"{name}\""))?;
    let tag = text[..named].rfind("<DataArray")?;
    let opened = tag + text[tag..].find('>')? + 1;
    let head = &text[tag..opened];
    if !head.contains("Float64") || !head.contains("format=\"binary\"") {
        return None;
    }
    let content = text[opened..opened + text[opened..].find('<')?].trim();
    let length = if text.contains("header_type=\"UInt64\"") {
        8
    } else {
        4
    };
    // The length may be encoded by itself, with its own padding.
    let own = usize::div_ceil(length, 3) * 4;
    let bytes = if content.get(..own)?.ends_with('=') {
        decoded(&content[own..])?
    } else {
        decoded(content)?.get(length..)?.to_vec()
    };
    let numbers = bytes
        .chunks_exact(8)
        .filter_map(|eight| eight.try_into().ok());
    Some(numbers.map(f64::from_le_bytes).collect())
}

/// Bytes of a text in base64.
fn decoded(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut n) = (0_u32, 0);
    for letter in text.bytes().filter(|letter| *letter != b'=') {
        let value = match letter {
            b'A'..=b'Z' => letter - b'A',
            b'a'..=b'z' => letter - b'a' + 26,
            b'0'..=b'9' => letter - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        n += 6;
        if n >= 8 {
            n -= 8;
            bytes.push((bits >> n & 0xff) as u8);
        }
    }
    Some(bytes)
}
