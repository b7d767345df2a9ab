//! Lines of a unit at rest: aliases of undersampled signals, converters' tones, vibration.
//!
//! The line of the smallest false-alarm probability on one gyro or on all is fitted with one frequency and subtracted, and
//! so on until none is below the plan's level. A line must keep its phase through the fitted time, a drift of its frequency
//! aside: a line that wanders more cannot be predicted. A line whose phase then wanders slowly is tracked, and its products
//! with it. Out of scope: the multiple of the row rate at which an alias lies; one rate does not determine it.

use rlg_plan::Plan;
use std::f64::consts::TAU;

use realfft::num_complex::Complex64;
use rlg_inference::line_fit::Shown;
use rlg_inference::periodogram::{Periodogram, Weighed, strongest};
use rlg_inference::phase_course::{Baseband, Course, legendre};
use rlg_inference::transform::Transform;
use rlg_inference::{NoiseBasis, NoiseLevels, Observations};
use rlg_model::Model;
use rlg_signal::streams::{Triad, add, add_triad, each_axis};

use super::line::{Clock, Line, Origin, Phase, phase_rad};
use super::line_words::is_known;
use super::products::{products, shown_hz};
use crate::rows::pulse_resolution::Lattice;

/// Lines of all gyros.
pub(crate) struct Lines {
    pub(crate) lines: Vec<Line>,
    /// Increments of all lines \[rad\].
    pub(crate) rows_rad: Triad,
}

/// Finds lines on the rows that are `seen`.
///
/// # Inputs
/// `left_rad`: residual of the gyros after all other effects; `levels`: its noise without lines.
pub(crate) fn search(
    left_rad: &Triad,
    seen: &[bool],
    levels: &[NoiseLevels],
    rate_hz: f64,
    plan: &Plan,
) -> Option<Lines> {
    let observations = Observations::bridged(seen).ok()?;
    let (transform, basis) = Transform::with_basis(observations, NoiseLevels::mean(levels));
    let clock = Clock {
        rows: seen.len(),
        rate_hz,
    };
    let mut search = Search {
        left_rad: left_rad.clone(),
        lines: Vec::new(),
        weights: each_axis(|gyro| basis.weights(levels[gyro])),
        transform,
        basis,
        seen,
        levels,
        clock,
        plan,
    };
    search.run();
    let mut rows_rad = left_rad.clone();
    add_triad(&mut rows_rad, &search.left_rad, -1.0);
    Some(Lines {
        lines: search.lines,
        rows_rad,
    })
}

impl Lines {
    /// Drops lines within the pulse quantisation of a gyro: counting makes tones.
    pub(crate) fn shown(mut self, lattice: &Lattice, clock: Clock) -> Self {
        if !lattice.is_any() {
            return self;
        }
        for place in 0..self.lines.len() {
            let rows_rad = self.lines[place].rows_rad(&self.lines, clock);
            for (gyro, rows) in rows_rad.iter().enumerate() {
                if !rows.is_empty() && lattice.hides(gyro, rows, 1.0) {
                    add(&mut self.rows_rad[gyro], rows, -1.0);
                    let line = &mut self.lines[place];
                    line.gain -= (line.amplitude_rad[gyro].norm() / line.std_rad[gyro]).powi(2);
                    line.amplitude_rad[gyro] = Complex64::ZERO;
                    line.measured_rad[gyro] = Complex64::ZERO;
                }
            }
        }
        self
    }

    /// Increments of the lines that a model does not hold \[rad\].
    pub(crate) fn news_rad(&self, clock: Clock, model: &Model) -> Triad {
        let mut news_rad = self.rows_rad.clone();
        for line in &self.lines {
            if is_known(line, clock, model) {
                add_triad(&mut news_rad, &line.rows_rad(&self.lines, clock), -1.0);
            }
        }
        news_rad
    }
}

struct Search<'a> {
    /// Residual after the known lines \[rad\].
    left_rad: Triad,
    lines: Vec<Line>,
    transform: Transform,
    basis: NoiseBasis,
    /// 1/S of each coefficient of each gyro.
    weights: [Vec<f64>; 3],
    seen: &'a [bool],
    levels: &'a [NoiseLevels],
    clock: Clock,
    plan: &'a Plan,
}

