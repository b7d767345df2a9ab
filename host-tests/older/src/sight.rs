//! What the search sees at one point: what objects to the listed effects, and what is left to find.
//!
//! Enters: a bench, what the products say of it, the names that may still be given. Leaves: an [`Objection`] where
//! expressions explain an effect's share, or that of several findings, better, or where its size differs between the
//! regimes; the most telling term of what is left; the expression that rivals an effect. Nothing is changed here: the
//! search is hunt.rs.

use super::declare::{FAMILY_SIGNIFICANCE, REGRESSOR_FIDELITY};
use super::empirical::{self, Form, Term};
use super::events;
use super::hunt::{Alike, CLEARLY_BETTER, PLAINER, VETO, fit};
use super::hypotheses::{CATALOGUE, reference_harmonic};
use super::information::Information;
use super::invariance::Verdict;
use super::lattice::Lattice;
use super::names::Names;
use super::products::{Best, Products, Survey, WORTH_A_LAG};
use super::select::Choice;
use super::signals;
use super::steps;
use super::weigh::prior_width;
use super::workbench::{Parameters, Workbench};

/// Why the choice cannot stand as it is.
pub(super) enum Objection {
    /// Terms outside the catalogue explain an effect's share better: they come in, and it must stand beside.
    Better(Vec<FoundOne>),
    /// The effect cannot be what it looks like.
    Veto(usize, String),
    /// The effect is not the same in every regime, with this chance.
    Uneven(usize, f64),
}

/// A term, the likelihood ratio it adds, and its chance.
pub(super) type FoundOne = (Term, f64, f64);

/// What the search can see at one point.
pub(super) struct Sight<'a> {
    pub(super) bench: &'a Workbench<'a>,
    pub(super) parameters: &'a Parameters,
    pub(super) survey: &'a Survey,
    pub(super) products: &'a Products<'a>,
    pub(super) lattice: &'a Lattice,
    pub(super) names: &'a Names,
}

