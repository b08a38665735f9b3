//! Cameras: from world positions to pixels and back.
//!
//! One convention inside: camera x right, y down, z forward; screen x right, y down, pixel (0, 0) covers 0..1 and
//! has its centre at +0.5. Everything is f64: positions may lie 1e7 units from the origin, and what later stages
//! hold in f32 is already relative to the eye. Other conventions are converted at the edge, by the constructors.

pub mod bands;
pub mod framing;
pub mod orbit;
pub mod spline;
pub mod tracks;
pub mod view;

use glam::{DAffine3, DMat3, DVec2, DVec3};
use thiserror::Error;

/// How world positions reach the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Projection {
    /// Things far away are smaller: a pinhole at the camera origin
    Perspective,
    /// Parallel rays along +z
    Orthographic,
}

/// A camera with its picture size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Perspective or orthographic.
    pub projection: Projection,
    /// Picture width, px.
    pub width: u32,
    /// Picture height, px.
    pub height: u32,
    /// Focal length along x: px per unit of x/z (perspective) or px per world unit (orthographic).
    pub fx: f64,
    /// Focal length along y, as `fx`. Different from `fx` where pixels are not square.
    pub fy: f64,
    /// Principal point along x, px; the centre of the first pixel is 0.5.
    pub cx: f64,
    /// Principal point along y, px.
    pub cy: f64,
    /// World to camera: a rotation and a translation, no scale.
    pub camera_from_world: DAffine3,
    /// Camera z of the near plane, world units: nothing before it is seen. Above 0 for perspective.
    pub near: f64,
}

/// Where integer pixel coordinates lie in a camera file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum PixelCentre {
    /// At 0.5, as in COLMAP: this crate's own convention
    Half,
    /// At 0, as in OpenCV
    Integer,
}

/// Focal lengths and principal point, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Picture width, px.
    pub width: u32,
    /// Picture height, px.
    pub height: u32,
    /// Focal length along x, px.
    pub fx: f64,
    /// Focal length along y, px.
    pub fy: f64,
    /// Principal point along x, px, in the convention of `pixel_centre`.
    pub cx: f64,
    /// Principal point along y, px, in the convention of `pixel_centre`.
    pub cy: f64,
    /// The origin of `cx` and `cy`.
    pub pixel_centre: PixelCentre,
}

/// Position, target and up of a look-at camera, world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookAt {
    /// The eye.
    pub position: DVec3,
    /// The point in the centre of the picture.
    pub target: DVec3,
    /// A direction that points up in the picture; any length, not parallel to the view.
    pub up: DVec3,
}

/// Why a camera cannot be used.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum CameraError {
    /// A number is NaN or infinite.
    #[error("camera {0} is not finite")]
    NotFinite(&'static str),
    /// A number is outside its range.
    #[error("camera {name} is {value}, expected {expected}")]
    OutOfRange {
        /// The name of the number.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Its range.
        expected: &'static str,
    },
    /// Position and target coincide.
    #[error("camera position and target are the same point: the view direction is undefined")]
    NoDirection,
    /// The up direction gives no horizon.
    #[error("camera up is zero or parallel to the view direction: choose another up")]
    NoUp,
    /// The pose is not a rotation.
    #[error(
        "camera rotation is not orthonormal with determinant +1 (off by {0:.1e}): it may hold a scale or a flip"
    )]
    NotRotation(f64),
}

/// Largest picture side, px. Keeps row numbers in u16 and pixel coordinates exact to 1/512 px in f32.
pub const MAX_SIDE_PX: u32 = 32_768;

/// Near plane when nothing else is asked for: this fraction of the distance to the target. Small enough that it cuts
/// nothing a person would look at, large enough that x/z stays far from overflow.
const NEAR_FRACTION: f64 = 1e-4;

/// Largest departure of R R^T from the identity that is taken for rounding in a file with seven digits.
const ROTATION_TOLERANCE: f64 = 1e-4;

impl Camera {
    /// A perspective camera at `pose`, with a vertical field of view in radians and square pixels.
    ///
    /// ```
    /// use resample_core::{Camera, LookAt};
    ///
    /// let pose = LookAt {
    ///     position: [0.0, 0.0, 4.0].into(),
    ///     target: [0.0; 3].into(),
    ///     up: [0.0, 1.0, 0.0].into(),
    /// };
    /// let camera = Camera::perspective(&pose, 0.8, [640, 480])?;
    /// assert!((camera.eye_in_world().z - 4.0).abs() < 1e-12);
    /// # Ok::<(), resample_core::CameraError>(())
    /// ```
    pub fn perspective(pose: &LookAt, fov_y_rad: f64, size: [u32; 2]) -> Result<Self, CameraError> {
        if !(fov_y_rad > 0.0 && fov_y_rad < std::f64::consts::PI) {
            let expected = "an angle above 0 and below 180 degrees (given in radians)";
            return Err(CameraError::OutOfRange {
                name: "field of view",
                value: fov_y_rad,
                expected,
            });
        }
        let focal_px = 0.5 * f64::from(size[1]) / (0.5 * fov_y_rad).tan();
        Self::looking(Projection::Perspective, pose, focal_px, size)
    }

