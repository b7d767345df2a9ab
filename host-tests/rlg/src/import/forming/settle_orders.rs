//! Orders of Euler angles and quaternions, by the gyros.

use super::attitudes::EulerOrder;
use super::evidence::{self, Misfit};
use super::settle::Settled;
use crate::error::InputError;
use crate::import::files::columns::Block;
use crate::import::mapping::known_forms::Form;
use crate::import::mapping::mapped::Plan;
use crate::import::mapping::questions::Question;
use crate::import::mapping::targets::Target;

/// Largest misfit of one order of a quaternion relative to that of the other that decides it.
const CLEARLY: f64 = 0.3;

/// Orders of Euler angles, the usual one first.
const ORDERS: [&str; 6] = ["zyx", "zxy", "yxz", "yzx", "xyz", "xzy"];

/// Largest misfit of an attitude's turns to the gyros', relative, of one that follows them.
const ORDER_FITS: f64 = 0.3;

impl Settled {
    /// Sets the order of Euler angles that neither the caller nor a publisher states, where the gyros contradict the usual one.
    pub(super) fn order_euler(
        &mut self,
        blocks: &mut Vec<Block>,
        plan: &Plan,
    ) -> Result<(), InputError> {
        let mut mapped = plan.mapped.iter();
        let Some(euler) = mapped.find(|one| one.target == Target::Euler && !one.is_given) else {
            return Ok(());
        };
        let is_documented = Form::euler(&blocks[euler.block]).is_some();
        if self.said.euler.is_some() || is_documented {
            return Ok(());
        }
        let mut misfits = Vec::new();
        for order in ORDERS {
            let mut tried = self.clone();
            tried.said.euler = EulerOrder::parse(order);
            let assembled = tried.provisional(blocks, plan, false)?;
            let Some(misfit) = evidence::attitude_misfit(&assembled.tables, false) else {
                return Ok(());
            };
            if misfits.is_empty() && misfit.as_is < ORDER_FITS {
                return Ok(());
            }
            misfits.push((order, misfit));
        }
        let usual = misfits[0].1.as_is;
        let (order, size, reversed) = best_order(&misfits);
        let reversed = match reversed.is_empty() {
            true => String::new(),
            false => format!(" with gyro {} reversed", reversed.join(", ")),
        };
        let evidence = format!(
            "its turns are off the gyros' by {:.0} %{reversed}, zyx by {:.0} %",
            100.0 * size,
            100.0 * usual
        );
        match size < CLEARLY * usual && size < ORDER_FITS {
            true => self
                .notes
                .push(format!("the Euler angles are taken as {order}: {evidence}")),
            false => self.questions.push(Question {
                asks: "the Euler angles follow the gyros in no order of their rotations".to_owned(),
                answer: ("--euler", vec![order.to_owned()]),
                is_guess: true,
                evidence,
            }),
        }
        self.said.euler = EulerOrder::parse(order);
        Ok(())
    }

    /// Sets the order of a quaternion `q1` to `q4` by the gyros.
    pub(super) fn order_quaternion(
        &mut self,
        blocks: &mut Vec<Block>,
        first: &Plan,
        lacks_rate: bool,
    ) -> Result<(), InputError> {
        let has_attitude = first
            .mapped
            .iter()
            .any(|mapped| mapped.target.is_attitude() && mapped.is_given);
        if first.unordered.len() != 4 || has_attitude {
            return Ok(());
        }
        let names: Vec<String> = first
            .unordered
            .iter()
            .map(|(b, c)| blocks[*b].columns[*c].name.clone())
            .collect();
        let mut found = Vec::new();
        for order in ["wxyz", "xyzw"] {
            let axes = order.chars();
            let maps = names.iter().zip(axes);
            let maps: Vec<String> = maps
                .map(|(name, axis)| format!("{name}=reference_attitude:{axis}"))
                .collect();
            let mut tried = self.clone();
            tried.maps.extend(maps.clone());
            let plan = tried.plan(blocks)?;
            let assembled = tried.provisional(blocks, &plan, lacks_rate)?;
            let is_open = plan
                .mapped
                .iter()
                .any(|mapped| mapped.is_open && mapped.target.is_gyro());
            let misfit = evidence::attitude_misfit(&assembled.tables, is_open || lacks_rate);
            found.push((order, maps, misfit));
        }
        // A reversed gyro follows neither order; with free signs it follows one.
        let is_followed = found.iter().any(|(_, _, misfit)| {
            misfit
                .as_ref()
                .is_some_and(|misfit| misfit.as_is < ORDER_FITS)
        });
        let size = |misfit: &Misfit| match is_followed {
            true => misfit.as_is,
            false => misfit.with_signs,
        };
        let mut found: Vec<(&str, Vec<String>, Option<f64>)> = found
            .into_iter()
            .map(|(order, maps, misfit)| (order, maps, misfit.as_ref().map(size)))
            .collect();
        found.sort_by(|a, b| a.2.unwrap_or(1.0).total_cmp(&b.2.unwrap_or(1.0)));
        let (order, maps, misfit) = found.remove(0);
        let other = found.remove(0).2;
        let all = names.join(", ");
        let nearer = match (misfit, other) {
            (Some(best), Some(other)) if best < CLEARLY * other => Some(format!(
                "{:.0} times nearer to the gyros than the other order",
                other / best.max(1e-6)
            )),
            _ => None,
        };
        let is_named = names.iter().any(|name| name.parse::<usize>().is_err());
        // Counted from 0 the scalar is the first, unless the gyros contradict it.
        let mut mapped = first.mapped.iter();
        if mapped.any(|one| first.unordered.contains(&(one.block, one.column)))
            && (nearer.is_none() || order == "wxyz")
        {
            return Ok(());
        }
        self.maps.extend(maps.clone());
        match nearer {
            Some(nearer) if is_named => self
                .notes
                .push(format!("{all} are taken as {order}: {nearer}")),
            nearer => self.questions.push(Question {
                asks: format!("{all}: is a quaternion whose scalar may be the first or the last"),
                answer: ("--map", maps),
                is_guess: true,
                evidence: nearer.unwrap_or_else(|| "the gyros do not decide".to_owned()),
            }),
        }
        Ok(())
    }
}

/// Returns the order of least misfit with its misfit: to the gyros as they are where one follows them, or else with gyros
/// reversed, which it names.
fn best_order(misfits: &[(&'static str, Misfit)]) -> (&'static str, f64, Vec<&'static str>) {
    let best = |of: &dyn Fn(&Misfit) -> f64| {
        let mut sorted: Vec<&(&'static str, Misfit)> = misfits.iter().collect();
        sorted.sort_by(|a, b| of(&a.1).total_cmp(&of(&b.1)));
        sorted[0].clone()
    };
    let (order, misfit) = best(&|misfit| misfit.as_is);
    if misfit.as_is < ORDER_FITS {
        return (order, misfit.as_is, Vec::new());
    }
    let (order, misfit) = best(&|misfit| misfit.with_signs);
    (order, misfit.with_signs, misfit.reversed)
}
