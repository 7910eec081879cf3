//! Scenes, integrator, film: pictures of a material.
