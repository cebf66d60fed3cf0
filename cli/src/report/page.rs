//! What pages are made of.

use super::chart::Chart;

/// Text as HTML.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c if c.is_control() && c != '\n' && c != '\t' => out.push(char::REPLACEMENT_CHARACTER),
            c => out.push(c),
        }
    }
    out
}

/// How every page begins, and nobody else's.
pub const MARK: &str = "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
    <meta name=\"generator\" content=\"seixo\">\n";

/// A page that holds everything and fetches nothing: its title as text, what stands under it and its sections as HTML.
pub fn html(title: &str, head: &str, sections: &[String], script: &str) -> String {
    let title = escape(title);
    let script = if script.is_empty() { String::new() } else { format!("<script>\n{script}</script>\n") };
    format!(
        "{MARK}<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; \
         style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n\
         <title>{title} - seixo</title>\n<style>\n{}</style>\n</head>\n<body>\n\
         <header><h1>{title}</h1>{head}</header>\n<main>\n{}</main>\n\
         <footer><p class=\"faint\">Made by seixo {}. The page holds everything and fetches nothing.</p></footer>\n\
         {script}</body>\n</html>\n",
        include_str!("page.css"),
        sections.concat(),
        env!("CARGO_PKG_VERSION"),
    )
}

/// A section with its heading; nothing if nothing is inside.
pub fn section(id: &str, title: &str, inside: &str) -> String {
    if inside.is_empty() {
        return String::new();
    }
    format!("<section aria-labelledby=\"{id}\">\n<h2 id=\"{id}\">{title}</h2>\n{inside}</section>\n")
}

/// Charts side by side; those of nothing are left out.
pub fn charts(charts: &[Chart]) -> String {
    let figures: String = charts.iter().map(Chart::figure).collect();
    if figures.is_empty() { figures } else { format!("<div class=\"charts\">\n{figures}</div>\n") }
}

/// What is said of `count` things with curves in `file`, of which a page shows no more than `shown`.
pub fn rest(count: usize, shown: usize, file: &str) -> String {
    match count.saturating_sub(shown) {
        0 => String::new(),
        more => format!("<p class=\"faint\">{more} more in {file}.</p>\n"),
    }
}

/// Letters of a cell that is not broken.
const LONGEST_NUMBER: usize = 14;

/// A table of texts; the first row is its head.
pub fn table(rows: &[Vec<String>]) -> String {
    let Some((head, rows)) = rows.split_first().filter(|(_, rows)| !rows.is_empty()) else {
        return String::new();
    };
    let cells = |row: &[String], of: &str| -> String {
        row.iter().map(|cell| format!("<{of}>{}</{}>", escape(cell), &of[..2])).collect()
    };
    // Numbers stay whole on a narrow page, words need not.
    let cell = |cell: &String| {
        let class = if cell.chars().count() > LONGEST_NUMBER { " class=\"words\"" } else { "" };
        format!("<td{class}>{}</td>", escape(cell))
    };
    let row = |row: &Vec<String>| format!("<tr>{}</tr>\n", row.iter().map(cell).collect::<String>());
    let body: String = rows.iter().map(row).collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\"><table>\n<thead><tr>{}</tr></thead>\n<tbody>\n{body}</tbody></table></div>\n",
        cells(head, "th scope=\"col\"")
    )
}
