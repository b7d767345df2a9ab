//! Attribution of an error to the gyros or to their reference by the joint likelihood of gyros and accelerometers.
//!
//! A misaligned, delayed or mis-scaled reference has the same effect on the gyros' residual as an installation, delay or
//! scale error of the gyros. But the case's attitude is computed from the reference, and the accelerometers measure gravity
//! in that attitude. So each split of the difference between the two gives its own prediction of the force; the log
//! likelihoods add, and the largest sum is selected. Further errors of the reference are free parameters on the
//! accelerometers' rows.

use nalgebra::{DMatrix, DVector};
use rlg_catalogue::accelerometers;
use rlg_diagnosis::Outcome;
use rlg_findings::combinations::{Number, identifiable};
use rlg_findings::entries::correlated;
use rlg_findings::result::{EffectEntry, ParameterEntry};
use rlg_findings::updated_model::switch_on;
use rlg_model::{EffectValue, Model, ModelEffect};
use rlg_plan::{CombinationPlan, Plan};
use rlg_signal::axes::AXES;

use crate::diagnose::{Asked, Diagnosed, Part, diagnose};

/// Error of a gyro and an error of the reference with the same effect on the gyros' residual.
struct Pair {
    gyro: &'static str,
    reference: &'static str,
}

static PAIRS: [Pair; 3] = [
    Pair {
        gyro: "installation",
        reference: "reference_misalignment",
    },
    Pair {
        gyro: "gyro_delay",
        reference: "reference_delay",
    },
    Pair {
        gyro: "gyro_scale",
        reference: "reference_scale",
    },
];

impl Pair {
    fn holds(&self, kind: &str) -> bool {
        kind == self.gyro || kind == self.reference
    }

