//! [`EntrySizes`]: what errors of a state are compared with, entry by entry.

use crate::analysis::Group;

/// Sizes of entries of a state: those of their groups.
pub(super) struct EntrySizes {
    groups: Vec<Group>,
    sizes: Vec<f64>,
    /// Length, speed and angular velocity that these sizes are made of.
    scales: [f64; 3],
}

impl EntrySizes {
    /// For positions and velocities.
    pub(super) fn of(groups: &[Group]) -> Self {
        Self { groups: groups.to_vec(), sizes: vec![1.0; groups.len()], scales: [f64::NAN; 3] }
    }

    /// The largest difference of positions in two states, m, in the entries that both have.
    pub(super) fn way(&self, from: &[f64], to: &[f64]) -> f64 {
        let positions = self.groups.iter().zip(from).zip(to).filter(|((group, _), _)| **group == Group::Position);
        positions.fold(0.0, |most, ((_, from), to)| most.max((to - from).abs()))
    }

    /// The largest of the differences as a share of its size, for a length (m), a speed (m/s) and an angular velocity (rad/s); no number
    /// where one is none. `[hot, no allocation]`
    pub(super) fn largest_share(&mut self, scales: [f64; 3], differences: &[f64]) -> f64 {
        if self.scales != scales {
            self.scales = scales;
            let [length, speed, spin] = scales;
            for (size, group) in self.sizes.iter_mut().zip(&self.groups) {
                *size = match group {
                    Group::Position => length,
                    Group::Velocity => speed,
                    Group::AngularVelocity => spin,
                    Group::Parameter | Group::State | Group::Work => 1.0,
                };
            }
        }
        let (mut most, mut is_none) = ([0.0_f64; 2], [false; 2]);
        let mut take = |k: usize, difference: f64, size: f64| {
            let share = difference.abs() / size;
            is_none[k] |= share.is_nan();
            most[k] = if share > most[k] { share } else { most[k] };
        };
        // Several at a time.
        let (pairs, last) = differences.as_chunks::<2>();
        let (sizes, last_size) = self.sizes.as_chunks::<2>();
        for (differences, sizes) in pairs.iter().zip(sizes) {
            take(0, differences[0], sizes[0]);
            take(1, differences[1], sizes[1]);
        }
        last.iter().zip(last_size).for_each(|(difference, size)| take(0, *difference, *size));
        if is_none[0] | is_none[1] { f64::NAN } else { most[0].max(most[1]) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_share_is_found_wherever_it_is() {
        let groups = [Group::Position, Group::Parameter, Group::Velocity, Group::AngularVelocity, Group::Velocity];
        for n in 0..=groups.len() {
            let mut sizes = EntrySizes::of(&groups[..n]);
            for scales in [[2.0, 3.0, 5.0], [2.0, 0.5, 5.0]] {
                let own = [scales[0], 1.0, scales[1], scales[2], scales[1]];
                for at in 0..n {
                    let mut differences = vec![1e-3; n];
                    differences[at] = -7.0;
                    assert_eq!(sizes.largest_share(scales, &differences), 7.0 / own[at]);
                    differences[at] = f64::NAN;
                    assert!(sizes.largest_share(scales, &differences).is_nan());
                    differences[at] = f64::NEG_INFINITY;
                    assert_eq!(sizes.largest_share(scales, &differences), f64::INFINITY);
                }
            }
        }
    }
}
