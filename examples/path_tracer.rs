//! A path tracer with no more of the library than a renderer needs: shading, light samples, BSDF samples, emission, and
//! shadow rays that holes in a cloth let through.
//!
//! `cargo run --release --example path_tracer -- [scene.obj] [-o picture.png] [--size N] [--spp N] [--seed N]`
//!
//! The groups of the OBJ file name scripts: `g velvet` is `velvet.osl` beside the file or in `examples`. Triangles
//! whose material gives off light are the lamps. The camera looks along −z at the middle of the scene.

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{Ray as TreeRay, RayHit};
use obvhs::triangle::Triangle;
use overcoat::closure::{Bsdf, Scattering};
use overcoat::{Engine, Globals, Material, Scratch};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::error::Error;
use std::path::{Path, PathBuf};

/// How far rays start from where they leave, in parts of the scene's size.
const OFFSET: f32 = 1e-4;
/// Most scattering events, and most holes on the way to a lamp.
const MAX_DEPTH: u32 = 12;

#[derive(Clone, Copy)]
struct Ray {
    origin: Vec3,
    dir: Vec3,
}

/// A corner: position, normal, texture coordinates.
#[derive(Clone, Copy)]
struct Vertex {
    p: Vec3,
    n: Vec3,
    uv: [f32; 2],
}

struct Face {
    corners: [Vertex; 3],
    material: usize,
}

struct Scene {
    faces: Vec<Face>,
    tree: CwBvh,
    triangles: Vec<Triangle>,
    materials: Vec<Material>,
    /// Faces that give off light, and the sum of areas up to and with each.
    lamps: Vec<(usize, f32)>,
    center: Vec3,
    radius: f32,
}

/// What a ray met.
struct Hit {
    face: usize,
    globals: Globals,
    /// Density over area with which [`Scene::lamp_sample`] chooses this point; 0 away from lamps.
    lamp_density: f32,
}

impl Face {
    fn cross(&self) -> Vec3 {
        let [a, b, c] = &self.corners;
        (b.p - a.p).cross(c.p - a.p)
    }

    /// The shading point at these weights of the second and third corner, seen from `wo`.
    fn point(&self, [wb, wc]: [f32; 2], wo: Vec3) -> Globals {
        let [a, b, c] = &self.corners;
        let wa = 1.0 - wb - wc;
        let (e1, e2) = (b.p - a.p, c.p - a.p);
        let ng = e1.cross(e2).normalize_or(Vec3::Z);
        let uv = |k: usize| a.uv[k] * wa + b.uv[k] * wb + c.uv[k] * wc;
        // ∂P/∂u and ∂P/∂v of the plane that the corners span over their texture coordinates.
        let d = |k: usize| (b.uv[k] - a.uv[k], c.uv[k] - a.uv[k]);
        let ((u1, u2), (v1, v2)) = (d(0), d(1));
        let det = u1 * v2 - u2 * v1;
        let (dpdu, dpdv) = match det.abs() > 1e-12 {
            true => ((e1 * v2 - e2 * v1) / det, (e2 * u1 - e1 * u2) / det),
            false => ng.any_orthonormal_pair(),
        };
        let n = (a.n * wa + b.n * wb + c.n * wc).normalize_or(ng);
        let n = if n.dot(ng) < 0.0 { -n } else { n };
        // The library wants both normals toward the viewer, and to be told when they were turned.
        let backfacing = ng.dot(wo) < 0.0;
        let (n, ng) = if backfacing { (-n, -ng) } else { (n, ng) };
        let n = if n.dot(wo) > 0.0 { n } else { ng };
        let p = a.p * wa + b.p * wb + c.p * wc;
        Globals { p, n, ng, u: uv(0), v: uv(1), dpdu, dpdv, backfacing, ..Globals::default() }
    }
}

