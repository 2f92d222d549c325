//! The nodes of a glTF scene: parts in their own frames, and the whole that they pose.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use gltf_json::{Node, Scene};

use super::super::parts::unique_names;
use super::super::{AnimationTime, Parsed, PartMesh, Pose, PosedPrimitive, single_rounding};
use super::shapes::{Notes, Shape};
use super::transforms::{NodePoses, local_pose};
use super::{GltfError, GltfFile};
use crate::mesh::{MeshError, Part, TriangleMesh};

/// Maximum number of triangles of all nodes: a small file may have many nodes with one large mesh.
const MAX_TRIANGLES: usize = 1 << 27;

/// Reads the scene that a file shows first: in bind pose, or as an animation and skins pose it.
pub(super) fn parse(
    file: &GltfFile,
    pose: Option<&AnimationTime<'_>>,
) -> Result<Parsed, GltfError> {
    let poses = pose.map(|pose| file.node_poses(pose)).transpose()?;
    let mut walk = Walk::new(file, poses);
    let roots = walk.roots()?;
    for root in roots {
        walk.tree(root)?;
    }
    walk.finish()
}

/// A walk over the nodes, with what they have posed so far.
struct Walk<'a> {
    file: &'a GltfFile,
    /// The poses of nodes by an animation; `None` for bind pose.
    poses: Option<NodePoses>,
    visited: Vec<bool>,
    shapes: HashMap<usize, Shape>,
    /// The own mesh of each glTF mesh, and the first part that has it.
    own: HashMap<usize, (Result<Arc<TriangleMesh>, MeshError>, usize)>,
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    parts: Vec<Part>,
    posed: Vec<Result<PartMesh, MeshError>>,
    primitives: Vec<PosedPrimitive>,
    notes: Notes,
    warnings: Vec<String>,
    skinned: usize,
    hidden: usize,
    instanced: usize,
    /// The largest scale of a pose.
    largest_scale: f64,
}

impl<'a> Walk<'a> {
    fn new(file: &'a GltfFile, poses: Option<NodePoses>) -> Self {
        Self {
            file,
            poses,
            visited: vec![false; file.root.nodes.len()],
            shapes: HashMap::new(),
            own: HashMap::new(),
            positions: vec![],
            triangles: vec![],
            parts: vec![],
            posed: vec![],
            primitives: vec![],
            notes: Notes::default(),
            warnings: vec![],
            skinned: 0,
            hidden: 0,
            instanced: 0,
            largest_scale: 0.0,
        }
    }

    /// Returns the root nodes of the default scene, or of the whole file if it has no scenes. Nodes
    /// that have a parent come last.
    fn roots(&mut self) -> Result<Vec<usize>, GltfError> {
        let root = &self.file.root;
        let mut has_parent = vec![false; root.nodes.len()];
        let children = root
            .nodes
            .iter()
            .flat_map(|node| node.children.iter().flatten());
        for child in children {
            if let Some(has_parent) = has_parent.get_mut(child.value()) {
                *has_parent = true;
            }
        }
        let chosen = root.scene.map_or(0, |scene| scene.value());
        let scene: &Scene = match root.scenes.get(chosen) {
            Some(scene) => scene,
            None if root.scene.is_some() => return Err(GltfError::Missing("scene", chosen)),
            None => {
                let roots = (0..root.nodes.len()).filter(|idx| !has_parent[*idx]);
                return Ok(roots.collect());
            }
        };
        if root.scenes.len() > 1 {
            let name = scene.name.as_deref().unwrap_or("without a name");
            self.warnings.push(format!(
                "it has {} scenes: scene {chosen} ({name}) is read",
                root.scenes.len()
            ));
        }
        let mut roots: Vec<usize> = scene.nodes.iter().map(|idx| idx.value()).collect();
        if let Some(&idx) = roots.iter().find(|idx| **idx >= has_parent.len()) {
            return Err(GltfError::Missing("node", idx));
        }
        roots.sort_by_key(|idx| has_parent[*idx]);
        Ok(roots)
    }

