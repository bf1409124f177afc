//! The ledger: every statement of the four papers that a computation can confirm, correct or refute, and questions
//! beyond them, with the numbers that decide. All numbers are computed in each run, and verdicts follow from them by
//! stated thresholds.
//!
//! - [`finding`]: numbers, thresholds, verdicts;
//! - [`lab`]: the meshes and small tools that claims share;
//! - one file a paper, and beside it one each for subjects of their own: [`thall`], [`zheng_cai`], [`pia`], [`lin_luo`];
//! - [`open`]: what two of them leave to open meshes;
//! - [`smallest`], [`decay`], [`everywhere`]: what none of them asks, of λ_min, of A⁻¹, of the surface between its vertices;
//! - [`links`]: claims in pages lead to the ledger;
//! - [`findings`]: the page on what is settled and what is wrong, filled with the ledger's numbers.

mod decay;
mod everywhere;
mod finding;
pub mod findings;
mod lab;
mod lin_luo;
mod lin_luo_others;
mod lin_luo_varying;
pub mod links;
mod open;
mod pia;
mod pia_catmull_clark;
mod pia_lemma;
mod smallest;
mod thall;
mod thall_masks;
mod thall_normals;
mod thall_surfaces;
mod zheng_cai;
mod zheng_cai_exact;
mod zheng_cai_faces;
mod zheng_cai_freedom;
mod zheng_cai_fronts;
mod zheng_cai_orders;
mod zheng_cai_speed;

use std::fmt::Write as _;

use serde_json::{Value as Json, json};

use crate::cli::number;
use crate::report::{Column, Columns, Table, readable};
use limitlab::error::Error;
use limitlab::output::write_file;
use limitlab::{Result, names};

use crate::programs::reproduce::context::{Context, Item};
use crate::report::table::{CsvFile, write_page};

use crate::programs::reproduce::pages;
use finding::{Evidence, Finding, Value, Verdict};
use lab::Lab;

pub const LEDGER: Item =
    Item { id: "claims", title: "The papers' claims one by one, with verdicts", question: None, run: run_ledger };

pub const FINDINGS: Item = Item {
    id: "findings",
    title: "Findings: what the papers left open or state wrongly",
    question: None,
    run: |context| run_page(context, "findings.md", findings::FINDINGS),
};

pub const PAPER: Item = Item {
    id: "paper",
    title: "Interpolating subdivision surfaces: what the systems of four papers do",
    question: None,
    run: |context| run_page(context, "paper.md", findings::PAPER),
};

/// A statement of a paper.
pub struct Claim {
    /// As in `--only ID`: the paper's letter and a number.
    pub id: &'static str,
    pub title: &'static str,
    /// Where in the paper.
    pub place: &'static str,
    /// What it says there, in our words.
    pub printed: &'static str,
    /// Too slow for a quick run.
    pub slow: bool,
    pub check: fn(&Lab) -> Result<Finding>,
}

/// A claim with what came of it.
pub struct Record {
    pub claim: &'static Claim,
    pub finding: Finding,
}

/// The papers by the letter of their claims, and what is said here beyond them.
const PAPERS: [(char, &str); 5] = [
    ('T', "Thall 2003, Fast C² Interpolating Subdivision Surfaces"),
    ('Z', "Zheng & Cai 2005, Making Doo-Sabin surface interpolation always work"),
    ('P', "Progressive Iterative Interpolation for Subdivision Surfaces"),
    ('L', "Lin & Luo, A Unified √3 Subdivision Scheme"),
    ('B', "Beyond the papers"),
];

/// All claims in the order of the ledger.
pub fn all() -> impl Iterator<Item = &'static Claim> {
    let thall = [thall::CLAIMS, thall_masks::CLAIMS, thall_normals::CLAIMS];
    let zheng_cai = [
        zheng_cai::CLAIMS,
        open::ZHENG_CAI,
        zheng_cai_exact::CLAIMS,
        zheng_cai_orders::CLAIMS,
        zheng_cai_freedom::CLAIMS,
    ];
    let pia = [pia::CLAIMS, open::PIA, pia_lemma::CLAIMS];
    let lin_luo = [lin_luo::CLAIMS, lin_luo_others::CLAIMS, lin_luo_varying::CLAIMS];
    let beyond = [smallest::CLAIMS, decay::CLAIMS, everywhere::CLAIMS];
    thall.into_iter().chain(zheng_cai).chain(pia).chain(lin_luo).chain(beyond).flatten()
}

