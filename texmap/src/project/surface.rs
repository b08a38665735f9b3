//! A triangle as one tile sees it: from a position on the screen to texture coordinates, colour and light.
//!
//! Everything that is linear over a triangle is, divided by w, a plane over the screen; two planes and one division
//! give it back exactly. Planes are in f32, relative to the tile and to whole periods of the texture, so that neither
//! a picture far from the eye nor a texture repeated a million times loses digits.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use glam::{DMat3, DVec2, DVec3, Vec3, Vec4};
use resample_core::light::{AMBIENT, DIFFUSE};
use resample_core::{Camera, Projection};
use resample_mesh::scene::Wrap;

use crate::light::blocked::BlockedLight;
use crate::light::blocked::look::LitTriangle;
use crate::prepare::charts::Borders;
use crate::prepare::{
    LightKind, LightMap, MAPS, NORMALS, Prepared, PreparedMaterial, PreparedMesh,
};
use crate::project::cull::{Facing, ScreenTriangle};
use crate::screen::{IOTA, LANES, Lanes, Plane, SPAN_HEIGHT, SPAN_WIDTH, moved, narrow, value};

/// A texture's coordinates over the tile.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UvPlanes {
    pub(crate) u: Plane,
    pub(crate) v: Plane,
    /// Where the texture's period begins that coordinates count from, texels.
    pub(crate) start: [f64; 2],
    /// Index into the pyramids.
    pub(crate) pyramid: usize,
    /// Where the chart ends.
    pub(crate) borders: Borders,
}

/// A triangle as one tile sees it.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    /// 1/w, times a factor that all planes share.
    pub(crate) over_w: Plane,
    pub(crate) base: Option<UvPlanes>,
    pub(crate) emissive: Option<UvPlanes>,
    /// World normal towards the eye, in any length.
    pub(crate) normal: [Plane; 3],
    /// Vertex colour times the material's; `None` where it is the same everywhere.
    pub(crate) colours: Option<[Plane; 4]>,
    pub(crate) material: usize,
    /// Index into the prepared meshes.
    pub(crate) mesh: u32,
    base_colour: Vec4,
    /// Red, green, blue; 0 where the emissive texture is black as far as the tile sees it.
    pub(crate) emissive_colour: Vec4,
    pub(crate) light: Light,
    /// Where light comes from all around.
    pub(crate) maps: Option<Box<SurfaceMaps>>,
}

/// The maps of light over the tile.
#[derive(Clone, Debug)]
pub(crate) struct SurfaceMaps {
    pub(crate) maps: [Option<MapPlanes>; MAPS],
    /// World tangent, in any length; turned round with the normal.
    pub(crate) tangent: [Plane; 3],
    /// Sign of normal x tangent.
    pub(crate) side: f32,
    /// Where the scene blocks light.
    pub(crate) lit: Option<LitTriangle>,
}

/// How a map of light lies over the tile.
#[derive(Clone, Debug)]
pub(crate) enum MapPlanes {
    /// As the base texture, texel by texel.
    LikeBase {
        /// Index into the pyramids.
        pyramid: usize,
    },
    Own(Box<UvPlanes>),
}

impl MapPlanes {
    pub(crate) fn pyramid(&self) -> usize {
        match self {
            Self::LikeBase { pyramid } => *pyramid,
            Self::Own(planes) => planes.pyramid,
        }
    }
}

/// Where light comes from.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Light {
    None,
    /// From all around.
    Surroundings,
    /// From the eye: rays of the tile, to be turned round.
    Eye,
    Distant(Vec3),
}

/// Values shared by all surfaces of a tile.
pub(crate) struct TileView<'a> {
    pub(crate) scene: &'a Prepared,
    pub(crate) blocked: Option<&'a BlockedLight>,
    /// Corner of the tile's border, px.
    pub(crate) corner_px: [f64; 2],
    /// Direction of the rays in the world, a plane each.
    pub(crate) rays: [Plane; 3],
    /// Unit vector towards the distant light.
    pub(crate) light: Vec3,
}

