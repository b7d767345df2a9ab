//! Effects outside the catalogue, as products of measured channels.
//!
//! An expression is a product of up to three factors, each written as in `diagnosis.json`: `omega_x` \[rad/s\],
//! `alpha_x` \[rad/s²\], `force_x` \[m/s²\], `temperature_x` \[K since the start\], `temperature_rate_x` \[K/s\],
//! `field_x` \[T\], `dither_rate_x` \[rad/s\], `dither_angle_x` \[rad\], any channel of unclassified quantity by its
//! own name; `abs_` before a channel is its absolute value; `sign(…)` its sign with hysteresis about zero; `rising(…)`
//! 1 after its last lower turning point and −1 after its last upper one; `deviation(…)` the channel minus its mean;
//! `lag(…,s)` a product of up to two channels through a first-order lag of s seconds; `integral(…)` its integral from
//! the start; `time` \[s since the start\], `decay(s)`, `sine(f)`, `cosine(f)` (f in Hz), `window(a,b)` (1 between a
//! and b s).

use std::borrow::Cow;
use std::fmt::Write as _;

use rlg_signal::derivatives::{Spectrum, row_means};

use crate::signals::{AXES, CaseMotion, Signals};

/// Measured channel, or motion derived from the reference, on one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Rate of the case \[rad/s\].
    Rate(usize),
    /// Angular acceleration of the case \[rad/s²\].
    Acceleration(usize),
    /// Specific force \[m/s²\].
    Force(usize),
    /// Temperature since the start \[K\].
    Warming(usize),
    /// Temperature rate \[K/s\].
    WarmingRate(usize),
    /// Magnetic flux density \[T\].
    Field(usize),
    /// Rate of block against case \[rad/s\].
    DitherRate(usize),
    /// Angle of block against case \[rad\].
    DitherAngle(usize),
    /// Channel of unclassified quantity, by its place in [`Signals::others`].
    Other(usize),
}

/// Product of one or two channels.
pub type Product = [Option<Channel>; 2];

/// Factor of an expression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Factor {
    /// Channel.
    Channel(Channel),
    /// Absolute value of a channel.
    Size(Channel),
    /// Sign of a channel, with hysteresis about zero.
    Side(Channel),
    /// 1 after the channel's last lower turning point, −1 after its last upper one.
    Way(Channel),
    /// Channel minus its mean.
    Deviation(Channel),
    /// Product through a first-order lag \[s\], settled at the start.
    Lag(Product, f64),
    /// Integral of a product over time from the start.
    Integral(Product),
    /// Time since the start \[s\].
    Time,
    /// exp(−t/s).
    Decay(f64),
    /// sin(2π f t).
    Sine(f64),
    /// cos(2π f t).
    Cosine(f64),
    /// 1 from the first to the second time on the recording's clock \[s\], 0 outside.
    Window(f64, f64),
}

/// Product of factors; absent ones come last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expression([Option<Factor>; 3]);

/// Channel by axis.
pub(crate) type OfAxis = fn(usize) -> Channel;

/// Names of the channels with an axis.
const STEMS: [(&str, OfAxis); 8] = [
    ("omega", Channel::Rate),
    ("alpha", Channel::Acceleration),
    ("force", Channel::Force),
    ("temperature", Channel::Warming),
    ("temperature_rate", Channel::WarmingRate),
    ("field", Channel::Field),
    ("dither_rate", Channel::DitherRate),
    ("dither_angle", Channel::DitherAngle),
];

impl Channel {
    fn name(self, signals: &Signals) -> String {
        if let Self::Other(place) = self {
            return signals.others[place].0.clone();
        }
        let of = |axis: usize| {
            let (stem, _) = STEMS.iter().find(|(_, channel)| channel(axis) == self)?;
            Some(format!("{stem}_{}", AXES[axis]))
        };
        (0..3).find_map(of).unwrap_or_default()
    }

