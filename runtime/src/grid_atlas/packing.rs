//! Packs boxes of texels into one box: shelves along x are stacked along y into layers, and layers
//! along z.

/// The origin of each box, and the size of the box around all.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Packed {
    pub(super) origins: Vec<[u32; 3]>,
    pub(super) size: [u32; 3],
}

/// Returns the smallest of several packings, or none if all are larger than `limit` along some
/// axis. Deterministic.
pub(super) fn pack(sizes: &[[u32; 3]], limit: u32) -> Option<Packed> {
    let packings = candidates(sizes, limit).map(|side| pack_shelves(sizes, side));
    let within_limit = packings.filter(|packed| packed.size.iter().all(|&n| n <= limit));
    within_limit.min_by_key(|packed| packed.size.map(u64::from).iter().product::<u64>())
}

/// The side lengths of layers to try, from the side of a cube of the total volume upwards.
fn candidates(sizes: &[[u32; 3]], limit: u32) -> impl Iterator<Item = u32> {
    const CANDIDATES: u32 = 32;
    let volume: f64 = sizes
        .iter()
        .map(|size| size.map(f64::from).iter().product::<f64>())
        .sum();
    let widest = sizes.iter().flat_map(|&[x, y, _]| [x, y]).max();
    let min_side = (volume.cbrt().ceil() as u32).max(widest.unwrap_or(1));
    let sides =
        (0..CANDIDATES).map(move |step| min_side.saturating_add(min_side.div_ceil(16) * step));
    // The last candidate is the largest allowed layer.
    sides.chain([limit]).filter(move |&side| side <= limit)
}

/// Packs the boxes from large to small, so that those in one layer or shelf have similar sizes.
fn pack_shelves(sizes: &[[u32; 3]], side: u32) -> Packed {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&idx| {
        let [x, y, z] = sizes[idx];
        std::cmp::Reverse([z, y, x])
    });
    let mut origins = vec![[0; 3]; sizes.len()];
    let mut size = [0; 3];
    let (mut cursor, mut shelf_height, mut layer_depth) = ([0; 3], 0, 0);
    for idx in order {
        let [x, y, z] = sizes[idx];
        if cursor[0] + x > side {
            cursor = [0, cursor[1] + shelf_height, cursor[2]];
            shelf_height = 0;
        }
        if cursor[1] + y > side {
            cursor = [0, 0, cursor[2] + layer_depth];
            (shelf_height, layer_depth) = (0, 0);
        }
        origins[idx] = cursor;
        size = std::array::from_fn(|axis| size[axis].max(cursor[axis] + sizes[idx][axis]));
        cursor[0] += x;
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
    fn packed_boxes_lie_inside_and_do_not_overlap() {
        let uneven: Vec<_> = (0..60_u32)
            .map(|i| [8 + i * 7 % 23, 8 + i * 5 % 31, 8 + i * 3 % 17])
            .collect();
        for sizes in [vec![[32; 3]], vec![[32; 3]; 11], uneven] {
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
            // Not guaranteed by the algorithm, but expected for these sizes.
            assert!(volume(packed.size) <= 2 * used, "{packed:?}");
        }
    }

    #[test]
    fn boxes_that_do_not_fit_are_rejected() {
        assert_eq!(pack(&[[32; 3]; 9], 63), None);
        assert_eq!(pack(&[[32; 3]; 8], 64).unwrap().size, [64; 3]);
        assert_eq!(pack(&[[65, 8, 8]], 64), None);
        assert_eq!(pack(&[[8, 8, 65]], 64), None);
    }
}
