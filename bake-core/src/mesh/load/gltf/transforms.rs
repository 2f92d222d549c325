//! The transforms of nodes: as the file has them, or at a time of an animation.

use glam::{DQuat, DVec3, DVec4};
use gltf_json::Node;
use gltf_json::accessor::Type;
use gltf_json::animation::{Animation, Channel, Interpolation, Property};
use gltf_json::validation::Checked;

use super::super::{AnimationTime, Pose};
use super::{GltfError, GltfFile};

/// The poses of all nodes.
pub(super) struct NodePoses {
    /// The pose of each node in its parent.
    pub locals: Vec<Pose>,
    /// The pose of each node in the scene; `None` for one that is its own ancestor.
    pub globals: Vec<Option<Pose>>,
}

/// A node's transform: scaled, rotated and then translated.
#[derive(Clone, Copy)]
struct Transform {
    translation: DVec3,
    rotation: DQuat,
    scale: DVec3,
}

/// The keys of an animated property: `values` has one a time, or three with splines.
struct Keys {
    times: Vec<f64>,
    values: Vec<DVec4>,
    interpolation: Interpolation,
    is_rotation: bool,
}

impl GltfFile {
    /// Returns the poses of all nodes.
    pub(super) fn node_poses(&self, pose: &AnimationTime<'_>) -> Result<NodePoses, GltfError> {
        let nodes = &self.root.nodes;
        let mut animated: Vec<Option<Transform>> = vec![None; nodes.len()];
        if let Some(name) = pose.animation {
            let animation = self.animation(name)?;
            for channel in &animation.channels {
                self.animate(animation, channel, pose.time, &mut animated)?;
            }
        }
        let locals: Vec<Pose> = animated
            .iter()
            .zip(nodes)
            .map(|(animated, node)| match animated {
                Some(transform) => transform.pose(),
                None => local_pose(node),
            })
            .collect();
        let globals = self.globals(&locals);
        Ok(NodePoses { locals, globals })
    }

    fn globals(&self, locals: &[Pose]) -> Vec<Option<Pose>> {
        let nodes = &self.root.nodes;
        let mut has_parent = vec![false; nodes.len()];
        for child in nodes.iter().flat_map(|node| node.children.iter().flatten()) {
            if let Some(has_parent) = has_parent.get_mut(child.value()) {
                *has_parent = true;
            }
        }
        let mut globals = vec![None; nodes.len()];
        let roots = (0..nodes.len()).filter(|idx| !has_parent[*idx]);
        let mut stack: Vec<_> = roots.map(|idx| (idx, Pose::IDENTITY)).collect();
        while let Some((idx, parent)) = stack.pop() {
            // A node with two parents is an error of the walk.
            if idx >= nodes.len() || globals[idx].is_some() {
                continue;
            }
            let global = parent.after(&locals[idx]);
            globals[idx] = Some(global);
            let children = nodes[idx].children.iter().flatten();
            stack.extend(children.map(|child| (child.value(), global)));
        }
        globals
    }

    /// Returns the animation with this name.
    fn animation(&self, name: &str) -> Result<&Animation, GltfError> {
        let names = self.animation_names();
        match names.iter().position(|known| known == name) {
            Some(idx) => Ok(&self.root.animations[idx]),
            None => Err(GltfError::NoAnimation {
                name: name.to_owned(),
                known: names,
            }),
        }
    }

    fn animation_names(&self) -> Vec<String> {
        let named = |(idx, animation): (usize, &Animation)| match &animation.name {
            Some(name) => name.clone(),
            None => format!("animation {idx}"),
        };
        self.root.animations.iter().enumerate().map(named).collect()
    }

    /// Changes the transform of the node that a channel animates.
    fn animate(
        &self,
        animation: &Animation,
        channel: &Channel,
        time: f64,
        animated: &mut [Option<Transform>],
    ) -> Result<(), GltfError> {
        let idx = channel.target.node.value();
        let node = self.root.nodes.get(idx);
        let node = node.ok_or(GltfError::Missing("node", idx))?;
        if node.matrix.is_some() {
            return Err(GltfError::AnimatedMatrix(idx));
        }
        let Checked::Valid(property) = channel.target.path else {
            return Ok(());
        };
        let keys = self.keys(animation, channel, property)?;
        let transform = animated[idx].get_or_insert_with(|| Transform::of(node));
        match property {
            Property::Translation => transform.translation = keys.at(time).truncate(),
            Property::Scale => transform.scale = keys.at(time).truncate(),
            Property::Rotation => transform.rotation = DQuat::from_vec4(keys.at(time)),
            // Morph targets are not read, of which the reader warns.
            Property::MorphTargetWeights => {}
        }
        Ok(())
    }

