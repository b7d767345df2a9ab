//! Single members of the catalogue's families: candidates with nonlinear parameters (order, frequency, time constant,
//! threshold), linearised about a first value and relinearised at an estimate.

use rlg_inference::{Bound, Fixed, Hypothesis, Term};
use rlg_plan::SizePlan;

use crate::candidates::{Candidate, Pool, Variant, along, of_one_term};
use crate::column::Column;
use crate::entries::{BANDWIDTH, HARMONIC, HIGH_PASS, LOCK_IN, MODE, MOUNT, UNLISTED};
use crate::entry::tilt;
use crate::expression::Expression;
use crate::high_pass::{self, HighPass};
use crate::lock_in::{self, Threshold};
use crate::low_pass::{self, LowPass};
use crate::resonance::{CRITICAL, PARTS, Part, Resonance};
use crate::sensed::Sensed;
use crate::signals::{AXES, Signals};
use crate::stiffness;

/// Candidate with nonlinear parameters, linearised about the values in `base`, selected from `places`.
fn about_values(
    kind: &'static str,
    (names, base): (Vec<String>, Vec<f64>),
    (terms, fixed): (Vec<Term>, Vec<Fixed>),
    of_parameter: impl Fn(&str) -> Bound,
    places: f64,
) -> Candidate {
    let bounds = names
        .iter()
        .zip(&base)
        .map(|(name, base)| of_parameter(name).about(*base));
    Candidate {
        kind,
        variant: Variant::Whole,
        hypothesis: Hypothesis {
            parameters: names.len(),
            terms,
            fixed,
            bounds: bounds.collect(),
            requires: None,
            price: places.ln(),
        },
        base,
        names,
    }
}

/// Bounds of a resonance's parameters at a row rate: at most critical damping and half the row rate.
fn of_resonance(signals: &Signals) -> impl Fn(&str) -> Bound {
    let (rate_hz, flexure_std_s2) = (signals.rate_hz, signals.plan.sizes.flexure_std_s2);
    move |name| {
        if name.ends_with("frequency_hz") {
            Bound {
                std: f64::INFINITY,
                range: [0.0, 0.5 * rate_hz],
            }
        } else if name.ends_with("damping") {
            Bound {
                std: f64::INFINITY,
                range: [0.0, CRITICAL],
            }
        } else {
            Bound {
                std: flexure_std_s2,
                ..Bound::NONE
            }
        }
    }
}

/// Moves a value by a step, limited to the trust region of the linearisation.
fn moved(value: f64, step: f64) -> f64 {
    const MOST_RATIO: f64 = 1.3;
    (value + step).clamp(value / MOST_RATIO, value * MOST_RATIO)
}

/// Bound of an encoder's error of one order \[rad\].
fn of_harmonic(plan: &SizePlan) -> Bound {
    Bound {
        std: plan.harmonic_std_rad,
        range: [-plan.harmonic_most_rad, plan.harmonic_most_rad],
    }
}

/// Nonlinear parameter of one gyro and its columns, linearised about a value.
struct AboutValue {
    name: String,
    value: f64,
    /// Column of the effect at that value.
    whole: Column,
    /// Derivative of the column.
    slope: Column,
}

/// Single members of the catalogue's families.
impl Pool {
    /// Error of the reference of one order, selected from `places`.
    pub fn harmonic(
        &mut self,
        axis: usize,
        order: u32,
        places: f64,
        signals: &Signals,
    ) -> Candidate {
        let waves = [true, false]
            .map(|is_cosine| self.tried(Column::Wave(axis, order, is_cosine), axis, signals));
        let terms = waves
            .into_iter()
            .enumerate()
            .flat_map(|(parameter, column)| {
                (0..3).map(move |gyro| Term {
                    parameter,
                    record: gyro,
                    column,
                    coefficient: -along(signals, gyro, axis),
                })
            });
        Candidate {
            kind: HARMONIC,
            variant: Variant::Harmonic { axis, order },
            names: ["cos", "sin"].map(str::to_string).to_vec(),
            base: vec![0.0; 2],
            hypothesis: Hypothesis {
                parameters: 2,
                terms: terms.filter(|term| term.coefficient != 0.0).collect(),
                fixed: Vec::new(),
                bounds: vec![of_harmonic(&signals.plan.sizes); 2],
                requires: None,
                price: places.ln(),
            },
        }
    }

