//! Whether gyros, pickoffs and reference mean the same axes, the same way round and the same unit (diagnosis road, step 1).
//!
//! Enters: the motion, and the residual under the model. Leaves: [`Crossing`]s, where a gyro follows the reference or the
//! pickoffs otherwise than any credible effect could make it: reversed, exchanged, or by another factor. A channel with the
//! wrong sign leaves twice the motion, which a search would explain by dozens of expressions.
//!
//! Deliberately not here: what noise or a delay could do. A reference that is noise halves a coefficient, so the rows must
//! follow what they are said to follow; at one frequency half a period's delay is a sign, so no credible delay may
//! explain it.

use nalgebra::{DMatrix, DVector};
use std::fmt;
use std::path::Path;

use super::hypotheses::find;
use super::information::scaled_inverse;
use super::scene::Scene;
use super::streams::{AXES, Triad};
use rlg_recording::error::InputError;

/// Twice the largest credible error of a gain, scale or crosstalk.
const GROSS: f64 = 0.4;

/// A coefficient not known to this says nothing.
const KNOWN: f64 = 0.05;

/// What the rows follow has this many times the power of what is left: noise in it would bring the coefficient to no less
/// than 0.8.
const FOLLOWED: f64 = 4.0;

/// Rows in a fit; so many, spread evenly, say enough of coefficients of the order of one.
const MOST_ROWS: usize = 20_000;

/// A delay explains it where it leaves no more than this many times as much.
const AS_WELL: f64 = 4.0;

/// What a gyro may follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lead {
    /// The reference.
    Reference,
    /// The pickoffs.
    Pickoff,
}

/// A gyro that follows something otherwise than it could.
#[derive(Debug, Clone, PartialEq)]
pub struct Crossing {
    /// Which gyro.
    pub gyro: usize,
    /// What it follows.
    pub lead: Lead,
    /// How much of each axis \[1\]; the model expects 1 of its own.
    pub shares: [f64; 3],
}

/// Sizes of what a gyro follows: reference x y z, pickoff x y z.
struct Fit {
    shares: [f64; 6],
    std: [f64; 6],
    /// Power of what follows the reference and of what follows the pickoffs.
    followed: [f64; 2],
    left: f64,
}

impl Fit {
    fn of(&self, lead: Lead) -> [f64; 3] {
        let first = 3 * lead as usize;
        [0, 1, 2].map(|axis| self.shares[first + axis])
    }

    /// Whether a gyro follows otherwise than any effect could make it.
    fn is_crossed(&self, lead: Lead, gyro: usize) -> bool {
        let first = 3 * lead as usize;
        let is_gross = |axis: usize| {
            let expected = f64::from(u8::from(axis == gyro));
            self.std[first + axis] < KNOWN && (self.shares[first + axis] - expected).abs() > GROSS
        };
        self.followed[lead as usize] > FOLLOWED * self.left && (0..3).any(is_gross)
    }
}

/// The crossings of a bench, in the order of the gyros.
pub fn crossings(scene: &Scene, residual_rad: &Triad) -> Vec<Crossing> {
    let streams = &scene.streams;
    let has_reference = streams.at_rest.is_none() && !streams.own_motion;
    let usable: Vec<usize> = (0..streams.rows)
        .filter(|&row| streams.usable[row])
        .collect();
    let stride = usable.len().div_ceil(MOST_ROWS).max(1);
    let rows: Vec<usize> = usable.into_iter().step_by(stride).collect();
    let pickoff: Option<Triad> = streams
        .pickoff_rad
        .is_some()
        .then(|| [0, 1, 2].map(|axis| scene.dither_increment_rad(axis).unwrap_or_default()));
    let most_lag = |kind: &str| {
        let largest_s = find(kind).map_or(0.0, |(_, entry)| entry.card().largest);
        (largest_s * streams.rate_hz).ceil() as isize
    };
    let mut found = Vec::new();
    for (gyro, own_rad) in residual_rad.iter().enumerate() {
        let bench = Bench {
            case: has_reference.then_some(&streams.case_rad),
            pickoff: pickoff.as_ref(),
            residual_rad: own_rad,
            gyro,
            rows: &rows,
        };
        let Some(fit) = bench.fit([0, 0]) else {
            continue;
        };
        for lead in [Lead::Reference, Lead::Pickoff] {
            let late = |lag: isize| match lead {
                Lead::Reference => [lag, 0],
                Lead::Pickoff => [0, lag],
            };
            let most = most_lag(match lead {
                Lead::Reference => "reference_delay",
                Lead::Pickoff => "dither_delay",
            });
            let is_delay = |lag: isize| {
                bench.fit(late(lag)).is_some_and(|late| {
                    late.left < AS_WELL * fit.left && !late.is_crossed(lead, gyro)
                })
            };
            if fit.is_crossed(lead, gyro) && !(-most..=most).any(is_delay) {
                let shares = fit.of(lead);
                found.push(Crossing { gyro, lead, shares });
            }
        }
    }
    found
}

/// One gyro's rows beside what they may follow.
struct Bench<'a> {
    case: Option<&'a Triad>,
    pickoff: Option<&'a Triad>,
    residual_rad: &'a [f64],
    gyro: usize,
    rows: &'a [usize],
}

