//! Compares the runs of a fleet: a row for each parameter of each effect of each run.

use std::collections::{BTreeMap, BTreeSet};

use super::few;
use super::run::{Effect, Run, Told};
use super::statistics::{Fleet, Measured, Place, Slope, mean, normal_chance, slopes};

/// Seconds in a day.
const DAY_S: f64 = 86_400.0;

/// Thresholds for outliers and trends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SummaryPlan {
    /// Robust z beyond which an instrument is an outlier (Iglewicz & Hoaglin 1993); of few instruments, the same chance in
    /// Student's t.
    pub outlier_z: f64,
    /// Instruments from which one can be distinguished from the others by the scatter of their own recordings: of two, either.
    pub few_instruments: usize,
    /// Instruments required for a median and its deviation: of four, two outliers are half.
    pub least_instruments: usize,
    /// Degrees of freedom required of a trend, to estimate its scatter.
    pub spare_runs: usize,
    /// Chance of noise alone below which a trend is reported, all slopes of the fleet counted: that of 3 σ.
    pub trend_chance: f64,
}

impl Default for SummaryPlan {
    fn default() -> Self {
        Self {
            outlier_z: 3.5,
            few_instruments: 3,
            least_instruments: 5,
            spare_runs: 1,
            trend_chance: normal_chance(3.0),
        }
    }
}

/// Key of comparable numbers: kind, its texts (an axis, an expression), parameter, and index among several such.
type Key = (String, String, String, usize);

/// A run with its numbers by key.
type Keyed = (Run, Vec<(Key, Found)>);

/// A parameter of an effect in one run.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Kind.
    pub kind: String,
    /// Texts of the effect, such as its axis.
    pub texts: String,
    /// Parameter.
    pub parameter: String,
    /// Value with its standard deviation, SI.
    pub measured: Measured,
    /// Unit.
    pub unit: String,
    /// `named` or `class`.
    pub label: Option<String>,
    /// Kinds not distinguishable from it in the recording.
    pub indistinguishable_from: Vec<String>,
    /// p-value, corrected for the number of trials.
    pub p_value: f64,
    /// Mean of the instrument's recordings.
    pub own: Option<Measured>,
    /// The fleet's median and spread; of few instruments, that of the others.
    pub fleet: Option<Fleet>,
    /// Robust z of the instrument in the fleet; of few instruments, its distance from the others over the scatter of
    /// recordings.
    pub fleet_z: Option<f64>,
    /// True if the instrument is an outlier.
    pub is_outlier: bool,
    /// The instrument's trend with time \[a day\].
    pub per_day: Option<Slope>,
    /// The instrument's trend with temperature \[a kelvin\].
    pub per_kelvin: Option<Slope>,
}

/// An instrument's trend beyond its noise.
#[derive(Debug, Clone, Copy)]
pub struct Trend<'a> {
    /// Instrument.
    pub instrument: &'a str,
    /// Number that changes.
    pub of: &'a Found,
    /// `day` or `kelvin`.
    pub a: &'static str,
    /// Change a day or a kelvin.
    pub slope: Slope,
}

/// A run with its findings.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// The run.
    pub run: Run,
    /// In the order of the diagnosis.
    pub found: Vec<Found>,
}

/// The fleet.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Runs by instrument, then start, then name.
    pub lines: Vec<Line>,
    plan: SummaryPlan,
}

/// Lists the numbers of a diagnosis with their keys.
fn numbers(told: &Told) -> Vec<(Key, Found)> {
    let mut seen: BTreeMap<(String, String, String), usize> = BTreeMap::new();
    let mut all = Vec::new();
    for effect in &told.effects {
        let texts = texts(effect);
        for parameter in &effect.parameters {
            let number = (parameter.value.as_f64(), parameter.std, &parameter.unit);
            let (Some(value), Some(std), Some(unit)) = number else {
                continue;
            };
            let key = (effect.kind.clone(), texts.clone(), parameter.name.clone());
            let place = seen.entry(key.clone()).or_default();
            let key = (key.0, key.1, key.2, *place);
            *place += 1;
            let found = Found {
                kind: effect.kind.clone(),
                texts: texts.clone(),
                parameter: parameter.name.clone(),
                measured: Measured { value, std },
                unit: unit.clone(),
                label: effect.label.clone(),
                indistinguishable_from: effect.indistinguishable_from.clone(),
                p_value: effect.p_value,
                own: None,
                fleet: None,
                fleet_z: None,
                is_outlier: false,
                per_day: None,
                per_kelvin: None,
            };
            all.push((key, found));
        }
    }
    all
}

