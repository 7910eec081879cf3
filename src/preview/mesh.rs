//! Triangles with smooth normals and tangents, and finding the one a ray hits.
//!
//! The tree over them is obvhs's compressed eight-wide BVH: quick to build, quick to walk, and it speaks the glam types
//! we use anyway. The `bvh` crate would do as well; it is binary and brings nalgebra along.

use super::camera::Ray;
use super::scene::{EPSILON, Point};
use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::RayHit;
use obvhs::triangle::Triangle;
use std::time::Duration;

/// A corner shared by triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Position.
    pub p: Vec3,
    /// Unit; its side is the front.
    pub n: Vec3,
    /// Surface coordinates, 0 to 1.
    pub u: f32,
    /// The other one.
    pub v: f32,
    /// ∂P/∂u.
    pub dpdu: Vec3,
    /// ∂P/∂v.
    pub dpdv: Vec3,
}

/// Triangles ready to be hit by rays.
pub struct Mesh {
    vertices: Vec<Vertex>,
    /// In the order of the tree's leaves.
    triangles: Vec<[u32; 3]>,
    corners: Vec<Triangle>,
    tree: CwBvh,
}

/// Which triangle, where in it, how far.
#[derive(Clone, Copy, Debug)]
pub struct MeshHit {
    triangle: usize,
    /// Weights of the second and third corner.
    weights: [f32; 2],
}

impl Mesh {
    /// Builds the tree. Triangles run counter-clockwise seen from the front.
    pub fn new(vertices: Vec<Vertex>, triangles: Vec<[u32; 3]>) -> Mesh {
        let corners_of = |t: &[u32; 3]| {
            let [v0, v1, v2] = t.map(|i| Vec3A::from(vertices[i as usize].p));
            Triangle { v0, v1, v2 }
        };
        let corners: Vec<Triangle> = triangles.iter().map(corners_of).collect();
        // No pre-splits: every triangle appears once in the leaves.
        let params = BvhBuildParams { pre_split: false, ..BvhBuildParams::fast_build() };
        let tree = build_cwbvh_from_tris(&corners, params, &mut Duration::default());
        let triangles: Vec<[u32; 3]> = tree.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
        let corners = triangles.iter().map(corners_of).collect();
        Mesh { vertices, triangles, corners, tree }
    }

    /// All corners, in the order triangles refer to them.
    pub fn vertices(&self) -> &[Vertex] {
        &self.vertices
    }

    /// Indices into [`vertices`](Self::vertices), counter-clockwise seen from the front.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The nearest hit beyond nothing and before `t_max`.
    pub(super) fn intersect(&self, ray: Ray, t_max: f32) -> Option<MeshHit> {
        let mut found = None;
        let mut nearest = t_max;
        self.tree.ray_traverse(tree_ray(ray, t_max), &mut RayHit::none(), |_, i| {
            match meet(&self.corners[i], ray, nearest) {
                Some((t, weights)) => {
                    nearest = t;
                    found = Some(MeshHit { triangle: i, weights });
                    t
                }
                None => f32::INFINITY,
            }
        });
        found
    }

    /// Whether anything lies along the ray.
    pub(super) fn occluded(&self, ray: Ray) -> bool {
        !self.tree.ray_traverse_miss(tree_ray(ray, f32::MAX), |_, i| {
            meet(&self.corners[i], ray, f32::MAX).map_or(f32::INFINITY, |(t, _)| t)
        })
    }

    /// The surface at a hit.
    pub(super) fn surface(&self, hit: MeshHit) -> Point {
        let [a, b, c] = self.triangles[hit.triangle].map(|i| &self.vertices[i as usize]);
        let [wb, wc] = hit.weights;
        let wa = 1.0 - wb - wc;
        let p = a.p * wa + b.p * wb + c.p * wc;
        let blend = |f: fn(&Vertex) -> Vec3| f(a) * wa + f(b) * wb + f(c) * wc;
        let face = (b.p - a.p).cross(c.p - a.p).normalize_or_zero();
        let n = blend(|v| v.n).normalize_or(face);
        let ng = if face.dot(n) < 0.0 { -face } else { face };
        // Rays leave from the curved surface the normals describe, not from the flat triangle, where the triangle lies
        // below it (Hanika 2021, "Hacking the shadow terminator"): no facets at the edge of the shade.
        let lift = |side: f32| {
            let onto = |v: &Vertex| v.n * (side * (side * (p - v.p).dot(v.n)).min(0.0).abs());
            p + onto(a) * wa + onto(b) * wb + onto(c) * wc + ng * (side * EPSILON)
        };
        Point {
            p,
            n,
            ng,
            u: (a.u * wa + b.u * wb + c.u * wc).clamp(0.0, 1.0),
            v: (a.v * wa + b.v * wb + c.v * wc).clamp(0.0, 1.0),
            dpdu: blend(|v| v.dpdu),
            dpdv: blend(|v| v.dpdv),
            outside: lift(1.0),
            inside: lift(-1.0),
        }
    }
}

fn tree_ray(ray: Ray, t_max: f32) -> obvhs::ray::Ray {
    obvhs::ray::Ray::new(ray.origin.into(), ray.dir.into(), 0.0, t_max)
}

/// Distance and weights of the second and third corner (Möller & Trumbore 1997), from either side.
fn meet(triangle: &Triangle, ray: Ray, t_max: f32) -> Option<(f32, [f32; 2])> {
    let (origin, dir) = (Vec3A::from(ray.origin), Vec3A::from(ray.dir));
    let (e1, e2) = (triangle.v1 - triangle.v0, triangle.v2 - triangle.v0);
    let across = dir.cross(e2);
    let det = e1.dot(across);
    if det == 0.0 {
        return None;
    }
    let inverse = 1.0 / det;
    let from = origin - triangle.v0;
    let b = from.dot(across) * inverse;
    let along = from.cross(e1);
    let c = dir.dot(along) * inverse;
    let t = e2.dot(along) * inverse;
    // A hair beyond the edges, so that no ray slips between neighbours.
    const SLACK: f32 = -1e-6;
    (b >= SLACK && c >= SLACK && b + c <= 1.0 - SLACK && t > 0.0 && t < t_max).then_some((t, [b, c]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preview::drape_mesh;

    #[test]
    fn the_tree_finds_what_a_look_at_every_triangle_finds() {
        let mesh = drape_mesh(24);
        let mut hits = 0;
        for i in 0..4000u32 {
            let [a, b, c, d] = sobol_burley::sample_4d(i, 0, 1);
            let from = Vec3::new(4.0 * a - 2.0, 3.0 * b, 4.0 * c - 2.0);
            let to = Vec3::new(2.0 * c - 1.0, 1.5 * d, 2.0 * b - 1.0);
            let Some(dir) = (to - from).try_normalize() else { continue };
            let ray = Ray { origin: from, dir };
            let every = mesh.corners.iter().filter_map(|t| meet(t, ray, f32::INFINITY)).map(|(t, _)| t);
            let nearest = every.fold(f32::INFINITY, f32::min);
            let found = mesh.intersect(ray, f32::INFINITY);
            let t = found.map(|hit| (mesh.surface(hit).p - from).length());
            assert!(t.map_or(nearest.is_infinite(), |t| (t - nearest).abs() < 1e-4), "{ray:?}: {t:?} {nearest}");
            assert_eq!(mesh.occluded(ray), found.is_some());
            hits += u32::from(found.is_some());
        }
        assert!(hits > 1000, "{hits}");
    }
}
