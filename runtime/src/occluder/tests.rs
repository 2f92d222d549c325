use super::*;
use aogrid_grid_format::TexelFormat;
use glam::Mat4;

const IDENTITY: [[f32; 4]; 4] = Mat4::IDENTITY.to_cols_array_2d();

/// Returns the facts of a grid of a sphere whose outer cells occlude up to a fraction.
fn facts(encoding: Encoding, border_fraction: f32) -> GridFacts {
    let a = f64::from(border_fraction);
    GridFacts {
        spec: GridSpec::new([8, 9, 10], [1.0, 2.0, 3.0], [0.5, 1.0, 2.0]).unwrap(),
        encoding,
        format: TexelFormat::Unorm8,
        distant_occlusion: [4.0 * a * (1.0 - a); 3],
        flatness: [0.0; 4],
        self_offset: 0.0,
    }
}

fn refusal(instance: Instance) -> InstanceError {
    AogridOccluder::of(&facts(Encoding::Cone, 0.1), &instance).unwrap_err()
}

#[test]
fn invalid_transforms_and_strengths_are_refused() {
    let with = |column: usize, row: usize, value: f32| {
        let mut m = IDENTITY;
        m[column][row] = value;
        refusal(Instance::at(m))
    };
    assert_eq!(with(1, 1, 0.0), InstanceError::Singular);
    assert_eq!(with(3, 0, f32::NAN), InstanceError::NotFinite);
    assert_eq!(with(0, 0, 1e-45), InstanceError::NotFinite);
    assert_eq!(
        with(2, 3, -1.0),
        InstanceError::NotAffine([0.0, 0.0, -1.0, 1.0])
    );
    for strength in [-0.1, 1.5, f32::NAN] {
        let instance = Instance {
            strength,
            ..Instance::at(IDENTITY)
        };
        assert!(matches!(refusal(instance), InstanceError::Strength(_)));
    }
    for far_field in [-0.1, 1.5, f32::NAN] {
        let instance = Instance {
            far_field: Some(far_field),
            ..Instance::at(IDENTITY)
        };
        assert!(matches!(refusal(instance), InstanceError::FarField(_)));
    }
}

/// A model with its origin far from zero is the same as one at zero that is moved there.
#[test]
fn the_center_includes_the_origin() {
    let origin = [64.0, -32.0, 16.0];
    let near = facts(Encoding::Moment, 0.1);
    let far = GridFacts {
        spec: near.spec.with_origin(origin).unwrap(),
        ..near
    };
    let moved = Mat4::from_translation(Vec3::new(64.0, -32.0, 16.0)).to_cols_array_2d();
    let at_zero = AogridOccluder::of(&near, &Instance::at(moved)).unwrap();
    let with_origin = AogridOccluder::of(&far, &Instance::at(IDENTITY)).unwrap();
    assert_eq!(with_origin, at_zero);
}

#[test]
fn unorm8_directions_decode_as_the_format_says() {
    use crate::shading::aogrid_axis;
    let instance = Instance::at(IDENTITY);
    let occluder = AogridOccluder::of(&facts(Encoding::Cone, 0.1), &instance).unwrap();
    for (byte, expected) in [(1_u8, -1.0_f32), (128, 0.0), (255, 1.0)] {
        let t = f32::from(byte) / 255.0;
        let axis = aogrid_axis(&occluder, [t, 128.0 / 255.0, t]);
        // The combined map rounds at the magnitude of 1.
        assert!((axis[0] - expected).abs() < 2e-7 && axis[1].abs() < 2e-7);
        assert_eq!(axis[0], axis[2]);
    }
}

#[test]
fn the_far_field_ends_where_a_facing_receiver_is_occluded_by_the_threshold() {
    let reach = |encoding, border, far_field| {
        let instance = Instance {
            far_field,
            ..Instance::at(IDENTITY)
        };
        let occluder = AogridOccluder::of(&facts(encoding, border), &instance).unwrap();
        let relative = occluder.per_hull[0] / occluder.per_reach[0];
        (relative, occluder.per_hull)
    };
    // sin²α of a tenth of the sphere is 0.36; a sphere's falls with the distance squared.
    let (far, [x, ..]) = reach(Encoding::Moment, 0.1, Some(0.04));
    assert!((far - 3.0).abs() < 1e-6 && (x - 2.0 * 8.0 / 7.0).abs() < 1e-6);
    let default = reach(Encoding::Moment, 0.1, None).0;
    assert!((default - (0.36 / Instance::FAR_FIELD).sqrt()).abs() < 2e-6);
    // A border that occludes less than the threshold still fades out, over a third.
    let (least, _) = reach(Encoding::Cone, 1e-4, Some(0.04));
    assert!((least - 4.0 / 3.0).abs() < 1e-6);
    for (encoding, border, far_field) in [
        (Encoding::Cone, 0.1, None),
        (Encoding::Moment, 0.0, None),
        (Encoding::Moment, 0.1, Some(0.0)),
    ] {
        assert_eq!(reach(encoding, border, far_field), (1.0, [2.0; 3]));
    }
}