    /// Poses a root node and all below it.
    fn tree(&mut self, root: usize) -> Result<(), GltfError> {
        if self.visited[root] {
            self.warnings.push(format!(
                "node {root} is in its scene and below another node: it is read once"
            ));
            return Ok(());
        }
        // An explicit stack: nodes may be nested deeper than the thread's stack.
        let mut stack = vec![(root, Pose::IDENTITY)];
        while let Some((idx, parent)) = stack.pop() {
            let node = self.file.root.nodes.get(idx);
            let node = node.ok_or(GltfError::Missing("node", idx))?;
            if std::mem::replace(&mut self.visited[idx], true) {
                return Err(GltfError::NotATree(idx));
            }
            if is_hidden(node) {
                self.hidden += 1;
                continue;
            }
            let pose = parent.after(&match &self.poses {
                Some(poses) => poses.locals[idx],
                None => local_pose(node),
            });
            if let Some(mesh) = node.mesh {
                self.part(idx, node, mesh.value(), pose)?;
            }
            // The first child is to come next.
            let children = node.children.iter().flatten().rev();
            stack.extend(children.map(|child| (child.value(), pose)));
        }
        Ok(())
    }

    /// Adds a node's mesh as a part.
    fn part(
        &mut self,
        idx: usize,
        node: &Node,
        mesh: usize,
        mut pose: Pose,
    ) -> Result<(), GltfError> {
        if !self.shapes.contains_key(&mesh) {
            let shape = self.file.shape(mesh, &mut self.notes)?;
            self.shapes.insert(mesh, shape);
        }
        let shape = &self.shapes[&mesh];
        if shape.triangles.is_empty() {
            return Ok(());
        }
        if self.triangles.len() + shape.triangles.len() > MAX_TRIANGLES
            || u32::try_from(self.positions.len() + shape.positions.len()).is_err()
        {
            return Err(GltfError::TooMany(MAX_TRIANGLES));
        }
        if node.skin.is_some() {
            // Joints pose a skinned mesh, not its node (glTF 2.0, 3.7.3.3).
            self.skinned += 1;
            pose = Pose::IDENTITY;
        }
        self.largest_scale = pose.largest_scale().max(self.largest_scale);
        self.instanced += usize::from(has_extension(node, "EXT_mesh_gpu_instancing"));
        let first = self.positions.len() as u32;
        let start = self.triangles.len();
        // A pose of its own would be no pose of a skinned primitive's vertices.
        let primitives = shape.primitives.iter().filter(|_| self.poses.is_none());
        let posed_primitive = |(primitive, range): &(usize, Range<usize>)| PosedPrimitive {
            node: idx,
            mesh,
            primitive: *primitive,
            vertices: range.start + first as usize..range.end + first as usize,
            pose,
        };
        self.primitives.extend(primitives.map(posed_primitive));
        let (positions, triangles) = match (&self.poses, node.skin) {
            (Some(poses), Some(skin)) => self.file.skinned(mesh, shape, skin.value(), poses)?,
            _ => posed(shape, &pose),
        };
        self.positions.extend_from_slice(&positions);
        self.triangles
            .extend(triangles.iter().map(|t| t.map(|v| v + first)));
        let mesh_name = self.file.root.meshes[mesh].name.as_ref();
        let name = node.name.as_ref().or(mesh_name);
        self.parts.push(Part {
            name: name.map_or_else(|| format!("node {idx}"), Clone::clone),
            triangles: start..self.triangles.len(),
        });
        let own = match self.poses.is_some() && node.skin.is_some() {
            true => self.skinned_mesh(&positions, triangles),
            false => self.own_mesh(mesh, pose),
        };
        self.posed.push(own);
        Ok(())
    }

