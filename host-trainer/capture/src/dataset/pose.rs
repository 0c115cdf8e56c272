//! Camera poses of captures: OpenGL camera-to-world matrices, checked and turned into world-to-camera in OpenCV axes.

use glam::{DMat3, DVec3};

/// Largest deviation of a rotation's columns from orthonormal, as max |RᵀR − I|.
///
/// Poses written with three decimals deviate by 1e-3; a deviation of 1e-2 already moves an 800 px image by pixels.
const MAX_DEVIATION: f64 = 2e-3;

/// Why a matrix is no camera pose.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum PoseFault {
    /// Not 4 × 4 (or 3 × 4).
    #[error("has {rows} rows, the shortest of {columns} numbers, needed: 4 rows of 4; export the pose again")]
    Shape { rows: usize, columns: usize },
    /// A number is NaN or infinite.
    #[error("has {found} in row {row}, column {column}, needed: finite numbers; take the frame out or export it again")]
    NotFinite { row: usize, column: usize, found: f64 },
    /// The last row is not 0 0 0 1.
    #[error("has the last row {found:?}, needed: [0, 0, 0, 1]; the matrix may be transposed")]
    LastRow { found: [f64; 4] },
    /// The upper left 3 × 3 has no inverse.
    #[error("is singular: its 3×3 part has determinant {determinant:e}, needed: 1; export the pose again")]
    Singular { determinant: f64 },
    /// The columns are orthogonal but not of length 1.
    #[error("scales by {scale:.6}, needed: a rotation without scale; apply the camera's scale before exporting")]
    Scaled { scale: f64 },
    /// The columns are not orthogonal, or of different lengths.
    #[error(
        "is no rotation: its columns deviate from orthonormal by {deviation:.6}, needed: at most {MAX_DEVIATION}; \
         remove shear and scale from the camera before exporting"
    )]
    NotOrthonormal { deviation: f64 },
    /// The determinant is −1: left and right are exchanged.
    #[error("is a reflection: its determinant is {determinant:.6}, needed: +1; negate one axis of the camera")]
    Reflection { determinant: f64 },
}

/// World-to-camera rotation and translation in OpenCV axes of an OpenGL camera-to-world matrix.
///
/// OpenGL cameras look along −z with y up, OpenCV cameras along +z with y down, so the second and third column are
/// negated: `R = (C·diag(1, −1, −1))ᵀ`, `t = −R·c` with `C`, `c` the matrix's rotation and last column.
/// `C` is replaced by the nearest rotation first, because files carry single-precision rounding.
///
/// * `rows`: 4 rows of 4 numbers, or the first 3 of them.
///
/// # Errors
/// [`PoseFault`] says which property of a rigid motion the matrix lacks, and by how much.
pub(super) fn world_to_camera(rows: &[Vec<f64>]) -> Result<(DMat3, DVec3), PoseFault> {
    let columns = rows.iter().map(Vec::len).min().unwrap_or(0);
    let (matrix, last): (&[Vec<f64>], _) = match rows {
        [upper @ .., last] if upper.len() == 3 => (upper, Some(last)),
        _ => (rows, None),
    };
    let [row0, row1, row2] = matrix else {
        return Err(PoseFault::Shape { rows: rows.len(), columns });
    };
    if rows.iter().any(|row| row.len() != 4) {
        return Err(PoseFault::Shape { rows: rows.len(), columns });
    }
    for (row, numbers) in rows.iter().enumerate() {
        if let Some(column) = numbers.iter().position(|number| !number.is_finite()) {
            return Err(PoseFault::NotFinite { row, column, found: numbers[column] });
        }
    }
    if let Some(&[a, b, c, d]) = last.map(Vec::as_slice)
        && [a, b, c, d - 1.0].iter().any(|deviation| deviation.abs() > 1e-6)
    {
        return Err(PoseFault::LastRow { found: [a, b, c, d] });
    }
    let column = |j: usize| DVec3::new(row0[j], row1[j], row2[j]);
    let rotation = checked_rotation(DMat3::from_cols(column(0), column(1), column(2)))?;
    let to_opencv = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let world_to_cam = (rotation * to_opencv).transpose();
    Ok((world_to_cam, -(world_to_cam * column(3))))
}

