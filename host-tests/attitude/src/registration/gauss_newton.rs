//! Registration: alignment of two instruments before the search for physics.
//!
//! Twenty parameters in groups, by forward selection from none, each linearised about its last value until convergence.

use rlg_plan::{AttitudeOutlierPlan, RegistrationPlan};
use rlg_signal::attitude_samples::SlowSample;
use rlg_signal::axes::{Triad, add_triad};

use crate::likelihood::equations::ParameterColumn;
use crate::likelihood::noise::Levels;
use crate::reference::reference_faults;
use crate::reference::reference_jumps::{self, Jump};
use crate::rows::alignment::{Alignment, COUNT, Free, places};
use crate::rows::fitting::{Fitting, priced};
use crate::rows::increments::Stamps;
use crate::rows::linearised_rows::{About, Gyros};

/// A converged registration.
pub struct Registration {
    /// Linearisation point.
    pub alignment: Alignment,
    /// Levels of the noise terms.
    pub levels: Levels,
    /// Rows about the alignment.
    pub about: About,
    /// Flags of the stamps.
    pub known: Stamps,
    /// Detected jumps of the reference.
    pub jumps: Vec<Jump>,
    /// Profile log likelihood, at the estimates.
    pub log_likelihood: f64,
    /// Pairs of a selected group and a group not distinguishable from it in its place.
    pub rivals: Vec<(&'static str, &'static str)>,
    /// Standard deviation of the delay \[s\].
    delay_std_s: f64,
    /// Smoothing variances given the delay \[s²\], and their standard deviations.
    smoothing_s2: [(f64, f64); 3],
    /// Errors of single stamps in excess of the noise, subtracted from the rows \[rad\].
    pub corrected_rad: Triad,
}

/// Most passes.
const PASSES: usize = 10;

/// Passes with the reduced noise model, so that a bad start is not fitted as correlated noise.
const PLAIN_PASSES: usize = 2;

/// Gyros, attitudes, and the flags of those left out or known to have jumped.
#[derive(Clone, Copy)]
pub(crate) struct Records<'a> {
    pub(crate) gyros: &'a Gyros,
    pub(crate) samples: &'a [SlowSample],
    pub(crate) stamps: &'a Stamps,
}

/// Linearisation point of rows, and the model's alignment, on which the priors are centred.
#[derive(Clone, Copy)]
pub(crate) struct Point<'a> {
    pub(crate) of_model: &'a Alignment,
    pub(crate) alignment: &'a Alignment,
}

/// Parameters and noise of a fit.
pub(crate) struct FitOptions<'a> {
    /// Column indices of the estimated parameters.
    pub(crate) kept: &'a [usize],
    /// True for the reduced noise model.
    pub(crate) is_plain: bool,
    /// Levels of the noise to start at.
    pub(crate) levels: Option<Levels>,
}

/// Forms rows about an alignment, and fits the columns of the `kept` indices to them.
pub(crate) fn fitted(
    Records {
        gyros,
        samples,
        stamps,
    }: Records,
    Point {
        of_model,
        alignment,
    }: Point,
    options: FitOptions,
) -> Option<(About, Fitting)> {
    let about = About::new(gyros, samples, stamps, alignment)?;
    let fitting = Fitting::new(
        &about.increments,
        priced(
            &about,
            options.kept,
            (alignment, of_model),
            &gyros.plan.registration,
        ),
        options.is_plain,
        options.levels,
        &gyros.plan.noise,
    );
    Some((about, fitting))
}

impl Registration {
    /// Builds the registration of rows too few for estimates of their noise and faults.
    pub(crate) fn of_few(
        alignment: Alignment,
        about: About,
        walk_rad_sqrt_s: f64,
        angle_rad: f64,
        known: Stamps,
    ) -> Self {
        Self {
            levels: Levels::of_all(vec![
                walk_rad_sqrt_s.powi(2) * about.increments.period_s,
                angle_rad.powi(2),
            ]),
            alignment,
            known,
            jumps: Vec::new(),
            log_likelihood: 0.0,
            rivals: Vec::new(),
            delay_std_s: f64::INFINITY,
            smoothing_s2: [(0.0, f64::INFINITY); 3],
            corrected_rad: none_corrected(&about),
            about,
        }
    }

