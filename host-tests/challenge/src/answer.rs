//! Draw of a trial's concealed effects, with their strength and the attainable accuracy.
//!
//! From a [`TrialDraw`] and its scene's [`ScenePredictions`], the [`Answer`]: the effects, scaled to a matched-filter SNR
//! that is log-uniform from 3 to 100 over the fitted rows, their separation from the nearest rival, and the Cramér–Rao
//! bound. It is written, hashed and committed to before any diagnosis.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use nalgebra::{DMatrix, DVector};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::bounds::{beside, bound, degrees, nearest};
use super::kinds::{DRAWN, LINEAR, Linear, NOISY, UNLISTED};
use super::predict::{PARTS, ScenePredictions, effect};
use super::scene::{Scene, Setting, log_uniform};
use super::trial::{Design, Family, TrialDraw};
use super::whiten::Variances;
use rlg_recording::error::InputError;
use rlg_simulator::instrument::normal;

/// Range of the drawn strengths (matched-filter SNR), over the fitted rows.
pub const STRENGTHS: [f64; 2] = [3.0, 100.0];

/// Strengths of the detection marks, and some around them.
pub const LADDER: [f64; 6] = [4.0, 5.0, 6.0, 7.0, 8.0, 10.0];

/// Largest bound, in typical sizes, of a parameter that counts as identifiable: for such a bound a prior thirty times the
/// typical size changes nothing that a thousand trials would show.
pub const FIXED: f64 = 3.0;

/// Largest size of an instrument's error, in typical sizes, equal to the width of the tool's own prior.
const MOST_TYPICAL: f64 = 30.0;

/// Concealed effect.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Concealed {
    /// The contract's kind.
    pub kind: String,
    /// Its parameters: numbers, an axis, an expression.
    pub parameters: BTreeMap<String, Value>,
    /// Matched-filter SNR over the fitted rows.
    pub rho: f64,
    /// Matched-filter SNR over the whole recording.
    pub rho_whole: f64,
    /// SNR that remains given the other concealed effects.
    pub rho_beside: f64,
    /// SNR that remains given the nearest rival, too.
    pub separation: f64,
    /// Nearest rival.
    pub nearest: Option<String>,
    /// Number of directions that the data determine better than the largest size of an instrument.
    pub degrees: usize,
    /// Joint Cramér–Rao bound of each identifiable parameter, as a standard deviation.
    pub bound: BTreeMap<String, f64>,
}

/// Trial's truth, which the examined tool must not see.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Answer {
    /// Number of the trial.
    pub trial: u64,
    /// Family of the trial.
    pub family: Family,
    /// Number of the scene.
    pub scene: usize,
    /// Setting of the scene.
    pub setting: Setting,
    /// Row rate \[Hz\].
    pub rate_hz: f64,
    /// Seed of the noise.
    pub noise_seed: u64,
    /// Columns of random numbers are recorded too.
    pub dummies: bool,
    /// Samples jump for a row, and rows are lost.
    pub glitches: bool,
    /// Concealed effects.
    pub effects: Vec<Concealed>,
    /// Kind that is not distinguishable from the concealed one, by design.
    pub partner: Option<String>,
    /// Number of kinds that this scene could conceal: the hypotheses of the theory's detection threshold.
    pub kinds: usize,
    /// SNR of all effects together over the fitted rows.
    pub rho: f64,
    /// Power over the held-out rows, in units of the noise.
    pub held_out: f64,
    /// Expected power left there by a fit of the true kinds.
    pub oracle_leaves: f64,
    /// Salt: without it a short answer could be guessed from its hash.
    pub salt: String,
}

impl Answer {
    /// Serialises the answer to one line, which is hashed and written.
    pub fn line(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string(self)
    }

    /// Formats the concealed effects as TOML of the simulator.
    pub fn toml(&self) -> String {
        self.effects.iter().map(Concealed::toml).collect()
    }
}

impl Concealed {
    /// Formats the effect as TOML of the simulator.
    pub fn toml(&self) -> String {
        let mut lines = String::new();
        for (name, value) in &self.parameters {
            let _ = match (value.as_f64(), value.as_str()) {
                (Some(number), _) => writeln!(lines, "{name} = {number:e}"),
                (None, text) => writeln!(lines, "{name} = \"{}\"", text.unwrap_or_default()),
            };
        }
        effect(&self.kind, &lines)
    }

    /// Numbers of the effect.
    pub fn numbers(&self) -> BTreeMap<String, f64> {
        let numbers = self.parameters.iter();
        numbers
            .filter_map(|(name, value)| Some((name.clone(), value.as_f64()?)))
            .collect()
    }
}

