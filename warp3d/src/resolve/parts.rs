//! The surfaces that a pixel near an edge sees, weighted by the pixel's Gaussian.

use glam::DVec2;

use crate::hybrid::{NO_SLOT, one_surface};
use crate::resolve::resolver::{REACH_PX, Resolver, Subset, WindowPixel, add};
use crate::surfaces::patch::{Hit, Patch, PlaneMap, share_a_corner};
use crate::surfaces::surface::NO_PATCH;
use crate::view::layer::BAND_ROWS;

/// One surface as a pixel sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// Its share of the pixel's Gaussian.
    pub(super) weight: f32,
    /// Weighted sum of the places, px from the pixel's centre.
    pub(super) moment: [f32; 2],
    /// The piece by which others of the surface are known, and its plane if it was asked for: it is from the same pixel as
    /// the best place.
    known_by: (u32, Option<Patch>),
    /// Largest weight of one place so far, and the piece there.
    best: (f32, u32),
}

/// The surfaces that a pixel sees.
#[derive(Default)]
pub(super) struct Parts {
    /// The surfaces, in no particular order.
    pub(super) list: Vec<Part>,
    /// Of each, the plane of the piece nearest to the pixel's centre, which stands for the surface, and where the
    /// centre lies on it.
    pub(super) traced: Vec<(PlaneMap, Option<Hit>)>,
    /// Weight of all places inside the picture, and their weighted sum, px.
    pub(super) window: [f32; 3],
}

/// The share of a pixel of the window in a surface.
struct Share {
    /// Weight and moment.
    sum: [f32; 3],
    /// Largest weight of one place, and the piece there.
    best: (f32, u32),
}

impl Resolver<'_> {
    /// Finds the surfaces that the places around a pixel see.
    pub(super) fn find_parts(&self, x: usize, y: usize, parts: &mut Parts) {
        parts.list.clear();
        parts.window = [0.0; 3];
        for (k, pixel) in self.weights.0.iter().enumerate() {
            let (dx, dy) = (k as i32 % 3 - REACH_PX, k as i32 / 3 - REACH_PX);
            let Some([x, y]) = self.inside(x as i32 + dx, y as i32 + dy) else {
                continue;
            };
            add(&mut parts.window, &pixel.total.sum);
            let at = y * self.size[0] + x;
            match self.hybrid.slot[at] {
                NO_SLOT => self.add_whole(&mut parts.list, self.hybrid.patch[at], pixel),
                slot => self.add_slot(&mut parts.list, [y / BAND_ROWS, slot as usize], pixel),
            }
        }
        let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        parts.traced.clear();
        parts.traced.extend(parts.list.iter().map(|part| {
            let plane = Patch::new(&self.prepared.surfaces, part.best.1).plane(self.warp);
            (plane, plane.hit(centre))
        }));
    }

    /// A pixel of the window of which the piece `id` stands for all.
    #[inline(always)]
    fn add_whole(&self, list: &mut Vec<Part>, id: u32, pixel: &WindowPixel) {
        if id == NO_PATCH {
            return;
        }
        let share = Share {
            sum: pixel.total.sum,
            best: (pixel.total.best.0, id),
        };
        let surfaces = &self.prepared.surfaces;
        match list
            .iter_mut()
            .find(|part| share_a_corner(surfaces, part.known_by.0, id))
        {
            Some(part) => part.add(&share, (id, None)),
            None => self.add_share(list, id, Patch::new(surfaces, id), &share),
        }
    }

    /// A pixel of the window that has places in the finer lattice.
    #[inline(always)]
    fn add_slot(&self, list: &mut Vec<Part>, [band, slot]: [usize; 2], pixel: &WindowPixel) {
        for part in self.hybrid.parts[band].of_slot(slot) {
            let Subset { sum, best } = pixel.sum(part.places);
            let piece = self.hybrid.fine[band].piece(slot, best.1 as usize);
            let best = (best.0, piece);
            self.add_share(list, part.id, part.patch, &Share { sum, best });
        }
    }

    #[inline(always)]
    fn add_share(&self, list: &mut Vec<Part>, id: u32, patch: Patch, share: &Share) {
        let surfaces = &self.prepared.surfaces;
        let found = list.iter_mut().find_map(|part| {
            let (known_id, plane) = &mut part.known_by;
            let same = share_a_corner(surfaces, *known_id, id) || {
                let plane = plane.get_or_insert_with(|| Patch::new(surfaces, *known_id));
                one_surface(plane, &patch, surfaces.tolerance)
            };
            same.then_some(part)
        });
        match found {
            Some(part) => part.add(share, (id, Some(patch))),
            None => list.push(Part {
                weight: share.sum[0],
                moment: [share.sum[1], share.sum[2]],
                known_by: (id, Some(patch)),
                best: share.best,
            }),
        }
    }

    /// The place in the picture; `None` outside it.
    #[inline(always)]
    fn inside(&self, x: i32, y: i32) -> Option<[usize; 2]> {
        let [width, height] = self.size;
        (x >= 0 && y >= 0 && x < width as i32 && y < height as i32)
            .then_some([x as usize, y as usize])
    }
}

impl Part {
    #[inline(always)]
    fn add(&mut self, share: &Share, known_by: (u32, Option<Patch>)) {
        self.weight += share.sum[0];
        self.moment = [self.moment[0] + share.sum[1], self.moment[1] + share.sum[2]];
        if share.best.0 > self.best.0 {
            self.best = share.best;
            self.known_by = known_by;
        }
    }
}
