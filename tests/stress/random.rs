//! Random numbers that are the same on every machine: splitmix64.

/// A stream of numbers, fixed by its seed.
pub struct Random(u64);

impl Random {
    /// The stream of item `index` under `seed`; streams of different items have nothing in common.
    pub fn new(seed: u64, index: usize) -> Self {
        let mut mixer = Self(seed);
        let mixed = mixer.next() ^ (index as u64).wrapping_mul(0xd134_2543_de82_ef95);
        Self(Self(mixed).next())
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [low, high).
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// 10^x with x uniform in [low, high).
    pub fn power_of_ten(&mut self, low: f64, high: f64) -> f64 {
        10f64.powf(self.uniform(low, high))
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.uniform(0.0, 1.0) < probability
    }

    /// One of a few.
    pub fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.uniform(0.0, choices.len() as f64) as usize % choices.len()]
    }
}