/// Where texture coordinates are and how they move from pixel to pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UvAt {
    /// Texels of the full texture; the centre of the first is 0.5.
    pub(crate) u: f32,
    pub(crate) v: f32,
    /// Texels per px: du/dx, du/dy, dv/dx, dv/dy.
    pub(crate) jacobian: [f32; 4],
}

impl<'a> TileView<'a> {
    pub(crate) fn new(
        (scene, blocked): (&'a Prepared, Option<&'a BlockedLight>),
        camera: &Camera,
        corner_px: [f64; 2],
        light: DVec3,
    ) -> Self {
        let world_from_camera: DMat3 = camera.camera_from_world.matrix3.transpose();
        let axis = |v: DVec3| world_from_camera * v;
        let rays = match camera.projection {
            Projection::Perspective => {
                let corner = camera.ray_in_camera(DVec2::from(corner_px)).1;
                [
                    axis(DVec3::X / camera.fx),
                    axis(DVec3::Y / camera.fy),
                    axis(corner),
                ]
            }
            Projection::Orthographic => [DVec3::ZERO, DVec3::ZERO, axis(DVec3::Z)],
        };
        let rays = [0, 1, 2].map(|k| narrow(DVec3::new(rays[0][k], rays[1][k], rays[2][k])));
        Self {
            scene,
            blocked,
            corner_px,
            rays,
            light: light.normalize_or_zero().as_vec3(),
        }
    }

    /// The light of a surface.
    fn light_of(&self, kind: LightKind) -> Light {
        match kind {
            LightKind::None => Light::None,
            LightKind::Headlight => Light::Eye,
            LightKind::Lambert => Light::Distant(self.light),
            LightKind::Physical => Light::Surroundings,
        }
    }
}

/// Gives the planes of texture coordinates, from the coordinate of a corner and the pyramid.
type UvOf<'a> = dyn Fn(&dyn Fn(usize) -> DVec2, usize) -> UvPlanes + 'a;

/// Where a map of light is looked up: as the base texture, at its coordinates scaled, or at coordinates of its own.
fn map_planes(map: &LightMap, own: &[DVec2], base: &[DVec2], uv: &UvOf) -> Option<MapPlanes> {
    let planes = match map.per_base {
        Some([1.0, 1.0]) => {
            return Some(MapPlanes::LikeBase {
                pyramid: map.pyramid,
            });
        }
        Some(scale) => {
            let scale = DVec2::from(scale.map(f64::from));
            uv(&|i| base[i] * scale, map.pyramid)
        }
        None if own.is_empty() => return None,
        None => uv(&|i| own[i], map.pyramid),
    };
    Some(MapPlanes::Own(Box::new(planes)))
}

/// The plane of the normal of a triangle whose corners have none.
fn flat_normal(triangle: &ScreenTriangle, mesh: &PreparedMesh) -> [[f32; 3]; 3] {
    let normal = triangle.flat_normal(mesh).normalize_or_zero();
    normal.to_array().map(|n| [0.0, 0.0, n as f32])
}

/// A triangle whose light is found at places.
fn lit_triangle(
    (scene, blocked): (&Prepared, &BlockedLight),
    (mesh, triangle, side): (&PreparedMesh, &ScreenTriangle, usize),
    shares: [Plane; 2],
) -> Option<LitTriangle> {
    let index = triangle.seen.triangle as usize;
    let grids = &blocked.grids.meshes[triangle.seen.mesh as usize];
    let grid = *grids.grids[side].get(index).filter(|grid| grid.steps > 0)?;
    Some(LitTriangle {
        shares,
        grid,
        corners: scene
            .has_suns()
            .then(|| lit_corners((mesh, triangle), side)),
    })
}

/// Positions and normals of a triangle's corners, on the side that is seen.
fn lit_corners(
    (mesh, triangle): (&PreparedMesh, &ScreenTriangle),
    side: usize,
) -> [(Vec3, Vec3); 3] {
    let flip = [1.0, -1.0][side];
    let flat = triangle.flat_normal(mesh).normalize_or_zero().as_vec3();
    mesh.triangles[triangle.seen.triangle as usize].map(|i| {
        let normal = mesh.normals.get(i as usize);
        let normal = normal.map_or(flat, |n| Vec3::from(*n).normalize_or_zero() * flip);
        (Vec3::from(mesh.positions[i as usize]), normal)
    })
}