    /// Re-estimates the noise given all columns, for tests of further groups: effects not yet selected are no noise.
    pub(crate) fn weighed(self, gyros: &Gyros, model: &Alignment) -> Self {
        let (levels, _) = self.noise_beside(gyros, model, Vec::new());
        Self { levels, ..self }
    }

    /// Estimates the noise given all columns and physical effects, and its profile log likelihood.
    pub(crate) fn noise_beside(
        &self,
        gyros: &Gyros,
        model: &Alignment,
        physics: impl IntoIterator<Item = ParameterColumn>,
    ) -> (Levels, f64) {
        let about = &self.about;
        let all: Vec<usize> = (0..COUNT).collect();
        let columns = priced(
            about,
            &all,
            (&self.alignment, model),
            &gyros.plan.registration,
        )
        .chain(physics);
        let mut rows_rad = about.increments.rows_rad.clone();
        add_triad(&mut rows_rad, &self.corrected_rad, -1.0);
        let (levels, noise) = (Some(self.levels.clone()), &gyros.plan.noise);
        let mut fitting = Fitting::new(&about.increments, columns, false, levels, noise);
        fitting.fit_to(&rows_rad);
        // Alternates the levels of the terms and of the record's pieces.
        for _ in 0..2 {
            fitting.modulate(&about.increments.times_s);
        }
        (fitting.fit.levels, fitting.fit.explained)
    }

    /// True if no time constant of a low pass is significantly negative.
    pub(crate) fn is_possible(&self, plan: &RegistrationPlan) -> bool {
        let mut each = (0..3).map(|axis| (axis, self.smoothing_s2[axis].1));
        self.alignment.low_pass_s.is_none_or(|time_s| {
            each.all(|(axis, std)| time_s[axis] > -plan.low_pass_negative * std)
        })
    }

    /// True if the gyros are late, and not less smooth than the reference.
    pub(crate) fn may_be_low_pass(&self, model: &Alignment, plan: &RegistrationPlan) -> bool {
        let seen = plan.low_pass_seen;
        let mut smoothing = self.smoothing_s2.iter();
        let is_of_reference = smoothing.any(|(variance, std)| -variance > seen * std);
        // A low pass is late, too: a filter that would need an opposite delay is no low pass.
        let is_late = model.delay_s - self.alignment.delay_s > seen * self.delay_std_s;
        self.alignment.low_pass_s.is_none() && is_late && !is_of_reference
    }
}

/// Gauss-Newton passes until the alignment converges. A step that lowers the likelihood is shortened (backtracking line
/// search): the rows are not linear over it.
///
/// # Inputs
/// `has_faults`: detect faults of the reference.
pub(crate) fn settle(
    of: Records,
    of_model: &Alignment,
    start: Alignment,
    free: &Free,
    has_faults: bool,
    progress: &dyn Fn(&str),
) -> Option<Registration> {
    let kept = places_of(free);
    let mut walk = Walk::new(start);
    let mut levels: Option<Levels> = None;
    let mut pass = 0;
    loop {
        progress("aligning the reference");
        let is_plain = pass < PLAIN_PASSES;
        if pass == PLAIN_PASSES {
            levels = None;
        }
        let alignment = walk.alignment.clone();
        let options = FitOptions {
            kept: &kept,
            is_plain,
            levels: levels.take(),
        };
        let point = Point {
            of_model,
            alignment: &alignment,
        };
        let mut rows = FittedRows::new(of, point, options)?;
        let linear_about: Vec<usize> = (0..kept.len())
            .filter(|at| is_moved(kept[*at], &alignment))
            .collect();
        if walk.is_too_far(rows.fitting.here(&linear_about), is_plain) {
            if walk.is_stuck() {
                pass = PASSES - 1;
            }
            levels = Some(rows.fitting.fit.levels);
            continue;
        }
        if has_faults && pass > 0 {
            rows = rows.without_faults(of, point, is_plain)?;
        }
        if pass > 0 {
            rows.shrink_outliers(&of.gyros.plan.outliers);
        }
        let fit = &rows.fitting.fit;
        let steps = Steps::new(&kept, &fit.estimate, &fit.std);
        pass += 1;
        if (pass > PLAIN_PASSES + 1 && steps.largest() < of.gyros.plan.registration.settled)
            || pass == PASSES
        {
            return Some(rows.registration(alignment, &steps));
        }
        walk.step(steps.estimate);
        // Nor are the residuals of a bad start fitted as modulated noise.
        levels = Some(match is_plain {
            true => rows.fitting.fit.levels,
            false => rows.fitting.levels_along(&rows.about.increments.times_s),
        });
    }
}