    /// An orthographic camera at `pose`; the picture is `height_in_world` world units high, pixels are square.
    ///
    /// ```
    /// use resample_core::{Camera, LookAt};
    ///
    /// let pose = LookAt {
    ///     position: [0.0, 0.0, 4.0].into(),
    ///     target: [0.0; 3].into(),
    ///     up: [0.0, 1.0, 0.0].into(),
    /// };
    /// // Two world units over 480 rows.
    /// let camera = Camera::orthographic(&pose, 2.0, [640, 480])?;
    /// assert_eq!(camera.fy, 240.0);
    /// # Ok::<(), resample_core::CameraError>(())
    /// ```
    pub fn orthographic(
        pose: &LookAt,
        height_in_world: f64,
        size: [u32; 2],
    ) -> Result<Self, CameraError> {
        if !(height_in_world > 0.0 && height_in_world.is_finite()) {
            let expected = "a height above 0 world units";
            return Err(CameraError::OutOfRange {
                name: "view height",
                value: height_in_world,
                expected,
            });
        }
        Self::looking(
            Projection::Orthographic,
            pose,
            f64::from(size[1]) / height_in_world,
            size,
        )
    }

    fn looking(
        projection: Projection,
        pose: &LookAt,
        focal_px: f64,
        size: [u32; 2],
    ) -> Result<Self, CameraError> {
        let camera = Self {
            projection,
            width: size[0],
            height: size[1],
            fx: focal_px,
            fy: focal_px,
            cx: 0.5 * f64::from(size[0]),
            cy: 0.5 * f64::from(size[1]),
            camera_from_world: pose.camera_from_world()?,
            near: NEAR_FRACTION * pose.position.distance(pose.target),
        };
        camera.validated()
    }

    /// A perspective camera from intrinsics and a world-to-camera pose (x right, y down, z forward).
    ///
    /// `near` is the camera z of the near plane in world units.
    pub fn from_intrinsics(
        intrinsics: &Intrinsics,
        rotation: DMat3,
        translation: DVec3,
        near: f64,
    ) -> Result<Self, CameraError> {
        let shift_px = match intrinsics.pixel_centre {
            PixelCentre::Half => 0.0,
            PixelCentre::Integer => 0.5,
        };
        let camera = Self {
            projection: Projection::Perspective,
            width: intrinsics.width,
            height: intrinsics.height,
            fx: intrinsics.fx,
            fy: intrinsics.fy,
            cx: intrinsics.cx + shift_px,
            cy: intrinsics.cy + shift_px,
            camera_from_world: DAffine3::from_mat3_translation(rotation, translation),
            near,
        };
        camera.validated()
    }

    /// The same view on a picture of another size; pixels stretch if the proportions differ.
    pub fn resized(mut self, width: u32, height: u32) -> Result<Self, CameraError> {
        let scale = DVec2::new(
            f64::from(width) / f64::from(self.width),
            f64::from(height) / f64::from(self.height),
        );
        (self.width, self.height) = (width, height);
        (self.fx, self.cx) = (self.fx * scale.x, self.cx * scale.x);
        (self.fy, self.cy) = (self.fy * scale.y, self.cy * scale.y);
        self.validated()
    }

    /// The same view of a world whose lengths are counted in this unit; exact for powers of two.
    pub fn in_unit(mut self, unit: f64) -> Self {
        self.camera_from_world.translation /= unit;
        self.near /= unit;
        if self.projection == Projection::Orthographic {
            (self.fx, self.fy) = (self.fx * unit, self.fy * unit);
        }
        self
    }

