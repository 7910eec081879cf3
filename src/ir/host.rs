//! What a script may ask of the program it runs in.

use super::shader::Value;
use super::types::Ty;
use crate::globals::Globals;
use std::fmt;

/// What a script says while it runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Speech {
    /// `printf`
    Print,
    /// `warning`
    Warning,
    /// `error`
    Error,
}

/// One lookup of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lookup<'a> {
    /// The file as the script names it.
    pub name: &'a str,
    /// Coordinates; 0..1 spans the picture, t downward.
    pub s: f32,
    /// The second coordinate.
    pub t: f32,
    /// How each direction goes on beyond the picture: `periodic`, `clamp`, `black`, `mirror`, `default`.
    pub wrap: [&'a str; 2],
    /// The first channel asked for.
    pub first_channel: i32,
    /// What takes the place of a missing picture.
    pub missing: Option<[f32; 4]>,
    /// The interpolation: `closest`, `linear`, `cubic`, `smartcubic`.
    pub interpolation: &'a str,
    /// The color space the picture is said to be in; empty: by its file.
    pub colorspace: &'a str,
    /// How s and t change by one pixel to the right, then how they change by one pixel down: as the script says, or as
    /// they follow from [`Globals::differentials`] for a host that gives these; else 0.
    pub changes: [[f32; 2]; 2],
}

/// What scripts ask about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// `transform("world", …)`, `matrix("object", 1)`
    Spaces,
    /// `getattribute`, `raytype`, `isconnected`
    Attributes,
    /// `texture`, `gettextureinfo`
    Textures,
    /// `printf`, `warning`, `error`
    Speech,
    /// `Dx`, `filterwidth`, `calculatenormal`: whether [`Globals::differentials`] is filled in.
    Derivatives,
}

/// What the host at hand, if any, answers at all.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Answers(u8);

impl Answers {
    /// Of a host.
    pub fn of(host: Option<&dyn Host>) -> Answers {
        let all = [Subject::Spaces, Subject::Attributes, Subject::Textures, Subject::Speech, Subject::Derivatives];
        let known = |subject: &Subject| host.is_some_and(|host| host.answers(*subject));
        Answers(all.iter().filter(|s| known(s)).map(|s| 1 << *s as u8).sum())
    }

    /// Whether anything is answered about a subject.
    pub fn on(self, subject: Subject) -> bool {
        self.0 & 1 << subject as u8 != 0
    }
}

/// Answers to the questions of scripts; every one has a plain answer by default. Called from any thread.
pub trait Host: Send + Sync {
    /// Whether it says anything about a subject. What it says nothing about is settled before shading. By default all
    /// but derivatives.
    fn answers(&self, subject: Subject) -> bool {
        subject != Subject::Derivatives
    }

    /// The matrix from `space` to the space that `P` and `N` are in, rows first, points as rows on its left. `None`: no
    /// such space. By default every space is the same.
    fn matrix(&self, space: &str, globals: &Globals) -> Option<[f32; 16]> {
        let _ = (space, globals);
        None
    }

    /// The attribute `name` of the object called `object` (empty: the one being shaded), as a `ty`.
    fn attribute(&self, object: &str, name: &str, ty: Ty, globals: &Globals) -> Option<Value> {
        let _ = (object, name, ty, globals);
        None
    }

    /// Element `index` of an attribute that is an array or a matrix, as a `ty`.
    fn attribute_element(&self, object: &str, name: &str, index: usize, ty: Ty, globals: &Globals) -> Option<Value> {
        let _ = (object, name, index, ty, globals);
        None
    }

    /// What `gettextureinfo` asks of a picture – `resolution`, `channels`, `exists`, … –, element `index` of it, as a
    /// `ty`.
    fn texture_info(&self, name: &str, what: &str, index: usize, ty: Ty) -> Option<Value> {
        let _ = (name, what, index, ty);
        None
    }

    /// Whether the ray is of a kind: `camera`, `shadow`, `diffuse`, `glossy`, …
    fn is_ray(&self, kind: &str, globals: &Globals) -> bool {
        let _ = (kind, globals);
        false
    }

    /// Whether something is connected to a parameter of the shader.
    fn is_connected(&self, param: &str) -> bool {
        let _ = param;
        false
    }

    /// Color and alpha of a picture; `None` if it is missing. Linear RGB with the primaries the renderer works in: decode
    /// what is stored otherwise (8 bits are sRGB unless [`Lookup::colorspace`] says so); numbers are not changed after this.
    fn texture(&self, lookup: &Lookup, globals: &Globals) -> Option<[f32; 4]> {
        let _ = (lookup, globals);
        None
    }

    /// What the script prints.
    fn say(&self, speech: Speech, text: &str) {
        let _ = (speech, text);
    }
}

impl fmt::Debug for dyn Host {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Host")
    }
}
