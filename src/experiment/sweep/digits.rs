//! Rounding of numbers for pages.

/// Table for a page: with words as titles and measurements rounded to few digits; `results.csv`
/// keeps all digits.
pub(in super::super) fn shortened(table: &[Vec<String>]) -> Vec<Vec<String>> {
    let Some((titles, rows)) = table.split_first() else {
        return Vec::new();
    };
    let from = titles.iter().position(|title| title == "ms").unwrap_or(0);
    let cell = |(index, cell): (usize, &String)| match cell.parse() {
        Ok(value) if index >= from && cell.contains('.') => significant(value),
        _ => cell.clone(),
    };
    let row = |row: &Vec<String>| row.iter().enumerate().map(cell).collect();
    let titles = titles.iter().map(|title| title.replace('_', " "));
    [titles.collect()]
        .into_iter()
        .chain(rows.iter().map(row))
        .collect()
}

/// Formats a number with three significant digits.
pub(in super::super) fn significant(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if (0.01..1000.0).contains(&size) {
        let digits = (2 - size.log10().floor() as i32).max(0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.2e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_has_three_digits_of_what_was_measured_and_settings_as_they_are() {
        let row = |cells: &[&str]| cells.iter().map(|&cell| cell.to_owned()).collect();
        let table: [Vec<String>; 2] = [
            row(&[
                "method", "setting", "ms", "ms_least", "work", "substeps", "failed",
            ]),
            row(&[
                "a", "0.12345", "23.4567", "0.012345", "1.2346e4", "12345", "",
            ]),
        ];
        let shown = shortened(&table);
        assert_eq!(shown[0][3], "ms least");
        let cells = ["a", "0.12345", "23.5", "0.0123", "1.23e4", "12345", ""];
        assert_eq!(shown[1], cells);
        assert_eq!(significant(0.0), "0");
    }
}
