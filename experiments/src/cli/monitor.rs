//! Convergence monitor: the errors of iterates on standard error as they come, as `-ksp_monitor` of PETSc has them.

use std::fmt::Display;

use clap::Args;

use super::CommonFlags;
use limitlab::solvers::Errors;

/// The flag of programs that iterate.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct MonitorFlags {
    /// Say the errors of every iterate on standard error as it comes, a line each and no bar; with --quiet too
    #[arg(long)]
    pub monitor: bool,
}

impl MonitorFlags {
    /// Whether no bar is drawn: lines take its place.
    pub fn no_bar(&self, common: &CommonFlags) -> bool {
        common.quiet || self.monitor
    }

    /// A line about an iterate of the run `of`, if lines were asked for.
    pub fn see(&self, of: impl Display, iteration: usize, errors: Errors) {
        self.see_of("error", of, iteration, errors);
    }

    /// As [`see`](Self::see), where an iterate is measured by another `quantity`.
    pub fn see_of(&self, quantity: &str, of: impl Display, iteration: usize, errors: Errors) {
        if self.monitor {
            let Errors { max, mean } = errors;
            super::say(format_args!(
                "{of}: iteration {iteration}: max {quantity} {max:.6e}, mean {quantity} {mean:.6e}"
            ));
        }
    }
}