    fn keys(
        &self,
        animation: &Animation,
        channel: &Channel,
        property: Property,
    ) -> Result<Keys, GltfError> {
        let sampler = channel.sampler.value();
        let sampler = animation.samplers.get(sampler);
        let sampler = sampler.ok_or(GltfError::Missing("sampler", channel.sampler.value()))?;
        let (input, output) = (sampler.input.value(), sampler.output.value());
        let fault = |accessor, reason: &str| GltfError::Accessor {
            accessor,
            reason: reason.into(),
        };
        let Checked::Valid(interpolation) = sampler.interpolation else {
            return Err(fault(output, "its interpolation is unknown"));
        };
        let times = self.vectors::<1>(input, Type::Scalar, "times")?.concat();
        let increase = times.windows(2).all(|pair| pair[0] < pair[1]);
        if !increase || times.iter().any(|time| !time.is_finite()) {
            return Err(fault(input, "its times do not increase"));
        }
        let values: Vec<DVec4> = match property {
            Property::MorphTargetWeights => vec![],
            Property::Rotation => {
                let values = self.vectors::<4>(output, Type::Vec4, "rotations")?;
                values.into_iter().map(DVec4::from).collect()
            }
            Property::Translation | Property::Scale => {
                let values = self.vectors::<3>(output, Type::Vec3, "translations or scales")?;
                let values = values.into_iter().map(DVec3::from);
                values.map(|value| value.extend(0.0)).collect()
            }
        };
        let per_time = match interpolation {
            Interpolation::CubicSpline => 3,
            Interpolation::Linear | Interpolation::Step => 1,
        };
        if property != Property::MorphTargetWeights && values.len() != per_time * times.len() {
            return Err(fault(output, "it has not a value for each time"));
        }
        Ok(Keys {
            times,
            values,
            interpolation,
            is_rotation: property == Property::Rotation,
        })
    }
}

impl Keys {
    /// Returns the value at a time: the first or the last beyond them.
    fn at(&self, time: f64) -> DVec4 {
        let next = self.times.partition_point(|known| *known <= time);
        let last = self.times.len() - 1;
        if next == 0 || next > last {
            return self.value(next.min(last));
        }
        let (from, to) = (self.value(next - 1), self.value(next));
        let step = self.times[next] - self.times[next - 1];
        let t = (time - self.times[next - 1]) / step;
        match self.interpolation {
            Interpolation::Step => from,
            // The shorter way around; both are of length one up to their rounding.
            Interpolation::Linear if self.is_rotation => {
                let [from, to] = [from, to].map(|q| DQuat::from_vec4(q).normalize());
                from.slerp(to, t).into()
            }
            Interpolation::Linear => from.lerp(to, t),
            Interpolation::CubicSpline => {
                let leaving = step * self.values[3 * (next - 1) + 2];
                let arriving = step * self.values[3 * next];
                let (t2, t3) = (t * t, t * t * t);
                (2.0 * t3 - 3.0 * t2 + 1.0) * from
                    + (t3 - 2.0 * t2 + t) * leaving
                    + (3.0 * t2 - 2.0 * t3) * to
                    + (t3 - t2) * arriving
            }
        }
    }

    /// Returns the value of a key, which stands between its tangents with splines.
    fn value(&self, key: usize) -> DVec4 {
        match self.interpolation {
            Interpolation::CubicSpline => self.values[3 * key + 1],
            Interpolation::Linear | Interpolation::Step => self.values[key],
        }
    }
}

impl Transform {
    /// Returns the transform of a node without a matrix.
    fn of(node: &Node) -> Self {
        let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        let rotation = node.rotation.unwrap_or_default().0.map(f64::from);
        Self {
            translation: vector(node.translation.unwrap_or_default()),
            rotation: DQuat::from_array(rotation),
            scale: vector(node.scale.unwrap_or([1.0; 3])),
        }
    }

    fn pose(&self) -> Pose {
        let DQuat { x, y, z, w } = self.rotation;
        let norm = x * x + y * y + z * z + w * w;
        // Quaternions are written in single precision or less and are not exactly of length one.
        let s = if norm > 0.0 { 2.0 / norm } else { 0.0 };
        let rotation = [
            [
                1.0 - s * (y * y + z * z),
                s * (x * y + w * z),
                s * (x * z - w * y),
            ],
            [
                s * (x * y - w * z),
                1.0 - s * (x * x + z * z),
                s * (y * z + w * x),
            ],
            [
                s * (x * z + w * y),
                s * (y * z - w * x),
                1.0 - s * (x * x + y * y),
            ],
        ];
        Pose {
            linear: std::array::from_fn(|c| rotation[c].map(|v| v * self.scale[c])),
            translation: self.translation.to_array(),
        }
    }
}

/// Returns the pose of a node in its parent, as the file has it.
pub(crate) fn local_pose(node: &Node) -> Pose {
    match node.matrix {
        Some(matrix) => Pose::from_matrix(matrix.map(f64::from)),
        None => Transform::of(node).pose(),
    }
}
