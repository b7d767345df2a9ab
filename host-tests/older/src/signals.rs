//! Measured channels by name, as factors of an expression.
//!
//! Enters: the scene. Leaves: one value a row. The names are those that `diagnosis.json` prints, so that an
//! expression found in one recording can be evaluated in another: `omega_x` \[rad/s\],
//! `alpha_x` \[rad/s²\], `force_x` \[m/s²\] (`abs_` before any of them its size), `temperature_x` \[K since the start\], `temperature_rate_x` \[K/s\],
//! `field_x` \[T\], `dither_rate_x` \[rad/s\], `dither_angle_x` \[rad\], `time` \[s since the start\],
//! `window(a,b)` (1 between a and b s), `recording(NAME)` (1 in that recording of several), `sine(f)` and `cosine(f)` (f in Hz, from the start), `decay(s)` (exp(−t/s)),
//! `lag(PRODUCT,s)` (the product behind a first-order lag of s seconds, settled at the start), `integral(PRODUCT)` (its
//! integral over time from the start), `sign(CHANNEL)` (the side of nothing it was last clearly on) and `rising(CHANNEL)`
//! (1 since it last turned upwards, −1 since it last turned down) for friction, play and relays, every channel of unknown
//! quantity under its own name, and `deviation(NAME)` (the same less its mean: a supply of 28 V acts by its ripple, and
//! its 28 V are in the bias already).

use std::borrow::Cow;

use super::pieces::{Piece, name_in_expression};
use super::scene::Scene;
use super::streams::{AXES, Streams, Triad};

/// A factor: how it is written and what it is worth in each row.
pub struct Signal<'a> {
    /// Its name.
    pub name: String,
    /// Its values.
    pub values: Cow<'a, [f64]>,
}

/// The value of a product such as `omega_x*force_z`, one a row.
pub fn evaluate(scene: &Scene, expression: &str) -> Result<Vec<f64>, String> {
    let mut product = vec![1.0; scene.streams.rows];
    for factor in factors(expression) {
        let values = signal(scene, factor).ok_or_else(|| {
            format!("the factor `{factor}` of `{expression}` is not a channel of this recording")
        })?;
        product
            .iter_mut()
            .zip(values)
            .for_each(|(product, value)| *product *= value);
    }
    Ok(product)
}

/// The factors of a product; what stands in brackets belongs together.
pub(super) fn factors(expression: &str) -> impl Iterator<Item = &str> {
    let mut depth = 0;
    let between = move |letter: char| {
        depth += i32::from(letter == '(') - i32::from(letter == ')');
        letter == '*' && depth == 0
    };
    let each = expression.split(between).map(str::trim);
    each.filter(|factor| !factor.is_empty())
}

/// Lags that are tried \[s\]: from a filter to a thermal mass. The one found is refined (products.rs).
pub const LAGS_S: [f64; 4] = [0.1, 0.4, 1.6, 6.4];

/// What stands in the brackets of a function of this name.
pub(super) fn argument<'a>(name: &'a str, function: &str) -> Option<&'a str> {
    let rest = name.strip_prefix(function)?.strip_prefix('(')?;
    rest.strip_suffix(')')
}

/// The product and the time constant \[s\] of `lag(PRODUCT,s)`.
pub fn as_lag(name: &str) -> Option<(&str, f64)> {
    let inside = argument(name, "lag")?;
    let (channel, constant) = inside.rsplit_once(',')?;
    let constant_s: f64 = constant.trim().parse().ok()?;
    (constant_s > 0.0 && constant_s.is_finite()).then_some((channel.trim(), constant_s))
}

/// A channel behind a first-order lag, settled at the start of each recording.
pub fn lagged(streams: &Streams, values: &[f64], constant_s: f64) -> Vec<f64> {
    let keep = (-1.0 / (streams.rate_hz * constant_s)).exp();
    let mut behind = Vec::with_capacity(values.len());
    for piece in &streams.pieces {
        let own = &values[piece.rows.clone()];
        let Some(&first) = own.first() else { continue };
        let (mut now, mut before) = (first, first);
        for &value in own {
            now = keep * now + (1.0 - keep) * 0.5 * (value + before);
            before = value;
            behind.push(now);
        }
    }
    behind
}

