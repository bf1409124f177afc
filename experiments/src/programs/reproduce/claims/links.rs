//! Links to claims: wherever a page names one.

use super::{LEDGER, find};

/// A page of Markdown whose claims lead to their places in the ledger; a heading that starts with a claim is such a
/// place. Other headings, and what is quoted as code, stay as they are.
pub fn linked(page: &str) -> String {
    page.split_inclusive('\n').map(|line| if line.starts_with('#') { place(line) } else { with_links(line) }).collect()
}

/// A heading, with the place that links lead to before it.
fn place(heading: &str) -> String {
    let first = heading.trim_start_matches('#').split_whitespace().next();
    match first.filter(|word| is_claim(word)) {
        Some(id) => format!("<a id=\"{}\"></a>\n\n{heading}", id.to_lowercase()),
        None => heading.to_owned(),
    }
}

fn with_links(line: &str) -> String {
    let mut out = String::with_capacity(line.len());
    for (k, part) in line.split('`').enumerate() {
        if k > 0 {
            out.push('`');
        }
        if k % 2 == 1 {
            out.push_str(part);
            continue;
        }
        // Words, with what is between them as words too.
        let mut rest = part;
        while let Some(c) = rest.chars().next() {
            let of_word = |c: char| c.is_alphanumeric() || matches!(c, '_' | '^' | '-' | '/' | '.' | '#');
            let end = rest.find(|d| of_word(d) != of_word(c)).unwrap_or(rest.len());
            let (word, further) = rest.split_at(end);
            let id = word.trim_end_matches('.');
            if is_claim(id) {
                out.push_str(&format!("[{id}]({}.md#{}){}", LEDGER.id, id.to_lowercase(), &word[id.len()..]));
            } else {
                out.push_str(word);
            }
            rest = further;
        }
    }
    out
}

fn is_claim(word: &str) -> bool {
    find(word).is_some_and(|claim| claim.id == word)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn claims_become_links_where_they_are_words() {
        for (text, expected) in [
            ("Settled (T5, Z10).", "Settled ([T5](claims.md#t5), [Z10](claims.md#z10))."),
            ("By P7.\n", "By [P7](claims.md#p7).\n"),
            ("| T1 | x |", "| [T1](claims.md#t1) | x |"),
            ("## 3 by T5", "## 3 by T5"),
            ("### T5 Title\ntext", "<a id=\"t5\"></a>\n\n### T5 Title\ntext"),
            ("`T5` T99 xT5 T5x T_5 t5 S^T5 a-T5.md", "`T5` T99 xT5 T5x T_5 t5 S^T5 a-T5.md"),
        ] {
            assert_eq!(linked(text), expected);
        }
    }
}
