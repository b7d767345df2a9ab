//! Effects of the catalogue as columns of the attitude's increments: an effect's contribution to the gyros, transformed by
//! the attitude.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use rlg_catalogue::candidates::Variant;
use rlg_catalogue::entries::{CATALOGUE, SLIP, STEP, UNLISTED, coefficient_of};
use rlg_catalogue::entry::Entry;
use rlg_catalogue::signals::{AXES, Inputs, Motions, Path};
use rlg_catalogue::{Candidate, Expression, Pool, Signals};
use rlg_diagnosis::rows::model_effects::event_row;
use rlg_inference::Term;
use rlg_model::{EffectValue, Model, ModelEffect};
use rlg_plan::CataloguePlan;
use rlg_signal::axes::Triad;
use rlg_signal::residual::body_from_sensing;
use rlg_signal::streams::Streams;

use crate::gyros::gyro_times;
use crate::rows::alignment::GROUPS;
use crate::rows::linearised_rows::About;

/// True for kinds of the registration, or not distinguishable from it here: a filter of the reference would only cancel one
/// of the gyros.
fn is_registration(kind: &str) -> bool {
    ["reference_scale", "reference_bandwidth"].contains(&kind)
        || GROUPS.iter().any(|group| group.kind == kind)
}

/// Signals measured by the gyros, prepared for columns.
pub struct Gyro {
    /// Channels and derivatives; the case's motion is measured by the gyros.
    pub signals: Signals,
    /// Map from increments sensed along the gyros' axes, less their scale errors, to the case's axes.
    case_from_sensed: Matrix3<f64>,
    /// Map from the case's motion to the gyros as recorded: the identity unless channels are reversed, exchanged or in another
    /// unit.
    recorded_from_case: Matrix3<f64>,
    /// Gyros without that map, unless it is the identity.
    as_wired: Option<Box<Self>>,
}

impl Gyro {
    /// Prepares gyros with reversed or exchanged channels: their effects are those of the gyros as recorded, in a motion of the
    /// axes that these follow.
    ///
    /// # Inputs
    /// `recorded_from_case`: the map of the channels; the others as in [`Gyro::new`].
    pub(crate) fn recorded(
        streams: &Streams,
        model: &Model,
        (case_rad, off_vertical): (Arc<Triad>, Option<&Triad>),
        recorded_from_case: &Matrix3<f64>,
        plan: &CataloguePlan,
    ) -> Option<Self> {
        let as_wired = Self::new(streams, model, (Arc::clone(&case_rad), off_vertical), plan)?;
        if *recorded_from_case == Matrix3::identity() {
            return Some(as_wired);
        }
        let followed_rad = Arc::new(rlg_signal::axes::mapped(&case_rad, recorded_from_case));
        let gyro = Self::new(streams, model, (followed_rad, off_vertical), plan)?;
        let back = recorded_from_case.try_inverse()?;
        Some(Self {
            case_from_sensed: back * gyro.case_from_sensed,
            recorded_from_case: *recorded_from_case,
            as_wired: Some(Box::new(as_wired)),
            ..gyro
        })
    }

    /// # Inputs
    /// `case_rad`: motion in the gyros' case \[rad by row\]; `off_vertical`: turn from the specific force to the vertical,
    /// with accelerometers.
    pub fn new(
        streams: &Streams,
        model: &Model,
        (case_rad, off_vertical): (Arc<Triad>, Option<&Triad>),
        plan: &CataloguePlan,
    ) -> Option<Self> {
        let from_sensing = body_from_sensing(&model.gyro.installation_rad);
        let sensing_from_body = from_sensing.try_inverse()?;
        let scale = model.gyro.scale_error;
        let motions = Motions::of_one(case_rad, streams.dither_rad(), streams.rate_hz);
        let inputs = Inputs {
            others: &[],
            off_vertical,
            ..Inputs::of(streams)
        };
        let sensing = (sensing_from_body, sensing_from_body);
        Some(Self {
            signals: Signals::new(
                streams.rate_hz,
                motions,
                inputs,
                Path::default(),
                scale,
                sensing,
                plan,
            ),
            case_from_sensed: from_sensing
                * Matrix3::from_diagonal(&Vector3::from(scale.map(|scale| 1.0 - scale))),
            recorded_from_case: Matrix3::identity(),
            as_wired: None,
        })
    }