    fn parse(name: &str, signals: &Signals) -> Option<Self> {
        if let Some(place) = signals.others.iter().position(|(other, _)| other == name) {
            return Some(Self::Other(place));
        }
        let (stem, axis) = name.rsplit_once('_')?;
        let axis = AXES.iter().position(|known| *known == axis)?;
        let (_, channel) = STEMS.iter().find(|(other, _)| *other == stem)?;
        Some(channel(axis))
    }

    /// Computes the values at row middles; `None` if the channel is not measured.
    fn values<'a>(self, signals: &'a Signals, motion: &'a CaseMotion) -> Option<Cow<'a, [f64]>> {
        let measured = |triad: &'a Option<crate::signals::Triad>, axis: usize| {
            triad.as_ref().map(|triad| Cow::Borrowed(&triad[axis][..]))
        };
        match self {
            Self::Rate(axis) => Some(motion.rate_rad_s(axis).into()),
            Self::Acceleration(axis) => Some(motion.acceleration_rad_s2(axis).into()),
            Self::Force(axis) => measured(&signals.force_m_s2, axis),
            Self::Warming(axis) => measured(&signals.warming_k, axis),
            Self::WarmingRate(axis) => measured(&signals.warming_k, axis)
                .map(|warming| Spectrum::new(&warming, signals.rate_hz).mean_derivative(1))
                .map(Cow::from),
            Self::Field(axis) => measured(&signals.magnetic_t, axis),
            Self::DitherRate(axis) => measured(&signals.dither_rad, axis)
                .map(|turned| turned.iter().map(|angle| angle * signals.rate_hz).collect()),
            Self::DitherAngle(axis) => measured(&signals.pickoff_rad, axis),
            Self::Other(place) => signals.others.get(place).map(|(_, values)| values.into()),
        }
    }

    /// True if the channel varies enough to be identifiable.
    pub(crate) fn moves(self, signals: &Signals, is_moving: [bool; 3]) -> bool {
        let plan = &signals.plan.excitation;
        if let Self::Rate(axis) | Self::Acceleration(axis) = self
            && !is_moving[axis]
        {
            return false;
        }
        let Some(values) = self.values(signals, &signals.independent) else {
            return false;
        };
        if values.iter().any(|value| !value.is_finite()) {
            return false;
        }
        let (least, most) = values.iter().fold(
            (f64::INFINITY, f64::NEG_INFINITY),
            |(least, most), value| (least.min(*value), most.max(*value)),
        );
        match self {
            Self::Rate(_) => rms_about_mean(&values) > plan.least_rate_rad_s,
            Self::Warming(_) => most - least > plan.least_span_k,
            _ => most > least,
        }
    }
}

impl Factor {
    /// Channels of the factor.
    fn channels(self) -> impl Iterator<Item = Channel> {
        let of: Product = match self {
            Self::Channel(channel)
            | Self::Size(channel)
            | Self::Side(channel)
            | Self::Way(channel)
            | Self::Deviation(channel) => [Some(channel), None],
            Self::Lag(product, _) | Self::Integral(product) => product,
            Self::Time | Self::Decay(_) | Self::Sine(_) | Self::Cosine(_) | Self::Window(..) => {
                [None; 2]
            }
        };
        of.into_iter().flatten()
    }

    fn name(self, signals: &Signals) -> String {
        let product = |product: Product| {
            let names = product.into_iter().flatten();
            let names: Vec<String> = names.map(|channel| channel.name(signals)).collect();
            names.join("*")
        };
        match self {
            Self::Channel(channel) => channel.name(signals),
            Self::Size(channel) => format!("abs_{}", channel.name(signals)),
            Self::Side(channel) => format!("sign({})", channel.name(signals)),
            Self::Way(channel) => format!("rising({})", channel.name(signals)),
            Self::Deviation(channel) => format!("deviation({})", channel.name(signals)),
            Self::Lag(of, constant_s) => format!("lag({},{constant_s})", product(of)),
            Self::Integral(of) => format!("integral({})", product(of)),
            Self::Time => "time".to_string(),
            Self::Decay(constant_s) => format!("decay({constant_s})"),
            Self::Sine(hz) => format!("sine({hz})"),
            Self::Cosine(hz) => format!("cosine({hz})"),
            Self::Window(from_s, to_s) => format!("window({from_s},{to_s})"),
        }
    }

