//! Vectors over any [`Real`]: what lobe maths uses in local coordinates, where z is the normal.

use super::real::{Lift, Real};
use core::ops::{Add, Mul, Neg, Sub};

/// Three numbers: a direction, usually in a lobe's local frame with z along the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct V3<R> {
    /// Along the tangent.
    pub x: R,
    /// Along the bitangent.
    pub y: R,
    /// Along the normal.
    pub z: R,
}

impl<T> V3<T> {
    /// The vector (x, y, z).
    #[inline(always)]
    pub fn new(x: T, y: T, z: T) -> Self {
        V3 { x, y, z }
    }

    /// The same in a place of its own. What is passed to a call by reference, or comes from one, is kept in memory all its
    /// life; this copy need not be.
    #[inline(always)]
    pub fn apart(self) -> Self {
        V3::new(self.x, self.y, self.z)
    }

    /// `f` of each component.
    #[inline(always)]
    pub fn map<U>(self, f: impl Fn(T) -> U) -> V3<U> {
        V3::new(f(self.x), f(self.y), f(self.z))
    }
}

impl<R: Real> V3<R> {
    /// Brings a scalar vector into the evaluating type.
    #[inline(always)]
    pub fn lift<S: Real>(v: V3<S>) -> Self
    where
        R: Lift<S>,
    {
        V3::new(R::lift(v.x), R::lift(v.y), R::lift(v.z))
    }

    /// From script values.
    #[inline(always)]
    pub fn from_f32(v: [f32; 3]) -> Self {
        V3::new(R::from_f32(v[0]), R::from_f32(v[1]), R::from_f32(v[2]))
    }

    /// The direction with polar angle acos(`cos`) and azimuth `phi` about z.
    #[inline(always)]
    pub fn polar(cos: R, phi: R) -> Self {
        let sin = (R::one() - cos * cos).safe_sqrt();
        let (s, c) = phi.sin_cos();
        V3::new(sin * c, sin * s, cos)
    }

    /// x·x′ + y·y′ + z·z′.
    #[inline(always)]
    pub fn dot(self, o: Self) -> R {
        self.x.mul_add(o.x, self.y.mul_add(o.y, self.z * o.z))
    }

    /// The vector product.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        V3::new(self.y * o.z - self.z * o.y, self.z * o.x - self.x * o.z, self.x * o.y - self.y * o.x)
    }

    /// Its squared length.
    #[inline(always)]
    pub fn length_squared(self) -> R {
        self.dot(self)
    }

    /// Each component times `s`.
    #[inline(always)]
    pub fn scale(self, s: R) -> Self {
        V3::new(self.x * s, self.y * s, self.z * s)
    }
}

impl<R: Real> Add for V3<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        V3::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl<R: Real> Sub for V3<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        V3::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl<R: Real> Neg for V3<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        V3::new(-self.x, -self.y, -self.z)
    }
}

impl<R: Real> Mul<R> for V3<R> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: R) -> Self {
        self.scale(s)
    }
}