impl Search<'_> {
    fn run(&mut self) {
        let resolution_hz = self.clock.resolution_hz();
        let plan = self.plan.rest.lines;
        // Half-width of a line whose phase wanders.
        let own_hz = 0.5 * (plan.most_degrees + 1) as f64 * resolution_hz;
        let mut passed_over_hz: Vec<f64> = Vec::new();
        let mut fitted_anew: Vec<bool> = Vec::new();
        while self.lines.len() < plan.most {
            let weighed = self.weighed();
            let each = each_axis(|gyro| {
                Periodogram::new(&weighed[gyro], &self.plan.inference.periodogram)
            });
            let is_free = |share: f64| {
                let hz = share * self.clock.rate_hz;
                passed_over_hz
                    .iter()
                    .all(|known| (known - hz).abs() > plan.own_resolutions * resolution_hz)
            };
            let Some(peak) = strongest(&each, is_free) else {
                break;
            };
            if peak.ln_chance > plan.chance.ln() {
                break;
            }
            drop(each);
            let hz = peak.share * self.clock.rate_hz;
            let near = |line: &Line| (line.shown_hz - hz).abs() < own_hz;
            match self.lines.iter().position(near) {
                Some(place) if !fitted_anew[place] => {
                    self.fit_again(place);
                    fitted_anew[place] = true;
                }
                None if self.enter(hz, peak.ln_chance, &weighed) => fitted_anew.push(false),
                // A peak that is still the strongest after its subtraction is no line.
                _ => passed_over_hz.push(hz),
            }
        }
        self.settle();
    }

    fn weighed(&self) -> [Weighed; 3] {
        each_axis(|gyro| {
            let by = (&self.transform, &self.basis);
            Weighed::new(&self.left_rad[gyro], self.seen, by, self.levels[gyro])
        })
    }

    /// Fits a line at a frequency to some gyros, with a wandering phase if `wanders`.
    fn own(
        &self,
        weighed: &[Weighed; 3],
        gyros: &[usize],
        phase: &Phase,
        wanders: bool,
    ) -> (Course, Phase, Baseband) {
        let records: Vec<&Weighed> = gyros.iter().map(|&gyro| &weighed[gyro]).collect();
        let origin = Origin::Own(Phase {
            course_rad: Vec::new(),
            ..phase.clone()
        });
        let turned = phase_rad(&origin, &self.lines, self.clock);
        let share = phase.hz / self.clock.rate_hz;
        let baseband = Baseband::new(&records, self.seen, share, turned);
        let price = 0.5 * (self.clock.rows as f64).ln();
        let most = if wanders {
            self.plan.rest.lines.most_degrees
        } else {
            2
        };
        let course = baseband.fit_wandering(most, price);
        // P_1 goes from −1 to 1 over the record.
        let per_rad = self.clock.resolution_hz() / (0.5 * TAU);
        let fitted = Phase {
            hz: phase.hz + per_rad * course.polynomial[0],
            hz_std: per_rad * course.covariance[(0, 0)].max(0.0).sqrt(),
            course_rad: course.polynomial[1..].to_vec(),
            wander_hz: wander_hz(&course, self.clock),
        };
        (course, fitted, baseband)
    }

    /// Subtracts a line that keeps its phase or is a product of others; returns true if it does.
    fn enter(&mut self, hz: f64, ln_chance: f64, weighed: &[Weighed; 3]) -> bool {
        let begin = Phase {
            hz,
            hz_std: 0.0,
            course_rad: Vec::new(),
            wander_hz: [0.0; 2],
        };
        let all = [0, 1, 2];
        let (first, near, baseband) = self.own(weighed, &all, &begin, false);
        let plan = self.plan.rest.lines;
        let gyros = shown_on(&first, self.plan);
        if gyros.is_empty() {
            return false;
        }
        let keeps_phase = baseband.coherence(&first, plan.pieces) >= plan.coherence;
        // A product needs the phases of its lines, not one of its own.
        let (course, phase, _) = self.own(weighed, &gyros, &begin, keeps_phase);
        let own = (keeps_phase).then(|| {
            let price = 0.5 * (self.clock.rows as f64).ln();
            let numbers = course.polynomial.len() - 1;
            let places = 1.5 * self.clock.rows as f64;
            0.5 * course.gain() - price * numbers as f64 - places.ln()
        });
        let product = self.product(near.hz, &gyros, weighed);
        let line = match (own, product) {
            (own, Some((line, worth))) if own.is_none_or(|own| worth > own) => {
                Line { ln_chance, ..line }
            }
            (Some(_), _) => {
                let shown_hz = phase.hz;
                self.line(Origin::Own(phase), shown_hz, (&course, &gyros), ln_chance)
            }
            (None, _) => return false,
        };
        if !line.gain.is_finite() || line.gain <= 0.0 {
            return false;
        }
        self.take(&line, -1.0);
        self.lines.push(line);
        true
    }

    /// Best product of known lines about a frequency, and its ln L less the price of the trials.
    fn product(&self, hz: f64, gyros: &[usize], weighed: &[Weighed; 3]) -> Option<(Line, f64)> {
        let all = products(&self.lines, &self.plan.rest.lines);
        let cost = (all.len().max(1) as f64).ln();
        let near = all.into_iter().filter(|orders| {
            let away_hz = shown_hz(orders, &self.lines, self.clock) - hz;
            away_hz.abs() < self.plan.rest.lines.own_resolutions * self.clock.resolution_hz()
        });
        let each = near.map(|orders| {
            let shown = shown_hz(&orders, &self.lines, self.clock);
            let line = self.following(Origin::Product(orders), shown, gyros, weighed);
            let worth = 0.5 * line.gain - cost;
            (line, worth)
        });
        each.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Fits the amplitudes of a known phase.
    fn following(
        &self,
        origin: Origin,
        shown_hz: f64,
        gyros: &[usize],
        weighed: &[Weighed; 3],
    ) -> Line {
        let records: Vec<&Weighed> = gyros.iter().map(|&gyro| &weighed[gyro]).collect();
        let turned = phase_rad(&origin, &self.lines, self.clock);
        let share = shown_hz / self.clock.rate_hz;
        let course = Baseband::new(&records, self.seen, share, turned).fit(0, &[]);
        self.line(origin, shown_hz, (&course, gyros), 0.0)
    }

    fn line(
        &self,
        origin: Origin,
        shown_hz: f64,
        (course, gyros): (&Course, &[usize]),
        ln_chance: f64,
    ) -> Line {
        let mut line = Line {
            origin,
            shown_hz,
            amplitude_rad: [Complex64::ZERO; 3],
            measured_rad: [Complex64::ZERO; 3],
            // On a gyro that is not fitted, the standard deviation by its noise.
            std_rad: each_axis(|gyro| self.std_rad(gyro, shown_hz)),
            gain: 0.0,
            ln_chance,
        };
        for (place, &gyro) in gyros.iter().enumerate() {
            line.measured_rad[gyro] = course.amplitudes[place];
            line.std_rad[gyro] = course.stds[place];
            if is_shown(course.gains[place], self.plan) {
                line.amplitude_rad[gyro] = course.amplitudes[place];
                line.gain += course.gains[place];
            }
        }
        line
    }

    /// Standard deviation of either quadrature of an amplitude \[rad\].
    fn std_rad(&self, gyro: usize, hz: f64) -> f64 {
        let seen = self.seen.iter().filter(|&&seen| seen).count().max(1) as f64;
        let share = hz / self.clock.rate_hz;
        (2.0 * self.levels[gyro].of_share(share) / seen).sqrt()
    }

    fn take(&mut self, line: &Line, size: f64) {
        let rows_rad = line.rows_rad(&self.lines, self.clock);
        add_triad(&mut self.left_rad, &rows_rad, size);
    }

    /// Fits a line of some gyros with its exact columns.
    fn exact(
        &self,
        origin: &Origin,
        degree: usize,
        spectra: &[Vec<f64>; 3],
        gyros: &[usize],
    ) -> Course {
        let of = |gyro: &usize| (spectra[*gyro].clone(), self.weights[*gyro].as_slice());
        let (spectra, weights): (Vec<_>, Vec<_>) = gyros.iter().map(of).unzip();
        let shown = Shown {
            spectra: &spectra,
            weights: &weights,
        };
        let phase_rad = phase_rad(origin, &self.lines, self.clock);
        shown.fit(&self.transform, self.clock.rows, degree, phase_rad)
    }

    /// Phase of a line on the gyros that show it, its course of the same degree as before.
    fn exact_phase(&self, before: &Phase, gyros: &[usize], spectra: &[Vec<f64>; 3]) -> Phase {
        let degree = before.course_rad.len() + 1;
        let mut course = self.exact(&Origin::Own(before.clone()), degree, spectra, gyros);
        let per_rad = self.clock.resolution_hz() / (0.5 * TAU);
        let pairs = course.polynomial[1..].iter_mut().zip(&before.course_rad);
        pairs.for_each(|(change, before)| *change += before);
        Phase {
            hz: before.hz + per_rad * course.polynomial[0],
            hz_std: per_rad * course.covariance[(0, 0)].max(0.0).sqrt(),
            course_rad: course.polynomial[1..].to_vec(),
            wander_hz: wander_hz(&course, self.clock),
        }
    }

    /// Refits a line given all others.
    fn fit_again(&mut self, place: usize) {
        let before = self.lines[place].clone();
        self.take(&before, 1.0);
        let spectra = each_axis(|gyro| self.transform.spectrum(&self.left_rad[gyro]));
        let (origin, hz) = match &before.origin {
            Origin::Own(phase) => {
                // Given all others its course may be simpler than at its detection.
                let gyros: Vec<usize> = (0..3).filter(|&gyro| before.is_on(gyro)).collect();
                let (_, phase, _) = self.own(&self.weighed(), &gyros, phase, true);
                let phase = self.exact_phase(&phase, &gyros, &spectra);
                let hz = phase.hz;
                (Origin::Own(phase), hz)
            }
            Origin::Product(orders) => {
                let hz = shown_hz(orders, &self.lines, self.clock);
                (before.origin.clone(), hz)
            }
        };
        let course = self.exact(&origin, 0, &spectra, &[0, 1, 2]);
        let line = self.line(origin, hz, (&course, &[0, 1, 2]), 0.0);
        // A line that is no longer significant keeps its earlier fit.
        let line = match line.gain > 0.0 {
            true => Line {
                ln_chance: before.ln_chance,
                ..line
            },
            false => before,
        };
        self.take(&line, -1.0);
        // Its products move with it.
        let followers = self.followers(place);
        for &other in &followers {
            self.take(&self.lines[other].clone(), 1.0);
        }
        self.lines[place] = line;
        for &other in &followers {
            if let Origin::Product(orders) = &self.lines[other].origin {
                self.lines[other].shown_hz = shown_hz(orders, &self.lines, self.clock);
            }
            self.take(&self.lines[other].clone(), -1.0);
        }
    }

    /// Fits every line given all others, independent lines first: products follow them.
    fn settle(&mut self) {
        /// Each turn leaves the overlap of lines, a tenth if they are near, of the error before.
        const TURNS: usize = 4;
        for _ in 0..TURNS {
            for of_own in [true, false] {
                for place in 0..self.lines.len() {
                    if matches!(self.lines[place].origin, Origin::Own(_)) == of_own {
                        self.fit_again(place);
                    }
                }
            }
        }
        // A line with too little gain given the others is dropped. Drift is no rival here: a slow line passes for it.
        for place in 0..self.lines.len() {
            let line = self.lines[place].clone();
            let gain = |gyro: usize| {
                let std_rad = self.std_rad(gyro, line.shown_hz);
                line.amplitude_rad[gyro].norm_sqr() / (std_rad * std_rad)
            };
            if 0.5 * (0..3).map(gain).sum::<f64>() < -self.plan.rest.lines.chance.ln() {
                self.take(&line, 1.0);
                self.lines[place].amplitude_rad = [Complex64::ZERO; 3];
            }
        }
    }

    /// Products of a line.
    fn followers(&self, place: usize) -> Vec<usize> {
        let follows = |other: &usize| match &self.lines[*other].origin {
            Origin::Product(orders) => orders.iter().any(|(of, _)| *of == place),
            Origin::Own(_) => false,
        };
        (0..self.lines.len()).filter(follows).collect()
    }
}

