//! The methods held against manufactured solutions, direct solves, loops made by hand with dense matrices, closed-form
//! rates; and what they say of singular systems and other impossible tasks.

mod accelerated;
mod back_ends;
mod foreign;
mod handmade;
mod invariance;
mod methods;
mod outcomes;
mod predictions;
mod rates;
mod singular;
mod solutions;
mod starts;