    /// Sums terms on the gyros, each times its size, as increments in the case's axes \[rad by row\].
    pub(crate) fn case_rad<'a>(
        &self,
        pool: &Pool,
        terms: impl Iterator<Item = (&'a Term, f64)>,
    ) -> Triad {
        let mut sensed: Triad = std::array::from_fn(|_| vec![0.0; self.signals.rows]);
        for (term, size) in terms {
            let values = pool.columns[term.column].values(&self.signals);
            rlg_signal::axes::add(&mut sensed[term.record], &values, size * term.coefficient);
        }
        self.in_case(&sensed)
    }

    fn in_case(&self, sensed: &Triad) -> Triad {
        let mut case: Triad = std::array::from_fn(|_| vec![0.0; self.signals.rows]);
        for (axis, case) in case.iter_mut().enumerate() {
            for (gyro, sensed) in sensed.iter().enumerate() {
                rlg_signal::axes::add(case, sensed, self.case_from_sensed[(axis, gyro)]);
            }
        }
        case
    }

    /// Sums the contributions of a model's effects outside the registration to the gyros, in the case's axes \[rad by row\].
    pub fn known_rad(&self, model: &Model) -> Triad {
        let mut all: Triad = std::array::from_fn(|_| vec![0.0; self.signals.rows]);
        for effect in &model.effects {
            let linear = CATALOGUE.iter().find(|entry| entry.kind == effect.kind);
            let part = match linear {
                Some(entry) => self.linear(entry, effect),
                None => self.event(effect),
            };
            if let Some(part) = part {
                rlg_signal::axes::add_triad(&mut all, &part, 1.0);
            }
        }
        all
    }

    fn linear(&self, entry: &Entry, effect: &ModelEffect) -> Option<Triad> {
        // The registration applies these exactly, except parameters without a value in the alignment.
        let is_exact = entry.kind == gyro_times::KIND
            || is_registration(entry.kind)
                && !["earth_rate", "gyro_bandwidth", "reference_bandwidth"].contains(&entry.kind);
        if is_exact {
            return None;
        }
        // The Earth turns past the case, whatever sign its motion is read with.
        if let Some(as_wired) = self
            .as_wired
            .as_ref()
            .filter(|_| entry.kind == "earth_rate")
        {
            return as_wired.linear(entry, effect);
        }
        let mut pool = Pool::default();
        let whole = pool.whole(entry, &self.signals);
        let terms = whole.iter().flat_map(|(name, terms)| {
            let value = coefficient_of(entry.kind, effect.number(name));
            terms.iter().map(move |term| (term, value))
        });
        Some(self.case_rad(&pool, terms))
    }

    fn event(&self, effect: &ModelEffect) -> Option<Triad> {
        let EffectValue::Text(axis) = effect.parameters.get("axis")? else {
            return None;
        };
        let axis = AXES.iter().position(|name| name == axis)?;
        let signals = &self.signals;
        if effect.kind == UNLISTED {
            let expression = Expression::parse(effect.text("expression")?, signals)?;
            let mut pool = Pool::default();
            let one = pool.expression(axis, expression, 1.0, signals);
            let size = effect.number("coefficient");
            let terms = one.hypothesis.terms.iter();
            return Some(self.case_rad(&pool, terms.map(|term| (term, size))));
        }
        let row = event_row(effect, signals.start_s, signals.rate_hz, signals.rows);
        let size = effect.number("size");
        let mut sensed: Triad = std::array::from_fn(|_| vec![0.0; self.signals.rows]);
        match effect.kind.as_str() {
            STEP => sensed[axis][row..].fill(size * self.signals.period_s()),
            SLIP => sensed[axis][row] = size,
            _ => return None,
        }
        Some(self.in_case(&sensed))
    }