    /// Gyro parameters, each with the place of the reference parameter; an error of the reference appears as its negative.
    fn shared(&self) -> Vec<(String, usize)> {
        if self.gyro == "installation" {
            // x: δ_xz ω_y − δ_xy ω_z is −(r × ω)_x for δ_ij = r_j.
            let pairs = (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
            return pairs
                .filter(|(i, j)| i != j)
                .map(|(i, j)| (format!("{}{}", AXES[i], AXES[j]), j))
                .collect();
        }
        let place = |axis: usize| if self.gyro == "gyro_delay" { 0 } else { axis };
        let axes = 0..3;
        axes.map(|axis| (AXES[axis].to_string(), place(axis)))
            .collect()
    }

    fn reference_names(&self) -> Vec<String> {
        let kind = accelerometers::find(self.reference);
        let parameters = kind.map(|kind| kind.law.parameters()).unwrap_or_default();
        parameters.into_iter().map(|(name, _)| name).collect()
    }
}

/// Entry of the gyros' diagnosis with a pair of alternative causes.
struct Difference {
    pair: &'static Pair,
    /// Place of the entry.
    entry: usize,
    /// An error of the reference alone can explain it.
    may_be_reference: bool,
    /// Log posterior by which each alternative is behind on the gyros' rows.
    behind: [f64; 2],
}

/// Diagnoses the accelerometers in addition to the gyros, and attributes shared errors by the joint likelihood.
///
/// # Errors
/// As of [`diagnose`](fn@diagnose).
pub fn beside(
    parts: &[Part],
    asked: &Asked,
    outcome: &mut Outcome,
    progress: &dyn Fn(&str),
) -> Result<(), String> {
    let differences = differences(outcome, &asked.plan);
    let mut best: Option<(f64, Vec<bool>, Diagnosed)> = None;
    let mut by_gravity: Vec<(f64, Vec<bool>)> = Vec::new();
    for sides in ways(&differences) {
        let effects = effects_under(asked.model, outcome, &differences, &sides);
        // A difference attributed to the reference as a whole leaves it no further error of this kind.
        let open: Vec<&str> = differences
            .iter()
            .zip(&sides)
            .filter(|(_, is_reference)| !**is_reference)
            .map(|(one, _)| one.pair.reference)
            .collect();
        let asked = Asked {
            effects: &effects,
            open: &open,
            ..*asked
        };
        let force = diagnose(parts, &asked, progress)?;
        let behind: f64 = differences
            .iter()
            .zip(&sides)
            .map(|(one, is_reference)| one.behind[usize::from(*is_reference)])
            .sum();
        let score = force.found.fit.score - behind;
        by_gravity.push((force.found.fit.score, sides.clone()));
        if best.as_ref().is_none_or(|(highest, ..)| score > *highest) {
            best = Some((score, sides, force));
        }
    }
    let Some((_, sides, force)) = best else {
        return Ok(());
    };
    for (place, (one, is_reference)) in differences.iter().zip(&sides).enumerate() {
        let best_where = |is_side: bool| {
            let of_side = by_gravity.iter().filter(|(_, way)| way[place] == is_side);
            of_side
                .map(|(own, _)| *own)
                .fold(f64::NEG_INFINITY, f64::max)
        };
        // The gyros' evidence is already in the class, so only gravity's counts here.
        let told_by = best_where(*is_reference) - best_where(!is_reference);
        let is_told = told_by > asked.plan.judgement.class_within;
        let combinations = &asked.plan.findings.combinations;
        let sides = (*is_reference, is_told);
        attribute(outcome, asked.model, one, sides, combinations);
        if !is_reference {
            share_with(outcome, one, &force, combinations);
        }
    }
    force.add_to(outcome);
    Ok(())
}

/// Findings of the gyros that may be errors of the reference, in part or as a whole.
fn differences(outcome: &Outcome, plan: &Plan) -> Vec<Difference> {
    let diagnosis = &outcome.diagnosis;
    let mut found: Vec<Difference> = Vec::new();
    for (entry, effect) in diagnosis.effects.iter().enumerate() {
        let Some(pair) = PAIRS.iter().find(|pair| pair.holds(&effect.kind)) else {
            continue;
        };
        if found.iter().any(|one| one.pair.gyro == pair.gyro) {
            continue;
        }
        let may_be_reference = effect.kind == pair.reference
            || effect
                .indistinguishable_from
                .iter()
                .any(|kind| kind == pair.reference);
        let behind_of = |kind: &str| {
            if kind == effect.kind {
                return 0.0;
            }
            // A kind that spans the effect without being near has more parameters than it needs.
            let mut near = diagnosis.runners_up.iter();
            near.find(|one| one.kind == kind)
                .map_or(plan.judgement.class_within, |one| one.behind)
        };
        found.push(Difference {
            pair,
            entry,
            may_be_reference,
            behind: [pair.gyro, pair.reference].map(behind_of),
        });
    }
    found
}

/// All attributions of the differences; true: to the reference.
fn ways(differences: &[Difference]) -> Vec<Vec<bool>> {
    let mut all = vec![Vec::new()];
    for one in differences {
        let sides: &[bool] = if one.may_be_reference {
            &[false, true]
        } else {
            &[false]
        };
        all = all
            .iter()
            .flat_map(|way: &Vec<bool>| sides.iter().map(|side| [&way[..], &[*side]].concat()))
            .collect();
    }
    all
}

/// Errors of the reference under one attribution.
fn effects_under(
    model: &Model,
    outcome: &Outcome,
    differences: &[Difference],
    sides: &[bool],
) -> Vec<ModelEffect> {
    let is_open = |kind: &str| differences.iter().any(|one| one.pair.reference == kind);
    let mut under = model.clone();
    let found = outcome.model.effects.iter();
    let settled = found.filter(|effect| !is_open(&effect.kind));
    under.effects.retain(|effect| is_open(&effect.kind));
    under.effects.extend(settled.cloned());
    for (one, _) in differences
        .iter()
        .zip(sides)
        .filter(|(_, is_reference)| **is_reference)
    {
        let (values, _) = as_reference(&outcome.diagnosis.effects[one.entry], one.pair);
        switch_on(
            &mut under,
            effect(one.pair.reference, &one.pair.reference_names(), &values),
        );
    }
    under.effects
}

/// Parameters of an entry with their covariance, by name.
fn numbers(entry: &EffectEntry) -> (Vec<String>, DVector<f64>, DMatrix<f64>) {
    let (names, values): (Vec<String>, Vec<f64>) = entry
        .parameters
        .iter()
        .filter_map(|parameter| match parameter {
            ParameterEntry::Number { name, value, .. } => Some((name.clone(), *value)),
            ParameterEntry::Text { .. } => None,
        })
        .unzip();
    let count = names.len();
    let covariance = DMatrix::from_fn(count, count, |a, b| entry.covariance[a][b]);
    (names, DVector::from_vec(values), covariance)
}

/// Linear map of an entry's parameters to those of `names`, with the given weights.
fn mapped(
    entry: &EffectEntry,
    rows: usize,
    weight: impl Fn(usize, &str) -> f64,
) -> (DVector<f64>, DMatrix<f64>) {
    let (names, values, covariance) = numbers(entry);
    let map = DMatrix::from_fn(rows, names.len(), |row, column| weight(row, &names[column]));
    (&map * values, &map * covariance * map.transpose())
}

/// Entry as an error of the reference: the negative mean of the gyro parameters that share one.
fn as_reference(entry: &EffectEntry, pair: &Pair) -> (DVector<f64>, DMatrix<f64>) {
    let names = pair.reference_names();
    if entry.kind == pair.reference {
        return mapped(entry, names.len(), |row, name| {
            f64::from(u8::from(names[row] == name))
        });
    }
    let shared = pair.shared();
    mapped(entry, names.len(), |row, name| {
        let alike = shared.iter().filter(|(_, place)| *place == row).count();
        let is_own = shared
            .iter()
            .any(|(other, place)| other == name && *place == row);
        if is_own { -1.0 / alike as f64 } else { 0.0 }
    })
}

/// Entry as an error of the gyros. All gyro parameters that share a reference parameter get its negative; their differences
/// were not estimated and have the prior variance.
fn as_gyro(entry: &EffectEntry, pair: &Pair) -> (DVector<f64>, DMatrix<f64>) {
    let shared = pair.shared();
    let references = pair.reference_names();
    let is_reference = entry.kind == pair.reference;
    let (values, mut covariance) = mapped(entry, shared.len(), |row, name| {
        let (own, place) = &shared[row];
        match is_reference {
            true if references[*place] == name => -1.0,
            false if own == name => 1.0,
            _ => 0.0,
        }
    });
    if let Some(kind) = accelerometers::find(pair.reference).filter(|_| is_reference) {
        for (a, (_, place)) in shared.iter().enumerate() {
            let alike: Vec<usize> = (0..shared.len())
                .filter(|&b| shared[b].1 == *place)
                .collect();
            for &b in &alike {
                let own = f64::from(u8::from(a == b));
                covariance[(a, b)] += kind.largest.powi(2) * (own - 1.0 / alike.len() as f64);
            }
        }
    }
    (values, covariance)
}

fn effect(kind: &str, names: &[String], values: &DVector<f64>) -> ModelEffect {
    let numbers = names.iter().zip(values.iter());
    ModelEffect {
        kind: kind.to_string(),
        parameters: numbers
            .map(|(name, value)| (name.clone(), EffectValue::Number(*value)))
            .collect(),
    }
}

/// Writes parameters into an entry.
fn write(
    entry: &mut EffectEntry,
    (kind, unit): (&str, &str),
    names: &[String],
    (values, covariance): (&DVector<f64>, &DMatrix<f64>),
    plan: &CombinationPlan,
) {
    entry.kind = kind.to_string();
    (entry.parameters, entry.covariance) = correlated(names, values.as_slice(), covariance, unit);
    let numbers = names.iter().zip(values);
    let numbers = numbers.map(|(name, value)| Number::free(name, *value));
    entry.identifiable = identifiable(&numbers.collect::<Vec<_>>(), covariance, plan);
}

/// Names an entry after the alternative with the larger joint likelihood.
fn attribute(
    outcome: &mut Outcome,
    model: &Model,
    one: &Difference,
    (is_reference, is_told): (bool, bool),
    plan: &CombinationPlan,
) {
    let pair = one.pair;
    let (side, other) = match is_reference {
        true => (pair.reference, pair.gyro),
        false => (pair.gyro, pair.reference),
    };
    let entry = &mut outcome.diagnosis.effects[one.entry];
    if entry.kind != side {
        let (names, (values, covariance)) = match is_reference {
            true => (pair.reference_names(), as_reference(entry, pair)),
            false => {
                let names = pair.shared().into_iter().map(|(name, _)| name).collect();
                (names, as_gyro(entry, pair))
            }
        };
        let unit = accelerometers::find(pair.reference).map_or("1", |kind| kind.unit);
        let card = rlg_catalogue::entries::card(side);
        restore(&mut outcome.model, model, &entry.kind);
        write(entry, (side, unit), &names, (&values, &covariance), plan);
        if let Some(card) = card {
            entry.equation = card.equation.to_string();
            entry.what_was_left_out = card.meaning.to_string();
        }
        entry.indistinguishable_from.retain(|kind| kind != side);
        entry.indistinguishable_from.push(other.to_string());
        switch_on(&mut outcome.model, effect(side, &names, &values));
    }
    let is_alike = entry
        .indistinguishable_from
        .iter()
        .any(|kind| kind == other);
    if is_told && is_alike {
        entry.gravity_speaks_against.push(other.to_string());
    }
}

/// Restores a kind in the updated model to its value in the model.
fn restore(updated: &mut Model, model: &Model, kind: &str) {
    updated.effects.retain(|effect| effect.kind != kind);
    let known = model.effects.iter().filter(|effect| effect.kind == kind);
    updated.effects.extend(known.cloned());
}

/// Splits a difference if the accelerometers show a reference error: the gyros' error is the remainder.
fn share_with(outcome: &mut Outcome, one: &Difference, force: &Diagnosed, plan: &CombinationPlan) {
    let pair = one.pair;
    let Some((values, covariance)) = force.reference_error(pair.reference) else {
        return;
    };
    let shared = pair.shared();
    let names: Vec<String> = shared.iter().map(|(name, _)| name.clone()).collect();
    let map = DMatrix::from_fn(shared.len(), values.len(), |row, column| {
        f64::from(u8::from(shared[row].1 == column))
    });
    let entry = &mut outcome.diagnosis.effects[one.entry];
    let more = &map * &values;
    let spread = &map * &covariance * map.transpose();
    let (own, certainty) = as_gyro(entry, pair);
    let unit = accelerometers::find(pair.reference).map_or("1", |kind| kind.unit);
    write(
        entry,
        (pair.gyro, unit),
        &names,
        (&(own + &more), &(certainty + spread)),
        plan,
    );
    entry
        .indistinguishable_from
        .retain(|kind| kind != pair.reference);
    entry
        .gravity_speaks_against
        .retain(|kind| kind != pair.reference);
    switch_on(&mut outcome.model, effect(pair.gyro, &names, &more));
}

#[cfg(test)]
mod tests {
    use rlg_findings::entries::unlisted;
    use rlg_findings::result::{EffectEntry, ParameterEntry};

