//! Skinned meshes: vertices that follow the joints they are bound to (glTF 2.0, 3.7.3).

use gltf_json::accessor::Type;
use gltf_json::mesh::Semantic;

use super::super::Pose;
use super::shapes::Shape;
use super::transforms::NodePoses;
use super::{GltfError, GltfFile};

/// The joints of a vertex in a set of attributes.
const JOINTS_PER_SET: usize = 4;

/// Positions and triangles.
type Posed = (Vec<[f64; 3]>, Vec<[u32; 3]>);

impl GltfFile {
    /// Returns the positions and triangles of a shape as the joints of a skin pose it. Triangles where
    /// they mirror are turned, so that their faces point outward as before.
    pub(super) fn skinned(
        &self,
        mesh: usize,
        shape: &Shape,
        skin: usize,
        poses: &NodePoses,
    ) -> Result<Posed, GltfError> {
        let joints = self.joint_poses(skin, poses)?;
        let mut of_vertices = vec![Pose::IDENTITY; shape.positions.len()];
        for (primitive, range) in &shape.primitives {
            let of_primitive = self.vertex_poses(mesh, *primitive, &joints)?;
            of_vertices[range.clone()].copy_from_slice(&of_primitive);
        }
        let positions = shape.positions.iter().zip(&of_vertices);
        let turned = |&[a, b, c]: &[u32; 3]| match of_vertices[a as usize].determinant() < 0.0 {
            true => [b, a, c],
            false => [a, b, c],
        };
        Ok((
            positions.map(|(p, pose)| pose.point(*p)).collect(),
            shape.triangles.iter().map(turned).collect(),
        ))
    }

    /// Returns the pose of each joint of a skin, relative to the one in which vertices are bound to it.
    fn joint_poses(&self, skin: usize, poses: &NodePoses) -> Result<Vec<Pose>, GltfError> {
        let found = self.root.skins.get(skin);
        let found = found.ok_or(GltfError::Missing("skin", skin))?;
        let joints: Vec<usize> = found.joints.iter().map(|joint| joint.value()).collect();
        let inverse: Vec<Pose> = match found.inverse_bind_matrices.map(|idx| idx.value()) {
            None => vec![Pose::IDENTITY; joints.len()],
            Some(idx) => {
                let matrices = self.vectors::<16>(idx, Type::Mat4, "matrices")?;
                if matrices.len() < joints.len() {
                    let reason = "it has not a matrix for each joint".into();
                    return Err(GltfError::Accessor {
                        accessor: idx,
                        reason,
                    });
                }
                matrices.into_iter().map(Pose::from_matrix).collect()
            }
        };
        let posed = |(joint, inverse): (usize, &Pose)| {
            let global = poses.globals.get(joint);
            let global = global.ok_or(GltfError::Missing("node", joint))?;
            let global = global.as_ref().ok_or(GltfError::NotATree(joint))?;
            Ok(global.after(inverse))
        };
        joints.into_iter().zip(&inverse).map(posed).collect()
    }

    /// Returns the pose of each vertex of a primitive: the mean of its joints' by its weights.
    fn vertex_poses(
        &self,
        mesh: usize,
        primitive: usize,
        joints: &[Pose],
    ) -> Result<Vec<Pose>, GltfError> {
        let mut bound: Vec<Vec<(Pose, f64)>> = Vec::new();
        for set in 0.. {
            let of = |semantic| self.attribute(mesh, primitive, semantic);
            let (Some(indices), Some(weights)) =
                (of(Semantic::Joints(set))?, of(Semantic::Weights(set))?)
            else {
                break;
            };
            let fault = |accessor, reason: &str| GltfError::Accessor {
                accessor,
                reason: reason.into(),
            };
            let of_vertices =
                self.vectors::<JOINTS_PER_SET>(indices, Type::Vec4, "joints of vertices")?;
            let weights_of =
                self.vectors::<JOINTS_PER_SET>(weights, Type::Vec4, "weights of joints")?;
            bound.resize(of_vertices.len(), vec![]);
            for (vertex, (indices_of, weights_of)) in
                of_vertices.into_iter().zip(weights_of).enumerate()
            {
                for (joint, weight) in indices_of.into_iter().zip(weights_of) {
                    if !(weight >= 0.0 && weight.is_finite()) {
                        return Err(fault(weights, "a weight is negative or not finite"));
                    }
                    let pose = joints.get(joint as usize);
                    let pose = pose.ok_or_else(|| fault(indices, "the skin has no such joint"))?;
                    bound[vertex].push((*pose, weight));
                }
            }
        }
        if bound.is_empty() {
            let reason = "a primitive of a skinned node has no joints and weights";
            return Err(GltfError::Primitive { mesh, reason });
        }
        Ok(bound.iter().map(|joints| mean(joints)).collect())
    }
}

/// Returns the mean of poses by weights, which quantization leaves near one in sum; the first of them
/// without any weight.
fn mean(joints: &[(Pose, f64)]) -> Pose {
    let sum: f64 = joints.iter().map(|(_, weight)| weight).sum();
    if sum == 0.0 {
        return joints[0].0;
    }
    let zero = Pose {
        linear: [[0.0; 3]; 3],
        translation: [0.0; 3],
    };
    joints.iter().fold(zero, |mut mean, (pose, weight)| {
        let share = weight / sum;
        for x in 0..3 {
            for column in 0..3 {
                mean.linear[column][x] += share * pose.linear[column][x];
            }
            mean.translation[x] += share * pose.translation[x];
        }
        mean
    })
}