/// The sign of the normals of the side that is seen.
fn side_seen(facing: Facing) -> f64 {
    match facing {
        Facing::Front => 1.0,
        Facing::Back => -1.0,
    }
}

impl Surface {
    /// The triangle as the tile sees it; `seen_px` is a position of the tile, from its corner, where it is seen.
    pub(crate) fn new(tile: &TileView, triangle: &ScreenTriangle, seen_px: [f32; 2]) -> Self {
        let mesh = &tile.scene.meshes[triangle.seen.mesh as usize];
        let material = &tile.scene.materials[mesh.material];
        let corners = mesh.triangles[triangle.seen.triangle as usize].map(|i| i as usize);
        let p = DVec3::new(
            tile.corner_px[0] + f64::from(seen_px[0]),
            tile.corner_px[1] + f64::from(seen_px[1]),
            1.0,
        );
        // One unit of w there, so that f32 holds everything however far the triangle is.
        let unit = 1.0 / triangle.plane([1.0; 3]).dot(p);
        let plane = |at: [f64; 3]| narrow(moved(triangle.plane(at) * unit, tile.corner_px));
        let uv = |coordinate: &dyn Fn(usize) -> DVec2, pyramid: usize| {
            let start = [0, 1].map(|k| {
                let here = triangle.plane(corners.map(|i| coordinate(i)[k])).dot(p) * unit;
                period_start(tile.scene, pyramid, k, here)
            });
            let uv = |i: usize| coordinate(i) - DVec2::from(start);
            let axis = |k: usize| plane(corners.map(|i| uv(i)[k]));
            let borders = mesh.charts.around(corners, uv);
            UvPlanes {
                u: axis(0),
                v: axis(1),
                start,
                pyramid,
                borders,
            }
        };
        let of_list = |list: &[DVec2], pyramid: Option<usize>| {
            let pyramid = pyramid.filter(|_| !list.is_empty())?;
            Some(uv(&|i| list[i], pyramid))
        };
        let flip = side_seen(triangle.seen.facing);
        let normal = if mesh.normals.is_empty() {
            flat_normal(triangle, mesh)
        } else {
            [0, 1, 2].map(|k| plane(corners.map(|i| flip * f64::from(mesh.normals[i][k]))))
        };
        let colours = (!mesh.colours.is_empty())
            .then(|| [0, 1, 2, 3].map(|k| plane(corners.map(|i| f64::from(mesh.colours[i][k])))));
        let maps = material.physical.as_ref().map(|physical| {
            let map =
                |k: usize| map_planes(&physical.maps[k]?, &mesh.map_uv[k], &mesh.base_uv, &uv);
            let mut tangents = [[0.0; 4]; 3];
            if physical.maps[NORMALS].is_some() && !mesh.tangents.is_empty() {
                tangents = mesh.tangents[triangle.seen.triangle as usize];
            }
            let tangent = |k: usize| plane(tangents.map(|t| flip * f64::from(t[k])));
            Box::new(SurfaceMaps {
                maps: std::array::from_fn(map),
                tangent: [tangent(0), tangent(1), tangent(2)],
                side: flip as f32 * tangents[0][3],
                lit: tile.blocked.and_then(|blocked| {
                    let shares = [plane([1.0, 0.0, 0.0]), plane([0.0, 1.0, 0.0])];
                    let side = usize::from(triangle.seen.facing == Facing::Back);
                    lit_triangle((tile.scene, blocked), (mesh, triangle, side), shares)
                }),
            })
        });
        let over_w = plane([1.0; 3]);
        let mut emissive = of_list(&mesh.emissive_uv, material.emissive);
        let mut emissive_colour = material.emissive_colour;
        let black = mesh.black_around.get(triangle.seen.triangle as usize);
        if emissive.is_some_and(|planes| is_within(&planes, &over_w, seen_px, black)) {
            (emissive, emissive_colour) = (None, Vec4::ZERO);
        }
        Self {
            over_w,
            base: of_list(&mesh.base_uv, material.base),
            emissive,
            emissive_colour,
            normal,
            colours,
            material: mesh.material,
            mesh: triangle.seen.mesh,
            base_colour: material.base_colour,
            light: tile.light_of(material.light),
            maps,
        }
    }

