//! Parameters of findings, as named in the contract.

use nalgebra::{DMatrix, DVector, Matrix3};
use rlg_catalogue::entries::{self, STEP, UNLISTED};
use rlg_findings::combinations::{Number, identifiable, written};
use rlg_findings::entries::correlated;
use rlg_findings::result::ParameterEntry;
use rlg_plan::CombinationPlan;
use rlg_signal::axes::AXES;

use crate::fits::report_inputs::Said;
use crate::likelihood::block_sums::Estimates;
use crate::reference::cards::card;
use crate::rows::alignment::{Group, PAIRS, group_at, orthogonal};

/// Parameters as named in the contract.
pub(crate) struct Numbers {
    pub(crate) names: Vec<String>,
    pub(crate) values: Vec<f64>,
    pub(crate) covariance: DMatrix<f64>,
    /// Parameters not determined by the record but chosen by `written`.
    pub(crate) choice: Option<String>,
    unit: &'static str,
}

impl Numbers {
    /// Replaces the values by the expectation of their prior given the combinations determined by the record.
    pub(crate) fn written(mut self, kind: &str, plan: &CombinationPlan) -> Self {
        let known = self.known(kind);
        let written = written(&known, &identifiable(&known, &self.covariance, plan));
        self.values = written.values;
        self.choice = written.choice;
        self
    }

    /// Standard deviation of a parameter.
    pub(crate) fn std(&self, k: usize) -> f64 {
        self.covariance[(k, k)].max(0.0).sqrt()
    }

    /// Converts the parameters to entries of `diagnosis.json`, with the rows of their covariance.
    pub(crate) fn parameters(&self) -> (Vec<ParameterEntry>, Vec<Vec<f64>>) {
        correlated(&self.names, &self.values, &self.covariance, self.unit)
    }

    /// Returns the parameters with the prior standard deviation of a kind.
    pub(crate) fn known(&self, kind: &str) -> Vec<Number> {
        let prior_std = entries::find(kind).map_or(f64::INFINITY, |entry| entry.size.largest);
        let numbers = self.names.iter().zip(&self.values);
        numbers
            .map(|(name, value)| Number {
                prior_std,
                ..Number::free(name, *value)
            })
            .collect()
    }

    /// Formats the values with their standard deviations.
    pub(crate) fn sentence(&self) -> String {
        let unit = match self.unit {
            "1" => String::new(),
            unit => format!(" {unit}"),
        };
        let numbers = self.names.iter().zip(&self.values).enumerate();
        let each: Vec<String> = numbers
            .map(|(k, (name, value))| format!("{name} {value:.4e} ± {:.1e}{unit}", self.std(k)))
            .collect();
        each.join(", ")
    }
}

