//! Whose error it is, the gyros' or their reference's: gravity tells.
//!
//! A reference that is turned, late or of a wrong scale looks to the gyros like an installation, a delay or a scale error of
//! their own. But the case's attitude is what the reference says it is, and gravity moves through the
//! accelerometers with the case: an error of the reference they feel, one of the gyros they do not.
//!
//! Enters: what the gyros' search found and what the accelerometers say of the reference's errors it left open, beside
//! everything chosen of their own. Leaves: the catch with the names that both agree with; what the gyros alone cannot tell
//! apart stays one class, and says what gravity speaks against.
//!
//! Not here: a soft mount, which turns the case too little to be felt, and an encoder's harmonics, which are undone
//! (carried.rs) but not weighed.

use nalgebra::DVector;

use super::bench::ForceBench;
use super::search::Weighed;
use crate::bench::Bench as _;
use crate::declare::SEPARATION;
use crate::hunt::{self, Catch};
use crate::hypotheses::{CATALOGUE, find, no_effects};
use crate::information::Information;
use crate::invariance::Verdict;
use crate::portion::Portion;
use crate::scene::Scene;
use crate::select::{self, Choice};
use crate::split::Split;
use crate::weigh::prior_width;
use crate::workbench::{Parameters, Workbench};

/// The gyros' side.
pub struct Gyros<'a> {
    /// Numbering of the catalogue's parameters.
    pub parameters: &'a Parameters,
    /// Effects that were tried.
    pub candidates: &'a [usize],
    /// What was found.
    pub catch: &'a mut Catch,
    /// What [`otherwise`] said before.
    pub otherwise: Vec<Information>,
}

/// What the gyros say where a delay that looks like one of the other side is linearised as that one; nothing where no delay
/// was found.
pub fn otherwise(
    bench: &mut Workbench,
    parameters: &Parameters,
    candidates: &[usize],
    choice: &Choice,
) -> Vec<Information> {
    let set = choice.effects();
    let open = open(choice, candidates);
    let named = &set;
    let pairs = open.iter().flat_map(|&turns| {
        let mates = mates(choice, candidates, turns).into_iter();
        mates.map(move |mate| match named.contains(&turns) {
            true => (turns, mate),
            false => (mate, turns),
        })
    });
    let is_linear = |effect: usize| CATALOGUE[effect].is_linear();
    let pairs: Vec<(usize, usize)> = pairs
        .filter(|&(out, into)| set.contains(&out) && !set.contains(&into))
        .filter(|&(out, into)| !is_linear(out) && !is_linear(into))
        .collect();
    let exchanged = |exchange| select::exchanged(bench, parameters, candidates, &set, exchange);
    pairs.into_iter().map(exchanged).collect()
}

/// Errors of the reference that the gyros named, or that would explain what they named, in part or as a whole.
pub(super) fn open(choice: &Choice, candidates: &[usize]) -> Vec<usize> {
    let turns = candidates.iter().copied();
    turns
        .filter(|&effect| CATALOGUE[effect].turns_reference())
        .filter(|&effect| {
            let contained_in = CATALOGUE[effect].card().special_case_of;
            choice.chosen.iter().any(|one| {
                one.effect == effect
                    || one.indistinguishable_from.contains(&effect)
                    || contained_in.contains(&CATALOGUE[one.effect].card().kind)
            })
        })
        .collect()
}

