//! HDF5: a dataset a column.

use hdf5_metno::types::VarLenUnicode;
use hdf5_metno::{File, Result};

use super::{Column, Values};

/// The file. The library writes to a path only; the bytes go on from there as those of any other output.
pub fn bytes(columns: &[Column]) -> Result<Vec<u8>> {
    let failed = |error: std::io::Error| hdf5_metno::Error::Internal(error.to_string());
    let own = tempfile::NamedTempFile::new().map_err(failed)?;
    let file = File::create(own.path())?;
    for column in columns {
        match &column.values {
            Values::Numbers(numbers) => {
                _ = file.new_dataset_builder().with_data(numbers).create(column.name.as_str())?
            }
            Values::Texts(texts) => {
                let texts: Vec<VarLenUnicode> = texts.iter().map(|text| text.parse().unwrap_or_default()).collect();
                file.new_dataset_builder().with_data(&texts).create(column.name.as_str())?;
            }
        }
    }
    file.close()?;
    std::fs::read(own.path()).map_err(failed)
}
