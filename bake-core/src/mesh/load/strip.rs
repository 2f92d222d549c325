//! Triangle strips, which glTF and PLY files have.

/// Returns the triangles of a strip of vertices. Every other one is turned, so that all face the same
/// way.
pub(super) fn strip(vertices: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    let turned = |(idx, t): (usize, &[u32])| match idx % 2 {
        0 => [t[0], t[1], t[2]],
        _ => [t[1], t[0], t[2]],
    };
    vertices.windows(3).enumerate().map(turned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_triangles_of_a_strip_face_the_same_way() {
        // Neighbors in a surface run through their common edge in opposite directions.
        let triangles: Vec<_> = strip(&[5, 6, 7, 8]).collect();
        assert_eq!(triangles, [[5, 6, 7], [7, 6, 8]]);
        assert_eq!(strip(&[1, 2]).count(), 0);
    }
}