/// True if a gyro shows a line of known frequency.
fn is_shown(gain: f64, plan: &Plan) -> bool {
    0.5 * gain > plan.judgement.naming
}

fn shown_on(course: &Course, plan: &Plan) -> Vec<usize> {
    let gains = course.gains.iter().enumerate();
    let shown = gains.filter(|(_, gain)| is_shown(**gain, plan));
    shown.map(|(gyro, _)| gyro).collect()
}

/// Root mean square of the frequency of a course about its mean, and its standard deviation \[Hz\].
fn wander_hz(course: &Course, clock: Clock) -> [f64; 2] {
    /// Number of steps for the slope of the polynomial.
    const STEPS: usize = 400;
    let degree = course.polynomial.len();
    if degree < 2 {
        return [0.0; 2];
    }
    let step = 2.0 / STEPS as f64;
    // Converts a phase over −1 to 1 to a frequency over the record.
    let per_step = clock.resolution_hz() * 2.0 / step / TAU;
    let slope = |coefficients: &[f64], at: usize| {
        let x = -1.0 + step * at as f64;
        (legendre(coefficients, x + step) - legendre(coefficients, x)) * per_step
    };
    let mut beyond = course.polynomial.clone();
    beyond[0] = 0.0;
    let of_course: Vec<f64> = (0..STEPS).map(|at| slope(&beyond, at)).collect();
    let square = of_course.iter().map(|hz| hz * hz).sum::<f64>() / STEPS as f64;
    let rms = square.sqrt();
    let gradient: Vec<f64> = (0..degree)
        .map(|place| {
            let mut unit = vec![0.0; degree];
            unit[place] = f64::from(u8::from(place > 0));
            let each = of_course.iter().enumerate();
            let sum: f64 = each.map(|(at, hz)| hz * slope(&unit, at)).sum();
            sum / STEPS as f64 / rms.max(f64::MIN_POSITIVE)
        })
        .collect();
    let mut variance = 0.0;
    for (a, of_a) in gradient.iter().enumerate() {
        for (b, of_b) in gradient.iter().enumerate() {
            variance += of_a * of_b * course.covariance[(a, b)];
        }
    }
    [rms, variance.max(0.0).sqrt()]
}
