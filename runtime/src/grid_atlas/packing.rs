//! Boxes of texels into one box: shelves along x, stacked in layers along y, the layers along z.

/// Where each box begins, and the box around all.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Packed {
    pub(super) origins: Vec<[u32; 3]>,
    pub(super) size: [u32; 3],
}

/// The tightest of a few ways, or none if all are larger than `limit` along some axis. Depends on
/// nothing but its arguments.
pub(super) fn pack(sizes: &[[u32; 3]], limit: u32) -> Option<Packed> {
    let ways = candidates(sizes, limit).map(|side| shelves(sizes, side));
    let fitting = ways.filter(|packed| packed.size.iter().all(|&n| n <= limit));
    fitting.min_by_key(|packed| packed.size.map(u64::from).iter().product::<u64>())
}

/// Sides of the layers that are tried: from a cube's that would just hold all upwards.
fn candidates(sizes: &[[u32; 3]], limit: u32) -> impl Iterator<Item = u32> {
    const TRIES: u32 = 32;
    let volume: f64 = sizes
        .iter()
        .map(|size| size.map(f64::from).iter().product::<f64>())
        .sum();
    let widest = sizes.iter().flat_map(|&[x, y, _]| [x, y]).max();
    let least = (volume.cbrt().ceil() as u32).max(widest.unwrap_or(1));
    let tries = (0..TRIES).map(move |step| least.saturating_add(least.div_ceil(16) * step));
    // The last resort is a layer as large as it may be.
    tries.chain([limit]).filter(move |&side| side <= limit)
}

/// Largest boxes first, so that those which share a layer or a shelf are alike.
fn shelves(sizes: &[[u32; 3]], side: u32) -> Packed {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&idx| {
        let [x, y, z] = sizes[idx];
        std::cmp::Reverse([z, y, x])
    });
    let mut origins = vec![[0; 3]; sizes.len()];
    let mut size = [0; 3];
    let (mut at, mut shelf_height, mut layer_depth) = ([0; 3], 0, 0);
    for idx in order {
        let [x, y, z] = sizes[idx];
        if at[0] + x > side {
            at = [0, at[1] + shelf_height, at[2]];
            shelf_height = 0;
        }
        if at[1] + y > side {
            at = [0, 0, at[2] + layer_depth];
            (shelf_height, layer_depth) = (0, 0);
        }
        origins[idx] = at;
        size = std::array::from_fn(|axis| size[axis].max(at[axis] + sizes[idx][axis]));
        at[0] += x;
        shelf_height = shelf_height.max(y);
        layer_depth = layer_depth.max(z);
    }
    Packed { origins, size }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn overlap(a: ([u32; 3], [u32; 3]), b: ([u32; 3], [u32; 3])) -> bool {
        (0..3).all(|x| a.0[x] < b.0[x] + b.1[x] && b.0[x] < a.0[x] + a.1[x])
    }

    #[test]
    fn boxes_lie_inside_and_never_in_each_other() {
        let odd: Vec<_> = (0..60_u32)
            .map(|i| [8 + i * 7 % 23, 8 + i * 5 % 31, 8 + i * 3 % 17])
            .collect();
        for sizes in [vec![[32; 3]], vec![[32; 3]; 11], odd] {
            let packed = pack(&sizes, 2048).unwrap();
            for (i, &size) in sizes.iter().enumerate() {
                let end = |x| packed.origins[i][x] + size[x];
                assert!((0..3).all(|x| end(x) <= packed.size[x]));
                let mut earlier = packed.origins.iter().zip(&sizes).take(i);
                let own = (packed.origins[i], size);
                assert!(earlier.all(|(&origin, &size)| !overlap(own, (origin, size))));
            }
            let volume = |size: [u32; 3]| size.map(u64::from).iter().product::<u64>();
            let used: u64 = sizes.iter().map(|&size| volume(size)).sum();
            println!("{} of {:?}", sizes.len(), packed.size);
            // Not a bound of the algorithm: it would be a pity if it were worse here.
            assert!(volume(packed.size) <= 2 * used, "{packed:?}");
        }
    }

    #[test]
    fn what_does_not_fit_is_none() {
        assert_eq!(pack(&[[32; 3]; 9], 63), None);
        assert_eq!(pack(&[[32; 3]; 8], 64).unwrap().size, [64; 3]);
        assert_eq!(pack(&[[65, 8, 8]], 64), None);
        assert_eq!(pack(&[[8, 8, 65]], 64), None);
    }
}
