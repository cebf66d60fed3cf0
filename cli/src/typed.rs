//! Times by the clock, counts and sizes, as they are typed.

use std::time::Duration;

const TIMES: &str = "write a time like 600 (seconds), 90s, 90m, 1h30m or 2d, or as Slurm does: 1:30:00 \
                     (hours:minutes:seconds), 90:00 (minutes:seconds), 1-12:00:00 (days-hours:minutes:seconds)";

/// A time by the clock: seconds, `1h30m`, or as Slurm writes it, `1-12:00:00`, `1:30:00` or `90:00`. A number alone
/// is seconds, which Slurm takes for minutes.
pub fn duration(text: &str) -> Result<Duration, String> {
    let text = text.trim();
    let seconds = if text.contains([':', '-']) { clock(text) } else { units(text) };
    let time = seconds.and_then(|s| Duration::try_from_secs_f64(s).ok()).filter(|time| !time.is_zero());
    time.ok_or_else(|| TIMES.to_owned())
}

/// The seconds of `days-hours`, `days-hours:minutes`, `days-hours:minutes:seconds`, `hours:minutes:seconds` or
/// `minutes:seconds`.
fn clock(text: &str) -> Option<f64> {
    let (days, rest) = text.split_once('-').map_or((None, text), |(days, rest)| (Some(days), rest));
    let parts: Vec<&str> = rest.split(':').collect();
    // Of the first part; those after it are each a sixtieth.
    let mut unit = match (days, parts.len()) {
        (Some(_), 1..=3) | (None, 3) => 3600.0,
        (None, 2) => 60.0,
        _ => return None,
    };
    let mut total = days.map_or(Some(0.0), whole)? * 86_400.0;
    for part in parts {
        total += unit * if unit == 1.0 { number(part)? } else { whole(part)? };
        unit /= 60.0;
    }
    Some(total)
}

/// The seconds of numbers, each with its unit; the last is seconds if it has none.
fn units(text: &str) -> Option<f64> {
    let (mut total, mut rest) = (0.0, text);
    while !rest.is_empty() {
        let end = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
        let (count, after) = rest.split_at(end);
        let unit = match after.chars().next() {
            Some('d') => 86_400.0,
            Some('h') => 3600.0,
            Some('m') => 60.0,
            Some('s') | None => 1.0,
            Some(_) => return None,
        };
        total += unit * number(count)?;
        rest = after.get(1..).unwrap_or_default();
    }
    Some(total)
}

fn whole(text: &str) -> Option<f64> {
    text.parse::<u32>().ok().filter(|_| !text.starts_with('+')).map(f64::from)
}

fn number(text: &str) -> Option<f64> {
    let plain = !text.is_empty() && text.bytes().all(|c| c.is_ascii_digit() || c == b'.');
    text.parse().ok().filter(|_| plain)
}

/// A number of steps.
pub fn count(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| "write a whole number, 0 or more".to_owned())
}

/// Bytes: `8G`, `500M`, or a number.
pub fn size(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let (number, unit) = match text.char_indices().next_back() {
        Some((at, 'k' | 'K')) => (&text[..at], 1e3),
        Some((at, 'M')) => (&text[..at], 1e6),
        Some((at, 'G')) => (&text[..at], 1e9),
        Some((at, 'T')) => (&text[..at], 1e12),
        _ => (text, 1.0),
    };
    let bytes = number.parse::<f64>().map_err(|_| "write a size like 8G or 500M")? * unit;
    if (1.0..1e18).contains(&bytes) { Ok(bytes as u64) } else { Err("write a size like 8G or 500M".into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_taken_as_people_and_batch_systems_write_them() {
        for (text, seconds) in [
            ("600", 600.0),
            ("0.3s", 0.3),
            ("90s", 90.0),
            ("90m", 5400.0),
            ("1h30m", 5400.0),
            ("1h30", 3630.0),
            ("2d", 172_800.0),
            ("1d2h3m4.5s", 93_784.5),
            ("1:30:00", 5400.0),
            ("48:00:00", 172_800.0),
            ("90:00", 5400.0),
            ("00:01.5", 1.5),
            ("1-12", 129_600.0),
            ("1-12:30", 131_400.0),
            ("01-12:30:15", 131_415.0),
        ] {
            assert_eq!(duration(text), Ok(Duration::from_secs_f64(seconds)), "{text}");
        }
        for wrong in [
            "",
            "soon",
            "-3h",
            "0",
            "3x",
            "1:",
            ":30",
            "1::2",
            "1:2:3:4",
            "1-",
            "-1",
            "1-2-3",
            "1.5:00:00",
            "1e3",
            "+5",
            "h",
            "1-1:+2",
            "0:00",
            "é",
            "3é",
            "nan",
            "1e400",
            "99999999999999999999d",
        ] {
            assert_eq!(duration(wrong), Err(TIMES.to_owned()), "{wrong}");
        }
    }
}
