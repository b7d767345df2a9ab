//! Expressions that the search tries on each gyro.

use crate::expression::Channel::{
    Acceleration, DitherAngle, DitherRate, Field, Force, Other, Rate, Warming, WarmingRate,
};
use crate::expression::Factor::{Channel as Of, Deviation, Integral, Side, Size, Time, Way};
use crate::expression::{Channel, Expression, Factor, OfAxis};
use crate::signals::Signals;

/// Channels that vary enough to be identifiable.
fn moving_channels(signals: &Signals, is_moving: [bool; 3]) -> Vec<Channel> {
    let triads: [OfAxis; 5] = [Rate, Acceleration, Force, Warming, Field];
    let others = (0..signals.others.len()).map(Other);
    triads
        .iter()
        .flat_map(|channel| (0..3).map(channel))
        .chain(others)
        .filter(|channel| channel.moves(signals, is_moving))
        .collect()
}

/// Expressions of one channel each.
pub fn channels(signals: &Signals, is_moving: [bool; 3]) -> Vec<Expression> {
    let channels = moving_channels(signals, is_moving).into_iter();
    channels
        .map(|channel| Expression::of(&[Factor::Channel(channel)]))
        .collect()
}

/// Lists all expressions tried on each gyro: channels and products of two, some of three, lags and integrals of channels,
/// and functions of time.
pub fn vocabulary(signals: &Signals, is_moving: [bool; 3]) -> Vec<Expression> {
    let mut all = Vocabulary {
        channels: moving_channels(signals, is_moving),
        has_dither: signals.dither_rad.is_some(),
        lags_s: signals.plan.grids.lags_s,
        expressions: Vec::new(),
    };
    for place in 0..all.channels.len() {
        all.add_channel(place);
    }
    for a in 0..3 {
        for b in 0..3 {
            all.add_pair(a, b);
        }
        all.add_axis(a);
    }
    if (0..3).all(|axis| all.has(Rate(axis))) {
        all.add(&[Of(Rate(0)), Of(Rate(1)), Of(Rate(2))]);
    }
    for constant_s in signals.plan.grids.decays_s {
        all.add(&[Factor::Decay(constant_s)]);
    }
    all.add(&[Time]);
    all.expressions
}

/// Expressions in the identifiable channels of a recording.
struct Vocabulary {
    channels: Vec<Channel>,
    has_dither: bool,
    /// Time constants of lags \[s\]; the selected one is refined.
    lags_s: [f64; 4],
    expressions: Vec<Expression>,
}

impl Vocabulary {
    fn has(&self, channel: Channel) -> bool {
        self.channels.contains(&channel)
    }

    fn add(&mut self, factors: &[Factor]) {
        self.expressions.push(Expression::of(factors));
    }

    /// Adds a channel, its products with itself and all further channels, its lags, and functions of it.
    fn add_channel(&mut self, place: usize) {
        let a = self.channels[place];
        self.add(&[Of(a)]);
        for other in place..self.channels.len() {
            self.add(&[Of(a), Of(self.channels[other])]);
        }
        for constant_s in self.lags_s {
            self.add(&[Factor::Lag([Some(a), None], constant_s)]);
        }
        match a {
            Rate(_) => {
                self.add(&[Size(a)]);
                self.add(&[Of(a), Size(a)]);
                self.add(&[Integral([Some(a), None])]);
                self.add(&[Side(a)]);
                self.add(&[Way(a)]);
                self.add(&[Of(a), Way(a)]);
                self.add(&[Time, Of(a)]);
            }
            // A clock of the reference that gains on that of the gyros.
            Acceleration(_) => self.add(&[Time, Of(a)]),
            Force(_) => {
                self.add(&[Size(a)]);
                self.add(&[Of(a), Size(a)]);
                self.add(&[Of(a), Of(a), Of(a)]);
                self.add(&[Side(a)]);
                self.add(&[Way(a)]);
            }
            Other(_) => self.add(&[Deviation(a)]),
            _ => {}
        }
    }

    /// Adds products of channels of two axes.
    fn add_pair(&mut self, a: usize, b: usize) {
        let (rate, other) = (Rate(a), Rate(b));
        if a != b && self.has(rate) && self.has(other) {
            self.add(&[Of(rate), Of(rate), Of(other)]);
            self.add(&[Size(rate), Of(other)]);
        }
        if self.has(rate) && self.has(Force(b)) {
            self.add(&[Size(rate), Of(Force(b))]);
            self.add(&[Of(rate), Of(Force(b)), Of(Force(b))]);
        }
        if self.has(Warming(a)) && self.has(other) {
            self.add(&[Of(WarmingRate(a)), Of(other)]);
        }
        if self.has(Warming(a)) && self.has(Warming(b)) {
            self.add(&[Of(WarmingRate(a)), Of(Warming(b))]);
        }
        if a != b && self.has(rate) && self.has(Acceleration(b)) {
            self.add(&[Size(Acceleration(b)), Of(rate)]);
            let third = Warming(3 - a - b);
            if self.has(third) {
                self.add(&[Of(Acceleration(b)), Of(rate), Of(third)]);
            }
        }
        if a <= b && self.has(rate) && self.has(other) {
            for constant_s in self.lags_s {
                self.add(&[Factor::Lag([Some(rate), Some(other)], constant_s)]);
            }
        }
        if a < b && self.has_dither {
            self.add(&[Of(DitherRate(a)), Of(DitherRate(b))]);
        }
    }

    /// Adds temperature rate and dither of one axis.
    fn add_axis(&mut self, a: usize) {
        if self.has(Warming(a)) {
            self.add(&[Of(WarmingRate(a))]);
            if self.has(Rate(a)) {
                self.add(&[Of(Rate(a)), Of(Rate(a)), Of(Warming(a))]);
            }
        }
        if self.has_dither {
            self.add(&[Of(DitherRate(a))]);
            self.add(&[Of(DitherAngle(a))]);
        }
    }
}
