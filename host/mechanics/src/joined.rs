//! Nodes that belong together, by whatever joins them.

/// Sets of numbers that grow together. The smallest number of a set stands for it.
pub(crate) struct Joined(Vec<usize>);

impl Joined {
    /// `n` sets of one number each.
    pub(crate) fn new(n: usize) -> Self {
        Self((0..n).collect())
    }

    /// The smallest number of a set.
    pub(crate) fn root(&mut self, mut number: usize) -> usize {
        while self.0[number] != number {
            self.0[number] = self.0[self.0[number]];
            number = self.0[number];
        }
        number
    }

    /// Makes one set of those that these numbers are in.
    pub(crate) fn join(&mut self, numbers: impl IntoIterator<Item = usize>) {
        let mut numbers = numbers.into_iter();
        let Some(first) = numbers.next() else { return };
        let mut root = self.root(first);
        for number in numbers {
            let other = self.root(number);
            self.0[root.max(other)] = root.min(other);
            root = root.min(other);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_joined_by_way_of_others_is_one() {
        let mut joined = Joined::new(5);
        joined.join([0, 3]);
        joined.join([4, 3]);
        let roots: Vec<usize> = (0..5).map(|node| joined.root(node)).collect();
        assert_eq!(roots, [0, 1, 2, 0, 0]);
    }
}