    /// Checks every number; a camera that passes cannot make a later stage fail.
    pub fn validated(self) -> Result<Self, CameraError> {
        for (name, value) in [
            ("fx", self.fx),
            ("fy", self.fy),
            ("cx", self.cx),
            ("cy", self.cy),
            ("near", self.near),
        ] {
            if !value.is_finite() {
                return Err(CameraError::NotFinite(name));
            }
        }
        for (name, value) in [("fx", self.fx), ("fy", self.fy)] {
            if value <= 0.0 {
                return Err(CameraError::OutOfRange {
                    name,
                    value,
                    expected: "a focal length above 0 px",
                });
            }
        }
        for (name, value) in [("width", self.width), ("height", self.height)] {
            if value == 0 || value > MAX_SIDE_PX {
                let expected = "1 to 32768 px";
                return Err(CameraError::OutOfRange {
                    name,
                    value: f64::from(value),
                    expected,
                });
            }
        }
        if self.projection == Projection::Perspective && self.near <= 0.0 {
            let expected = "a distance above 0";
            return Err(CameraError::OutOfRange {
                name: "near",
                value: self.near,
                expected,
            });
        }
        self.validated_pose()
    }

    fn validated_pose(self) -> Result<Self, CameraError> {
        let rotation = self.camera_from_world.matrix3;
        if !rotation.is_finite() || !self.camera_from_world.translation.is_finite() {
            return Err(CameraError::NotFinite("pose"));
        }
        let defect = rotation * rotation.transpose() - DMat3::IDENTITY;
        let defect = defect
            .to_cols_array()
            .iter()
            .fold(0.0f64, |worst, x| worst.max(x.abs()));
        if defect > ROTATION_TOLERANCE || rotation.determinant() < 0.0 {
            return Err(CameraError::NotRotation(defect));
        }
        Ok(self)
    }

    /// The eye (perspective) or the centre of the image plane z = 0 (orthographic), world units.
    pub fn eye_in_world(&self) -> DVec3 {
        self.camera_from_world.matrix3.transpose() * -self.camera_from_world.translation
    }

    /// The unit view direction in the world.
    pub fn forward_in_world(&self) -> DVec3 {
        self.camera_from_world.matrix3.row(2)
    }

    /// The screen position (px) of a point given in camera space, whatever its sign of z.
    ///
    /// ```
    /// use resample_core::{Camera, LookAt};
    ///
    /// let pose = LookAt {
    ///     position: [0.0, 0.0, 4.0].into(),
    ///     target: [0.0; 3].into(),
    ///     up: [0.0, 1.0, 0.0].into(),
    /// };
    /// let camera = Camera::perspective(&pose, 0.8, [640, 480])?;
    /// let middle = camera.screen_from_camera([0.0, 0.0, 3.0].into());
    /// assert_eq!(middle.to_array(), [320.0, 240.0]);
    /// # Ok::<(), resample_core::CameraError>(())
    /// ```
    pub fn screen_from_camera(&self, pos_in_camera: DVec3) -> DVec2 {
        let on_plane = match self.projection {
            Projection::Perspective => pos_in_camera.truncate() / pos_in_camera.z,
            Projection::Orthographic => pos_in_camera.truncate(),
        };
        DVec2::new(
            self.fx * on_plane.x + self.cx,
            self.fy * on_plane.y + self.cy,
        )
    }

    /// Origin and direction, in camera space, of the ray through a screen position (px).
    ///
    /// Perspective: from the origin along (x, y, 1), so that the ray parameter is camera z. Orthographic: from
    /// (x, y, 0) along (0, 0, 1). The direction is not normalised.
    pub fn ray_in_camera(&self, pos_in_screen: DVec2) -> (DVec3, DVec3) {
        let on_plane = DVec2::new(
            (pos_in_screen.x - self.cx) / self.fx,
            (pos_in_screen.y - self.cy) / self.fy,
        );
        match self.projection {
            Projection::Perspective => (DVec3::ZERO, on_plane.extend(1.0)),
            Projection::Orthographic => (on_plane.extend(0.0), DVec3::Z),
        }
    }
}

impl LookAt {
    /// The world-to-camera transform of this pose.
    pub fn camera_from_world(&self) -> Result<DAffine3, CameraError> {
        for (name, v) in [
            ("position", self.position),
            ("target", self.target),
            ("up", self.up),
        ] {
            if !v.is_finite() {
                return Err(CameraError::NotFinite(name));
            }
        }
        let forward = (self.target - self.position)
            .try_normalize()
            .ok_or(CameraError::NoDirection)?;
        let up = self.up.try_normalize().ok_or(CameraError::NoUp)?;
        let right = forward.cross(up);
        // Below a sine of 1e-6 the horizon is decided by rounding in a file with seven digits.
        if right.length() < 1e-6 {
            return Err(CameraError::NoUp);
        }
        let right = right.normalize();
        let down = forward.cross(right);
        let rotation = DMat3::from_cols(right, down, forward).transpose();
        Ok(DAffine3::from_mat3_translation(
            rotation,
            rotation * -self.position,
        ))
    }
}

#[cfg(test)]
mod tests;