pub fn find(id: &str) -> Option<&'static Claim> {
    all().find(|c| names::same(c.id, id))
}

/// Computes some claims, prints them, and holds them against the ledger in `--check`; writes nothing.
///
/// # Errors
/// Those of the computations.
pub fn run_alone(context: &mut Context, claims: &[&'static Claim]) -> Result<()> {
    let records = compute(context, claims.iter().copied())?;
    let sections: Vec<String> = records.iter().map(|r| section(r, shown)).collect();
    context.printer.page(&sections.join("\n"))?;
    context.compare(&table(&records))?;
    context.ledger = records;
    Ok(())
}

fn run_ledger(context: &mut Context) -> Result<()> {
    let quick = context.quick;
    let records = compute(context, all().filter(|c| !(quick && c.slow)))?;
    let table = table(&records);
    let (folder, provenance) = (context.folder(), context.provenance());
    let page = page(context, &records);
    let other = [("as CSV", "claims.csv".into()), ("as JSON", "claims.json".into())];
    write_page(&folder.join("claims.md"), &pages::of_words(&page, &other), &provenance)?;
    table.write_csv_file(&folder.join("claims.csv"), &provenance)?;
    write_file(&folder.join("claims.json"), |out| writeln!(out, "{:#}", json(&records)))?;
    context.printer.page(&page)?;
    context.made.pages += 1;
    context.note_table(&table);
    context.compare(&table)?;
    context.times(|_| Ok(times(&records)))?;
    context.ledger = records;
    Ok(())
}

fn run_page(context: &mut Context, file: &str, text: &str) -> Result<()> {
    if context.quick {
        // Such a page quotes claims that a quick run leaves out.
        return Ok(());
    }
    if context.ledger.is_empty() {
        context.ledger = compute(context, all())?;
    }
    let page = findings::page(text, &context.note_on_meshes(), &context.ledger)?;
    let written = pages::of_words(&page, &[]);
    write_page(&context.folder().join(file), &written, &context.provenance())?;
    context.made.pages += 1;
    context.printer.page(&page)
}

fn compute(context: &Context, claims: impl Iterator<Item = &'static Claim>) -> Result<Vec<Record>> {
    let lab = Lab::new(context);
    claims
        .map(|claim| {
            let finding = (claim.check)(&lab).map_err(|e| Error::Computation(format!("claim {}: {e}", claim.id)))?;
            Ok(Record { claim, finding })
        })
        .collect()
}

/// A number with the claim that it decides.
type Line<'a> = (&'a Record, &'a Evidence);

/// One row for every number of every claim; the durations among them have their values in [`times`] alone, so that
/// this table is the same from run to run.
fn table(records: &[Record]) -> Table {
    // Of a claim without numbers.
    let none = Evidence::shown("", f64::NAN);
    let number = |e: &Evidence| match e.value {
        Value::Number(x) if !e.quantity.is_empty() => Some(x),
        _ => None,
    };
    let count = |e: &Evidence| match e.value {
        Value::Count(n) => Some(n),
        _ => None,
    };
    let columns = Columns::<Line>::new()
        .col(Column::key("claim"), |(r, _)| r.claim.id)
        .col(Column::key("quantity"), |(_, e)| e.quantity.clone())
        .col(Column::remark("title"), |(r, _)| r.claim.title)
        // What is measured with a random start or by sums of many terms differs in the last digits.
        .col(Column::number("value", 1e-4, 6).floor(1e-9), move |(_, e)| number(e))
        .col(Column::count("count"), move |(_, e)| count(e))
        .col(Column::text("relation"), |(_, e)| e.test.map(|t| t.0.sign()))
        .col(Column::number("threshold", 1e-9, 6), |(_, e)| e.test.map(|t| t.1))
        .col(Column::text("holds"), |(_, e)| e.holds().map(|h| if h { "yes" } else { "no" }))
        .col(Column::text("verdict"), |(r, _)| r.finding.verdict().name())
        .col(Column::remark("remark"), |(r, _)| r.finding.remark.clone());
    let lines: Vec<Line> = records
        .iter()
        .flat_map(|r| {
            let evidence = match r.finding.evidence.as_slice() {
                [] => std::slice::from_ref(&none),
                evidence => evidence,
            };
            evidence.iter().map(move |e| (r, e))
        })
        .collect();
    columns.table(LEDGER.id, LEDGER.title, &lines)
}

/// The durations, and ratios of durations, among the numbers of the claims.
fn times(records: &[Record]) -> Table {
    let columns = Columns::<(&Record, &Evidence, f64)>::new()
        .col(Column::key("claim"), |(r, ..)| r.claim.id)
        .col(Column::key("quantity"), |(_, e, _)| e.quantity.clone())
        .col(Column::time("time"), |&(_, _, time)| time);
    let lines: Vec<_> = records
        .iter()
        .flat_map(|r| r.finding.evidence.iter().map(move |e| (r, e)))
        .filter_map(|(r, e)| if let Value::Time(time) = e.value { Some((r, e, time)) } else { None })
        .collect();
    columns.table(format!("{}--times", LEDGER.id), "Seconds, and their ratios, that claims speak of", &lines)
}

pub fn json(records: &[Record]) -> Json {
    let evidence = |e: &Evidence| {
        let value = match e.value {
            Value::Count(n) => n.into(),
            Value::Number(x) => number(x),
            Value::Time(_) => Json::Null,
        };
        json!({
            "quantity": e.quantity,
            "value": value,
            "relation": e.test.map(|t| t.0.sign()),
            "threshold": e.test.map(|t| t.1),
            "holds": e.holds(),
        })
    };
    let record = |Record { claim, finding }: &Record| {
        json!({
            "id": claim.id,
            "title": claim.title,
            "source": source(claim),
            "printed": claim.printed,
            "verdict": finding.verdict().name(),
            "evidence": finding.evidence.iter().map(evidence).collect::<Vec<_>>(),
            "remark": finding.remark,
        })
    };
    records.iter().map(record).collect()
}

fn paper(claim: &Claim) -> &'static str {
    let letter = claim.id.chars().next();
    let found = PAPERS.iter().find(|(l, _)| Some(*l) == letter);
    found.map_or("", |(_, name)| name)
}

