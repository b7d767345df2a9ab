//! Residual, columns and noise on one portion of the recording, kept together while the search goes on.
//!
//! Enters: the scene, the residual of the model \[rad per row\], a portion. Leaves: [`Information`] about all
//! parameters of the catalogue, re-made when the noise or the point of linearisation changes.

use realfft::num_complex::Complex64;

use super::bench::Bench;
use super::blocks::{Beside, Blocks};
use super::columns::{self, Column};
use super::empirical::Term;
use super::hypotheses::{CATALOGUE, Sought};
use super::information::{Drift, Information, Nuisance};
use super::noise::{self, Declared, Noise, Series};
use super::portion::{Bins, Portion};
use super::regressor::{Regressor, regressors};
use super::scene::Scene;
use super::streams::{Triad, each_axis};

/// A parameter of the catalogue: which effect, which of its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParameterId {
    /// Index into [`CATALOGUE`].
    pub effect: usize,
    /// Index into the effect's parameters.
    pub parameter: usize,
}

/// All parameters of the catalogue in one order.
pub struct Parameters {
    ids: Vec<ParameterId>,
    first: Vec<usize>,
}

impl Parameters {
    /// Numbers the catalogue's parameters.
    pub fn of_catalogue() -> Self {
        let mut ids = Vec::new();
        let mut first = Vec::new();
        for (effect, entry) in CATALOGUE.iter().enumerate() {
            first.push(ids.len());
            ids.extend(
                (0..entry.card().count()).map(|parameter| ParameterId { effect, parameter }),
            );
        }
        Self { ids, first }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.ids.len()
    }

    /// Who a parameter is; `None` beyond the catalogue, where the sizes of found terms stand.
    pub fn id(&self, index: usize) -> Option<ParameterId> {
        self.ids.get(index).copied()
    }

    /// The indices of an effect's parameters.
    pub fn of(&self, effect: usize) -> std::ops::Range<usize> {
        self.first[effect]..self.first[effect] + CATALOGUE[effect].card().count()
    }

    /// The indices of several effects' parameters.
    pub fn of_all(&self, effects: &[usize]) -> Vec<usize> {
        effects.iter().flat_map(|&effect| self.of(effect)).collect()
    }
}

/// The offset of one nonlinear effect on the three axes (information.rs).
struct Offset {
    effect: usize,
    bins: [Regressor; 3],
}

/// What a search changes on a [`Workbench`].
pub struct Snapshot {
    noise: [Noise; 3],
    terms: Vec<Term>,
    at: Vec<Vec<f64>>,
}

/// See the page above.
pub struct Workbench<'a> {
    scene: &'a Scene,
    residual_rad: &'a Triad,
    parameters: &'a Parameters,
    /// The rows it works on.
    pub portion: Portion,
    /// Noise of each axis.
    pub noise: [Noise; 3],
    residual: [Bins; 3],
    joints: Vec<Regressor>,
    /// What of a size known in advance is in each gyro's noise.
    nuisances: [Vec<Nuisance>; 3],
    columns: Vec<Column>,
    terms: Vec<Term>,
    /// Where each effect is linearised.
    at: Vec<Vec<f64>>,
    /// f(p0) − J p0 of the effects that are linearised elsewhere than at nothing.
    offsets: Vec<Offset>,
    /// What the blocks of a longer recording say of the same parameters.
    beside: Option<Beside<'a>>,
}

impl<'a> Workbench<'a> {
    /// Transforms the residual and the columns of `effects` on `portion`.
    pub fn new(
        scene: &'a Scene,
        residual_rad: &'a Triad,
        parameters: &'a Parameters,
        portion: Portion,
        noise: [Noise; 3],
        effects: &[usize],
        at: &[Vec<f64>],
    ) -> Self {
        let mut bench = Self {
            scene,
            residual_rad,
            parameters,
            residual: each_axis(|axis| portion.transform(&residual_rad[axis])),
            joints: regressors(&portion.joints()),
            nuisances: Default::default(),
            columns: columns::make(scene, parameters, &portion, effects, at),
            portion,
            noise,
            terms: Vec::new(),
            at: at.to_vec(),
            offsets: Vec::new(),
            beside: None,
        };
        for &effect in effects {
            bench.remake_offset(effect);
        }
        bench
    }

    /// Puts the blocks of the recording, of which these rows are stretches, beside the bench before anything is found.
    pub fn stand_beside(&mut self, blocks: &'a Blocks) {
        self.beside = Some(Beside::new(blocks, self.parameters.count()));
    }

