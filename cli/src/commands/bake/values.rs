//! Parsers of the values of options.

use std::ops::RangeInclusive;

use aogrid_grid_format::{FACE_SIZES, MAX_RESOLUTION, MAX_SELF_OFFSET, MIN_RESOLUTION, RAY_COUNTS};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// Returns a parser of the values of `all` by their names; an alias stands for the name behind it.
pub(crate) fn named<T, const N: usize>(
    all: [T; N],
    name: fn(T) -> &'static str,
    aliases: &'static [(&'static str, &'static str)],
) -> impl TypedValueParser<Value = T>
where
    T: Clone + Copy + Send + Sync + 'static,
{
    let full_name = move |text: &str| {
        let alias = aliases.iter().find(|(alias, _)| *alias == text);
        alias.map_or(text.to_owned(), |(_, full)| (*full).to_owned())
    };
    let possible = all.map(|value| {
        let of_value = aliases.iter().filter(|(_, full)| *full == name(value));
        PossibleValue::new(name(value)).aliases(of_value.map(|(alias, _)| *alias))
    });
    PossibleValuesParser::new(possible).map(move |text| {
        let full = full_name(&text);
        let value = all.iter().find(|value| name(**value) == full);
        *value.expect("clap accepts names of values only")
    })
}

/// Parses cell counts: one number for all axes, or three.
pub fn resolution(text: &str) -> Result<[u32; 3], String> {
    let numbers: Vec<u32> = text
        .split(['x', 'X', '×'])
        .map(|n| {
            n.trim()
                .parse()
                .map_err(|_| format!("`{n}` is not a number of cells"))
        })
        .collect::<Result<_, _>>()?;
    let cells = match numbers[..] {
        [n] => [n; 3],
        [x, y, z] => [x, y, z],
        _ => return Err("one number or three are needed, as in 32x24x32".into()),
    };
    match cells
        .iter()
        .find(|n| !(MIN_RESOLUTION..=MAX_RESOLUTION).contains(*n))
    {
        Some(n) => Err(format!("{n} is not in {MIN_RESOLUTION}..={MAX_RESOLUTION}")),
        None => Ok(cells),
    }
}

/// Parses three numbers with commas between.
pub(super) fn number_triple(text: &str) -> Result<[f32; 3], String> {
    let numbers: Vec<f32> = text
        .split(',')
        .map(|n| {
            n.trim()
                .parse()
                .map_err(|_| format!("`{n}` is not a number"))
        })
        .collect::<Result<_, _>>()?;
    <[f32; 3]>::try_from(numbers).map_err(|_| "three numbers are needed, as in 1,2,3".into())
}

pub(super) fn half_extents(text: &str) -> Result<[f32; 3], String> {
    let numbers = number_triple(text)?;
    match numbers.iter().all(|v| *v > 0.0 && v.is_finite()) {
        true => Ok(numbers),
        false => Err("each must be above zero and finite".into()),
    }
}

pub(super) fn sample_offset(text: &str) -> Result<[f32; 3], String> {
    let numbers = number_triple(text)?;
    match numbers.iter().all(|v| v.abs() <= 0.5) {
        true => Ok(numbers),
        false => Err("each must be within ±0.5 of a cell".into()),
    }
}

pub(super) fn self_offset(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(v) if (0.0..=MAX_SELF_OFFSET).contains(&v) => Ok(v),
        _ => Err(format!("it must be a number from 0 to {MAX_SELF_OFFSET}")),
    }
}

pub(super) fn positive(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(v) if v > 0.0 && f32::is_finite(v) => Ok(v),
        _ => Err("it must be a number above zero".into()),
    }
}

/// Parses a share of the sphere.
pub(super) fn share(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(v) if v > 0.0 && v <= 1.0 => Ok(v),
        _ => Err("it must be a share of the sphere, above 0 and at most 1".into()),
    }
}

pub(crate) fn in_range(text: &str, range: RangeInclusive<u32>) -> Result<u32, String> {
    match text.parse() {
        Ok(n) if range.contains(&n) => Ok(n),
        _ => Err(format!("it must be a number in {range:?}")),
    }
}

/// Parses the texels along a side of a cube face.
pub fn face_size(text: &str) -> Result<u32, String> {
    in_range(text, FACE_SIZES)
}

pub(super) fn ray_count(text: &str) -> Result<u32, String> {
    in_range(text, RAY_COUNTS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resolutions_are_one_number_or_three() {
        assert_eq!(resolution("24"), Ok([24; 3]));
        assert_eq!(resolution("32x24x8"), Ok([32, 24, 8]));
        for wrong in [
            "",
            "7",
            "32x32",
            "32x32x32x32",
            "32,32,32",
            "-8",
            "4096",
            "32x",
        ] {
            assert!(resolution(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn triples_are_checked() {
        assert_eq!(half_extents("1, 2.5,3e1"), Ok([1.0, 2.5, 30.0]));
        assert_eq!(sample_offset("-0.5,0,0.25"), Ok([-0.5, 0.0, 0.25]));
        for wrong in ["1,2", "1,2,0", "1,2,-3", "1,2,inf", "1,2,NaN", "a,b,c"] {
            assert!(half_extents(wrong).is_err(), "{wrong}");
        }
        assert!(sample_offset("0,0,0.6").is_err() && sample_offset("0,NaN,0").is_err());
    }
}