/// What the accelerometers say of the parameters of `open`, their own effects but those of `instead` and the vertical fitted
/// away, as information beside the gyros' (whose parameters count from the model).
pub(super) fn said(
    scene: &Scene,
    (weighed, split): (&Weighed, &Split),
    gyros: &Gyros,
    (open, instead): (&[usize], &[usize]),
) -> Option<Information> {
    let parameters = gyros.parameters;
    let chosen = weighed.choice.chosen.iter();
    let own: Vec<usize> = chosen
        .clone()
        .map(|one| one.effect)
        .filter(|effect| !open.contains(effect) && !instead.contains(effect))
        .collect();
    let mut at = no_effects();
    for one in chosen.filter(|one| own.contains(&one.effect)) {
        at[one.effect] = one.values.iter().copied().collect();
    }
    let portion = Portion::new(split.fitted.clone(), weighed.noise[0].rate_hz)?;
    let effects = [&own[..], open].concat();
    let bench = ForceBench::new(
        scene,
        &weighed.beside,
        parameters,
        portion,
        weighed.noise,
        &effects,
        &at,
    );
    let information = bench.information();
    let asked = parameters.of_all(open);
    let mut aside = parameters.of_all(&own);
    aside.extend(bench.unknowns());
    let (fisher, right) = information.whatever(&asked, &aside, &|index| {
        prior_width(parameters, &information, index)
    })?;
    // They found what is missing beside the error that the reference was already cleared of.
    let already = DVector::from_fn(asked.len(), |a, _| already(gyros, asked[a]));
    let right = right + &fisher * already;
    let mut said = Information::empty(parameters.count());
    for (a, &index_a) in asked.iter().enumerate() {
        said.right[index_a] = right[a];
        for (b, &index_b) in asked.iter().enumerate() {
            said.fisher[(index_a, index_b)] = fisher[(a, b)];
        }
    }
    Some(said)
}

/// A parameter's value in the gyros' choice.
fn already(gyros: &Gyros, index: usize) -> f64 {
    let chosen = gyros.catch.choice.chosen.iter();
    let of = |effect: usize| gyros.parameters.of(effect);
    let mut found = chosen.filter(|one| of(one.effect).contains(&index));
    found
        .next()
        .map_or(0.0, |one| one.values[index - of(one.effect).start])
}

/// Takes `said` into the gyros' choice, where the accelerometers felt some errors of the reference; one that `may_add` to the
/// names, and not only take the place of one, or not. Whether a name came or went.
pub(super) fn decide(
    gyros: &mut Gyros,
    said: &Information,
    (felt, may_add): (&[usize], bool),
    open: &[usize],
    weighed: &Weighed,
) -> bool {
    let (parameters, candidates) = (gyros.parameters, gyros.candidates);
    let before = gyros.catch.choice.effects();
    let linearised = std::iter::once(&gyros.catch.information).chain(&gyros.otherwise);
    let ways: Vec<(&Information, Information)> = linearised
        .map(|alone| {
            let mut both = alone.clone();
            both.add_leading(said);
            (alone, both)
        })
        .collect();
    // What the gyros show of a felt error belongs to it or to one of its mates.
    let of = |&effect: &usize| mates(&gyros.catch.choice, candidates, effect);
    let mut doubtful = felt.to_vec();
    doubtful.extend(felt.iter().flat_map(of));
    let all = [&before[..], &doubtful].concat();
    let judged = ways.iter().map(|(alone, both)| {
        let all = all.clone();
        let (after, evidence) = select::reconsider(parameters, both, candidates, all, &doubtful);
        (after, evidence, *alone, both)
    });
    let best = judged.max_by(|a, b| a.1.total_cmp(&b.1));
    let Some((after, _, alone, both)) = best else {
        return false;
    };
    if after.len() > before.len() && !may_add {
        return false;
    }
    let changed = after != before;
    if changed {
        // One name in the place of another is as large as the gyros say; of two in its place they say nothing.
        let information = match after.len() > before.len() {
            true => both,
            false => alone,
        };
        let mut chosen = select::described(parameters, information, candidates, &after);
        let known = &gyros.catch.choice.chosen;
        for one in &mut chosen {
            if let Some(known) = known.iter().find(|known| known.effect == one.effect) {
                let others = known.indistinguishable_from.iter().copied();
                one.indistinguishable_from =
                    others.filter(|other| !after.contains(other)).collect();
            }
        }
        let regimes: Vec<Verdict> = after
            .iter()
            .map(|&effect| verdict(gyros, &before, effect, weighed))
            .collect();
        gyros.catch.choice.chosen = chosen;
        gyros.catch.regimes = regimes;
        let came = after
            .iter()
            .copied()
            .filter(|effect| !before.contains(effect));
        let came: Vec<usize> = came.collect();
        for gone in before.iter().filter(|effect| !after.contains(effect)) {
            let chosen = &gyros.catch.choice.chosen;
            if !chosen
                .iter()
                .any(|one| one.indistinguishable_from.contains(gone))
            {
                gyros.catch.vetoed.push((*gone, reason(&came)));
            }
        }
    }
    let ways: Vec<Information> = ways.into_iter().map(|(_, both)| both).collect();
    tell_apart(gyros, &ways, open);
    changed
}

