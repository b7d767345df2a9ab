//! Stepwise selection of a set: forward, backward, and by exchange where neither helps (Miller, Subset Selection in
//! Regression, 2002, ch. 3).

/// Evidence for members of a set. Where it is no function of the set alone, an implementor excludes what it has removed, so
/// that the selection ends.
pub trait Stepwise {
    /// Selected members, with what is known of them together.
    type Set;

    /// Adds the member of largest evidence.
    ///
    /// # Returns
    /// False if none has enough.
    fn extend(&mut self, set: &mut Self::Set) -> bool;

    /// Removes a member that the others make redundant.
    ///
    /// # Returns
    /// False if each is supported given the others.
    fn reduce(&mut self, set: &mut Self::Set) -> bool;

    /// Exchanges a member for a better one.
    ///
    /// # Returns
    /// False if none is better.
    fn exchange(&mut self, _set: &mut Self::Set) -> bool {
        false
    }
}

/// Steps from a set until no step improves it.
pub fn stepwise<S: Stepwise>(of: &mut S, mut set: S::Set) -> S::Set {
    loop {
        let was_extended = of.extend(&mut set);
        let was_reduced = of.reduce(&mut set);
        if !was_extended && !was_reduced && !of.exchange(&mut set) {
            return set;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Stepwise, stepwise};

    /// A table of scores by sets of the members 0, 1 and 2.
    struct Table([f64; 8]);

    impl Table {
        fn best(&self, set: &mut usize, others: impl Iterator<Item = usize>) -> bool {
            let best = others.max_by(|a, b| self.0[*a].total_cmp(&self.0[*b]));
            let better = best.filter(|other| self.0[*other] > self.0[*set]);
            better.inspect(|other| *set = *other).is_some()
        }
    }

    impl Stepwise for Table {
        type Set = usize;

        fn extend(&mut self, set: &mut usize) -> bool {
            let now = *set;
            self.best(set, (0..3).map(|k| now | (1 << k)))
        }

        fn reduce(&mut self, set: &mut usize) -> bool {
            let now = *set;
            self.best(set, (0..3).map(|k| now & !(1 << k)))
        }

        fn exchange(&mut self, set: &mut usize) -> bool {
            let now = *set;
            let pairs = (0..3).flat_map(|k| (0..3).map(move |l| (k, l)));
            let within = pairs.filter(|(k, l)| now & (1 << k) != 0 && now & (1 << l) == 0);
            self.best(set, within.map(|(k, l)| now & !(1 << k) | (1 << l)))
        }
    }

    #[test]
    fn a_member_made_redundant_by_later_ones_goes() {
        // 2 alone is the best single member; 0 and 1 together need it no more.
        let scores = [0.0, 1.0, 1.0, 9.0, 5.0, 7.0, 5.5, 8.0];
        assert_eq!(stepwise(&mut Table(scores), 0), 0b011);
    }

    #[test]
    fn an_exchange_leads_on_where_no_single_step_does() {
        // Beside 2, neither member gains; 0 in its place is better and leads to 0 and 1.
        let scores = [0.0, 3.0, 1.0, 9.0, 2.0, 1.0, 1.0, 1.0];
        assert_eq!(stepwise(&mut Table(scores), 0b100), 0b011);
    }
}
