//! Gaussians moved by a node: centres, ellipsoids and colours.
//!
//! Takes a Gaussian in the space of its mesh, gives it in the world. A node that only turns, scales evenly and shifts keeps the
//! axes of an ellipsoid; after any other one they are the eigenvectors of its covariance M C C' M'. Harmonics turn with the
//! node: coefficient j becomes the integral of the turned function times harmonic j, which a rule of 32 directions gives
//! exactly, since the product is a polynomial of degree 6 at most.

use resample_core::narrow::single;
use std::f64::consts::TAU;

use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};

use crate::gaussians::basis;
use crate::gaussians::formats::sink::Stored;
use crate::input::Fault;

/// Harmonics beyond the constant.
const HARMONICS: usize = 15;

/// How far the columns of a node may be from those of a turn with one scale, as a part of it. Files have their rotations in f32.
const EVEN_WITHIN: f64 = 1e-5;

/// Nodes and weights of Gauss and Legendre's rule of 4, which is exact for polynomials up to degree 7.
const COSINES: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
];

/// Directions around the axis, which are exact for degrees below this.
const AROUND: usize = 8;

/// The change of ellipsoids by a node.
enum Shape {
    /// A turn and one scale.
    Even(DQuat, f64),
    Uneven(DMat3),
}

/// From each harmonic to all after a turn.
type Turn = [[f32; HARMONICS]; HARMONICS];

/// The change of Gaussians by a node.
pub(super) struct Placement {
    world_from_mesh: DAffine3,
    shape: Shape,
    turn: Option<Box<Turn>>,
}

impl Placement {
    /// Refuses a transform that flattens space, or is not finite.
    pub(super) fn new(world_from_mesh: DAffine3) -> Result<Self, Fault> {
        let matrix = world_from_mesh.matrix3;
        let determinant = matrix.determinant();
        let is_sound = world_from_mesh.is_finite() && determinant.is_finite();
        if !is_sound || determinant == 0.0 {
            return Err(Fault::Invalid(
                "the node of its Gaussians has a transform that is not finite or flattens them: expected a turn, a scale and a shift"
                    .to_owned(),
            ));
        }
        let scale = determinant.abs().cbrt();
        let square = matrix.transpose() * matrix * (scale * scale).recip();
        let is_even = determinant > 0.0 && square.abs_diff_eq(DMat3::IDENTITY, EVEN_WITHIN);
        let axes = orthonormal(matrix);
        let shape = match is_even {
            true => Shape::Even(DQuat::from_mat3(&axes), scale),
            false => Shape::Uneven(matrix),
        };
        let is_turned = !axes.abs_diff_eq(DMat3::IDENTITY, EVEN_WITHIN);
        Ok(Self {
            world_from_mesh,
            shape,
            turn: is_turned.then(|| Box::new(turn_of(axes))),
        })
    }

    /// A Gaussian and its coefficients in the world.
    pub(super) fn apply(&self, stored: &mut Stored, coefficients: &mut [f32]) {
        stored.centre = self.world_from_mesh.transform_point3(stored.centre);
        match &self.shape {
            Shape::Even(rotation, scale) => {
                stored.rotation = (*rotation * stored.rotation.as_dquat()).as_quat();
                stored.scales = (stored.scales.as_dvec3() * *scale).as_vec3();
            }
            Shape::Uneven(matrix) => reshape(stored, matrix),
        }
        if let Some(turn) = &self.turn {
            turned(turn, coefficients);
        }
    }
}

/// The axes of a matrix, unit and at right angles; they keep its handedness.
fn orthonormal(matrix: DMat3) -> DMat3 {
    let x = matrix.x_axis.normalize_or_zero();
    let y = matrix.y_axis.normalize_or_zero();
    let y = (y - x * x.dot(y)).normalize_or_zero();
    let across = x.cross(y);
    DMat3::from_cols(x, y, across * across.dot(matrix.z_axis).signum())
}

fn reshape(stored: &mut Stored, matrix: &DMat3) {
    let length = stored.rotation.as_dquat().length();
    // What has no rotation or is not finite stays as it is, and is left out later.
    let is_sound = length > 0.0 && length.is_finite() && stored.scales.is_finite();
    if !is_sound {
        return;
    }
    let rotation = DMat3::from_quat(stored.rotation.as_dquat() / length);
    let axes = *matrix * rotation * DMat3::from_diagonal(stored.scales.as_dvec3());
    let (vectors, values) = eigen(axes * axes.transpose());
    stored.rotation = DQuat::from_mat3(&vectors).as_quat();
    stored.scales = values.max(DVec3::ZERO).map(f64::sqrt).as_vec3();
}

/// Eigenvectors (right-handed) and eigenvalues of a symmetric matrix, by Jacobi's rotations.
fn eigen(matrix: DMat3) -> (DMat3, DVec3) {
    // Each round squares what is off the diagonal; six reach the last digit of f64 from anywhere.
    const ROUNDS: usize = 8;
    let mut a = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    let mut vectors = DVec3::AXES;
    for (p, q) in [(0, 1), (0, 2), (1, 2)].repeat(ROUNDS) {
        if a[p][q] == 0.0 {
            continue;
        }
        let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
        let tangent = 1f64.copysign(theta) / (theta.abs() + theta.hypot(1.0));
        let cosine = tangent.hypot(1.0).recip();
        let sine = tangent * cosine;
        for column in &mut a {
            let (first, second) = (column[p], column[q]);
            column[p] = cosine * first - sine * second;
            column[q] = sine * first + cosine * second;
        }
        for columns in [&mut a, &mut vectors] {
            let (first, second) = (columns[p], columns[q]);
            columns[p] = cosine * first - sine * second;
            columns[q] = sine * first + cosine * second;
        }
    }
    let [x, y, z] = vectors;
    (
        DMat3::from_cols(x, y, z),
        DVec3::new(a[0].x, a[1].y, a[2].z),
    )
}

/// The turn of harmonics by orthonormal axes.
fn turn_of(world_from_mesh: DMat3) -> Turn {
    let mut turn = [[0.0; HARMONICS]; HARMONICS];
    let mesh_from_world = world_from_mesh.transpose();
    for (cosine, weight) in COSINES {
        let sine = (1.0 - cosine * cosine).sqrt();
        for step in 0..AROUND {
            let angle = TAU * step as f64 / AROUND as f64;
            let direction = DVec3::new(sine * angle.cos(), sine * angle.sin(), cosine);
            let world = basis(direction.as_vec3());
            let mesh = basis((mesh_from_world * direction).as_vec3());
            let area = single(weight * TAU / AROUND as f64);
            for (row, world) in turn.iter_mut().zip(world) {
                for (entry, mesh) in row.iter_mut().zip(mesh) {
                    *entry += area * world * mesh;
                }
            }
        }
    }
    turn
}

/// Turns the coefficients of the degrees that there are: those of one do not mix with those of another.
fn turned(turn: &Turn, coefficients: &mut [f32]) {
    for degree in 1..=3usize {
        let (first, count) = (degree * degree - 1, 2 * degree + 1);
        let Some(old) = coefficients.get_mut(3 * first..3 * (first + count)) else {
            return;
        };
        let mut new = [Vec3::ZERO; 7];
        for (place, sum) in new.iter_mut().take(count).enumerate() {
            for (other, rgb) in old.chunks_exact(3).enumerate() {
                *sum += turn[first + place][first + other] * Vec3::from_slice(rgb);
            }
        }
        for (rgb, new) in old.chunks_exact_mut(3).zip(new) {
            rgb.copy_from_slice(&new.to_array());
        }
    }
}