/// Effect before scaling: its scaled and its fixed parameters, power and projections.
struct Draft {
    kind: &'static str,
    scaled: BTreeMap<String, f64>,
    fixed: BTreeMap<String, Value>,
    power: [f64; PARTS],
    against: DVector<f64>,
}

impl Draft {
    fn scale(&mut self, factor: f64) {
        self.scaled.values_mut().for_each(|value| *value *= factor);
        self.power = self.power.map(|power| power * factor * factor);
        self.against *= factor;
    }

    /// True if an instrument can have these numbers at strength `rho`.
    fn fits(&self, rho: f64) -> bool {
        let factor = rho / self.power[0].sqrt();
        let largest = Linear::of(self.kind).map_or(f64::INFINITY, |entry| {
            entry.largest.min(MOST_TYPICAL * entry.typical)
        });
        factor.is_finite()
            && self
                .scaled
                .values()
                .all(|value| (value * factor).abs() <= largest)
    }
}

/// Number of draws before a weaker strength is taken: some kinds hardly show in some scenes.
const ATTEMPTS: usize = 40;

/// Draws the concealed effects of a trial.
pub fn conceal(
    mut trial_draw: TrialDraw,
    scene: &Scene,
    predictions: &ScenePredictions,
) -> Result<Answer, InputError> {
    let rng = &mut trial_draw.rng;
    let mut drafts: Vec<Draft> = Vec::new();
    let mut noise = None;
    match trial_draw.family {
        Family::Null => {}
        Family::Single => drafts.push(draw(rng, predictions, STRENGTHS, |rng, predictions| {
            let kinds = predictions.products.kinds();
            let place = rng.random_range(0..kinds.len() + DRAWN.len());
            match kinds.get(place) {
                Some(entry) => Ok(linear(rng, predictions, entry)),
                None => drawn(rng, scene, predictions, DRAWN[place - kinds.len()]),
            }
        })?),
        Family::Detection => {
            let rho = LADDER[rng.random_range(0..LADDER.len())];
            drafts.push(draw(rng, predictions, [rho, rho], |rng, predictions| {
                let six: Vec<_> = predictions
                    .products
                    .kinds()
                    .into_iter()
                    .filter(|entry| entry.names().len() == 6)
                    .collect();
                let entry = six[rng.random_range(0..six.len())];
                Ok(linear(rng, predictions, entry))
            })?);
        }
        Family::Pair => {
            while drafts.len() < 2 {
                let draft = draw(rng, predictions, STRENGTHS, |rng, predictions| {
                    let kinds = predictions.products.kinds();
                    let entry = kinds[rng.random_range(0..kinds.len())];
                    Ok(linear(rng, predictions, entry))
                })?;
                if drafts.iter().all(|other| other.kind != draft.kind) {
                    drafts.push(draft);
                }
            }
        }
        Family::Confounded => {
            let design = trial_draw.design.unwrap_or(Design::Scale);
            let entry = Linear::of(design.kinds().0).unwrap_or(&LINEAR[0]);
            drafts.push(draw(rng, predictions, STRENGTHS, |rng, predictions| {
                Ok(linear(rng, predictions, entry))
            })?);
        }
        Family::Unlisted => drafts.push(draw(rng, predictions, STRENGTHS, |rng, predictions| {
            let known: Vec<_> = UNLISTED
                .iter()
                .filter(|(_, _, needs)| scene.has(*needs))
                .collect();
            let (axis, expression, _) = known[rng.random_range(0..known.len())];
            unlisted(predictions, axis, expression)
        })?),
        Family::Noise => noise = Some(noisy(rng, scene)),
    }
    let salt: [u64; 2] = [rng.random(), rng.random()];
    let places: Vec<usize> = drafts
        .iter()
        .flat_map(|draft| predictions.products.of(draft.kind))
        .collect();
    let joint = bound(&predictions.products, &places);
    let held = |matrix: &DMatrix<f64>| {
        let count = places.len();
        DMatrix::from_fn(count, count, |a, b| matrix[(places[a], places[b])])
    };
    let total: Option<DVector<f64>> = predictions
        .products
        .vector(drafts.iter().map(|draft| (draft.kind, &draft.scaled)));
    let power = |part: usize| match &total {
        Some(vector) => predictions.products.power(vector, part),
        None => drafts.iter().map(|draft| draft.power[part]).sum(),
    };
    let effects: Vec<Concealed> = match &noise {
        Some(concealed) => vec![concealed.clone()],
        None => drafts
            .iter()
            .map(|draft| concealed(predictions, draft, &drafts, &places, &joint))
            .collect(),
    };
    Ok(Answer {
        trial: trial_draw.trial,
        family: trial_draw.family,
        scene: scene.number,
        setting: scene.setting,
        rate_hz: scene.rate_hz,
        noise_seed: trial_draw.noise_seed,
        dummies: trial_draw.dummies,
        glitches: trial_draw.glitches,
        rho: noise.map_or_else(|| power(0).sqrt(), |noise| noise.rho),
        held_out: power(1),
        oracle_leaves: (&joint * held(&predictions.products.gram[1])).trace(),
        effects,
        partner: trial_draw.design.map(|design| design.kinds().1.to_owned()),
        kinds: predictions.products.kinds().len(),
        salt: format!("{:016x}{:016x}", salt[0], salt[1]),
    })
}