    fn parse(text: &str, signals: &Signals) -> Option<Self> {
        if text == "time" {
            return Some(Self::Time);
        }
        let Some((function, inside)) = text.strip_suffix(')').and_then(|text| text.split_once('('))
        else {
            // A channel of unclassified quantity may have a name with the prefix abs_.
            let plain = Channel::parse(text, signals).map(Self::Channel);
            return plain.or_else(|| {
                let channel = text.strip_prefix("abs_")?;
                Some(Self::Size(Channel::parse(channel, signals)?))
            });
        };
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        let positive = |text: &str| number(text).filter(|value| *value > 0.0);
        let channel = |text: &str| Channel::parse(text.trim(), signals);
        let product = |text: &str| -> Option<Product> {
            match text.split_once('*') {
                Some((a, b)) => Some([Some(channel(a)?), Some(channel(b)?)]),
                None => Some([Some(channel(text)?), None]),
            }
        };
        match function {
            "sign" => channel(inside).map(Self::Side),
            "rising" => channel(inside).map(Self::Way),
            "deviation" => channel(inside).map(Self::Deviation),
            "integral" => product(inside).map(Self::Integral),
            "decay" => positive(inside).map(Self::Decay),
            "sine" => positive(inside).map(Self::Sine),
            "cosine" => positive(inside).map(Self::Cosine),
            "lag" => {
                let (of, constant) = inside.rsplit_once(',')?;
                Some(Self::Lag(product(of)?, positive(constant)?))
            }
            "window" => {
                let (from, to) = inside.split_once(',')?;
                Some(Self::Window(number(from)?, number(to)?))
            }
            _ => None,
        }
    }

    fn values<'a>(self, signals: &'a Signals, motion: &'a CaseMotion) -> Option<Cow<'a, [f64]>> {
        let at = |law: &dyn Fn(f64) -> f64| -> Cow<'a, [f64]> {
            (0..signals.rows)
                .map(|row| law(signals.elapsed_s + (row as f64 + 0.5) * signals.period_s()))
                .collect()
        };
        let product = |of: Product| -> Option<Cow<'a, [f64]>> {
            let mut channels = of.into_iter().flatten();
            let mut values = channels.next()?.values(signals, motion)?;
            for channel in channels {
                multiply(values.to_mut(), &channel.values(signals, motion)?);
            }
            Some(values)
        };
        let hysteresis = signals.plan.excitation.hysteresis;
        match self {
            Self::Channel(channel) => channel.values(signals, motion),
            Self::Size(channel) => channel
                .values(signals, motion)
                .map(|values| values.iter().map(|value| value.abs()).collect()),
            Self::Side(channel) => channel
                .values(signals, motion)
                .map(|values| side(&values, hysteresis).into()),
            Self::Way(channel) => channel
                .values(signals, motion)
                .map(|values| way(&values, hysteresis).into()),
            Self::Deviation(channel) => channel.values(signals, motion).map(|values| {
                let mean = mean(&values);
                values.iter().map(|value| value - mean).collect()
            }),
            Self::Lag(of, constant_s) => {
                product(of).map(|values| lagged(&values, constant_s * signals.rate_hz).into())
            }
            Self::Integral(of) => {
                product(of).map(|values| integrated(&values, signals.rate_hz).into())
            }
            Self::Time => Some(at(&|time_s| time_s)),
            Self::Decay(constant_s) => Some(at(&|time_s| (-time_s / constant_s).exp())),
            Self::Sine(hz) => Some(at(&|time_s| (std::f64::consts::TAU * hz * time_s).sin())),
            Self::Cosine(hz) => Some(at(&|time_s| (std::f64::consts::TAU * hz * time_s).cos())),
            Self::Window(from_s, to_s) => Some(at(&|time_s| {
                let clock_s = signals.start_s - signals.elapsed_s + time_s;
                f64::from(u8::from(from_s <= clock_s && clock_s < to_s))
            })),
        }
    }

    /// True if the factor is discontinuous: means over rows are then not those of a smooth curve.
    fn jumps(self) -> bool {
        matches!(self, Self::Side(_) | Self::Way(_) | Self::Window(..))
    }
}

