//! The boundary treatment: occlusion must fade out at the grid's boundary without a visible edge,
//! so values are rescaled such that the largest of the outer cells becomes zero (RR-5779, 3.3.2;
//! JGT 2007).

use aogrid_grid_format::{Boundary, BoundaryMode};

use crate::RawGrid;

use super::PostError;

/// The occlusion above which the JGT treatment leaves values unchanged.
const JGT_KNEE: f64 = 0.3;

/// Rescales a in place, and m by the same factor, so that a cone keeps its axis. A cell that is
/// clamped to zero has no axis.
pub(super) fn treat(raw: &mut RawGrid, requested: BoundaryMode) -> Result<Boundary, PostError> {
    let v_m = largest_outer(raw);
    let applied = match requested {
        BoundaryMode::Jgt if f64::from(v_m) >= JGT_KNEE => BoundaryMode::Rr,
        mode => mode,
    };
    if applied != BoundaryMode::None && v_m >= 1.0 {
        return Err(PostError::BoundaryOccluded);
    }
    let rescale = |v: f64| {
        let v_m = f64::from(v_m);
        match applied {
            BoundaryMode::Jgt if v <= JGT_KNEE => JGT_KNEE * (v - v_m) / (JGT_KNEE - v_m),
            BoundaryMode::Rr => (v - v_m) / (1.0 - v_m),
            BoundaryMode::Jgt | BoundaryMode::None => v,
        }
    };
    for cell in &mut raw.moments {
        let before = cell.a;
        cell.a = rescale(f64::from(before)).clamp(0.0, 1.0) as f32;
        if before > 0.0 {
            cell.m = cell.m.map(|v| v * (cell.a / before));
        }
    }
    Ok(Boundary {
        requested,
        applied,
        v_m,
    })
}

/// Returns V_M, the largest a of the grid's outer cells.
fn largest_outer(raw: &RawGrid) -> f32 {
    let outer = (0..).zip(&raw.moments);
    let outer = outer.filter(|&(idx, _)| raw.spec.is_outer(raw.spec.cell_at(idx)));
    outer.fold(0.0, |largest, (_, cell)| cell.a.max(largest))
}

#[cfg(test)]
mod tests {
    use aogrid_grid_format::GridSpec;

    use super::*;
    use crate::Moments;

    /// Rounding of V', which is computed in f64 and stored as f32.
    const ROUNDING: f32 = f32::EPSILON;

    /// Returns a grid whose inner cells have a = `inner`; one outer cell has `v_m`, the other outer
    /// cells half of it.
    fn raw(inner: f32, v_m: f32) -> RawGrid {
        let spec = GridSpec::new([8, 9, 10], [0.0; 3], [1.0; 3]).unwrap();
        let cell = |a| Moments {
            a,
            m: [0.0, 0.25 * a, 0.0],
        };
        let mut moments: Vec<_> = (0..spec.cell_count())
            .map(|idx| match spec.is_outer(spec.cell_at(idx)) {
                true => cell(v_m / 2.0),
                false => cell(inner),
            })
            .collect();
        // This cell is outer only because it is last in z: code that forgets that side misses it.
        moments[spec.cell_idx([3, 3, 9])] = cell(v_m);
        RawGrid {
            spec,
            counts: vec![0; moments.len()],
            moments,
            directions: 10,
            layers: None,
        }
    }

    fn treated(inner: f32, v_m: f32, mode: BoundaryMode) -> (Boundary, Moments) {
        let mut grid = raw(inner, v_m);
        let boundary = treat(&mut grid, mode).unwrap();
        if boundary.applied != BoundaryMode::None {
            let outer =
                (0..grid.moments.len()).filter(|&i| grid.spec.is_outer(grid.spec.cell_at(i)));
            assert!(outer.into_iter().all(|i| grid.moments[i].a == 0.0));
        }
        (boundary, grid.moments[grid.spec.cell_idx([4, 4, 4])])
    }

    #[test]
    fn values_follow_the_papers_formulas() {
        for inner in [0.05, 0.1, 0.2, 0.3, 0.31, 0.7, 1.0] {
            let v_m = 0.1;
            let expected = [
                (BoundaryMode::None, inner),
                (BoundaryMode::Rr, (inner - v_m) / (1.0 - v_m)),
                (
                    BoundaryMode::Jgt,
                    match inner > 0.3 {
                        true => inner,
                        false => 0.3 * (inner - v_m) / (0.3 - v_m),
                    },
                ),
            ];
            for (mode, expected) in expected {
                let (boundary, cell) = treated(inner, v_m, mode);
                let expected = expected.max(0.0);
                assert_eq!((boundary.applied, boundary.v_m), (mode, v_m));
                assert!(
                    (cell.a - expected).abs() <= ROUNDING,
                    "{mode:?} {inner}: {cell:?}"
                );
                // The moment keeps its proportion to a, hence the cone its axis.
                assert!((cell.m[1] - 0.25 * expected).abs() <= ROUNDING);
            }
        }
    }

    #[test]
    fn jgt_is_continuous_at_its_knee_and_rr_keeps_one() {
        assert!((treated(0.3, 0.2, BoundaryMode::Jgt).1.a - 0.3).abs() <= ROUNDING);
        assert_eq!(treated(1.0, 0.2, BoundaryMode::Rr).1.a, 1.0);
    }

    #[test]
    fn jgt_falls_back_to_rr_where_it_is_undefined() {
        let (boundary, cell) = treated(0.6, 0.3, BoundaryMode::Jgt);
        assert_eq!(boundary.requested, BoundaryMode::Jgt);
        // 0.3 as an `f32` is above 0.3.
        assert_eq!(boundary.applied, BoundaryMode::Rr);
        assert!((cell.a - 3.0 / 7.0).abs() <= ROUNDING);
    }

    #[test]
    fn a_fully_occluded_boundary_is_an_error_unless_it_is_untreated() {
        for mode in [BoundaryMode::Rr, BoundaryMode::Jgt] {
            let error = treat(&mut raw(1.0, 1.0), mode);
            assert_eq!(error, Err(PostError::BoundaryOccluded));
        }
        assert_eq!(treated(1.0, 1.0, BoundaryMode::None).0.v_m, 1.0);
    }

    #[test]
    fn an_unoccluded_grid_stays_unoccluded() {
        let (boundary, cell) = treated(0.0, 0.0, BoundaryMode::Jgt);
        assert_eq!((boundary.v_m, cell.a), (0.0, 0.0));
        assert_eq!(cell.m, [0.0; 3]);
    }
}