/// What a channel must move by to be clearly elsewhere, of its root mean square about its mean: noise of a channel that
/// moves stays below.
const CLEARLY: f64 = 0.1;

fn clearly(values: &[f64]) -> f64 {
    CLEARLY * rms_about_mean(values)
}

fn rms_about_mean(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (square / count).sqrt()
}

/// The sign that a channel had when it was last clearly off nothing; before that, the first it will have.
fn sign(streams: &Streams, values: &[f64]) -> Vec<f64> {
    let least = clearly(values);
    let mut signs = Vec::with_capacity(values.len());
    for piece in &streams.pieces {
        let own = &values[piece.rows.clone()];
        let first = own.iter().find(|value| value.abs() > least);
        let mut now = first.map_or(0.0, |value| value.signum());
        for value in own {
            if value.abs() > least {
                now = value.signum();
            }
            signs.push(now);
        }
    }
    signs
}

/// Whether a channel went up (1) or down (−1) since it last clearly turned; nothing before it first moves.
fn rising(streams: &Streams, values: &[f64]) -> Vec<f64> {
    let least = clearly(values);
    let mut ways = Vec::with_capacity(values.len());
    for piece in &streams.pieces {
        let own = &values[piece.rows.clone()];
        let Some(&first) = own.first() else { continue };
        let (mut now, mut lowest, mut highest) = (0.0, first, first);
        for &value in own {
            (lowest, highest) = (value.min(lowest), value.max(highest));
            if now <= 0.0 && value > lowest + least {
                (now, highest) = (1.0, value);
            } else if now >= 0.0 && value < highest - least {
                (now, lowest) = (-1.0, value);
            }
            ways.push(now);
        }
    }
    ways
}

/// A channel less the mean of what was measured of it.
fn deviation(values: &[f64]) -> Vec<f64> {
    let mean = mean(values);
    values.iter().map(|value| value - mean).collect()
}

fn mean(values: &[f64]) -> f64 {
    let measured = values.iter().filter(|value| value.is_finite());
    let (sum, count) = measured.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / f64::max(count, 1.0)
}

/// Whether a channel's mean is more than what it moves by.
fn has_a_mean(values: &[f64]) -> bool {
    let measured = deviation(values)
        .into_iter()
        .filter(|value| value.is_finite());
    let (sum, count) = measured.fold((0.0, 0.0), |(sum, count), value| {
        (sum + value * value, count + 1.0)
    });
    mean(values).powi(2) * count > sum
}

/// The integral over time of a channel, from nothing at the start of each recording.
fn integrated(streams: &Streams, values: &[f64]) -> Vec<f64> {
    let mut sums = Vec::with_capacity(values.len());
    for piece in &streams.pieces {
        let mut sum = 0.0;
        for &value in &values[piece.rows.clone()] {
            // To the middle of the row, as the other signals are.
            sums.push((sum + 0.5 * value) / streams.rate_hz);
            sum += value;
        }
    }
    sums
}