fn source(claim: &Claim) -> String {
    format!("{}, {}", paper(claim), claim.place)
}

/// How many claims have a verdict, and which, unless they are as printed.
pub struct Tally {
    pub verdict: &'static str,
    pub claims: usize,
    pub named: Vec<&'static str>,
}

/// The verdicts that occur, from pairs of a claim and the name of its verdict.
fn tallies(claims: &[(&'static str, &str)]) -> Vec<Tally> {
    let tally = |verdict: &Verdict| {
        let ids: Vec<_> = claims.iter().filter(|claim| claim.1 == verdict.name()).map(|claim| claim.0).collect();
        let named = if *verdict == Verdict::Reproduced { Vec::new() } else { ids.clone() };
        Tally { verdict: verdict.name(), claims: ids.len(), named }
    };
    Verdict::ALL.iter().map(tally).filter(|tally| tally.claims > 0).collect()
}

fn tallies_of(records: &[Record]) -> Vec<Tally> {
    tallies(&records.iter().map(|r| (r.claim.id, r.finding.verdict().name())).collect::<Vec<_>>())
}

/// The verdicts in the table of a ledger.
pub fn tallies_in(ledger: &CsvFile) -> Vec<Tally> {
    let place = |name: &str| ledger.header.iter().position(|column| column == name);
    let (Some(claim), Some(verdict)) = (place("claim"), place("verdict")) else {
        return Vec::new();
    };
    let rows = ledger.rows.iter().filter_map(|row| Some((find(&row[claim])?.id, row[verdict].as_str())));
    let mut claims: Vec<_> = rows.collect();
    // A row a number: those of a claim stand together.
    claims.dedup();
    tallies(&claims)
}

/// How many claims have each verdict, those that occur, as `12 reproduced, 3 corrected`.
fn counts(records: &[Record]) -> String {
    let parts = tallies_of(records).into_iter().map(|tally| format!("{} {}", tally.claims, tally.verdict));
    parts.collect::<Vec<_>>().join(", ")
}

/// A line for each verdict that occurs.
pub fn verdicts(records: &[Record]) -> String {
    let mut text = String::new();
    for Tally { verdict, claims, named } in tallies_of(records) {
        let line = format!("{claims:5} {verdict:17} {}", named.join(" "));
        let _ = writeln!(text, "{}", line.trim_end());
    }
    text
}

/// The claims that a quick run leaves out.
pub fn left_out() -> Vec<&'static str> {
    all().filter(|c| c.slow).map(|c| c.id).collect()
}

/// The whole ledger for people: a list with verdicts, then a section a claim.
fn page(context: &Context, records: &[Record]) -> String {
    let mut page = format!(
        "# {}\n\n{}\n\nEach number was computed in the run that wrote this page; each verdict follows from the \
         numbers by the thresholds beside them. *Reproduced*: as printed. *Corrected*: a slip; the right form holds, \
         the printed one does not. *Refuted*: by the counterexample given. *Settled*: left open or not said in the \
         paper, decided here. *In part*: as printed as far as the numbers go; the remark names the rest. *Not decided*: \
         the paper names nothing that the numbers could be held against. *Not reproducible*: with the reason. *Not confirmed*: a number is on the wrong side of \
         its threshold. Numbers are measurements, not proofs: eigenvalues come from dense decompositions, good to \
         rounding, those of large meshes from Lanczos processes that end by their residuals, rates and counts from runs. What is \
         proven of all meshes has its theorem in [findings](findings.md); `spectrum --certify` encloses the ends of the spectra \
         of one mesh between proven numbers. Random meshes are {} closed ones of at most {} vertices with valences from 3, from fixed \
         seeds; L is the diagonal of a mesh's bounding box. `claims.csv` has a row for every number, `claims.json` \
         both, `claims--times.csv` (written with `--times`) the durations.\n\n{} claims: {}.\n",
        LEDGER.title,
        context.note_on_meshes(),
        lab::RANDOM_MESHES,
        lab::RANDOM_VERTICES,
        records.len(),
        counts(records),
    );
    if context.quick {
        let _ = write!(page, "\nQuick run, without {}.\n", left_out().join(", "));
    }
    for (_, name) in PAPERS {
        let own = || records.iter().filter(move |r| paper(r.claim) == name);
        let _ = write!(page, "\n## {name}\n\n| ID | claim | verdict |\n| --- | --- | --- |\n");
        for Record { claim, finding } in own() {
            let verdict = finding.verdict().name();
            let _ = writeln!(page, "| {} | {} | {verdict} |", claim.id, claim.title);
        }
        for record in own() {
            let _ = write!(page, "\n{}", section(record, shown_by_reference));
        }
    }
    page
}

/// A claim for people, its numbers written by `show`.
fn section(Record { claim, finding }: &Record, show: fn(Value) -> String) -> String {
    let mut text = format!(
        "### {} {} — {}\n\n{}. {}\n\n",
        claim.id,
        claim.title,
        finding.verdict().name(),
        claim.place,
        claim.printed
    );
    for e in &finding.evidence {
        let _ = write!(text, "- {}: {}", e.quantity, show(e.value));
        if let Some((relation, threshold)) = e.test {
            let missed = if e.holds() == Some(false) { "; it is not" } else { "" };
            let _ = write!(text, " (to be {} {}{missed})", relation.sign(), shown(threshold.into()));
        }
        text.push('\n');
    }
    if !finding.remark.is_empty() {
        let gap = if finding.evidence.is_empty() { "" } else { "\n" };
        let _ = writeln!(text, "{gap}{}", finding.remark);
    }
    text
}

/// A number for people: six digits at most, whole numbers as such.
fn shown(value: Value) -> String {
    shown_with(value, 6)
}

/// A number in a sentence: three digits, and more only where three would make it a whole one, which it is not.
fn in_prose(value: Value) -> String {
    let rounded = (3..6).map(|digits| shown_with(value, digits));
    rounded.into_iter().find(|text| text.contains('.')).unwrap_or_else(|| shown(value))
}

fn shown_with(value: Value, digits: usize) -> String {
    let x = value.number();
    match value {
        Value::Count(n) => n.to_string(),
        Value::Time(_) => readable(x, 2),
        Value::Number(_) if x.fract() == 0.0 && x.abs() < 1e6 => x.to_string(),
        Value::Number(_) if x.abs() < 1e-3 => readable(x, 2),
        Value::Number(_) => {
            let text = readable(x, digits);
            match text.contains('.') && !text.contains('e') {
                true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
                false => text,
            }
        }
    }
}

/// As [`shown`]; durations are named by their place, so that the page is the same from run to run.
fn shown_by_reference(value: Value) -> String {
    match value {
        Value::Time(_) => format!("see {}--times.csv", LEDGER.id),
        Value::Number(_) | Value::Count(_) => shown(value),
    }
}

#[cfg(test)]
mod tests;
