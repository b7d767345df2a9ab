//! Registration: what aligns two instruments before any physics is thought of.
//!
//! Twenty numbers in groups that join from nothing, each beside those that stand, linear about the last values until those
//! stand still (inference.md, B4).

use rlg_signal::attitude_samples::SlowSample;
use rlg_signal::axes::{Triad, add_triad};

use crate::about::{About, Gyros};
use crate::alignment::{Alignment, COUNT, Free, places};
use crate::equations::ParameterColumn;
use crate::fitting::{Fitting, priced};
use crate::increments::Stamps;
use crate::noise::Levels;
use crate::reference_faults;
use crate::reference_jumps::{self, Jump};

/// A registration that stands.
pub struct Registration {
    /// About what.
    pub alignment: Alignment,
    /// Levels of the noise terms.
    pub levels: Levels,
    /// Rows about it.
    pub about: About,
    /// What is known of the stamps.
    pub known: Stamps,
    /// Jumps of the reference that were found.
    pub jumps: Vec<Jump>,
    /// Log likelihood at its estimates.
    pub log_likelihood: f64,
    /// Groups that stand, each with one that explains as much in its place.
    pub rivals: Vec<(&'static str, &'static str)>,
    /// Standard deviation of the delay \[s\].
    delay_std_s: f64,
    /// Smoothing variances beside it \[s²\], and their standard deviations.
    smoothing_s2: [(f64, f64); 3],
    /// What outliers of single stamps were taken to be, in excess of what noise makes of them: subtracted from the rows.
    pub corrected_rad: Triad,
}

/// Most passes.
const PASSES: usize = 10;

/// Passes with plain noise: a bad start is not called wandering.
const PLAIN_PASSES: usize = 2;

/// A step of this many standard deviations is none.
const SETTLED: f64 = 0.1;

/// Gyros, attitudes, and which of those are left out or are known to have jumped.
pub(crate) type Records<'a> = (&'a Gyros, &'a [SlowSample], &'a Stamps);

/// Rows about an alignment, and the columns of some places fitted to them.
pub(crate) fn fitted(
    (gyros, samples, stamps): Records,
    (model, alignment): (&Alignment, &Alignment),
    (kept, is_plain, levels): (&[usize], bool, Option<Levels>),
) -> Option<(About, Fitting)> {
    let about = About::new(gyros, samples, stamps, alignment)?;
    let all = priced(about.columns(gyros.rate_hz), alignment, model);
    let own = all.into_iter().enumerate();
    let own = own.filter(|(place, _)| kept.contains(place));
    let columns = own.map(|(_, column)| column).collect();
    let fitting = Fitting::new(&about.increments, columns, is_plain, levels);
    Some((about, fitting))
}

impl Registration {
    /// Of rows that are too few for passes over their noise and faults.
    pub(crate) fn of_few(
        alignment: Alignment,
        about: About,
        (walk_rad_sqrt_s, angle_rad): (f64, f64),
        known: Stamps,
    ) -> Self {
        let rows = about.increments.rows();
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
            corrected_rad: std::array::from_fn(|_| vec![0.0; rows]),
            about,
        }
    }

    /// The same with the noise beside all columns, to weigh what may join: what is not called for yet is no noise.
    pub(crate) fn weighed(self, gyros: &Gyros, model: &Alignment) -> Self {
        self.weighed_beside(gyros, model, Vec::new())
    }

    /// The same beside effects of physics, too.
    pub(crate) fn weighed_beside(
        self,
        gyros: &Gyros,
        model: &Alignment,
        physics: Vec<ParameterColumn>,
    ) -> Self {
        let about = &self.about;
        let mut columns = priced(about.columns(gyros.rate_hz), &self.alignment, model);
        columns.extend(physics);
        let mut rows_rad = about.increments.rows_rad.clone();
        add_triad(&mut rows_rad, &self.corrected_rad, -1.0);
        let mut fitting = Fitting::new(&about.increments, columns, false, Some(self.levels));
        fitting.fit_to(&rows_rad);
        // Levels of the terms and of the record's pieces in turn.
        for _ in 0..2 {
            fitting.modulate(&about.increments.times_s);
        }
        Self {
            levels: fitting.fit.levels,
            ..self
        }
    }

    /// Whether the gyros are late, and not less smooth than the reference.
    pub(crate) fn may_be_low_pass(&self, model: &Alignment) -> bool {
        /// Standard deviations of what is worth a second look.
        const SEEN: f64 = 5.0;
        let mut smoothing = self.smoothing_s2.iter();
        let is_of_reference = smoothing.any(|(variance, std)| -variance > SEEN * std);
        // A low pass is late, too: one that would need a delay against it is none.
        let is_late = model.delay_s - self.alignment.delay_s > SEEN * self.delay_std_s;
        self.alignment.low_pass_s.is_none() && is_late && !is_of_reference
    }
}