impl Sight<'_> {
    /// Whether a product on a gyro says more than effects that were weighed: one that is such an effect's own does not.
    fn is_news(&self, axis: usize, product: usize) -> bool {
        let mut own = self.products.effects[product][axis].iter();
        !own.any(|&effect| self.names.is_weighed(effect))
    }

    /// Whether a product on a gyro is of channels, and no effect's.
    fn is_unlisted(&self, axis: usize, product: usize) -> bool {
        let no_effect = self.products.effects[product][axis].is_empty();
        no_effect && !signals::is_shape(&self.products.names[product])
    }

    /// The best news on a gyro when the parameters in `without` are not fitted; behind a lag only where that is clearly
    /// better than the channel itself.
    fn best_news(&self, axis: usize, without: &[usize]) -> Option<Best> {
        let mut known: Vec<usize> = Vec::new();
        loop {
            let before = |product: usize| self.products.before_lag[product];
            let wanted = |product: usize| {
                let lags_known = before(product).is_some_and(|plain| known.contains(&plain));
                self.is_news(axis, product) && !lags_known
            };
            let best = self.survey.best_of(axis, without, &wanted)?;
            let Some(plain) = before(best.product).filter(|&plain| !self.is_news(axis, plain))
            else {
                return Some(self.plainer(axis, without, best));
            };
            let itself = self
                .survey
                .best_of(axis, without, &|product| product == plain);
            if itself.is_none_or(|itself| best.ratio > itself.ratio + WORTH_A_LAG) {
                return Some(best);
            }
            known.push(plain);
        }
    }

    /// One factor of a product where it explains nearly as much: the other hardly changes.
    fn plainer(&self, axis: usize, without: &[usize], best: Best) -> Best {
        let factors = self.products.factors_of(best.product).into_iter();
        let news = factors.filter(|&factor| self.is_news(axis, factor));
        let alone = news.filter_map(|factor| {
            let wanted = |product: usize| product == factor;
            self.survey.best_of(axis, without, &wanted)
        });
        let alone = alone.filter(|alone| alone.ratio > best.ratio - PLAINER);
        let plainest = alone.max_by(|a, b| a.ratio.total_cmp(&b.ratio));
        plainest.unwrap_or(best)
    }

    /// The effect that what was found is, if it lost its name before.
    pub(super) fn lost_effect(&self, found: &[FoundOne]) -> Option<usize> {
        let [
            (
                Term {
                    axis,
                    form: Form::Product { expression },
                },
                ..,
            ),
        ] = found
        else {
            return None;
        };
        let product = self
            .products
            .names
            .iter()
            .position(|name| name == expression)?;
        let own = self.products.effects[product][*axis].iter().copied();
        own.into_iter()
            .find(|&effect| self.names.may_come_back(effect))
    }

    pub(super) fn objection(
        &self,
        information: &Information,
        choice: &Choice,
        verdicts: &[Verdict],
    ) -> Option<Objection> {
        let whole = Whole::of(self, information, &choice.effects());
        for one in &choice.chosen {
            let own: Vec<usize> = self.parameters.of(one.effect).collect();
            let rest = whole.without(&own);
            let by_products = self.one_a_gyro(&own);
            let together: f64 = by_products.iter().map(|(_, ratio, _)| ratio).sum();
            let best = self.best_term(&rest.values, &own, 0.0, &|_| true);
            let by_best = best.first().map_or(0.0, |(_, ratio, _)| *ratio);
            let best = match together > by_best && are_of_channels(&by_products) {
                true => by_products,
                false => best,
            };
            // Each further number of the effect explains two more, or it says nothing (Akaike).
            let for_numbers = 2.0 * (own.len() as f64 - 1.0);
            let needed = (CLEARLY_BETTER - for_numbers).max(0.0);
            if by_best.max(together) > rest.share + needed {
                return Some(Objection::Better(self.refined(best, &own)));
            }
        }
        if self.lattice.is_any() {
            let hidden = choice.chosen.iter().find(|one| {
                let values = one.values.as_slice();
                let added = CATALOGUE[one.effect].prediction(self.bench.scene(), values);
                (0..3).all(|axis| self.lattice.hides(axis, &added[axis], 1.0))
            });
            if let Some(one) = hidden {
                let why = "it turns by less than a pulse of gyros that count without a dither";
                return Some(Objection::Veto(one.effect, why.to_string()));
            }
        }
        choice
            .chosen
            .iter()
            .zip(verdicts)
            .find(|(_, verdict)| verdict.p_value < VETO)
            .map(|(one, verdict)| Objection::Uneven(one.effect, verdict.p_value))
    }

    /// The product, one a gyro, that is more probable than several of what was found together, two of which one is an
    /// effect, or all: none of them gives way to it alone, as each stands for the part that the others leave.
    pub(super) fn better_than_several(
        &self,
        information: &Information,
        set: &[usize],
    ) -> Option<Vec<FoundOne>> {
        let first = self.parameters.count();
        let terms = first..first + self.bench.terms().len();
        let whole = Whole::of(self, information, set);
        // The odds against each: which effect, or which product on which gyro, it might as well have been.
        let of_effects = (self.names.allowed.len() as f64).ln();
        let of_products = (3.0 * self.products.names.len() as f64).ln();
        let effects = set
            .iter()
            .map(|&effect| (self.parameters.of(effect).collect(), of_effects));
        let terms = terms.map(|index| (vec![index], of_products));
        let found: Vec<(Vec<usize>, f64)> = effects.chain(terms).collect();
        let pairs = (0..set.len()).flat_map(|a| (a + 1..found.len()).map(move |b| vec![a, b]));
        let all = (found.len() > 2 && !set.is_empty()).then(|| (0..found.len()).collect());
        pairs.chain(all).find_map(|several: Vec<usize>| {
            let own = several.iter().flat_map(|&one| &found[one].0);
            let own: Vec<usize> = own.copied().collect();
            let share = 0.5 * whole.without(&own).share;
            // Each number explains one more, or it says nothing (Akaike).
            let odds: f64 = several.iter().map(|&one| found[one].1).sum();
            let worth = share - odds - own.len() as f64;
            let products = self.one_a_gyro(&own);
            if !are_of_channels(&products) {
                return None;
            }
            let by_products = products
                .iter()
                .map(|(_, ratio, _)| 0.5 * ratio - of_products - 1.0);
            (by_products.sum::<f64>() > worth).then(|| self.refined(products, &own))
        })
    }

    /// The best news of each gyro that has any when the parameters in `without` are not fitted. They enter together: one
    /// alone would give way again to the effect that explains the others, too.
    fn one_a_gyro(&self, without: &[usize]) -> Vec<FoundOne> {
        (0..3)
            .filter_map(|axis| Some(self.product(axis, &self.best_news(axis, without)?)))
            .filter(|(_, _, p_value)| *p_value < FAMILY_SIGNIFICANCE)
            .collect()
    }

    /// A product as a term.
    fn product(&self, axis: usize, best: &Best) -> FoundOne {
        let expression = self.products.names[best.product].clone();
        let form = Form::Product { expression };
        (Term { axis, form }, best.ratio, best.p_value)
    }

    /// For each chosen effect the product of channels outside the catalogue that explains its share as well, where one
    /// does: too little better to take its place, and no other name of its own columns, which explains as much and no
    /// more.
    pub(super) fn unlisted_rivals(
        &self,
        information: &Information,
        choice: &Choice,
    ) -> Vec<Option<(usize, String)>> {
        /// A product this much outside an effect's columns is not the effect times what hardly changes.
        const APART: f64 = 0.05;
        let set = choice.effects();
        let whole = Whole::of(self, information, &set);
        let rival = |effect: usize| {
            let own: Vec<usize> = self.parameters.of(effect).collect();
            let share = whole.without(&own).share;
            // One with a frequency of its own holds any product of what stands at one frequency.
            let bends = !CATALOGUE[effect].card().others.is_empty();
            // Each further number of the effect explains two more, or it says nothing (Akaike).
            let needed = share - 2.0 * (own.len() as f64 - 1.0);
            (0..3)
                .filter_map(|axis| {
                    let apart = self.survey.apart(axis, &own, APART);
                    let is_other = |product: usize| self.is_unlisted(axis, product);
                    let better = self.survey.best_of(axis, &own, &is_other);
                    let better = better.filter(|best| best.ratio > share + PLAINER);
                    let as_good = || {
                        let is_apart = |product: usize| bends || apart(product);
                        let wanted = |product: usize| is_other(product) && is_apart(product);
                        self.survey.best_of(axis, &own, &wanted)
                    };
                    Some((axis, better.or_else(as_good)?))
                })
                .filter(|(_, best)| best.ratio > needed && best.p_value < FAMILY_SIGNIFICANCE)
                .max_by(|a, b| a.1.ratio.total_cmp(&b.1.ratio))
                .map(|(axis, best)| (axis, self.products.names[best.product].clone()))
        };
        set.iter().map(|&effect| rival(effect)).collect()
    }

    /// For each chosen effect whether an encoder's error at one order, about one axis, explains its share as well.
    pub(super) fn harmonic_rivals(&self, information: &Information, choice: &Choice) -> Vec<bool> {
        /// A harmonic's own: its cosine and its sine.
        const NUMBERS: f64 = 2.0;
        let set = choice.effects();
        let whole = Whole::of(self, information, &set);
        let is_rivalled = |effect: usize| {
            let own: Vec<usize> = self.parameters.of(effect).collect();
            let rest = whole.without(&own);
            let left = self.bench.left_over(&rest.values);
            // Each further number explains two more, or it says nothing (Akaike); what noise adds to those is no reason.
            let needed = rest.share - 2.0 * (own.len() as f64 - NUMBERS) - PLAINER;
            reference_harmonic::harmonics(self.bench, &left)
                .iter()
                .any(|found| found.ratio > needed && found.p_value < FAMILY_SIGNIFICANCE)
        };
        let at_rest = self.bench.scene().streams.at_rest.is_some();
        set.iter()
            .map(|&effect| !at_rest && is_rivalled(effect))
            .collect()
    }

    /// What else than the harmonic that begins at `place` explains as much; nothing of its second half.
    pub(super) fn like_harmonic(
        &self,
        information: &Information,
        set: &[usize],
        place: usize,
    ) -> Alike {
        let terms = self.bench.terms();
        let Term {
            axis,
            form: Form::Harmonic { order, .. },
        } = terms[place]
        else {
            return Alike::default();
        };
        let halves = empirical::together(terms, place);
        if halves.start != place {
            return Alike::default();
        }
        let first = self.parameters.count();
        let own: Vec<usize> = halves.map(|half| first + half).collect();
        let rest = Whole::of(self, information, set).without(&own);
        let left = self.bench.left_over(&rest.values);
        // Each further number explains two more, or it says nothing (Akaike).
        let needed = rest.share - 2.0 * (own.len() as f64 - 1.0);
        let is_other = |product: usize| self.is_unlisted(axis, product);
        let rival = self.survey.best_of(axis, &own, &is_other);
        let rival = rival.filter(|best| best.ratio > needed);
        Alike {
            order_std: reference_harmonic::spread_of_order(self.bench, &left[axis], axis, order),
            unlisted: rival.map(|best| self.products.names[best.product].clone()),
        }
    }

    /// The most telling pattern in time or product of channels in what the values leave, `without` some
    /// parameters of the survey. A line comes as a pair.
    pub(super) fn best_term(
        &self,
        values: &[(usize, f64)],
        without: &[usize],
        explained: f64,
        fresh: &dyn Fn(&Term) -> bool,
    ) -> Vec<FoundOne> {
        let left = self.bench.left_over(values);
        let one = |term: Term, ratio: f64, p_value: f64| vec![(term, ratio, p_value)];
        // At rest the lines are in the bench already, and no reference tells a jump of the gyro from a nudge.
        let ((steps, slips), (lines, harmonics)) = match self.bench.scene().streams.at_rest {
            None => rayon::join(
                || {
                    rayon::join(
                        || steps::steps(self.bench, &left),
                        || events::slips(self.bench, &left),
                    )
                },
                || {
                    rayon::join(
                        || events::lines(self.bench, &left),
                        || reference_harmonic::harmonics(self.bench, &left),
                    )
                },
            ),
            Some(_) => Default::default(),
        };
        let further = events::further(&slips, |slip| fresh(&slip.term));
        let events = steps.into_iter().chain(slips);
        let events = events.map(|event| one(event.term, event.ratio + PLAINER, event.p_value));
        let lines = lines.into_iter().map(|pair| {
            pair.into_iter()
                .map(|e| (e.term, e.ratio, e.p_value))
                .collect()
        });
        // What repeats with a table's angle: both halves enter together.
        let harmonics = harmonics.into_iter().map(|found| {
            found
                .terms
                .map(|term| (term, found.ratio, found.p_value))
                .to_vec()
        });
        let expressions = (0..3).filter_map(|axis| {
            let best = self.best_news(axis, without)?;
            Some(vec![self.product(axis, &best)])
        });
        // What imperfect regressors of the effects already found may leave behind.
        let allowance = REGRESSOR_FIDELITY * REGRESSOR_FIDELITY * explained;
        let mut best = events
            .chain(lines)
            .chain(harmonics)
            .chain(expressions)
            .filter(|found: &Vec<FoundOne>| {
                let (_, ratio, p_value) = &found[0];
                *p_value < FAMILY_SIGNIFICANCE
                    && *ratio > 1.0 + allowance
                    && found.iter().all(|(term, _, _)| fresh(term))
            })
            .max_by(|a, b| a[0].1.total_cmp(&b[0].1))
            .unwrap_or_default();
        // A counter that slips does so more than once: all that stand out come in together.
        if best.first().is_some_and(|(term, ..)| term.is_slip()) {
            let first = best[0].0.clone();
            let others = further.into_iter().filter(|slip| slip.term != first);
            best.extend(others.map(|slip| (slip.term, slip.ratio, slip.p_value)));
        }
        best
    }

    /// Terms that come in, each product of channels as it explains most.
    pub(super) fn refined(&self, mut found: Vec<FoundOne>, without: &[usize]) -> Vec<FoundOne> {
        for (Term { axis, form }, _, _) in &mut found {
            if let Form::Product { expression } = form {
                let at = (*axis, without);
                *expression = self
                    .products
                    .refined(self.bench, self.survey, at, expression);
            }
        }
        found
    }
}