fn texts(effect: &Effect) -> String {
    let texts = effect.parameters.iter();
    let texts = texts.filter_map(|one| Some(format!("{} {}", one.name, one.value.as_str()?)));
    texts.collect::<Vec<_>>().join(", ")
}

/// Returns a run's estimate for a key: its value; or 0 with the standard deviation of the test if the kind was tested and
/// not found; `None` if the recording could not have shown it.
fn said(told: &Told, numbers: &[(Key, Found)], key: &Key) -> Option<Measured> {
    if let Some((_, found)) = numbers.iter().find(|(one, _)| one == key) {
        return Some(found.measured);
    }
    let tested = told
        .sensitivity
        .iter()
        .find(|tested| tested.kind == key.0)?;
    (tested.snr > 0.0).then(|| Measured {
        value: 0.0,
        std: (tested.typical / tested.snr).abs(),
    })
}

impl Summary {
    /// Compares runs.
    pub fn of(mut runs: Vec<Run>, plan: &SummaryPlan) -> Self {
        runs.sort_by(|a, b| {
            let start = |run: &Run| run.about.start_s.unwrap_or(f64::INFINITY);
            let by_start = start(a).total_cmp(&start(b));
            let by_instrument = a.instrument().cmp(b.instrument());
            by_instrument.then(by_start).then(a.name.cmp(&b.name))
        });
        let told = |run: &Run| run.told.as_ref().map(numbers).unwrap_or_default();
        let mut keyed: Vec<Keyed> = runs
            .into_iter()
            .map(|run| {
                let found = told(&run);
                (run, found)
            })
            .collect();
        let keys: BTreeSet<Key> = keyed
            .iter()
            .flat_map(|(_, found)| found.iter().map(|(key, _)| key.clone()))
            .collect();
        for key in &keys {
            place(&mut keyed, key, plan);
            follow(&mut keyed, key, plan);
        }
        let line = |(run, found): Keyed| Line {
            run,
            found: found.into_iter().map(|(_, found)| found).collect(),
        };
        Self {
            lines: keyed.into_iter().map(line).collect(),
            plan: *plan,
        }
    }

    /// Returns the names of the known instruments.
    pub fn instruments(&self) -> BTreeSet<&str> {
        let runs = self.lines.iter().map(|line| &line.run);
        let known = runs.filter(|run| run.has_instrument());
        known.map(Run::instrument).collect()
    }

    /// Returns the numbers of an instrument, each once, with the first of its runs that has it.
    fn once(&self) -> Vec<(&Line, &Found)> {
        let mut seen = BTreeSet::new();
        let all = self.lines.iter();
        let all = all.flat_map(|line| line.found.iter().map(move |one| (line, one)));
        all.filter(|(line, one)| {
            let name = (line.run.instrument(), &one.kind, &one.texts, &one.parameter);
            seen.insert(name)
        })
        .collect()
    }

    /// Returns the numbers that stand out, once an instrument, the farthest first.
    pub fn outliers(&self) -> Vec<(&str, &Found)> {
        let outliers = self.once().into_iter().filter(|(_, one)| one.is_outlier);
        let mut outliers: Vec<_> = outliers
            .map(|(line, one)| (line.run.instrument(), one))
            .collect();
        let far = |one: &Found| one.fleet_z.map_or(0.0, f64::abs);
        outliers.sort_by(|(_, a), (_, b)| far(b).total_cmp(&far(a)));
        outliers
    }

