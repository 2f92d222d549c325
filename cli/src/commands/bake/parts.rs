//! The scene file that poses the parts of a model.

use std::fmt::Write;
use std::path::{Component, Path, PathBuf};

use anyhow::bail;
use aogrid_bake_core::TriangleMesh;
use aogrid_bake_core::mesh::{PartMesh, Pose};
use glam::{DMat3, DQuat};

use super::jobs::Job;

/// The heading of a scene file, before the hash of the rest.
const HEADING: &str = "# The parts of a model, as it poses them. `bake --parts` replaces this file unless it\n\
    # was edited, which this hash tells: ";

/// The distance of the camera from the model's center, in half diagonals of its box: from there a
/// vertical field of view of 40 degrees shows all of it.
const CAMERA_DISTANCE: f64 = 3.0;

/// Returns the path by which a scene at `out` names a model, as a TOML string.
///
/// # Errors
///
/// The path is not UTF-8, which TOML files are.
pub(super) fn model_reference(model: &Path, out: &Path) -> anyhow::Result<String> {
    let folder = out.parent().unwrap_or(Path::new(""));
    let file = relative(model, folder)?;
    let Some(file) = file.to_str() else {
        bail!("the name is not UTF-8, and a scene file cannot hold it: rename it");
    };
    Ok(quoted(file))
}

/// Returns a scene with all parts of a model, each with its grid, as the model poses them. `file` is
/// the model's path as a TOML string, `jobs` are those of all parts, `posed` the parts that have a grid.
pub(super) fn scene(
    file: &str,
    whole: &TriangleMesh,
    jobs: &[Job],
    posed: &[(&Job, PartMesh)],
) -> anyhow::Result<String> {
    let mut text = String::new();
    camera(&mut text, whole);
    for (job, part) in posed {
        let name = job.part_name.as_deref().unwrap_or_default();
        if job.part == Some(part.same_as) {
            let grid = job.out.file_name().unwrap_or_default().to_string_lossy();
            write!(
                text,
                "\n[[mesh]]\nname = {name}\nfile = {file}\npart = {name}\ngrid.file = {}\n",
                quoted(&grid),
                name = quoted(name),
            )?;
        }
    }
    for (job, part) in posed {
        let mesh = jobs[part.same_as].part_name.as_deref().unwrap_or_default();
        let name = job.part_name.as_deref().unwrap_or_default();
        write!(text, "\n[[instance]]\nmesh = {}\n", quoted(mesh))?;
        if mesh != name {
            writeln!(text, "name = {}", quoted(name))?;
        }
        text.push_str(&pose_keys(&part.pose));
    }
    Ok(format!("{HEADING}{}\n{text}", short_hash(text.as_bytes())))
}

/// Whether a scene file is as it was written.
pub(super) fn is_unedited(bytes: &[u8]) -> bool {
    let Some(rest) = bytes.strip_prefix(HEADING.as_bytes()) else {
        return false;
    };
    let end = rest.iter().position(|byte| *byte == b'\n');
    end.is_some_and(|end| rest[..end] == *short_hash(&rest[end + 1..]).as_bytes())
}

/// Returns as much of a text's hash as tells whether a person has changed it.
fn short_hash(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex()[..16].to_owned()
}

fn camera(text: &mut String, whole: &TriangleMesh) {
    let bounds = whole.bounds();
    let origin = whole.origin();
    let center: [f64; 3] = std::array::from_fn(|x| origin[x] + f64::from(bounds.center()[x]));
    let half: f64 = bounds
        .half_extents()
        .iter()
        .map(|v| v * v)
        .sum::<f64>()
        .sqrt();
    let position: [f64; 3] =
        std::array::from_fn(|x| center[x] + CAMERA_DISTANCE * half * [0.6, 0.4, 0.7][x]);
    *text +=
        &format!("\n[camera]\nposition = {position:?}\ntarget = {center:?}\nvertical_fov = 40.0\n");
}

/// Returns the keys of an instance that give it this pose, a similarity.
fn pose_keys(pose: &Pose) -> String {
    let mut text = String::new();
    let linear = DMat3::from_cols_array_2d(&pose.linear);
    // A mirror image is a rotation with a negative scale.
    let scale = linear.determinant().cbrt();
    let rotation = DQuat::from_mat3(&(linear * scale.recip())).normalize();
    // A rotation has two quaternions; this one turns by at most half a turn.
    let rotation = if rotation.w < 0.0 {
        -rotation
    } else {
        rotation
    };
    let (axis, angle) = rotation.to_axis_angle();
    if pose.translation != [0.0; 3] {
        text += &format!("translate = {:?}\n", pose.translation);
    }
    if angle != 0.0 {
        // Adding zero turns −0 into +0.
        let (axis, degrees) = (axis.to_array().map(|v| v + 0.0), angle.to_degrees());
        text += &format!("rotate = {{ axis = {axis:?}, degrees = {degrees:?} }}\n");
    }
    if scale != 1.0 {
        text += &format!("scale = {scale:?}\n");
    }
    text
}

/// Returns text as a TOML string.
fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => quoted += &format!("\\u{:04X}", u32::from(c)),
            c => quoted.push(c),
        }
    }
    quoted + "\""
}

/// Returns the path from `folder` to `file`, with `/` between folders; both must exist.
fn relative(file: &Path, folder: &Path) -> std::io::Result<PathBuf> {
    let folder = match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => folder,
    };
    let (file, folder) = (file.canonicalize()?, folder.canonicalize()?);
    let to: Vec<Component<'_>> = file.components().collect();
    let from: Vec<Component<'_>> = folder.components().collect();
    let common = to.iter().zip(&from).take_while(|(a, b)| a == b).count();
    let up = from[common..].iter().map(|_| Component::ParentDir);
    Ok(up.chain(to[common..].iter().copied()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_quoted() {
        assert_eq!(quoted("Screw #6-32"), "\"Screw #6-32\"");
        assert_eq!(quoted("a\"b\\c\n"), "\"a\\\"b\\\\c\\u000A\"");
    }

    #[test]
    fn poses_become_keys() {
        assert_eq!(pose_keys(&Pose::IDENTITY), "");
        let pose = Pose {
            linear: [[0.0, 2.0, 0.0], [-2.0, 0.0, 0.0], [0.0, 0.0, -2.0]],
            translation: [1.0, 0.0, -0.5],
        };
        // A half turn about z less, and mirrored.
        let text = pose_keys(&pose);
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("translate = [1.0, 0.0, -0.5]"));
        let rotate = lines.next().unwrap();
        assert!(
            rotate.starts_with("rotate = { axis = [0.0, 0.0, -1.0], degrees = 90"),
            "{rotate}"
        );
        assert_eq!(lines.next(), Some("scale = -2.0"));
    }

    #[test]
    fn paths_lead_from_the_scene_to_the_model() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        std::fs::create_dir_all(root.join("a/b")).unwrap();
        std::fs::write(root.join("a/m.obj"), "").unwrap();
        let from = |folder: &str| relative(&root.join("a/m.obj"), &root.join(folder)).unwrap();
        assert_eq!(from("a/b"), Path::new("../m.obj"));
        assert_eq!(from("a"), Path::new("m.obj"));
        assert_eq!(from(""), Path::new("a/m.obj"));
    }
}