    /// Takes columns of known width into each gyro's noise: what they could make is no effect.
    pub fn allow_for(&mut self, nuisances: [Vec<Nuisance>; 3]) {
        self.nuisances = nuisances;
    }

    /// The blocks beside it.
    pub fn beside(&self) -> Option<&Beside<'a>> {
        self.beside.as_ref()
    }

    /// Seconds of the series that shows the lowest frequencies.
    pub fn seconds(&self) -> f64 {
        let beside = self.beside.as_ref();
        beside.map_or_else(|| self.portion.seconds(), Beside::seconds)
    }

    /// Terms found in the data, whose sizes stand behind the catalogue's parameters.
    pub fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// Adds a found term; from now on it is part of every fit.
    pub fn add_term(&mut self, term: Term) -> Result<(), String> {
        let values = term.column(self.scene)?;
        let index = self.parameters.count() + self.terms.len();
        self.columns.push(Column {
            axis: term.axis,
            index,
            bins: Regressor::new(&self.portion.transform(&values)),
        });
        self.columns
            .sort_by_key(|column| (column.axis, column.index));
        if let Some(beside) = &mut self.beside {
            beside.add_term(&term, &self.scene.streams);
        }
        self.terms.push(term);
        Ok(())
    }

    /// Puts a found term at a place among the others.
    pub fn insert_term(&mut self, place: usize, term: Term) -> Result<(), String> {
        let mut behind = self.terms.split_off(place);
        for later in (0..behind.len()).rev() {
            let gone = self.parameters.count() + place + later;
            self.columns.retain(|column| column.index != gone);
            if let Some(beside) = &mut self.beside {
                beside.remove_term(place + later);
            }
        }
        behind.insert(0, term);
        behind.into_iter().try_for_each(|term| self.add_term(term))
    }

    /// Takes all found terms out.
    pub fn clear_terms(&mut self) {
        while !self.terms.is_empty() {
            self.remove_term(self.terms.len() - 1);
        }
    }

    /// Sizes and standard deviations of the found terms, fitted by themselves.
    pub fn term_sizes(&self) -> (Vec<f64>, Vec<f64>) {
        let information = self.information();
        let first = self.parameters.count();
        let indices: Vec<usize> = (first..first + self.terms.len()).collect();
        let solution = information.solve(&indices, &|index| {
            super::weigh::prior_width(self.parameters, &information, index)
        });
        let stds = (0..indices.len())
            .map(|k| solution.covariance[(k, k)].sqrt())
            .collect();
        (solution.values.iter().copied().collect(), stds)
    }

    /// What a search changes on the bench.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            noise: self.noise,
            terms: self.terms.clone(),
            at: self.at.clone(),
        }
    }

    /// Puts the bench back.
    pub fn restore(&mut self, snapshot: Snapshot) -> Result<(), String> {
        self.clear_terms();
        self.noise = snapshot.noise;
        for term in snapshot.terms {
            self.add_term(term)?;
        }
        for (effect, at) in snapshot.at.iter().enumerate() {
            if self.at[effect] != *at {
                self.relinearise(effect, at);
            }
        }
        Ok(())
    }

    /// Whittle log-likelihood of what the values leave: −½ Σ (degrees · ln S + power/S).
    pub fn whittle(&self, values: &[(usize, f64)]) -> f64 {
        let left = self.left_over(values);
        let of_rows: f64 = (0..3)
            .map(|axis| {
                let weights = self.noise[axis].weights(&self.portion);
                self.portion.log_likelihood(&left[axis], &weights)
            })
            .sum();
        let beside = self.beside.as_ref();
        of_rows + beside.map_or(0.0, |beside| beside.whittle(&self.noise, values))
    }

    /// Takes a found term out again.
    pub fn remove_term(&mut self, place: usize) {
        self.terms.remove(place);
        if let Some(beside) = &mut self.beside {
            beside.remove_term(place);
        }
        let gone = self.parameters.count() + place;
        self.columns.retain(|column| column.index != gone);
        for column in self.columns.iter_mut().filter(|column| column.index > gone) {
            column.index -= 1;
        }
    }

    /// The scene.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// The model's residual by row \[rad\].
    pub fn residual_rad(&self) -> &'a Triad {
        self.residual_rad
    }

    /// The columns of some parameters on one axis, as (parameter index, bins).
    pub fn columns_of(&self, indices: &[usize], axis: usize) -> Vec<(usize, &Regressor)> {
        columns::on(&self.columns, axis)
            .filter(|column| indices.contains(&column.index))
            .map(|column| (column.index, &column.bins))
            .collect()
    }

    /// The offsets of nonlinear effects among some parameters, each with its effect's first parameter.
    pub fn offsets_of(&self, indices: &[usize], axis: usize) -> Vec<(usize, &Regressor)> {
        self.offsets
            .iter()
            .map(|offset| (self.parameters.of(offset.effect).start, &offset.bins[axis]))
            .filter(|(first, _)| indices.contains(first))
            .collect()
    }

    /// f(p0) − J(p0) p0 of a nonlinear effect, so that a linear solution is p itself.
    fn remake_offset(&mut self, effect: usize) {
        self.offsets.retain(|offset| offset.effect != effect);
        let at = &self.at[effect];
        if CATALOGUE[effect].is_linear() || at.iter().all(|value| *value == 0.0) {
            return;
        }
        // What the prediction is proportional to drops out.
        let gone = CATALOGUE[effect].proportional_to();
        let mut bins = if gone.is_empty() {
            let prediction = CATALOGUE[effect].prediction(self.scene, at);
            [0, 1, 2].map(|axis: usize| self.portion.transform(&prediction[axis]))
        } else {
            [0, 1, 2].map(|_| vec![Complex64::default(); self.portion.bins()])
        };
        for column in &self.columns {
            let Some(id) = self.parameters.id(column.index) else {
                continue;
            };
            if id.effect != effect || gone.contains(&id.parameter) {
                continue;
            }
            let value = at[id.parameter];
            if value != 0.0 {
                column.bins.add_to(&mut bins[column.axis], -value);
            }
        }
        let bins = bins.map(|bins| Regressor::new(&bins));
        self.offsets.push(Offset { effect, bins });
        self.offsets.sort_by_key(|offset| offset.effect);
    }

    /// The residual less the offsets of the effects that `has` names.
    fn residual_beside(&self, has: &dyn Fn(usize) -> bool) -> [Bins; 3] {
        let mut residual = self.residual.clone();
        for offset in self.offsets.iter().filter(|offset| has(offset.effect)) {
            for (left, part) in residual.iter_mut().zip(&offset.bins) {
                part.add_to(left, -1.0);
            }
        }
        residual
    }

    /// Refits the noise of every axis after the parameters of `effects` are fitted away.
    pub fn refit_noise(&mut self, effects: &[usize], declared: &[Declared; 3], from_scratch: bool) {
        let residual = self.residual_beside(&|effect| effects.contains(&effect));
        let columns = (self.joints.as_slice(), self.columns.as_slice());
        let of_effects = |index: usize| {
            let id = self.parameters.id(index);
            id.is_none_or(|id| effects.contains(&id.effect))
        };
        self.noise = columns::noise_by_axis(|axis| {
            let start = (!from_scratch).then_some(self.noise[axis]);
            let rows = Series {
                portion: &self.portion,
                residual: &residual[axis],
                columns: columns::fitted(columns, axis, (self.parameters, effects)),
                block_rows: 1,
            };
            let beside = self.beside.as_ref();
            let blocks = beside.map(|beside| beside.series(axis, &of_effects));
            noise::fit_all(&rows, blocks.as_ref(), declared[axis], start)
        });
    }

    /// Information about all parameters whose columns are here or beside.
    pub fn information(&self) -> Information {
        self.information_where(&|_| true)
    }

    /// The same of this bench's rows alone.
    pub fn own_information(&self) -> Information {
        self.information_of(&|_| true, None)
    }

    /// The same about those parameters that `wanted` names: the work grows with the square of their number.
    fn information_where(&self, wanted: &(dyn Fn(usize) -> bool + Sync)) -> Information {
        self.information_of(wanted, self.beside.as_ref())
    }

    fn information_of(
        &self,
        wanted: &(dyn Fn(usize) -> bool + Sync),
        beside: Option<&Beside>,
    ) -> Information {
        let parameters = self.parameters.count() + self.terms.len();
        let offsets: Vec<std::ops::Range<usize>> = self
            .offsets
            .iter()
            .map(|offset| self.parameters.of(offset.effect))
            .collect();
        let nothing = Information::with_offsets(parameters, offsets);
        Information::of_axes(nothing, |axis, part| {
            let weights = self.noise[axis].weights(&self.portion);
            let of_wanted = |offset: &Offset| wanted(self.parameters.of(offset.effect).start);
            let offsets = self.offsets.iter().enumerate();
            let offsets = offsets.filter(|(_, offset)| of_wanted(offset));
            let columns: Vec<(usize, &Regressor)> = columns::on(&self.columns, axis)
                .filter(|column| wanted(column.index))
                .map(|column| (column.index, &column.bins))
                .chain(offsets.map(|(k, offset)| (parameters + k, &offset.bins[axis])))
                .collect();
            let nuisances = &self.nuisances[axis];
            let residual = &self.residual[axis];
            part.add_axis(&self.joints, nuisances, residual, &columns, &weights);
            if let Some(beside) = beside {
                beside.add_axis(axis, &self.noise[axis], wanted, part);
            }
            part.drifts
                .extend(self.drift(&self.noise[axis], &columns, &weights));
        })
    }

    /// What of the columns lies in drifting noise; `None` where the rows show none: a level that no data tell from
    /// nothing would make every slow effect doubtful.
    fn drift(
        &self,
        noise: &Noise,
        columns: &[(usize, &Regressor)],
        weights: &[f64],
    ) -> Option<Drift> {
        let shares = noise::drift_shares(noise, &self.portion);
        let squares = shares.iter().enumerate();
        let knowledge: f64 = squares
            .map(|(bin, share)| 0.5 * self.portion.degrees(bin) * share * share)
            .sum();
        let inside: Vec<f64> = shares.iter().zip(weights).map(|(s, w)| s * w).collect();
        let power = |(index, column): &(usize, &Regressor)| (*index, column.power(&inside));
        /// Drift makes up S in four bins at least: in fewer, white noise looks like drift often enough.
        const SHOWN: f64 = 4.0;
        (knowledge > SHOWN).then(|| Drift {
            knowledge,
            powers: columns.iter().map(power).collect(),
        })
    }

    /// The residual's bins less the given parameter values and, fitted last, the jumps at the joints.
    pub fn left_over(&self, values: &[(usize, f64)]) -> [Bins; 3] {
        let has = |effect: usize| {
            let of = self.parameters.of(effect);
            values.iter().any(|(index, _)| of.contains(index))
        };
        let mut left = self.residual_beside(&has);
        for column in &self.columns {
            if let Some((_, value)) = values.iter().find(|(index, _)| *index == column.index) {
                column.bins.add_to(&mut left[column.axis], -value);
            }
        }
        for (axis, left) in left.iter_mut().enumerate() {
            let weights = self.noise[axis].weights(&self.portion);
            super::information::fit_away(left, &self.joints, &weights);
        }
        left
    }

    /// `bins` of one gyro over √S near `bin`, back in time as (row of the recording, value of unit variance
    /// per row): enough bins around to refine a line, thinned to what they need.
    pub fn whitened_in_time(&self, axis: usize, bins: &Bins, bin: usize) -> Vec<(usize, f64)> {
        let level = self.noise[axis].at(self.portion.frequency_hz(bin), 0.0);
        let scale = level.sqrt().recip();
        self.portion
            .back_in_time(bins, bin)
            .into_iter()
            .map(|(row, value)| (row, value * scale))
            .collect()
    }

    /// The residual's bins as they are.
    pub fn residual(&self) -> &[Bins; 3] {
        &self.residual
    }

    /// One unit jump of angle at the start of each stretch.
    pub fn joints(&self) -> &[Regressor] {
        &self.joints
    }

    /// What of a size known in advance is in a gyro's noise.
    pub fn nuisances(&self, axis: usize) -> &[Nuisance] {
        &self.nuisances[axis]
    }
}

impl Bench for Workbench<'_> {
    type Declared = [Declared; 3];

    fn information(&self) -> Information {
        Workbench::information(self)
    }

    fn information_about(&self, indices: &[usize]) -> Information {
        self.information_where(&|index| indices.contains(&index))
    }

    fn at(&self) -> &[Vec<f64>] {
        &self.at
    }

    fn relinearise(&mut self, effect: usize, at: &[f64]) {
        self.at[effect] = at.to_vec();
        columns::renew(
            &mut self.columns,
            self.scene,
            self.parameters,
            &self.portion,
            effect,
            &self.at,
        );
        self.remake_offset(effect);
    }

    fn refit_noise(&mut self, effects: &[usize], declared: &[Declared; 3]) {
        Workbench::refit_noise(self, effects, declared, false);
    }

    fn seek(&self, effect: usize, values: &[(usize, f64)]) -> Option<Sought> {
        CATALOGUE[effect].seek(self, &self.left_over(values))
    }
}