/// Passes until the alignment no longer changes. A step that leads to less likelihood is shortened: there the rows are not
/// linear.
///
/// # Inputs
/// `has_faults`: whether faults of the reference are looked for.
pub(crate) fn settle(
    (gyros, samples, stamps): Records,
    (model, start, free): (&Alignment, Alignment, &Free),
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
        let fitted = |known: &Stamps, levels: Option<Levels>| {
            let how = (&kept[..], is_plain, levels);
            fitted((gyros, samples, known), (model, &alignment), how)
        };
        // What the last pass left out is looked at anew: far off, an error of the gyros looks like one of the reference.
        let mut known = stamps.clone();
        let (mut about, mut fitting) = fitted(&known, levels.take())?;
        let linear_about: Vec<usize> = (0..kept.len())
            .filter(|at| is_moved(kept[*at], &alignment))
            .collect();
        if walk.is_too_far(fitting.here(&linear_about), is_plain) {
            if walk.is_stuck() {
                pass = PASSES - 1;
            }
            levels = Some(fitting.fit.levels);
            continue;
        }
        let searches = [
            reference_faults::spikes,
            reference_faults::rough_stretches,
            reference_jumps::find,
        ];
        for search in searches.iter().filter(|_| has_faults && pass > 0) {
            if search(&about, &fitting, &mut known) {
                let levels = fitting.fit.levels.clone();
                (about, fitting) = fitted(&known, Some(levels))?;
            }
        }
        let mut corrected_rad: Triad = std::array::from_fn(|_| vec![0.0; about.increments.rows()]);
        if pass > 0 {
            for _ in 0..2 {
                fitting.shrink_outliers(&about.increments, &mut corrected_rad);
            }
        }
        let steps = Steps::new(&kept, &fitting.fit.estimate, &fitting.fit.std);
        pass += 1;
        if (pass > PLAIN_PASSES + 1 && steps.largest() < SETTLED) || pass == PASSES {
            return Some(Registration {
                log_likelihood: fitting.fit.explained,
                smoothing_s2: steps.smoothing_s2(),
                delay_std_s: steps.std[places("reference_delay").start],
                rivals: Vec::new(),
                alignment,
                levels: fitting.fit.levels.clone(),
                jumps: reference_jumps::sizes(&about, &fitting, &known),
                about,
                known,
                corrected_rad,
            });
        }
        walk.step(steps.estimate);
        // What a bad start leaves is no noise that comes and goes, either.
        levels = Some(match is_plain {
            true => fitting.fit.levels,
            false => fitting.levels_along(&about.increments.times_s),
        });
    }
}

/// Places of groups, in the order of the columns.
pub(crate) fn places_of(free: &Free) -> Vec<usize> {
    let mut kept: Vec<usize> = free.iter().flat_map(|kind| places(kind)).collect();
    kept.sort_unstable();
    kept
}

/// Whether rows are linear about a number; what is smoothed or turns with the clock has its value in its column alone.
fn is_moved(place: usize, alignment: &Alignment) -> bool {
    let is_of = |kind: &str| places(kind).contains(&place);
    let is_smoothing = is_of("gyro_bandwidth") && alignment.low_pass_s.is_none();
    !is_smoothing && !is_of("earth_rate")
}

/// Steps of an alignment, shortened where they lead too far.
struct Walk {
    alignment: Alignment,
    /// Where the last step began, and its estimates.
    last: Option<(Alignment, [f64; COUNT])>,
    /// Share of that step that was made.
    share: f64,
    /// Log likelihood of a coefficient where the last step began, and whether noise was plain.
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

    /// Shortens the last step where the likelihood is less than where it began; whether it was.
    fn is_too_far(&mut self, (here, count): (f64, f64), is_plain: bool) -> bool {
        /// Log likelihood that stamps at the ends of the record may cost.
        const NEARLY: f64 = 5.0;
        /// A step is shortened to this share.
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

    /// Whether no part of the last step gains.
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

/// Estimates of all numbers, those that stay at 0.
pub(crate) struct Steps {
    /// By place.
    pub(crate) estimate: [f64; COUNT],
    std: [f64; COUNT],
}

impl Steps {
    /// # Inputs
    /// `kept`: places that are moved, with their estimates and standard deviations.
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

    /// The largest step of what the rows are linear about \[σ\].
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

    /// Whether what they lead to is within three standard deviations of a place.
    pub(crate) fn lead_to(&self, led: &Alignment, place: &Alignment) -> bool {
        let away = led.beyond(place);
        let mut each = away.iter().zip(&self.std);
        each.all(|(away, std)| away.abs() <= 3.0 * std)
    }

    fn smoothing_s2(&self) -> [(f64, f64); 3] {
        let first = places("gyro_bandwidth").start;
        std::array::from_fn(|axis| (self.estimate[first + axis], self.std[first + axis]))
    }
}
