//! MAT-File, level 5 (The MathWorks, *MAT-File Format*, chapter 1): a variable a column, numbers as a double column vector, words as a cell column of strings.

use super::{Column, Values};

/// Data types (table 1-1).
const INT8: u32 = 1;
const UINT16: u32 = 4;
const INT32: u32 = 5;
const UINT32: u32 = 6;
const DOUBLE: u32 = 9;
const MATRIX: u32 = 14;
const UTF16: u32 = 17;
/// Array classes (table 1-3).
const CELL: u32 = 1;
const CHAR: u32 = 4;
const DOUBLES: u32 = 6;
/// Longest name of a variable.
const LONGEST: usize = 63;

/// The file.
pub fn bytes(columns: &[Column]) -> Vec<u8> {
    let text = format!("MATLAB 5.0 MAT-file, angles written by freeswing {}", env!("CARGO_PKG_VERSION"));
    let mut file: Vec<u8> = text.into_bytes();
    file.resize(124, b' ');
    file.extend(0x0100u16.to_le_bytes());
    file.extend(b"IM");
    for column in columns {
        let name = variable(&column.name);
        file.extend(match &column.values {
            Values::Numbers(numbers) => {
                let values: Vec<u8> = numbers.iter().flat_map(|value| value.to_le_bytes()).collect();
                array(&name, DOUBLES, [numbers.len(), 1], &element(DOUBLE, &values))
            }
            Values::Texts(texts) => {
                let cells: Vec<u8> = texts.iter().flat_map(|text| string(text)).collect();
                array(&name, CELL, [texts.len(), 1], &cells)
            }
        });
    }
    file
}

fn string(text: &str) -> Vec<u8> {
    let units: Vec<u16> = text.encode_utf16().collect();
    let values: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
    let kind = if units.is_empty() { UINT16 } else { UTF16 };
    array("", CHAR, [usize::from(!units.is_empty()), units.len()], &element(kind, &values))
}

/// An array: flags, dimensions, name, contents.
fn array(name: &str, class: u32, size: [usize; 2], contents: &[u8]) -> Vec<u8> {
    let flags: Vec<u8> = [class, 0].iter().flat_map(|word| word.to_le_bytes()).collect();
    let size: Vec<u8> = size.iter().flat_map(|n| (*n as i32).to_le_bytes()).collect();
    let parts = [element(UINT32, &flags), element(INT32, &size), element(INT8, name.as_bytes()), contents.to_vec()];
    element(MATRIX, &parts.concat())
}

/// A data element: its type, its length, and its bytes up to a multiple of eight.
fn element(kind: u32, bytes: &[u8]) -> Vec<u8> {
    let mut all: Vec<u8> = [kind, bytes.len() as u32].iter().flat_map(|word| word.to_le_bytes()).collect();
    all.extend(bytes);
    all.resize(all.len().next_multiple_of(8), 0);
    all
}

/// A name that MATLAB takes: letters, digits and underscores, a letter first.
fn variable(name: &str) -> String {
    let name: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).take(LONGEST - 1).collect();
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) { name } else { format!("x{name}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_of_two_numbers_is_the_manual_s_layout() {
        let column = Column { name: "t_s".to_owned(), values: Values::Numbers(vec![0.0, 0.5]) };
        let file = bytes(&[column]);
        assert_eq!(&file[124..128], [0, 1, b'I', b'M']);
        // type and length, flags 16, dimensions 16, name 16, values 8 + 16
        assert_eq!((file.len(), &file[128..136]), (128 + 8 + 72, &[14u8, 0, 0, 0, 72, 0, 0, 0][..]));
        assert_eq!(&file[file.len() - 8..], 0.5f64.to_le_bytes());
    }

    #[test]
    fn names_are_those_that_can_be() {
        assert_eq!(variable("m1_x_px"), "m1_x_px");
        assert_eq!(variable("1st angle"), "x1st_angle");
    }
}