/// Draws until an instrument can have the effect at the drawn strength.
fn draw(
    rng: &mut ChaCha8Rng,
    predictions: &ScenePredictions,
    [low, high]: [f64; 2],
    mut one: impl FnMut(&mut ChaCha8Rng, &ScenePredictions) -> Result<Draft, InputError>,
) -> Result<Draft, InputError> {
    let rho = log_uniform(rng, low, high);
    for _ in 0..ATTEMPTS {
        let mut draft = one(rng, predictions)?;
        if draft.fits(rho) {
            draft.scale(rho / draft.power[0].sqrt());
            return Ok(draft);
        }
    }
    // A bias is observable in every scene.
    let mut draft = linear(rng, predictions, &LINEAR[0]);
    draft.scale(rho / draft.power[0].sqrt());
    Ok(draft)
}

/// Draws a linear kind: sign and size of each parameter independent, one gyro in three left out.
fn linear(rng: &mut ChaCha8Rng, predictions: &ScenePredictions, entry: &Linear) -> Draft {
    /// Standard deviation of ln size: a factor of 1.6 between parameters of one instrument.
    const SPREAD: f64 = 0.5;
    let places = predictions.products.of(entry.kind);
    let mut vector = DVector::zeros(predictions.products.names.len());
    for &place in &places {
        let draw = rng.random_bool(0.5);
        let sign = if draw || entry.is_positive() {
            1.0
        } else {
            -1.0
        };
        vector[place] = sign * entry.typical * (SPREAD * normal(rng)).exp();
    }
    let scaled = places
        .iter()
        .map(|&place| {
            (
                predictions.products.names[place].parameter.to_owned(),
                vector[place],
            )
        })
        .collect();
    Draft {
        kind: entry.kind,
        scaled,
        fixed: BTreeMap::new(),
        power: [0, 1, 2].map(|part| predictions.products.power(&vector, part)),
        against: &predictions.products.gram[0] * vector,
    }
}

/// Draws a kind with an instant, an order or a mode.
fn drawn(
    rng: &mut ChaCha8Rng,
    scene: &Scene,
    predictions: &ScenePredictions,
    kind: &'static str,
) -> Result<Draft, InputError> {
    let axis = Value::from(["x", "y", "z"][rng.random_range(0..3)]);
    let one = |name: &str, value: Value| (name.to_owned(), value);
    let seconds = if scene.is_dithered() { 20.0 } else { 40.0 };
    let mut scaled = BTreeMap::new();
    let fixed: BTreeMap<String, Value> = match kind {
        "axis_flexure_mode" => {
            for name in rlg_model::catalogue::SIX {
                scaled.insert((*name).to_owned(), 1e-7 * log_uniform(rng, 0.6, 1.6));
            }
            let top = (0.4 * scene.rate_hz).min(200.0);
            [
                one("frequency_hz", Value::from(log_uniform(rng, 10.0, top))),
                one("damping", Value::from(log_uniform(rng, 0.01, 0.1))),
            ]
            .into()
        }
        "reference_harmonic" => {
            let phase = rng.random::<f64>() * std::f64::consts::TAU;
            scaled.insert("cos".to_owned(), 1e-6 * phase.cos());
            scaled.insert("sin".to_owned(), 1e-6 * phase.sin());
            let order = f64::from(rng.random_range(1..=4));
            [one("axis", axis), one("order", Value::from(order))].into()
        }
        _ => {
            scaled.insert("size".to_owned(), 1e-6);
            // between a sixth and five sixths, so that there are rows before and after
            let time_s = seconds * (1.0 + 4.0 * rng.random::<f64>()) / 6.0;
            [one("axis", axis), one("time_s", Value::from(time_s))].into()
        }
    };
    simulated(predictions, kind, scaled, fixed)
}