    /// Expression on one gyro, selected from `places`.
    pub fn expression(
        &mut self,
        axis: usize,
        expression: Expression,
        places: f64,
        signals: &Signals,
    ) -> Candidate {
        let term = Term {
            parameter: 0,
            record: axis,
            column: self.tried(Column::Expression(expression), axis, signals),
            coefficient: 1.0 / (1.0 - signals.scale_error[axis]),
        };
        let variant = Variant::Expression { axis, expression };
        of_one_term(UNLISTED, variant, "coefficient", term, places)
    }

    /// Resonant suspension, selected from `places`: the six flexures, and the resonance linearised about a first value
    /// with the flexures `k_s2`.
    pub fn suspension(
        &mut self,
        resonance: Resonance,
        k_s2: [f64; 6],
        places: f64,
        signals: &Signals,
    ) -> Candidate {
        let mut terms = Vec::new();
        let mut names = Vec::new();
        for (gyro, gyro_name) in AXES.iter().enumerate() {
            for about in (0..3).filter(|about| *about != gyro) {
                let (sign, senses) = tilt(gyro, about);
                let flexure = names.len();
                for (part, parameter) in PARTS.into_iter().zip([flexure, 6, 7]) {
                    let size = if part == Part::Response {
                        1.0
                    } else {
                        k_s2[flexure]
                    };
                    terms.push(Term {
                        parameter,
                        record: gyro,
                        column: self.tried(
                            Column::ResonantFlexure(about, senses, resonance, part),
                            gyro,
                            signals,
                        ),
                        coefficient: -sign * size / (1.0 - signals.scale_error[gyro]),
                    });
                }
                names.push(format!("{gyro_name}{}", AXES[about]));
            }
        }
        names.extend(["frequency_hz", "damping"].map(str::to_string));
        let mut base = vec![0.0; 6];
        base.extend([resonance.hz, resonance.damping]);
        terms.retain(|term| term.coefficient != 0.0);
        let largest = stiffness::largest_of_mode(resonance, signals);
        let of_resonance = of_resonance(signals);
        let of_parameter = |name: &str| match name.len() {
            2 => stiffness::within(of_resonance(name), name, Some(largest)),
            _ => of_resonance(name),
        };
        about_values(
            MODE,
            (names, base),
            (terms, Vec::new()),
            of_parameter,
            places,
        )
    }

    /// Soft mount, selected from `places`: the complete response about each axis with a mount, and its resonance
    /// linearised about a first value.
    pub fn mount(
        &mut self,
        mount: [Option<Resonance>; 3],
        places: f64,
        signals: &Signals,
    ) -> Candidate {
        let (mut terms, mut fixed) = (Vec::new(), Vec::new());
        let (mut names, mut base) = (Vec::new(), Vec::new());
        for (axis, resonance) in mount.into_iter().enumerate() {
            let Some(resonance) = resonance else { continue };
            let along: Vec<(usize, f64)> = (0..3)
                .map(|gyro| (gyro, along(signals, gyro, axis)))
                .filter(|(_, along)| *along != 0.0)
                .collect();
            let response = Column::Mount(axis, resonance, Part::Response);
            for &(record, size) in &along {
                fixed.push(Fixed {
                    record,
                    column: self.place(Sensed::independent(response)),
                    size,
                });
            }
            for (part, name) in [
                (Part::ByFrequency, "frequency_hz"),
                (Part::ByDamping, "damping"),
            ] {
                let column = self.tried(Column::Mount(axis, resonance, part), axis, signals);
                terms.extend(along.iter().map(|&(record, coefficient)| Term {
                    parameter: names.len(),
                    record,
                    column,
                    coefficient,
                }));
                names.push(format!("{}_{name}", AXES[axis]));
            }
            base.extend([resonance.hz, resonance.damping]);
        }
        about_values(
            MOUNT,
            (names, base),
            (terms, fixed),
            of_resonance(signals),
            places,
        )
    }

    /// First-order low passes, selected from `places`: the complete response of each gyro with a low pass, and its time
    /// constant linearised about a first value.
    pub fn low_pass(
        &mut self,
        low_passes: [Option<LowPass>; 3],
        places: f64,
        signals: &Signals,
    ) -> Candidate {
        let of_gyros = low_passes.into_iter().enumerate().map(|(gyro, low_pass)| {
            let part = |low_pass, part| Column::LowPass(gyro, low_pass, part);
            low_pass.map(|low_pass: LowPass| AboutValue {
                name: format!("{}_pole_s", AXES[gyro]),
                value: low_pass.time_s,
                whole: part(low_pass, low_pass::Part::Response),
                slope: part(low_pass, low_pass::Part::ByTime),
            })
        });
        Candidate {
            variant: Variant::LowPass,
            ..self.on_gyros(BANDWIDTH, of_gyros, places, signals)
        }
    }