/// The rotation nearest to `matrix`, if that is near.
fn checked_rotation(matrix: DMat3) -> Result<DMat3, PoseFault> {
    let determinant = matrix.determinant();
    let gram = matrix.transpose() * matrix;
    let largest = |m: DMat3| m.to_cols_array().iter().fold(0.0_f64, |max, x| max.max(x.abs()));
    // Relative to the columns' own lengths, so that a tiny but well-formed scale is called a scale.
    let volume = matrix.x_axis.length() * matrix.y_axis.length() * matrix.z_axis.length();
    if volume == 0.0 || !volume.is_finite() || determinant.abs() < 1e-6 * volume {
        return Err(PoseFault::Singular { determinant });
    }
    let deviation = largest(gram - DMat3::IDENTITY);
    if deviation > MAX_DEVIATION {
        let scale = determinant.abs().cbrt();
        let scaled = largest(gram * (1.0 / (scale * scale)) - DMat3::IDENTITY);
        return Err(if scaled <= MAX_DEVIATION {
            PoseFault::Scaled { scale }
        } else {
            PoseFault::NotOrthonormal { deviation }
        });
    }
    if determinant < 0.0 {
        return Err(PoseFault::Reflection { determinant });
    }
    // Newton's iteration for the polar factor, R ← (R + R⁻ᵀ)/2; it squares the deviation, so three steps from 2e-3
    // reach rounding.
    Ok((0..3).fold(matrix, |r, _| (r + r.inverse().transpose()) * 0.5))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(rotation: DMat3, centre: DVec3) -> Vec<Vec<f64>> {
        let r = rotation.transpose().to_cols_array_2d();
        let mut rows: Vec<Vec<f64>> =
            r.iter().zip(centre.to_array()).map(|(row, c)| vec![row[0], row[1], row[2], c]).collect();
        rows.push(vec![0.0, 0.0, 0.0, 1.0]);
        rows
    }

    fn some_rotation() -> DMat3 {
        DMat3::from_rotation_z(0.3) * DMat3::from_rotation_x(1.1)
    }

    #[test]
    fn an_opengl_camera_at_rest_looks_along_minus_z_with_y_up() {
        let (r, t) = world_to_camera(&rows(DMat3::IDENTITY, DVec3::new(0.0, 0.0, 4.0))).expect("a pose");
        let cam = |p: DVec3| r * p + t;
        assert_eq!(cam(DVec3::ZERO), DVec3::new(0.0, 0.0, 4.0), "the origin is 4 in front");
        assert_eq!(cam(DVec3::new(0.0, 1.0, 0.0)).y, -1.0, "up in the world is up in the image");
        assert_eq!(cam(DVec3::new(1.0, 0.0, 0.0)).x, 1.0, "right stays right");
    }

    #[test]
    fn the_centre_survives_and_rounding_is_polished_away() {
        let centre = DVec3::new(1.0, -2.0, 3.0);
        let rounded = some_rotation().to_cols_array().map(|x| (x * 1e4).round() / 1e4);
        let (r, t) = world_to_camera(&rows(DMat3::from_cols_array(&rounded), centre)).expect("a pose");
        assert!((-(r.transpose() * t) - centre).length() < 1e-12, "centre");
        assert!((r * r.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-14), "orthonormal");
        assert_eq!(
            world_to_camera(&rows(some_rotation(), centre)[..3]),
            world_to_camera(&rows(some_rotation(), centre))
        );
    }

    #[test]
    fn every_fault_is_told_apart() {
        let fault = |m: &[Vec<f64>]| world_to_camera(m).expect_err("no pose");
        let good = rows(some_rotation(), DVec3::ONE);
        let with = |row: usize, column: usize, x: f64| {
            let mut m = good.clone();
            m[row][column] = x;
            m
        };
        assert_eq!(fault(&good[..2]), PoseFault::Shape { rows: 2, columns: 4 });
        assert_eq!(fault(&[]), PoseFault::Shape { rows: 0, columns: 0 });
        assert!(matches!(fault(&with(1, 2, f64::NAN)), PoseFault::NotFinite { row: 1, column: 2, .. }));
        assert!(matches!(fault(&with(3, 0, 2.0)), PoseFault::LastRow { .. }));
        assert!(matches!(fault(&rows(DMat3::ZERO, DVec3::ONE)), PoseFault::Singular { .. }));
        assert!(matches!(fault(&rows(some_rotation() * -1.0, DVec3::ONE)), PoseFault::Reflection { .. }));
        let PoseFault::Scaled { scale } = fault(&rows(some_rotation() * 0.01, DVec3::ONE)) else {
            panic!("a scaled rotation must be called one")
        };
        assert!((scale - 0.01).abs() < 1e-12, "scale {scale}");
        let sheared = some_rotation() * DMat3::from_cols(DVec3::X, DVec3::new(0.1, 1.0, 0.0), DVec3::Z);
        assert!(matches!(fault(&rows(sheared, DVec3::ONE)), PoseFault::NotOrthonormal { .. }));
    }
}
