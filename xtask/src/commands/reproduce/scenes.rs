//! The scenes of the report: the project's own with other grids, and some more.

/// The grids of the papers: cones with the later paper's boundary treatment.
const PAPER: &str = "{ preset = \"paper\" }";
/// The papers' grids without boundary treatment, and with the first paper's.
const UNTREATED: &str = "{ preset = \"paper\", boundary = \"none\" }";
const RESCALED: &str = "{ preset = \"paper\", boundary = \"rr\" }";
const DEFAULT: &str = "{ preset = \"default\" }";

const BOX: &str = include_str!("../../../../scenes/box-on-floor.toml");
const TABLE: &str = include_str!("../../../../scenes/table.toml");
const SPHERES: &str = include_str!("../../../../scenes/spheres-and-boxes.toml");
const ROBOT: &str = include_str!("../../../../scenes/robot.toml");
const OVERLAPPING: &str = include_str!("../../../../scenes/overlapping-boxes.toml");
const ROOM: &str = include_str!("../../../../scenes/room.toml");
const AREA_LIGHT: &str = include_str!("../../../../scenes/area-light.toml");
const OCCLUDERS: &str = include_str!("../../../../scenes/occluders.toml");
const SURFACE: &str = include_str!("../../../../scenes/surface.toml");
const VOLUMES: &str = include_str!("../../../../scenes/volumes.toml");

/// The triangles of occluders and of surroundings of growing complexity.
pub(super) const COMPLEXITIES: [u32; 4] = [400, 4_700, 16_300, 100_000];

/// Returns the scenes' file names and texts.
pub(super) fn all() -> Vec<(String, String)> {
    let fixed = [
        ("box-untreated", with_grid(BOX, UNTREATED)),
        ("box-rescaled", with_grid(BOX, RESCALED)),
        ("box-paper", with_grid(BOX, PAPER)),
        ("box-default", with_grid(BOX, DEFAULT)),
        ("table-paper", with_grid(TABLE, PAPER)),
        ("table-default", with_grid(TABLE, DEFAULT)),
        ("spheres-paper", with_grid(SPHERES, PAPER)),
        ("spheres-default", with_grid(SPHERES, DEFAULT)),
        ("robot-untreated", with_grid(ROBOT, UNTREATED)),
        ("robot-default", with_grid(ROBOT, DEFAULT)),
        ("overlapping-boxes", OVERLAPPING.to_owned()),
        ("room", ROOM.to_owned()),
        ("area-light", AREA_LIGHT.to_owned()),
        ("occluders", OCCLUDERS.to_owned()),
        ("volumes", VOLUMES.to_owned()),
        ("surface", SURFACE.to_owned()),
        ("polygon", polygon()),
    ];
    let fixed = fixed.map(|(name, text)| (name.to_owned(), text));
    let occluders = COMPLEXITIES.map(|n| (format!("occluder-{n}"), complex_occluder(n)));
    let surroundings = COMPLEXITIES.map(|n| (format!("surroundings-{n}"), surroundings(n)));
    fixed
        .into_iter()
        .chain(occluders)
        .chain(surroundings)
        .collect()
}

/// Gives every procedural model without a grid of its own this one.
fn with_grid(text: &str, grid: &str) -> String {
    let lines = text
        .lines()
        .map(|line| match line.starts_with("sample = ") {
            true => format!("{line}\ngrid = {grid}\n"),
            false => format!("{line}\n"),
        });
    lines.collect()
}

const VIEW: &str = "[camera]\nposition = [2.2, 2.0, 3.0]\ntarget = [0, 0.4, 0]\nvertical_fov = 36\n\
    [[mesh]]\nname = \"floor\"\nrectangle = [8, 8]\n[[instance]]\nmesh = \"floor\"\n";

/// A ring of `triangles` triangles that occludes a floor.
fn complex_occluder(triangles: u32) -> String {
    format!(
        "{VIEW}[[mesh]]\nname = \"ring\"\nsample = \"torus\"\ntriangles = {triangles}\n\
         grid = {{ preset = \"paper\" }}\n[[instance]]\nmesh = \"ring\"\n"
    )
}

/// A box that occludes a ring of `triangles` triangles.
fn surroundings(triangles: u32) -> String {
    format!(
        "{VIEW}[[mesh]]\nname = \"box\"\nsample = \"box\"\ngrid = {{ preset = \"paper\" }}\n\
         [[mesh]]\nname = \"ring\"\nsample = \"torus\"\ntriangles = {triangles}\n\
         [[instance]]\nmesh = \"box\"\n\
         [[instance]]\nmesh = \"ring\"\ncasts = false\nscale = 1.6\n"
    )
}

/// A box beside a floor whose volumes have no fall-off and no end.
fn polygon() -> String {
    let text = BOX.replace(
        "[[mesh]]\nname = \"floor\"",
        "[volumes]\nextent = 100\nweight = \"none\"\n\n[[mesh]]\nname = \"floor\"",
    );
    // The list of receivers is not needed for a picture.
    let end = text.find("[receivers]").unwrap_or(text.len());
    text[..end].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grids_reach_the_scenes() {
        let scenes = all();
        let text = |name: &str| &scenes.iter().find(|(n, _)| n == name).unwrap().1;
        assert!(text("box-rescaled").contains("\"rr\""));
        assert_eq!(text("spheres-paper").matches("\"paper\"").count(), 2);
        assert!(text("polygon").contains("weight = \"none\""));
        assert!(!text("polygon").contains("[receivers]"));
    }
}