/// Rows about an alignment with their fit.
struct FittedRows<'a> {
    about: About,
    fitting: Fitting,
    /// Column indices of the fitted parameters.
    kept: &'a [usize],
    /// Flags of the stamps: faults are detected anew in each pass, as far from convergence a gyro error resembles a fault of
    /// the reference.
    known: Stamps,
    /// Errors of single stamps in excess of the noise \[rad\].
    corrected_rad: Triad,
}

impl<'a> FittedRows<'a> {
    fn new(of: Records, point: Point, options: FitOptions<'a>) -> Option<Self> {
        let kept = options.kept;
        let (about, fitting) = fitted(of, point, options)?;
        Some(Self {
            kept,
            corrected_rad: none_corrected(&about),
            about,
            fitting,
            known: of.stamps.clone(),
        })
    }

    /// Residuals of rows after the fitted columns \[rad\].
    fn left_rad(&self, mut rows_rad: Triad) -> Triad {
        for (place, size) in self.kept.iter().zip(&self.fitting.fit.estimate) {
            add_triad(&mut rows_rad, &self.about.column(*place), -size);
        }
        rows_rad
    }

    /// Leaves out stamps with faults of the reference, and fits again after each kind of fault.
    fn without_faults(mut self, of: Records, point: Point, is_plain: bool) -> Option<Self> {
        let searches = [
            reference_faults::spikes,
            reference_faults::rough_stretches,
            reference_jumps::find,
        ];
        let mut left_rad = self.left_rad(self.about.increments.rows_rad.clone());
        for search in searches {
            let fit = (&self.fitting, &left_rad);
            if search(&self.about, fit, &mut self.known, &of.gyros.plan) {
                let options = FitOptions {
                    kept: self.kept,
                    is_plain,
                    levels: Some(self.fitting.fit.levels.clone()),
                };
                let stamps = &self.known;
                // The rows before are freed first.
                drop((self.about, self.fitting));
                (self.about, self.fitting) = fitted(Records { stamps, ..of }, point, options)?;
                left_rad = self.left_rad(self.about.increments.rows_rad.clone());
            }
        }
        self.corrected_rad = none_corrected(&self.about);
        Some(self)
    }

    /// Subtracts errors of single stamps in excess of the noise, and fits again.
    fn shrink_outliers(&mut self, plan: &AttitudeOutlierPlan) {
        for _ in 0..2 {
            let increments = &self.about.increments;
            let mut rows_rad = increments.rows_rad.clone();
            add_triad(&mut rows_rad, &self.corrected_rad, -1.0);
            let mut left_rad = self.left_rad(rows_rad.clone());
            increments.silence_free(&mut left_rad, |_| true);
            let weighted = self.fitting.weighted(&left_rad, increments);
            let errors = weighted.outliers_rad(plan);
            let corrected = self.corrected_rad.iter_mut().zip(&errors);
            for (rows, (corrected, errors)) in rows_rad.iter_mut().zip(corrected) {
                for row in 0..rows.len() {
                    let grown = errors[row + 1] - errors[row];
                    rows[row] -= grown;
                    corrected[row] += grown;
                }
            }
            self.fitting.fit_to(&rows_rad);
        }
    }

    fn registration(self, alignment: Alignment, steps: &Steps) -> Registration {
        let fit = &self.fitting.fit;
        let left_rad = self.left_rad(self.about.increments.rows_rad.clone());
        Registration {
            log_likelihood: fit.explained,
            smoothing_s2: steps.smoothing_s2(),
            delay_std_s: steps.std[places("reference_delay").start],
            rivals: Vec::new(),
            alignment,
            levels: fit.levels.clone(),
            jumps: reference_jumps::sizes(&self.about, (&self.fitting, &left_rad), &self.known),
            about: self.about,
            known: self.known,
            corrected_rad: self.corrected_rad,
        }
    }
}

/// Zero corrections of all rows \[rad\].
fn none_corrected(about: &About) -> Triad {
    std::array::from_fn(|_| vec![0.0; about.increments.rows()])
}