/// One factor by its name.
pub fn signal(scene: &Scene, name: &str) -> Option<Vec<f64>> {
    let streams = &scene.streams;
    if name == "time" {
        return Some(
            (0..streams.rows)
                .map(|row| streams.since_start_s(row))
                .collect(),
        );
    }
    if let Some(limits) = argument(name, "window") {
        let (from, to) = limits.split_once(',')?;
        let (from_s, to_s): (f64, f64) = (from.trim().parse().ok()?, to.trim().parse().ok()?);
        let inside = |row: usize| {
            let time_s = streams.piece_of(row).start_s + streams.since_start_s(row);
            f64::from(u8::from(from_s <= time_s && time_s < to_s))
        };
        return Some((0..streams.rows).map(inside).collect());
    }
    for (shape, phase) in [("sine", 0.0), ("cosine", std::f64::consts::FRAC_PI_2)] {
        if let Some(frequency) = argument(name, shape) {
            let turn = std::f64::consts::TAU * frequency.trim().parse::<f64>().ok()?;
            let at = |row: usize| (turn * streams.clock_s(row) + phase).sin();
            return Some((0..streams.rows).map(at).collect());
        }
    }
    if let Some(constant) = argument(name, "decay") {
        let constant_s = constant
            .trim()
            .parse::<f64>()
            .ok()
            .filter(|constant_s| *constant_s > 0.0)?;
        let at = |row: usize| (-streams.since_start_s(row) / constant_s).exp();
        return Some((0..streams.rows).map(at).collect());
    }
    if let Some(recording) = argument(name, "recording") {
        let mut inside = vec![0.0; streams.rows];
        let own = |piece: &&Piece| name_in_expression(&piece.recording) == recording;
        for piece in streams.pieces.iter().filter(own) {
            inside[piece.rows.clone()].fill(1.0);
        }
        return Some(inside);
    }
    if let Some((channel, constant_s)) = as_lag(name) {
        return Some(lagged(streams, &evaluate(scene, channel).ok()?, constant_s));
    }
    if let Some(channel) = argument(name, "integral") {
        return Some(integrated(streams, &evaluate(scene, channel).ok()?));
    }
    if let Some(channel) = argument(name, "deviation") {
        return Some(deviation(&evaluate(scene, channel).ok()?));
    }
    if let Some(channel) = argument(name, "sign") {
        return Some(sign(streams, &evaluate(scene, channel).ok()?));
    }
    if let Some(channel) = argument(name, "rising") {
        return Some(rising(streams, &evaluate(scene, channel).ok()?));
    }
    if let Some((_, values)) = streams.others.iter().find(|(other, _)| other == name) {
        return Some(values.clone());
    }
    if let Some(channel) = name.strip_prefix("abs_") {
        let mut values = signal(scene, channel)?;
        values.iter_mut().for_each(|value| *value = value.abs());
        return Some(values);
    }
    let (stem, axis) = name.rsplit_once('_')?;
    let axis = AXES.iter().position(|known| *known == axis)?;
    match stem {
        "omega" => Some(scene.rate_rad_s[axis].clone()),
        "alpha" => Some(scene.acceleration_rad_s2[axis].clone()),
        "force" => scene.force_m_s2(axis, 0),
        "temperature" => scene.temperature_change_k(axis, 0),
        "temperature_rate" => scene.temperature_change_k(axis, 1),
        "field" => streams.magnetic_t.as_ref().map(|field| field[axis].clone()),
        "dither_rate" => scene.dither_increment_rad(axis).map(|increments| {
            increments
                .into_iter()
                .map(|increment| increment * streams.rate_hz)
                .collect()
        }),
        "dither_angle" => streams
            .pickoff_rad
            .as_ref()
            .map(|pickoff| pickoff[axis][1..].to_vec()),
        _ => None,
    }
}

/// The same, borrowed where the scene holds it as it is.
fn borrowed<'a>(scene: &'a Scene, name: &str) -> Option<Cow<'a, [f64]>> {
    let of = |triad: &'a Triad, axis: &str| {
        let axis = AXES.iter().position(|known| *known == axis)?;
        Some(Cow::Borrowed(triad[axis].as_slice()))
    };
    if let Some((_, values)) = scene.streams.others.iter().find(|(other, _)| other == name) {
        return Some(Cow::Borrowed(values));
    }
    match name.rsplit_once('_') {
        Some(("omega", axis)) => of(&scene.rate_rad_s, axis),
        Some(("alpha", axis)) => of(&scene.acceleration_rad_s2, axis),
        Some(("field", axis)) => of(scene.streams.magnetic_t.as_ref()?, axis),
        _ => signal(scene, name).map(Cow::Owned),
    }
}

