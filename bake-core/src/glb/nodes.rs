//! The nodes of a GLB file that grids belong to.

use gltf_json::{Node, Root};

use super::{Container, GlbError};
use crate::mesh::{LoadedMesh, Pose, local_pose};

/// The nodes of a GLB file, and the parts of its mesh.
pub struct Nodes {
    root: Root,
    /// The pose of each node in the scene.
    world: Vec<Pose>,
    parts: Vec<NodePart>,
}

/// A part of the mesh.
struct NodePart {
    name: String,
    node: usize,
    /// The pose of the part's frame in the scene, and the first part that one grid serves with it; `None`
    /// for a part without a triangle that has an area.
    frame: Option<(Pose, usize)>,
}

/// A node with the pose in it of the frame of a grid.
pub type PosedNode = (usize, Pose);

impl Nodes {
    /// Finds the nodes of a GLB file from its bytes and its mesh.
    ///
    /// # Errors
    ///
    /// The file is no GLB.
    pub fn new(bytes: &[u8], loaded: &LoadedMesh) -> Result<Self, GlbError> {
        let json = Container::new(bytes)?.json;
        let root: Root = gltf_json::deserialize::from_slice(json)
            .map_err(|error| GlbError::Json(error.to_string()))?;
        // Every part has a primitive, and those of a node follow each other.
        let of_nodes = loaded.primitives.chunk_by(|a, b| a.node == b.node);
        let parts = loaded.mesh.parts().iter().zip(of_nodes).enumerate();
        let parts = parts.map(|(idx, (part, primitives))| NodePart {
            name: part.name.clone(),
            node: primitives[0].node,
            frame: loaded.part(idx).ok().map(|part| (part.pose, part.same_as)),
        });
        Ok(Self {
            world: world_poses(&root),
            parts: parts.collect(),
            root,
        })
    }

    /// Returns the names of the mesh's parts.
    pub fn parts(&self) -> impl Iterator<Item = &str> {
        self.parts.iter().map(|part| part.name.as_str())
    }

    /// Returns the nodes that a grid of the part with this name serves: its own, and those that pose the
    /// same mesh; empty if there is no such part.
    ///
    /// # Errors
    ///
    /// A node scales an axis to nothing.
    pub fn of_part(&self, name: &str) -> Result<Vec<PosedNode>, GlbError> {
        let part = self.parts.iter().find(|part| part.name == name);
        let Some((_, same)) = part.and_then(|part| part.frame) else {
            return Ok(vec![]);
        };
        let frames = self.parts.iter().filter_map(|part| {
            let (pose, same_as) = part.frame?;
            (same_as == same).then_some((part.node, pose))
        });
        let local = |(node, pose): PosedNode| Ok((node, self.in_node(node, &pose)?));
        frames.map(local).collect()
    }

    /// Returns the nodes that are called `name`.
    pub fn named(&self, name: &str) -> Vec<usize> {
        let is_named = |node: &Node| node.name.as_deref() == Some(name);
        let nodes = self.root.nodes.iter().enumerate();
        let named = nodes.filter(|(_, node)| is_named(node));
        named.map(|(idx, _)| idx).collect()
    }

    /// Returns the nodes that by their extras had the grid file with this BLAKE3 hash before a program
    /// dropped it, and the pose of its frame in them.
    pub fn with_hash(&self, blake3: &str) -> Vec<PosedNode> {
        let recorded = |node: &Node| {
            let record = super::occluders::record(node)?;
            let is_same = record["blake3"] == blake3;
            is_same.then(|| super::occluders::pose_of(&record["matrix"]))
        };
        let nodes = self.root.nodes.iter().enumerate();
        nodes
            .filter_map(|(idx, node)| Some((idx, recorded(node)?)))
            .collect()
    }

    /// Returns the only root of the scene with the pose of the scene's frame in it; `None` if there are
    /// several.
    ///
    /// # Errors
    ///
    /// The node scales an axis to nothing.
    pub fn only_root(&self) -> Result<Option<PosedNode>, GlbError> {
        let roots = match self.root.scenes.get(self.scene()) {
            Some(scene) => scene.nodes.iter().map(|node| node.value()).collect(),
            None => {
                let parents = parents(&self.root);
                let roots = (0..parents.len()).filter(|idx| parents[*idx].is_none());
                roots.collect::<Vec<_>>()
            }
        };
        match roots[..] {
            [root] if root < self.world.len() => {
                let pose = self.in_node(root, &Pose::IDENTITY)?;
                Ok(Some((root, pose)))
            }
            _ => Ok(None),
        }
    }

    /// Returns the index of the scene that is shown first.
    pub(super) fn scene(&self) -> usize {
        self.root.scene.map_or(0, |scene| scene.value())
    }

    /// Returns a pose in the scene as one in a node.
    fn in_node(&self, node: usize, pose: &Pose) -> Result<Pose, GlbError> {
        let world = self.world[node];
        if world == *pose {
            return Ok(Pose::IDENTITY);
        }
        let inverse = world.inverse().ok_or(GlbError::Flat(node))?;
        Ok(inverse.after(pose))
    }
}

/// Returns the parent of each node.
fn parents(root: &Root) -> Vec<Option<usize>> {
    let mut parents = vec![None; root.nodes.len()];
    for (idx, node) in root.nodes.iter().enumerate() {
        for child in node.children.iter().flatten() {
            if let Some(parent) = parents.get_mut(child.value()) {
                *parent = Some(idx);
            }
        }
    }
    parents
}

/// Returns the pose of each node in the scene.
fn world_poses(root: &Root) -> Vec<Pose> {
    let parents = parents(root);
    let world = |idx: usize| {
        let mut pose = local_pose(&root.nodes[idx]);
        let mut parent = parents[idx];
        // Nodes that the mesh does not have may be in a circle.
        for _ in 0..parents.len() {
            let Some(idx) = parent else { break };
            pose = local_pose(&root.nodes[idx]).after(&pose);
            parent = parents[idx];
        }
        pose
    };
    (0..root.nodes.len()).map(world).collect()
}
