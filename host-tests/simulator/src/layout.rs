//! Tables of a scenario's recording.
//!
//! Each table has a file, a rate and columns, in the order in which rows are written.
//!
//! The gyros' rows come first, then a table for each further reference, then slow channels at their own rates. The first
//! reference is that of the model and of the reference's effects; readers use the first too.

use super::scenario::{GyroOutput, Scenario};
use super::slow_channels::{DRIVE_WEIGHT, NOMINAL_WEIGHT, STAMP_WEIGHT_S, SlowChannelsEntry};
use rlg_recording::Quantity;

/// Instrument that measures the angle of the case or of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReferenceKind {
    /// `[reference]`.
    Gyro,
    /// `[fibre_optic]`.
    FibreOptic,
    /// `[encoder]`.
    Encoder,
}

/// References of a scenario; the first is *the* reference.
pub fn references(scenario: &Scenario) -> impl Iterator<Item = ReferenceKind> + use<> {
    [
        (ReferenceKind::Gyro, scenario.reference.is_some()),
        (ReferenceKind::FibreOptic, scenario.fibre_optic.is_some()),
        (ReferenceKind::Encoder, scenario.encoder.is_some()),
    ]
    .into_iter()
    .filter_map(|(kind, there)| there.then_some(kind))
}

/// One column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name in the file.
    pub name: String,
    /// Quantity of the column.
    pub quantity: Quantity,
    /// "x", "y", "z", or "w"; empty for a quantity of the whole unit.
    pub axis: &'static str,
    /// Resolution: values are whole multiples of it. `None`: continuous.
    pub weight: Option<f64>,
    /// Name in an effect's `channel`; `None`: no fault can act on it.
    pub fault_name: Option<String>,
}

/// One table.
#[derive(Debug, Clone, PartialEq)]
pub struct TableLayout {
    /// File in the recording's folder.
    pub file: &'static str,
    /// Gyro rows per row of the table.
    pub gyro_rows: usize,
    /// Columns of the table.
    pub columns: Vec<Column>,
}

const LETTERS: [&str; 3] = ["x", "y", "z"];

fn triad(
    prefix: &str,
    quantity: Quantity,
    weights: [f64; 3],
    fault_stem: Option<&str>,
) -> impl Iterator<Item = Column> {
    let make = |(axis, weight): (&'static str, f64)| Column {
        name: format!("{prefix}{axis}"),
        quantity: quantity.clone(),
        axis,
        weight: Some(weight),
        fault_name: fault_stem.map(|stem| format!("{stem}_{axis}")),
    };
    let columns: Vec<_> = LETTERS.into_iter().zip(weights).map(make).collect();
    columns.into_iter()
}

/// All tables of the recording.
pub fn tables(scenario: &Scenario) -> Vec<TableLayout> {
    let gyro = &scenario.gyro;
    let (quantity, weights) = match gyro.output {
        GyroOutput::Count => (Quantity::GyroCount, [1.0; 3]),
        GyroOutput::Increment => (Quantity::GyroIncrement, gyro.pulse_weight_rad),
    };
    let mut columns: Vec<Column> = triad("g", quantity, weights, Some("gyro")).collect();
    if let Some(dither) = &scenario.dither {
        let weights = [dither.pickoff_weight_rad; 3];
        columns.extend(triad("d", Quantity::DitherAngle, weights, Some("dither")));
    }
    if let Some(reference) = &scenario.reference {
        let increment = Quantity::ReferenceIncrement;
        columns.extend(triad(
            "r",
            increment,
            [reference.weight_rad; 3],
            Some("reference"),
        ));
    }
    if let Some(accelerometer) = &scenario.accelerometer {
        let weights = [accelerometer.weight_m_s2; 3];
        columns.extend(triad("a", Quantity::SpecificForce, weights, Some("force")));
    }
    if scenario
        .reference
        .is_some_and(|reference| reference.attitude)
    {
        columns.extend(["w", "x", "y", "z"].map(|axis| Column {
            name: format!("q{axis}"),
            quantity: Quantity::ReferenceAttitude,
            axis,
            weight: None,
            fault_name: None,
        }));
    }
    let mut tables = vec![TableLayout {
        file: "samples.parquet",
        gyro_rows: 1,
        columns,
    }];
    let first = references(scenario).next();
    let stem = |kind| (first == Some(kind)).then_some("reference");
    let mut add = |file, rate_hz: f64, columns: Vec<Column>| {
        tables.push(TableLayout {
            file,
            gyro_rows: (scenario.rate_hz / rate_hz).round() as usize,
            columns,
        });
    };
    let increment = Quantity::ReferenceIncrement;
    if let Some(gyro) = &scenario.fibre_optic {
        let stem = stem(ReferenceKind::FibreOptic);
        let columns = triad("f", increment.clone(), [gyro.weight_rad; 3], stem);
        add("fibre_optic.parquet", scenario.rate_hz, columns.collect());
    }
    if let Some(encoder) = &scenario.encoder {
        let stem = stem(ReferenceKind::Encoder);
        let columns = triad("e", increment, [encoder.weight_rad; 3], stem);
        add("encoder.parquet", scenario.rate_hz, columns.collect());
    }
    if let Some(thermal) = &scenario.thermal {
        let weights = [thermal.sensor_weight_k; 3];
        let columns = triad("t", Quantity::Temperature, weights, Some("temperature"));
        add("temperature.parquet", thermal.rate_hz, columns.collect());
    }
    if let Some(magnetic) = &scenario.magnetic {
        let weights = [magnetic.sensor_weight_t; 3];
        let columns = triad("b", Quantity::MagneticField, weights, Some("field"));
        add("magnetic.parquet", magnetic.rate_hz, columns.collect());
    }
    if let Some(slow) = &scenario.slow_channels {
        add("slow.parquet", slow.rate_hz, slow_columns(slow));
    }
    tables
}

/// Columns of the unit's health.
fn slow_columns(slow: &SlowChannelsEntry) -> Vec<Column> {
    let triads = [
        (Quantity::LaserIntensity, NOMINAL_WEIGHT),
        (Quantity::PathLengthDrive, DRIVE_WEIGHT),
        (Quantity::PathLengthResets, 1.0),
        (Quantity::DitherDrive, NOMINAL_WEIGHT),
    ];
    let mut columns: Vec<Column> = triads
        .into_iter()
        .flat_map(|(quantity, weight)| {
            let name = quantity.name().to_owned();
            triad(&format!("{name}_"), quantity, [weight; 3], Some(&name)).collect::<Vec<_>>()
        })
        .collect();
    columns.extend(slow.pulse.map(|_| Column {
        name: Quantity::TimeSincePulse.name().to_owned(),
        quantity: Quantity::TimeSincePulse,
        axis: "",
        weight: Some(STAMP_WEIGHT_S),
        fault_name: None,
    }));
    columns
}

/// Channel names that a fault may address.
pub fn fault_channels(scenario: &Scenario) -> Vec<String> {
    tables(scenario)
        .into_iter()
        .flat_map(|table| table.columns)
        .filter_map(|column| column.fault_name)
        .collect()
}