impl Expression {
    /// Empty product.
    pub const ONE: Self = Self([None; 3]);

    /// Product of factors.
    pub fn of(factors: &[Factor]) -> Self {
        Self(std::array::from_fn(|place| factors.get(place).copied()))
    }

    /// Window over a range of rows.
    pub fn window(rows: std::ops::Range<usize>, signals: &Signals) -> Self {
        // A quarter of a row is enough to identify the rows inside.
        let digit = 10_f64.powf((4.0 * signals.rate_hz).log10().ceil());
        let edge_s = |row: usize| {
            let clock_s = signals.start_s + row as f64 * signals.period_s();
            (clock_s * digit).round() / digit
        };
        Self::of(&[Factor::Window(edge_s(rows.start), edge_s(rows.end))])
    }

    /// Multiplies the expression by a window over a range of rows; `None` for a product of three factors.
    pub fn within(self, rows: std::ops::Range<usize>, signals: &Signals) -> Option<Self> {
        let window = Self::window(rows, signals).0[0];
        let factors: Vec<Factor> = self.factors().chain(window).collect();
        (factors.len() <= 3).then(|| Self::of(&factors))
    }

    /// True if the expression is a single window.
    pub fn is_window(self) -> bool {
        matches!(self.0, [Some(Factor::Window(..)), None, None])
    }

    fn factors(self) -> impl Iterator<Item = Factor> {
        self.0.into_iter().flatten()
    }

    /// Axes of the motion in the expression; `None` without motion.
    pub(crate) fn axes(self) -> Option<[Option<usize>; 3]> {
        let mut axes = [None; 3];
        for channel in self.factors().flat_map(Factor::channels) {
            if let Channel::Rate(axis) | Channel::Acceleration(axis) = channel {
                axes[axis] = Some(axis);
            }
        }
        (axes != [None; 3]).then_some(axes)
    }

    /// Formats the expression as printed in `diagnosis.json`.
    pub fn text(self, signals: &Signals) -> String {
        let mut text = String::new();
        for factor in self.factors() {
            let between = if text.is_empty() { "" } else { "*" };
            let _ = write!(text, "{between}{}", factor.name(signals));
        }
        text
    }

    /// Parses a text of [`Expression::text`]; `None` if a factor is not one of these signals.
    pub fn parse(text: &str, signals: &Signals) -> Option<Self> {
        let mut depth = 0;
        let outside = |letter: char| {
            depth += i32::from(letter == '(') - i32::from(letter == ')');
            letter == '*' && depth == 0
        };
        let factors: Vec<Factor> = text
            .split(outside)
            .map(|factor| Factor::parse(factor.trim(), signals))
            .collect::<Option<_>>()?;
        ((1..=3).contains(&factors.len())).then(|| Self::of(&factors))
    }

