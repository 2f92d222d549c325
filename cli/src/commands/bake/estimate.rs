//! An estimate of the time that a bake takes, before it begins.

use aogrid_bake_core::mesh::MeshReport;
use aogrid_bake_core::{Algorithm, BakeOptions, has_far_field};
use aogrid_baker_cpu::Sweeper;
use aogrid_grid_format::{GridSpec, Sampling};

use super::check;

/// Seconds of an AVX-512 core for a sweep, fitted to the processor times of 17 OBJ models of 32 to
/// 871,414 triangles with the presets `default` and `paper` at 32³ and 64³ cells, and raised by a fifth.
/// docs/models.md says how good the estimates are.
const SWEEP: f64 = 6e-4;
/// The same for a triangle, and for a triangle in each direction.
const SWEEP_TRIANGLE: f64 = 4.2e-7;
const SWEEP_TRIANGLE_DIRECTION: f64 = 1e-10;
/// The same for a cell in each direction.
const SWEEP_CELL_DIRECTION: f64 = 7e-11;
/// The same for each direction, layer of cells, and cell's width of the silhouette: a silhouette's
/// shadow crosses all layers behind it.
const SWEEP_CROSSING: f64 = 3.9e-10;

/// Seconds of a core with AVX2 for a ray at each level of the BVH, and for a triangle in building it;
/// measured with 968 to 871,414 triangles, and raised by a fifth.
const RAY_LEVEL: f64 = 5.4e-9;
const BVH_TRIANGLE: f64 = 1.2e-6;

/// Seconds for a cell in post-processing; for a cell near the surface in the fit, of which a grid has
/// about as many as its faces have; and for a point of the fit.
const POST_CELL: f64 = 6e-8;
const FIT_CELL: f64 = 8e-5;
const FIT_POINT: f64 = 2e-7;

/// Texels along a face of the points of the fit and of the far field, and the number of the latter
/// along an axis.
const POINT_FACE: f64 = 8.0;
const FAR_POINTS: f64 = 12.0;

/// Returns about the seconds that a bake takes on this machine's CPU after the model is loaded.
/// `lattice` has the points of the near-surface fit.
pub(super) fn seconds(
    report: &MeshReport,
    spec: &GridSpec,
    lattice: Option<&GridSpec>,
    options: &BakeOptions,
    requested: Option<Algorithm>,
    is_checked: bool,
) -> f64 {
    let casts = requested == Some(Algorithm::RayCasting)
        || options.max_distance.is_some()
        || matches!(options.sampling, Sampling::MonteCarlo { .. });
    let triangles = report.triangles as f64;
    let rays = |rays: f64| {
        let levels = (triangles + 2.0).log2();
        BVH_TRIANGLE * triangles + RAY_LEVEL * ray_factor() * rays * levels
    };
    let visibility = |cells: f64, box_size: f64, directions: f64| match casts {
        true => rays(cells * directions),
        false => sweep(report, cells, box_size, directions),
    };
    let (directions, point_directions) = match options.sampling {
        Sampling::CubeFaces { size } => (6.0 * f64::from(size).powi(2), 6.0 * POINT_FACE.powi(2)),
        Sampling::MonteCarlo { count, .. } => (f64::from(count), f64::from(count)),
    };
    let cells = spec.cell_count() as f64;
    let mut of_cores = visibility(cells, box_size(spec), directions);
    let mut alone = POST_CELL * cells;
    if let Some(lattice) = lattice {
        let points = lattice.cell_count() as f64;
        of_cores += visibility(points, box_size(lattice), point_directions);
        alone += FIT_CELL * cells.powf(2.0 / 3.0) + FIT_POINT * points;
    }
    if has_far_field(options) {
        let box_size = 2.0 * box_size(spec);
        of_cores += visibility(FAR_POINTS.powi(3), box_size, point_directions);
    }
    if is_checked {
        of_cores += rays(check::RAYS);
    }
    of_cores / rayon::current_num_threads() as f64 + alone
}

/// Returns the seconds of a core for a sweep of cells in a box.
fn sweep(report: &MeshReport, cells: f64, box_size: f64, directions: f64) -> f64 {
    let triangles = report.triangles as f64;
    let layers = cells.cbrt();
    let crossings = layers * report.silhouette_length * layers / box_size;
    let of_direction = SWEEP_CELL_DIRECTION * cells
        + SWEEP_TRIANGLE_DIRECTION * triangles
        + SWEEP_CROSSING * crossings;
    SWEEP + SWEEP_TRIANGLE * triangles + directions * of_direction * level_factor()
}

