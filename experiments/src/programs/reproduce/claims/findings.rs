//! The page of findings, what the papers left open or state wrongly, with proofs in a few lines, and the report in the form
//! of a paper that sums them up: pages with the ledger's numbers in them.

use limitlab::Result;
use limitlab::error::Error;

use super::{Record, in_prose};

/// In these texts `{{ID}}` stands for the verdict of a claim, `{{ID|start of a quantity}}` for a number of it.
pub const FINDINGS: &str = include_str!("findings.md");
pub const PAPER: &str = include_str!("paper.md");

/// The findings, a numbered line each.
pub fn headings() -> impl Iterator<Item = &'static str> {
    FINDINGS.lines().filter_map(|line| line.strip_prefix("## "))
}

/// A text with the ledger's numbers.
///
/// # Errors
/// A placeholder that names no claim or number of the ledger.
pub fn page(text: &str, note_on_meshes: &str, records: &[Record]) -> Result<String> {
    Ok(fill(text, records)?.replace("(meshes)", note_on_meshes))
}

fn fill(text: &str, records: &[Record]) -> Result<String> {
    let mut page = String::with_capacity(2 * text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, further) = after.split_once("}}").unwrap_or((after, ""));
        page.push_str(before);
        page.push_str(&look_up(name, records)?);
        rest = further;
    }
    page.push_str(rest);
    Ok(page)
}

fn look_up(name: &str, records: &[Record]) -> Result<String> {
    let (id, quantity) = name.split_once('|').unwrap_or((name, ""));
    let record = records.iter().find(|r| r.claim.id == id);
    let found = match (record, quantity) {
        (None, _) => None,
        (Some(r), "") => Some(format!("{id}: {}", r.finding.verdict().name())),
        (Some(r), _) => {
            let evidence = &r.finding.evidence;
            // The whole name first: "runs" is not "runs that failed".
            let exact = evidence.iter().find(|e| e.quantity == quantity);
            let start = || evidence.iter().find(|e| e.quantity.starts_with(quantity));
            exact.or_else(start).map(|e| in_prose(e.value))
        }
    };
    found.ok_or_else(|| Error::Computation(format!("a page quotes {name}, which is not in the ledger")))
}

#[cfg(test)]
mod tests {
    use super::super::find;
    use super::super::finding::{Evidence, Finding};
    use super::*;

    fn records() -> Vec<Record> {
        let evidence = vec![Evidence::at_most("deviation from 1", 0.5, 1.0), Evidence::shown("meshes", 3_usize)];
        vec![Record { claim: find("Z12").unwrap(), finding: Finding::settled(evidence) }]
    }

    #[test]
    fn numbers_and_verdicts_are_filled_in() {
        let page = fill("{{Z12}} by {{Z12|dev}} on {{Z12|meshes}}, Σ_{F}.", &records()).unwrap();
        assert_eq!(page, "Z12: settled by 0.5 on 3, Σ_{F}.");
    }

    #[test]
    fn a_number_that_is_not_there_is_an_error() {
        for text in ["{{Z12|nothing}}", "{{T1}}", "{{X1|deviation}}"] {
            assert!(fill(text, &records()).is_err(), "{text}");
        }
    }

    #[test]
    fn the_pages_name_claims_that_exist() {
        for part in [FINDINGS, PAPER].iter().flat_map(|text| text.split("{{").skip(1)) {
            let name = part.split(['}', '|']).next().unwrap();
            assert!(find(name).is_some(), "{name}");
        }
    }

    #[test]
    fn the_paper_has_a_row_for_every_finding() {
        let rows: Vec<_> = PAPER.lines().filter_map(|line| line.strip_prefix("| [")?.split_once(']')).collect();
        for heading in headings() {
            let (number, _) = heading.split_once(". ").unwrap();
            let place = format!("(findings.md#{})", crate::report::index::anchor(heading));
            assert!(rows.iter().any(|(n, rest)| *n == number && rest.starts_with(&place)), "{number}: {place}");
        }
    }

    #[test]
    fn the_readme_lists_the_findings_with_their_places() {
        let readme = include_str!("../../../../../README.md");
        for heading in headings() {
            let (number, title) = heading.split_once(". ").unwrap();
            // As the anchors of rendered Markdown.
            let kept = heading.to_lowercase().replace(' ', "-");
            let anchor: String = kept.chars().filter(|c| c.is_alphanumeric() || matches!(c, '-' | '_')).collect();
            let line = format!("{number}. [{title}](reports/built-in/findings.md#{anchor})");
            assert!(readme.lines().any(|l| l == line), "{line}");
        }
    }
}
