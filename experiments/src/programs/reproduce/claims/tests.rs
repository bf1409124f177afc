use super::*;

/// The list of the papers' statements, and those found beside it.
const IDS: [(char, usize); 5] = [('T', 36), ('Z', 32), ('P', 20), ('L', 17), ('B', 4)];

#[test]
fn every_statement_is_in_the_ledger_once_and_in_order() {
    let wanted: Vec<String> =
        IDS.iter().flat_map(|&(letter, count)| (1..=count).map(move |k| format!("{letter}{k}"))).collect();
    let found: Vec<&str> = all().map(|c| c.id).collect();
    assert_eq!(found, wanted);
    assert!(all().all(|c| !c.title.is_empty() && !c.place.is_empty() && c.printed.ends_with('.')));
    assert!(all().all(|c| !paper(c).is_empty()));
    // Items and claims share one name space.
    assert!([LEDGER, FINDINGS, PAPER].iter().all(|item| find(item.id).is_none()));
}

fn record(finding: Finding) -> Record {
    Record { claim: find("T1").unwrap(), finding }
}

#[test]
fn a_claim_without_numbers_still_has_its_row() {
    let records = [record(Finding::not_reproducible("no model"))];
    let csv = table(&records).to_csv();
    let row = csv.lines().nth(1).unwrap();
    assert!(row.starts_with("T1,,") && row.ends_with("not reproducible,no model"), "{row}");
    assert!(section(&records[0], shown).contains("not reproducible"));
    assert_eq!(json(&records)[0]["verdict"], "not reproducible");
    assert_eq!(counts(&records), "1 not reproducible");
}

#[test]
fn a_number_on_the_wrong_side_is_told_everywhere() {
    let finding = Finding::reproduced(vec![
        Evidence::at_most("deviation", 0.25, 1e-12),
        Evidence::equal("misses", 0_usize, 0.0),
        Evidence::shown("seconds", Value::Time(0.5)),
    ]);
    let records = [record(finding)];
    assert!(section(&records[0], shown).contains("- deviation: 0.25 (to be ≤ 1.0e-12; it is not)\n"));
    assert_eq!(json(&records)[0]["evidence"][0]["holds"], false);
    let csv = table(&records).to_csv();
    let rows: Vec<&str> = csv.lines().skip(1).collect();
    assert!(rows[0].contains(",0.25,,≤,1e-12,no,not confirmed,"), "{}", rows[0]);
    assert!(rows[1].contains(",,0,=,0,yes,not confirmed,"), "{}", rows[1]);
    assert!(rows[2].contains(",,,,,,not confirmed,"), "{}", rows[2]);
    // Durations stand in a file of their own, so that the others are the same from run to run.
    assert!(!csv.contains("0.5") && !json(&records).to_string().contains("0.5"));
    assert!(!section(&records[0], shown_by_reference).contains("0.5"));
    assert!(section(&records[0], shown).contains("- seconds: 0.50\n"));
    assert_eq!(times(&records).to_csv(), "claim,quantity,time\nT1,seconds,0.5\n");
}

#[test]
fn numbers_are_shown_with_six_digits_or_two_where_they_are_small() {
    for (value, text) in [
        (0.00123, "0.00123"),
        (0.005, "0.005"),
        (0.000999, "0.0010"),
        (1.23e-9, "1.2e-9"),
        (2.0 / 3.0, "0.666667"),
        (3.0, "3"),
        (1234567.5, "1.23457e6"),
    ] {
        assert_eq!(shown(value.into()), text);
    }
    assert_eq!(shown(Value::Count(12)), "12");
    assert_eq!(shown(Value::Time(0.12345)), "0.12");
}

#[test]
fn numbers_in_sentences_have_three_digits_unless_that_makes_them_whole() {
    for (value, text) in [
        (1.61538, "1.62"),
        (0.0128811, "0.0129"),
        (8.1e-15, "8.1e-15"),
        (0.99961, "0.9996"),
        (0.999996, "0.999996"),
        (1703.09, "1703.1"),
        (12.0, "12"),
        (0.25, "0.25"),
    ] {
        assert_eq!(in_prose(value.into()), text);
    }
    assert_eq!(in_prose(Value::Count(1234)), "1234");
}
