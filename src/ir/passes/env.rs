//! What a pass knows of each variable, with branches: each way starts from the same knowledge, and afterwards the two
//! outcomes are joined. Costs grow with what changes in a branch, not with the number of variables.

use super::super::body::VarId;

/// Knowledge of type `T` about each variable.
pub struct Env<T> {
    now: Vec<T>,
    /// What variables were before each change since the start of the branch at hand.
    log: Vec<(VarId, T)>,
}

/// The variables that one way through a branch changed, sorted, with what they became.
pub struct Outcome<T>(Vec<(VarId, T)>);

impl<T: Copy + PartialEq> Env<T> {
    /// The same knowledge about `count` variables.
    pub fn new(count: usize, value: T) -> Self {
        Env { now: vec![value; count], log: Vec::new() }
    }

    /// What is known now.
    pub fn get(&self, var: VarId) -> T {
        self.now[var.index()]
    }

    /// Replaces what is known.
    pub fn set(&mut self, var: VarId, value: T) {
        let slot = &mut self.now[var.index()];
        if *slot != value {
            self.log.push((var, *slot));
            *slot = value;
        }
    }

    /// Starts one way through a branch.
    pub fn enter(&mut self) -> usize {
        self.log.len()
    }

    /// Undoes what changed since `enter` and returns it.
    pub fn leave(&mut self, entered: usize) -> Outcome<T> {
        let mut ends = Vec::new();
        while self.log.len() > entered
            && let Some((var, before)) = self.log.pop()
        {
            let slot = &mut self.now[var.index()];
            ends.push((var, *slot));
            *slot = before;
        }
        // Latest change first, so that of several changes to one variable the first met is what it became.
        ends.sort_by_key(|(var, _)| var.0);
        ends.dedup_by_key(|(var, _)| var.0);
        Outcome(ends)
    }

    /// Carries on after a branch, with `join` deciding what holds where either way changed something.
    pub fn join(&mut self, a: &Outcome<T>, b: &Outcome<T>, join: impl Fn(T, T) -> T) {
        let end = |outcome: &Outcome<T>, var: VarId, unchanged: T| {
            let found = outcome.0.binary_search_by_key(&var.0, |(v, _)| v.0);
            found.map_or(unchanged, |i| outcome.0[i].1)
        };
        let changed = a.0.iter().chain(&b.0).map(|(var, _)| *var);
        let joined: Vec<(VarId, T)> = changed
            .map(|var| {
                let before = self.get(var);
                (var, join(end(a, var, before), end(b, var, before)))
            })
            .collect();
        for (var, value) in joined {
            self.set(var, value);
        }
    }

    /// What is known of all variables.
    pub fn all(&self) -> &[T] {
        &self.now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branches_start_alike_and_join() {
        let mut env = Env::new(3, 0);
        let (a, b) = (VarId(1), VarId(2));
        env.set(a, 5);
        let mark = env.enter();
        env.set(a, 6);
        env.set(a, 7);
        env.set(b, 1);
        let then = env.leave(mark);
        assert_eq!((env.get(a), env.get(b)), (5, 0));
        let mark = env.enter();
        env.set(a, 7);
        let other = env.leave(mark);
        env.join(&then, &other, |x, y| if x == y { x } else { -1 });
        assert_eq!((env.get(a), env.get(b)), (7, -1));
    }
}
