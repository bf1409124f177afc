//! The unified schemes of Lin & Luo (2007): one parameter α a point blends an approximating scheme with an
//! interpolatory one, for curves ([`curve`]) and for triangle meshes ([`surface`], its limit in [`limit`]). No system is solved: a point is
//! interpolated because its own α says so.
//!
//! The two senses are opposite, as printed: a *curve* interpolates where α = 0 and is a cubic B-spline at α = 1; a
//! *surface* interpolates where α = 1 and is Kobbelt's √3 surface at α = 0.

pub mod curve;
pub mod limit;
pub mod surface;