    /// Returns the part that is next, if joints pose it: no other part has its mesh.
    fn skinned_mesh(
        &self,
        positions: &[[f64; 3]],
        triangles: Vec<[u32; 3]>,
    ) -> Result<PartMesh, MeshError> {
        Ok(PartMesh {
            same_as: self.posed.len(),
            ..PartMesh::whole(own_mesh(positions, triangles)?)
        })
    }

    /// Returns the part that is next: its mesh in its own frame. A grid can be posed by rotation and
    /// uniform scale alone, so that a part with another pose has its linear part in the mesh.
    fn own_mesh(&mut self, mesh: usize, pose: Pose) -> Result<PartMesh, MeshError> {
        let idx = self.posed.len();
        let shape = &self.shapes[&mesh];
        if !pose.is_similarity() {
            let [linear, translation] = pose.split();
            return Ok(PartMesh {
                mesh: Arc::new(mesh_of(shape, &linear)?),
                pose: translation,
                same_as: idx,
            });
        }
        let (own, same_as) = self
            .own
            .entry(mesh)
            .or_insert_with(|| (mesh_of(shape, &Pose::IDENTITY).map(Arc::new), idx));
        Ok(PartMesh {
            mesh: own.clone()?,
            pose,
            same_as: *same_as,
        })
    }

    fn finish(mut self) -> Result<Parsed, GltfError> {
        unique_names(&mut self.parts);
        let mesh = TriangleMesh::from_f64(&self.positions, self.triangles, self.parts)?;
        let mut warnings = self.warnings;
        warnings.extend(self.notes.warnings());
        let unposed = match self.poses {
            Some(_) => 0,
            None => self.skinned,
        };
        for (count, text) in [
            (unposed, "parts are skinned: they are read in bind pose"),
            (
                self.hidden,
                "nodes are hidden: they and what is below them are left out",
            ),
            (
                self.instanced,
                "parts have instances by EXT_mesh_gpu_instancing, which is not supported: one of \
                 each is read",
            ),
        ] {
            if count > 0 {
                warnings.push(format!("{count} {text}"));
            }
        }
        // The translation of a node moves a mesh as a whole, and rounds nothing of its shape.
        let rounding = self
            .shapes
            .values()
            .map(|shape| single_rounding(&shape.positions));
        Ok(Parsed {
            mesh,
            posed: self.posed,
            primitives: self.primitives,
            warnings,
            rounding: rounding.fold(0.0, f64::max) * self.largest_scale,
        })
    }
}

/// Returns a shape's positions and triangles in a pose. A mirror image is turned, so that its faces
/// point outward as before.
fn posed(shape: &Shape, pose: &Pose) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let is_mirrored = pose.determinant() < 0.0;
    let turned = move |[a, b, c]: [u32; 3]| match is_mirrored {
        true => [b, a, c],
        false => [a, b, c],
    };
    let positions = shape.positions.iter().map(|p| pose.point(*p));
    let triangles = shape.triangles.iter().copied().map(turned);
    (positions.collect(), triangles.collect())
}

fn mesh_of(shape: &Shape, pose: &Pose) -> Result<TriangleMesh, MeshError> {
    let (positions, triangles) = posed(shape, pose);
    own_mesh(&positions, triangles)
}

/// Returns the mesh of one part.
fn own_mesh(positions: &[[f64; 3]], triangles: Vec<[u32; 3]>) -> Result<TriangleMesh, MeshError> {
    let whole = Part {
        name: super::super::UNNAMED.to_owned(),
        triangles: 0..triangles.len(),
    };
    TriangleMesh::from_f64(positions, triangles, vec![whole])
}

fn has_extension(node: &Node, name: &str) -> bool {
    let extensions = node.extensions.as_ref();
    extensions.is_some_and(|extensions| extensions.others.contains_key(name))
}

fn is_hidden(node: &Node) -> bool {
    let extensions = node.extensions.as_ref();
    let visibility = extensions.and_then(|all| all.others.get("KHR_node_visibility"));
    visibility.is_some_and(|value| value["visible"] == false)
}