    /// Returns the trends beyond their noise, the clearest first.
    ///
    /// The chance of noise alone is Student's, and every slope of the fleet is counted as a trial (Bonferroni).
    pub fn trends(&self) -> Vec<Trend<'_>> {
        let mut tried = Vec::new();
        for (line, one) in self.once() {
            for (slope, a) in [(one.per_day, "day"), (one.per_kelvin, "kelvin")] {
                tried.extend(slope.map(|slope| (slope, a, line, one)));
            }
        }
        let chance = self.plan.trend_chance / tried.len() as f64;
        let mut trends: Vec<Trend<'_>> = tried
            .into_iter()
            .filter(|(slope, ..)| slope.chance() < chance)
            .map(|(slope, a, line, of)| Trend {
                instrument: line.run.instrument(),
                of,
                a,
                slope,
            })
            .collect();
        trends.sort_by(|a, b| a.slope.chance().total_cmp(&b.slope.chance()));
        trends
    }

    /// Returns the runs without a diagnosis, with the reason.
    pub fn refused(&self) -> impl Iterator<Item = (&Run, &str)> {
        self.lines
            .iter()
            .filter_map(|line| Some((&line.run, line.run.told.as_ref().err()?.as_str())))
    }
}

/// Computes each instrument's robust z in the fleet.
fn place(keyed: &mut [Keyed], key: &Key, plan: &SummaryPlan) {
    let mut by_instrument: BTreeMap<String, Vec<Measured>> = BTreeMap::new();
    for (run, found) in keyed.iter() {
        let Ok(told) = &run.told else { continue };
        if let Some(said) = said(told, found, key) {
            let all = by_instrument.entry(run.instrument().to_owned());
            all.or_default().push(said);
        }
    }
    let places = match by_instrument.len() {
        count if count < plan.few_instruments => BTreeMap::new(),
        count if count < plan.least_instruments => few::places(&by_instrument, plan.outlier_z),
        _ => by_median(&by_instrument, plan.outlier_z),
    };
    for (run, found) in keyed {
        let own = by_instrument
            .get(run.instrument())
            .and_then(|all| mean(all));
        let place = places.get(run.instrument());
        for (_, one) in found.iter_mut().filter(|(one, _)| one == key) {
            one.own = own;
            one.fleet = place.map(|place| place.fleet);
            one.fleet_z = place.map(|place| place.z);
            one.is_outlier = place.is_some_and(|place| place.is_outlier);
        }
    }
}

/// Places every instrument by the median of all and its deviation.
fn by_median(
    by_instrument: &BTreeMap<String, Vec<Measured>>,
    outlier_z: f64,
) -> BTreeMap<String, Place> {
    let means = by_instrument.iter();
    let means = means.filter_map(|(instrument, all)| Some((instrument, mean(all)?)));
    let means: Vec<(&String, Measured)> = means.collect();
    let values: Vec<f64> = means.iter().map(|(_, mean)| mean.value).collect();
    let Some(fleet) = Fleet::of(&values) else {
        return BTreeMap::new();
    };
    let place = |(instrument, mean): (&String, Measured)| {
        let z = fleet.z(mean);
        let place = Place {
            fleet,
            z,
            is_outlier: z.abs() > outlier_z,
        };
        (instrument.clone(), place)
    };
    means.into_iter().map(place).collect()
}

/// A value with its time \[day\] and temperature \[K\], if known.
type Dated = (Measured, [Option<f64>; 2]);