/// Column indices of groups, in ascending order.
pub(crate) fn places_of(free: &Free) -> Vec<usize> {
    let mut kept: Vec<usize> = free.iter().flat_map(|kind| places(kind)).collect();
    kept.sort_unstable();
    kept
}

/// True if a parameter has a value in the alignment; smoothing variance and Earth rate have theirs in their columns alone.
fn is_moved(place: usize, alignment: &Alignment) -> bool {
    let is_of = |kind: &str| places(kind).contains(&place);
    let is_smoothing = is_of("gyro_bandwidth") && alignment.low_pass_s.is_none();
    !is_smoothing && !is_of("earth_rate")
}

/// Gauss-Newton iterates of an alignment, with backtracking.
struct Walk {
    alignment: Alignment,
    /// Start of the last step, and its estimates.
    last: Option<(Alignment, [f64; COUNT])>,
    /// Share of the last step that was made.
    share: f64,
    /// Log likelihood per coefficient at the start of the last step, and true if its noise model was the reduced one.
    before: Option<(f64, bool)>,
}

impl Walk {
    fn new(alignment: Alignment) -> Self {
        Self {
            alignment,
            last: None,
            share: 1.0,
            before: None,
        }
    }

    /// Shortens the last step if it lowered the likelihood; true if it did.
    fn is_too_far(&mut self, (here, count): (f64, f64), is_plain: bool) -> bool {
        /// Tolerated loss in log likelihood, by stamps at the ends of the record.
        const NEARLY: f64 = 5.0;
        /// Factor of a shortened step.
        const SHORTER: f64 = 0.4;
        let is_less = |before: f64| here < before - NEARLY / count;
        let is_alike = self.before.filter(|(_, plain)| *plain == is_plain);
        let is_less = is_alike.is_some_and(|(before, _)| is_less(before));
        if let (true, false, Some((from, by))) = (is_less, self.is_stuck(), &self.last) {
            self.share *= SHORTER;
            self.alignment = from.moved(&by.map(|by| self.share * by));
            return true;
        }
        self.before = Some((here, is_plain));
        false
    }

    /// True if no part of the last step increases the likelihood.
    fn is_stuck(&self) -> bool {
        const LEAST: f64 = 0.03;
        self.share < LEAST
    }

    fn step(&mut self, by: [f64; COUNT]) {
        let moved = self.alignment.moved(&by);
        self.last = Some((std::mem::replace(&mut self.alignment, moved), by));
        self.share = 1.0;
    }
}

/// Steps of all parameters, 0 for the fixed ones.
pub(crate) struct Steps {
    /// Step by column index.
    pub(crate) estimate: [f64; COUNT],
    std: [f64; COUNT],
}

impl Steps {
    /// # Inputs
    /// `kept`: indices of the estimated parameters, with their estimates and standard deviations.
    pub(crate) fn new(kept: &[usize], estimate: &[f64], std: &[f64]) -> Self {
        let mut steps = Self {
            estimate: [0.0; COUNT],
            std: [f64::INFINITY; COUNT],
        };
        for (place, (estimate, std)) in kept.iter().zip(estimate.iter().zip(std)) {
            steps.estimate[*place] = *estimate;
            steps.std[*place] = *std;
        }
        steps
    }

    /// Largest step of the parameters of the linearisation point \[σ\].
    pub(crate) fn largest(&self) -> f64 {
        let is_linear = |k: &usize| {
            let kinds = ["reference_clock_rate", "earth_rate", "gyro_bandwidth"];
            kinds.iter().any(|kind| places(kind).contains(k))
        };
        let moved = (0..COUNT).filter(|k| !is_linear(k));
        moved
            .map(|k| self.estimate[k].abs() / self.std[k])
            .fold(0.0, f64::max)
    }

    /// True if the alignment reached is within some standard deviations of another.
    pub(crate) fn lead_to(&self, led: &Alignment, place: &Alignment, within: f64) -> bool {
        let away = led.beyond(place);
        let mut each = away.iter().zip(&self.std);
        each.all(|(away, std)| away.abs() <= within * std)
    }

    fn smoothing_s2(&self) -> [(f64, f64); 3] {
        let first = places("gyro_bandwidth").start;
        std::array::from_fn(|axis| (self.estimate[first + axis], self.std[first + axis]))
    }
}