impl Scene {
    fn open(path: &Path) -> Result<Scene, Box<dyn Error>> {
        // Materials are scripts: what an MTL file says is not read.
        let no_mtl = |_: &Path| Ok((vec![], Default::default()));
        let text = std::fs::read_to_string(path)?;
        let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &tobj::GPU_LOAD_OPTIONS, no_mtl)?;
        let (mut faces, mut names) = (Vec::new(), Vec::new());
        for model in &models {
            let mesh = &model.mesh;
            // Groups are called after what they are made of, `material` or `material.part`.
            let name = model.name.split('.').next().unwrap_or("").to_owned();
            let material = names.iter().position(|n| *n == name).unwrap_or(names.len());
            if material == names.len() {
                names.push(name);
            }
            let triple = |from: &[f32], i: u32| from.get(3 * i as usize..3 * i as usize + 3).map(Vec3::from_slice);
            let vertex = |i: u32| {
                let uv = mesh.texcoords.get(2 * i as usize..2 * i as usize + 2).map_or([0.0; 2], |t| [t[0], t[1]]);
                let (p, n) = (triple(&mesh.positions, i), triple(&mesh.normals, i));
                Vertex { p: p.unwrap_or_default(), n: n.unwrap_or_default(), uv }
            };
            let (triangles, _) = mesh.indices.as_chunks::<3>();
            faces.extend(triangles.iter().map(|t| Face { corners: t.map(vertex), material }));
        }
        let materials = names.iter().map(|name| compile(path, name)).collect::<Result<Vec<_>, _>>()?;
        Scene::new(faces, materials)
    }

    fn new(faces: Vec<Face>, materials: Vec<Material>) -> Result<Scene, Box<dyn Error>> {
        if faces.is_empty() {
            return Err("the scene is empty".into());
        }
        let triangle = |f: &Face| {
            let [v0, v1, v2] = f.corners.map(|v| Vec3A::from(v.p));
            Triangle { v0, v1, v2 }
        };
        let unordered: Vec<Triangle> = faces.iter().map(triangle).collect();
        let params = BvhBuildParams { pre_split: false, ..BvhBuildParams::fast_build() };
        let tree = build_cwbvh_from_tris(&unordered, params, &mut Default::default());
        let mut faces: Vec<Option<Face>> = faces.into_iter().map(Some).collect();
        let faces: Vec<Face> = tree.primitive_indices.iter().filter_map(|i| faces[*i as usize].take()).collect();
        let triangles = faces.iter().map(triangle).collect();
        let points = || faces.iter().flat_map(|f| f.corners.map(|v| v.p));
        let (low, high) = (points().fold(Vec3::MAX, Vec3::min), points().fold(Vec3::MIN, Vec3::max));
        let mut scene = Scene {
            tree,
            triangles,
            lamps: vec![],
            center: (low + high) * 0.5,
            radius: (high - low).length() * 0.5,
            faces,
            materials,
        };
        let mut area = 0.0;
        for (index, face) in scene.faces.iter().enumerate() {
            let globals = face.point([1.0 / 3.0; 2], face.cross());
            let bsdf = scene.materials[face.material].shade(&globals, globals.n)?;
            if bsdf.flags().contains(Scattering::EMISSION) {
                area += face.cross().length() * 0.5;
                scene.lamps.push((index, area));
            }
        }
        Ok(scene)
    }

    fn lamp_area(&self) -> f32 {
        self.lamps.last().map_or(0.0, |l| l.1)
    }

    fn hit(&self, ray: Ray, far: f32) -> Option<Hit> {
        let (mut found, mut nearest) = (None, far);
        let walk = TreeRay::new(ray.origin.into(), ray.dir.into(), 0.0, far);
        self.tree.ray_traverse(walk, &mut RayHit::none(), |_, index| {
            match meet(&self.triangles[index], ray, nearest) {
                Some((t, weights)) => {
                    nearest = t;
                    found = Some((index, weights));
                    t
                }
                None => f32::INFINITY,
            }
        });
        let (face, weights) = found?;
        let lamp = self.lamps.iter().any(|l| l.0 == face);
        let lamp_density = if lamp { 1.0 / self.lamp_area() } else { 0.0 };
        Some(Hit { face, globals: self.faces[face].point(weights, -ray.dir), lamp_density })
    }

    /// A ray that leaves a point of a surface along `dir`.
    fn leave(&self, globals: &Globals, dir: Vec3) -> Ray {
        let side = if dir.dot(globals.ng) < 0.0 { -1.0 } else { 1.0 };
        Ray { origin: globals.p + globals.ng * (side * OFFSET * self.radius), dir }
    }

    fn material(&self, hit: &Hit) -> &Material {
        &self.materials[self.faces[hit.face].material]
    }

    /// What of the light along `ray` arrives: holes let it through, colored.
    fn transmittance<'s>(
        &'s self,
        mut ray: Ray,
        mut far: f32,
        scratch: &mut Scratch<'s>,
    ) -> Result<Vec3, overcoat::Error> {
        let mut passed = Vec3::ONE;
        for _ in 0..MAX_DEPTH {
            let Some(hit) = self.hit(ray, far) else { return Ok(passed) };
            let bsdf = self.material(&hit).shade_in(&hit.globals, -ray.dir, scratch)?;
            passed *= Vec3::from(bsdf.transparency());
            if passed == Vec3::ZERO {
                break;
            }
            far -= (hit.globals.p - ray.origin).length();
            ray = self.leave(&hit.globals, ray.dir);
        }
        Ok(Vec3::ZERO)
    }

    /// A point on a lamp by area: its face, and the point as seen from `from`.
    fn lamp_sample(&self, from: Vec3, u: [f32; 3]) -> Option<(usize, Globals)> {
        let at = u[2] * self.lamp_area();
        let (face, _) = *self.lamps.get(self.lamps.partition_point(|l| l.1 <= at))?;
        let root = u[0].sqrt();
        let weights = [root * (1.0 - u[1]), root * u[1]];
        let p = self.faces[face].point(weights, Vec3::Z).p;
        Some((face, self.faces[face].point(weights, from - p)))
    }

    /// Light of the lamps at a point, weighed against finding it by sampling the BSDF.
    fn direct<'s>(
        &'s self,
        globals: &Globals,
        bsdf: &Bsdf<'_>,
        u: [f32; 3],
        scratch: &mut Scratch<'s>,
    ) -> Result<Vec3, overcoat::Error> {
        let Some((face, lamp)) = self.lamp_sample(globals.p, u) else { return Ok(Vec3::ZERO) };
        let way = lamp.p - globals.p;
        let (distance, wi) = (way.length(), way.normalize_or_zero());
        // From density over area to density over solid angle.
        let pdf = distance * distance / (lamp.ng.dot(wi).abs().max(1e-9) * self.lamp_area());
        let eval = bsdf.eval(wi);
        if eval.f_cos == [0.0; 3] {
            return Ok(Vec3::ZERO);
        }
        let material = &self.materials[self.faces[face].material];
        let light = Vec3::from(material.shade_in(&lamp, -wi, scratch)?.emission());
        let ray = self.leave(globals, wi);
        let passed = self.transmittance(ray, distance - 2.0 * OFFSET * self.radius, scratch)?;
        Ok(light * passed * Vec3::from(eval.f_cos) * (power(pdf, eval.pdf) / pdf))
    }

    fn radiance<'s>(
        &'s self,
        mut ray: Ray,
        rng: &mut Pcg64Mcg,
        [scratch, other]: &mut [Scratch<'s>; 2],
    ) -> Result<Vec3, overcoat::Error> {
        let (mut light, mut carried) = (Vec3::ZERO, Vec3::ONE);
        // Where the last direction was drawn, and its density: none for the camera and for delta lobes.
        let mut drawn: Option<(Vec3, f32)> = None;
        let mut depth = 0;
        while let Some(hit) = self.hit(ray, f32::MAX) {
            let bsdf = self.material(&hit).shade_in(&hit.globals, -ray.dir, scratch)?;
            let emission = Vec3::from(bsdf.emission());
            if emission != Vec3::ZERO {
                let weight = drawn.map_or(1.0, |(from, pdf)| {
                    let way = hit.globals.p - from;
                    let lamp = hit.lamp_density * way.length_squared() / hit.globals.ng.dot(ray.dir).abs().max(1e-9);
                    power(pdf, lamp)
                });
                light += carried * emission * weight;
            }
            if depth == MAX_DEPTH {
                break;
            }
            if !bsdf.is_delta() && !bsdf.is_black() {
                light += carried * self.direct(&hit.globals, bsdf, rng.random(), other)?;
            }
            let Some(sample) = bsdf.sample(rng.random()) else { break };
            carried *= Vec3::from(sample.weight);
            // Straight through a hole is no event: lamps were sampled through it from where the path last scattered.
            let hole = sample.flags.delta && Vec3::from(sample.wi).dot(ray.dir) > 1.0 - 2e-6;
            if !hole {
                drawn = (!sample.flags.delta).then_some((hit.globals.p, sample.pdf));
            }
            depth += 1;
            // Russian roulette.
            let survival = if depth > 3 { carried.max_element().min(0.95) } else { 1.0 };
            if rng.random::<f32>() >= survival {
                break;
            }
            carried /= survival;
            ray = self.leave(&hit.globals, Vec3::from(sample.wi));
        }
        Ok(light)
    }
}

