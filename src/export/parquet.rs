//! Apache Parquet: a column a column, missing values null.

use std::sync::Arc;

use parquet::basic::{ConvertedType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::Result;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::Type;

/// Values of a column, missing ones among them.
pub enum Cells {
    /// Numbers.
    Numbers(Vec<Option<f64>>),
    /// Whole numbers.
    Counts(Vec<Option<i64>>),
    /// Words.
    Texts(Vec<Option<String>>),
}

/// The file of a table of that name, its columns by name.
pub fn bytes(table: &str, columns: Vec<(String, Cells)>) -> Result<Vec<u8>> {
    let field = |(name, cells): &(String, Cells)| {
        let build = match cells {
            Cells::Numbers(_) => Type::primitive_type_builder(name, Physical::DOUBLE),
            Cells::Counts(_) => Type::primitive_type_builder(name, Physical::INT64),
            Cells::Texts(_) => {
                Type::primitive_type_builder(name, Physical::BYTE_ARRAY).with_converted_type(ConvertedType::UTF8)
            }
        };
        build.with_repetition(Repetition::OPTIONAL).build().map(Arc::new)
    };
    let fields = columns.iter().map(field).collect::<Result<Vec<_>>>()?;
    let schema = Type::group_type_builder(table).with_fields(fields).build()?;
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, Arc::new(schema), Arc::new(WriterProperties::default()))?;
    let mut group = file.next_row_group()?;
    for (_, cells) in columns {
        let Some(column) = group.next_column()? else { break };
        match cells {
            Cells::Numbers(values) => write::<DoubleType>(column, values)?,
            Cells::Counts(values) => write::<Int64Type>(column, values)?,
            Cells::Texts(values) => {
                let of_bytes = |text: Option<String>| text.map(|text| ByteArray::from(text.into_bytes()));
                write::<ByteArrayType>(column, values.into_iter().map(of_bytes).collect())?;
            }
        }
    }
    group.close()?;
    file.close()?;
    Ok(bytes)
}

/// Which rows have a value, and these values.
fn write<T: DataType>(mut column: SerializedColumnWriter<'_>, values: Vec<Option<T::T>>) -> Result<()> {
    let present: Vec<i16> = values.iter().map(|value| i16::from(value.is_some())).collect();
    let values: Vec<T::T> = values.into_iter().flatten().collect();
    column.typed::<T>().write_batch(&values, Some(&present), None)?;
    column.close()
}