/// Fits each instrument's trends with time and temperature, if known for all runs with the effect.
fn follow(keyed: &mut [Keyed], key: &Key, plan: &SummaryPlan) {
    let mut by_instrument: BTreeMap<String, Vec<Dated>> = BTreeMap::new();
    for (run, found) in keyed.iter() {
        if let Some((_, one)) = found.iter().find(|(one, _)| one == key) {
            let days = run.about.start_s.map(|start_s| start_s / DAY_S);
            let all = by_instrument.entry(run.instrument().to_owned());
            let at = [days, run.about.temperature_k];
            all.or_default().push((one.measured, at));
        }
    }
    for (run, found) in keyed {
        let Some(all) = by_instrument.get(run.instrument()) else {
            continue;
        };
        let values: Vec<Measured> = all.iter().map(|(value, _)| *value).collect();
        let axis = |k: usize| all.iter().map(|(_, at)| at[k]).collect();
        let axes: [Option<Vec<f64>>; 2] = [0, 1].map(axis);
        let known: Vec<Vec<f64>> = axes.iter().flatten().cloned().collect();
        let mut fitted = slopes(&values, &known, plan.spare_runs).into_iter();
        let [per_day, per_kelvin] = axes.map(|axis| axis.and_then(|_| fitted.next().flatten()));
        for (_, one) in found.iter_mut().filter(|(one, _)| one == key) {
            one.per_day = per_day;
            one.per_kelvin = per_kelvin;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fleet::run::{Parameter, Tested};
    use crate::recording::About;

    fn run(name: &str, instrument: &str, scale: Option<f64>, day: f64) -> Run {
        let effect = |value: f64| Effect {
            kind: "gyro_scale".to_owned(),
            indistinguishable_from: Vec::new(),
            parameters: vec![Parameter {
                name: "x".to_owned(),
                value: value.into(),
                std: Some(1e-6),
                unit: Some("1".to_owned()),
            }],
            p_value: 0.0,
            label: Some("named".to_owned()),
        };
        Run {
            name: name.to_owned(),
            page: None,
            about: About {
                recording: name.to_owned(),
                instrument: Some(instrument.to_owned()),
                start: None,
                start_s: Some(day * DAY_S),
                temperature_k: None,
            },
            told: serde_json::from_value(serde_json::json!({
                "recording": name, "verdict": "explained", "effects": [], "sensitivity": [],
            }))
            .map(|told: Told| Told {
                effects: scale.map(effect).into_iter().collect(),
                sensitivity: vec![Tested {
                    kind: "gyro_scale".to_owned(),
                    typical: 1e-4,
                    snr: 50.0,
                }],
                ..told
            })
            .map_err(|error| error.to_string()),
        }
    }

    fn found(runs: Vec<Run>) -> Vec<(String, Found)> {
        let summary = Summary::of(runs, &SummaryPlan::default());
        let named = |line: Line| {
            let name = line.run.name;
            line.found.into_iter().map(move |one| (name.clone(), one))
        };
        summary.lines.into_iter().flat_map(named).collect()
    }

    #[test]
    fn the_one_with_an_effect_that_the_others_were_tested_for_stands_out() {
        let mut runs: Vec<Run> = (0..5)
            .map(|k| run(&format!("r{k}"), &format!("u{k}"), None, 0.0))
            .collect();
        runs.push(run("r5", "u5", Some(1e-4), 0.0));
        let all = found(runs.clone());
        // The spread is zero, so its own standard deviation alone decides.
        assert_eq!(all.len(), 1);
        assert!(all[0].1.is_outlier && (all[0].1.fleet_z.expect("a z") - 100.0).abs() < 1e-9);
        // Runs that could not have shown it have no estimate.
        for run in &mut runs[..5] {
            run.told.as_mut().expect("a diagnosis").sensitivity.clear();
        }
        assert_eq!(found(runs)[0].1.fleet_z, None);
    }

    #[test]
    fn an_instruments_runs_are_one_value_of_the_fleet_and_a_trend() {
        let mut runs: Vec<Run> = (0..4)
            .map(|k| {
                run(
                    &format!("r{k}"),
                    &format!("u{k}"),
                    Some(1e-5 * f64::from(k)),
                    0.0,
                )
            })
            .collect();
        runs.extend((0..6).map(|k| {
            run(
                &format!("s{k}"),
                "u9",
                Some(2e-4 + 1e-6 * f64::from(k)),
                f64::from(k),
            )
        }));
        let all = found(runs);
        let of = |name: &str| &all.iter().find(|(run, _)| run == name).expect("the run").1;
        assert_eq!(of("s0").fleet.expect("a fleet").median, 2e-5);
        assert!(of("s0").is_outlier && of("s5").is_outlier && !of("r3").is_outlier);
        let trend = of("s3").per_day.expect("a trend").measured;
        assert!(
            (trend.value - 1e-6).abs() < 1e-12 && (trend.std - 1e-6 / 17.5f64.sqrt()).abs() < 1e-12
        );
        assert_eq!((of("r1").per_day, of("s3").per_kelvin), (None, None));
    }
}
