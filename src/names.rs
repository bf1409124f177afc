//! Names as people type them: found whatever their case and separators, with a suggestion where they are misspelt.

use crate::error::one_of;
use crate::{Error, Result};

/// What `text` names. Case, `-`, `_` and spaces do not count; `aliases` are further names, which messages do not list.
///
/// ```
/// use limitlab::names::find;
///
/// let names = [("edge-and-corner", 1), ("refuse", 2)];
/// assert_eq!(find("boundary", "Edge_And_Corner", &names, &[("none", 2)])?, 1);
/// let error = find("boundary", "refus", &names, &[]).unwrap_err().to_string();
/// assert_eq!(error, "unknown boundary \"refus\" (perhaps refuse?): use edge-and-corner or refuse");
/// # Ok::<(), limitlab::Error>(())
/// ```
///
/// # Errors
/// [`Error::Unknown`] if nothing is called so: the nearest name, if one is near, and all of them.
pub fn find<T: Copy>(kind: &str, text: &str, names: &[(&str, T)], aliases: &[(&str, T)]) -> Result<T> {
    if let Some((_, value)) = names.iter().chain(aliases).find(|(name, _)| same(name, text)) {
        return Ok(*value);
    }
    let all: Vec<&str> = names.iter().map(|(name, _)| *name).collect();
    let perhaps = perhaps(text, all.iter().copied());
    Err(Error::Unknown(format!("unknown {kind} \"{text}\"{perhaps}: use {}", one_of(&all))))
}

/// Whether two names differ at most in case and separators.
pub fn same(a: &str, b: &str) -> bool {
    letters(a).eq(letters(b))
}

/// ` (perhaps NAME?)` if one of the names is near to `text`, else nothing.
pub fn perhaps<'n>(text: &str, names: impl IntoIterator<Item = &'n str>) -> String {
    nearest(text, names).map_or_else(String::new, |name| format!(" (perhaps {name}?)"))
}

fn letters(name: &str) -> impl Iterator<Item = char> {
    name.chars().filter(|c| !matches!(c, '-' | '_' | ' ')).flat_map(char::to_lowercase)
}

/// The name with the fewest changes from `text`, at most one for every three letters, or the first that `text` begins.
fn nearest<'n>(text: &str, names: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    /// Letters of a beginning that say enough.
    const BEGINNING: usize = 3;
    let typed: Vec<char> = letters(text).collect();
    let rank = |name: &str| {
        let name: Vec<char> = letters(name).collect();
        let changes = changes(&typed, &name);
        let begins = typed.len() >= BEGINNING && name.starts_with(&typed);
        if begins { Some(0) } else { (3 * changes <= name.len()).then_some(changes) }
    };
    let ranked = names.into_iter().filter_map(|name| Some((rank(name)?, name)));
    ranked.min_by_key(|&(rank, _)| rank).map(|(_, name)| name)
}

/// Levenshtein's distance: insertions, deletions and replacements from one word to the other.
fn changes(a: &[char], b: &[char]) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_counted_by_hand() {
        let distance = |a: &str, b: &str| changes(&a.chars().collect::<Vec<_>>(), &b.chars().collect::<Vec<_>>());
        for (a, b, d) in [("", "", 0), ("", "pia", 3), ("kitten", "sitting", 3), ("sor", "ssor", 1), ("abc", "acb", 2)]
        {
            assert_eq!((distance(a, b), distance(b, a)), (d, d), "{a}, {b}");
        }
    }

    #[test]
    fn what_is_far_from_all_names_gets_no_suggestion() {
        let near = |text| nearest(text, ["catmull-clark", "loop", "lu"]);
        assert_eq!(near("catmul_clarc"), Some("catmull-clark"));
        assert_eq!(near("CATMULL"), Some("catmull-clark"));
        assert_eq!(near("lop"), Some("loop"));
        assert_eq!([near("butterfly"), near("lx"), near("c"), near("")], [None; 4]);
    }
}