/// Product of channels outside any catalogue.
fn unlisted(
    predictions: &ScenePredictions,
    axis: &str,
    expression: &str,
) -> Result<Draft, InputError> {
    let fixed: BTreeMap<String, Value> = [
        ("axis".to_owned(), Value::from(axis)),
        ("expression".to_owned(), Value::from(expression)),
    ]
    .into();
    let mut coefficient = 1e-6;
    loop {
        let scaled = BTreeMap::from([("coefficient".to_owned(), coefficient)]);
        let draft = simulated(predictions, "unlisted", scaled, fixed.clone())?;
        // Far above the rounding of the differences.
        if draft.power[0] > 100.0 || coefficient > 1e20 {
            return Ok(draft);
        }
        coefficient *= 1e4;
    }
}

fn simulated(
    predictions: &ScenePredictions,
    kind: &'static str,
    scaled: BTreeMap<String, f64>,
    fixed: BTreeMap<String, Value>,
) -> Result<Draft, InputError> {
    let mut parameters = fixed.clone();
    parameters.extend(
        scaled
            .iter()
            .map(|(name, value)| (name.clone(), Value::from(*value))),
    );
    let bare = Concealed {
        kind: kind.to_owned(),
        parameters,
        rho: 0.0,
        rho_whole: 0.0,
        rho_beside: 0.0,
        separation: 0.0,
        nearest: None,
        degrees: 0,
        bound: BTreeMap::new(),
    };
    let prediction = predictions.prediction(&bare.toml())?;
    Ok(Draft {
        kind,
        scaled,
        fixed,
        power: [0, 1, 2].map(|part| prediction.dot(&prediction, part)),
        against: predictions.against(&prediction),
    })
}

/// Draws a kind that only raises the noise. Its strength is the deflection of the log likelihood: √(½ Σ (ln S'/S)²) over
/// the bins.
fn noisy(rng: &mut ChaCha8Rng, scene: &Scene) -> Concealed {
    let kind = if scene.is_dithered() {
        NOISY[0]
    } else {
        NOISY[rng.random_range(0..2)]
    };
    let mut parameters = BTreeMap::new();
    let mut deflection = 0.0;
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let variances = Variances::of(scene, axis);
        let more = log_uniform(rng, 0.2, 8.0);
        let (value, walk, angle) = if kind == NOISY[0] {
            (
                (more * variances.walk * scene.rate_hz).sqrt(),
                more * variances.walk,
                0.0,
            )
        } else {
            (
                (12.0 * more * variances.angle).sqrt(),
                0.0,
                more * variances.angle,
            )
        };
        parameters.insert(name.to_owned(), Value::from(value));
        deflection += variances.deflection(walk, angle, scene.fitted_rows());
    }
    let rho = deflection.sqrt();
    Concealed {
        kind: kind.to_owned(),
        parameters,
        rho,
        rho_whole: rho,
        rho_beside: rho,
        separation: rho,
        nearest: None,
        degrees: 3,
        bound: BTreeMap::new(),
    }
}

fn concealed(
    predictions: &ScenePredictions,
    draft: &Draft,
    all: &[Draft],
    places: &[usize],
    joint: &DMatrix<f64>,
) -> Concealed {
    let products = &predictions.products;
    let others: Vec<&str> = all
        .iter()
        .map(|other| other.kind)
        .filter(|kind| *kind != draft.kind)
        .collect();
    let given: Vec<usize> = others.iter().flat_map(|kind| products.of(kind)).collect();
    let left = beside(&products.gram[0], draft.power[0], &draft.against, &given).sqrt();
    let rival = nearest(
        products,
        draft.power[0],
        &draft.against,
        draft.kind,
        &others,
    );
    let own = products.of(draft.kind);
    let bound = own
        .iter()
        .filter_map(|place| {
            let at = places.iter().position(|known| known == place)?;
            let name = products.names[*place];
            let std = joint[(at, at)].sqrt();
            (std < FIXED * LINEAR[name.entry].typical).then(|| (name.parameter.to_owned(), std))
        })
        .collect();
    let numbers = draft
        .scaled
        .iter()
        .map(|(name, value)| (name.clone(), Value::from(*value)));
    Concealed {
        kind: draft.kind.to_owned(),
        parameters: numbers.chain(draft.fixed.clone()).collect(),
        rho: draft.power[0].sqrt(),
        rho_whole: draft.power[2].sqrt(),
        rho_beside: left,
        separation: rival.map_or(left, |(_, separation)| separation),
        nearest: rival.map(|(kind, _)| kind.to_owned()),
        degrees: if own.is_empty() {
            1
        } else {
            degrees(products, &own, MOST_TYPICAL)
        },
        bound,
    }
}