/// The errors of the reference that the accelerometers felt, and those that they may have felt instead of effects of their
/// own, with these effects.
pub(super) fn felt(weighed: &Weighed, open: &[usize]) -> (Vec<usize>, Vec<usize>, Vec<usize>) {
    let chosen = weighed.choice.chosen.iter();
    let is_open = |effect: &usize| open.contains(effect);
    let felt: Vec<usize> = weighed
        .choice
        .effects()
        .into_iter()
        .filter(is_open)
        .collect();
    let own = chosen.filter(|one| !is_open(&one.effect));
    let doubtful = own.filter(|one| one.indistinguishable_from.iter().any(is_open));
    let instead: Vec<usize> = doubtful.clone().map(|one| one.effect).collect();
    let rivals = doubtful.flat_map(|one| one.indistinguishable_from.iter().copied());
    let maybe: Vec<usize> = rivals.filter(is_open).collect();
    (felt, maybe, instead)
}

/// Effects of the gyros that look to them like an error of the reference.
fn mates(choice: &Choice, candidates: &[usize], effect: usize) -> Vec<usize> {
    let kinds = CATALOGUE[effect].card().special_case_of.iter();
    let whole = kinds.filter_map(|kind| find(kind).map(|(index, _)| index));
    let chosen = choice.chosen.iter();
    let alike = chosen.flat_map(|one| {
        if one.effect == effect {
            one.indistinguishable_from.clone()
        } else if one.indistinguishable_from.contains(&effect) {
            vec![one.effect]
        } else {
            Vec::new()
        }
    });
    let mut mates: Vec<usize> = whole.chain(alike).collect();
    mates.retain(|&mate| candidates.contains(&mate) && !CATALOGUE[mate].turns_reference());
    mates
}

/// What the regimes say of an effect: as they said of it, of the one in whose place it came, or as the force says.
fn verdict(gyros: &Gyros, before: &[usize], effect: usize, weighed: &Weighed) -> Verdict {
    let mates = mates(&gyros.catch.choice, gyros.candidates, effect);
    let as_before = |wanted: &dyn Fn(usize) -> bool| before.iter().position(|&kept| wanted(kept));
    let place =
        as_before(&|kept| kept == effect).or_else(|| as_before(&|kept| mates.contains(&kept)));
    if let Some(place) = place {
        return gyros.catch.regimes[place].clone();
    }
    let felt = weighed
        .choice
        .effects()
        .iter()
        .position(|&kept| kept == effect);
    felt.map_or_else(
        || Verdict {
            amplitudes: Vec::new(),
            p_value: 1.0,
        },
        |place| weighed.verdicts[place].clone(),
    )
}

/// Says of each class what of it gravity speaks against.
fn tell_apart(gyros: &mut Gyros, ways: &[Information], open: &[usize]) {
    let parameters = gyros.parameters;
    let set = gyros.catch.choice.effects();
    // A delay is judged where it is linearised best.
    let gain = |set: &[usize]| -> f64 {
        let gains = ways.iter().map(|both| {
            let terms = both.parameters - parameters.count();
            hunt::fit(parameters, both, set, terms)
                .1
                .log_likelihood_gain
        });
        gains.fold(f64::NEG_INFINITY, f64::max)
    };
    let full = gain(&set);
    for one in &mut gyros.catch.choice.chosen {
        let effect = one.effect;
        let concerns = |rival: usize| open.contains(&rival) != open.contains(&effect);
        let rivals = one.indistinguishable_from.iter().copied();
        let against = rivals.filter(|&rival| concerns(rival)).filter(|&rival| {
            let rest = set.iter().copied().filter(|&kept| kept != effect);
            let mut other: Vec<usize> = rest.chain([rival]).collect();
            other.sort_unstable();
            2.0 * (full - gain(&other)) >= SEPARATION * SEPARATION
        });
        one.gravity_speaks_against = against.collect();
    }
}

fn reason(instead: &[usize]) -> String {
    let kinds: Vec<&str> = instead
        .iter()
        .map(|&effect| CATALOGUE[effect].card().kind)
        .collect();
    format!(
        "gravity, as the accelerometers feel it, goes with {}",
        kinds.join(" and ")
    )
}
