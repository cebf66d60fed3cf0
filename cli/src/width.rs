//! How wide a terminal is, and fields that fit it.

use terminal_size::{Width, terminal_size_of};

/// Columns of the terminal that stdout is; nothing if it is none.
pub fn of_stdout() -> Option<usize> {
    terminal_size_of(std::io::stdout()).map(|(Width(columns), _)| columns.into())
}

/// Columns of the terminal that stderr is; nothing if it is none.
pub fn of_stderr() -> Option<usize> {
    terminal_size_of(std::io::stderr()).map(|(Width(columns), _)| columns.into())
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
    fn fields_stay_whole() {
        let fields: Vec<String> = ["ETA 00:00:10", "t=0.123 s", "step 17"].map(String::from).to_vec();
        assert_eq!(fitting(&fields, 80), "ETA 00:00:10  t=0.123 s  step 17");
        assert_eq!(fitting(&fields, 25), "ETA 00:00:10  t=0.123 s");
        assert_eq!(fitting(&fields, 3), "ETA 00:00:10");
    }
}