/// Returns the geometric mean of a box's extents.
fn box_size(spec: &GridSpec) -> f64 {
    let extents = spec.half_extents().map(|e| 2.0 * f64::from(e));
    extents.iter().product::<f64>().cbrt()
}

/// Returns the time of the sweep at this machine's SIMD level, relative to AVX-512: measured with
/// 968 and 69,451 triangles.
fn level_factor() -> f64 {
    match Sweeper::simd_levels()[0] {
        "avx512" => 1.0,
        "avx2" => 1.2,
        _ => 3.2,
    }
}

/// Returns the time of a ray at this machine's SIMD level, relative to AVX2 (docs/cpu-bake.md).
fn ray_factor() -> f64 {
    match Sweeper::simd_levels()[0] {
        "avx512" | "avx2" => 1.0,
        _ => 1.8,
    }
}

/// Returns a duration as a person would say it.
pub(super) fn shown(seconds: f64) -> String {
    match seconds {
        s if s < 0.1 => "less than 0.1 s".into(),
        s if s < 9.5 => format!("about {s:.1} s"),
        s if s < 90.0 => format!("about {s:.0} s"),
        s if s < 5400.0 => format!("about {:.0} min", s / 60.0),
        s => format!("about {:.0} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aogrid_bake_core::models::Model;
    use aogrid_bake_core::{Placement, Preset, near_surface_lattice};

    /// Returns the estimate for a model by a preset, on one thread.
    fn estimate(
        model: Model,
        (preset, n, face): (Preset, u32, u32),
        requested: Option<Algorithm>,
        is_checked: bool,
    ) -> f64 {
        let mesh = model.mesh(None).unwrap();
        let placement = Placement {
            resolution: [n; 3],
            ..preset.placement()
        };
        let spec = placement.place(&mesh.bounds()).unwrap();
        let options = BakeOptions {
            sampling: Sampling::CubeFaces { size: face },
            ..preset.options()
        };
        let lattice = near_surface_lattice(&spec, &mesh).unwrap();
        let lattice = options.fit.then_some(&lattice);
        let report = MeshReport::new(&mesh);
        let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        one_thread
            .unwrap()
            .install(|| seconds(&report, &spec, lattice, &options, requested, is_checked))
    }

    /// More of anything takes longer, rays longer than the sweep; a usual bake takes less than a second
    /// on any machine, and one of a thousand times the work does not.
    #[test]
    fn more_work_takes_longer() {
        let paper = |n, face, requested, is_checked| {
            estimate(
                Model::SpaceShip,
                (Preset::Paper, n, face),
                requested,
                is_checked,
            )
        };
        let usual = paper(32, 16, None, false);
        assert!((1e-3..1.0).contains(&usual), "{usual}");
        for more in [
            paper(64, 16, None, false),
            paper(32, 32, None, false),
            paper(32, 16, Some(Algorithm::RayCasting), false),
            paper(32, 16, None, true),
            estimate(Model::SpaceShip, (Preset::Default, 32, 16), None, false),
        ] {
            assert!(more > 1.5 * usual, "{more} {usual}");
        }
        assert!(paper(256, 32, None, false) > 100.0 * usual);
    }

    /// A silhouette twice as long, in a box of the same size, costs as much as the crossings of one;
    /// a mesh of any unit takes as long.
    #[test]
    fn long_silhouettes_take_longer() {
        let mut report = MeshReport::new(&Model::Table.mesh(None).unwrap());
        let times = [0.0, 1.0, 2.0].map(|length| {
            report.silhouette_length = 1e3 * length;
            sweep(&report, 32_768.0, 1.0, 1536.0)
        });
        let [once, twice] = [times[1] - times[0], times[2] - times[0]];
        assert!(once > 10.0 * times[0], "{times:?}");
        assert!((twice - 2.0 * once).abs() < 1e-9 * twice, "{times:?}");
        assert_eq!(sweep(&report, 32_768.0, 1.0, 1536.0), times[2]);
        report.silhouette_length *= 64.0;
        assert_eq!(sweep(&report, 32_768.0, 64.0, 1536.0), times[2]);
    }

    #[test]
    fn durations_are_rounded() {
        let texts = [0.01, 0.25, 20.0, 600.0, 9e4].map(shown);
        let expected = [
            "less than 0.1 s",
            "about 0.2 s",
            "about 20 s",
            "about 10 min",
            "about 25 h",
        ];
        assert_eq!(texts, expected);
    }
}