    /// First-order high passes, selected from `places`: the full response behind each gyro with one, and the time constant
    /// linearised about a first value.
    pub fn high_pass(
        &mut self,
        high_passes: [Option<HighPass>; 3],
        places: f64,
        signals: &Signals,
    ) -> Candidate {
        let of_gyros = high_passes
            .into_iter()
            .enumerate()
            .map(|(gyro, high_pass)| {
                let part = |high_pass, part| Column::HighPass(gyro, high_pass, part);
                high_pass.map(|high_pass: HighPass| AboutValue {
                    name: AXES[gyro].to_string(),
                    value: high_pass.time_s,
                    whole: part(high_pass, high_pass::Part::Response),
                    slope: part(high_pass, high_pass::Part::ByTime),
                })
            });
        self.on_gyros(HIGH_PASS, of_gyros, places, signals)
    }

    /// Lock-in, selected from `places`: the dead band of each gyro with a threshold, and the threshold linearised about
    /// a first value.
    pub fn lock_in(
        &mut self,
        thresholds: [Option<Threshold>; 3],
        places: f64,
        signals: &Signals,
    ) -> Candidate {
        let of_gyros = thresholds.into_iter().enumerate().map(|(gyro, threshold)| {
            let part = |threshold, part| Column::LockIn(gyro, threshold, part);
            threshold.map(|threshold: Threshold| AboutValue {
                name: AXES[gyro].to_string(),
                value: threshold.rad_s,
                whole: part(threshold, lock_in::Part::Missing),
                slope: part(threshold, lock_in::Part::ByThreshold),
            })
        });
        self.on_gyros(LOCK_IN, of_gyros, places, signals)
    }

    /// Candidate with one nonlinear parameter, at least 0, for each gyro that has one.
    fn on_gyros(
        &mut self,
        kind: &'static str,
        of_gyros: impl Iterator<Item = Option<AboutValue>>,
        places: f64,
        signals: &Signals,
    ) -> Candidate {
        let (mut terms, mut fixed) = (Vec::new(), Vec::new());
        let (mut names, mut base) = (Vec::new(), Vec::new());
        for (gyro, one) in of_gyros.enumerate() {
            let Some(one) = one else { continue };
            let sensed = 1.0 / (1.0 - signals.scale_error[gyro]);
            fixed.push(Fixed {
                record: gyro,
                column: self.place(Sensed::independent(one.whole)),
                size: sensed,
            });
            terms.push(Term {
                parameter: names.len(),
                record: gyro,
                column: self.tried(one.slope, gyro, signals),
                coefficient: sensed,
            });
            names.push(one.name);
            base.push(one.value);
        }
        let possible = |_: &str| Bound {
            std: f64::INFINITY,
            range: [0.0, f64::INFINITY],
        };
        about_values(kind, (names, base), (terms, fixed), possible, places)
    }

    /// Linearises pickoff delays about known and found delays: the parameters are the total delays beyond `known_s`.
    ///
    /// # Inputs
    /// `candidate`: of this pool, linearised about zero delay; `known_s`: delays in the model; `found_s`: delays found
    /// beyond them.
    pub fn about_late_pickoff(
        &mut self,
        candidate: &mut Candidate,
        (known_s, found_s): ([f64; 3], [f64; 3]),
    ) {
        let hypothesis = &mut candidate.hypothesis;
        for term in &mut hypothesis.terms {
            let gyro = term.record;
            let about_s = known_s[gyro] + found_s[gyro];
            let of = self.columns[term.column].of;
            let column = Column::DitherDelay(gyro, about_s);
            term.column = self.place(Sensed { column, of });
            if found_s[gyro] != 0.0 {
                let column = Column::DitherBeyond(gyro, known_s[gyro], found_s[gyro]);
                hypothesis.fixed.push(Fixed {
                    record: gyro,
                    column: self.place(Sensed { column, of }),
                    size: term.coefficient,
                });
            }
        }
    }