    /// Computes means over rows times T; `None` if a channel is not measured.
    pub fn values(self, signals: &Signals, motion: &CaseMotion) -> Option<Vec<f64>> {
        let period = signals.period_s();
        let mut product = vec![period; signals.rows];
        for factor in self.factors() {
            multiply(&mut product, &factor.values(signals, motion)?);
        }
        let is_of_middles = self.factors().any(|factor| {
            matches!(
                factor,
                Factor::Channel(Channel::Rate(_) | Channel::Acceleration(_))
                    | Factor::Size(Channel::Rate(_) | Channel::Acceleration(_))
            )
        });
        if is_of_middles && !self.factors().any(Factor::jumps) {
            product = row_means(&product);
        }
        Some(product)
    }

    /// Factors; absent ones come last.
    pub fn parts(self) -> [Option<Factor>; 3] {
        self.0
    }

    /// Replaces the time constant \[s\] of a lag or decay; `None` for other expressions.
    pub fn with_time_constant(self, constant_s: f64) -> Option<Self> {
        match self.0 {
            [Some(Factor::Lag(of, _)), None, None] => {
                Some(Self::of(&[Factor::Lag(of, constant_s)]))
            }
            [Some(Factor::Decay(_)), None, None] => Some(Self::of(&[Factor::Decay(constant_s)])),
            _ => None,
        }
    }

    /// Frequency \[Hz\] of a single sine or cosine in time.
    pub fn wave_hz(self) -> Option<f64> {
        match self.0 {
            [Some(Factor::Sine(hz) | Factor::Cosine(hz)), None, None] => Some(hz),
            _ => None,
        }
    }

    /// Time constant \[s\] of a single lag or decay.
    pub fn time_constant_s(self) -> Option<f64> {
        match self.0 {
            [
                Some(Factor::Lag(_, constant_s) | Factor::Decay(constant_s)),
                None,
                None,
            ] => Some(constant_s),
            _ => None,
        }
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn rms_about_mean(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / values.len() as f64).sqrt()
}

fn multiply(product: &mut [f64], values: &[f64]) {
    for (product, value) in product.iter_mut().zip(values) {
        *product *= value;
    }
}

/// Sign of a channel with hysteresis about zero; before the first value off zero, the sign of that value.
fn side(values: &[f64], hysteresis: f64) -> Vec<f64> {
    let least = hysteresis * rms_about_mean(values);
    let first = values.iter().find(|value| value.abs() > least);
    let mut now = first.map_or(0.0, |value| value.signum());
    let follow = |value: &f64| {
        if value.abs() > least {
            now = value.signum();
        }
        now
    };
    values.iter().map(follow).collect()
}

/// Direction of a channel, up (1) or down (−1), since its last turning point; 0 before the first motion.
fn way(values: &[f64], hysteresis: f64) -> Vec<f64> {
    let least = hysteresis * rms_about_mean(values);
    let Some(&first) = values.first() else {
        return Vec::new();
    };
    let (mut now, mut lowest, mut highest) = (0.0, first, first);
    let follow = |&value: &f64| {
        (lowest, highest) = (value.min(lowest), value.max(highest));
        if now <= 0.0 && value > lowest + least {
            (now, highest) = (1.0, value);
        } else if now >= 0.0 && value < highest - least {
            (now, lowest) = (-1.0, value);
        }
        now
    };
    values.iter().map(follow).collect()
}

/// First-order lag of `rows`, settled at the start.
fn lagged(values: &[f64], rows: f64) -> Vec<f64> {
    let keep = (-1.0 / rows).exp();
    let Some(&first) = values.first() else {
        return Vec::new();
    };
    let (mut now, mut before) = (first, first);
    let follow = |&value: &f64| {
        now = keep * now + (1.0 - keep) * 0.5 * (value + before);
        before = value;
        now
    };
    values.iter().map(follow).collect()
}

/// Integral to the middle of each row, 0 at the start.
fn integrated(values: &[f64], rate_hz: f64) -> Vec<f64> {
    let mut sum = 0.0;
    let follow = |value: &f64| {
        let middle = (sum + 0.5 * value) / rate_hz;
        sum += value;
        middle
    };
    values.iter().map(follow).collect()
}