/// The power heuristic for the first of two densities (Veach 1997, §9.2.4).
fn power(a: f32, b: f32) -> f32 {
    let ratio = b / a;
    1.0 / (1.0 + ratio * ratio)
}

/// Distance and weights of the second and third corner (Möller & Trumbore 1997), from either side.
fn meet(triangle: &Triangle, ray: Ray, far: f32) -> Option<(f32, [f32; 2])> {
    let (origin, dir) = (Vec3A::from(ray.origin), Vec3A::from(ray.dir));
    let (e1, e2) = (triangle.v1 - triangle.v0, triangle.v2 - triangle.v0);
    let across = dir.cross(e2);
    let inverse = 1.0 / e1.dot(across);
    let from = origin - triangle.v0;
    let b = from.dot(across) * inverse;
    let along = from.cross(e1);
    let (c, t) = (dir.dot(along) * inverse, e2.dot(along) * inverse);
    (b >= 0.0 && c >= 0.0 && b + c <= 1.0 && t > 0.0 && t < far).then_some((t, [b, c]))
}

/// The script called `name`, beside the scene or in `examples`.
fn compile(scene: &Path, name: &str) -> Result<Material, Box<dyn Error>> {
    let file = format!("{name}.osl");
    let beside = scene.with_file_name(&file);
    let path =
        if beside.exists() { beside } else { Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(&file) };
    let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(Engine::new().material(&path.display().to_string(), &text)?)
}

