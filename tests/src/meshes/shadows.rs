//! Balls and boxes that block the light of surroundings: as meshes, and by brute force, in f64.
//!
//! The truth meets the bodies themselves, not their triangles, and sums the light of every direction that nothing blocks.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use texmap::Scene;
use texmap::scene::{Lighting, Material, Mesh, Physical, Sides};

use crate::meshes::surroundings::{Reflector, reflected_of};
use crate::meshes::textured::material;
use resample_core::narrow::single;

/// A body.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// Middle and radius.
    Ball(DVec3, f64),
    /// Two opposite corners, the lower first.
    Block(DVec3, DVec3),
}

/// A body and its surface.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// Where it is.
    pub shape: Shape,
    /// How it reflects.
    pub surface: Reflector,
}

/// Where a ray meets a body.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// Index of the body.
    pub body: usize,
    /// From the ray's start.
    pub distance: f64,
    /// Of the body there, of length 1.
    pub normal: DVec3,
}

impl Shape {
    /// Distance and normal of the first place on a ray from outside.
    fn meet(&self, from: DVec3, towards: DVec3) -> Option<(f64, DVec3)> {
        match *self {
            Self::Ball(middle, radius) => {
                let to = middle - from;
                let along = to.dot(towards);
                let square = radius * radius - (to.length_squared() - along * along);
                let distance = along - square.max(0.0).sqrt();
                let normal = (from + towards * distance - middle) / radius;
                (square > 0.0 && distance > 1e-9).then_some((distance, normal))
            }
            Self::Block(low, high) => {
                let (a, b) = ((low - from) / towards, (high - from) / towards);
                let (near, far) = (a.min(b), a.max(b));
                let distance = near.max_element();
                let axis = near.max_position();
                let mut normal = DVec3::ZERO;
                normal[axis] = -towards[axis].signum();
                (distance < far.min_element() && distance > 1e-9).then_some((distance, normal))
            }
        }
    }

    /// Fine triangles for a ball, twelve for a block.
    fn mesh(&self, material: usize) -> Mesh {
        match *self {
            Self::Ball(middle, radius) => ball(48, material, |_| radius, middle),
            Self::Block(low, high) => block(low, high, material),
        }
    }
}

/// The first body on a ray.
pub fn first_met(bodies: &[Body], from: DVec3, towards: DVec3) -> Option<Met> {
    let met = bodies.iter().enumerate().filter_map(|(body, own)| {
        let (distance, normal) = own.shape.meet(from, towards)?;
        Some(Met {
            body,
            distance,
            normal,
        })
    });
    met.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// The light that bodies send back along a ray, by the sum over `count` directions of what nothing blocks; `None` where the ray meets none.
pub fn lit(
    bodies: &[Body],
    (from, towards): (DVec3, DVec3),
    radiance: impl Fn(DVec3) -> DVec3,
    count: usize,
) -> Option<DVec3> {
    let met = first_met(bodies, from, towards)?;
    let place = from + towards * met.distance + met.normal * 1e-7;
    let arriving = |direction: DVec3| {
        let is_blocked = first_met(bodies, place, direction).is_some();
        if is_blocked {
            DVec3::ZERO
        } else {
            radiance(direction)
        }
    };
    let surface = &bodies[met.body].surface;
    Some(reflected_of(
        arriving,
        surface,
        (met.normal, -towards),
        count,
    ))
}

/// The bodies as a scene of meshes, each with a material of its own.
pub fn scene(bodies: &[Body]) -> Scene {
    let mut scene = Scene::default();
    for (index, body) in bodies.iter().enumerate() {
        let Reflector {
            base,
            metal,
            roughness,
        } = body.surface;
        scene.meshes.push(body.shape.mesh(index));
        scene.materials.push(Material {
            base_colour: base.extend(1.0).as_vec4().to_array(),
            lighting: Lighting::Lit,
            sides: Sides::Front,
            physical: Some(Physical {
                metal: single(metal),
                roughness: single(roughness),
                ..Physical::default()
            }),
            ..material(None)
        });
    }
    scene
}

/// A ball whose radius depends on the direction, from pole to pole in `down` rows. Its normals are those of its surface.
pub fn ball(down: u32, material: usize, radius: impl Fn(DVec3) -> f64, middle: DVec3) -> Mesh {
    let around = 2 * down;
    let towards = |a: f64, b: f64| DVec3::new(b.sin() * a.sin(), b.cos(), b.sin() * a.cos());
    let place = |a: f64, b: f64| towards(a, b) * radius(towards(a, b));
    let mut mesh = Mesh {
        material,
        ..Mesh::default()
    };
    for j in 0..=down {
        for i in 0..=around {
            let a = f64::from(i) / f64::from(around) * TAU;
            let b = f64::from(j) / f64::from(down) * PI;
            // Differences a little off the poles, where directions around the axis are all one.
            let (step, b_off) = (1e-4, b.clamp(1e-3, PI - 1e-3));
            let along = place(a, b_off + step) - place(a, b_off - step);
            let across = place(a + step, b_off) - place(a - step, b_off);
            let normal = along.cross(across).normalize();
            mesh.positions
                .push((middle + place(a, b)).as_vec3().to_array());
            mesh.normals.push(normal.as_vec3().to_array());
        }
    }
    let stride = around + 1;
    for at in (0..down).flat_map(|j| (0..around).map(move |i| j * stride + i)) {
        mesh.triangles.push([at, at + stride, at + stride + 1]);
        mesh.triangles.push([at, at + stride + 1, at + 1]);
    }
    mesh
}

/// A white ball with bumps, which shade each other, of `4 down^2` triangles.
pub fn bumpy_ball(down: u32) -> Scene {
    let radius =
        |d: DVec3| 1.0 + 0.05 * (9.0 * d.x).sin() * (11.0 * d.y).sin() * (10.0 * d.z).cos();
    let surface = Reflector {
        base: DVec3::ONE,
        metal: 0.0,
        roughness: 0.6,
    };
    let mut scene = scene(&[Body {
        shape: Shape::Ball(DVec3::ZERO, 1.0),
        surface,
    }]);
    scene.meshes = vec![ball(down, 0, radius, DVec3::ZERO)];
    scene
}

/// Twelve triangles without normals.
fn block(low: DVec3, high: DVec3, material: usize) -> Mesh {
    let corner = |k: usize| {
        let pick = |axis: usize| {
            if k >> axis & 1 == 0 {
                low[axis]
            } else {
                high[axis]
            }
        };
        DVec3::new(pick(0), pick(1), pick(2)).as_vec3().to_array()
    };
    let faces = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    Mesh {
        positions: (0..8).map(corner).collect(),
        triangles: faces
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
        material,
        ..Mesh::default()
    }
}