/// Returns the parameters of a group of columns, relative to the model.
///
/// # Inputs
/// `set`: column indices of the `estimates`.
pub(crate) fn numbers(
    said: &Said,
    kind: &'static str,
    columns: &[usize],
    (set, estimates): (&[usize], &Estimates),
) -> Numbers {
    let at: Vec<usize> = columns
        .iter()
        .filter_map(|column| set.iter().position(|one| one == column))
        .collect();
    let values = DVector::from_fn(at.len(), |k, _| estimates.values[at[k]]);
    let covariance = DMatrix::from_fn(at.len(), at.len(), |a, b| {
        estimates.covariance[(at[a], at[b])]
    });
    let group = group_at(columns);
    let recorded = &said.observed.recorded_from_case;
    let (values, covariance) = match group {
        Some(group) if *recorded != Matrix3::identity() => {
            let map = as_recorded(group.kind, at.len(), recorded);
            (&map * values, &map * covariance * map.transpose())
        }
        _ => (values, covariance),
    };
    let (names, map) = match group {
        Some(group) if kind == "reference_bandwidth" => {
            let (names, map) = stated(group, &Matrix3::identity());
            (names, -map)
        }
        Some(group) if is_low_pass(said, kind) => {
            let names = group.names.iter().map(|name| format!("{name}_pole_s"));
            (names.collect(), DMatrix::identity(3, 3))
        }
        Some(group) => stated(
            group,
            &said.registered.about.increments.navigation_from_start(0),
        ),
        None if kind == STEP => (vec!["size".to_string()], DMatrix::identity(1, 1)),
        None if kind == UNLISTED => {
            let names = match at.len() {
                1 => vec!["coefficient".to_string()],
                _ => ["sine", "cosine"].map(String::from).to_vec(),
            };
            (names, DMatrix::identity(at.len(), at.len()))
        }
        None => {
            let effects = said.candidates.effects.iter();
            let names = effects
                .filter(|(candidate, _)| candidate.kind == kind)
                .flat_map(|(candidate, _)| candidate.names.clone())
                .collect();
            // The common delay belongs to the reference.
            let shared = if kind == "gyro_delay" {
                1.0 / at.len() as f64
            } else {
                0.0
            };
            let map = DMatrix::identity(at.len(), at.len()).add_scalar(-shared);
            (names, map)
        }
    };
    Numbers {
        names,
        values: (&map * values).iter().copied().collect(),
        covariance: &map * covariance * map.transpose(),
        choice: None,
        unit: match group {
            Some(_) if is_low_pass(said, kind) => "s",
            Some(group) => group.unit,
            None => card(kind).unit,
        },
    }
}

/// True if the gyros' filter is a first-order low pass.
fn is_low_pass(said: &Said, kind: &str) -> bool {
    kind == "gyro_bandwidth" && said.registered.alignment.low_pass_s.is_some()
}

/// Linear map from a group's parameters to those of the gyros as recorded, for a map of their channels.
fn as_recorded(kind: &str, count: usize, recorded_from_case: &Matrix3<f64>) -> DMatrix<f64> {
    let axes = orthogonal(recorded_from_case);
    let of = |map: &Matrix3<f64>| DMatrix::from_fn(3, 3, |a, b| map[(a, b)]);
    match kind {
        "gyro_bias" => of(recorded_from_case),
        "gyro_scale" | "gyro_bandwidth" => of(&axes.component_mul(&axes)),
        "reference_misalignment" => of(&(axes * axes.determinant())),
        "installation" => DMatrix::from_fn(3, 3, |a, b| {
            let ((a, of_a), (b, of_b)) = (PAIRS[a], PAIRS[b]);
            axes[(a, b)] * axes[(of_a, of_b)] + axes[(a, of_b)] * axes[(of_a, b)]
        }),
        // Of the clock, or of the Earth in the case.
        _ => DMatrix::identity(count, count),
    }
}

/// Contract names of a group's parameters, and the linear map to them.
fn stated(group: &Group, navigation_from_start: &Matrix3<f64>) -> (Vec<String>, DMatrix<f64>) {
    let own = || group.names.iter().map(|name| (*name).to_string()).collect();
    match group.kind {
        // Stretch ab couples axis b into gyro a, and axis a into gyro b.
        "installation" => {
            let mut names = Vec::new();
            let mut map = DMatrix::zeros(6, 3);
            for (gyro, axis) in AXES.iter().enumerate() {
                for about in (0..3).filter(|about| *about != gyro) {
                    let (sign, senses) = rlg_catalogue::entry::tilt(gyro, about);
                    let pair = [(0, 1), (0, 2), (1, 2)]
                        .iter()
                        .position(|pair| *pair == (gyro.min(senses), gyro.max(senses)));
                    if let Some(pair) = pair {
                        map[(names.len(), pair)] = sign;
                    }
                    names.push(format!("{axis}{}", AXES[about]));
                }
            }
            (names, map)
        }
        // The Earth's rotation in the body frame at the start.
        "earth_rate" => {
            let turn = navigation_from_start.transpose();
            (own(), DMatrix::from_fn(3, 3, |a, b| turn[(a, b)]))
        }
        _ => (
            own(),
            DMatrix::identity(group.names.len(), group.names.len()),
        ),
    }
}