    /// Texture coordinates at a position of the tile.
    #[inline(always)]
    pub(crate) fn uv_at(&self, planes: &UvPlanes, at: [f32; 2]) -> UvAt {
        uv_at(planes, &self.over_w, at)
    }

    /// Relative change of 1/w per px along x and y.
    pub(crate) fn over_w_slope(&self, at: [f32; 2]) -> [f32; 2] {
        let w = 1.0 / value(&self.over_w, at);
        [self.over_w[0] * w, self.over_w[1] * w]
    }

    /// Base colour factor with the vertices' colour: red, green, blue, alpha.
    #[inline(always)]
    pub(crate) fn factor(&self, at: [f32; 2]) -> Vec4 {
        let Some(colours) = &self.colours else {
            return self.base_colour;
        };
        let w = 1.0 / value(&self.over_w, at);
        let c = |k: usize| value(&colours[k], at) * w;
        self.base_colour * Vec4::new(c(0), c(1), c(2), c(3)).max(Vec4::ZERO)
    }

    /// How the maps of light lie.
    #[inline(always)]
    pub(crate) fn maps_of_light(&self) -> &[Option<MapPlanes>] {
        self.maps.as_ref().map_or(&[], |maps| &maps.maps)
    }

    /// Unit normal in the world towards the eye; zero where the normals cancel.
    fn normal_at(&self, at: [f32; 2]) -> Vec3 {
        let n = &self.normal;
        Vec3::new(value(&n[0], at), value(&n[1], at), value(&n[2], at)).normalize_or_zero()
    }

    /// The light that a position reflects, as a factor of its colour.
    #[inline(always)]
    pub(crate) fn light_at(&self, tile: &TileView, at: [f32; 2]) -> f32 {
        let towards = match self.light {
            Light::None | Light::Surroundings => return 1.0,
            Light::Eye => {
                let r = &tile.rays;
                -Vec3::new(value(&r[0], at), value(&r[1], at), value(&r[2], at)).normalize_or_zero()
            }
            Light::Distant(direction) => direction,
        };
        AMBIENT + DIFFUSE * self.normal_at(at).dot(towards).max(0.0)
    }

    /// The material.
    pub(crate) fn material<'a>(&self, scene: &'a Prepared) -> &'a PreparedMaterial {
        &scene.materials[self.material]
    }
}

#[inline(always)]
fn uv_at(planes: &UvPlanes, over_w: &Plane, at: [f32; 2]) -> UvAt {
    let w = 1.0 / value(over_w, at);
    let (u, v) = (value(&planes.u, at) * w, value(&planes.v, at) * w);
    let slope = |p: &Plane, t: f32, axis: usize| (p[axis] - t * over_w[axis]) * w;
    let jacobian = [
        slope(&planes.u, u, 0),
        slope(&planes.u, u, 1),
        slope(&planes.v, v, 0),
        slope(&planes.v, v, 1),
    ];
    UvAt { u, v, jacobian }
}

/// Returns true if every footprint in the tile on a triangle reaches less than this far around it in a texture; `at` is a position
/// of the triangle.
fn is_within(planes: &UvPlanes, over_w: &Plane, at: [f32; 2], reach: Option<&f32>) -> bool {
    let Some(&reach) = reach.filter(|reach| **reach > 0.0) else {
        return false;
    };
    let [ux, uy, vx, vy] = uv_at(planes, over_w, at).jacobian;
    let per_px = (ux * ux + uy * uy + vx * vx + vy * vy).sqrt();
    let across = SPAN_WIDTH as f32 * over_w[0].abs() + SPAN_HEIGHT as f32 * over_w[1].abs();
    let change = across / value(over_w, at).abs();
    // Over the tile 1/w keeps the share 1 - change or more, and texels per pixel are at most this.
    let kept = 1.0 - change;
    let most = per_px * (1.0 / kept + change / (kept * kept));
    // Points: the Gaussian's cut at 3.25 times 0.5 px, its own width and perspective make 2.2 texels for each
    // texel per pixel, and 2; levels have texels of at most 0.5 for each, and 0.6, which are widened to 0.7 of their own and see
    // 2.5 around them. That is less than 6 times texels per pixel, and 6; sub-pixels reach less far.
    change < 0.5 && 6.0 * most + 6.0 <= reach
}

