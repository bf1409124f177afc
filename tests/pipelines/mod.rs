//! The papers' whole methods held against exact identities, real refinement, and a second way to the same result.

mod fair_refinement;
mod front_door;
mod halstead;
mod lin_luo;
mod lin_luo_limits;
mod thall;
mod zheng_cai;
