//! How wide a terminal is, and text that fits it.

use terminal_size::{Width, terminal_size_of};

/// Columns of the terminal that stdout is; nothing if it is none.
pub fn of_stdout() -> Option<usize> {
    terminal_size_of(std::io::stdout()).map(|(Width(columns), _)| columns.into())
}

/// Columns of the terminal that stderr is; nothing if it is none.
pub fn of_stderr() -> Option<usize> {
    terminal_size_of(std::io::stderr()).map(|(Width(columns), _)| columns.into())
}

/// Narrowest terminal that lines are broken for.
const NARROWEST: usize = 40;

/// The lines of `text`, those of more than `width` letters broken between words; what goes on is set in by four.
pub fn wrapped(text: &str, width: usize) -> String {
    let lines = text.lines().map(|line| broken(line, width.max(NARROWEST)));
    lines.collect::<Vec<_>>().join("\n")
}

fn broken(line: &str, width: usize) -> String {
    let indent = line.chars().take_while(|&c| c == ' ').count();
    let (mut done, mut rest, mut before) = (String::new(), line.to_owned(), 0);
    while rest.chars().count() > width {
        let end = rest.char_indices().nth(width).map_or(rest.len(), |(at, _)| at);
        // A break within the indent would make no way.
        let Some(at) = rest[..=end.min(rest.len() - 1)].rfind(' ').filter(|&at| at > before) else { break };
        done.push_str(rest[..at].trim_end());
        done.push('\n');
        before = indent + 4;
        rest = format!("{}{}", " ".repeat(before), rest[at..].trim_start());
    }
    done + &rest
}

/// As many of `fields` as fit into `width` letters with two blanks between: the first ones, each whole.
pub fn fitting(fields: &[String], width: usize) -> String {
    let mut line = String::new();
    for field in fields {
        let more = if line.is_empty() { field.clone() } else { format!("{line}  {field}") };
        if more.chars().count() > width && !line.is_empty() {
            break;
        }
        line = more;
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_break_between_words_and_fields_stay_whole() {
        let text = "advice\n  time step: typed 1.000e-3 s; the flow allows 8.8e-4 s, the sound 1.4e-3 s";
        let told = wrapped(text, 50);
        assert!(told.lines().all(|l| l.chars().count() <= 50), "{told}");
        assert_eq!(told.split_whitespace().collect::<String>(), text.split_whitespace().collect::<String>());
        assert!(told.lines().nth(2).is_some_and(|l| l.starts_with("      ")), "{told}");
        let long = "x".repeat(90);
        assert_eq!(wrapped(&long, 50), long);
        let fields: Vec<String> = ["ETA 00:00:10", "t=0.123 s", "step 17"].map(String::from).to_vec();
        assert_eq!(fitting(&fields, 80), "ETA 00:00:10  t=0.123 s  step 17");
        assert_eq!(fitting(&fields, 25), "ETA 00:00:10  t=0.123 s");
        assert_eq!(fitting(&fields, 3), "ETA 00:00:10");
    }
}