/// Whether an expression is a constant over a stretch of time: it describes, and explains nothing.
pub(super) fn is_window(expression: &str) -> bool {
    expression.starts_with("window(")
}

/// Whether an expression is a mere shape in time, or goes with a channel's past.
pub(super) fn is_shape(expression: &str) -> bool {
    expression.contains('(') || expression == "time"
}

/// Whether a channel moved enough to be recognised. Less than a twentieth of a kelvin is converter noise:
/// no gyro coefficient turns it into a hundredth of a degree per hour. A rate that is the Earth's and no more multiplies
/// like a constant: what it explains is a bias.
fn moves(name: &str, values: &[f64]) -> bool {
    const LEAST_SPAN_K: f64 = 0.05;
    const LEAST_RATE_RAD_S: f64 = 3e-5;
    if name.starts_with("omega_") || name.starts_with("abs_omega_") {
        return rms_about_mean(values) > LEAST_RATE_RAD_S;
    }
    let (least, most) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), v| {
            (least.min(*v), most.max(*v))
        });
    let needed = if name.starts_with("temperature_") {
        LEAST_SPAN_K
    } else {
        0.0
    };
    most - least > needed
}

/// Whether a channel is clearly on both sides of nothing: else its size is the channel again.
fn has_both_signs(values: &[f64]) -> bool {
    let square: f64 = values.iter().map(|value| value * value).sum();
    let least = CLEARLY * (square / values.len() as f64).sqrt();
    values.iter().any(|value| *value > least) && values.iter().any(|value| *value < -least)
}

/// Products of more than two factors, or of factors that stand alone otherwise: rates to the third order off the
/// axes (the axes' own are `gyro_scale_cubic`), what a changing temperature or a rectified rate multiplies, rates and
/// forces with another curve than the catalogue's, a scale or tilt that creeps, goes with a force's square or bends with
/// the temperature, and the dithers of two blocks, which beat.
fn of_third_order(factors: &[Signal], alone: &[String]) -> Vec<String> {
    let has = |stem: &str, axis: usize| {
        let name = format!("{stem}_{}", AXES[axis]);
        factors.iter().any(|factor| factor.name == name) || alone.contains(&name)
    };
    let mut names = Vec::new();
    if (0..3).all(|axis| has("omega", axis)) {
        names.push("omega_x*omega_y*omega_z".to_string());
    }
    let turns_over = |stem: &str, axis: usize| {
        let name = format!("{stem}_{}", AXES[axis]);
        let factor = factors.iter().find(|factor| factor.name == name);
        factor.is_some_and(|factor| has_both_signs(&factor.values))
    };
    for (a, first) in AXES.iter().enumerate() {
        if turns_over("omega", a) {
            names.push(format!("omega_{first}*abs_omega_{first}"));
        }
        if turns_over("force", a) {
            names.push(format!("abs_force_{first}"));
            names.push(format!("force_{first}*abs_force_{first}"));
        }
        if has("force", a) {
            names.push(format!("force_{first}*force_{first}*force_{first}"));
        }
        if has("omega", a) {
            names.push(format!("time*omega_{first}"));
            // A reference whose clock gains on the gyros'.
            names.push(format!("time*alpha_{first}"));
            if has("temperature", a) {
                names.push(format!("omega_{first}*omega_{first}*temperature_{first}"));
            }
        }
        for (b, second) in AXES.iter().enumerate() {
            if a != b && has("omega", a) && has("omega", b) {
                names.push(format!("omega_{first}*omega_{first}*omega_{second}"));
                names.push(format!("abs_omega_{first}*omega_{second}"));
            }
            for (stem, other) in [
                ("temperature_rate", "omega"),
                ("temperature_rate", "temperature"),
                ("abs_omega", "force"),
            ] {
                if has(stem, a) && has(other, b) {
                    names.push(format!("{stem}_{first}*{other}_{second}"));
                }
            }
            if has("omega", a) && has("force", b) {
                names.push(format!("omega_{first}*force_{second}*force_{second}"));
            }
            if a != b && has("omega", a) && has("alpha", b) {
                names.push(format!("abs_alpha_{second}*omega_{first}"));
                let third = AXES[3 - a - b];
                if has("temperature", 3 - a - b) {
                    names.push(format!("alpha_{second}*omega_{first}*temperature_{third}"));
                }
            }
            if a < b && has("dither_rate", a) && has("dither_rate", b) {
                names.push(format!("dither_rate_{first}*dither_rate_{second}"));
            }
        }
    }
    names
}

