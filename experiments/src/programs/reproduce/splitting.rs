//! Splitting matrices of all schemes, Thall's printed tables, Lin and Luo's condition, characteristic maps.

use limitlab::Result;
use limitlab::analysis::splitting::{LocalScheme, rows};

use crate::programs::reproduce::context::{Context, Item, Question};
use crate::studies::splitting::{figures, sampled, tables};

pub const LOCAL: Item = Item {
    id: "splitting",
    title: "Splitting matrices, masks and characteristic maps; Lin-Luo's condition over α",
    question: Some(Question {
        asks: "Are the papers' splitting matrices, masks and eigenvalue conditions right?",
        answer: "Most are as printed (T19, T20, T22, T23, L9), some have slips (T9, T21, T24, T31), and Lin and Luo's \
                 condition fails within the range that they give (L8).",
    }),
    run,
};

const VALENCES: std::ops::RangeInclusive<usize> = 3..=12;

/// No mesh is involved: the results stand with those on built-in meshes.
fn run(context: &mut Context) -> Result<()> {
    if context.real() {
        return Ok(());
    }
    let valences: Vec<usize> = VALENCES.collect();
    let mut schemes = vec![LocalScheme::Loop];
    if !context.quick {
        schemes.extend([
            LocalScheme::CatmullClark,
            LocalScheme::DooSabin,
            LocalScheme::Sqrt3 { alpha: 0.0 },
            LocalScheme::Sqrt3 { alpha: 1.0 },
        ]);
    }
    for scheme in schemes {
        let rows = rows(scheme, &valences)?;
        let sampled = sampled(scheme, &valences)?;
        for mut table in tables(scheme, &valences, &rows, sampled.as_ref())? {
            table.id = named(&table.id);
            context.table(table)?;
        }
        for (stem, figure) in figures(scheme, &valences, sampled.as_ref())? {
            context.figure(&named(&stem), &figure)?;
        }
    }
    Ok(())
}

/// File names of an item start with its ID and two dashes.
fn named(stem: &str) -> String {
    let rest = stem.strip_prefix("splitting-").unwrap_or(stem);
    format!("{}--{rest}", LOCAL.id)
}