/// Where the period of the texture begins that holds coordinate `here`, texels.
fn period_start(scene: &Prepared, pyramid: usize, axis: usize, here: f64) -> f64 {
    let pyramid = &scene.pyramids[pyramid];
    let size = pyramid.levels[0].size[axis] as f64;
    let period = match pyramid.wrap[axis] {
        Wrap::Repeat => size,
        Wrap::Mirror => 2.0 * size,
        Wrap::Clamp => return 0.0,
    };
    let start = (here / period).floor() * period;
    if start.is_finite() { start } else { 0.0 }
}

/// Up to sixteen positions, px from the corner of the tile's border. Those beyond `count` are any numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Batch {
    pub(crate) x: Lanes,
    pub(crate) y: Lanes,
    pub(crate) count: usize,
}

impl Batch {
    /// Positions a pixel apart.
    #[inline(always)]
    pub(crate) fn along<S: Simd>(simd: S, first_px: [f32; 2], count: usize) -> Self {
        let x = f32x16::from_slice(simd, &IOTA) + f32x16::splat(simd, first_px[0]);
        let mut batch = Self {
            x: [0.0; LANES],
            y: [first_px[1]; LANES],
            count: count.min(LANES),
        };
        x.store_slice(&mut batch.x);
        batch
    }

    /// The k-th position.
    #[inline(always)]
    pub(crate) fn at(&self, k: usize) -> [f32; 2] {
        [self.x[k], self.y[k]]
    }

    /// A plane's values.
    #[inline(always)]
    pub(crate) fn on<S: Simd>(&self, simd: S, plane: &Plane) -> f32x16<S> {
        let [x, y] = [&self.x, &self.y].map(|lanes| f32x16::from_slice(simd, lanes));
        let splat = |x: f32| f32x16::splat(simd, x);
        splat(plane[0]) * x + splat(plane[1]) * y + splat(plane[2])
    }

    /// The values of three planes.
    #[inline(always)]
    pub(crate) fn on_3<S: Simd>(&self, simd: S, [a, b, c]: &[Plane; 3]) -> [f32x16<S>; 3] {
        [self.on(simd, a), self.on(simd, b), self.on(simd, c)]
    }

    /// The light that the surface reflects, as a factor of its colour.
    #[inline(always)]
    pub(crate) fn light<S: Simd>(
        &self,
        simd: S,
        (surface, tile): (&Surface, &TileView),
    ) -> f32x16<S> {
        let splat = |x: f32| f32x16::splat(simd, x);
        let zero = splat(0.0);
        let towards = match surface.light {
            Light::None | Light::Surroundings => return splat(1.0),
            Light::Eye => {
                let [x, y, z] = self.on_3(simd, &tile.rays);
                [zero - x, zero - y, zero - z]
            }
            Light::Distant(direction) => {
                [splat(direction.x), splat(direction.y), splat(direction.z)]
            }
        };
        let normal = self.on_3(simd, &surface.normal);
        let (mut cosine, mut normal2, mut towards2) = (zero, zero, zero);
        for axis in 0..3 {
            cosine += normal[axis] * towards[axis];
            normal2 += normal[axis] * normal[axis];
            towards2 += towards[axis] * towards[axis];
        }
        let lengths = (normal2 * towards2).sqrt();
        let cosine = lengths.simd_gt(zero).select(cosine / lengths, zero);
        splat(AMBIENT) + splat(DIFFUSE) * cosine.max(zero)
    }
}