    use super::{PAIRS, as_gyro, as_reference};

    fn entry(kind: &str, numbers: &[(String, f64)]) -> EffectEntry {
        let parameters = numbers.iter().map(|(name, value)| ParameterEntry::Number {
            name: name.clone(),
            value: *value,
            std: 1.0,
            unit: String::new(),
        });
        let count = numbers.len();
        EffectEntry {
            kind: kind.to_string(),
            parameters: parameters.collect(),
            covariance: (0..count)
                .map(|a| (0..count).map(|b| f64::from(u8::from(a == b))).collect())
                .collect(),
            ..unlisted(String::new(), String::new())
        }
    }

    #[test]
    fn an_error_of_the_reference_is_the_same_behind_the_gyros_and_back() {
        for pair in &PAIRS {
            let names = pair.reference_names();
            let sizes = [2.0, -3.0, 5.0];
            let numbers: Vec<(String, f64)> = names.iter().cloned().zip(sizes).collect();
            let (on_gyros, covariance) = as_gyro(&entry(pair.reference, &numbers), pair);
            let shared = pair.shared();
            for place in 0..names.len() {
                let sharing: Vec<usize> = (0..shared.len())
                    .filter(|&row| shared[row].1 == place)
                    .collect();
                let count = sharing.len() as f64;
                let pairs = sharing
                    .iter()
                    .flat_map(|&a| sharing.iter().map(move |&b| (a, b)));
                let of_mean: f64 = pairs.map(|at| covariance[at]).sum::<f64>() / (count * count);
                assert!((of_mean - 1.0).abs() < 1e-9, "{}: {of_mean}", pair.gyro);
                // Alone, each parameter is as uncertain as their differences.
                let least = 1.0 + 1e-6 * (count - 1.0);
                let own = sharing.iter().map(|&row| covariance[(row, row)]);
                assert!(own.fold(f64::INFINITY, f64::min) >= least, "{}", pair.gyro);
            }
            let named: Vec<(String, f64)> = shared
                .iter()
                .zip(on_gyros.iter())
                .map(|((name, _), value)| (name.clone(), *value))
                .collect();
            for (name, value) in &named {
                let (_, place) = shared
                    .iter()
                    .find(|(other, _)| other == name)
                    .expect("named");
                assert_eq!(*value, -sizes[*place], "{} {name}", pair.gyro);
            }
            let (back, _) = as_reference(&entry(pair.gyro, &named), pair);
            assert_eq!(back.as_slice(), &sizes[..names.len()], "{}", pair.reference);
        }
    }
}
