//! Tangents for normal maps: MikkTSpace's, where a file gives none.
//!
//! Takes a mesh's corners with their coordinates in the normal map, v downwards as in glTF; gives a unit tangent for each corner of each
//! triangle, and the sign of normal x tangent along v upwards. Corners stay as they are: a seam of tangents splits no vertex.

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{DVec2, Vec3};

/// A tangent and a sign for each corner of a triangle.
pub(crate) type Tangents = [[f32; 4]; 3];

/// The input of tangents.
pub(crate) struct Surface<'a> {
    pub(crate) positions: &'a [[f32; 3]],
    /// Empty: triangles are flat.
    pub(crate) normals: &'a [[f32; 3]],
    pub(crate) triangles: &'a [[u32; 3]],
    pub(crate) uv: &'a [DVec2],
}

struct MikkGeometry<'a> {
    surface: Surface<'a>,
    tangents: Vec<Tangents>,
}

/// By triangle and corner; where texture coordinates have no direction, the tangent is any.
pub(crate) fn generate(surface: Surface) -> Vec<Tangents> {
    let tangents = vec![[[1.0, 0.0, 0.0, 1.0]; 3]; surface.triangles.len()];
    let mut made = MikkGeometry { surface, tangents };
    // It fails for a mesh without triangles alone, which has no tangents.
    let _ = generate_tangents(&mut made);
    made.tangents
}

impl MikkGeometry<'_> {
    fn corner(&self, face: usize, corner: usize) -> usize {
        self.surface.triangles[face][corner] as usize
    }
}

impl Geometry for MikkGeometry<'_> {
    fn num_faces(&self) -> usize {
        self.surface.triangles.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.surface.positions[self.corner(face, corner)]
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        if let Some(normal) = self.surface.normals.get(self.corner(face, corner)) {
            return *normal;
        }
        let [a, b, c] = [0, 1, 2].map(|k| Vec3::from(self.position(face, k)));
        (b - a).cross(c - a).normalize_or_zero().to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.surface.uv[self.corner(face, corner)]
            .as_vec2()
            .to_array()
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        if let Some(space) = space {
            let [x, y, z, sign] = space.tangent_encoded();
            // MikkTSpace counts v upwards.
            self.tangents[face][corner] = [x, y, z, -sign];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_follow_u_and_the_sign_leads_up_the_picture() {
        let positions = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let uv = [[0.0, 8.0], [8.0, 8.0], [8.0, 0.0], [0.0, 0.0]].map(DVec2::from);
        for (mirrored, expected) in [
            (false, [1.0, 0.0, 0.0, 1.0]),
            (true, [-1.0, 0.0, 0.0, -1.0]),
        ] {
            let uv = uv.map(|uv| {
                if mirrored {
                    DVec2::new(-uv.x, uv.y)
                } else {
                    uv
                }
            });
            let tangents = generate(Surface {
                positions: &positions,
                normals: &[],
                triangles: &[[0, 1, 2], [0, 2, 3]],
                uv: &uv,
            });
            assert_eq!(tangents, [[expected; 3]; 2], "mirrored: {mirrored}");
        }
    }
}
