//! The one place where a [`Provenance`] is made: from the command line as clap understood it, the clock, the build.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use clap::{ArgAction, ArgMatches, Command, Parser};
use serde_json::Value;

use super::input::all_fields;
use super::json::json_text;
use super::print_json;
use crate::report::provenance::{Provenance, Run, quoted};
use limitlab::error::Result;

/// Arguments of a program, and what its files say of them. Ends the program with status 2 if they are wrong, as
/// [`Parser::parse`] does.
pub fn parse<A: Parser>() -> (A, Provenance) {
    let mut command = A::command();
    let matches = command.get_matches_mut();
    let arguments = A::from_arg_matches(&matches).unwrap_or_else(|error| error.format(&mut command).exit());
    (arguments, provenance(&command, &matches))
}

/// What files say of a run of this program, whose arguments these are. The number of threads is known once they are started.
pub fn provenance(program: &Command, arguments: &ArgMatches) -> Provenance {
    let option = |argument: &clap::Arg| {
        let id = argument.get_id().as_str();
        let values = || arguments.get_raw(id).into_iter().flatten().map(|value| Value::from(value.to_string_lossy()));
        let value = match argument.get_action() {
            ArgAction::SetTrue => arguments.get_flag(id).into(),
            ArgAction::Append => values().collect(),
            ArgAction::Set => values().next().unwrap_or(Value::Null),
            _ => return None,
        };
        Some((argument.get_long().unwrap_or(id).to_owned(), value))
    };
    Provenance {
        program: program.get_name().into(),
        version: env!("CARGO_PKG_VERSION").into(),
        command: command_line(),
        options: program.get_arguments().filter_map(option).collect(),
        run: Some(Run { commit: env!("LIMITLAB_COMMIT").into(), date: now() }),
        ..Provenance::default()
    }
}

/// The command as it can be pasted, its program without folder.
fn command_line() -> String {
    let mut words: Vec<String> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    if let Some(program) = words.first_mut()
        && let Some(name) = Path::new(program).file_name()
    {
        *program = name.to_string_lossy().into_owned();
    }
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

/// The time in UTC, as RFC 3339 writes it.
fn now() -> String {
    // A clock before 1970 is not worth an error.
    date(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs()))
}

/// The date of so many seconds since 1970: years that begin in March have their leap day last, and eras of 400 of them
/// have 146097 days (Hinnant, *chrono-compatible low-level date algorithms*, 2013).
fn date(seconds: u64) -> String {
    let (days, second) = (seconds / 86_400 + 719_468, seconds % 86_400);
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let (year, month) = (400 * era + year + month / 10, (month + 2) % 12 + 1);
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

/// Prints the JSON object of a program: `fields`, how they came about, and the files that were replaced.
///
/// # Errors
/// If standard output cannot be written.
///
/// # Panics
/// If `fields` is not an object.
pub fn print_object(fields: Value, provenance: &Provenance) -> Result<()> {
    let mut object = all_fields(provenance.fields(), fields);
    object["replaced"] = limitlab::output::replaced().iter().map(|path| Value::from(path.to_string_lossy())).collect();
    print_json(&object)
}

/// The file beside a system for other programs: what it is of, and how it came about.
pub const MANIFEST: &str = "manifest.json";

/// The JSON of a file about what a program wrote: `fields`, and how they came about.
///
/// # Errors
/// If a value has no JSON.
///
/// # Panics
/// If `fields` is not an object.
pub fn object_text(fields: &Value, provenance: &Provenance) -> Result<Vec<u8>> {
    let mut text = json_text(&all_fields(provenance.fields(), fields.clone()))?;
    text.push(b'\n');
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        // By GNU date: `date -u -d @951782400`.
        for (seconds, expected) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_399, "2000-02-28T23:59:59Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (951_868_800, "2000-03-01T00:00:00Z"),
            (1_709_251_199, "2024-02-29T23:59:59Z"),
            (1_735_689_599, "2024-12-31T23:59:59Z"),
            (1_735_689_600, "2025-01-01T00:00:00Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            assert_eq!(date(seconds), expected);
        }
        // Every month of a year that is none of leap.
        let lengths = [31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
        let mut seconds = 1_735_689_600;
        for (month, days) in (1..).zip(lengths) {
            assert_eq!(date(seconds), format!("2025-{month:02}-01T00:00:00Z"));
            seconds += days * 86_400;
        }
    }
}