/// A set of effects and all found terms, fitted together.
struct Whole<'a> {
    sight: &'a Sight<'a>,
    information: &'a Information,
    indices: Vec<usize>,
    log_likelihood_gain: f64,
}

/// What is fitted when a part of the whole is not.
struct Rest {
    /// (parameter index, value).
    values: Vec<(usize, f64)>,
    /// 2 Δ ln L that only the part explains.
    share: f64,
}

impl<'a> Whole<'a> {
    fn of(sight: &'a Sight<'a>, information: &'a Information, set: &[usize]) -> Self {
        let terms = sight.bench.terms().len();
        let (indices, solution) = fit(sight.parameters, information, set, terms);
        Self {
            sight,
            information,
            indices,
            log_likelihood_gain: solution.log_likelihood_gain,
        }
    }

    fn without(&self, own: &[usize]) -> Rest {
        let rest = self.indices.iter().copied();
        let rest: Vec<usize> = rest.filter(|index| !own.contains(index)).collect();
        let width = |index| prior_width(self.sight.parameters, self.information, index);
        let solution = self.information.solve(&rest, &width);
        Rest {
            share: 2.0 * (self.log_likelihood_gain - solution.log_likelihood_gain),
            values: rest
                .into_iter()
                .zip(solution.values.iter().copied())
                .collect(),
        }
    }
}

/// Whether none is a mere shape in time or goes with a channel's past: a decay of its own for every gyro fits better than
/// the temperature that all of them follow, as measured.
fn are_of_channels(found: &[FoundOne]) -> bool {
    found.iter().all(|(term, ..)| match &term.form {
        Form::Product { expression } => !signals::is_shape(expression),
        _ => false,
    })
}
