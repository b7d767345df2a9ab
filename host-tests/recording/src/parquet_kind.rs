//! Kinds of Parquet columns: what a stored value stands for.

use parquet::basic::{ConvertedType, LogicalType, Repetition, TimeUnit, Type as Physical};
use parquet::schema::types::Type;

/// Kind of a column.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    /// Null in every row.
    Null,
    /// Integers, in the low bits of what is stored.
    Integers {
        /// Width \[bit\].
        bits: u32,
        /// Negative integers are possible.
        is_signed: bool,
    },
    /// Floating-point numbers of any width.
    Floats,
    /// Date-times since 1970.
    Dates {
        /// Unit, as units in a second.
        per_second: i64,
        /// They are instants in UTC; else their zone is unknown.
        has_zone: bool,
    },
    /// Text.
    Text,
    /// Anything else, by its name in pyarrow.
    Other(String),
}

impl Kind {
    /// Returns the kind of a column at the root of a file.
    pub(super) fn of(column: &Type) -> Self {
        let info = column.get_basic_info();
        let is_repeated = info.has_repetition() && info.repetition() == Repetition::REPEATED;
        if is_repeated || !column.is_primitive() {
            return Self::Other(group_name(column, is_repeated));
        }
        let (logical, converted) = (info.logical_type_ref(), info.converted_type());
        if logical == Some(&LogicalType::Unknown) {
            return Self::Null;
        }
        let known = match (column.get_physical_type(), logical) {
            (Physical::INT32, _) => int32(logical, converted),
            (Physical::INT64, _) => int64(logical, converted),
            (Physical::INT96, _) => Some(dates(TimeUnit::NANOS, false)),
            (Physical::FLOAT | Physical::DOUBLE, _)
            | (Physical::FIXED_LEN_BYTE_ARRAY, Some(LogicalType::Float16)) => Some(Self::Floats),
            (Physical::BYTE_ARRAY, Some(LogicalType::String | LogicalType::Json)) => {
                Some(Self::Text)
            }
            (Physical::BYTE_ARRAY, None)
                if matches!(converted, ConvertedType::UTF8 | ConvertedType::JSON) =>
            {
                Some(Self::Text)
            }
            _ => None,
        };
        known.unwrap_or_else(|| Self::Other(name(column)))
    }

    /// True for a column of numbers.
    pub(super) fn is_number(&self) -> bool {
        matches!(self, Self::Integers { .. } | Self::Floats)
    }

    /// Returns the number that an integer stands for, as stored.
    pub(super) fn number(&self, stored: i64) -> f64 {
        match *self {
            Self::Integers {
                bits,
                is_signed: false,
            } => ((stored as u64) << (64 - bits) >> (64 - bits)) as f64,
            Self::Integers { bits, .. } => (stored << (64 - bits) >> (64 - bits)) as f64,
            _ => stored as f64,
        }
    }

    /// Returns its name in pyarrow.
    pub(super) fn name(&self) -> String {
        match self {
            Self::Dates {
                per_second,
                has_zone,
            } => {
                let unit = match per_second {
                    1_000 => "ms",
                    1_000_000 => "µs",
                    _ => "ns",
                };
                let zone = if *has_zone { ", \"UTC\"" } else { "" };
                format!("Timestamp({unit}{zone})")
            }
            Self::Other(name) => name.clone(),
            kind => format!("{kind:?}"),
        }
    }
}

fn integers(bits: u32, is_signed: bool) -> Kind {
    Kind::Integers { bits, is_signed }
}

fn dates(unit: TimeUnit, has_zone: bool) -> Kind {
    let per_second = match unit {
        TimeUnit::MILLIS => 1_000,
        TimeUnit::MICROS => 1_000_000,
        TimeUnit::NANOS => 1_000_000_000,
    };
    Kind::Dates {
        per_second,
        has_zone,
    }
}

fn int32(logical: Option<&LogicalType>, converted: ConvertedType) -> Option<Kind> {
    Some(match (logical, converted) {
        (Some(LogicalType::Integer(int)), _) if matches!(int.bit_width, 8 | 16 | 32) => {
            integers(u32::from(int.bit_width.unsigned_abs()), int.is_signed)
        }
        (None, ConvertedType::INT_8) => integers(8, true),
        (None, ConvertedType::INT_16) => integers(16, true),
        (None, ConvertedType::INT_32 | ConvertedType::NONE) => integers(32, true),
        (None, ConvertedType::UINT_8) => integers(8, false),
        (None, ConvertedType::UINT_16) => integers(16, false),
        (None, ConvertedType::UINT_32) => integers(32, false),
        _ => return None,
    })
}

fn int64(logical: Option<&LogicalType>, converted: ConvertedType) -> Option<Kind> {
    Some(match (logical, converted) {
        (Some(LogicalType::Integer(int)), _) if int.bit_width == 64 => integers(64, int.is_signed),
        (Some(LogicalType::Timestamp(time)), _) => dates(time.unit, time.is_adjusted_to_u_t_c),
        (None, ConvertedType::INT_64 | ConvertedType::NONE) => integers(64, true),
        (None, ConvertedType::UINT_64) => integers(64, false),
        (None, ConvertedType::TIMESTAMP_MILLIS) => dates(TimeUnit::MILLIS, true),
        (None, ConvertedType::TIMESTAMP_MICROS) => dates(TimeUnit::MICROS, true),
        _ => return None,
    })
}

fn group_name(column: &Type, is_repeated: bool) -> String {
    let name = match column.get_basic_info().converted_type() {
        ConvertedType::LIST => "List",
        ConvertedType::MAP | ConvertedType::MAP_KEY_VALUE => "Map",
        _ if is_repeated => "List",
        _ => "Struct",
    };
    name.to_owned()
}

/// Name of a column without numbers, which is no group.
fn name(column: &Type) -> String {
    let info = column.get_basic_info();
    match (info.logical_type_ref(), info.converted_type()) {
        (Some(LogicalType::Decimal(_)), _) | (None, ConvertedType::DECIMAL) => {
            let (precision, scale) = (column.get_precision(), column.get_scale());
            format!("Decimal128({precision}, {scale})")
        }
        (Some(LogicalType::Date), _) | (None, ConvertedType::DATE) => "Date32".to_owned(),
        (Some(LogicalType::Time(_)), _)
        | (None, ConvertedType::TIME_MILLIS | ConvertedType::TIME_MICROS) => "Time".to_owned(),
        _ => match column.get_physical_type() {
            Physical::BOOLEAN => "Boolean".to_owned(),
            Physical::BYTE_ARRAY => "Binary".to_owned(),
            Physical::FIXED_LEN_BYTE_ARRAY => "FixedSizeBinary".to_owned(),
            physical => physical.to_string(),
        },
    }
}