    /// Relinearises a candidate at `estimate` over these signals; `None` for a row of the catalogue.
    ///
    /// # Inputs
    /// `estimate`: its parameters relative to [`Candidate::base`].
    pub fn again(
        &mut self,
        candidate: &Candidate,
        estimate: &[f64],
        signals: &Signals,
    ) -> Option<Candidate> {
        let places = candidate.hypothesis.price.exp();
        match candidate.variant {
            Variant::Event { axis, row } => {
                Some(self.event(candidate.kind, axis, row, places, signals))
            }
            Variant::Harmonic { axis, order } => Some(self.harmonic(axis, order, places, signals)),
            Variant::Expression { axis, expression } => {
                Some(self.expression(axis, expression, places, signals))
            }
            Variant::LowPass => {
                let low_passes = candidate.low_passes(estimate);
                (low_passes != [None; 3]).then(|| self.low_pass(low_passes, places, signals))
            }
            _ if candidate.kind == MODE => {
                let k_s2 = std::array::from_fn(|place| estimate[place]);
                let resonance = candidate.moved(6, estimate);
                Some(self.suspension(resonance, k_s2, places, signals))
            }
            _ if candidate.kind == MOUNT => {
                Some(self.mount(candidate.mounts(estimate), places, signals))
            }
            _ if candidate.kind == HIGH_PASS => {
                let high_passes = candidate
                    .values(estimate)
                    .map(|value| value.map(|time_s| HighPass { time_s }));
                Some(self.high_pass(high_passes, places, signals))
            }
            _ if candidate.kind == LOCK_IN => {
                Some(self.lock_in(candidate.thresholds(estimate), places, signals))
            }
            _ => None,
        }
    }

    /// Copies a candidate of another pool into this one, with its columns.
    pub fn adopt(&mut self, candidate: &Candidate, columns: &[Sensed]) -> Candidate {
        let mut adopted = candidate.clone();
        adopted.hypothesis.requires = None;
        for term in &mut adopted.hypothesis.terms {
            term.column = self.place(columns[term.column]);
        }
        for fixed in &mut adopted.hypothesis.fixed {
            fixed.column = self.place(columns[fixed.column]);
        }
        adopted
    }
}

impl Candidate {
    /// Resonance with frequency and damping in parameters `first` and the next, moved by an estimate within the trust
    /// region.
    fn moved(&self, first: usize, estimate: &[f64]) -> Resonance {
        const DAMPINGS: [f64; 2] = [1e-3, CRITICAL];
        let damping = self.base[first + 1];
        Resonance {
            hz: moved(self.base[first], estimate[first]),
            damping: (damping + estimate[first + 1])
                .clamp(0.4 * damping, 2.5 * damping)
                .clamp(DAMPINGS[0], DAMPINGS[1]),
        }
    }

    /// Thresholds of the gyros of a lock-in candidate, moved by an estimate within the trust region.
    pub fn thresholds(&self, estimate: &[f64]) -> [Option<Threshold>; 3] {
        self.values(estimate)
            .map(|value| value.map(|rad_s| Threshold { rad_s }))
    }

    /// The numbers of the gyros that have one, moved by an estimate as far as it is to be trusted.
    fn values(&self, estimate: &[f64]) -> [Option<f64>; 3] {
        std::array::from_fn(|gyro| {
            let place = self.names.iter().position(|name| name == AXES[gyro])?;
            Some(moved(self.base[place], estimate[place]))
        })
    }

    /// Low passes of the gyros of a low-pass candidate, moved by an estimate within the trust region; `None` for a time
    /// constant of 0.
    pub fn low_passes(&self, estimate: &[f64]) -> [Option<LowPass>; 3] {
        std::array::from_fn(|gyro| {
            let name = format!("{}_pole_s", AXES[gyro]);
            let place = self.names.iter().position(|other| *other == name)?;
            if self.base[place] + estimate[place] == 0.0 {
                return None;
            }
            let time_s = moved(self.base[place], estimate[place]);
            Some(LowPass { time_s })
        })
    }

    /// Mounts about the axes of a mount candidate, moved by an estimate within the trust region.
    pub fn mounts(&self, estimate: &[f64]) -> [Option<Resonance>; 3] {
        std::array::from_fn(|axis| {
            let name = format!("{}_frequency_hz", AXES[axis]);
            let first = self.names.iter().position(|other| *other == name)?;
            Some(self.moved(first, estimate))
        })
    }
}