    /// Transforms a rate of one gyro \[rad/s\] to increments in the case's axes \[rad by row\].
    pub fn sensed_along(&self, axis: usize, rate_rad_s: f64) -> Vector3<f64> {
        self.case_from_sensed.column(axis) * (rate_rad_s * self.signals.period_s())
    }

    /// Components of a vector of the case along the gyros' axes.
    pub(crate) fn on_gyros(&self, case: Vector3<f64>) -> Vector3<f64> {
        self.signals.sensing_from_body * (self.recorded_from_case * case)
    }

    /// Physical effects observable with these channels, each whole.
    pub fn candidates(&self, left_out: &[&str]) -> (Pool, Vec<Candidate>) {
        let (pool, mut all) = self.whole(left_out);
        all.retain(|one| !is_registration(one.kind));
        for one in all.iter_mut().filter(|one| one.kind == ELASTIC) {
            without_own_axes(one);
        }
        (pool, all)
    }

    /// Effects of the catalogue observable with these channels, each with all its parameters.
    pub fn whole(&self, left_out: &[&str]) -> (Pool, Vec<Candidate>) {
        let mut pool = Pool::default();
        let mut all = pool.candidates(&self.signals, [true; 3], left_out);
        all.retain(|one| matches!(one.variant, Variant::Whole));
        (pool, all)
    }

    /// Contribution of each parameter of an effect to the gyros, in the case's axes \[rad by row\].
    pub fn in_case_rad(&self, pool: &Pool, candidate: &Candidate) -> impl Iterator<Item = Triad> {
        (0..candidate.names.len()).map(move |parameter| {
            let terms = candidate.hypothesis.terms.iter();
            let own = terms.filter(|term| term.parameter == parameter);
            self.case_rad(pool, own.map(|term| (term, 1.0)))
        })
    }

    /// Column of each parameter of an effect.
    pub fn columns(&self, pool: &Pool, candidate: &Candidate, about: &About) -> Vec<Triad> {
        carried(candidate, self.in_case_rad(pool, candidate), about)
    }
}

/// Transforms the contributions of an effect's parameters in the case's axes to columns.
pub fn carried(
    candidate: &Candidate,
    in_case_rad: impl Iterator<Item = Triad>,
    about: &About,
) -> Vec<Triad> {
    let column = |case: Triad| about.carried(|row| Vector3::from_fn(|axis, _| case[axis][row]));
    let mut columns: Vec<Triad> = in_case_rad.map(column).collect();
    if candidate.kind == "gyro_delay" {
        without_mean(&mut columns);
    }
    columns
}

/// An elastic rate whose part about a gyro's own axis equals that gyro's filter, which the registration always contains.
const ELASTIC: &str = "elastic_rate_by_jerk";

/// Removes xx, yy and zz from an effect.
fn without_own_axes(candidate: &mut Candidate) {
    let kept: Vec<usize> = (0..candidate.names.len())
        .filter(|k| {
            let name = candidate.names[*k].as_bytes();
            name.first() != name.last()
        })
        .collect();
    let hypothesis = &mut candidate.hypothesis;
    hypothesis.terms = hypothesis
        .terms
        .iter()
        .filter_map(|term| {
            let parameter = kept.iter().position(|k| *k == term.parameter)?;
            Some(Term { parameter, ..*term })
        })
        .collect();
    hypothesis.parameters = kept.len();
    hypothesis.bounds = kept.iter().map(|k| hypothesis.bound(*k)).collect();
    candidate.names = kept.iter().map(|k| candidate.names[*k].clone()).collect();
    candidate.base = vec![0.0; kept.len()];
}

/// Subtracts the mean of columns from each: it is the delay of the reference, which the registration always contains.
fn without_mean(columns: &mut [Triad]) {
    let share = 1.0 / columns.len() as f64;
    let mut mean: Triad = columns[0].each_ref().map(|values| vec![0.0; values.len()]);
    for column in columns.iter() {
        rlg_signal::axes::add_triad(&mut mean, column, share);
    }
    for column in columns {
        rlg_signal::axes::add_triad(column, &mean, -1.0);
    }
}