/// Whether what was before a row is known: not in the stretches of a recording longer than memory. At rest there is none
/// that matters.
pub fn has_past(scene: &Scene) -> bool {
    let streams = &scene.streams;
    let whole = streams.pieces.iter().all(|piece| piece.origin.is_none());
    whole && streams.at_rest.is_none()
}

/// What goes with a channel's past: behind a lag, added up, or with the way it last went.
fn of_the_past(scene: &Scene, factors: &[Signal]) -> Vec<String> {
    if !has_past(scene) {
        return Vec::new();
    }
    let lags = factors.iter().flat_map(|factor| {
        let name = &factor.name;
        LAGS_S.map(|constant_s| format!("lag({name},{constant_s})"))
    });
    let turned = factors
        .iter()
        .filter(|factor| factor.name.starts_with("omega_"));
    let past = turned.flat_map(|factor| {
        let name = &factor.name;
        [
            format!("integral({name})"),
            format!("sign({name})"),
            format!("rising({name})"),
            format!("{name}*rising({name})"),
        ]
    });
    let forces = factors.iter().map(|factor| &factor.name);
    let forces = forces.filter(|name| name.starts_with("force_"));
    let sides = forces.flat_map(|name| [format!("sign({name})"), format!("rising({name})")]);
    lags.chain(past).chain(sides).collect()
}

/// The signals from which products are formed, and the names of those that stand alone, which are formed when
/// they are looked at.
pub fn vocabulary(scene: &Scene) -> (Vec<Signal<'_>>, Vec<String>) {
    let named = |stems: &[&str]| -> Vec<String> {
        stems
            .iter()
            .flat_map(|stem| AXES.iter().map(move |axis| format!("{stem}_{axis}")))
            .collect()
    };
    // At rest the force is what the dither and the ground do to the case: a companion, no cause.
    let stems: &[&str] = match scene.streams.at_rest {
        Some(_) => &["temperature", "field"],
        None => &["omega", "alpha", "force", "temperature", "field"],
    };
    let others = scene.streams.others.iter().flat_map(|(name, values)| {
        let deviation = has_a_mean(values).then(|| format!("deviation({name})"));
        std::iter::once(name.clone()).chain(deviation)
    });
    let moving = |name: &String| borrowed(scene, name).is_some_and(|values| moves(name, &values));
    let factors: Vec<Signal> = named(stems)
        .into_iter()
        .filter(moving)
        .chain(others)
        .filter_map(|name| {
            let values = borrowed(scene, &name)?;
            Some(Signal { name, values })
        })
        .collect();
    let mut alone = match scene.streams.at_rest {
        Some(_) => Vec::new(),
        None => named(&["abs_omega"]),
    };
    alone.extend(named(&["temperature_rate", "dither_rate", "dither_angle"]));
    alone.retain(moving);
    alone.extend(of_the_past(scene, &factors));
    let turns = |factor: &Signal| factor.name.starts_with("omega_");
    if scene.streams.at_rest.is_none() && factors.iter().any(turns) {
        alone.extend(of_third_order(&factors, &alone));
    }
    // At rest the one likelihood decides on what acts slowly, with drift as a rival that this noise does not have.
    if scene.streams.at_rest.is_none() {
        // Warming up, settling: a decay within the record, in steps of an octave.
        alone.extend([1, 2, 4, 8, 16, 32].map(|constant_s| format!("decay({constant_s})")));
        alone.push("time".to_string());
    }
    (factors, alone)
}
