//! Mirror structs of the ray shaders; their layout is asserted against naga's.

use bytemuck::{Pod, Zeroable};

/// `Scene` of `any_hit.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(super) struct Scene {
    pub cells: [u32; 3],
    pub n_directions: u32,
    pub first_cell: u32,
    pub n_cells: u32,
    pub n_nodes: u32,
    pub max_distance: f32,
    pub key: [u32; 8],
    pub n_triangles: u32,
    pub padding: [u32; 3],
}

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use super::super::tree::Node;
    use super::*;
    use crate::layout_test::assert_layout;

    #[test]
    fn mirror_structs_have_the_layout_of_the_shaders() {
        let shaders = crate::shaders();
        let shader = shaders
            .iter()
            .find(|s| s.name == "rays: Monte Carlo")
            .unwrap();
        let scene = [
            ("cells", offset_of!(Scene, cells)),
            ("n_directions", offset_of!(Scene, n_directions)),
            ("first_cell", offset_of!(Scene, first_cell)),
            ("n_cells", offset_of!(Scene, n_cells)),
            ("n_nodes", offset_of!(Scene, n_nodes)),
            ("max_distance", offset_of!(Scene, max_distance)),
            ("key", offset_of!(Scene, key)),
            ("n_triangles", offset_of!(Scene, n_triangles)),
        ];
        assert_layout(shader, "Scene", size_of::<Scene>(), &scene);
        let node = [
            ("low", offset_of!(Node, low)),
            ("skip", offset_of!(Node, skip)),
            ("high", offset_of!(Node, high)),
            ("triangles", offset_of!(Node, triangles)),
        ];
        assert_layout(shader, "Node", size_of::<Node>(), &node);
    }
}