impl Bench<'_> {
    /// What the gyro follows, reference and pickoffs taken so many rows later; none where nothing moves.
    fn fit(&self, late: [isize; 2]) -> Option<Fit> {
        const CONSTANT: usize = 6;
        const SENSED: usize = 7;
        let leads = [self.case, self.pickoff];
        let mut sums = DMatrix::<f64>::zeros(8, 8);
        let mut count = 0.0;
        for &row in self.rows {
            let mut values = [0.0; 8];
            values[CONSTANT] = 1.0;
            // What the model took off for the gyro's own axis goes back: noise in a channel then shrinks its share.
            values[SENSED] = self.residual_rad[row];
            let mut is_known = true;
            for (which, lead) in leads.iter().enumerate() {
                let Some(lead) = lead else { continue };
                values[SENSED] += lead[self.gyro][row];
                let Some(at) = row.checked_add_signed(late[which]) else {
                    is_known = false;
                    continue;
                };
                for (axis, channel) in lead.iter().enumerate() {
                    match channel.get(at) {
                        Some(&value) => values[3 * which + axis] = value,
                        None => is_known = false,
                    }
                }
            }
            if !is_known || !values.iter().all(|value| value.is_finite()) {
                continue;
            }
            count += 1.0;
            for a in 0..8 {
                for b in 0..=a {
                    sums[(a, b)] += values[a] * values[b];
                }
            }
        }
        if count < 100.0 {
            return None;
        }
        sums.fill_upper_triangle_with_lower_triangle();
        let gram = sums.view((0, 0), (SENSED, SENSED)).into_owned();
        let against = DVector::from_fn(SENSED, |a, _| sums[(SENSED, a)]);
        let inverse = scaled_inverse(&gram);
        let sizes = &inverse * &against;
        let left = (sums[(SENSED, SENSED)] - sizes.dot(&against)).max(0.0);
        let variance = left / (count - SENSED as f64);
        let power = |first: usize| {
            let of = |a: usize, b: usize| {
                // About the mean: what stands still leads nowhere.
                let mean = sums[(CONSTANT, a)] * sums[(CONSTANT, b)] / count;
                sizes[a] * sizes[b] * (sums[(a, b)] - mean)
            };
            let range = first..first + 3;
            let pairs = range
                .clone()
                .flat_map(|a| range.clone().map(move |b| (a, b)));
            pairs.map(|(a, b)| of(a, b)).sum::<f64>()
        };
        Some(Fit {
            shares: [0, 1, 2, 3, 4, 5].map(|place| sizes[place]),
            std: [0, 1, 2, 3, 4, 5].map(|place| match gram[(place, place)] > 0.0 {
                true => (variance * inverse[(place, place)]).sqrt(),
                false => f64::INFINITY,
            }),
            followed: [power(0), power(3)],
            left,
        })
    }
}

impl fmt::Display for Crossing {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let lead = match self.lead {
            Lead::Reference => "the reference turns",
            Lead::Pickoff => "the pickoffs swing",
        };
        let parts: Vec<String> = (0..3)
            .filter(|&axis| self.shares[axis].abs() > 0.1)
            .map(|axis| {
                format!(
                    "{:.3} times what {lead} about {}",
                    self.shares[axis], AXES[axis]
                )
            })
            .collect();
        match parts.is_empty() {
            true => write!(f, "nothing of what {lead}"),
            false => f.write_str(&parts.join(" and ")),
        }
    }
}

/// Refuses a recording whose channels do not mean what the model means by them.
pub fn check(
    scene: &Scene,
    residual_rad: &Triad,
    recording: &str,
    model_file: &Path,
) -> Result<(), InputError> {
    let crossings = crossings(scene, residual_rad);
    if crossings.is_empty() {
        return Ok(());
    }
    let each: Vec<String> = crossings
        .iter()
        .map(|one| format!("gyro {} reads {one}", AXES[one.gyro]))
        .collect();
    let problem = format!(
        "does not say the same axes as recording {recording}: {}; most likely {}",
        each.join(", "),
        advice(&crossings)
    );
    Err(InputError::new(model_file, problem)
        .expected("each gyro to read once what reference and pickoff say of its own axis"))
}

/// What is most likely the matter with the channels, for people.
fn advice(crossings: &[Crossing]) -> String {
    let follows = |gyro: usize, lead: Lead| {
        let mut of = crossings.iter();
        of.find(|one| one.gyro == gyro && one.lead == lead)
    };
    let gyros: Vec<usize> = (0..3)
        .filter(|&gyro| crossings.iter().any(|one| one.gyro == gyro))
        .collect();
    let both = |gyro: &usize| {
        follows(*gyro, Lead::Reference).is_some() && follows(*gyro, Lead::Pickoff).is_some()
    };
    let whose = match () {
        () if gyros.iter().all(both) => "the gyro's own channel",
        () if crossings.iter().all(|one| one.lead == Lead::Pickoff) => "the pickoff's channel",
        () => "either the reference's channel, or the gyro's with its pickoff",
    };
    let first = &crossings[0].shares;
    let own = first[crossings[0].gyro];
    let what = match () {
        () if own < -0.5 => "has the wrong sign",
        () if own.abs() < 0.5 => "is exchanged with another axis",
        () => "has the wrong scale (or the model another pulse weight)",
    };
    format!("{whose} {what}")
}
