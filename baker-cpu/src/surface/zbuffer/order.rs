//! An order in which neighbors in space are neighbors in memory.

/// Bits of a coordinate in a key.
const BITS: u32 = 10;

/// Returns the indices of positions within ±1 along a Z-curve (Morton 1966). Equal keys keep their order.
pub(super) fn z_curve(positions: impl Iterator<Item = [f64; 3]>) -> Vec<u32> {
    let mut keyed: Vec<_> = positions.map(key).zip(0..).collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, idx)| idx).collect()
}

/// Returns the interleaved bits of the coordinates.
fn key(position: [f64; 3]) -> u32 {
    let cells = f64::from(1 << BITS);
    let cell = position.map(|v| (((v + 1.0) / 2.0 * cells) as u32).min((1 << BITS) - 1));
    (0..BITS).fold(0, |key, bit| {
        let bits = cell.map(|c| c >> bit & 1);
        key | (bits[0] | bits[1] << 1 | bits[2] << 2) << (3 * bit)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_index_is_there_once_and_octants_follow_each_other() {
        let corner = |i: i32| [i & 1, i >> 1 & 1, i >> 2].map(|bit| f64::from(bit) - 0.5);
        let positions = (0..64).map(|i| corner(i * 5 % 8));
        let order = z_curve(positions);
        let octants: Vec<_> = order.iter().map(|i| i * 5 % 8).collect();
        assert!(octants.is_sorted());
        let mut all = order;
        all.sort_unstable();
        assert!(all.into_iter().eq(0..64));
        assert_eq!(z_curve([[1.0; 3], [-1.0; 3]].into_iter()), [1, 0]);
    }
}
