//! Disjoint sets that grow together.

/// Disjoint sets of things that are joined directly or through others.
pub struct Joined(Vec<u32>);

impl Joined {
    /// Start with `count` things, each in a set of its own.
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn root(&mut self, mut thing: u32) -> u32 {
        while self.0[thing as usize] != thing {
            // The thing now points to the one two steps above, which halves the way up for the next search.
            let above = self.0[self.0[thing as usize] as usize];
            self.0[thing as usize] = above;
            thing = above;
        }
        thing
    }

    /// Join two things.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// Return the number of sets, and the index of the set of each thing. Sets are numbered in the order of their first things.
    pub fn classes(mut self) -> (usize, Vec<u32>) {
        let mut of_thing: Vec<u32> = vec![0; self.0.len()];
        let mut count = 0;
        for thing in 0..self.0.len() {
            // The root is the least of all things in the set.
            let root = self.root(thing as u32) as usize;
            if root == thing {
                of_thing[thing] = count;
                count += 1;
            }
            of_thing[thing] = of_thing[root];
        }
        (count as usize, of_thing)
    }
}