/// One row of the picture, linear.
fn row(scene: &Scene, args: &Args, y: u32) -> Result<Vec<Vec3>, overcoat::Error> {
    let mut scratch = [Scratch::new(), Scratch::new()];
    let eye = scene.center + Vec3::new(0.0, 0.0, 1.9 * scene.radius);
    let mut pixels = Vec::new();
    for x in 0..args.size {
        let mut rng = Pcg64Mcg::seed_from_u64(args.seed << 32 ^ u64::from(y * args.size + x));
        let mut sum = Vec3::ZERO;
        for _ in 0..args.spp {
            let [dx, dy]: [f32; 2] = rng.random();
            let at = |k: u32, d: f32| 2.0 * (k as f32 + d) / args.size as f32 - 1.0;
            let dir = Vec3::new(0.4 * at(x, dx), -0.4 * at(y, dy), -1.0).normalize();
            sum += scene.radiance(Ray { origin: eye, dir }, &mut rng, &mut scratch)?;
        }
        pixels.push(sum / args.spp as f32);
    }
    Ok(pixels)
}

fn render(scene: &Scene, args: &Args) -> Result<image::RgbImage, overcoat::Error> {
    let rows: Vec<Vec<Vec3>> = (0..args.size).into_par_iter().map(|y| row(scene, args, y)).collect::<Result<_, _>>()?;
    let srgb = |l: f32| if l <= 0.0031308 { 12.92 * l } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 };
    let byte = |l: f32| (255.0 * srgb(l.clamp(0.0, 1.0))).round() as u8;
    Ok(image::RgbImage::from_fn(args.size, args.size, |x, y| {
        image::Rgb(rows[y as usize][x as usize].to_array().map(byte))
    }))
}

struct Args {
    scene: PathBuf,
    output: PathBuf,
    size: u32,
    spp: u32,
    seed: u64,
}

fn args() -> Result<Args, Box<dyn Error>> {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/still_life.obj");
    let mut args = Args { scene, output: "path_tracer.png".into(), size: 384, spp: 128, seed: 0 };
    let mut given = std::env::args().skip(1);
    while let Some(arg) = given.next() {
        let mut value = || given.next().ok_or(format!("{arg} wants a value"));
        match arg.as_str() {
            "-o" => args.output = value()?.into(),
            "--size" => args.size = value()?.parse::<u32>()?.clamp(1, 8192),
            "--spp" => args.spp = value()?.parse::<u32>()?.max(1),
            "--seed" => args.seed = value()?.parse()?,
            _ => args.scene = arg.into(),
        }
    }
    Ok(args)
}

fn run() -> Result<(), Box<dyn Error>> {
    let args = args()?;
    let scene = Scene::open(&args.scene)?;
    render(&scene, &args)?.save(&args.output)?;
    println!("{} faces, {} of them lamps: {}", scene.faces.len(), scene.lamps.len(), args.output.display());
    Ok(())
}

fn main() -> std::process::ExitCode {
    match run() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("{e}");
            std::process::ExitCode::FAILURE
        }
    }
}
