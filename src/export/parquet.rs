//! Apache Parquet: a column a column, missing numbers null.

use std::sync::Arc;

use parquet::basic::{ConvertedType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::Result;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::{Column, Values};

/// The file.
pub fn bytes(columns: &[Column]) -> Result<Vec<u8>> {
    let field = |column: &Column| {
        let build = match column.values {
            Values::Numbers(_) => Type::primitive_type_builder(&column.name, Physical::DOUBLE),
            Values::Texts(_) => Type::primitive_type_builder(&column.name, Physical::BYTE_ARRAY)
                .with_converted_type(ConvertedType::UTF8),
        };
        build.with_repetition(Repetition::OPTIONAL).build().map(Arc::new)
    };
    let fields = columns.iter().map(field).collect::<Result<Vec<_>>>()?;
    let schema = Type::group_type_builder("angles").with_fields(fields).build()?;
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, Arc::new(schema), Arc::new(WriterProperties::default()))?;
    let mut group = file.next_row_group()?;
    for own in columns {
        let Some(mut column) = group.next_column()? else { break };
        match &own.values {
            Values::Numbers(numbers) => {
                let present: Vec<i16> = numbers.iter().map(|value| i16::from(!value.is_nan())).collect();
                let values: Vec<f64> = numbers.iter().copied().filter(|value| !value.is_nan()).collect();
                column.typed::<DoubleType>().write_batch(&values, Some(&present), None)?;
            }
            Values::Texts(texts) => {
                let values: Vec<ByteArray> = texts.iter().map(|text| ByteArray::from(text.as_str())).collect();
                column.typed::<ByteArrayType>().write_batch(&values, Some(&vec![1; values.len()]), None)?;
            }
        }
        column.close()?;
    }
    group.close()?;
    file.close()?;
    Ok(bytes)
}
