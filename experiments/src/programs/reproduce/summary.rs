//! Summary of a whole run on one screen: the verdicts, the findings, where the tables are.

use std::fmt::Write as _;

use crate::programs::reproduce::claims;
use crate::programs::reproduce::context::{Context, Made};

/// The screen; `made` is what all items made.
pub fn screen(context: &Context, made: &Made) -> String {
    let folder = context.folder();
    let mut text =
        format!("The papers' claims, {} of them ({}):\n", context.ledger.len(), folder.join("claims.md").display());
    text.push_str(&claims::verdicts(&context.ledger));
    if context.quick {
        let _ = writeln!(
            text,
            "A quick run leaves out {}, and the pages of words that quote them.",
            claims::left_out().join(", ")
        );
    } else {
        let _ = writeln!(text, "\nWhat they left open or state wrongly ({}):", folder.join("findings.md").display());
        for heading in claims::findings::headings() {
            let _ = writeln!(text, "  {heading}");
        }
    }
    let _ = write!(
        text,
        "\n{made} in {}; the report with its pictures: {}.\nOne again, with its tables on the screen: --only ID; all IDs: --list.",
        folder.display(),
        context.index().display(),
    );
    text
}
